"""Few contacts on a strip: what noise makes of the other tactels does not make them ambiguous."""

import numpy as np
import pytest
from exact_frames import Bench, drawing
from scipy.stats import chi2

import fringeforce as ff

FRAMES = 80


def one(rng: np.random.Generator) -> np.ndarray:
    normal = np.zeros(11)
    normal[rng.integers(11)] = rng.uniform(1, 4)
    return normal


def two(rng: np.random.Generator) -> np.ndarray:
    normal = np.zeros(11)
    normal[rng.choice(11, 2, replace=False)] = rng.uniform(1, 4), rng.uniform(0.03, 0.3)
    return normal


def finger(rng: np.random.Generator) -> np.ndarray:
    """A smooth pressure whose edges press hardly at all."""
    across = (np.arange(11) - rng.uniform(0, 10)) / rng.uniform(1, 3)
    return rng.uniform(0.5, 2) * np.maximum(1 - across**2, 0)


@pytest.mark.parametrize("contacts", [one, two, finger])
def test_few_contacts_are_read_as_ok_and_lie_within_their_covariance(contacts) -> None:
    """Frames of the exact series against the chi-square distribution of squared distances."""
    sensor, rng, squares = drawing(), np.random.default_rng(21), []
    bench = Bench(sensor, sensor.tactels.positions, np.full(11, 1e-7))
    normal = np.array([contacts(rng) for _ in range(FRAMES)])
    forces = np.stack([normal, normal * rng.uniform(-0.5, 0.5, (FRAMES, 11))], axis=2)
    reader = ff.Reader(ff.characterize(sensor))
    for frame, true in zip(bench.frames(forces, rng), forces, strict=True):
        reading = reader.search(frame)
        explained = np.concatenate([reading.forces[None], reading.alternatives]) - true
        assert (np.abs(explained) < 6 * reading.std).all(axis=(1, 2)).any()
        if reading.status is ff.Status.OK:
            off = (reading.forces - true).ravel()
            squares.append(off @ np.linalg.solve(reading.covariance, off))
    assert len(squares) > 0.8 * FRAMES
    assert max(squares) < chi2.isf(1e-4 / FRAMES, 22)


def test_shear_that_nothing_presses_is_read_all_the_same() -> None:
    """Friction is likely, not certain: two pictures in quadrature tell pure shear."""
    sensor = ff.load_sensor("saad").replace(**{"polariscope.channels": [{}, {"bias": 90}]})
    model, shear = ff.characterize(sensor), np.zeros((11, 2))
    shear[[2, 7], 1] = 0.4, -0.6
    reading = ff.Reader(model).search(model.expose(shear, rng=1))
    assert reading.status is ff.Status.OK
    assert (np.abs(reading.forces - shear) < 6 * reading.std).all()
