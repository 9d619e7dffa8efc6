"""Contacts that explain a frame of a pad: damped least squares over grey levels.

The gradient is exact and takes all pixels, by the adjoint of light and of the series; its matrix
takes some thousands of pixels, dense beside the contacts and sparse elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from fringeforce.base.arrays import Array, Mask, Single
from fringeforce.estimation.levenberg_marquardt import SLOW, Curvature, Expansion, Stop, minimise
from fringeforce.estimation.likelihood import Misfit, Response
from fringeforce.models.as_built import RESIDUAL
from fringeforce.models.creep import Crept
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_skin import (
    FIRST_SHAPE,
    PLACE,
    SHAPE,
    SIZE_OF,
    PadSkinModel,
    matrix_of,
)
from fringeforce.models.pad_skin_uncertainty import PadSkinUncertainty
from fringeforce.models.pad_synthesis import Harmonics, Synthesis
from fringeforce.reading.pads.lattice import Lattice
from fringeforce.reading.pads.light import FrameLight, Prior, Shone, at_likeliest_scale

NEGLIGIBLE_GAIN = 8.0
"""Gain of the loss that a step promises, below which it is taken without evaluating it any more:
what it leaves is a tenth of that, a third of a standard deviation in sixty unknowns together."""
MOST_DEVIATIONS = 5.0
"""Standard deviations that an unknown of a tolerance is off at most: one in two million is.  Where
contacts are still wrong, a residual of many more would take over what they must explain."""
LINEAR_CHANGE = 0.1
"""Change of contacts, over their force and size, above which a last step is evaluated all the same:
light is not linear in it.  Two contacts at one place exchange much for little."""
DENSE_PITCH, SPARSE_PITCH = 2, 7
"""Pixels between those of the matrix, beside contacts and elsewhere."""
MOST_DENSE = 64
"""Dense rows or columns at most: contacts that need more are large, and what they do is smooth."""
DENSE_REACH = 3.0
"""How far beside a contact they are dense, in thicknesses of the cover."""
MIXTURES = 3
"""Mixtures of depth profiles of which the matrix is made: with all, deviations change by 0.3 %."""
WEAKEST = 1e-3
"""Normal force below which a contact is none [N]."""
CREEP_STEPS = 3
"""Gauss-Newton steps of what is uncertain of creep where nothing touches: light is nearly linear in
what is left of earlier contacts, a tenth of what they showed."""
SMALLEST_AXIS, LARGEST_AXIS = 0.1, 12.0
"""Limits of half axes, in thicknesses of the cover."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SkinPlace(Shone):
    """Contacts, and the light that they cause.

    Attributes
    ----------
    contacts : ndarray, shape (k, SIZE_OF)
        Their unknowns, as of `PadSkinModel`.
    loads : ndarray, shape (3, m, n)
        Harmonics of their tractions.
    synthesis : Synthesis
        From these to the retardance.
    left : Misfit
        What is left of the frame; its loss has the prior as well.
    """

    contacts: Array
    loads: Single
    synthesis: Synthesis
    left: Misfit


@dataclass(frozen=True, eq=False)
class SkinOptimum:
    """Contacts that explain a frame, as far as they do.

    Attributes
    ----------
    contacts : ndarray, shape (k, SIZE_OF)
        Their unknowns.
    extra : ndarray, shape (q,)
        Unknowns of tolerances.
    loss : float
        Twice the negative logarithm of the posterior, less a constant.
    place : SkinPlace
        Where all was evaluated last, a short step before.
    curvature : Curvature
        Used last, of the unknowns of contacts that were fitted and then of tolerances.
    free : ndarray of bool, shape (k, SIZE_OF)
        Those that were fitted.
    converged : bool
        Whether no step promises to gain more than `NEGLIGIBLE_GAIN`, or than was asked for.
    """

    contacts: Array
    extra: Array
    loss: float
    place: SkinPlace
    curvature: Curvature
    free: Mask
    converged: bool

    def taken(self, fit: SkinFit) -> int:
        """Degrees of freedom that the unknowns take: those that their prior does not hold."""
        _, std = fit.skin.drawn(len(self.contacts))
        covariance, count = self.curvature.covariance, int(self.free.sum())
        held = float((np.diag(covariance)[:count] / np.square(std[self.free])).sum())
        held += float(np.vdot(covariance[count:, count:], fit.known.precision))
        return int(np.clip(len(covariance) - held, 0, len(covariance)))


