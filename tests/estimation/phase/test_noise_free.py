"""The paper's algorithm gives the very phase back that made a noise-free intensity."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import fringeforce as ff
from fringeforce.estimation.phase.noise_free import recover_phase, start_indices

TURN = 2 * np.pi
FRINGE = 20
"""Samples that a fringe must have."""
ON_IT = 1e-8
"""Distance from a multiple of pi within which the cosine rounds to one [rad]."""
KINK = 2e-3
"""Distance from a multiple of pi within which a kink makes a crossing look like a turn [rad]."""
EXACT = settings(max_examples=100, deadline=None)


def light(phase: np.ndarray) -> np.ndarray:
    return np.sin(phase / 2) ** 2


def away(phase: np.ndarray) -> np.ndarray:
    """Where rounding of the intensity does not limit the phase."""
    return np.abs(phase - np.pi * np.rint(phase / np.pi)) > 1e-3


def start_of(phase: np.ndarray, direction: str) -> tuple[int, int, int]:
    scanned = phase if direction == "forward" else phase[::-1]
    return start_indices(scanned[0], rising=bool(scanned[1] > scanned[0]))


def assert_same(found: np.ndarray, phase: np.ndarray, near: float = 1e-4) -> None:
    clear = away(phase)
    np.testing.assert_allclose(found[clear], phase[clear], rtol=0, atol=1e-6)
    np.testing.assert_allclose(found[~clear], phase[~clear], rtol=0, atol=near)


def shown(phase: np.ndarray) -> bool:
    """Whether the phase never lies on a multiple of pi for three samples, and ends on none.

    From there it may cross the multiple or turn back: the intensity is the same.
    """
    on_it = np.abs(phase - np.pi * np.rint(phase / np.pi)) < ON_IT
    return not ((on_it[:-2] & on_it[1:-1] & on_it[2:]).any() or on_it[0] or on_it[-1])


@st.composite
def phases(draw: st.DrawFn, samples: int) -> np.ndarray:
    """Sums of harmonics or of bumps, to 50 rad but never less than 20 samples to a fringe."""
    x = np.linspace(-1, 1, samples)
    phase = np.zeros(samples)
    harmonic = draw(st.booleans())
    for _ in range(draw(st.integers(1, 5))):
        height, place = draw(st.floats(-1, 1)), draw(st.floats(-1, 1))
        if harmonic:
            phase += height * np.sin(np.pi * (draw(st.floats(0.2, 12)) * x + place))
        else:
            phase += height * np.exp(-(((x - place) / draw(st.floats(0.05, 0.8))) ** 2))
    phase -= phase[0]
    reach, pace = np.abs(phase).max(), np.abs(np.diff(phase)).max()
    assume(reach > 1e-3)
    scale = min(draw(st.floats(0.1, 50)) / reach, TURN / FRINGE / pace)
    return draw(st.floats(-3.14, 0)) + scale * phase


@pytest.mark.slow
@pytest.mark.parametrize("samples", [2048, 20_000])
@EXACT
@given(data=st.data())
def test_a_phase_that_starts_within_a_half_turn_comes_back_from_the_default_start(
    samples: int, data: st.DataObject
) -> None:
    phase = data.draw(phases(samples))
    assume(phase[0] < -1e-6 and shown(phase))
    assert_same(recover_phase(light(phase)), phase)
    assert_same(recover_phase(light(phase[::-1]), direction="backward"), phase[::-1])


@pytest.mark.slow
@pytest.mark.parametrize("samples", [2048, 20_000])
@pytest.mark.parametrize("direction", ["forward", "backward"])
@EXACT
@given(data=st.data(), shift=st.floats(-40, 40))
def test_any_phase_comes_back_from_the_indices_of_its_edge(
    samples: int, direction, data: st.DataObject, shift: float
) -> None:
    phase = data.draw(phases(samples)) + shift
    edge = phase[0] if direction == "forward" else phase[-1]
    assume(abs(edge - np.pi * round(edge / np.pi)) > 1e-6 and shown(phase))
    found = recover_phase(light(phase), start_of(phase, direction), direction)
    assert_same(found, phase)


@pytest.mark.slow
@pytest.mark.parametrize("samples", [2048, 20_000])
@pytest.mark.parametrize("edges", ["free", "roller"])
@pytest.mark.parametrize("direction", ["forward", "backward"])
@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), largest=st.floats(0.2, 6.0))
def test_the_phase_of_a_sensor_comes_back(
    model, roller_model, samples: int, edges: str, direction, seed: int, largest: float
) -> None:
    """With rollers it takes the indices of the edge phase, which no intensity shows."""
    rng = np.random.default_rng(seed)
    forces = ff.polar(rng.uniform(0, largest, 11), rng.uniform(-25, 25, 11))
    chosen = model if edges == "free" else roller_model
    place = chosen.sensor.transducer.length * ((np.arange(samples) + 0.5) / samples - 0.5)
    phase = chosen.phase(forces, place)
    assume(np.abs(np.diff(phase)).max() < TURN / FRINGE)
    # elements meet in kinks, which hide what goes on within a little of a multiple of pi
    kinks = chosen.phase(forces, chosen.breaks[1:-1]) / np.pi
    assume(np.abs(kinks - np.rint(kinks)).min() > KINK / np.pi)
    found = recover_phase(light(phase), start_of(phase, direction), direction)
    assert_same(found, phase, near=KINK)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), largest=st.floats(0.2, 3.0))
def test_free_edges_need_no_start_but_for_the_sign(model, seed: int, largest: float) -> None:
    rng = np.random.default_rng(seed)
    forces = ff.polar(rng.uniform(0, largest, 11), rng.uniform(-25, 25, 11))
    phase = model.phase(forces)
    assert abs(phase[0]) < np.pi
    found = recover_phase(model.intensity(forces))
    assert found[0] <= 0
    assert_same(found, -np.sign(phase[0]) * phase, near=2e-3)


@pytest.mark.parametrize("pace", [-30, 30])
def test_the_default_start_takes_the_slope_from_the_intensity(pace: int) -> None:
    phase = -1.0 + pace * np.linspace(0, 1, 2048)
    assert_same(recover_phase(light(phase)), phase)


@pytest.mark.parametrize("samples", [2048, 4097, 20_000])
@pytest.mark.parametrize("order", [2, 3, 4, 5])
@pytest.mark.parametrize("multiple", [-3, -2, 2, 3])
@pytest.mark.parametrize("sign", [-1, 1])
def test_touches_and_flat_crossings_come_back(
    samples: int, order: int, multiple: int, sign: int
) -> None:
    phase = multiple * np.pi + sign * 2.5 * np.linspace(-1, 1, samples) ** order
    assert_same(recover_phase(light(phase), start_of(phase, "forward")), phase, near=1e-6)


@pytest.mark.parametrize("multiple", [-3, -2, -1, 0, 1, 2])
@pytest.mark.parametrize("pace", [-9.0, 9.0])
@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_a_phase_may_start_at_a_multiple_of_pi(multiple: int, pace: float, direction) -> None:
    phase = multiple * np.pi + pace * np.linspace(0, 1, 2048)
    phase = phase if direction == "forward" else phase[::-1]
    assert_same(recover_phase(light(phase), start_of(phase, direction), direction), phase)


@given(st.floats(-200, 200), st.booleans(), st.integers(-60, 60), st.booleans())
def test_start_indices_give_the_phase_they_are_for(
    phase: float, rising: bool, half_turns: int, at_multiple: bool
) -> None:
    phase = half_turns * np.pi if at_multiple else phase
    m, n, k = start_indices(phase, rising)
    fold = 2 * np.arcsin(np.sqrt(light(np.array(phase))))
    assert -TURN * m - (-1) ** (m + n) * fold == pytest.approx(phase, abs=1e-5)
    assert k == rising
    assert n in (0, 1)


@pytest.mark.parametrize("phase", [-3.1, -1.0, -1e-3])
def test_the_paper_starts_with_zeros_in_its_interval(phase: float) -> None:
    assert start_indices(phase) == (0, 0, 0)


@given(value=st.floats(0, 1), direction=st.sampled_from(["forward", "backward"]))
def test_an_even_intensity_is_an_even_phase(value: float, direction) -> None:
    found = recover_phase(np.full(2048, value), direction=direction)
    np.testing.assert_array_equal(found, found[0])
    assert light(found[0]) == pytest.approx(value, abs=1e-12)
    assert -np.pi <= found[0] <= 0


def test_rounding_beyond_the_limits_is_no_error() -> None:
    found = recover_phase(np.linspace(-1e-13, 1 + 1e-13, 2048))
    assert found[0] == 0
    assert found[-1] == pytest.approx(-np.pi)


def test_an_edge_phase_in_the_interval_is_taken() -> None:
    phase = np.linspace(-1, -20, 2048)
    assert_same(recover_phase(light(phase), edge_phase=-1.0), phase)


def test_the_intensity_passed_in_stays_as_it_is() -> None:
    given_light = np.linspace(-1e-13, 1, 2048)
    given_light.flags.writeable = False
    recover_phase(given_light, direction="backward")


FALLING = light(np.linspace(-1, -20, 2048))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: recover_phase(np.ones((2, 9))), ["(2, 9)", "8 samples"]),
        (lambda: recover_phase(np.ones(7)), ["(7,)", "8 samples"]),
        (lambda: recover_phase(np.full(9, 1.2)), ["1.2", "sample 0", "offset"]),
        (lambda: recover_phase(np.full(9, 1 + 1e-10)), ["sample 0", "offset"]),
        (lambda: recover_phase(np.full(9, -1e-10)), ["-1e-10", "sample 0"]),
        (lambda: recover_phase(np.full(9, np.nan)), ["nan", "sample 0"]),
        (lambda: recover_phase(np.full(9, np.inf)), ["inf", "sample 0"]),
        (lambda: recover_phase(FALLING, direction="up"), ["'up'", "forward"]),  # pyrefly: ignore[bad-argument-type]
        (lambda: recover_phase(FALLING, edge_phase=-4.0), ["left", "-4 rad", "backward"]),
        (lambda: recover_phase(FALLING, edge_phase=np.nan), ["left", "nan rad"]),
        (
            lambda: recover_phase(FALLING, direction="backward", edge_phase=0.5),
            ["right", "0.5 rad", "start_indices"],
        ),
        (lambda: recover_phase(FALLING, (0, 0, 1)), ["k = 1", "falls", "start_indices"]),
        (lambda: recover_phase(FALLING, (0, 1, 0)), ["k = 0", "n = 1", "rises"]),
        (lambda: start_indices(np.inf), ["inf", "finite"]),
    ],
)
def test_what_cannot_be_scanned_is_said(call, words: list[str]) -> None:
    with pytest.raises(ff.FringeforceError) as caught:
        call()
    assert all(word in str(caught.value) for word in words)
