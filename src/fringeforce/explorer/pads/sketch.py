"""A pad on few pixels, fast enough to follow a finger.

What every load adds to every pixel is worked out beforehand, by mirror symmetry on a quarter of the
pad; a finger loads few tactels, and the others cost nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fringeforce.base.arrays import Array, Single
from fringeforce.models import splines
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_symmetry import FIELDS, PARITIES, folded_weights, load_basis, unfold

NOTHING = 1e-7
"""Share of the largest load below which one is lost in single precision."""


@dataclass(frozen=True, eq=False)
class Sketch:
    """Retardance per load on the pixels of one model, even numbers of them along either side.

    Attributes
    ----------
    bases : tuple of ndarray, shape (m, 3 n)
        Loads of each of the four parities.
    columns : tuple of ndarray, shape (m, 2, modes, rows / 2, columns / 2)
        What they add to the modes, (A, B) on the quarter of negative x and y [rad/N].
    profile : ndarray, shape (slices, modes)
        What each mode adds to each slice.
    """

    bases: tuple[Single, ...]
    columns: tuple[Single, ...]
    profile: Single

    @classmethod
    def of(cls, model: PadModel) -> Sketch:
        """Work it out for the pixels of a model."""
        influence = model.influence
        x, y = model.sensor.pixel_positions
        along = splines.basis(influence.x, x[: len(x) // 2])
        across = splines.basis(influence.y, y[: len(y) // 2])
        shape = 2, influence.modes, len(influence.y) // 2, len(influence.x) // 2
        columns = []
        for parity, part in zip(PARITIES, influence.quarters, strict=True):
            loads_first = np.moveaxis(part.reshape(*shape, -1), -1, 0)
            own = np.empty((len(loads_first), *shape[:2], len(across), len(along)), np.float32)
            for field, mirrored in enumerate(FIELDS):
                columns_of = folded_weights(along, parity[0] * mirrored[0]).astype(np.float32)
                rows_of = folded_weights(across, parity[1] * mirrored[1]).astype(np.float32)
                own[:, field] = rows_of @ loads_first[:, field] @ columns_of.T
            columns.append(own)
        bases = [load_basis(influence.count, parity).astype(np.float32) for parity in PARITIES]
        return cls(tuple(bases), tuple(columns), influence.profile.astype(np.float32))

    def modes(self, forces: Array) -> Single:
        """Single-pass retardance of every depth profile at every pixel, as `PadModel.modes`.

        Parameters
        ----------
        forces : ndarray, shape (n, 3)
            N, T_x, T_y of every tactel [N].

        Returns
        -------
        ndarray, shape (2, modes, rows, columns)
            (A, B) of every profile [rad].
        """
        _, *fields, rows, columns = self.columns[0].shape
        whole = np.zeros((*fields, 2 * rows, 2 * columns), dtype=np.float32)
        loads = forces.astype(np.float32).ravel()
        least = NOTHING * np.abs(loads).max(initial=0)
        for parity, basis, own in zip(PARITIES, self.bases, self.columns, strict=True):
            weights = basis @ loads
            used = np.flatnonzero(np.abs(weights) > least)
            quarter = np.tensordot(weights[used], own[used], axes=1)
            for field, mirrored in enumerate(FIELDS):
                signs = parity[0] * mirrored[0], parity[1] * mirrored[1]
                unfold(quarter[field], signs, whole[field])
        return whole

    def slices(self, forces: Array) -> Single:
        """Single-pass retardance of every slice at every pixel, as `PadModel.slices`."""
        modes = self.modes(forces)
        found = self.profile @ modes.reshape(*modes.shape[:2], -1)
        return np.ascontiguousarray(found.swapaxes(0, 1)).reshape(-1, 2, *modes.shape[2:])
