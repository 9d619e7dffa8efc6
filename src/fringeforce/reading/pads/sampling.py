"""Some pixels of a frame and the whole influence there: curvature, covariance, and searches.

Influences are smooth, so that a lattice of some thousands of pixels says of the curvature what all
would say; each pixel stands for its neighbours of all kinds, and counts with the mean of their
forms.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fringeforce.models.as_built import RESIDUAL
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_influence import PadInfluence
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.optics.area_camera import Picture
from fringeforce.reading.pads.lattice import Lattice
from fringeforce.reading.pads.light import Place

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Mask = NDArray[np.bool_]

STEPPED_SIDE, STATED_SIDE = 48, 64
"""Rows and columns of pixels of the matrix of steps, and of a covariance, at least."""
EACH_TACTEL = 4
"""The same for each tactel of a row, at least: with three, squared distances of followed forces
were 1.15 times what was stated where light is retarded by 10 rad."""


@dataclass(frozen=True, eq=False)
class Sampling(Lattice):
    """The influence of squares at a lattice of pixels.

    Attributes
    ----------
    influence : ndarray, shape (2, modes, r * c, 3 n)
        Retardance of the modes per force [rad/N].
    uncertain : PadUncertainty, optional
        What is uncertain about the pad, if anything is.
    """

    influence: Single
    uncertain: PadUncertainty | None = None

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
        shares = np.ones(len(self.pixels), np.float32) if used is None else self.shares(used)
        stacked = [np.sqrt(shares) * slope for slope in self.slopes(modes, picture, light)]
        weights = np.stack(stacked).reshape(len(stacked), -1, len(shares))
        rows = np.empty((len(shares), len(stacked), size), dtype=np.float32)
        _combine(self.influence.reshape(-1, len(shares), size), weights, rows)
        flat = rows.reshape(-1, size)
        return (flat.T @ flat).astype(float) / len(shares)

    def joint_information(self, state: Place, used: Mask | None = None) -> tuple[Array, Mask]:
        """Mean over the pixels of the squared derivatives of the intensity by all unknowns.

        Parameters
        ----------
        state : State
            Where to take them.
        used : ndarray of bool, shape (channels * P,), optional
            Pixels that count; all if not given.

        Returns
        -------
        information : ndarray, shape (3 n + q, 3 n + q)
            Summed over the pictures.
        shown : ndarray of bool, shape (3 n + q,)
            Which unknowns it holds.
        """
        uncertain = self.uncertain
        assert uncertain is not None
        shown = uncertain.shown(state.forces if state.reference is None else state.reference)
        columns = self._columns(state, shown)
        loads = self.influence.shape[3]
        held = np.concatenate([np.ones(loads, dtype=bool), shown])
        total = np.zeros((columns.shape[2],) * 2)
        pixels = len(self.model.kinds)
        for k, (picture, light) in enumerate(zip(state.pictures, state.lights, strict=True)):
            count, forms = len(self.pixels), len(picture.forms)
            few = None if used is None else used[k * pixels : (k + 1) * pixels]
            root = np.sqrt(self._weights(forms, few))
            slopes = [root * slope for slope in self.each(state.modes, picture, light, state.lens)]
            weights = np.stack(slopes).reshape(forms, -1, count)
            rows = np.empty((count, forms, columns.shape[2]), dtype=np.float32)
            _combine(columns, weights, rows)
            place = loads + np.cumsum(shown) - 1
            for number, change in self.by_light(uncertain, state, k):
                rows[:, :, place[number]] = (root * change).T
            flat = rows.reshape(-1, rows.shape[2])
            total += (flat.T @ flat).astype(float) / count
        return total, held

    def _weights(self, forms: int, used: Mask | None) -> Single:
        """Weights of pixels of each kind, shape (r * c,)."""
        if used is None:
            return np.full(len(self.pixels), 1 / forms, np.float32)
        return self.shares(used) / np.float32(forms)

    def across(
        self, state: Place, others: Callable[[int, Single], Single], used: Mask | None = None
    ) -> tuple[Array, Array]:
        """Mean over the pixels of products of derivatives by all unknowns and by others.

        Parameters
        ----------
        state : State
            Where to take them.
        others : callable
            From the number of a picture, and derivatives of its intensity by the modes for every
            kind of pixels, shape (forms, 2 modes, r * c), to those by r others, (r, forms, r * c).
        used : ndarray of bool, shape (channels * P,), optional
            Pixels that count; all if not given.

        Returns
        -------
        across : ndarray, shape (3 n + q, r)
            Summed over the pictures; zero for unknowns that do not show.
        own : ndarray, shape (r, r)
            The same of products of derivatives by others.
        """
        known, loads = self.uncertain, self.influence.shape[3]
        held = np.arange(loads)
        columns = self.influence.reshape(-1, len(self.pixels), loads)
        if known is not None:
            shown = known.shown(state.forces if state.reference is None else state.reference)
            held = np.concatenate([held, loads + np.flatnonzero(shown)])
            columns = self._columns(state, shown)
        size = loads if known is None else loads + known.size
        across, own, pixels = 0.0, 0.0, len(self.model.kinds)
        for k, (picture, light) in enumerate(zip(state.pictures, state.lights, strict=True)):
            few = None if used is None else used[k * pixels : (k + 1) * pixels]
            weights = self._weights(len(picture.forms), few)
            each = np.stack(self.each(state.modes, picture, light, state.lens))
            slopes = each.reshape(len(each), -1, each.shape[-1])
            changes = others(k, slopes)
            pulls = np.einsum("qsp,sfp->fqp", weights * changes, slopes)
            found = np.zeros((size, len(changes)))
            found[held] = np.matmul(pulls, columns).sum(axis=0).T
            if known is not None:
                for number, change in self.by_light(known, state, k):
                    found[loads + number] += (weights * changes).reshape(len(changes), -1) @ (
                        change.ravel()
                    )
            across += found / len(self.pixels)
            flat = changes.reshape(len(changes), -1)
            own += (weights * changes).reshape(flat.shape) @ flat.T / len(self.pixels)
        return np.asarray(across), np.asarray(own, dtype=float)

    def _columns(self, state: Place, shown: Mask) -> Single:
        """Derivatives of the retardance by forces and unknowns that show, (2 modes, r c, m)."""
        uncertain, forces, extra = self.uncertain, state.forces, state.extra
        assert uncertain is not None
        loads = self.influence.shape[3]
        place = loads + np.cumsum(shown) - 1
        size = loads + int(shown.sum())
        columns = np.zeros((*self.influence.shape[:3], size), dtype=np.float32)
        columns[..., :loads] = self.influence
        single = forces.astype(np.float32)
        loaded = single if state.reference is None else state.reference.astype(np.float32)
        for (group, _), powers in zip(uncertain.values, self._values, strict=True):
            unknown = float(extra[group.begin])
            for power, change in enumerate(powers, 1):
                if unknown:
                    columns[..., :loads] += np.float32(unknown**power) * change
                slope = np.float32(power * unknown ** (power - 1))
                columns[..., place[group.begin]] += slope * (change @ single)
        if uncertain.contacts is not None:
            rows, forces_on = columns.reshape(-1, size), loaded.reshape(-1, 3)
            counts = uncertain.deviations(shown).sum(axis=0)  # the strongest functions
            numbers, deviations = uncertain.deviations(place), uncertain.deviations(extra)
            for tactel in np.flatnonzero(counts).tolist():
                own = slice(counts[tactel])
                parts = self._contact(tactel, int(counts[tactel])).reshape(3, len(rows), -1)
                rows[:, numbers[own, tactel]] = np.tensordot(forces_on[tactel], parts, 1)
                if state.reference is None:
                    spread = deviations[own, tactel].astype(np.float32)
                    rows[:, 3 * tactel : 3 * tactel + 3] += (parts @ spread).T
        for number, moved in uncertain.moved(state.modes, self.rows, self.columns):
            columns[..., place[number]] = moved.reshape(*moved.shape[:2], -1)
        if group := uncertain.group(RESIDUAL):
            fields, even = self._residual
            half = len(fields)
            for part in range(2):
                begin = int(place[group.begin]) + part * half
                columns[part, :, :, begin : begin + half] = even[:, None, None] * fields.T
        return columns.reshape(-1, len(self.pixels), size)

    @cached_property
    def _values(self) -> list[list[Single]]:
        """Changes of the influence with sizes and materials, each as `influence`."""
        assert self.uncertain is not None
        return [[self._matrix(one) for one in powers] for _, powers in self.uncertain.values]

    @cached_property
    def _contacts(self) -> dict[int, Single]:
        """Those of `_contact` that are known, by the tactel."""
        return {}

    def _contact(self, tactel: int, count: int) -> Single:
        """Influence of the first functions of a tactel's traction, (3, 2, modes, r * c, count)."""
        assert self.uncertain is not None
        assert self.uncertain.contacts is not None
        influence, known = self.uncertain.contacts, self._contacts.get(tactel)
        first = 0 if known is None else known.shape[-1]
        if first < count:
            added = influence.matrix(*self.places, tactel, slice(first, count))
            known = added if known is None else np.concatenate([known, added], axis=-1)
            self._contacts[tactel] = known
        assert known is not None
        return known[..., :count]

    def _matrix(self, influence: PadInfluence) -> Single:
        return influence.matrix(*self.places)

    @cached_property
    def _residual(self) -> tuple[Single, Single]:
        """Modes of one part of the residual at the lattice, and its depth profiles."""
        assert self.uncertain is not None
        return self.uncertain.residual_at(*self.places)


def for_steps(model: PadModel, uncertain: PadUncertainty | None = None) -> Sampling:
    """Pixels of a matrix that leads to the top."""
    return lattice(model, _side(model, STEPPED_SIDE), uncertain)


def for_covariance(model: PadModel, uncertain: PadUncertainty | None = None) -> Sampling:
    """Pixels of a matrix that tells a covariance."""
    return lattice(model, _side(model, STATED_SIDE), uncertain)


def _side(model: PadModel, least: int) -> int:
    return max(least, EACH_TACTEL * max(model.sensor.tactels.count))


def lattice(model: PadModel, side: int, uncertain: PadUncertainty | None = None) -> Sampling:
    """Pixels in `side` even rows and columns, or all where there are fewer."""
    rows, columns = (
        ((np.arange(min(side, n)) + 0.5) * n / min(side, n)).astype(np.intp)
        for n in model.frame_shape[-2:]
    )
    influence = model.influence.matrix(*Lattice(model, rows, columns).places)
    return Sampling(model, rows, columns, influence, uncertain)


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
