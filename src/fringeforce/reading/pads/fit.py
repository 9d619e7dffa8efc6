"""To the top of the likelihood of a frame, through the optics of every pixel.

The gradient is exact and takes all pixels, by the adjoint; its matrix takes some thousands of
them.  Levenberg and Marquardt's method joins the two; see `levenberg_marquardt`.

Where a design has tolerances, its standardised unknowns stand behind the forces, with a normal
prior, and the loss is twice the negative logarithm of the posterior.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.covariance import marginal_information
from fringeforce.estimation.levenberg_marquardt import (
    MOST_STEPS,
    Curvature,
    Expansion,
    Stop,
    minimise,
)
from fringeforce.estimation.likelihood import Misfit, Response
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_uncertainty import PadUncertainty, Reference
from fringeforce.reading.pads.light import (
    Curve,
    FrameLight,
    Place,
    Prior,
    Start,
    at_likeliest_scale,
    expected_response,
    nothing,
)
from fringeforce.reading.pads.sampling import Sampling

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Mask = NDArray[np.bool_]

NEGLIGIBLE_GAIN = 0.2
"""Gain of the loss that a step promises, per load, below which it is not evaluated any more.

Noise itself moves the top by a gain of one for each load."""
LAST_GAIN = 3.0
"""The same for a step by a matrix of the very place, which leaves a few thousandths of the gain,
below which it is the last."""
FLAT_GAIN = 6.0
"""The same where light hardly tells forces from what scales them: rounding of a matrix, a
thousandth of the prior's share, leaves a tenth of a deviation of such a gain."""
SPREAD_CLIMBS = 8
"""Climbs in which the forces that the spread of tractions is relative to are found, at most.

On tactels each leaves a third of the way; where a contact lies between two, nine tenths."""
SETTLED = 0.2
"""Deviations, root mean square, by which forces may differ from those that the spread is relative
to."""
HOPELESS = 2.0
"""Loss over that of noise above which a climb must halve it for another to be worth it."""
FIRST_STEPS = 2
"""Steps of a climb that gain most of what it can."""
RIDGE, MASKED = 1e-9, 1e-6
"""Shares of the mean information that keep steps finite where a load leaves no trace, and where a
mask may hide it, beyond what sums in single precision leave."""


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
    settled : bool
        Whether the forces that the spread of tractions is relative to are these.
    """

    forces: Array
    curvature: Curvature
    place: Place
    misfit: Misfit
    extra: Array = field(default_factory=nothing, kw_only=True)
    settled: bool = field(default=True, kw_only=True)

    @property
    def loss(self) -> float:
        """Twice the negative logarithm of the posterior, less a constant."""
        return self.misfit.loss

    @property
    def mass(self) -> float:
        """Logarithm of the posterior mass about it, less a constant, by Laplace's approximation."""
        _, size = np.linalg.slogdet(self.curvature.information)
        return -(self.loss + float(size)) / 2


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
    reference : Reference, optional
        What the spread of tractions is relative to; what is fitted if not given, which makes large
        forces likelier, for their tractions need less of a spread.
    still : ndarray, optional
        Spline coefficients of the retardance without forces, where nothing is uncertain [rad].
    curve : Curve, optional
        Of the camera; as drawn if not given.
    """

    model: PadModel
    response: Response
    sampling: Sampling
    frame: Array
    used: Mask | None = None
    prior: Prior | None = None
    reference: Reference | None = None
    still: Single | None = None
    curve: Curve | None = None

    @property
    def uncertain(self) -> PadUncertainty | None:
        """What is uncertain about the pad, if anything is."""
        return self.sampling.uncertain

    @property
    def as_drawn(self) -> Fit:
        """The same where all unknowns of tolerances are at their means, and the camera is linear.

        Far from the top, neither tolerances nor the curve of a camera help to find it.
        """
        known, drawn = self.uncertain, Curve.of(self.model.sensor.camera)
        frame, response = drawn.straightened(self.frame, expected_response(self.response, known))
        return replace(
            self,
            sampling=replace(self.sampling, uncertain=None),
            still=None if known is None else known.still,
            frame=frame,
            response=response,
            curve=Curve("linear", 1.0, drawn.full),
        )

    @property
    def is_as_drawn(self) -> bool:
        """Whether nothing is uncertain, and the camera is linear."""
        return self.uncertain is None and Curve.of(self.model.sensor.camera).straight

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

    @cached_property
    def _light(self) -> FrameLight:
        return FrameLight(
            self.model, self.response, self.frame, self.used, self.uncertain, self.curve
        )

    def place(self, start: Start) -> Place:
        """Evaluate where the retardance is known."""
        shone = self._light.shone(start.modes, start.extra)
        return Place(forces=start.forces, reference=self.reference, **vars(shone))

    def misfit(self, place: Place) -> Misfit:
        """What a place leaves of the frame; nothing at pixels that do not count.

        The loss is that of the frame and of the unknowns of tolerances.
        """
        found = self._light.misfit(place.level)
        if self.uncertain is None:
            return found
        return replace(found, loss=found.loss + self._prior.loss(place.extra))

    def gradient(self, place: Place, left: Misfit) -> Array:
        """Half the derivative of the loss, shape (3 n + q,), exact."""
        return self.gathered(place, *self._light.back(place, left.slope))

    def gathered(self, place: Place, by_modes: Single, by_light: Array) -> Array:
        """The same from the derivatives that `FrameLight.back` gives."""
        known = self.uncertain
        if known is None:
            return self.model.retarding.adjoint(by_modes).ravel()
        grid = known.retarding(place.extra).gather(by_modes)
        by_forces, by_extra = known.coefficients_adjoint(
            place.forces, place.extra, grid, self.reference
        )
        by_extra += by_light + self._prior.slope(place.extra)
        return np.concatenate([by_forces, by_extra])

    def curvature(self, place: Place) -> Curvature:
        """Half the expected second derivative of the loss, from some pixels.

        It holds forces, and the unknowns that show, which are 3 n + q at most.
        """
        scale, loads, known = self._scale(place), len(place.forces), self.uncertain
        ridge = RIDGE if self.used is None else MASKED
        own = np.diag_indices(loads)
        if known is None:
            total, held = np.zeros((loads, loads)), None
            for k in range(len(place.lights)):
                total += scale * self.sampling.information(place, k, self.used)
        else:
            total, held = self.sampling.joint_information(place, self.used)
            total *= scale
            total[loads:, loads:] += self._prior.among(held[loads:])
        total[own] += ridge * total[own].sum() / max(loads, 1)
        return Curvature(total, held)

    def _others_curvature(self, place: Place) -> Curvature:
        """The same of the unknowns of tolerances alone."""
        few, shown = self.sampling.others_information(place, self.used)
        return Curvature(self._scale(place) * few + self._prior.among(shown), shown)

    def information(self, place: Place) -> Array:
        """The matrix of `curvature` of all unknowns, shape (3 n + q, 3 n + q)."""
        found = self.curvature(place)
        if found.held is None:
            return found.information
        whole = np.eye(found.size)
        whole[np.ix_(found.held, found.held)] = found.information
        return whole

    def _scale(self, place: Place) -> float:
        """Of information, over the mean over the pixels of squared derivatives of the intensity."""
        pixels = len(self.frame) // len(place.lights)
        return pixels * float(np.asarray(place.amplitude**2 / self.response.variance))

    def across(self, place: Place, others: Callable[[int, Single], Single]) -> tuple[Array, Array]:
        """The same by its unknowns and others, shape (3 n + q, r), and by others alone, (r, r).

        Parameters
        ----------
        place : Place
            Where to take it.
        others : callable
            As of `Sampling.across`.
        """
        across, own = self.sampling.across(place, others, self.used)
        return self._scale(place) * across, self._scale(place) * own

    def climb(
        self,
        start: Array | Start,
        steps: int = MOST_STEPS,
        curvature: Curvature | None = None,
        fine: bool = False,
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
        fine : bool
            Whether gains count that are as small as those of noise in one load.
        """
        here = self.place(start) if isinstance(start, Start) else self.at(start)
        known = self.uncertain
        if self.reference is None and known is not None and known.contacts is not None:
            return self._settled(here, steps)
        loads = len(here.forces)
        counted = 1 if fine else loads
        near = FLAT_GAIN if known is not None and known.scales else LAST_GAIN * counted
        stop = Stop(NEGLIGIBLE_GAIN * counted, near)
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
        matrix = found.curvature or self.curvature(place)
        gained = replace(left, loss=left.loss - found.gain)
        forces, extra = place.forces + found.step[:loads], place.extra + found.step[loads:]
        if known is not None and known.contacts is None:
            factor, extra = at_likeliest_scale(known, self._prior, extra)
            forces = factor * forces
        return Optimum(forces, matrix, place, gained, extra=extra)

    def _settled(self, here: Place, steps: int) -> Optimum:
        """Climb with tractions whose spread is relative to forces that are found then."""
        reference, last = Reference(here.forces, here.extra), np.inf
        for _ in range(SPREAD_CLIMBS):
            fit = replace(self, reference=reference)
            found = fit.climb(fit.at(*reference), steps)
            moved = found.forces - reference.forces
            known = marginal_information(found.curvature.information, len(moved))
            if moved @ known @ moved < SETTLED**2 * len(moved):
                return found
            if found.loss > HOPELESS * max(len(self.frame), last / 2):
                break
            reference, last = Reference(found.forces, found.extra), found.loss
        return replace(found, settled=False)

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
                whole.loss, whole.gradient[loads:], lambda: self._others_curvature(here[0]), ahead
            )

        start = here, self.misfit(here)
        if not len(here.extra):
            return start[1].loss
        found = minimise(start, expanded, MOST_STEPS, Stop(NEGLIGIBLE_GAIN, LAST_GAIN), damping=0.0)
        return found.place[1].loss - found.gain

    def _expanded(self, here: tuple[Place, Misfit]) -> Expansion[tuple[Place, Misfit]]:
        place, left = here
        loads = len(place.forces)

        def ahead(step: Array) -> tuple[tuple[Place, Misfit], float]:
            there = self.at(place.forces + step[:loads], place.extra + step[loads:])
            beyond = self.misfit(there)
            return (there, beyond), beyond.loss

        return Expansion(
            left.loss, self.gradient(place, left), lambda: self.curvature(place), ahead
        )
