"""Departures that contacts on a skin hide from the residual test, shown one by one beside them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from chi_squares import expect_chi_squares
from scipy.stats import binom

import fringeforce as ff
from fringeforce.reading.findings import Sized
from fringeforce.reading.skin_departure_test import SkinDepartureTest
from fringeforce.reading.skin_fit import Explanation
from fringeforce.reading.skin_reader import SkinReader

DRAWING = ff.load_sensor("skin").replace(**{"transducer.edges": "roller"})
PIXEL = DRAWING.transducer.length / DRAWING.camera.pixels
FRAMES, SHOWN, RARE = 30, 0.25, 0.05
"""Frames with a departure, the share of them that it shows in, and the chance that fewer do."""


@pytest.fixture(scope="module")
def single() -> SkinReader:
    """Of a strip with roller edges, whose frames come from the exact series."""
    return SkinReader(ff.characterize(DRAWING))


def presses(rng: np.random.Generator) -> list[ff.Press]:
    """Two cylinders, or patches of any pressure, three millimetres apart."""
    place, profile = rng.uniform(-5e-3, 2e-3), rng.choice(["hertz", "flat", "cylinder"])
    found = list[ff.Press]()
    for x in (place, place + 3e-3):
        force = float(np.exp(rng.uniform(*np.log([0.5, 4.0]))))
        shape: dict[str, Any] = {"width": rng.uniform(0.3e-3, 1.2e-3), "profile": profile}
        if profile == "cylinder":
            shape = {"radius": rng.uniform(1e-3, 8e-3), "friction": 0.6}
        shear = float(rng.uniform(-0.5, 0.5)) * force
        found.append(ff.Press(x=float(x), normal=force, tangential=shear, **shape))
    return found


def departed(model: ff.SensorModel, changes: dict[str, Any]) -> ff.SensorModel:
    """The same strip, which is not as drawn; the light of presses needs no influence matrix."""
    return replace(model, sensor=model.sensor.replace(**changes))


@pytest.mark.slow
def test_squares_of_frames_as_drawn_are_chi_square(single: SkinReader) -> None:
    test = single._departures
    told = []
    for number in range(40):
        rng = np.random.default_rng([11, number])
        levels = single.model.expose(presses(rng), rng=rng)
        reading, one = single.followed(levels, single.usable(None), None)
        assert reading.ok
        assert one is not None
        told.append(test.scores(one))
    expect_chi_squares(told)


@pytest.mark.parametrize(
    ("path", "value", "size"),
    [
        ("camera.amplitude", 245 * 0.995, -0.005),
        ("camera.blur", 4 * PIXEL, 4 * PIXEL),
        ("camera.gamma", 1.015, 0.015),
    ],
)
def test_frames_that_contacts_explain_are_refused_by_name(
    single: SkinReader, monkeypatch: pytest.MonkeyPatch, path: str, value: float, size: float
) -> None:
    made, told = departed(single.model, {path: value}), SkinDepartureTest.shown
    heard = list[list[Sized]]()

    def recorded(test: SkinDepartureTest, one: Explanation) -> list[Sized]:
        heard.append(told(test, one))
        return heard[-1]

    monkeypatch.setattr(SkinDepartureTest, "shown", recorded)
    shown = list[tuple[str, float]]()
    for number in range(FRAMES):
        rng = np.random.default_rng([12, number])
        reading = single.read(made.expose(presses(rng), rng=rng))
        if not reading.findings:
            continue
        assert reading.status is ff.Status.MODEL_MISMATCH
        found = heard[-1][0]
        shown.append((found.departure.path, found.size))
    right = [own for name, own in shown if name == path]
    assert len(right) > binom.ppf(RARE, FRAMES, SHOWN)
    assert len(right) > 0.7 * len(shown)
    assert np.median(right) == pytest.approx(size, rel=0.3)


def test_what_the_design_allows_for_is_fitted_in_place_of_being_tested() -> None:
    sensor = DRAWING.replace(**{"camera.amplitude": "245 +/- 3 %"})
    single = SkinReader(model := ff.characterize(sensor))
    tested = [one.path for one in single._departures.tested]
    assert "camera.gamma" in tested
    assert "camera.amplitude" not in tested
    made, right = departed(model, {"camera.amplitude": 245 * 0.98}), 0
    for number in range(6):
        rng = np.random.default_rng([13, number])
        right += single.read(made.expose(presses(rng), rng=rng)).ok
    assert right >= 5


@pytest.mark.slow
def test_what_shows_when_contacts_press_harder_is_refused_where_frames_follow(
    single: SkinReader,
) -> None:
    """Faint contacts hide a blur of three pixels; strong ones show it."""
    rows = [
        [
            ff.Press(x=-2e-3, normal=float(share), tangential=0.3 * float(share), width=0.9e-3),
            ff.Press(x=1.5e-3, normal=0.7 * float(share), width=0.7e-3),
        ]
        for share in np.interp(np.arange(52), [0, 16, 46], [0.8, 0.8, 3.5])
    ]
    reader = ff.Reader(single.model)
    as_drawn = reader.read_on(single.model.expose(rows, rng=14))
    assert as_drawn.tracked.mean() > 0.9
    assert all(status is ff.Status.OK for status in as_drawn.status)
    reader.reset()
    blurred = departed(single.model, {"camera.blur": 3 * PIXEL})
    departing = reader.read_on(blurred.expose(rows, rng=14))
    assert all(status is ff.Status.OK for status in departing.status[:16])
    assert ff.Status.MODEL_MISMATCH in departing.status[16:]
