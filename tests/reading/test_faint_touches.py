"""Faint touches, whose light hardly tells a phase from its mirror image."""

import numpy as np
from scipy.stats import chi2

import fringeforce as ff

FRAMES = 300


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
