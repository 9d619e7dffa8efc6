"""Sides of a phase beside multiples of pi: known, or open to noise."""

import numpy as np
import pytest

from fringeforce.estimation.phase_stretches import NOTHING, OPEN, Hidden, emerged, sides_of

X = np.linspace(-1, 1, 201)
BUMP = np.exp(-np.square((X + 0.5) / 0.15))
"""A stretch of its own, far from what lies at the other end."""
HILL = np.exp(-np.square((X - 0.5) / 0.15))
HIDDEN = Hidden(0.2, 1e4, 1.0)


def phase(bump: float, hill: float) -> np.ndarray:
    return bump * BUMP + hill * HILL


def told(nodes: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Covariance of loads that light of these fringes tells, and little else."""
    known = columns * HIDDEN.light * np.square(np.sin(nodes)) @ columns.T
    return np.linalg.inv(known + 1e-3 * np.eye(len(columns)))


def test_sides_are_known_where_light_is_more_than_noise() -> None:
    sides = sides_of(phase(0.02, -2.0), HIDDEN)
    strong = np.abs(phase(0.0, -2.0)) > 0.1
    assert (sides[strong] == -1).all()
    assert (sides[~strong] == OPEN).all()
    # on either side of pi, and of no phase
    np.testing.assert_array_equal(
        sides_of(np.repeat([np.pi - 0.5, np.pi + 0.5, -0.5], 20), HIDDEN), np.repeat([0, 1, -1], 20)
    )


@pytest.mark.parametrize("multiple", [0, 1, -2])
def test_a_stretch_that_comes_out_of_the_dark_may_be_on_either_side(multiple: int) -> None:
    """The loads can turn the sign of the bump alone, and its light is the same."""
    columns = np.array([BUMP, HILL], np.float32)
    before, now = (multiple * np.pi + phase(size, 0.0) for size in (0.05, 0.5))
    sides = sides_of(before, HIDDEN)
    assert not emerged(before, sides, HIDDEN, columns, told(before, columns))
    assert emerged(now, sides, HIDDEN, columns, told(now, columns))
    assert not emerged(now, sides_of(before, HIDDEN), NOTHING, columns, told(now, columns))


def test_a_stretch_whose_mirror_image_no_loads_make_is_on_its_side() -> None:
    """The only load that moves the bump moves the bright hill as well."""
    columns = np.array([BUMP + HILL], np.float32)
    before, now = phase(0.05, 1.3), phase(0.5, 1.3)
    sides = sides_of(before, HIDDEN)
    assert not emerged(now, sides, HIDDEN, columns, told(now, columns))
    np.testing.assert_array_equal(sides, sides_of(now, HIDDEN))


def test_what_showed_before_stays_on_its_side() -> None:
    columns = np.array([BUMP, HILL], np.float32)
    sides = sides_of(phase(0.5, 0.0), HIDDEN)
    for size in (0.6, 0.3, 0.15, 0.5):  # not so dark that noise could turn it
        nodes = phase(size, 0.0)
        assert not emerged(nodes, sides, HIDDEN, columns, told(nodes, columns))
    nodes = phase(-0.5, 0.0)  # on the other side
    assert emerged(nodes, sides, HIDDEN, columns, told(nodes, columns))
