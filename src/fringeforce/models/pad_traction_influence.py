"""Light of the functions that tractions on tactels may have beside those of squares.

All functions of a tactel act through the same harmonics, so that the series is summed for those
tactels alone that are touched, and nothing is prepared for the others.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product

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

    def matrices(self, x: Array, y: Array, begin: Index, end: Index) -> dict[int, Single]:
        """Retardance of some functions of every tactel at all pairs of places.

        Parameters
        ----------
        x, y : ndarray, shape (c,), (r,)
            Places [m].
        begin, end : ndarray of int, shape (n,)
            The functions of each tactel, from the first to before the last.

        Returns
        -------
        dict
            By tactel that has any, by N, T_x and T_y, (3, 2, modes, r * c, end - begin) [rad/N].
        """
        synthesis, places = self.series.synthesis, self.series.at(x, y)
        (first, second), (_, rows) = synthesis.orders, self.series.base.count
        shape = 3, *synthesis.waves.shape[:2], len(y) * len(x)
        found = {
            tactel: np.empty((*shape, end[tactel] - begin[tactel]), dtype=np.float32)
            for tactel in np.flatnonzero(end > begin).tolist()
        }
        for row in sorted({tactel % rows for tactel in found}):
            own = [tactel for tactel in found if tactel % rows == row]
            for numbers, spectra, loads in self._kinds:
                low, high = np.searchsorted(numbers, [begin[own].min(), end[own].max()])
                shapes = synthesis.ordered(spectra[low:high])[:, None]
                for (part, c), (to_x, to_y), (load_x, load_y) in _pairs(places, loads):
                    # tactels beside each other share half of the sum
                    wave = synthesis.waves[part, :, c]
                    half = (shapes * wave) @ (to_y * load_y[0, second, row]).T
                    for tactel in own:
                        ends = [begin[tactel], end[tactel]]
                        some = slice(*np.searchsorted(numbers[low:high], ends))
                        image = (to_x * load_x[0, first, tactel // rows]) @ half[some]
                        flat = image.transpose(1, 3, 2, 0).reshape(len(wave), shape[-1], -1)
                        found[tactel][c, part][..., numbers[low:high][some] - ends[0]] = flat
        return found


def _pairs(
    places: list[tuple[Single, Single]], loads: Loads
) -> Iterator[tuple[tuple[int, int], tuple[Single, Single], tuple[Single, Single]]]:
    """Numbers of parts of the retardance and of components of forces, and what belongs to each."""
    for (part, place), (component, load) in product(enumerate(places), enumerate(loads)):
        yield (part, component), place, load
