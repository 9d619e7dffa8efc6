"""What the page of a strip is told of a load that is held on layers that creep."""

from pathlib import Path

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.base.errors import DesignError, InputError
from fringeforce.explorer.creep import STEPS, moments, over_time
from fringeforce.explorer.protocol import CreepRequest, DesignRequest, encoded, request
from fringeforce.explorer.solution import facts
from fringeforce.explorer.tasks import Answer, stored

SHARE, TIME = 0.1, 2.0
HELD = slice(1, STEPS + 2)
"""Moments of the hold; those behind the release follow."""
GONE = slice(STEPS + 2, None)
FORCES = ff.polar(1.0, 10, n=3)


@pytest.fixture(scope="module")
def short() -> ff.Sensor:
    """A short strip of three tactels under a small camera, whose layers relax alike."""
    return ff.load_sensor("saad").replace(
        transducer={"length": "9 mm", "relaxation": [[f"{SHARE:.0%}", f"{TIME} s"]]},
        tactels={"count": 3, "pitch": "1.5 mm"},
        camera={"pixels": 512},
    )


def _asked(sensor: ff.Sensor, folder: Path, held: float = 0.0) -> Answer:
    wish = CreepRequest(type="creep", id=1, design=1, forces=FORCES.tolist(), held=held)
    return over_time(stored(ff.characterize(sensor), str(folder)), wish)


def test_light_follows_the_standard_linear_solid(short: ff.Sensor, tmp_path: Path) -> None:
    """Of one term g, tau: retardation by g / (1 - g) in tau / (1 - g), and superposition.

    N. W. Tschoegl, The Phenomenological Theory of Linear Viscoelastic Behavior, 1989.
    """
    told, blocks = _asked(short, tmp_path, held=7.0)
    first, late = told["first"], TIME / (1 - SHARE)

    def crept(since: np.ndarray) -> np.ndarray:
        """Behind a ramp as long as the first moment, which ended so long ago."""
        mean = -np.expm1(-first / late) * late / first
        return SHARE / (1 - SHARE) * (1 - mean * np.exp(-since / late))

    times = blocks["times"]
    pressed = times - first
    ratio = 1 + crept(pressed[HELD])
    left = crept(pressed[GONE]) - crept(pressed[GONE] - 7.0 - first)
    at_once = ff.characterize(short).phase(FORCES)
    expected = np.concatenate([[0.0], ratio, left])[:, None] * at_once
    np.testing.assert_allclose(blocks["phase"], expected, atol=1e-9)


def test_moments_run_evenly_on_the_logarithm_from_press_and_release() -> None:
    times, acts = moments(0.1, 100.0)
    assert (np.diff(times) > 0).all()
    np.testing.assert_array_equal(acts[HELD], 1.0)
    np.testing.assert_array_equal(acts[GONE], 0.0)
    for part in (times[HELD], times[GONE]):
        steps = np.diff(np.log(part[1:] - part[0]))
        np.testing.assert_allclose(steps, np.log(1000.0) / (STEPS - 1))


def test_readings_know_of_creep_or_take_it_for_forces(short: ff.Sensor, tmp_path: Path) -> None:
    told, blocks = _asked(short, tmp_path)
    assert told["held"] == pytest.approx(4 * TIME)
    load = FORCES.sum(axis=0)
    np.testing.assert_allclose(blocks["true"][HELD], np.broadcast_to(load, (STEPS + 1, 2)))
    # four retardation times, of which 1 / (1 - g) is the end
    after = 1 + SHARE / (1 - SHARE) * (1 - np.exp(-4 * (1 - SHARE)))
    assert blocks["without_read"][STEPS + 1, 0] / load[0] == pytest.approx(after, rel=0.01)
    misses = (blocks["with_read"] - blocks["true"])[HELD] / blocks["with_std"][HELD]
    # 41 frames of two forces beyond five deviations: 5e-5
    assert np.abs(misses).max() < 5
    assert set(told["status"]["with"][STEPS + 2 :]) <= {"NO_CONTACT", "AMBIGUOUS"}
    assert told["status"]["without"][STEPS + 2] not in ("NO_CONTACT", "BAD_FRAME")


def test_layers_that_relax_unlike_end_as_the_strip_of_their_relaxed_moduli(
    short: ff.Sensor, tmp_path: Path
) -> None:
    cover = short.replace(
        **{"transducer.relaxation": [], "transducer.compliant.relaxation": [["50 %", "2 s"]]}
    )
    _, blocks = _asked(cover, tmp_path, held=1e3)
    modulus = cover.transducer.compliant.youngs_modulus
    relaxed = ff.characterize(short.replace(**{"transducer.compliant.youngs_modulus": modulus / 2}))
    np.testing.assert_allclose(blocks["phase"][STEPS + 1], relaxed.phase(FORCES), atol=5e-3)


def test_what_cannot_be_shown_is_refused(short: ff.Sensor, tmp_path: Path) -> None:
    still = short.replace(**{"transducer.relaxation": []})
    assert facts(ff.characterize(short))["creeps"]
    assert not facts(ff.characterize(still))["creeps"]
    with pytest.raises(InputError, match="give it a relaxation"):
        _asked(still, tmp_path)
    with pytest.raises(InputError, match=r"more than 0\.4 s"):
        _asked(short, tmp_path, held=0.3)


def test_a_page_may_state_terms_and_hears_of_wrong_ones(short: ff.Sensor) -> None:
    terms = [{"share": "6 %", "time": "0.4 s"}, {"share": 0.04, "time": "15 s"}]
    changes = {"transducer.relaxation": terms}
    wish = request(encoded({"type": "design", "id": 1, "changes": changes}))
    assert isinstance(wish, DesignRequest)
    stated = short.replace(**wish.changes).transducer.relaxation
    assert [(one.share, one.time) for one in stated] == [(0.06, 0.4), (0.04, 15.0)]
    with pytest.raises(DesignError, match=r"transducer\.relaxation\.0\.time = 'soon'"):
        short.replace(**{"transducer.relaxation": [{"share": "6 %", "time": "soon"}]})
    endless = {"transducer.relaxation": [terms[0]] * 9}
    with pytest.raises(InputError, match="cannot use changes"):
        request(encoded({"type": "design", "id": 1, "changes": endless}))
