"""Corrected columns together with references, single pixels and a lamp that drifts or does not."""

from dataclasses import replace

import numpy as np
import pytest
from benches import STRAIN_OPTIC, drawing, findings, held_out, lit, seen_by
from scipy.linalg import eigh

from benches import presses, shots  # isort: skip


import fringeforce as ff
from fringeforce.estimation.frame_exposure import expose
from fringeforce.estimation.frame_loss import Prior
from fringeforce.reading.strip_reader import StripFrameReader

pytestmark = pytest.mark.slow

GAIN, DARK = 0.02, 0.7


@pytest.fixture(scope="module")
def true() -> ff.SensorModel:
    """A bench whose columns are 3 % off any design, and whose pixels differ."""
    made = ff.characterize(drawing().replace(**{STRAIN_OPTIC: 0.054}))
    rng, x = np.random.default_rng(61), made.x / made.sensor.transducer.length
    waves = rng.normal(size=(4, *made.psi.shape[1:])) * 0.03 / np.sqrt(2)
    bends = np.array([np.cos(7 * x), np.sin(7 * x), np.cos(16 * x), np.sin(16 * x)])
    wrong = replace(made, psi=made.psi * (1 + np.einsum("kx,knc->xnc", bends, waves)))
    return lit(wrong, rng, pattern=1.0)


def calibrated(true: ff.SensorModel, gain: float, dark: float, columns: bool) -> ff.SensorModel:
    rng = np.random.default_rng(62)
    forces = presses(rng, 16)
    gains, darks = gain * rng.standard_normal(len(forces)), dark * rng.standard_normal(len(forces))
    still = np.zeros((40, *forces.shape[1:]))
    references = ff.References(unloaded=shots(true, still, rng))
    frames = shots(true, forces, rng, gains, darks)
    return ff.calibrate(
        drawing(), frames, forces, [STRAIN_OPTIC], references=references, columns=columns
    )


@pytest.fixture(scope="module")
def steady(true: ff.SensorModel) -> ff.SensorModel:
    return calibrated(true, 0.0, 0.0, columns=True)


def test_a_wrong_matrix_is_not_taken_for_a_drifting_lamp(true, steady, cause_not_asked) -> None:
    assert seen_by(calibrated(true, 0.0, 0.0, columns=False)).drift != (0.0, 0.0)
    assert seen_by(steady).drift == (0.0, 0.0)
    assert findings(steady).chi2 == pytest.approx(1, abs=0.04)
    assert findings(steady).outliers == ()
    found = held_out(steady, true, np.random.default_rng(63), 60)
    assert found.efficiency < 1.3
    assert 0.92 < found.coverage < 0.98
    assert found.read > 0.95


def test_columns_are_corrected_under_a_lamp_that_drifts(true) -> None:
    model = calibrated(true, GAIN, DARK, columns=True)
    assert seen_by(model).drift == pytest.approx((GAIN, DARK), rel=0.4)
    found = held_out(model, true, np.random.default_rng(64), gain=GAIN, offset=DARK)
    assert found.efficiency < 1.6
    assert found.coverage > 0.92
    assert found.read > 0.85


def test_followed_frames_say_the_same_as_searched_ones(true, steady) -> None:
    still, alike = np.repeat(ff.polar(1.5, 8, n=11)[None], 4, axis=0), 0
    for seed in range(65, 73):
        frames = shots(true, still, np.random.default_rng(seed))
        reader = ff.Reader(steady)
        readings = list(reader.stream(frames))
        assert all(reading.tracked for reading in readings[1:])
        reading, alone = readings[-1], reader.search(frames[-1])
        apart = (reading.forces - alone.forces).ravel()
        assert np.sqrt(apart @ np.linalg.solve(reading.covariance, apart)) < 0.1
        # variances of all sums of loads, over those of the searched frame
        shares = eigh(reading.covariance, alone.covariance, eigvals_only=True)
        alike += bool(np.abs(shares - 1).max() < 0.02)
    # a misfit that noise causes in 5 of 100 frames widens a searched one
    assert alike >= 5


@pytest.mark.parametrize("size", [0.5, 2.0])
def test_what_a_calibration_leaves_moves_loads_as_every_pixel_says(steady, size) -> None:
    """Against least squares of loads, gain and offset of the frame on all pixels."""
    single, imaging, response = StripFrameReader(steady), steady.imaging, steady.response
    used, loads = single.usable(None), ff.polar(size, 8, n=11).ravel()
    assert single.calibration_uncertainty is not None
    assert imaging is not None
    assert imaging.lens_modes is not None
    model = single.uncertain.frame
    phase = single.influence @ loads
    light = response.amplitude * response.brightness(phase)
    slopes = [*(response.slope(phase)[:, None] * single.influence).T]
    gain, offset = imaging.drift
    slopes += [gain * light] * bool(gain) + [np.full_like(light, offset)] * bool(offset)
    seen = np.array(slopes)[:, used] / np.sqrt(response.at(used).variance)
    unknowns = np.zeros(model.at.size)
    unknowns[:22] = loads

    def change(name: str, step: float) -> np.ndarray:
        ahead, behind = (
            expose(model._replace(**{name: getattr(model, name) + by}), unknowns)[0]
            for by in (step, -step)
        )
        return (ahead - behind) / (2 * step)

    pixel = steady.sensor.transducer.length / steady.sensor.camera.pixels
    lens = np.stack([change("blur", model.blur / 4) / pixel, change("gamma", 1e-4)])
    modes = imaging.level_modes(loads, phase) + imaging.lens_modes @ lens
    modes = modes[:, used] / np.sqrt(response.at(used).variance)
    known = seen @ seen.T + np.eye(len(seen))
    moved = np.linalg.solve(known, seen @ modes.T)[:22]
    prior = Prior(np.zeros(model.at.size), np.ones(model.at.size), -1.0, 1e6)
    found = single.calibration_uncertainty.covariance(model, prior, unknowns, used)
    scale = np.sqrt(np.diag(np.linalg.inv(known)[:22, :22] + moved @ moved.T))
    assert (np.abs(found - moved @ moved.T) < 0.02 * np.outer(scale, scale)).all()
