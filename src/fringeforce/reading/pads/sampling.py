"""Some pixels of a frame and the whole influence there: curvature, covariance, and searches.

Influences are smooth, so that a lattice of some thousands of pixels says of the curvature what all
would say; each pixel stands for its neighbours of all kinds, and counts with the mean of their
forms.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fringeforce.models.pad import PadModel
from fringeforce.optics.area_camera import Picture
from fringeforce.optics.integrated import turn_modes_back

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Sampling:
    """A lattice of pixels.

    Attributes
    ----------
    model : PadModel
        Of the pad.
    rows, columns : ndarray of int, shape (r,), (c,)
        Those of the image that the lattice is made of.
    influence : ndarray, shape (2, modes, r * c, 3 n)
        Retardance of the modes per force [rad/N].
    """

    model: PadModel
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    influence: Single

    @property
    def pixels(self) -> NDArray[np.intp]:
        """Numbers of the pixels in the flattened image, shape (r * c,)."""
        width = self.model.frame_shape[-1]
        return (self.rows[:, None] * width + self.columns).ravel()

    def modes(self, forces: Array) -> Single:
        """Retardance of the modes, shape (2, modes, r * c) [rad]."""
        return self.influence @ forces.astype(np.float32)

    def information(
        self, modes: Single, picture: Picture, light: Single, used: Mask | None = None
    ) -> Array:
        """Mean over the pixels of the squared derivatives of the intensity, shape (3 n, 3 n).

        Parameters
        ----------
        modes : ndarray, shape (2, modes, rows, columns)
            Retardance at all pixels of the image [rad].
        picture : Picture
            What they measure.
        light : ndarray, shape (3, P)
            The light behind it.
        used : ndarray of bool, shape (P,), optional
            Pixels that count; all if not given.
        """
        size = self.influence.shape[3]
        shares = np.ones(len(self.pixels), np.float32) if used is None else self._shares(used)
        stacked = [np.sqrt(shares) * slope for slope in self._slopes(modes, picture, light)]
        weights = np.stack(stacked).reshape(len(stacked), -1, len(shares))
        rows = np.empty((len(shares), len(stacked), size), dtype=np.float32)
        _combine(self.influence.reshape(-1, len(shares), size), weights, rows)
        flat = rows.reshape(-1, size)
        return (flat.T @ flat).astype(float) / len(shares)

    def _slopes(self, modes: Single, picture: Picture, light: Single) -> list[Single]:
        """Derivatives by the modes whose squares add up to the mean of all kinds of pixels."""
        profile = np.float32(picture.dispersion) * self.model.profile
        flat, pixels = modes.reshape(*modes.shape[:2], -1), self.pixels
        if self.model.lens is None:
            few, shone = np.ascontiguousarray(flat[:, :, pixels]), light[:, pixels]
            return [_back(few, profile, shone, pull) for pull in _roots(shone, picture.forms)]
        found = []
        for form in picture.forms:
            pull = (2 / np.sqrt(len(picture.forms)) * form).astype(np.float32) @ light
            # influences hardly change over the blur, so that it may act on the other factor alone
            image = _back(flat, profile, light, pull).reshape(modes.shape)
            blurred = self.model.lens.forward(image)[..., self.rows[:, None], self.columns]
            found.append(blurred.reshape(*modes.shape[:2], -1))
        return found

    def _shares(self, used: Mask) -> Single:
        """Share of the pixels around each of the lattice that are used, shape (r * c,)."""
        whole = used.reshape(self.model.frame_shape[-2:]).astype(np.float32)
        for axis, places in enumerate((self.rows, self.columns)):
            middles = (places[1:] + places[:-1] + 1) // 2
            starts = np.concatenate([[0], middles])
            counts = np.diff(np.append(starts, whole.shape[axis]))
            sums = np.add.reduceat(whole, starts, axis=axis)
            whole = sums / np.expand_dims(counts, 1 - axis)
        return whole.ravel().astype(np.float32)


def lattice(model: PadModel, side: int) -> Sampling:
    """Pixels in `side` even rows and columns, or all where there are fewer."""
    rows, columns = (
        ((np.arange(min(side, n)) + 0.5) * n / min(side, n)).astype(np.intp)
        for n in model.frame_shape[-2:]
    )
    x, y = model.sensor.pixel_positions
    places = np.meshgrid(x[columns], y[rows])
    return Sampling(model, rows, columns, model.influence.matrix(*(p.ravel() for p in places)))


def _back(modes: Single, profile: Single, light: Single, pull: Single) -> Single:
    gradient = np.empty_like(modes)
    turn_modes_back(modes, profile, light, pull, gradient)
    return gradient


def _roots(light: Single, forms: Array) -> list[Single]:
    """Two directions of light, shape (3, m), for a pixel of several kinds.

    The squared derivatives of the intensity along them add up to the mean over the kinds of that by
    the light.
    """
    slopes = np.einsum("kij,jp->kip", (2 * forms).astype(np.float32), light)
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


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, nogil=True)
def _combine(influence, weights, rows) -> None:
    """Sum influences, shape (f, m, n), with the weights of every row, shape (k, f, m)."""
    for i in range(len(rows)):
        rows[i] = 0
        for f in range(len(influence)):
            for k in range(len(weights)):
                _add(rows[i, k], weights[k, f, i], influence[f, i])


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, nogil=True)
def _add(target, share, source) -> None:
    for j in range(len(target)):
        target[j] += share * source[j]
