"""To the top of the likelihood of a frame, through the optics of every pixel.

The gradient is exact and takes all pixels, by the adjoint; its matrix takes some thousands of
them.  Levenberg and Marquardt's method joins the two; see `levenberg_marquardt`.

Where a design has tolerances, its standardised unknowns stand behind the forces, with a normal
prior, and the loss is twice the negative logarithm of the posterior.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.levenberg_marquardt import Curvature, Expansion, Stop, minimise
from fringeforce.estimation.likelihood import Misfit, Response, misfit
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.optics.area_camera import Lens, Picture
from fringeforce.reading.pads.sampling import Sampling

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Mask = NDArray[np.bool_]

CLOSE = 0.2
"""Gain of the loss that a step promises, per load, below which it is not evaluated any more.

Noise itself moves the top by a gain of one for each load."""
NEAR = 3.0
"""The same for a step by a matrix of the very place, which leaves a few thousandths of the gain,
below which it is the last."""
SETTLING = 5
"""Climbs in which the forces that the spread of tractions is relative to are found."""
SILENT_STEPS = 10
"""Steps in which the unknowns of a frame without forces are found."""
RIDGE, MASKED = 1e-9, 1e-6
"""Shares of the mean information that keep steps finite where a load leaves no trace, and where a
mask may hide it, beyond what sums in single precision leave."""


def nothing() -> Array:
    """Unknowns of a pad without tolerances, shape (0,)."""
    return np.empty(0)


@dataclass(frozen=True, eq=False)
class Start:
    """Forces, and the retardance that they cause.

    Attributes
    ----------
    forces : ndarray, shape (3 n,)
        N, T_x, T_y of tactel after tactel [N].
    modes : ndarray, shape (2, modes, rows, columns)
        Retardance [rad].
    extra : ndarray, shape (q,)
        Unknowns of tolerances.
    """

    forces: Array
    modes: Single
    extra: Array = field(default_factory=nothing, kw_only=True)

    def onward(self, share: float, before: Start) -> Start:
        """A share of the way from another to here further on, for retardance follows forces.

        Unknowns of tolerances stay as they are.
        """
        modes = np.float32(1 + share) * self.modes
        modes -= np.float32(share) * before.modes
        forces = self.forces + share * (self.forces - before.forces)
        return Start(forces, modes, extra=self.extra)


@dataclass(frozen=True, eq=False)
class Place(Start):
    """Forces, and the light that they cause.

    Attributes
    ----------
    lights : list of ndarray, shape (3, P)
        Light of every channel.
    level : ndarray, shape (channels * P,)
        Expected grey levels.
    pictures : tuple of Picture
        What the channels measure.
    lens : Lens, optional
        What blurs the light.
    amplitude : float
        Of the camera, grey levels.
    intensity : ndarray, shape (channels * P,)
        Of the light that pixels get.
    reference : ndarray, shape (3 n,), optional
        Forces that the spread of tractions is relative to, if not these.
    """

    lights: Sequence[Single]
    level: Array
    pictures: tuple[Picture, ...] = field(default=(), kw_only=True)
    lens: Lens | None = field(default=None, kw_only=True)
    amplitude: float = field(default=1.0, kw_only=True)
    intensity: Array = field(default_factory=nothing, kw_only=True)
    reference: Array | None = field(default=None, kw_only=True)


@dataclass(frozen=True, eq=False)
class Prior:
    """What is known of the unknowns of tolerances before a frame.

    Attributes
    ----------
    mean : ndarray, shape (q,)
    precision : ndarray, shape (q, q)
        Inverse of their covariance.
    """

    mean: Array
    precision: Array

    @classmethod
    def stated(cls, uncertain: PadUncertainty) -> Prior:
        """By the tolerances, and by what is known of them together."""
        return cls(*uncertain.expected)

    def slope(self, extra: Array) -> Array:
        """Half the derivative of the loss, shape (q,)."""
        return np.asarray(self.precision @ (extra - self.mean))

    def loss(self, extra: Array) -> float:
        """Twice the negative logarithm, less a constant."""
        return float((extra - self.mean) @ self.slope(extra))


@dataclass(frozen=True, eq=False)
class Optimum:
    """Where the likelihood, or the posterior under tolerances, is largest.

    Attributes
    ----------
    forces : ndarray, shape (3 n,)
        N, T_x, T_y of tactel after tactel [N].
    curvature : Curvature
        Used last, of forces and unknowns of tolerances.
    place : Place
        Where all was evaluated last, a small step away.
    misfit : Misfit
        There, but for the loss, which is that of the forces.
    extra : ndarray, shape (q,)
        Unknowns of tolerances.
    """

    forces: Array
    curvature: Curvature
    place: Place
    misfit: Misfit
    extra: Array = field(default_factory=nothing, kw_only=True)

    @property
    def mass(self) -> float:
        """Logarithm of the posterior mass about it, less a constant, by Laplace's approximation."""
        _, size = np.linalg.slogdet(self.curvature.information)
        return -(self.misfit.loss + float(size)) / 2


