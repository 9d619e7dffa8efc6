"""Light of the functions that tractions on tactels may have beside those of squares.

All functions of a tactel act through the same harmonics, so that the series is summed for those
tactels alone that are touched, and nothing is prepared for the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array, Index, Single
from fringeforce.design.pad import Pad
from fringeforce.mechanics.solid.block import Patches
from fringeforce.mechanics.solid.fourier import load_harmonics
from fringeforce.models import splines
from fringeforce.models.pad_influence import PadInfluence
from fringeforce.models.pad_slices import block_of, profile_waves
from fringeforce.models.pad_traction_modes import TractionMode

Trig = tuple[Single, Single]


@dataclass(frozen=True, eq=False)
class TractionInfluence:
    """Retardance of t functions on n tactels, per unit deviation and force.

    Attributes
    ----------
    pad : Pad
        The design.
    base : PadInfluence
        Whose depth profiles and samples are taken.
    functions : tuple of TractionMode, length t
        The functions.
    """

    pad: Pad
    base: PadInfluence
    functions: tuple[TractionMode, ...]

    @cached_property
    def _series(self) -> tuple[Array, Array, Single]:
        """Wave numbers, shape (m,) and (n,), and waves, shape (2, modes, 3, m, n) [rad/Pa]."""
        weights = block_of(self.pad).depths(len(self.base.profile))[1]
        alpha, beta, waves = profile_waves(self.pad, self.base.profile, weights)
        return alpha, beta, waves.astype(np.float32)

    @cached_property
    def _kinds(self) -> list[tuple[Index, Single, list[Trig]]]:
        """Functions of the same mirror signs: numbers (l,), spectra (l, m, n) and loads.

        Loads are harmonics of point forces, as of `load_harmonics`.
        """
        alpha, beta, _ = self._series
        block, places = block_of(self.pad), Patches(self.pad.tactels.places)
        signs, found = [one.shape.odd for one in self.functions], []
        for odd in sorted(set(signs)):
            numbers = np.flatnonzero([own == odd for own in signs])
            spectra = np.array([self.functions[k].shape.spectrum for k in numbers], np.float32)
            loads = load_harmonics(block, places, alpha, beta, odd)
            single = [(x.astype(np.float32), y.astype(np.float32)) for x, y in loads]
            found.append((numbers, spectra, single))
        return found

    @cached_property
    def _synthesis(self) -> tuple[Trig, Trig]:
        """From harmonics to spline coefficients along x and along y, for A and for B."""
        alpha, beta, _ = self._series
        t = self.pad.transducer
        (cos_x, sin_x), (cos_y, sin_y) = (
            tuple(
                (splines.coefficients(samples) @ turn(at)).astype(np.float32)
                for turn in (np.cos, np.sin)
            )
            for samples, at in (
                (self.base.x, np.outer(self.base.x + t.length / 2, alpha)),
                (self.base.y, np.outer(self.base.y + t.width / 2, beta)),
            )
        )
        return (cos_x, cos_y), (sin_x, sin_y)

    def forward(self, shares: Array, forces: Array) -> Single:
        """Spline coefficients, shape (2, modes, ny, nx) [rad].

        Parameters
        ----------
        shares : ndarray, shape (t, n)
            Deviations.
        forces : ndarray, shape (n, 3)
            Forces that they are relative to [N].
        """
        _, _, waves = self._series
        harmonics = np.zeros(waves.shape[2:], dtype=np.float32)
        parts, acting = shares.astype(np.float32), forces.astype(np.float32)
        for tactel in np.flatnonzero(shares.any(axis=0)):
            for numbers, spectra, loads in self._kinds:
                spectrum = np.tensordot(parts[numbers, tactel], spectra, 1)
                for own, (x, y), force in zip(harmonics, loads, acting[tactel], strict=True):
                    own += np.outer(force * x[:, tactel], y[:, tactel]) * spectrum
        fields = np.einsum("fkcmn,cmn->fkmn", waves, harmonics)
        return np.stack(
            [
                across @ field.swapaxes(1, 2) @ along.T
                for field, (along, across) in zip(fields, self._synthesis, strict=True)
            ]
        )

    def adjoint(self, grid: Single, tactels: Index) -> Array:
        """From derivatives by the coefficients to those by shares times forces, (t, l, 3).

        Parameters
        ----------
        grid : ndarray, shape (2, modes, ny, nx)
            Derivatives by spline coefficients.
        tactels : ndarray of int, shape (l,)
            Those that are asked for.
        """
        _, _, waves = self._series
        fields = np.stack(
            [
                (across.T @ part @ along).swapaxes(1, 2)
                for part, (along, across) in zip(grid, self._synthesis, strict=True)
            ]
        )
        harmonics = np.einsum("fkcmn,fkmn->cmn", waves, fields)
        found = np.zeros((len(self.functions), len(tactels), 3))
        for k, tactel in enumerate(tactels):
            for numbers, spectra, loads in self._kinds:
                pulled = [
                    np.outer(x[:, tactel], y[:, tactel]) * own
                    for own, (x, y) in zip(harmonics, loads, strict=True)
                ]
                found[numbers, k] = np.tensordot(spectra, np.array(pulled), ((1, 2), (1, 2)))
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
        _, _, waves = self._series
        rows, columns = (
            splines.basis(samples, places).astype(np.float32)
            for samples, places in ((self.base.y, y), (self.base.x, x))
        )
        few = np.arange(len(self.functions))[chosen]
        found = np.empty((3, *waves.shape[:2], len(y) * len(x), len(few)), dtype=np.float32)
        for numbers, spectra, loads in self._kinds:
            own = np.flatnonzero(np.isin(few, numbers))
            shapes = spectra[np.isin(numbers, few)]
            for field, (along, across) in enumerate(self._synthesis):
                to_x, to_y = columns @ along, rows @ across
                for part, wave, (load_x, load_y) in zip(
                    found, waves[field].swapaxes(0, 1), loads, strict=True
                ):
                    lines = (to_x * load_x[:, tactel]) @ (wave[:, None] * shapes)
                    image = (to_y * load_y[:, tactel]) @ lines.swapaxes(2, 3)
                    flat = image.reshape(*image.shape[:2], len(y) * len(x))
                    part[field][..., own] = flat.swapaxes(1, 2)
        return found
