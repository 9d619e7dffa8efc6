"""Nodes of the splines along a strip: what pixels take of them, and samples between them."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fringeforce.base.arrays import Array
from fringeforce.estimation.frame_model import node_weights
from fringeforce.models.node_splines import coefficients, fitted, sampled
from fringeforce.models.smooth_field import karhunen_loeve
from fringeforce.models.strip import SensorModel

NODES = 5
"""Nodes in the thickness of the cover, which smooths everything that passes through it: cubic
splines on them are good to 1e-4 of the peak of a line load."""
SPLINE_SAMPLES, FIELD_SAMPLES = 8, 2
"""Samples between neighbouring nodes by which splines are fitted, and of random fields."""
SMALLEST = 5e-4
"""Variance of a mode of a random field, relative to the largest, below which it is left out."""


def places_of_fields(model: SensorModel) -> tuple[Array, int]:
    """Where samples of random fields lie along a strip, shape (s,) [m], and the number of nodes."""
    x = samples_along(model)
    return x[:: SPLINE_SAMPLES // FIELD_SAMPLES], (len(x) - 1) // SPLINE_SAMPLES + 3


def samples_along(model: SensorModel) -> Array:
    """Places of the samples between the nodes, shape (s,) [m]."""
    pixel, positions = model.pixel_positions, pixel_nodes(model)[2]
    return np.asarray(pixel[0] + positions * (pixel[-1] - pixel[0]) / max(len(pixel) - 1, 1))


def pixel_nodes(model: SensorModel) -> tuple[NDArray[np.int64], Array, Array]:
    """First node and weights of every pixel of one channel, and places of samples in pixels."""
    pixels = model.sensor.camera.pixels
    seen = model.pixel_positions
    step = abs(float(seen[-1] - seen[0])) / max(pixels - 1, 1)
    spacing = model.sensor.transducer.compliant.thickness / NODES
    steps = max(int(np.ceil(pixels * step / spacing)), 4)
    steps = min(steps, max(pixels, 4))
    count = steps + 3
    first, weights = node_weights(1 + (np.arange(pixels) + 0.5) * steps / pixels, count)
    return first, weights, _places_in_pixels(pixels, steps)


def at_nodes(model: SensorModel, values: Array) -> Array:
    """Coefficients at the nodes of values at the pixels of one row, shape (..., P) to (..., m)."""
    samples = len(pixel_nodes(model)[2])
    sides = _sides_of_pixels(values.shape[-1], samples)
    rows = values.reshape(-1, values.shape[-1])
    return fitted(sides @ rows.T, samples).reshape(*values.shape[:-1], sides.shape[0])


@cache
def _sides_of_pixels(pixels: int, samples: int) -> csr_array:
    """From values at pixels to what `fitted` takes of the samples between them, shape (m, P)."""
    steps = (samples - 1) // SPLINE_SAMPLES
    places = np.clip(_places_in_pixels(pixels, steps), 0, pixels - 1)
    left = np.minimum(places.astype(np.int64), pixels - 2)
    share = places - left
    between = csr_array(
        (
            np.stack([1 - share, share], axis=1).ravel(),
            np.stack([left, left + 1], axis=1).ravel(),
            2 * np.arange(samples + 1),
        ),
        shape=(samples, pixels),
    )
    return csr_array(sampled(samples, steps + 3) @ between)


def _places_in_pixels(pixels: int, steps: int) -> Array:
    """Places of the samples in pixels, so many steps between nodes along them."""
    return np.arange(SPLINE_SAMPLES * steps + 1) / SPLINE_SAMPLES * pixels / steps - 0.5


def random_field(x: Array, length: float, nodes: int, smallest: float = SMALLEST) -> Array:
    """Modes of a smooth random field at the nodes, shape (k, m); see `karhunen_loeve`.

    Parameters
    ----------
    x : ndarray, shape (s,)
        Places of samples, as those of `Uncertainty` [m].
    length : float
        Correlation length [m].
    nodes : int
        Number of nodes m.
    smallest : float
        As of `karhunen_loeve`.
    """
    samples = x[:: SPLINE_SAMPLES // FIELD_SAMPLES]
    return coefficients(karhunen_loeve(samples, length, smallest), nodes)
