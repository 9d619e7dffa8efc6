"""Covariances that hold explanations of little weight, against the normal distribution."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.stats import chi2, special_ortho_group

import fringeforce as ff
from fringeforce.estimation.hypotheses import CONFIDENCE
from fringeforce.reading.strip_explanations import held, not_too_wide

SIZE, RARE, DRAWS, FRAMES = 22, 1e-4, 20_000, 200


def normal(rng: np.random.Generator) -> np.ndarray:
    """A covariance whose deviations differ by a hundred."""
    turned = special_ortho_group.rvs(SIZE, random_state=rng)
    return turned @ np.diag(np.logspace(-4, 0, SIZE)) @ turned.T


def beside(rng: np.random.Generator, covariance: np.ndarray, far: float) -> np.ndarray:
    """Loads so many deviations off, root mean square over them."""
    way = rng.standard_normal(SIZE)
    way *= far * np.sqrt(SIZE) / np.linalg.norm(way)
    return np.linalg.cholesky(covariance) @ way


@pytest.mark.parametrize("far", [1.5, 1.9])
def test_what_is_held_lies_within_what_the_covariance_allows(far: float) -> None:
    """The mean square of draws is the square of their mean, n, and the trace of at most n ones."""
    rng = np.random.default_rng()
    own, weight = normal(rng), 0.003
    other = beside(rng, own, far)
    drawn = rng.multivariate_normal(other, own, DRAWS)
    mean, covariance = held(np.array([1 - weight, weight]), np.array([np.zeros(SIZE), other]), own)
    off = drawn - mean
    square = (off * np.linalg.solve(covariance, off.T).T).sum(axis=1)
    assert square.mean() < 2 * SIZE
    moments = own + weight * (1 - weight) * np.outer(other, other)
    square = (off * np.linalg.solve(moments, off.T).T).sum(axis=1)
    assert square.mean() > 2 * SIZE  # the second moments do not hold it
    # wider in one direction alone, as far as the other is off, and in no other
    grown = eigh(covariance, moments, eigvals_only=True)
    np.testing.assert_allclose(grown[:-1], 1, rtol=1e-6)
    off = other - mean
    square = off @ np.linalg.solve(moments, off)
    np.testing.assert_allclose(grown[-1], square / SIZE, rtol=1e-6)
    assert not_too_wide(covariance, own)


def test_what_is_too_far_is_not_held() -> None:
    rng = np.random.default_rng()
    own = normal(rng)
    for far, holds in ((1.9, True), (2.1, False)):
        parts = np.array([np.zeros(SIZE), beside(rng, own, far)])
        assert not_too_wide(held(np.array([0.999, 0.001]), parts, own)[1], own) == (holds)


def test_near_explanations_of_little_weight_leave_a_reading_sure() -> None:
    """As sure as asked for, with deviations as much wider as that needs."""
    model = ff.characterize(ff.load_sensor("saad"))
    rng = np.random.default_rng(7)
    careless, careful = ff.Reader(model, confidence=0.01), ff.Reader(model)
    widened = 0
    for _ in range(FRAMES):
        pushed = rng.uniform(0.05, 1, 11) * (rng.permutation(11) < rng.integers(1, 12))
        forces = np.stack([pushed, pushed * rng.uniform(-0.5, 0.5, 11)], axis=1)
        forces *= rng.uniform(0.3, 1.5) / np.abs(model.phase(forces)).max()
        frame = model.expose(forces, rng)
        alone = careless.search(frame)
        if alone.probability >= CONFIDENCE or not (reading := careful.search(frame)).ok:
            continue
        widened += 1
        assert reading.probability >= CONFIDENCE > alone.probability
        assert len(reading.alternatives) < len(alone.alternatives)
        grown = eigh(reading.covariance, alone.covariance, eigvals_only=True)
        assert grown[-1] < 2.0**2 * (1 + 1e-9)
        off = (reading.forces - forces).ravel()
        assert chi2.sf(off @ np.linalg.solve(reading.covariance, off), SIZE) > RARE / FRAMES
    assert widened
