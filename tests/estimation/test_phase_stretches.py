"""Sides of a phase beside multiples of pi: known, or open to noise."""

import numpy as np
import pytest

from fringeforce.estimation.phase_stretches import (
    NOTHING,
    OPEN,
    Hidden,
    Stretches,
    close,
    crossed,
    emerged,
    stretches_of,
)

X = np.linspace(-1, 1, 201)
BUMP = np.exp(-np.square((X + 0.5) / 0.15))
"""A stretch of its own, far from what lies at the other end."""
HILL = np.exp(-np.square((X - 0.5) / 0.15))
HIDDEN = Hidden(0.2, 1e4, 1.0, 2.0)
LOADS = np.array([BUMP, HILL, 0 * X, 0 * X], np.float32)
"""Each has a load of its own, of which nothing else is known."""
NOTHING_KNOWN = np.zeros(4)


def phase(bump: float, hill: float) -> np.ndarray:
    return bump * BUMP + hill * HILL


def comes_out(
    nodes: np.ndarray,
    stretches: Stretches,
    hidden: Hidden,
    columns: np.ndarray,
    precision: np.ndarray = NOTHING_KNOWN,
) -> bool:
    """In single precision, as where frames are followed."""
    return emerged(nodes.astype(np.float32), stretches, hidden, columns, precision)


def test_sides_are_known_where_light_is_more_than_noise() -> None:
    sides = stretches_of(phase(0.02, -2.0), HIDDEN).sides
    assert (sides[X > 0.2] == -1).all()
    assert (sides[X < -0.1] == OPEN).all()
    # on either side of pi, and of no phase
    both = np.repeat([np.pi - 0.5, np.pi + 0.5, -0.5], 20)
    np.testing.assert_array_equal(stretches_of(both, HIDDEN).sides, np.repeat([0, 1, -1], 20))


@pytest.mark.parametrize("multiple", [0, 1, -2])
def test_a_stretch_that_comes_out_of_the_dark_may_be_on_either_side(multiple: int) -> None:
    """Its light is the same on both."""
    before, now = (multiple * np.pi + phase(size, 0.0) for size in (0.02, 0.5))
    stretches = stretches_of(before, HIDDEN)
    assert not comes_out(before, stretches, HIDDEN, LOADS)
    assert comes_out(now, stretches, HIDDEN, LOADS)
    assert not comes_out(now, stretches_of(before, HIDDEN), NOTHING, LOADS)


def test_what_showed_before_stays_on_its_side() -> None:
    stretches = stretches_of(phase(0.5, 0.0), HIDDEN)
    for size in (0.6, 0.3, 0.15, 0.5):  # not so dark that noise could turn it
        assert not comes_out(phase(size, 0.0), stretches, HIDDEN, LOADS)
    assert comes_out(phase(-0.5, 0.0), stretches, HIDDEN, LOADS)  # on the other side


def test_a_stretch_that_went_dark_is_open_however_slowly_it_comes_back() -> None:
    """A hill of another sign is all the while bright, so that the phase is known to move slowly."""
    stretches = stretches_of(phase(0.5, -2.0), HIDDEN)
    sizes = np.concatenate([np.linspace(0.5, 0.0, 100), np.linspace(0.0, 0.5, 100)])
    told = [comes_out(phase(size, -2.0), stretches, HIDDEN, LOADS) for size in sizes]
    assert not any(told[:110])
    assert any(told[110:150])


def test_noise_of_a_single_frame_does_not_open_what_many_frames_show() -> None:
    """The mean of sixteen frames is not dark where one of them is."""
    stretches = stretches_of(phase(0.2, -2.0), HIDDEN)
    for _ in range(16):
        assert not comes_out(phase(0.2, -2.0), stretches, HIDDEN, LOADS)
    dark = phase(0.01, -2.0)
    assert not comes_out(dark, stretches, HIDDEN, LOADS)
    assert (stretches.sides[np.abs(X + 0.5) < 0.05] == 0).all()
    assert (stretches_of(dark, HIDDEN).sides[np.abs(X + 0.5) < 0.05] == OPEN).all()


def test_a_stretch_that_the_rest_of_the_frame_tells_is_on_its_side() -> None:
    """The only load that moves the bump moves the bright hill as well."""
    before, now = phase(0.02, 1.3), phase(0.5, 1.3)
    columns = np.array([BUMP + HILL, 0 * X, 0 * X, 0 * X], np.float32)
    stretches = stretches_of(before, HIDDEN)
    assert not comes_out(now, stretches, HIDDEN, columns)
    assert (stretches.sides[np.abs(X + 0.5) < 0.1] == 0).all()


def test_a_stretch_that_only_unlikely_errors_turn_is_on_its_side() -> None:
    """A field of phase moves the bump alone; its mirror image takes it as many deviations."""
    turned = 2 * 0.5  # by so much the mirror image of the bump differs [rad]
    for deviation, open_ in ((turned / 3.9, True), (turned / 4.1, False)):
        columns = np.array([HILL, deviation * BUMP, 0 * X, 0 * X], np.float32)
        stretches = stretches_of(phase(0.02, -2.0), HIDDEN)
        known = np.array([0.0, 1.0, 0.0, 0.0])
        assert comes_out(phase(0.5, -2.0), stretches, HIDDEN, columns, known) == open_


@pytest.mark.parametrize(
    ("before", "now", "told"),
    [
        (phase(0.5, -2.0), phase(-0.5, -2.0), True),
        (phase(0.5, -2.0), phase(0.5, -1.9), False),
        (phase(0.5, -2.0), phase(-0.02, -2.0), False),  # dark, and may come out on either side
        (phase(0.02, -2.0), phase(-0.5, -2.0), False),  # was dark
        (0.5 * BUMP - 0.1, 0.5 * BUMP - 0.11, False),  # where it meets the multiple moves
    ],
)
def test_a_phase_crosses_a_multiple_where_light_shows_it_on_both_sides(
    before: np.ndarray, now: np.ndarray, told: bool
) -> None:
    """A side that is known lasts, and the filter does not take the frame."""
    stretches = stretches_of(before, HIDDEN)
    assert crossed(now.astype(np.float32), stretches.sides, stretches.square, HIDDEN) == told
    sides = stretches.sides.copy()
    if told:
        assert comes_out(now, stretches, HIDDEN, LOADS)
        np.testing.assert_array_equal(stretches.sides, sides)


@pytest.mark.parametrize(
    ("now", "far", "open_"),
    [
        (phase(0.5, -2.0), True, False),
        (phase(0.5, -2.0), False, True),  # mirror images that are near may soon have weight
        (phase(-0.5, -2.0), True, True),  # on the other side
        (phase(0.5, -1.9), True, True),  # where the rest has moved
    ],
)
def test_a_side_whose_mirror_image_explains_nothing_is_not_tried_again_at_once(
    now: np.ndarray, far: bool, open_: bool
) -> None:
    """Noise hides the bump and shows it again."""
    dark, shown = (phase(size, -2.0).astype(np.float32) for size in (0.02, 0.5))
    stretches = stretches_of(dark.astype(float), HIDDEN)
    assert comes_out(shown, stretches, HIDDEN, LOADS)
    close(shown, stretches, HIDDEN, far)
    assert not any(comes_out(dark, stretches, HIDDEN, LOADS) for _ in range(16))
    assert comes_out(now, stretches, HIDDEN, LOADS) == open_