@dataclass(frozen=True, eq=False)
class Fit:
    """The likelihood of one frame, or its posterior under tolerances.

    Attributes
    ----------
    model : PadModel
        Of the pad.
    response : Response
        Of its camera.
    sampling : Sampling
        Some pixels, for the matrix.
    frame : ndarray, shape (channels * P,)
        Grey levels.
    used : ndarray of bool, shape (channels * P,), optional
        Pixels that count; all if not given.
    prior : Prior, optional
        Of the unknowns of tolerances; as stated if not given.
    reference : ndarray, shape (3 n,), optional
        Forces that the spread of tractions is relative to; those that are fitted if not given,
        which makes large ones likelier, for their tractions need less of a spread.
    still : ndarray, optional
        Spline coefficients of the retardance without forces, where nothing is uncertain [rad].
    """

    model: PadModel
    response: Response
    sampling: Sampling
    frame: Array
    used: Mask | None = None
    prior: Prior | None = None
    reference: Array | None = None
    still: Single | None = None

    @property
    def uncertain(self) -> PadUncertainty | None:
        """What is uncertain about the pad, if anything is."""
        return self.sampling.uncertain

    @property
    def as_drawn(self) -> Fit:
        """The likelihood of the same frame where all unknowns of tolerances are at their means."""
        still = None if self.uncertain is None else self.uncertain.still
        return replace(self, sampling=replace(self.sampling, uncertain=None), still=still)

    @property
    def _prior(self) -> Prior:
        assert self.uncertain is not None
        return self.prior or Prior.stated(self.uncertain)

    def at(self, forces: Array, extra: Array | None = None) -> Place:
        """Evaluate at forces, shape (3 n,), and unknowns (q,), at their means if not given."""
        if self.uncertain is None:
            grid = self.model.influence.forward(forces)
            if self.still is not None:
                grid += self.still
            return self.place(Start(forces, self.model.retarding.spread(grid)))
        other = self._prior.mean if extra is None else extra
        grid = self.uncertain.coefficients(forces, other, self.reference)
        modes = self.uncertain.retarding(other).spread(grid)
        return self.place(Start(forces, modes, extra=other))

    def place(self, start: Start) -> Place:
        """Evaluate where the retardance is known."""
        modes, extra, known = start.modes, start.extra, self.uncertain
        pictures, lens = self.model.pictures, self.model.lens
        if known is not None:
            pictures, lens = known.pictures(extra), known.lens(extra)
        lights = [self.model.light(modes, picture) for picture in pictures]
        seen = [
            self.model.measured(light, picture, lens)
            for light, picture in zip(lights, pictures, strict=True)
        ]
        intensity = np.concatenate(seen).astype(float)
        gain, dark = 1.0, 0.0
        if known is not None:
            gain, dark = 1.0 + known.brightness @ extra, known.darkness @ extra
        level = np.asarray(gain * self.response.amplitude * intensity + self.response.offset + dark)
        return Place(
            start.forces,
            modes,
            lights,
            level,
            extra=extra,
            pictures=pictures,
            lens=lens,
            amplitude=float(gain * np.mean(self.response.amplitude)),
            intensity=intensity,
            reference=self.reference,
        )

    def misfit(self, place: Place) -> Misfit:
        """What a place leaves of the frame; nothing at pixels that do not count.

        The loss is that of the frame and of the unknowns of tolerances.
        """
        if self.used is None:
            found = misfit(self.frame, place.level, self.response)
        else:
            few = misfit(self.frame[self.used], place.level[self.used], self.response)
            slope, weight = np.zeros((2, len(self.frame)))
            slope[self.used], weight[self.used] = few.slope, few.weight
            found = Misfit(few.loss, slope, weight)
        if self.uncertain is None:
            return found
        return replace(found, loss=found.loss + self._prior.loss(place.extra))

    def gradient(self, place: Place, left: Misfit) -> Array:
        """Half the derivative of the loss, shape (3 n + q,), exact."""
        scale = np.float32(place.amplitude / np.sqrt(self.response.variance))
        pulls = (scale * left.slope.astype(np.float32)).reshape(len(place.lights), -1)
        by_modes = reduce(
            np.add,
            (
                self.model.picture_adjoint(place.modes, picture, light, pull, place.lens)
                for picture, light, pull in zip(place.pictures, place.lights, pulls, strict=True)
            ),
        )
        known = self.uncertain
        if known is None:
            return self.model.retarding.adjoint(by_modes).ravel()
        grid = known.retarding(place.extra).gather(by_modes)
        by_forces, by_extra = known.coefficients_adjoint(
            place.forces, place.extra, grid, self.reference
        )
        for group in known.registration:
            by_extra[group.begin] = np.vdot(known.moved(place.modes, group), by_modes)
        by_extra += self._by_light(place, left.slope, pulls)
        return np.concatenate([by_forces, by_extra + self._prior.slope(place.extra)])

    def _by_light(self, place: Place, slope: Array, pulls: Single) -> Array:
        """Half the derivative by what acts on light and camera, shape (q,)."""
        known = self.uncertain
        assert known is not None
        unit = slope / np.sqrt(self.response.variance)
        bright = float(np.vdot(unit, self.response.amplitude * place.intensity))
        found = bright * known.brightness + float(unit.sum()) * known.darkness
        for number, changes in known.forms:
            for pull, picture, light, change in zip(
                pulls, place.pictures, place.lights, changes, strict=True
            ):
                turned = replace(picture, forms=change)
                found[number] += np.vdot(pull, self.model.measured(light, turned, place.lens))
        if blur := known.group("camera.blur"):
            low, high, apart = known.lens_change(place.extra)
            for pull, picture, light in zip(pulls, place.pictures, place.lights, strict=True):
                ends = (self.model.measured(light, picture, lens) for lens in (high, low))
                found[blur.begin] += np.vdot(pull, np.subtract(*ends)) / apart
        return found

    def information(self, place: Place) -> Array:
        """Half the expected second derivative of the loss, from some pixels.

        Shape (3 n + q, 3 n + q).
        """
        pixels = len(self.frame) // len(place.lights)
        scale = pixels * float(np.asarray(place.amplitude**2 / self.response.variance))
        loads, known = len(place.forces), self.uncertain
        total = np.zeros((loads, loads))
        if known is None:
            for k, (picture, light) in enumerate(zip(place.pictures, place.lights, strict=True)):
                used = None if self.used is None else self.used[k * pixels : (k + 1) * pixels]
                total += scale * self.sampling.information(place.modes, picture, light, used)
        else:
            few, held = self.sampling.joint_information(place, self.used)
            total = np.zeros((loads + known.size,) * 2)
            total[loads:, loads:] = self._prior.precision
            total[np.ix_(held, held)] += scale * few
        ridge = RIDGE if self.used is None else MASKED
        own = np.diag_indices(loads)
        total[own] += ridge * total[own].sum() / max(loads, 1)
        return total

    def climb(
        self, start: Array | Start, steps: int = 20, curvature: Curvature | None = None
    ) -> Optimum:
        """Climb from forces that are nearly right.

        Parameters
        ----------
        start : ndarray, shape (3 n,), or Start
            Forces [N], or with their retardance.
        steps : int
            Largest number of steps.
        curvature : Curvature, optional
            Of a place near by; computed if not given.
        """
        here = self.place(start) if isinstance(start, Start) else self.at(start)
        if self.reference is None and self.uncertain is not None and self.uncertain.contacts:
            return self._settled(here, steps)
        loads = len(here.forces)
        stop = Stop(CLOSE * loads, NEAR * loads)
        found = minimise(
            (here, self.misfit(here)),
            self._expanded,
            steps,
            stop,
            damping=0.0,
            reuse=True,
            curvature=curvature,
        )
        place, left = found.place
        matrix = found.curvature or Curvature(self.information(place))
        gained = replace(left, loss=left.loss - found.gain)
        return Optimum(
            place.forces + found.step[:loads],
            matrix,
            place,
            gained,
            extra=place.extra + found.step[loads:],
        )

    def _settled(self, here: Place, steps: int) -> Optimum:
        """Climb with tractions whose spread is relative to forces that are found then."""
        forces, found = here.forces, None
        for _ in range(SETTLING):
            fit = replace(self, reference=forces)
            extra = here.extra if found is None else found.extra
            found = fit.climb(fit.at(forces, extra), steps)
            forces = found.forces
        assert found is not None
        return found

    def silence(self) -> float:
        """Smallest loss without forces."""
        nothing_acts = np.zeros(self.model.influence.shapes[0])
        here = self.at(nothing_acts)
        loads = len(nothing_acts)

        def expanded(here: tuple[Place, Misfit]) -> Expansion[tuple[Place, Misfit]]:
            whole = self._expanded(here)

            def ahead(step: Array) -> tuple[tuple[Place, Misfit], float]:
                return whole.ahead(np.concatenate([nothing_acts, step]))

            return Expansion(
                whole.loss,
                whole.gradient[loads:],
                lambda: whole.curvature()[loads:, loads:],
                ahead,
            )

        start = here, self.misfit(here)
        if not len(here.extra):
            return start[1].loss
        found = minimise(start, expanded, SILENT_STEPS, Stop(CLOSE, NEAR), damping=0.0)
        return found.place[1].loss - found.gain

    def _expanded(self, here: tuple[Place, Misfit]) -> Expansion[tuple[Place, Misfit]]:
        place, left = here
        loads = len(place.forces)

        def ahead(step: Array) -> tuple[tuple[Place, Misfit], float]:
            there = self.at(place.forces + step[:loads], place.extra + step[loads:])
            beyond = self.misfit(there)
            return (there, beyond), beyond.loss

        return Expansion(
            left.loss, self.gradient(place, left), lambda: self.information(place), ahead
        )
