"""Faint touches, whose light hardly tells a phase from its mirror image."""

import numpy as np
from scipy.stats import chi2

import fringeforce as ff

FRAMES = 200


def test_what_is_read_as_ok_under_faint_loads_lies_within_its_covariance() -> None:
    """Against the chi-square distribution of squared Mahalanobis distances from the truth."""
    model = ff.characterize(ff.load_sensor("saad"))
    reader, rng, squares = ff.Reader(model), np.random.default_rng(7), []
    for _ in range(FRAMES):
        normal = rng.uniform(0.05, 1, 11) * (rng.permutation(11) < rng.integers(1, 12))
        forces = np.stack([normal, normal * rng.uniform(-0.5, 0.5, 11)], axis=1)
        forces *= rng.uniform(0.3, 1.5) / np.abs(model.phase(forces)).max()
        reading = reader.search(model.expose(forces, rng))
        if reading.ok:
            off = (reading.forces - forces).ravel()
            squares.append(off @ np.linalg.solve(reading.covariance, off))
    assert len(squares) > FRAMES / 2
    # one frame in ten thousand, of all together
    assert max(squares) < chi2.isf(1e-4 / FRAMES, 22)
    assert 0.85 < np.mean(squares) / 22 < 1.15


def test_no_lobe_of_a_soft_cover_under_faint_touches_is_read_with_the_wrong_sign() -> None:
    """Of one or two tactels that cover a few lobes each: light tells hardly the sign of any.

    By the same distances as above; each frame takes ten times as long.
    """
    model = ff.characterize(ff.load_sensor("soft-sixteen"))
    reader, rng, squares = ff.Reader(model), np.random.default_rng(7), []
    for _ in range(FRAMES // 3):
        touched = rng.permutation(16) < rng.integers(1, 3)
        normal = rng.uniform(0.05, 1, 16) * touched
        forces = np.stack([normal, normal * rng.uniform(-0.8, 0.8, 16)], axis=1)
        forces *= rng.uniform(0.2, 1.0) / np.abs(model.phase(forces)).max()
        reading = reader.search(model.expose(forces, rng))
        if reading.ok:
            off = (reading.forces - forces).ravel()
            squares.append(off @ np.linalg.solve(reading.covariance, off))
    assert len(squares) > FRAMES / 9
    assert max(squares) < chi2.isf(3e-4 / FRAMES, 32)


def test_faint_touches_that_are_followed_lie_within_their_covariance() -> None:
    """Of touches that fade by a sixtieth in each frame, as creep lets them."""
    light = {"camera.noise_model": "gaussian", "camera.noise": 1.0, "camera.pixels": 1024}
    model = ff.characterize(ff.load_sensor("saad").replace(**light))
    reader, rng, squares = ff.Reader(model), np.random.default_rng(7), []
    shares = np.exp(-np.arange(24) / 60)[:, None, None]
    for peak in np.repeat([0.07, 0.1, 0.15], 6):
        normal = peak * np.exp(-np.square((np.arange(11) - 5) / 1.5))
        forces = shares * np.stack([normal, np.zeros(11)], axis=1)
        reader.reset()
        batch = reader.read_on(model.expose(forces, rng), covariance=True)
        assert batch.covariance is not None
        for row, status in enumerate(batch.status):
            if status is ff.Status.OK:
                off = (batch.forces[row] - forces[row]).ravel()
                squares.append(off @ np.linalg.solve(batch.covariance[row], off))
    assert len(squares) > 200
    assert max(squares) < chi2.isf(1e-4 / len(squares), 22)
    assert np.mean(squares) / 22 < 1.15
