"""Superposition, interpolation and the frames that a model predicts."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fringeforce as ff

TACTELS = 11


def _random_forces(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(TACTELS, 2))


@given(st.integers(0, 2**32 - 1), st.floats(-3, 3), st.floats(-3, 3))
def test_phase_superposes(model: ff.SensorModel, seed: int, a: float, b: float) -> None:
    first, second = _random_forces(seed), _random_forces(seed + 1)
    together = model.phase(a * first + b * second)
    apart = a * model.phase(first) + b * model.phase(second)
    np.testing.assert_allclose(together, apart, atol=1e-11)


def test_a_batch_is_its_members_one_by_one(model: ff.SensorModel) -> None:
    forces = np.stack([[_random_forces(3 * i + j) for j in range(3)] for i in range(2)])
    batch = model.phase(forces)
    assert batch.shape == (2, 3, 2048)
    np.testing.assert_allclose(batch[1, 2], model.phase(forces[1, 2]), atol=1e-12)
    assert model.intensity(forces).shape == model.expose(forces, rng=0).shape == (2, 3, 2048)


def test_the_stations_and_every_other_place_agree(model: ff.SensorModel) -> None:
    np.testing.assert_allclose(model.influence(model.x), model.psi, atol=1e-10)


def test_a_push_to_the_right_is_the_mirror_of_a_push_to_the_left(model: ff.SensorModel) -> None:
    forces = _random_forces(5)
    mirrored = forces[::-1] * [1.0, -1.0]
    np.testing.assert_allclose(model.phase(forces), model.phase(mirrored)[::-1], atol=1e-6)


def test_a_frame_cannot_tell_a_load_from_its_negative(model: ff.SensorModel) -> None:
    forces = _random_forces(6)
    np.testing.assert_array_equal(model.expose(forces, rng=1), model.expose(-forces, rng=1))


def test_a_seed_makes_a_frame_repeatable(model: ff.SensorModel) -> None:
    forces = ff.polar(1.0, 10, n=TACTELS)
    np.testing.assert_array_equal(model.expose(forces, rng=4), model.expose(forces, rng=4))
    assert (model.expose(forces, rng=4) != model.expose(forces, rng=5)).any()


def test_polar_forces_have_their_magnitude_and_angle() -> None:
    normal, tangential = ff.polar([1.0, 2.0, 3.0], [10.0, -30.0, 0.0]).T
    np.testing.assert_allclose(np.hypot(normal, tangential), [1, 2, 3])
    np.testing.assert_allclose(np.degrees(np.arctan2(tangential, normal)), [10, -30, 0])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m: m.phase(np.zeros((5, 2))), ["(5, 2)", "(..., 11, 2)"]),
        (lambda m: m.expose(np.zeros((3, 2, 11))), ["(3, 2, 11)", "(..., 11, 2)", "np.swapaxes"]),
        (lambda m: m.influence([0.02]), ["0.02", "0.0125"]),
        (lambda m: ff.characterize(m.sensor, "fine"), ["'fine'", "'paper'"]),
        (lambda m: ff.polar(1.0, 10), ["give n"]),
        (lambda m: ff.polar([1.0, 2.0], 10, n=3), ["3", "2"]),
    ],
)
def test_bad_input_is_named_with_its_remedy(model: ff.SensorModel, call, words) -> None:
    with pytest.raises(ff.FringeforceError) as caught:
        call(model)
    assert all(word in str(caught.value) for word in words)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_forces_that_are_not_finite_make_no_phase(model: ff.SensorModel, bad: float) -> None:
    forces = ff.polar(1.0, 10, 11)
    forces[3, 1] = bad
    for use in (model.phase, model.expose, model.as_built(0).expose):
        with pytest.raises(ff.FringeforceError, match=r"Force \(3, 1\) is"):
            use(forces)


def test_lists_that_are_no_arrays_are_refused(model: ff.SensorModel) -> None:
    ragged: Any = [[[1.0, 0.0]], [[1.0]]]
    for use in (model.phase, model.expose):
        with pytest.raises(ff.FringeforceError, match="must be real numbers"):
            use(ragged)
    with pytest.raises(ff.FringeforceError, match="array of grey levels"):
        ff.Reader(model).read_batch(ragged)
