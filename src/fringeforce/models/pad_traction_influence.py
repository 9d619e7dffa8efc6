"""Light of the functions that tractions on tactels may have beside those of squares.

All functions of a tactel act through the same harmonics, so that the series is summed for those
tactels alone that are touched, and nothing is prepared for the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array, Index, Single
from fringeforce.models.pad_series import Loads, PadSeries
from fringeforce.models.pad_traction_modes import TractionMode


@dataclass(frozen=True, eq=False)
class TractionInfluence:
    """Retardance of t functions on n tactels, per unit deviation and force.

    Attributes
    ----------
    series : PadSeries
        Of the pad.
    functions : tuple of TractionMode, length t
        The functions.
    """

    series: PadSeries
    functions: tuple[TractionMode, ...]

    @cached_property
    def _kinds(self) -> list[tuple[Index, Single, Loads]]:
        """Functions of the same mirror signs: numbers (l,), spectra (l, m, n) and loads."""
        signs, found = [one.shape.odd for one in self.functions], []
        for odd in sorted(set(signs)):
            numbers = np.flatnonzero([own == odd for own in signs])
            spectra = np.array([self.functions[k].shape.spectrum for k in numbers], np.float32)
            found.append((numbers, spectra, self.series.loads(self.series.pad, odd)))
        return found

    def forward(self, shares: Array, forces: Array) -> Single:
        """Spline coefficients, shape (2, modes, ny, nx) [rad].

        Parameters
        ----------
        shares : ndarray, shape (t, n)
            Deviations.
        forces : ndarray, shape (n, 3)
            Forces that they are relative to [N].
        """
        synthesis = self.series.synthesis
        harmonics = np.zeros(synthesis.waves.shape[2:], dtype=np.float32)
        for numbers, spectra, loads in self._kinds:
            acting = shares[numbers, :, None] * forces
            each = acting.astype(np.float32).reshape(len(numbers), *self.series.base.count, 3)
            for c, (own, (x, y)) in enumerate(zip(harmonics, loads, strict=True)):
                own += np.einsum("lmn,lmn->mn", x @ each[..., c] @ y.swapaxes(1, 2), spectra)
        return synthesis.modes(harmonics)

    def adjoint(self, grid: Single, tactels: Index) -> Array:
        """From derivatives by the coefficients to those by shares times forces, (t, l, 3).

        Parameters
        ----------
        grid : ndarray, shape (2, modes, ny, nx)
            Derivatives by spline coefficients.
        tactels : ndarray of int, shape (l,)
            Those that are asked for.
        """
        harmonics = self.series.synthesis.adjoint(grid)
        found = np.zeros((len(self.functions), len(tactels), 3))
        for numbers, spectra, loads in self._kinds:
            for c, (own, (x, y)) in enumerate(zip(harmonics, loads, strict=True)):
                each = x.swapaxes(1, 2) @ (spectra * own) @ y
                found[numbers, :, c] = each.reshape(len(numbers), -1)[:, tactels]
        return found

    def matrix(self, x: Array, y: Array, tactel: int, chosen: slice) -> Single:
        """Retardance of functions on one tactel at all pairs of places.

        Parameters
        ----------
        x, y : ndarray, shape (c,), (r,)
            Places [m].
        tactel : int
            That whose force acts.
        chosen : slice
            Some of the functions.

        Returns
        -------
        ndarray, shape (3, 2, modes, r * c, l)
            By N, T_x and T_y, of l functions [rad/N].
        """
        synthesis, places = self.series.synthesis, self.series.at(x, y)
        first, second = synthesis.orders
        column, row = divmod(tactel, self.series.base.count[1])
        few = np.arange(len(self.functions))[chosen]
        shape = 3, *synthesis.waves.shape[:2], len(y) * len(x), len(few)
        found = np.empty(shape, dtype=np.float32)
        for numbers, spectra, loads in self._kinds:
            own = np.flatnonzero(np.isin(few, numbers))
            if not own.size:
                continue
            shapes = synthesis.ordered(spectra[np.isin(numbers, few)])
            for field, (to_x, to_y) in enumerate(places):
                waves = synthesis.waves[field].swapaxes(0, 1)
                for part, wave, (load_x, load_y) in zip(found, waves, loads, strict=True):
                    lines = (to_x * load_x[0, first, column]) @ (wave[:, None] * shapes)
                    image = (to_y * load_y[0, second, row]) @ lines.swapaxes(2, 3)
                    flat = image.reshape(*image.shape[:2], len(y) * len(x))
                    part[field][..., own] = flat.swapaxes(1, 2)
        return found
