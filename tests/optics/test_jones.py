"""Jones calculus against closed forms of the textbook and against Mueller calculus."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fringeforce.optics.jones import Fringe, fringe, passed, polariser, retarder
from fringeforce.optics.polariscope import intensity

QUARTER, EIGHTH = np.pi / 2, np.pi / 4
PHASES = np.linspace(-9, 9, 181)
angles = st.floats(-np.pi, np.pi)
shares = st.floats(0, 0.2)


def mueller_polariser(angle: float, extinction: float) -> np.ndarray:
    """Diattenuator of Chipman, Lam and Young, Polarized Light and Optical Systems, 2018."""
    a, b, c = (1 + extinction) / 2, (1 - extinction) / 2, np.sqrt(extinction)
    straight = np.array([[a, b, 0, 0], [b, a, 0, 0], [0, 0, c, 0], [0, 0, 0, c]])
    return turned(straight, angle)


def mueller_retarder(retardance: float, angle: float) -> np.ndarray:
    straight = np.eye(4)
    c, s = np.cos(retardance), np.sin(retardance)
    straight[2:, 2:] = [[c, s], [-s, c]]
    return turned(straight, angle)


def turned(straight: np.ndarray, angle: float) -> np.ndarray:
    turn = np.eye(4)
    c, s = np.cos(2 * angle), np.sin(2 * angle)
    turn[1:3, 1:3] = [[c, s], [-s, c]]
    return turn.T @ straight @ turn


def plane(analyser: float) -> Fringe:
    return fringe([polariser(EIGHTH)], [polariser(analyser)])


def test_a_plane_dark_field_polariscope_reduces_to_equation_11() -> None:
    found = plane(-EIGHTH)
    np.testing.assert_allclose(found.intensity(PHASES), intensity(PHASES), atol=1e-14)
    assert (found.amplitude, abs(found.bias), found.offset) == pytest.approx((1, 0, 0), abs=1e-14)


def test_a_circular_dark_field_polariscope_reduces_to_equation_11() -> None:
    before = [polariser(0), retarder(QUARTER, EIGHTH)]
    found = fringe(before, [retarder(QUARTER, -EIGHTH), polariser(QUARTER)])
    np.testing.assert_allclose(found.intensity(PHASES), intensity(PHASES), atol=1e-14)


def test_parallel_polarisers_make_the_bright_field() -> None:
    np.testing.assert_allclose(plane(EIGHTH).intensity(PHASES), 1 - intensity(PHASES), atol=1e-14)


def test_a_quarter_wave_plate_along_the_strip_biases_by_a_quarter() -> None:
    biased = fringe([polariser(EIGHTH), retarder(QUARTER)], [polariser(-EIGHTH)])
    assert biased.bias == pytest.approx(QUARTER)


def test_a_polarisation_camera_behind_a_plate_sees_all_four_quarters() -> None:
    before = [polariser(0), retarder(QUARTER, EIGHTH)]
    plate = retarder(QUARTER, EIGHTH)
    biases = [
        fringe(before, [plate, polariser(angle)]).bias for angle in np.radians([0, 45, 90, 135])
    ]
    assert np.sort(np.degrees(biases) % 360).tolist() == pytest.approx([0, 90, 180, 270])


@given(angles, angles, angles, angles, angles, angles, shares, shares)
def test_any_arrangement_makes_the_fringe_that_mueller_calculus_makes(
    first, second, axis, other, retardance, another, leak, leak_behind
) -> None:
    before = [polariser(first, leak), retarder(retardance, axis)]
    behind = [retarder(another, other), polariser(second, leak_behind)]
    light = np.array([1.0, 0, 0, 0])
    light = mueller_retarder(retardance, axis) @ mueller_polariser(first, leak) @ light
    expected = [
        (
            mueller_polariser(second, leak_behind)
            @ mueller_retarder(another, other)
            @ mueller_retarder(p, 0)
            @ light
        )[0]
        for p in PHASES
    ]
    np.testing.assert_allclose(passed(before, PHASES, behind), expected, atol=1e-12)
    found = fringe(before, behind).intensity(PHASES)
    np.testing.assert_allclose(found, 2 * np.array(expected), atol=1e-12)
