"""A strip under large strain that is not the one on the drawing, calibrated and read.

Frames are of elements of the sixth order and of light along straight lines through the deformed
strip; the calibration takes what strain adds from the fourth order.
"""

from dataclasses import replace

import numpy as np
import pytest
from benches import findings
from scipy.stats import chi2 as chi_square

import fringeforce as ff
from fringeforce.calibration.calibrate import PARAMETERS
from fringeforce.calibration.design_entries import varied
from fringeforce.calibration.strain_phase import FrameContacts, StrainPhases
from fringeforce.mechanics.finite_strain import finite_strip
from fringeforce.models.finite_strain import finite_press_phase, phase_of
from fringeforce.models.imaging import Imaging
from fringeforce.models.presses import press_phase

pytestmark = pytest.mark.slow

TRUE = np.array([1.06, 0.9, 1.04])
"""Values of `PARAMETERS` over those of the drawing."""
COUNT, LARGEST, PIXELS, FRAMES, READ = 3, 2.0, 256, 12, 6
IMPROBABLE = 1e-4


def drawing(strain: str, loads: str = "dead") -> ff.Sensor:
    return ff.load_sensor("saad").replace(
        **{
            "transducer.length": "9 mm",
            "transducer.strain": strain,
            "transducer.loads": loads,
            "tactels.count": COUNT,
            "tactels.contact_width": "0.5 mm",
            "camera.pixels": PIXELS,
            "camera.amplitude": 200.0,
            "camera.offset": 15.0,
        }
    )


@pytest.fixture(scope="module", params=["dead", "follower"])
def loads(request: pytest.FixtureRequest) -> str:
    return request.param


def made(loads: str) -> ff.SensorModel:
    """The sensor on the bench, under a camera that is shifted and light that is not as drawn."""
    sensor = drawing("finite", loads)
    drawn = {path: _value(sensor, path) for path in PARAMETERS}
    changed = sensor.replace(**{p: k * drawn[p] for p, k in zip(PARAMETERS, TRUE, strict=True)})
    light = np.full(PIXELS, 180.0), np.full(PIXELS, 18.0)
    imaging = Imaging.known(0.1e-3 + 1.004 * sensor.pixel_positions, *light)
    return replace(ff.characterize(changed), imaging=imaging)


def _value(sensor: ff.Sensor, path: str) -> float:
    found: object = sensor
    for part in path.split("."):
        found = getattr(found, part)
    assert isinstance(found, float)
    return found


def combined(rng: np.random.Generator, count: int) -> np.ndarray:
    size = rng.uniform(0, LARGEST, (count, COUNT))
    angle = np.radians(rng.uniform(-17, 17, size.shape))
    return np.stack([size * np.cos(angle), size * np.sin(angle)], axis=2)


@pytest.fixture(scope="module")
def bench(loads: str) -> tuple[ff.SensorModel, np.ndarray, np.ndarray, np.ndarray]:
    """The sensor, loads, their phases and frames: single loads, then random ones."""
    model, rng = made(loads), np.random.default_rng(4)
    unit = np.eye(2 * COUNT).reshape(2 * COUNT, COUNT, 2) * [1.5 * LARGEST, 0.75 * LARGEST]
    forces = np.concatenate([unit, combined(rng, FRAMES)])
    tactels = model.sensor.tactels
    widths = np.full(COUNT, tactels.contact_width)
    strip = finite_strip(model.sensor.transducer, tactels.positions, widths, order=6)
    x = model.pixel_positions
    phases = np.array([phase_of(model.sensor, strip, x, strip.solved(one)) for one in forces])
    return model, forces, phases, model.delivered(phases, rng=5)


KEPT = slice(0, -READ)
"""Frames that calibrate; the others are read."""


@pytest.fixture(scope="module")
def calibrated(bench, loads) -> ff.SensorModel:
    _, forces, _, frames = bench
    return ff.calibrate(drawing("finite", loads), frames[KEPT], forces[KEPT], aside=0)


def test_moduli_are_found_where_small_strain_is_far_off(
    calibrated, bench, loads, cause_not_asked
) -> None:
    _, forces, _, frames = bench
    plain = ff.calibrate(drawing("linear"), frames[KEPT], forces[KEPT], aside=0)
    own = slice(len(PARAMETERS))
    told = np.linalg.inv(findings(calibrated).covariance[own, own])  # by the same frames
    squares = []
    for found in (findings(calibrated), findings(plain)):
        error = np.log(found.values[own] / found.drawing[own] / TRUE)
        squares.append(error @ told @ error)
    chance = chi_square.isf(IMPROBABLE, len(PARAMETERS))
    assert squares[0] < chance
    # loads that follow the surface strain it less
    assert squares[1] > (100 if loads == "dead" else chance)
    assert findings(calibrated).usable
    assert not findings(calibrated).outliers


def test_the_phase_of_the_calibrated_strip_is_that_of_the_bench(calibrated, bench) -> None:
    model, forces, phases, _ = bench
    largest = int(np.abs(phases).max(axis=1).argmax())
    # beside the ends, where the stress of a bonded corner has no bound
    inside = np.abs(model.pixel_positions) < model.sensor.transducer.length / 2 - 0.5e-3
    peak = np.abs(phases[largest]).max()
    for strain, least, most in (("finite", 0.0, 3e-3), ("linear", 1e-2, 1.0)):
        found = calibrated.phase(forces[largest], model.pixel_positions[inside], strain=strain)
        assert least <= np.abs(found - phases[largest][inside]).max() / peak < most


