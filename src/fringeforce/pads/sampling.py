"""Some pixels of a frame and the whole influence there: curvature, covariance, and searches.

Where intensities are smooth from pixel to pixel, a few thousand of them say of the curvature what
all would say.  They are spread by an additive recurrence (Roberts's R2 sequence, after the plastic
number), so that the first so many of them are spread evenly as well.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fringeforce.optics.integrated import turn, turn_back
from fringeforce.pads.imaging import measure, measure_back
from fringeforce.pads.model import PadModel

Array = NDArray[np.float64]
Single = NDArray[np.float32]

PLASTIC = 1.324717957244746


@dataclass(frozen=True, eq=False)
class Sampling:
    """Some pixels of one picture.

    Attributes
    ----------
    pixels : ndarray of int, shape (m,)
        Their numbers in the flattened image.
    influence : ndarray, shape (2, modes, m, 3 n)
        Retardance of the modes per force [rad/N].
    profile : ndarray, shape (slices, modes)
        Of the modes over the slices.
    packed : ndarray, shape (k, 6)
        Quadratic forms of the picture.
    kinds : ndarray, shape (m,)
        Which of them each pixel measures.
    """

    pixels: NDArray[np.intp]
    influence: Single
    profile: Single
    packed: Single
    kinds: NDArray[np.uint8]

    def first(self, count: int) -> Sampling:
        """The first so many pixels, spread as evenly as all."""
        few = slice(0, count)
        return replace(
            self,
            pixels=self.pixels[few],
            influence=np.ascontiguousarray(self.influence[:, :, few]),
            kinds=self.kinds[few],
        )

    def slices(self, forces: Array) -> Single:
        """Retardance of every slice, shape (slices, 2, m)."""
        modes = self.influence @ forces.astype(np.float32)
        return np.stack([self.profile @ modes[0], self.profile @ modes[1]], axis=1)

    def evaluate(self, forces: Array, jacobian: bool = True) -> tuple[Single, Single]:
        """Intensities, shape (m,), and their derivatives by the forces, shape (m, 3 n).

        Parameters
        ----------
        forces : ndarray, shape (3 n,)
            N, T_x, T_y of tactel after tactel [N].
        jacobian : bool
            Whether the derivatives are wanted; they are empty if not.
        """
        stack = self.slices(forces)
        light = np.empty((3, stack.shape[2]), dtype=np.float32)
        turn(stack, light)
        seen = np.empty(stack.shape[2], dtype=np.float32)
        measure(light, self.packed, self.kinds, seen)
        if not jacobian:
            return seen, np.empty((0, 0), dtype=np.float32)
        pull, by_slice = np.zeros_like(light), np.empty_like(stack)
        measure_back(light, self.packed, self.kinds, np.ones_like(seen), pull)
        turn_back(stack, light, pull, by_slice)
        by_mode = np.stack([self.profile.T @ by_slice[:, part] for part in range(2)])
        rows = np.empty((stack.shape[2], self.influence.shape[3]), dtype=np.float32)
        _combine(self.influence.reshape(-1, *rows.shape), by_mode.reshape(-1, len(rows)), rows)
        return seen, rows


def sampled(model: PadModel, channel: int, count: int) -> Sampling:
    """Evenly spread pixels of one channel of a pad."""
    picture = model.pictures[channel]
    x, y = model.sensor.pixel_positions
    numbers = np.arange(1, count + 1)
    column = ((numbers / PLASTIC + 0.5) % 1 * len(x)).astype(np.intp)
    row = ((numbers / PLASTIC**2 + 0.5) % 1 * len(y)).astype(np.intp)
    pixels = row * len(x) + column
    return Sampling(
        pixels,
        model.influence.matrix(x[column], y[row]),
        (picture.dispersion * model.influence.profile).astype(np.float32),
        picture.packed,
        model.kinds[pixels],
    )


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, nogil=True)
def _combine(influence, weights, rows) -> None:
    """Sum influences, shape (f, m, n), with the weights of every row, shape (f, m)."""
    for i in range(len(rows)):
        row = rows[i]
        row[:] = row.dtype.type(0)
        for f in range(len(influence)):
            weight, part = weights[f, i], influence[f, i]
            for j in range(len(row)):
                row[j] += weight * part[j]
