"""Critical points are classified by how the phase goes on, whatever their order."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fringeforce.estimation.phase.critical_points import critical_points

SAMPLES = [2048, 2049, 20_000]


def light(phase: np.ndarray) -> np.ndarray:
    return np.sin(phase / 2) ** 2


def kinds(phase: np.ndarray) -> list[int]:
    return [point.kind for point in critical_points(light(phase))]


def meeting(multiple: int, order: int, samples: int, place: float, sign: int) -> np.ndarray:
    """A phase that meets a multiple of pi once, as (x - place)^order, and stays within a turn."""
    x = np.linspace(-1, 1, samples) - place
    return multiple * np.pi + sign * 2.5 * (x / np.abs(x).max()) ** order


@pytest.mark.parametrize("samples", SAMPLES)
def test_a_running_phase_crosses_bright_and_dark_in_turn(samples: int) -> None:
    phase = np.linspace(-0.5, -0.5 - 4 * np.pi, samples)
    assert kinds(phase) == [1, 2, 1, 2]
    assert kinds(phase[::-1]) == [2, 1, 2, 1]


@pytest.mark.parametrize("samples", SAMPLES)
@pytest.mark.parametrize("shift", [0.3, 1.0, 2.0])
def test_a_turn_between_multiples_is_class_3(samples: int, shift: float) -> None:
    assert kinds(-shift - 0.2 * np.linspace(-1, 1, samples) ** 2) == [3]


@given(
    multiple=st.integers(-6, 6),
    order=st.integers(1, 6),
    samples=st.sampled_from(SAMPLES),
    place=st.floats(-0.5, 0.5),
    sign=st.sampled_from([-1, 1]),
)
def test_the_order_decides_whether_the_phase_crosses_a_multiple_or_touches_it(
    multiple: int, order: int, samples: int, place: float, sign: int
) -> None:
    """Odd orders r, whose intensity has a first derivative of order 2(2k+1), cross; even turn."""
    crosses = 1 if multiple % 2 else 2
    found = kinds(meeting(multiple, order, samples, place, sign))
    assert found == [crosses if order % 2 else 3]


@pytest.mark.parametrize("samples", SAMPLES)
@pytest.mark.parametrize("multiple", [-3, -2, 0, 1])
@pytest.mark.parametrize("excess", [3e-2, 1e-3, 1e-5])
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_turn_just_beyond_a_multiple_is_two_crossings_and_one_just_before_is_none(
    samples: int, multiple: int, excess: float, sign: int
) -> None:
    x = np.linspace(-1, 1, samples)
    crosses = 1 if multiple % 2 else 2
    before = multiple * np.pi + sign * (2 * x**2 + excess)
    beyond = multiple * np.pi + sign * (2 * x**2 - excess)
    assert kinds(before) == [3]
    assert np.abs(x[beyond * sign < multiple * np.pi * sign]).size > 1
    assert kinds(beyond) == [crosses, 3, crosses]


@pytest.mark.parametrize("inside", [2, 3, 4, 5, 8])
@pytest.mark.parametrize("shift", [0.0, 0.2, 0.4, 0.5, 0.6, 0.8])
@pytest.mark.parametrize("multiple", [-1, -2])
def test_a_phase_beyond_a_multiple_for_a_few_samples_has_crossed_it_twice(
    inside: int, shift: float, multiple: int
) -> None:
    """For two samples their distances from the multiple may even fall all the way."""
    steps = np.arange(-40, 41) - shift
    phase = multiple * np.pi + 1e-3 * (steps**2 - (inside / 2) ** 2)
    assert np.sum(phase < multiple * np.pi) in (inside - 1, inside, inside + 1)
    crosses = 1 if multiple % 2 else 2
    assert kinds(phase) == [crosses, 3, crosses]


@pytest.mark.parametrize("apart", [2, 3, 5, 20])
@pytest.mark.parametrize("shift", [0.1, 0.3, 0.5, 0.7])
@pytest.mark.parametrize("multiple", [-1, -2])
@pytest.mark.parametrize("sign", [-1, 1])
def test_three_crossings_of_a_phase_that_wriggles_about_a_multiple_are_three(
    apart: int, shift: float, multiple: int, sign: int
) -> None:
    steps = np.arange(-60, 61) - shift
    phase = multiple * np.pi + sign * 1e-5 * steps * (steps**2 - apart**2)
    crosses = 1 if multiple % 2 else 2
    assert kinds(phase) == [crosses, 3, crosses, 3, crosses]


@given(st.floats(-3, -0.1), st.floats(10, 300), st.sampled_from(SAMPLES))
def test_crossings_lie_where_the_phase_crosses(edge: float, span: float, samples: int) -> None:
    phase = np.linspace(edge, edge - span, samples)
    found = critical_points(light(phase))
    exact = np.nonzero(np.diff(np.floor(phase / np.pi)))[0] + 1
    clear = np.abs(phase[[exact - 1, exact]] - np.pi * np.rint(phase[exact] / np.pi)).min(0) > 1e-6
    assert len(found) == len(exact)
    np.testing.assert_array_equal(np.array([p.index for p in found])[clear], exact[clear])


@given(st.floats(-0.9, 0.9), st.sampled_from(SAMPLES))
def test_turns_lie_at_the_sample_next_to_the_extremum(place: float, samples: int) -> None:
    x = np.linspace(-1, 1, samples)
    (point,) = critical_points(light(-0.5 - 0.5 * (x - place) ** 2))
    assert abs(point.index - (place + 1) / 2 * (samples - 1)) <= 1.01


@pytest.mark.parametrize("value", [0.0, 1e-30, 0.3, 0.5, 1 - 1e-16, 1.0])
def test_an_even_intensity_has_no_critical_point(value: float) -> None:
    assert critical_points(np.full(2048, value)) == []


def test_a_phase_that_rests_between_two_slopes_turns_once() -> None:
    x = np.linspace(-1, 1, 2048)
    assert kinds(-0.3 - np.maximum(np.abs(x) - 0.5, 0)) == [3]
