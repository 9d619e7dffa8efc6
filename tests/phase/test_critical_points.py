"""Critical points are classified by how the phase goes on, whatever their order."""

import numpy as np
import pytest

from fringeforce.phase.critical_points import critical_points

X = np.linspace(-1, 1, 2001)


def kinds(phase: np.ndarray) -> list[int]:
    return [point.kind for point in critical_points(np.sin(phase / 2) ** 2)]


def test_a_running_phase_crosses_bright_and_dark_in_turn() -> None:
    assert kinds(-0.5 - 2 * np.pi * (X + 1)) == [1, 2, 1, 2]


@pytest.mark.parametrize("shift", [0.3, 1.0, 2.0])
def test_a_turn_between_multiples_is_class_3(shift: float) -> None:
    assert kinds(-shift - 0.2 * X**2) == [3]


@pytest.mark.parametrize(("order", "kind"), [(1, 1), (2, 3), (3, 1), (4, 3), (5, 1)])
def test_at_a_bright_point_the_order_decides(order: int, kind: int) -> None:
    assert kinds(-np.pi - 2.0 * X**order) == [kind]


@pytest.mark.parametrize(("order", "kind"), [(1, 2), (2, 3), (3, 2), (4, 3), (5, 2)])
def test_at_a_dark_point_the_order_decides(order: int, kind: int) -> None:
    assert kinds(-2 * np.pi - 2.0 * X**order) == [kind]


@pytest.mark.parametrize("excess", [-1e-3, 1e-3])
def test_a_turn_just_beyond_a_multiple_is_two_crossings_and_one_turn(excess: float) -> None:
    found = kinds(-2 * np.pi + excess + 2.0 * X**2)
    assert found == ([2, 3, 2] if excess < 0 else [3])


def test_crossings_lie_where_the_phase_crosses() -> None:
    phase = -0.5 - 40 * (X + 1)
    found = critical_points(np.sin(phase / 2) ** 2)
    exact = np.nonzero(np.diff(np.floor(phase / np.pi)))[0] + 1
    np.testing.assert_array_equal([point.index for point in found], exact)
