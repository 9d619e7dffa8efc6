"""Contacts that explain a frame of a pad: damped least squares over grey levels.

The gradient is exact and takes all pixels, by the adjoint of light and of the series; its matrix
takes some thousands of pixels, dense beside the contacts and sparse elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from fringeforce.base.arrays import Array, Mask, Single
from fringeforce.estimation.levenberg_marquardt import Curvature, Expansion, Stop, minimise
from fringeforce.estimation.likelihood import Misfit, Response, misfit
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_skin import FIRST, PLACE, SHAPE, PadSkinModel, matrix_of
from fringeforce.reading.pads.sampling import Sampling

CLOSE = 8.0
"""Gain of the loss that a step promises, below which it is taken without evaluating it any more:
what it leaves is a tenth of that, a third of a standard deviation in sixty unknowns together."""
DENSE, SPARSE = 2, 7
"""Pixels between those of the matrix, beside contacts and elsewhere."""
MOST_DENSE = 64
"""Dense rows or columns at most: contacts that need more are large, and what they do is smooth."""
BESIDE = 3.0
"""How far beside a contact they are dense, in thicknesses of the cover."""
MIXTURES = 3
"""Mixtures of depth profiles of which the matrix is made: with all, deviations change by 0.3 %."""
WEAKEST = 1e-3
"""Normal force below which a contact is none [N]."""
SMALLEST, LARGEST = 0.1, 12.0
"""Limits of half axes, in thicknesses of the cover."""


@dataclass(frozen=True, eq=False)
class SkinPlace:
    """Contacts, and the light that they cause.

    Attributes
    ----------
    contacts : ndarray, shape (k, SIZE_OF)
        Their unknowns, as of `PadSkinModel`.
    modes : ndarray, shape (2, modes, rows, columns)
        Retardance [rad].
    lights : list of ndarray, shape (3, P)
        Light of every channel.
    left : Misfit
        What is left of the frame; its loss has the prior as well.
    """

    contacts: Array
    modes: Single
    lights: list[Single]
    left: Misfit


@dataclass(frozen=True, eq=False)
class SkinOptimum:
    """Contacts that explain a frame, as far as they do.

    Attributes
    ----------
    contacts : ndarray, shape (k, SIZE_OF)
        Their unknowns.
    loss : float
        Twice the negative logarithm of the posterior, less a constant.
    place : SkinPlace
        Where all was evaluated last, a short step before.
    curvature : Curvature
        Used last, of the unknowns that were fitted.
    free : ndarray of bool, shape (k, SIZE_OF)
        Those.
    """

    contacts: Array
    loss: float
    place: SkinPlace
    curvature: Curvature
    free: Mask


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
    """

    model: PadModel
    skin: PadSkinModel
    response: Response
    frame: Array
    used: Mask | None = None

    def at(self, contacts: Array) -> SkinPlace:
        """Evaluate contacts."""
        modes = self.skin.pixels.modes(self.skin.loads(contacts))
        lights = [self.model.light(modes, picture) for picture in self.model.pictures]
        seen = [
            self.model.measured(light, picture, self.model.lens)
            for light, picture in zip(lights, self.model.pictures, strict=True)
        ]
        level = self.response.amplitude * np.concatenate(seen).astype(float) + self.response.offset
        if self.used is None:
            left = misfit(self.frame, level, self.response)
        else:
            few = misfit(self.frame[self.used], level[self.used], self.response)
            slope, weight = np.zeros((2, len(self.frame)))
            slope[self.used], weight[self.used] = few.slope, few.weight
            left = Misfit(few.loss, slope, weight)
        mean, std = self.skin.drawn(len(contacts))
        prior = float(np.square((contacts - mean) / std).sum())
        return SkinPlace(contacts, modes, lights, replace(left, loss=left.loss + prior))

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
        """Half the derivative of the loss by the free unknowns."""
        scale = np.float32(np.mean(self.response.amplitude) / np.sqrt(self.response.variance))
        pulls = (scale * place.left.slope.astype(np.float32)).reshape(len(place.lights), -1)
        by_modes = reduce(
            np.add,
            (
                self.model.picture_adjoint(place.modes, picture, light, pull, self.model.lens)
                for picture, light, pull in zip(
                    self.model.pictures, place.lights, pulls, strict=True
                )
            ),
        )
        by_loads = self.skin.pixels.adjoint(by_modes)
        found = np.array([self.skin.gradient(one, by_loads) for one in place.contacts])
        mean, std = self.skin.drawn(len(free))
        return (found + (place.contacts - mean) / np.square(std))[free]

    def information(self, place: SkinPlace, free: Mask) -> Array:
        """Half the expected second derivative of the loss by the free unknowns."""
        (rows, tall), (across, wide) = self._lattice(place.contacts)
        x, y = self.model.pixel_positions
        pixels = place.lights[0].shape[1]
        sampling = Sampling(self.model, rows, across, np.empty((0, 0, 0, 0), np.float32))
        shares, slopes = np.outer(tall, wide).ravel().astype(np.float32), list[Single]()
        for k, (picture, light) in enumerate(zip(self.model.pictures, place.lights, strict=True)):
            counts = shares
            if self.used is not None:
                counts = shares * sampling.shares(self.used[k * pixels : (k + 1) * pixels])
            found = sampling.slopes(place.modes, picture, light)
            slopes += [np.sqrt(counts) * slope for slope in found]
        mixed, pulls = _mixtures(np.stack(slopes), place.modes[..., rows[:, None], across])
        synthesis = self.skin.rough(x[across], y[rows], mixed)
        columns = [
            one
            for each, which in zip(place.contacts, free, strict=True)
            for one in self.skin.derivatives(each, which)
        ]
        by = np.empty((len(columns), len(pulls) * len(shares)))
        for component in range(4):
            own = [k for k, (which, _) in enumerate(columns) if which == component]
            if own:
                few = synthesis.columns(component, np.stack([columns[k][1] for k in own]))
                each = few.swapaxes(0, 1).reshape(len(own), -1, len(shares))
                by[own] = np.einsum("sfp,qfp->qsp", pulls, each).reshape(len(own), -1)
        # in double precision, for shapes are hardly told apart
        total = by @ by.T
        total *= float(np.mean(self.response.amplitude)) ** 2 / float(
            np.mean(self.response.variance)
        )
        _, std = self.skin.drawn(len(free))
        total[np.diag_indices(len(total))] += 1 / np.square(std[free])
        return total

    def _lattice(self, contacts: Array) -> list[tuple[NDArray[np.intp], Array]]:
        """Rows and columns of the matrix, and how many each stands for."""
        found, margin = [], BESIDE * self.model.sensor.transducer.compliant.thickness
        reach = np.array([np.linalg.norm(matrix_of(one[SHAPE:FIRST]), axis=1) for one in contacts])
        for axis, places in zip((1, 0), self.model.pixel_positions[::-1], strict=True):
            middle = contacts[:, PLACE + axis]
            half = reach[:, axis] + margin
            distances = np.abs(places[:, None] - middle) - half
            near = distances.min(axis=1) < 0
            dense = max(DENSE, int(near.sum()) // MOST_DENSE)
            kept, last = [], -SPARSE
            for i, close in enumerate(near.tolist()):
                if i - last >= min(dense if close else SPARSE, SPARSE):
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
        close: float = CLOSE,
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
        """
        here = start if isinstance(start, SkinPlace) else self.at(start)
        own = np.flatnonzero(free)

        def moved(place: SkinPlace, step: Array) -> Array:
            found = place.contacts.copy().ravel()
            found[own] += step
            return self.limited(found.reshape(free.shape))

        def expanded(place: SkinPlace) -> Expansion[SkinPlace]:
            def ahead(step: Array) -> tuple[SkinPlace, float]:
                there = self.at(moved(place, step))
                return there, there.left.loss

            return Expansion(
                place.left.loss,
                self.gradient(place, free),
                lambda: self.information(place, free),
                ahead,
            )

        found = minimise(here, expanded, steps, Stop(close), damping=0.0, reuse=True)
        place, matrix = found.place, found.curvature
        assert matrix is not None
        loss = place.left.loss - found.gain
        return SkinOptimum(moved(place, found.step), loss, place, matrix, free)

    def limited(self, contacts: Array) -> Array:
        """Contacts that push, are on the pad, and have sizes that make sense."""
        found, cover = contacts.copy(), self.model.sensor.transducer.compliant.thickness
        found[:, 0] = np.maximum(found[:, 0], WEAKEST)
        pad = self.model.sensor.transducer
        ends = np.array([pad.length, pad.width]) / 2
        found[:, PLACE:SHAPE] = np.clip(found[:, PLACE:SHAPE], -ends, ends)
        low, high = np.log(SMALLEST * cover), np.log(LARGEST * cover)
        stretch = np.hypot(found[:, SHAPE + 1], found[:, SHAPE + 2])
        most = (high - low) / 2
        found[:, SHAPE + 1 : FIRST] *= (np.minimum(stretch, most) / np.maximum(stretch, 1e-12))[
            :, None
        ]
        found[:, SHAPE] = np.clip(found[:, SHAPE], low, high)
        return found


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
