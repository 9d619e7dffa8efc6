"""Light of the functions that tractions on tactels may have beside those of squares.

All functions of a tactel act through the same harmonics, so that the series is summed for those
tactels alone that are touched, and nothing is prepared for the others.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from fringeforce.base.arrays import Array, Index, Single
from fringeforce.models.pad_series import Loads, PadSeries
from fringeforce.models.pad_synthesis import Synthesis
from fringeforce.models.pad_traction_modes import TractionMode
from fringeforce.models.pad_turned_influence import TurnedSeries

Kind = tuple[tuple[int, int], Index, Single]
"""Mirror signs of functions, their numbers, shape (l,), and spectra, (l, m, n)."""


@dataclass(frozen=True, eq=False)
class TractionInfluence:
    """Retardance of t functions on n tactels, per unit deviation and force.

    Attributes
    ----------
    series : PadSeries
        Of the pad.
    functions : tuple of TractionMode, length t
        The functions.
    turned : TurnedSeries, optional
        Where layers or pitch are off.
    known : tuple of Kind, optional
        Of the functions, if they are known.
    """

    series: PadSeries
    functions: tuple[TractionMode, ...]
    turned: TurnedSeries | None = None
    known: tuple[Kind, ...] | None = None

    def under(self, turned: TurnedSeries) -> TractionInfluence:
        """The same on a pad whose layers and pitch are off."""
        return replace(self, turned=turned, known=self._spectra)

    @cached_property
    def _spectra(self) -> tuple[Kind, ...]:
        """Functions by their mirror signs."""
        if self.known is not None:
            return self.known
        signs, found = [one.shape.odd for one in self.functions], list[Kind]()
        for odd in sorted(set(signs)):
            numbers = np.flatnonzero([own == odd for own in signs])
            spectra = np.array([self.functions[k].shape.spectrum for k in numbers], np.float32)
            found.append((odd, numbers, spectra))
        return tuple(found)

    @cached_property
    def _kinds(self) -> list[tuple[Index, Single, Loads]]:
        """Functions of the same mirror signs: numbers (l,), spectra (l, m, n) and loads."""
        tactels = None if self.turned is None else self.turned.tactels
        pad = tactels or self.series.pad
        return [
            (numbers, spectra, self.series.loads(pad, odd))
            for odd, numbers, spectra in self._spectra
        ]

    @cached_property
    def _synthesis(self) -> Synthesis:
        found = self.series.synthesis
        return found if self.turned is None else replace(found, waves=self.turned.own_waves)

    def harmonics(self, shares: Array, forces: Array) -> Single:
        """Harmonics of N, T_x and T_y, shape (3, m, n), of what `forward` takes."""
        found = np.zeros(self.series.synthesis.waves.shape[2:], dtype=np.float32)
        for numbers, spectra, loads in self._kinds:
            acting = shares[numbers, :, None] * forces
            each = acting.astype(np.float32).reshape(len(numbers), *self.series.base.count, 3)
            for c, (own, (x, y)) in enumerate(zip(found, loads, strict=True)):
                own += np.einsum("lmn,lmn->mn", x @ each[..., c] @ y.swapaxes(1, 2), spectra)
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
        return self._synthesis.modes(self.harmonics(shares, forces))

    def adjoint(self, grid: Single, tactels: Index) -> Array:
        """From derivatives by the coefficients to those by shares times forces, (t, l, 3).

        Parameters
        ----------
        grid : ndarray, shape (2, modes, ny, nx)
            Derivatives by spline coefficients.
        tactels : ndarray of int, shape (l,)
            Those that are asked for.
        """
        harmonics = self._synthesis.adjoint(grid)
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
        synthesis, places = self._synthesis, self.series.at(x, y)
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