def test_new_frames_are_read_within_their_deviations(calibrated, bench, tmp_path) -> None:
    _, forces, _, frames = bench
    calibrated.save(tmp_path / "model.h5")
    reader, total = ff.Reader(ff.load_model(tmp_path / "model.h5")), 0.0
    for frame, true in zip(frames[-READ:], forces[-READ:], strict=True):
        reading = reader.search(frame)
        assert reading.status is ff.Status.OK
        error = (reading.forces - true).ravel()
        total += error @ np.linalg.solve(reading.covariance, error)
    assert total < chi_square.isf(IMPROBABLE, READ * 2 * COUNT)


def test_drift_is_found_under_loads_of_large_strain(calibrated, bench) -> None:
    """Of the light, the residual and the camera's place; known loads are solved for."""
    model, _, _, _ = bench
    imaging = model.imaging
    place, light = 4e-5, 0.93
    residual = 0.12 * np.sin(np.linspace(0, 5, PIXELS) + 0.4)
    later = replace(
        model,
        imaging=replace(
            imaging, positions=imaging.positions + place, amplitude=imaging.amplitude * light
        ),
    )
    forces = combined(np.random.default_rng(8), 6)
    tactels, x = model.sensor.tactels, later.pixel_positions
    widths = np.full(COUNT, tactels.contact_width)
    strip = finite_strip(model.sensor.transducer, tactels.positions, widths, order=6)
    phases = np.array([phase_of(model.sensor, strip, x, strip.solved(one)) for one in forces])
    frames, middle = later.delivered(phases + residual, rng=9), np.abs(x) < 3e-3
    was, now = (one.imaging.amplitude[middle].mean() for one in (calibrated, later))
    for known in (None, forces):
        found = ff.update(calibrated, frames, loads=known)
        seen = found.imaging
        assert seen is not None
        assert findings(found).usable
        assert not findings(found).outliers
        assert np.abs((seen.positions - x)[middle].mean()) < 0.15 * place
        error = seen.amplitude[middle].mean() - now
        assert np.abs(error) < 0.15 * np.abs(was - now)
        if known is None:
            continue
        std = np.linalg.norm(seen.amplitude_modes[:, middle].mean(axis=1))
        assert np.abs(error) < 4 * std
        left = (seen.residual - residual)[middle]
        assert np.sqrt(np.square(left).mean()) < 0.05 * np.abs(residual).max()


def test_contacts_at_any_place_are_taken_from_their_own_elements() -> None:
    """Loads by place, beside tactels."""
    model, rng = made("follower"), np.random.default_rng(6)
    half = 2.5e-3
    presses = [
        [ff.Press(x=x, normal=n, tangential=t * n, width=0.5e-3, profile="flat")]
        for x, n, t in zip(
            rng.uniform(-half, half, 7), rng.uniform(1, 3, 7), rng.uniform(-0.3, 0.3, 7),
            strict=True,
        )
    ]  # fmt: skip
    phases = []
    for (one,) in presses:
        strip = finite_strip(model.sensor.transducer, [one.x], [0.5e-3], order=6, share=1 / 4)
        moved = strip.solved([[one.normal, one.tangential]])
        phases.append(phase_of(model.sensor, strip, model.pixel_positions, moved))
    frames = model.delivered(np.array(phases), rng=7)
    found = findings(ff.calibrate(drawing("finite", "follower"), frames, presses, aside=0))
    own = slice(len(PARAMETERS))
    error = np.log(found.values[own] / found.drawing[own] / TRUE)
    square = error @ np.linalg.solve(found.covariance[own, own], error)
    assert square < chi_square.isf(IMPROBABLE, len(PARAMETERS))
    assert not found.outliers


def test_slopes_by_the_design_are_those_of_the_contacts_that_were_found():
    """Contacts whose widths nobody knows begin half as wide as they are, and then are found."""
    changes = {"transducer.strain": "finite", "transducer.loads": "follower"}
    sensor = ff.load_sensor("skin").replace(**changes)
    paths, grid = ("transducer.compliant.youngs_modulus",), np.linspace(-3e-3, 3e-3, 200)
    place, force = np.array([4e-4]), np.array([[1.5, 0.3]])
    phases = StrainPhases.none(np.zeros(1), 1, len(grid))
    for width in (5e-4, 1e-3):
        contacts = [FrameContacts(place, np.array([width]), force)]
        phases = phases.about(sensor, paths, np.zeros(1), grid, contacts, near=1e-3)
    press = ff.Press(x=4e-4, normal=1.5, tangential=0.3, width=1e-3)

    def added(entry: float) -> np.ndarray:
        made = varied(sensor, paths, np.array([entry]))
        return finite_press_phase(made, grid, [press]) - press_phase(made, grid, [press])

    exact = (added(0.05) - added(-0.05)) / 0.1
    assert phases.added[1, 0] == pytest.approx(exact, abs=0.1 * np.abs(exact).max())
