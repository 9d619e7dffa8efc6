"""Mirror images of the phase: those that counting finds, and NumPy's least squares."""

import itertools

import numpy as np
import pytest

from fringeforce.estimation.phase.reflections import (
    DIFFERENT_IMAGE,
    EQUAL_LOSS,
    TOUCH,
    mirror_images,
)

STEPS, PIXELS = 7, 24
END = STEPS * PIXELS
GROWTH = 250.0
"""Expected growth of the loss up to which images are asked for."""


def found_images(phase: np.ndarray, influence: np.ndarray, information: np.ndarray) -> np.ndarray:
    """Changes of the loads, the likeliest first."""
    return mirror_images(phase, influence, information, growth=GROWTH)[0]


def staircase() -> np.ndarray:
    """Influence of a constant, and of smooth steps of pi, each over an interval of its own."""
    x = np.arange(END + 1)[:, None] / PIXELS - np.arange(STEPS)
    inside = np.clip(x, 0, 1)
    return np.pi * np.column_stack([np.ones(END + 1), inside**2 * (3 - 2 * inside)])


def information(phase: np.ndarray) -> np.ndarray:
    return 4 * np.sin(phase) ** 2 + 0.1


def every_mirror_image(loads: np.ndarray) -> set[tuple[int, ...]]:
    """Changes that mirror one stretch, among all staircases that leave the same frame.

    A mirror image differs from the phase over one stretch, where the two add up to a constant, and
    not over the whole frame.
    """
    influence = staircase()
    phase, found = influence @ loads, set()
    starts = loads[0] + 2 * np.arange(-STEPS, STEPS + 1)
    for first, *steps in itertools.product(starts, *[(-1, 1)] * STEPS):
        other = np.array([first, *steps])
        image = influence @ other
        np.testing.assert_allclose(np.sin(image / 2) ** 2, np.sin(phase / 2) ** 2, atol=1e-12)
        apart = np.flatnonzero(np.abs(image - phase) > 1e-9)
        # a phase that is mirrored at its very end differs everywhere but there
        if len(apart) and (apart[0] > 1 or apart[-1] < END - 1):
            stretch = slice(apart[0], apart[-1] + 1)
            if np.ptp((image + phase)[stretch]) < 1e-9:
                found.add(tuple(np.rint(other - loads).astype(int)))
    return found


@pytest.mark.parametrize("start", [0, 3])
@pytest.mark.parametrize(
    "steps",
    [
        (1, -1, 1, -1, 1, -1, 1),
        (1, 1, -1, -1, -1, -1, 1),
        (-1, 1, 1, 1, -1, 1, -1),
        (1, 1, 1, 1, 1, 1, 1),
    ],
)
def test_mirror_images_are_those_that_counting_all_staircases_finds(
    start: int, steps: tuple[int, ...]
) -> None:
    """Steps of half a turn up or down: whatever their signs, the frame is the same."""
    influence, loads = staircase(), np.array([start, *steps], dtype=float)
    phase = influence @ loads
    found = found_images(phase, influence, information(phase))
    np.testing.assert_allclose(found, np.rint(found), atol=1e-3)
    expected = every_mirror_image(loads)
    assert len(found) == len(expected)
    assert {tuple(change) for change in np.rint(found).astype(int)} == expected


def waves(height: float) -> tuple[np.ndarray, np.ndarray]:
    """A phase that turns at so much above 0, a quarter and three quarters along; its influence."""
    x = np.linspace(0, 1, 801)
    influence = np.cos(np.pi * np.outer(x, np.arange(9)))
    loads = np.array([height + 0.8, 0, 0, 0, 0.8, 0, 0, 0, 0])
    return influence @ loads, influence


@pytest.mark.parametrize(("precision", "count"), [(0.005, 2), (1.0, 5), (150.0, 4)])
def test_images_at_turns_near_a_multiple_are_those_of_numpys_least_squares(
    precision: float, count: int
) -> None:
    """Of the five stretches between two turns and two ends, but for the whole.

    Those that noise does not tell from a likelier one are left out.
    """
    phase, influence = waves(0.3)
    weight = precision * information(phase)
    root, losses, fits = np.sqrt(weight), [], []
    for first, last in [(0, 200), (0, 600), (200, 600), (200, 801), (600, 801)]:
        wanted = np.zeros(len(phase))
        wanted[first:last] = -2 * phase[first:last]
        change, *_ = np.linalg.lstsq(root[:, None] * influence, root * wanted, rcond=None)
        loss = weight @ (influence @ change - wanted) ** 2
        if loss < GROWTH and weight @ (influence @ change) ** 2 > DIFFERENT_IMAGE:
            losses.append(loss)
            fits.append(change)
    order, kept = np.argsort(losses), list[int]()
    for i in order:
        apart = [weight @ (influence @ (fits[i] - fits[j])) ** 2 for j in kept]
        if min(apart, default=np.inf) > DIFFERENT_IMAGE:
            kept.append(int(i))
    fits, losses = [fits[i] for i in kept], [losses[i] for i in kept]
    found = found_images(phase, influence, weight)
    assert len(found) == len(fits) == count
    # in deviations of the loads, squared
    apart = [[weight @ (influence @ (one - fit)) ** 2 for fit in fits] for one in found]
    nearest = [int(np.argmin(row)) for row in apart]
    assert sorted(nearest) == list(range(count))
    assert all(min(row) < 1e-3 for row in apart)
    # the likeliest first; two that are as likely in either order
    ranked = np.array(losses)[nearest]
    assert (np.diff(ranked) > -EQUAL_LOSS).all()  # what differs by less keeps the order of places


@pytest.mark.parametrize(("height", "images"), [(0.9 * TOUCH, True), (1.1 * TOUCH, False)])
def test_a_turn_far_from_every_multiple_mirrors_nothing(height: float, images: bool) -> None:
    phase, influence = waves(height)
    assert bool(len(found_images(phase, influence, 0.05 * information(phase)))) is images


def test_an_image_within_the_noise_of_what_it_mirrors_is_no_other_explanation() -> None:
    influence = staircase()
    loads = np.array([0, 1, -1, 1, -1, 1, -1, 1.0])
    phase = influence @ loads
    # squared deviations that mirroring everything but the first step moves the frame by
    most = information(phase)[PIXELS:] @ (2 * phase[PIXELS:]) ** 2
    for size, some in ((1.5, True), (0.6, False)):
        found = found_images(phase, influence, size * DIFFERENT_IMAGE / most * information(phase))
        assert bool(len(found)) is some


def test_a_phase_that_runs_along_a_multiple_may_have_crossed_it() -> None:
    """From -1.15 rad up to a shelf just below zero, where it may lie as well just above."""
    x = np.linspace(0, 1, 801)
    influence = np.cos(np.pi * np.outer(x, np.arange(12)))
    phase = -np.exp(-8 * x) - 0.15 + 0.4 * (x - 0.6) ** 3
    found = found_images(phase, influence, 30 * information(phase))
    others = phase + found @ influence.T
    beyond = x > 0.8
    assert any(np.abs(image + phase)[beyond].max() < 0.03 for image in others)
