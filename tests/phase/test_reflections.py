"""Mirror images are those that a plain least-squares fit of the mirrored stretch finds."""

from typing import Any

import numpy as np

from fringeforce.phase.reflections import EQUAL, LOSS, SHIFT, reflections

X = np.linspace(0, 1, 800)
INFLUENCE = np.sin(np.pi * np.outer(X, np.arange(1, 7)))


def scene(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    phase = INFLUENCE @ rng.normal(0, 3, 6)
    return phase, 4 * np.sin(phase) ** 2 + 0.01


def fitted(phase: np.ndarray, information: np.ndarray, first: int, last: int, mirror: float):
    """Change of the loads, its loss and its size, by an independent solver."""
    wanted = np.zeros(len(phase))
    wanted[first:last] = 2 * (mirror - phase[first:last])
    root = np.sqrt(information)
    change, *_ = np.linalg.lstsq(root[:, None] * INFLUENCE, root * wanted, rcond=None)
    followed = INFLUENCE @ change
    return change, information @ (followed - wanted) ** 2, information @ followed**2


def contacts(phase: np.ndarray) -> list[int]:
    distance = np.abs(phase - np.pi * np.rint(phase / np.pi))
    return [
        k
        for k in range(1, len(phase) - 1)
        if distance[k - 1] >= distance[k] < distance[k + 1] and distance[k] < 0.6
    ]


def every_image(phase: np.ndarray, information: np.ndarray) -> list[tuple[float, Any]]:
    """Loss and change of every stretch that may be mirrored, the likeliest first.

    Equals, such as both sides of one place at zero, come in the order of their stretches.
    """
    inner, end = contacts(phase), len(phase)
    near = {k: np.pi * np.rint(phase[k] / np.pi) for k in inner}
    stretches = [(0, k, near[k]) for k in inner] + [(k, end, near[k]) for k in inner]
    stretches += [(j, k, near[j]) for j in inner for k in inner if j < k and near[j] == near[k]]
    fits = [fitted(phase, information, *stretch) for stretch in sorted(stretches)]
    return sorted(
        ((float(loss), change) for change, loss, shift in fits if loss < LOSS and shift > SHIFT),
        key=lambda one: round(one[0] / EQUAL),
    )


def test_every_stretch_between_meetings_of_one_multiple_is_mirrored_and_nothing_else() -> None:
    compared = 0
    for seed in range(20):
        phase, information = scene(seed)
        expected = every_image(phase, information)
        found = reflections(phase, INFLUENCE, information)
        assert len(found) == len(expected)
        for one, (_, change) in zip(found, expected, strict=True):
            np.testing.assert_allclose(one, change, atol=1e-4 * np.abs(change).max())
            compared += 1
    assert compared > 10
