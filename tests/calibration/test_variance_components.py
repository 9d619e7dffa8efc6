"""Sizes of what scatters: against the marginal density of frames that are linear, written out."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import multivariate_normal

from fringeforce.calibration.variance_components import Expanded, Scattering
from fringeforce.estimation.shared_fit import FrameTerms

FRAMES, SEEN, OWN, SHARED = 9, 8, 3, 5
SIZES = np.array([0.7, 2.0, 1.5])
"""True ones: of the first own unknown, of the two others, and of two shared ones."""
OWN_GROUP, SHARED_GROUP = np.array([0, 1, 1]), np.array([2, 2, -1, -1, -1])
STATED = np.array([1.0, 1.0, 0.8, 1.2, 0.5])
"""Deviations of the shared unknowns where the size is one or there is none."""
UNIT = np.array([1.0, 0.5, 2.0])
"""Of the own unknowns."""


class Linear:
    """Frames y = A u + B s + e, where u scatter about M w, w being the last shared unknown."""

    def __init__(self, rng: np.random.Generator, still: bool = False) -> None:
        self.own = rng.standard_normal((FRAMES, SEEN, OWN))
        self.shared = rng.standard_normal((FRAMES, SEEN, SHARED))
        self.moves = rng.standard_normal((FRAMES, OWN, 1))
        sizes = SIZES * [not still, 1, 1]
        shared = rng.standard_normal(SHARED) * self.deviations(sizes)[1]
        self.levels = np.array(
            [
                a @ (m @ shared[-1:] + rng.standard_normal(OWN) * self.deviations(sizes)[0])
                + b @ shared
                + rng.standard_normal(SEEN)
                for a, b, m in zip(self.own, self.shared, self.moves, strict=True)
            ]
        )

    def deviations(self, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of the own unknowns of a frame, and of the shared ones."""
        more = np.append(sizes, 1.0)
        return UNIT * more[OWN_GROUP], STATED * more[SHARED_GROUP]

    def loss(self, sizes: np.ndarray) -> float:
        """Twice the negative logarithm of the density of all levels."""
        own, shared = self.deviations(sizes)
        whole = np.concatenate(
            [
                b + np.pad(a @ m, [(0, 0), (SHARED - 1, 0)])
                for a, b, m in zip(self.own, self.shared, self.moves, strict=True)
            ]
        )
        covariance = whole * shared**2 @ whole.T + np.eye(FRAMES * SEEN)
        for f, a in enumerate(self.own):
            at = slice(f * SEEN, (f + 1) * SEEN)
            covariance[at, at] += a * own**2 @ a.T
        return -2 * float(multivariate_normal.logpdf(self.levels.ravel(), cov=covariance))

    def expanded(self, sizes: np.ndarray, rng: np.random.Generator) -> Expanded:
        """About some values, which are not the best."""
        deviations, known = self.deviations(sizes)
        precision, before = 1 / deviations**2, 1 / known**2
        shared, terms, scattering = rng.standard_normal(SHARED), [], []
        for a, b, m, y in zip(self.own, self.shared, self.moves, self.levels, strict=True):
            own = rng.standard_normal(OWN)
            left, off = a @ own + b @ shared - y, own - m @ shared[-1:]
            cross, both, gradient = a.T @ b, b.T @ b, b.T @ left
            cross[:, -1:] -= precision[:, None] * m
            both[-1:, -1:] += m.T @ (precision[:, None] * m)
            gradient[-1:] -= m.T @ (precision * off)
            pull = a.T @ left + precision * off
            terms.append(FrameTerms(a.T @ a + np.diag(precision), cross, both, pull, gradient))
            scattering.append(Scattering(off, precision, OWN_GROUP))
        return Expanded(
            terms,
            scattering,
            list(self.moves),
            np.ones(FRAMES),
            Scattering(shared, before, SHARED_GROUP),
            np.diag(before),
            before * shared,
            len(SIZES),
        )


def test_the_probability_of_frames_under_other_sizes_is_that_of_their_levels() -> None:
    rng = np.random.default_rng(1)
    bench, first = Linear(rng), np.array([1.0, 0.6, 3.0])
    about = bench.expanded(first, rng)
    start = about.sized(np.zeros(3))
    for _ in range(5):
        steps = rng.standard_normal(3)
        found = about.sized(steps)
        expected = bench.loss(first * np.exp(steps)) - bench.loss(first)
        assert found.loss - start.loss == pytest.approx(expected, abs=1e-8)


def test_half_its_slope_is_what_frames_tell_less_the_squares() -> None:
    rng = np.random.default_rng(2)
    bench, first, steps = Linear(rng), np.array([1.0, 0.6, 3.0]), np.array([0.2, -0.3, 0.4])
    found = bench.expanded(first, rng).sized(steps)
    for number, each in enumerate(1e-4 * np.eye(3)):
        ahead, behind = (bench.loss(first * np.exp(steps + side * each)) for side in (1, -1))
        assert found.gradient[number] == pytest.approx((ahead - behind) / 4e-4, rel=1e-5)


@pytest.mark.parametrize("still", [False, True])
def test_the_likeliest_sizes_are_those_of_the_density(still: bool) -> None:
    """Also where the first own unknown does not scatter at all, or hardly."""
    rng = np.random.default_rng(3)
    bench, first, least = Linear(rng, still), np.ones(3), -7.0
    about = bench.expanded(first, rng)
    found = about.likeliest(about.sized(np.zeros(3)), np.full(3, least), np.full(3, 4.0))
    best = min(
        (
            minimize(lambda steps: bench.loss(np.exp(steps)), begin, bounds=[(least, 4.0)] * 3)
            for begin in ([0.0, 0.0, 0.0], [-3.0, 0.5, 0.5])
        ),
        key=lambda one: one.fun,
    )
    assert bench.loss(np.exp(found.steps)) == pytest.approx(best.fun, abs=0.1)
    told = best.x > -2
    assert np.abs(found.steps - best.x)[told].max() < 0.1
