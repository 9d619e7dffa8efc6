"""The paper's algorithm gives the very phase back that made a noise-free intensity."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import fringeforce as ff
from fringeforce.phase.noise_free import recover_phase, start_indices

TURN = 2 * np.pi


def light(phase: np.ndarray) -> np.ndarray:
    return np.sin(phase / 2) ** 2


def resolved(phase: np.ndarray) -> bool:
    """Whether the samples show every crossing: no turn hides within one of them."""
    step, bend = np.diff(phase), np.abs(np.diff(phase, 2))
    turns = np.nonzero(step[:-1] * step[1:] <= 0)[0] + 1
    above = np.abs(phase[turns] - np.pi * np.rint(phase[turns] / np.pi))
    return bool(np.abs(step).max() < 0.15 and (above > 20 * bend[turns - 1] + 1e-9).all())


@st.composite
def phases(draw: st.DrawFn, samples: int) -> np.ndarray:
    x = np.linspace(-1, 1, samples)
    peak = draw(st.floats(0.5, 50))
    p = draw(st.floats(-20, 20)) + draw(st.floats(0.5, 5)) * x
    for _ in range(draw(st.integers(1, 5))):
        place, width = draw(st.floats(-1, 1)), draw(st.floats(0.15, 0.8))
        p += draw(st.floats(-1, 1)) * peak * np.exp(-(((x - place) / width) ** 2))
    return p


@pytest.mark.parametrize("samples", [2048, 20_000])
@pytest.mark.parametrize("direction", ["forward", "backward"])
@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_the_phase_comes_back_from_any_known_start(samples, direction, data) -> None:
    phase = data.draw(phases(samples))
    assume(resolved(phase))
    scanned = phase if direction == "forward" else phase[::-1]
    steps = np.diff(scanned)
    # what happens within a few samples of an end has no neighbours to be told by
    assume(np.ptp(np.floor(scanned[:8] / np.pi)) == 0 and np.ptp(np.sign(steps[:8])) == 0)
    assume(np.abs(np.diff(light(scanned[:8]))).min() > 1e-12)
    start = start_indices(scanned[0], rising=bool(steps[0] > 0))
    found = recover_phase(light(phase), start, direction)[4:-4]
    expected = phase[4:-4]
    away = np.abs(expected - np.pi * np.rint(expected / np.pi)) > 1e-3
    np.testing.assert_allclose(found[away], expected[away], atol=1e-6)
    np.testing.assert_allclose(found, expected, atol=1e-4)


@pytest.mark.parametrize("samples", [2048, 20_000])
@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), largest=st.floats(0.2, 3.0))
def test_the_phase_of_a_sensor_with_free_edges_needs_no_start(model, samples, seed, largest):
    """Their phase starts at zero; up to its sign, which no intensity shows, it comes back."""
    rng = np.random.default_rng(seed)
    forces = ff.polar(rng.uniform(0, largest, 11), rng.uniform(-20, 20, 11))
    half = model.sensor.transducer.length / 2
    phase = model.phase(forces, np.linspace(-half, half, samples))
    inside = slice(samples // 100, -samples // 100)
    assume(resolved(phase[inside]) and (np.abs(phase[:2]) < np.pi).all())
    start = start_indices(phase[inside][0], rising=bool(np.diff(phase[inside][:2])[0] > 0))
    np.testing.assert_allclose(recover_phase(light(phase[inside]), start), phase[inside], atol=1e-5)


def test_the_default_start_is_a_falling_or_rising_phase_within_a_half_turn() -> None:
    x = np.linspace(0, 1, 2048)
    falling, rising = -1.0 - 30 * x, -1.0 + 30 * x
    np.testing.assert_allclose(recover_phase(light(falling)), falling, atol=1e-6)
    np.testing.assert_allclose(recover_phase(light(rising)), rising, atol=1e-6)


@pytest.mark.parametrize("order", [2, 4])
@pytest.mark.parametrize("multiple", [-3, -2])
def test_a_touch_of_even_order_is_a_turn(order: int, multiple: int) -> None:
    x = np.linspace(-1, 1, 4097)
    phase = multiple * np.pi + 2.5 * x**order
    start = start_indices(phase[0])
    np.testing.assert_allclose(recover_phase(light(phase), start), phase, atol=1e-6)


@pytest.mark.parametrize("order", [3, 5])
@pytest.mark.parametrize("multiple", [-3, -2])
def test_a_flat_crossing_of_odd_order_is_a_crossing(order: int, multiple: int) -> None:
    x = np.linspace(-1, 1, 2001)
    phase = multiple * np.pi - 2.5 * x**order
    found = recover_phase(light(phase), start_indices(phase[0]))
    np.testing.assert_allclose(found, phase, atol=1e-4)
    away = np.abs(phase - multiple * np.pi) > 1e-2
    np.testing.assert_allclose(found[away], phase[away], atol=1e-6)


@given(st.floats(-200, 200), st.booleans())
def test_start_indices_give_the_phase_they_are_for(phase: float, rising: bool) -> None:
    m, n, k = start_indices(phase, rising)
    fold = 2 * np.arcsin(np.sqrt(np.sin(phase / 2) ** 2))
    assert -TURN * m - (-1) ** (m + n) * fold == pytest.approx(phase, abs=1e-5)
    assert k == rising


def test_darkness_is_no_phase() -> None:
    np.testing.assert_array_equal(recover_phase(np.zeros(2048)), 0)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: recover_phase(np.ones((2, 9))), ["(2, 9)", "8 samples"]),
        (lambda: recover_phase(np.full(9, 1.2)), ["1.2", "sample 0", "offset"]),
        (lambda: recover_phase(np.full(9, np.nan)), ["nan", "sample 0"]),
        (lambda: recover_phase(np.zeros(9), edge_phase=-4.0), ["left", "-4 rad", "backward"]),
        (
            lambda: recover_phase(np.zeros(9), direction="backward", edge_phase=0.5),
            ["right", "0.5 rad", "start_indices"],
        ),
        (lambda: start_indices(np.inf), ["inf", "finite"]),
    ],
)
def test_what_cannot_be_scanned_is_said(call, words: list[str]) -> None:
    with pytest.raises(ff.FringeforceError) as caught:
        call()
    assert all(word in str(caught.value) for word in words)
