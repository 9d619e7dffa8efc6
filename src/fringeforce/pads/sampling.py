"""Some pixels of a frame and the whole influence there: curvature, covariance, and searches.

Influences are smooth, so that a lattice of some thousands of pixels says of the curvature what all
would say.  Searches take pixels of an additive recurrence (Roberts's R2 sequence, after the plastic
number), which is even as well but no lattice, so that all kinds of a mosaic are among them.
"""

from __future__ import annotations

from dataclasses import dataclass

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
        return seen, self._rows(by_slice)

    def _rows(self, by_slice: Single) -> Single:
        """Derivatives by the forces, shape (m, 3 n), of what has these by the slices."""
        by_mode = np.stack([self.profile.T @ by_slice[:, part] for part in range(2)])
        rows = np.empty((by_slice.shape[2], self.influence.shape[3]), dtype=np.float32)
        _combine(self.influence.reshape(-1, *rows.shape), by_mode.reshape(-1, len(rows)), rows)
        return rows

    def information(self, forces: Array) -> Array:
        """Sum over the pixels of the squared derivatives of the intensity, shape (3 n, 3 n).

        Each pixel stands for its neighbours of all kinds, and counts with the mean of their forms.
        """
        stack = self.slices(forces)
        light = np.empty((3, stack.shape[2]), dtype=np.float32)
        turn(stack, light)
        total = np.zeros((len(forces), len(forces)))
        for pull in _roots(light, self.packed):
            by_slice = np.empty_like(stack)
            turn_back(stack, light.copy(), pull, by_slice)
            rows = self._rows(by_slice)
            total += rows.T @ rows
        return total


def _roots(light: Single, packed: Single) -> list[Single]:
    """Two derivatives by the light whose squares sum up to the mean over the forms."""
    q = packed[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3) * np.float32(0.5)
    q += q * np.eye(3, dtype=np.float32)
    slopes = np.float32(2) * np.einsum("kij,jp->kip", q, light)
    # light moves on a sphere: two directions across it, the first away from the nearest axis
    away = np.where(np.abs(light[2]) < np.float32(0.9), 1.0, 0.0).astype(np.float32)
    first = np.cross(light, np.stack([1 - away, 0 * away, away]), axis=0)
    first /= np.sqrt((first**2).sum(axis=0))
    second = np.cross(light, first, axis=0)
    along, across = (np.einsum("kip,ip->kp", slopes, e) for e in (first, second))
    aa, ab, bb = (along**2).mean(0), (along * across).mean(0), (across**2).mean(0)
    # Cholesky's factor of the matrix of two rows
    root = np.sqrt(aa)
    lean = np.divide(ab, root, out=np.zeros_like(ab), where=root > 0)
    rest = np.sqrt(np.clip(bb - lean**2, 0, None))
    return [root * first + lean * second, rest * second]


def sampled(model: PadModel, channel: int, count: int) -> Sampling:
    """Pixels of one channel of a pad, spread evenly but not on a lattice."""
    x, y = model.sensor.pixel_positions
    numbers = np.arange(1, count + 1)
    column = ((numbers / PLASTIC + 0.5) % 1 * len(x)).astype(np.intp)
    row = ((numbers / PLASTIC**2 + 0.5) % 1 * len(y)).astype(np.intp)
    return _at(model, channel, row, column)


def lattice(model: PadModel, channel: int, side: int) -> Sampling:
    """Pixels of one channel in `side` even rows and columns, or all where there are fewer."""
    numbers = [
        ((np.arange(min(side, n)) + 0.5) * n / min(side, n)).astype(np.intp)
        for n in model.frame_shape[-2:]
    ]
    row, column = (places.ravel() for places in np.meshgrid(*numbers, indexing="ij"))
    return _at(model, channel, row, column)


def _at(model: PadModel, channel: int, row: NDArray[np.intp], column: NDArray[np.intp]) -> Sampling:
    picture = model.pictures[channel]
    x, y = model.sensor.pixel_positions
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
