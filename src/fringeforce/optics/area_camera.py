"""From light at every place to the grey levels that the camera's pixels are meant to have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.special import ndtr

from fringeforce.base.arrays import Array, Index, Single
from fringeforce.base.linear_map import LinearMap
from fringeforce.design.pad import Pad
from fringeforce.optics.arrangement import arranged

MOSAIC = ((0.0, 45.0), (135.0, 90.0))
"""Analysers of a polarisation camera before pixels of even and odd rows and columns [degrees]."""


@dataclass(frozen=True, eq=False)
class Picture:
    """One channel of a frame.

    Attributes
    ----------
    dispersion : float
        Retardance at the channel's wavelength over that at the polariscope's own wavelength.
    forms : ndarray, shape (k, 3, 3)
        Quadratic forms of the light that pixels measure: one, or those of a mosaic of four.
    """

    dispersion: float
    forms: Array

    @property
    def packed(self) -> Single:
        """Six coefficients of each form, of aa, bb, cc, ab, ac and bc, shape (k, 6)."""
        q = self.forms
        parts = [q[:, 0, 0], q[:, 1, 1], q[:, 2, 2]]
        parts += [2 * q[:, 0, 1], 2 * q[:, 0, 2], 2 * q[:, 1, 2]]
        return np.stack(parts, axis=1).astype(np.float32)


def pictures(pad: Pad) -> tuple[Picture, ...]:
    """What the channels of a pad measure."""
    light = pad.polariscope
    found = []
    for channel in light.pictures:
        dispersion = light.wavelength / (channel.wavelength or light.wavelength)
        if pad.camera.kind == "polarisation":
            angles = np.radians(MOSAIC).ravel()
            forms = [arranged("analyser", a, light.plates, dispersion) for a in angles]
        else:
            kind = channel.arrangement or "dark field"
            forms = [arranged(kind, np.radians(channel.angle), light.plates, dispersion)]
        v = light.visibility
        if v < 1:  # w' w = 1: light that has lost its polarisation is half as bright at any phase
            forms = [v * form + (1 - v) / 2 * np.eye(3) for form in forms]
        found.append(Picture(dispersion, np.array(forms)))
    return tuple(found)


def mosaic(rows: int, columns: int, kinds: int) -> NDArray[np.uint8]:
    """Number of the form that each pixel measures, shape (rows * columns,)."""
    if kinds == 1:
        return np.zeros(rows * columns, dtype=np.uint8)
    row, column = np.arange(rows)[:, None] % 2, np.arange(columns) % 2
    return (2 * row + column).astype(np.uint8).ravel()


FARTHEST = 6.0
"""Deviations of a point spread beyond which it is left out: 1e-9 of the light."""


@dataclass(frozen=True, eq=False)
class Lens(LinearMap):
    """Blur by a Gaussian point spread, separable; what lies beyond the pad is as its edge is.

    Attributes
    ----------
    rows, columns : sparse array, shapes (rows, rows) and (columns, columns)
        What spreads along either side of an image.
    """

    rows: csr_array
    columns: csr_array

    @classmethod
    def of(cls, pad: Pad) -> Lens | None:
        """The lens of a design; none if it is perfect."""
        if not (blur := pad.camera.blur):
            return None
        x, y = pad.pixel_positions
        return cls(_spread(y, blur), _spread(x, blur))

    @property
    def shapes(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Shape of an image, twice."""
        rows, columns = (one.indptr.size - 1 for one in (self.rows, self.columns))
        return (rows, columns), (rows, columns)

    def forward(self, values: Single) -> Single:
        """An image, shape (..., rows, columns), as the sensor sees it."""
        return along_axis(self.rows, along_axis(self.columns, values, -1), -2)

    def part(self, values: Single, rows: Index, columns: Index) -> Single:
        """The same at some rows and columns alone, shape (..., r, c)."""
        across, along = self.rows[rows].toarray(), self.columns[columns].toarray()
        return np.asarray(across @ values @ along.T)

    def adjoint(self, values: Single) -> Single:
        """The derivative by the image, from that by what the sensor sees."""
        return along_axis(self.rows.T, along_axis(self.columns.T, values, -1), -2)


def along_axis(spread: csr_array, values: Single, axis: int) -> Single:
    """A sparse matrix times what stands along one axis of images."""
    turned = np.moveaxis(values, axis, 0)
    found = spread @ np.ascontiguousarray(turned).reshape(len(turned), -1)
    return np.asarray(np.moveaxis(found.reshape(turned.shape), 0, axis), dtype=np.float32)


def _spread(places: Array, deviation: float) -> csr_array:
    pitch = places[1] - places[0]
    edges = np.append(places - pitch / 2, places[-1] + pitch / 2)
    edges[0], edges[-1] = -np.inf, np.inf
    shares = np.diff(ndtr((edges - places[:, None]) / deviation), axis=1)
    far = np.abs(np.subtract.outer(places, places)) > FARTHEST * deviation + pitch
    return csr_array(np.where(far, 0.0, shares).astype(np.float32))


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, nogil=True)
def measure(light, packed, kinds, intensity) -> None:
    """Fill in the intensity of every pixel, shape (P,), from light, shape (3, P)."""
    for i in range(len(intensity)):
        q = packed[kinds[i]]
        a, b, c = light[0, i], light[1, i], light[2, i]
        intensity[i] = (
            a * (q[0] * a + q[3] * b + q[4] * c) + b * (q[1] * b + q[5] * c) + q[2] * c * c
        )


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, nogil=True)
def measure_back(light, packed, kinds, weight, pull) -> None:
    """Add to the derivative by the light, shape (3, P), that by the intensity times its own."""
    two = light.dtype.type(2)
    for i in range(len(weight)):
        q = packed[kinds[i]]
        a, b, c, w = light[0, i], light[1, i], light[2, i], weight[i]
        pull[0, i] += w * (two * q[0] * a + q[3] * b + q[4] * c)
        pull[1, i] += w * (two * q[1] * b + q[3] * a + q[5] * c)
        pull[2, i] += w * (two * q[2] * c + q[4] * a + q[5] * b)
