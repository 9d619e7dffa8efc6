"""Some pixels of a frame and the whole influence there: curvature, covariance, and searches.

Influences are smooth, so that a lattice of some thousands of pixels says of the curvature what all
would say; each pixel stands for its neighbours of all kinds, and counts with the mean of their
forms.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fringeforce.base.arrays import Index
from fringeforce.models import splines
from fringeforce.models.as_built import RESIDUAL
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_uncertainty import PadUncertainty
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
NEAR = 0.01
"""Share of its peak by which the influence in the matrix of steps and covariance may be another
than that of the unknowns: deviations are then as far off."""
AT_ONCE = 256
"""Functions of tractions of which so many are combined at once: some tens of megabytes."""


@dataclass(frozen=True, eq=False)
class Centre:
    """Matrices of a pad whose layers, pitch and camera are off, of the effect as drawn.

    Attributes
    ----------
    at : ndarray, shape (d,)
        How many deviations.
    places : (ndarray, ndarray)
        Where columns and rows of the lattice look [m].
    extra : ndarray, shape (q,)
        All unknowns, of which others do not count.
    influence : ndarray, shape (2, modes, r * c, 3 n)
        That of squares [rad/N].
    contacts : dict
        That of functions of tractions, by tactel, as far as it is known.
    """

    at: Array
    places: tuple[Array, Array]
    extra: Array
    influence: Single
    contacts: dict[int, Single] = field(default_factory=dict)


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

    def information(self, state: Place, k: int, used: Mask | None = None) -> Array:
        """Mean over the pixels of the squared derivatives of the intensity, shape (3 n, 3 n).

        Parameters
        ----------
        state : Place
            Where to take them.
        k : int
            Number of the picture.
        used : ndarray of bool, shape (channels * P,), optional
            Pixels that count; all if not given.
        """
        size, pixels = self.influence.shape[3], len(self.pixels)
        root, slopes = self._squares(state, k, used)
        weights = root * slopes
        rows = np.empty((pixels, len(weights), size), dtype=np.float32)
        _combine(self.influence.reshape(-1, pixels, size), weights, rows)
        flat = rows.reshape(-1, size)
        return (flat.T @ flat).astype(float) / pixels

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
        assert self.uncertain is not None
        shown, influence = self.uncertain.shown(state.about.forces), self._under(state)
        _, pixels, loads = influence.shape
        total = np.zeros((loads + int(shown.sum()),) * 2)
        for k in range(len(state.lights)):
            light = root, slopes = self._squares(state, k, used)
            weights = root * slopes
            rows = np.empty((pixels, len(weights), loads), dtype=np.float32)
            _combine(influence, weights, rows)
            one = rows.reshape(pixels * len(weights), loads)
            other = self._others(state, k, shown, light)
            total[:loads, :loads] += one.T @ one
            total[:loads, loads:] += one.T @ other
            total[loads:, loads:] += other.T @ other
        total[loads:, :loads] = total[:loads, loads:].T
        return total / pixels, np.concatenate([np.ones(loads, dtype=bool), shown])

    def others_information(self, state: Place, used: Mask | None = None) -> tuple[Array, Mask]:
        """The same by the unknowns of tolerances alone, shape (q, q)."""
        assert self.uncertain is not None
        shown = self.uncertain.shown(state.about.forces)
        total = np.zeros((int(shown.sum()),) * 2)
        for k in range(len(state.lights)):
            other = self._others(state, k, shown, self._squares(state, k, used))
            total += other.T @ other
        return total / len(self.pixels), shown

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
        known, influence = self.uncertain, self._under(state)
        shown = np.zeros(0, dtype=bool) if known is None else known.shown(state.about.forces)
        _, pixels, loads = influence.shape
        across, own = 0.0, 0.0
        for k in range(len(state.lights)):
            light = root, slopes = self._root(state, k, used), self._slopes(state, k)
            changes = root * others(k, slopes)
            pulls = np.einsum("qsp,sfp->fqp", root * changes, slopes)
            found = np.zeros((loads + len(shown), len(changes)))
            found[:loads] = np.matmul(pulls, influence).sum(axis=0).T
            flat = changes.swapaxes(1, 2).reshape(len(changes), -1)
            if known is not None:
                found[loads:][shown] = (flat @ self._others(state, k, shown, light)).T
            across += found / pixels
            own += (flat @ flat.T).astype(float) / pixels
        return np.asarray(across), np.asarray(own)

    def _root(self, state: Place, k: int, used: Mask | None) -> Single:
        """Roots of the weights of a picture's pixels of each kind, shape (r * c,)."""
        forms, pixels = len(state.pictures[k].forms), len(self.model.kinds)
        if used is None:
            return np.full(len(self.pixels), forms**-0.5, np.float32)
        return np.sqrt(self.shares(used[k * pixels : (k + 1) * pixels]) / np.float32(forms))

    def _squares(self, state: Place, k: int, used: Mask | None) -> tuple[Single, Single]:
        """As `_root` and `_slopes`, or of fewer kinds whose squares add up to the same."""
        root, known = self._root(state, k, used), self.uncertain
        bent = state.curve is not None or state.uneven is not None
        if bent or (known is not None and known.camera.acts_on_light):
            return root, self._slopes(state, k)
        each = np.stack(self.slopes(state.modes, state.pictures[k], state.lights[k]))
        root = root * np.float32(len(state.pictures[k].forms) ** 0.5)
        return root, each.reshape(len(each), -1, each.shape[-1])

    def _slopes(self, state: Place, k: int) -> Single:
        """Derivatives of a picture's intensity by the modes, shape (forms, 2 modes, r * c)."""
        each = np.stack(self.each(state.modes, state.pictures[k], state.lights[k], state.lens))
        each, weight = each.reshape(len(each), -1, each.shape[-1]), self.weight(state, k)
        return each if weight is None else each * weight[:, None]

    def _under(self, state: Place) -> Single:
        """Influence of squares as it is under unknowns, shape (2 modes, r * c, 3 n)."""
        known, found = self.uncertain, self.influence
        flat = 2 * found.shape[1], *found.shape[2:]
        if known is None:
            return found.reshape(flat)
        centre = self._near(state.extra)
        found, share = centre.influence, known.share(state.extra)
        for group, powers in known.values:
            if unknown := float(state.extra[group.begin]):
                if group.path not in self._values:
                    self._values[group.path] = [one.matrix(*self.places) for one in powers]
                for power, change in enumerate(self._values[group.path], 1):
                    found = np.asarray(found + np.float32(unknown**power) * change, np.float32)
        if known.contacts is not None and state.reference is None:
            # forces that tractions are spread by bring the spread along
            shown = known.shown(state.forces)
            shares = known.deviations(state.extra * shown).astype(np.float32)
            found = found.copy()
            for tactel, parts in self._contacts(
                centre, known.deviations(shown).sum(axis=0)
            ).items():
                spread = parts @ shares[: parts.shape[-1], tactel]
                found[..., 3 * tactel : 3 * tactel + 3] += np.moveaxis(spread, 0, -1)
        if share != 1:
            found = np.float32(share) * found
        return found.reshape(flat)

    def _near(self, extra: Array) -> Centre:
        """Matrices of layers, pitch and camera as they are under unknowns, or nearly so."""
        known = self.uncertain
        assert known is not None
        at = np.array([extra[group.begin] for group in known.seen_turning])
        for centre in self._centres:
            if not len(at) or np.abs(at - centre.at) @ known.turns < NEAR:
                return centre
        places, turned = self.places, self.influence
        if known.camera.moves(extra):
            x, y = known.camera.looking(extra).pixel_positions
            places = x[self.columns], y[self.rows]
            turned = known.model.influence.matrix(*places)
        for one in known.influence(extra).added:
            turned = turned + one.matrix(*places)
        centre = Centre(at, places, extra.copy(), turned)
        self._centres[1:] = [centre]
        return centre

    @cached_property
    def _centres(self) -> list[Centre]:
        """That of the drawing, and the last other one."""
        known = self.uncertain
        assert known is not None
        drawn = np.zeros(len(known.seen_turning)), self.places, np.zeros(known.size)
        return [Centre(*drawn, self.influence)]

    @cached_property
    def _values(self) -> dict[str, list[Single]]:
        """Changes of the influence with sizes and materials, each as `influence`."""
        return {}

    def _others(self, state: Place, k: int, shown: Mask, light: tuple[Single, Single]) -> Single:
        """Derivatives of a picture's intensity by unknowns that show, times roots of weights.

        Parameters
        ----------
        state : Place
            Where to take them.
        k : int
            Number of the picture.
        shown : ndarray of bool, shape (q,)
            Unknowns that show.
        light : (ndarray, ndarray)
            What `_root` and `_slopes` are.

        Returns
        -------
        ndarray, shape (r * c * forms, m)
        """
        known, place = self.uncertain, np.cumsum(shown) - 1
        assert known is not None
        root, slopes = light
        weights = root * slopes
        forms, _, count = weights.shape
        rows = np.empty((count, forms, int(shown.sum())), dtype=np.float32)
        for number, change in self._moved(state):
            rows[:, :, place[number]] = np.einsum("kfp,fp->pk", weights, change)
        if known.contacts is not None:
            for numbers, own in self._tractions(state, shown):
                shone = np.empty((count, forms, len(numbers)), dtype=np.float32)
                _combine(own.reshape(-1, count, len(numbers)), weights, shone)
                rows[:, :, place[numbers]] = shone
        if group := known.group(RESIDUAL):
            fields, even = self._residual
            halves = weights.reshape(forms, 2, -1, count)
            shares = np.einsum("kfmp,m->pkf", halves, even)[..., None]
            begin = int(place[group.begin])
            both = shares * fields.T[:, None, None]
            rows[:, :, begin : begin + 2 * len(fields)] = both.reshape(count, forms, -1)
        for number, change in self.by_light(known, state, k):
            rows[:, :, place[number]] = (root * change).T
        return rows.reshape(count * forms, rows.shape[2])

    def _moved(self, state: Place) -> Iterator[tuple[int, Single]]:
        """Numbers of unknowns of values and of the camera's place, and derivatives by them.

        The derivatives are those of the modes at the lattice, shape (2 modes, r * c) [rad].
        """
        known = self.uncertain
        assert known is not None
        (x, y), base = self._near(state.extra).places, known.model.influence
        columns, rows = splines.basis(base.x, x), splines.basis(base.y, y)
        grids = list(known.by_turning(state.forces, state.extra, state.reference))
        grids += known.by_scaling(state.forces, state.extra, state.reference)
        for number, grid in grids:
            image = np.asarray(rows @ grid @ columns.T, dtype=np.float32)
            yield number, image.reshape(-1, len(self.pixels))
        for group, powers in known.values:
            unknown = float(state.extra[group.begin])
            slopes = (power * unknown ** (power - 1) for power in range(1, len(powers) + 1))
            grid = sum(
                np.float32(slope) * change.forward(state.forces)
                for slope, change in zip(slopes, powers, strict=True)
            )
            image = np.asarray(rows @ grid @ columns.T, dtype=np.float32)
            yield group.begin, image.reshape(-1, len(self.pixels))
        for number, moved in known.camera.moved(state.modes, self.rows, self.columns):
            yield number, moved.reshape(-1, len(self.pixels))

    def _tractions(self, state: Place, shown: Mask) -> Iterator[tuple[Index, Single]]:
        """Numbers of unknowns of tractions that show, a few tactels' together, and derivatives.

        The derivatives are those of the modes at the lattice, shape (2, modes, r * c, l) [rad].
        """
        known, about = self.uncertain, state.about
        assert known is not None
        forces = about.forces.reshape(-1, 3).astype(np.float32)
        counts = known.deviations(shown).sum(axis=0)  # the strongest ones
        numbers = known.deviations(np.arange(known.size))
        # every tactel's would be written apart, and all at once would be large
        share = np.float32(known.share(about.extra))
        contacts, own, size = self._contacts(self._near(about.extra), counts), list[int](), 0
        for tactel in contacts:
            own.append(tactel)
            size += int(counts[tactel])
            if size >= AT_ONCE or tactel == max(contacts):
                parts = [np.tensordot(forces[k], contacts[k], 1) for k in own]
                few = [numbers[: counts[k], k] for k in own]
                yield np.concatenate(few), share * np.concatenate(parts, axis=-1)
                own, size = [], 0

    def _contacts(self, centre: Centre, counts: Index) -> dict[int, Single]:
        """Influence of the first functions of tractions, (3, 2, modes, r * c, count) by tactel.

        Parameters
        ----------
        centre : Centre
            Of layers, pitch and camera.
        counts : ndarray of int, shape (n,)
            How many functions of every tactel.
        """
        known = centre.contacts
        assert self.uncertain is not None
        light = self.uncertain.contacts_under(centre.extra)
        assert light is not None
        begin = np.zeros_like(counts)
        for tactel, parts in known.items():
            begin[tactel] = parts.shape[-1]
        added = light.matrices(*centre.places, begin, counts)
        for tactel, parts in added.items():
            if tactel in known:
                parts = np.concatenate([known[tactel], parts], axis=-1)
            known[tactel] = parts
        return {t: known[t][..., : counts[t]] for t in np.flatnonzero(counts).tolist()}

    @cached_property
    def _residual(self) -> tuple[Single, Single]:
        """Modes of one part of the residual at the lattice, and its depth profiles."""
        assert self.uncertain is not None
        return self.uncertain.residual.at(*self.places)


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