@dataclass(frozen=True, eq=False)
class SkinFit:
    """The posterior of contacts given one frame.

    Attributes
    ----------
    model : PadModel
        Of the pad, with the depth profiles of the skin.
    skin : PadSkinModel
        What contacts do.
    response : Response
        Of the camera.
    frame : ndarray, shape (channels * P,)
        Grey levels.
    used : ndarray of bool, shape (channels * P,), optional
        Pixels that count; all if not given.
    uncertain : PadSkinUncertainty, optional
        What is uncertain about the pad, if anything is.
    prior : Prior, optional
        Of the unknowns of tolerances; as stated if not given.
    crept : Crept, optional
        What creep of earlier loads adds to the harmonics of the tractions.
    """

    model: PadModel
    skin: PadSkinModel
    response: Response
    frame: Array
    used: Mask | None = None
    uncertain: PadSkinUncertainty | None = None
    prior: Prior | None = None
    crept: Crept | None = None

    @cached_property
    def known(self) -> Prior:
        """What is known of the unknowns of tolerances before the frame."""
        if self.uncertain is None:
            return Prior(np.zeros(0), np.zeros((0, 0)))
        return self.prior or Prior.stated(self.uncertain)

    @cached_property
    def _light(self) -> FrameLight:
        return FrameLight(self.model, self.response, self.frame, self.used, self.uncertain)

    def at(self, contacts: Array, extra: Array | None = None) -> SkinPlace:
        """Evaluate contacts, and unknowns (q,) of tolerances, at their means if not given."""
        other, loads = self.known.mean if extra is None else extra, self.skin.loads(contacts)
        if self.crept is not None:
            loads += self.crept.left.astype(np.float32)
        if self.uncertain is None:
            synthesis = self.skin.pixels
            modes = synthesis.modes(loads)
        else:
            synthesis = self.uncertain.synthesis(other)
            modes = self.uncertain.modes(synthesis, loads, other)
        shone = self._light.shone(modes, other)
        left = self._light.misfit(shone.level)
        mean, std = self.skin.drawn(len(contacts))
        loss = left.loss + np.square((contacts - mean) / std).sum() + self.known.loss(other)
        return SkinPlace(
            contacts=contacts,
            loads=loads,
            synthesis=synthesis,
            left=replace(left, loss=float(loss)),
            **vars(shone),
        )

    def below(self, place: SkinPlace, limit: float, margin: float = 0.0) -> Mask:
        """Pixels that count and near which contacts cause less than a retardance [rad].

        Parameters
        ----------
        place : SkinPlace
            The contacts.
        limit : float
            The retardance.
        margin : float
            How near, along x and along y [m].
        """
        whole = 2 * self.skin.profile.sum(axis=0)
        size = np.hypot(*np.einsum("k,fkrc->frc", whole, place.modes))
        pitches = (float(places[1] - places[0]) for places in self.model.pixel_positions[::-1])
        size = maximum_filter(size, [2 * int(margin / pitch) + 1 for pitch in pitches]).ravel()
        few = np.concatenate([size * p.dispersion < limit for p in self.model.pictures])
        return few if self.used is None else few & self.used

    def gradient(self, place: SkinPlace, free: Mask) -> Array:
        """Half the derivative of the loss by the free unknowns, and by those of tolerances."""
        by_modes, by_light = self._light.back(place, place.left.slope)
        sums = place.synthesis.gather(by_modes)
        by_loads = place.synthesis.back(sums)
        found = np.zeros(place.contacts.shape)
        for one, own in zip(place.contacts, found, strict=True):
            own[:] = self.skin.gradient(one, by_loads)
        mean, std = self.skin.drawn(len(free))
        by_contacts = (found + (place.contacts - mean) / np.square(std))[free]
        by_extra = by_light + self.known.slope(place.extra)
        if self.uncertain is not None:
            by_extra += self.uncertain.by_mechanics(
                place.synthesis, place.loads, place.extra, by_modes, sums
            )
        return np.concatenate([by_contacts, by_extra])

    def without_contacts(self, extra: Array | None = None) -> SkinPlace:
        """No contact, with what is uncertain of creep as it explains the frame best."""
        none, crept = np.zeros((0, SIZE_OF)), self.crept
        if crept is None:
            return self.at(none, extra)
        off, fit, free = np.zeros(len(crept.modes)), self, none.astype(bool)
        changes = self._changes(crept)
        for _ in range(CREEP_STEPS):
            place = fit.at(none, extra)
            by_modes, _ = fit._light.back(place, place.left.slope)
            by_loads = place.synthesis.back(place.synthesis.gather(by_modes))
            slope = np.tensordot(crept.modes, by_loads, by_loads.ndim) + off
            known = fit.information(place, free, changes)[-len(off) :, -len(off) :]
            off = off - np.linalg.solve(known + np.eye(len(off)), slope)
            left = crept.left + np.tensordot(off, crept.modes, 1)
            fit = replace(self, crept=crept._replace(left=left))
        place = fit.at(none, extra)
        loss = place.left.loss + float(off @ off)
        return replace(place, left=replace(place.left, loss=loss))

    def _changes(self, crept: Crept) -> list[Harmonics]:
        """Changes of the tractions with what is uncertain of creep."""
        return [Harmonics(None, self.skin.lowest(own)) for own in crept.modes.astype(np.float32)]

    def by_creep(self, one: SkinOptimum) -> Array:
        """Change of the unknowns of an explanation with what is uncertain of creep.

        Returns
        -------
        ndarray, shape (m, u)
            For a standard deviation of each, of the unknowns that were fitted.
        """
        assert self.crept is not None
        changes = self._changes(self.crept)
        whole = self.information(one.place, one.free, changes)
        size = len(whole) - len(changes)
        return np.asarray(-one.curvature.covariance @ whole[:size, size:])

    def information(
        self, place: SkinPlace, free: Mask, changes: list[Harmonics] | None = None
    ) -> Array:
        """Half the expected second derivative of the loss by the same unknowns.

        And by changes of the tractions, which are apart from all before the frame.
        """
        (rows, tall), (across, wide) = self._lattice(place.contacts)
        lattice, known = Lattice(self.model, rows, across), self.uncertain
        pixels = place.lights[0].shape[1]
        shares, slopes, light = np.outer(tall, wide).ravel(), list[Single](), list[Array]()
        for k, (picture, shone) in enumerate(zip(place.pictures, place.lights, strict=True)):
            root = np.sqrt(shares).astype(np.float32)
            if self.used is not None:
                root *= np.sqrt(lattice.shares(self.used[k * pixels : (k + 1) * pixels]))
            weight = lattice.weight(place, k)
            if known is None and weight is None:
                found = lattice.slopes(place.modes, picture, shone)
            else:
                root /= np.float32(np.sqrt(len(picture.forms)))
                found = lattice.each(place.modes, picture, shone, place.lens)
            if weight is not None:
                found = [own * slope for own, slope in zip(weight, found, strict=True)]
            if known is not None:
                own = np.zeros((known.size, len(found), len(root)))
                for number, change in lattice.by_light(known, place, k):
                    own[number] = root * change
                light.append(own)
            slopes += [root * slope for slope in found]
        stacked = np.stack(slopes)
        few = _mixtures(stacked, place.modes[..., rows[:, None], across])
        by = [self._by_contacts(place, free, lattice, few)]
        if known is not None:
            by_extra = np.concatenate(light, axis=1)
            self._add_retardance(by_extra, place, lattice, stacked)
            self._add_values(by_extra, place, lattice, few)
            by.append(by_extra.reshape(known.size, -1))
        if changes:
            by.append(self._by_tractions(place, lattice, few, changes))
        # in double precision, for shapes are hardly told apart
        flat = np.concatenate(by)
        total = flat @ flat.T
        total *= place.amplitude**2 / float(np.mean(self.response.variance))
        _, std = self.skin.drawn(len(free))
        count = int(free.sum())
        total[np.diag_indices(count)] += 1 / np.square(std[free])
        own = slice(count, count + len(self.known.precision))
        total[own, own] += self.known.precision
        return total

    def _by_contacts(
        self, place: SkinPlace, free: Mask, lattice: Lattice, few: tuple[Single, Single]
    ) -> Array:
        """Derivatives of the intensity by the free unknowns of contacts."""
        columns = [
            one
            for each, which in zip(place.contacts, free, strict=True)
            for one in self.skin.derivatives(each, which)
        ]
        return self._by_tractions(place, lattice, few, columns)

    def _by_tractions(
        self,
        place: SkinPlace,
        lattice: Lattice,
        few: tuple[Single, Single],
        changes: list[Harmonics],
    ) -> Array:
        """Derivatives of the intensity by changes of the tractions."""
        mixed, pulls = few
        waves = self.skin.waves if self.uncertain is None else self.uncertain.waves(place.extra)
        synthesis = self.skin.rough(*self._places(place, lattice), mixed, waves)
        return synthesis.columns(changes, pulls)

    def _add_retardance(
        self, by_extra: Array, place: SkinPlace, lattice: Lattice, slopes: Single
    ) -> None:
        """Add what unknowns of camera and residual do to the intensity by the retardance."""
        known = self.uncertain
        assert known is not None
        for number, moved in known.camera.moved(place.modes, lattice.rows, lattice.columns):
            flat = moved.reshape(*moved.shape[:2], -1)
            by_extra[number] += np.einsum("sfkp,fkp->sp", slopes, flat)
        if group := known.group(RESIDUAL):
            fields, even = known.residual.at(*lattice.places)
            pulls = np.einsum("sfkp,k->fsp", slopes, even)
            each = pulls[:, None] * fields[:, None]
            by_extra[group.place] += each.reshape(-1, *each.shape[2:])

    def _add_values(
        self, by_extra: Array, place: SkinPlace, lattice: Lattice, few: tuple[Single, Single]
    ) -> None:
        """Add what unknowns of sizes and materials do."""
        known, (mixed, pulls) = self.uncertain, few
        assert known is not None
        lowest = self.skin.lowest(place.loads)
        for number, waves in known.waves_by_values(place.extra):
            synthesis = self.skin.rough(*self._places(place, lattice), mixed, waves)
            column = synthesis.columns([Harmonics(None, lowest)], pulls)
            by_extra[number] += column.reshape(len(pulls), -1)

    def _places(self, place: SkinPlace, lattice: Lattice) -> tuple[Array, Array]:
        """Where columns and rows of a lattice look under unknowns [m]."""
        if self.uncertain is None:
            return lattice.places
        x, y = self.uncertain.camera.looking(place.extra).pixel_positions
        return x[lattice.columns], y[lattice.rows]

    def _lattice(self, contacts: Array) -> list[tuple[NDArray[np.intp], Array]]:
        """Rows and columns of the matrix, and how many each stands for."""
        found, margin = [], DENSE_REACH * self.model.sensor.transducer.compliant.thickness
        matrices = np.array([matrix_of(one[SHAPE:FIRST_SHAPE]) for one in contacts])
        reach = np.linalg.norm(matrices.reshape(-1, 2, 2), axis=2)
        for axis, places in zip((1, 0), self.model.pixel_positions[::-1], strict=True):
            middle = contacts[:, PLACE + axis]
            half = reach[:, axis] + margin
            distances = np.abs(places[:, None] - middle) - half
            near = (distances < 0).any(axis=1)
            dense = max(DENSE_PITCH, int(near.sum()) // MOST_DENSE)
            kept, last = [], -SPARSE_PITCH
            for i, close in enumerate(near.tolist()):
                if i - last >= min(dense if close else SPARSE_PITCH, SPARSE_PITCH):
                    kept.append(i)
                    last = i
            index = np.array(kept)
            ends = np.concatenate([[0], (index[1:] + index[:-1] + 1) / 2, [len(places)]])
            found.append((index, np.diff(ends)))
        return found

    def climb(
        self,
        start: Array | SkinPlace,
        free: Mask,
        steps: int = 20,
        close: float = NEGLIGIBLE_GAIN,
        curvature: Curvature | None = None,
    ) -> SkinOptimum:
        """Climb from contacts that are nearly right.

        Parameters
        ----------
        start : ndarray, shape (k, SIZE_OF), or SkinPlace
            Their unknowns.
        free : ndarray of bool, shape (k, SIZE_OF)
            Which of them are fitted; the others stay.
        steps : int
            Largest number of steps.
        close : float
            Gain that a step promises below which it is the last.
        curvature : Curvature, optional
            Of a place near by, of the same unknowns.
        """
        here = start if isinstance(start, SkinPlace) else self.at(start)
        own = np.flatnonzero(free)

        def moved(place: SkinPlace, step: Array) -> tuple[Array, Array]:
            found = place.contacts.copy().ravel()
            found[own] += step[: len(own)]
            extra = np.clip(place.extra + step[len(own) :], -MOST_DEVIATIONS, MOST_DEVIATIONS)
            return self.limited(found.reshape(free.shape)), extra

        def expanded(place: SkinPlace) -> Expansion[SkinPlace]:
            def ahead(step: Array) -> tuple[SkinPlace, float]:
                there = self.at(*moved(place, step))
                return there, there.left.loss

            return Expansion(
                place.left.loss,
                self.gradient(place, free),
                lambda: Curvature(self.information(place, free)),
                ahead,
            )

        found = minimise(
            here,
            expanded,
            steps,
            Stop(close),
            damping=0.0,
            reuse=True,
            curvature=curvature,
            stale=SLOW,  # deviations of totals are then off by 1 % (rms), by 7 % at most
        )
        place, matrix = found.place, found.curvature
        assert matrix is not None
        loss, (contacts, extra) = place.left.loss - found.gain, moved(place, found.step)
        if _changed(place.contacts, contacts) > LINEAR_CHANGE:
            there = self.at(contacts, extra)
            if there.left.loss < place.left.loss:
                place = there
            contacts, extra, loss = place.contacts, place.extra, place.left.loss
        if self.uncertain is not None and self.crept is None:
            factor, extra = at_likeliest_scale(self.uncertain, self.known, extra)
            contacts = np.concatenate([factor * contacts[:, :PLACE], contacts[:, PLACE:]], axis=1)
        return SkinOptimum(contacts, extra, loss, place, matrix, free, found.converged)

    def limited(self, contacts: Array) -> Array:
        """Contacts that push, within the friction cone, on the pad, with sizes that make sense."""
        found, cover = contacts.copy(), self.model.sensor.transducer.compliant.thickness
        found[:, 0] = np.maximum(found[:, 0], WEAKEST)
        held = self.skin.friction * found[:, 0]
        shear = np.hypot(found[:, 1], found[:, 2])
        found[:, 1:PLACE] *= (held / np.maximum(shear, held))[:, None]
        pad = self.model.sensor.transducer
        ends = np.array([pad.length, pad.width]) / 2
        found[:, PLACE:SHAPE] = np.clip(found[:, PLACE:SHAPE], -ends, ends)
        low, high = np.log(SMALLEST_AXIS * cover), np.log(LARGEST_AXIS * cover)
        stretch = np.hypot(found[:, SHAPE + 1], found[:, SHAPE + 2])
        most = (high - low) / 2
        found[:, SHAPE + 1 : FIRST_SHAPE] *= (
            np.minimum(stretch, most) / np.maximum(stretch, 1e-12)
        )[:, None]
        found[:, SHAPE] = np.clip(found[:, SHAPE], low, high)
        return found


def _changed(before: Array, after: Array) -> float:
    """Largest change of contacts, over their force and size."""
    change = np.abs(after - before)
    change[:, :PLACE] /= before[:, :1]
    change[:, PLACE:SHAPE] /= np.exp(before[:, SHAPE : SHAPE + 1])
    return float(change.max(initial=0.0))


def _mixtures(slopes: Single, modes: Single) -> tuple[Single, Single]:
    """Few mixtures of depth profiles that what light makes of them needs.

    Parameters
    ----------
    slopes : ndarray, shape (s, 2, modes, p)
        Derivatives by the profiles.
    modes : ndarray, shape (2, modes, rows, columns)
        Retardance of the profiles, which says how much of each there is [rad].

    Returns
    -------
    mixed : ndarray, shape (modes, MIXTURES)
        What of each profile a mixture takes.
    slopes : ndarray, shape (s, 2 MIXTURES, p)
        Derivatives by the mixtures.
    """
    size = np.sqrt(np.square(modes).mean(axis=(0, 2, 3))) + np.float32(1e-12)
    scaled = slopes * size[:, None]
    _, vectors = np.linalg.eigh(np.einsum("sfkp,sflp->kl", scaled, scaled, optimize=True))
    chosen = vectors[:, : -MIXTURES - 1 : -1]
    few = np.einsum("sfkp,kr->sfrp", scaled, chosen, optimize=True)
    return chosen / size[:, None], few.reshape(len(slopes), -1, slopes.shape[-1])
