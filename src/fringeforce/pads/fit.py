"""To the top of the likelihood of a frame, through the optics of every pixel.

The gradient is exact and takes all pixels, by the adjoint; its matrix takes some thousands of
them.  Levenberg and Marquardt's method joins the two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from fringeforce.force.likelihood import Misfit, Response, misfit
from fringeforce.pads.model import PadModel
from fringeforce.pads.sampling import Sampling

Array = NDArray[np.float64]
Single = NDArray[np.float32]

CLOSE = 0.3
"""Gain of twice the log-likelihood that the next step promises, below which it is the last."""
SLOW = 0.1
"""Share of a promise left after a step, above which the matrix is computed again."""
RIDGE = 1e-9
"""Share of the mean information that keeps steps finite where a load leaves no trace."""


@dataclass(frozen=True, eq=False)
class Place:
    """Forces, and what they leave of a frame.

    Attributes
    ----------
    forces : ndarray, shape (3 n,)
        N, T_x, T_y of tactel after tactel [N].
    misfit : Misfit
        Of all pixels of all channels in turn.
    slices : ndarray, shape (slices, 2, rows, columns)
        Retardance [rad].
    lights : list of ndarray, shape (3, P)
        Light of every channel.
    """

    forces: Array
    misfit: Misfit
    slices: Single
    lights: Sequence[Single]


@dataclass(frozen=True, eq=False)
class Fit:
    """The likelihood of one frame.

    Attributes
    ----------
    model : PadModel
        Of the pad.
    response : Response
        Of its camera.
    samplings : sequence of Sampling
        Some pixels of every channel, for the matrix.
    frame : ndarray, shape (channels * P,)
        Grey levels.
    """

    model: PadModel
    response: Response
    samplings: Sequence[Sampling]
    frame: Array

    def at(self, forces: Array) -> Place:
        """Evaluate at forces, shape (3 n,)."""
        slices = self.model.slices(forces.reshape(-1, 3))
        seen = [self.model.picture(slices, picture) for picture in self.model.pictures]
        intensity = np.concatenate([one for one, _ in seen]).astype(float)
        level = self.response.amplitude * intensity + self.response.offset
        found = misfit(self.frame, level, self.response)
        return Place(forces, found, slices, [light for _, light in seen])

    def gradient(self, place: Place) -> Array:
        """Half the derivative of the loss, shape (3 n,), exact."""
        scale = np.float32(self.response.amplitude / np.sqrt(self.response.variance))
        pulls = (scale * place.misfit.slope.astype(np.float32)).reshape(len(place.lights), -1)
        by_slice = sum(
            self.model.picture_adjoint(place.slices, picture, light, pull)
            for picture, light, pull in zip(self.model.pictures, place.lights, pulls, strict=True)
        )
        return self.model.slices_adjoint(np.asarray(by_slice, dtype=np.float32)).ravel()

    def information(self, place: Place) -> Array:
        """Half the expected second derivative of the loss, shape (3 n, 3 n), from some pixels."""
        size = len(place.forces)
        total = np.zeros((size, size))
        scale = float(np.asarray(self.response.amplitude**2 / self.response.variance))
        for sampling in self.samplings:
            share = scale * (len(self.frame) / len(self.samplings)) / len(sampling.pixels)
            total += share * sampling.information(place.forces)
        total[np.diag_indices(size)] += RIDGE * np.trace(total) / size
        return total

    def climb(
        self, start: Array, information: Array | None = None, steps: int = 20
    ) -> tuple[Place, Array]:
        """Climb from forces that are nearly right.

        Parameters
        ----------
        start : ndarray, shape (3 n,)
            Forces [N].
        information : ndarray, shape (3 n, 3 n), optional
            Matrix from near by, such as that of the last frame.
        steps : int
            Largest number of steps.

        Returns
        -------
        place : Place
            The top, but for a step that is too small to matter.
        information : ndarray, shape (3 n, 3 n)
            The matrix last used.
        """
        here, damping, promised = self.at(start), 0.0, np.inf
        gradient = self.gradient(here)
        for _ in range(steps):
            if information is None:
                information = self.information(here)
            step = _step(information, gradient, damping)
            before, promised = promised, float(-(step @ gradient))
            if promised < CLOSE:
                break
            if promised > SLOW * before and before < np.inf:
                information = self.information(here)
                step = _step(information, gradient, damping)
                promised = float(-(step @ gradient))
            there = self.at(here.forces + step)
            while not there.misfit.loss < here.misfit.loss and damping < 1e6:
                damping = max(10 * damping, 1e-3)
                step = _step(information, gradient, damping)
                there = self.at(here.forces + step)
            if not there.misfit.loss < here.misfit.loss:
                break
            here, damping = there, damping / 10 if damping > 1e-3 else 0.0
            gradient = self.gradient(here)
        return here, self.information(here) if information is None else information


def _step(information: Array, gradient: Array, damping: float) -> Array:
    damped = information
    if damping:
        damped = information + np.diag(damping * np.diag(information))
    return -cho_solve(cho_factor(damped, check_finite=False), gradient, check_finite=False)
