"""To the top of the likelihood of a frame, through the optics of every pixel.

The gradient is exact and takes all pixels, by the adjoint; its matrix takes some thousands of
them.  Levenberg and Marquardt's method joins the two; see `levenberg_marquardt`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.levenberg_marquardt import Curvature, Expansion, Stop, minimise
from fringeforce.estimation.likelihood import Misfit, Response, misfit
from fringeforce.models.pad import PadModel
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
RIDGE, MASKED = 1e-9, 1e-6
"""Shares of the mean information that keep steps finite where a load leaves no trace, and where a
mask may hide it, beyond what sums in single precision leave."""


@dataclass(frozen=True, eq=False)
class Start:
    """Forces, and the retardance that they cause.

    Attributes
    ----------
    forces : ndarray, shape (3 n,)
        N, T_x, T_y of tactel after tactel [N].
    modes : ndarray, shape (2, modes, rows, columns)
        Retardance [rad].
    """

    forces: Array
    modes: Single

    def onward(self, share: float, before: Start) -> Start:
        """A share of the way from another to here further on, for retardance follows forces."""
        modes = np.float32(1 + share) * self.modes
        modes -= np.float32(share) * before.modes
        return Start(self.forces + share * (self.forces - before.forces), modes)


@dataclass(frozen=True, eq=False)
class Place(Start):
    """Forces, and the light that they cause.

    Attributes
    ----------
    lights : list of ndarray, shape (3, P)
        Light of every channel.
    level : ndarray, shape (channels * P,)
        Expected grey levels.
    """

    lights: Sequence[Single]
    level: Array


@dataclass(frozen=True, eq=False)
class Optimum:
    """Where the likelihood is largest.

    Attributes
    ----------
    forces : ndarray, shape (3 n,)
        N, T_x, T_y of tactel after tactel [N].
    curvature : Curvature
        Used last.
    place : Place
        Where all was evaluated last, a small step away.
    misfit : Misfit
        There, but for the loss, which is that of the forces.
    """

    forces: Array
    curvature: Curvature
    place: Place
    misfit: Misfit


@dataclass(frozen=True, eq=False)
class Fit:
    """The likelihood of one frame.

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
    """

    model: PadModel
    response: Response
    sampling: Sampling
    frame: Array
    used: Mask | None = None

    def at(self, forces: Array) -> Place:
        """Evaluate at forces, shape (3 n,)."""
        return self.place(Start(forces, self.model.modes(forces.reshape(-1, 3))))

    def place(self, start: Start) -> Place:
        """Evaluate where the retardance is known."""
        modes = start.modes
        seen = [self.model.picture(modes, picture) for picture in self.model.pictures]
        intensity = np.concatenate([one for one, _ in seen]).astype(float)
        level = np.asarray(self.response.amplitude * intensity + self.response.offset)
        return Place(start.forces, modes, [light for _, light in seen], level)

    def misfit(self, place: Place) -> Misfit:
        """What a place leaves of the frame; nothing at pixels that do not count."""
        if self.used is None:
            return misfit(self.frame, place.level, self.response)
        few = misfit(self.frame[self.used], place.level[self.used], self.response)
        slope, weight = np.zeros((2, len(self.frame)))
        slope[self.used], weight[self.used] = few.slope, few.weight
        return Misfit(few.loss, slope, weight)

    def gradient(self, place: Place, left: Misfit) -> Array:
        """Half the derivative of the loss, shape (3 n,), exact."""
        scale = np.float32(self.response.amplitude / np.sqrt(self.response.variance))
        pulls = (scale * left.slope.astype(np.float32)).reshape(len(place.lights), -1)
        by_modes = [
            self.model.picture_adjoint(place.modes, picture, light, pull)
            for picture, light, pull in zip(self.model.pictures, place.lights, pulls, strict=True)
        ]
        return self.model.retarding.adjoint(reduce(np.add, by_modes)).ravel()

    def information(self, place: Place) -> Array:
        """Half the expected second derivative of the loss, shape (3 n, 3 n), from some pixels."""
        pixels = len(self.frame) // len(place.lights)
        scale = pixels * float(np.asarray(self.response.amplitude**2 / self.response.variance))
        total = np.zeros((len(place.forces), len(place.forces)))
        for k, (picture, light) in enumerate(zip(self.model.pictures, place.lights, strict=True)):
            used = None if self.used is None else self.used[k * pixels : (k + 1) * pixels]
            total += scale * self.sampling.information(place.modes, picture, light, used)
        ridge = RIDGE if self.used is None else MASKED
        total[np.diag_indices(len(total))] += ridge * np.trace(total) / len(total)
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
        stop = Stop(CLOSE * len(here.forces), NEAR * len(here.forces))
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
        return Optimum(place.forces + found.step, matrix, place, gained)

    def _expanded(self, here: tuple[Place, Misfit]) -> Expansion[tuple[Place, Misfit]]:
        place, left = here

        def ahead(step: Array) -> tuple[tuple[Place, Misfit], float]:
            there = self.at(place.forces + step)
            beyond = self.misfit(there)
            return (there, beyond), beyond.loss

        return Expansion(
            left.loss, self.gradient(place, left), lambda: self.information(place), ahead
        )
