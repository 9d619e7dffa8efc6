"""What lies between nodes is what a polynomial through them says, and no pixel is lost."""

import numpy as np
import pytest

from fringeforce.estimation.layout import GROUP, Layout
from fringeforce.estimation.vector_loops import interpolate

PLACES = pytest.mark.parametrize(
    ("pixels", "channels", "every"), [(2048, 1, 4), (700, 1, 2), (300, 3, 4), (97, 1, 1)]
)


@PLACES
def test_every_pixel_has_a_place_of_its_own_between_empty_ones(pixels, channels, every) -> None:
    layout = Layout(pixels, channels, every)
    values = np.arange(1.0, pixels + 1)
    laid = layout.lay(values)
    np.testing.assert_array_equal(layout.pick(laid), values)
    assert np.count_nonzero(laid) == pixels
    assert laid.size % GROUP == 0
    assert not laid.reshape(every, -1)[:, :GROUP].any()


@PLACES
def test_neighbouring_pixels_stand_in_one_group(pixels: int, channels: int, every: int) -> None:
    layout = Layout(pixels, channels, every)
    laid = layout.lay(np.arange(pixels) % (pixels // channels) // GROUP + np.ones(pixels))
    for group in laid.reshape(every, -1, GROUP // every).swapaxes(0, 1):
        assert len(np.unique(group[group > 0])) <= 1


@PLACES
def test_a_quintic_is_exact_between_the_nodes_and_up_to_the_ends(pixels, channels, every) -> None:
    layout = Layout(pixels, channels, every)
    x = np.linspace(-1, 1, pixels // channels)
    quintic = np.polynomial.Polynomial(np.random.default_rng(0).normal(size=6))
    curves = np.stack([np.concatenate([quintic(x) + c for c in range(channels)])] * 2, axis=1)
    nodes, base = layout.at_nodes(curves)[0], np.zeros_like(layout.lay(curves[:, 0]))
    base[:] = 3
    found = base.copy()
    interpolate(nodes, layout.shares, base, found)
    np.testing.assert_allclose(layout.pick(found) - 3, curves[:, 0], atol=3e-6 * abs(curves).max())
