"""What squares of frames as drawn must be like."""

from collections.abc import Iterable

import numpy as np
from scipy.stats import chi2

from fringeforce.estimation.score_test import Score


def expect_chi_squares(told: Iterable[list[Score]]) -> None:
    """Of each of at least nine departures, the sum over all frames has the distribution of one."""
    plain = np.array([[score.plain() for score in scores] for scores in told])
    squares, freedoms = plain.sum(axis=0).T
    assert (freedoms > 0).sum() >= 9
    for square, freedom in zip(squares, freedoms, strict=True):
        if freedom:
            low, high = chi2.ppf([1e-5, 1 - 1e-5], freedom)
            assert low < square < high
