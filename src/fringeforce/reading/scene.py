"""One frame before its explanations: how they are found, compared and varied.

Arrays only: grey levels, an influence matrix and the camera's response.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fringeforce.force.bounds import covariance, phase_information
from fringeforce.force.estimate import Estimate, maximum_likelihood
from fringeforce.force.likelihood import Response
from fringeforce.force.shape import ShapeError, shape_error
from fringeforce.phase.reflections import reflections

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Doubt = Callable[[Array, Mask], Array]
"""From loads (2n,) and pixels (P,) to what k independent errors besides noise do to group sums of
their grey levels in units of the noise, shape (p // GROUP, k)."""

IMAGES = 16
"""Mirror images of one explanation that are tried."""


@dataclass(frozen=True, eq=False)
class Scene:
    """The pixels of one frame that are used, and what they can show.

    Attributes
    ----------
    frame : ndarray, shape (p,)
        Grey levels of the used pixels, channel after channel.
    influence : ndarray, shape (p, 2n)
        Influence matrix [rad/N].
    response : Response
        Of the camera.
    lead : int
        Used pixels of the first channel.
    model_error : float
        Relative size of the influence matrix's errors of shape, where it is known.
    pixels : ndarray of bool, shape (P,)
        Which pixels they are.
    doubt : callable, optional
        What grey levels are uncertain by besides noise.
    """

    frame: Array
    influence: Array
    response: Response
    lead: int
    model_error: float
    pixels: Mask
    doubt: Doubt | None = None

    def only(self, sound: Mask) -> Scene:
        """The scene without some of its pixels."""
        lead, pixels = int(np.count_nonzero(sound[: self.lead])), self.pixels.copy()
        pixels[pixels] = sound
        return replace(
            self,
            frame=self.frame[sound],
            influence=self.influence[sound],
            response=self.response.at(sound),
            lead=lead,
            pixels=pixels,
        )

    def climbed(self, start: Array) -> Estimate:
        """Top of the likelihood that a start leads to."""
        return maximum_likelihood(self.frame, self.influence, self.response, start)

    def half_climbed(self, start: Array) -> Estimate:
        """Nearly the top, near enough to be ranked."""
        return maximum_likelihood(
            self.frame, self.influence, self.response, start, steps=8, tolerance=0.1
        )

    def covariance(self, estimate: Estimate) -> Array:
        """Covariance of an estimate."""
        return covariance(estimate.phase, self.influence, self.response)

    def shape_error(self, estimate: Estimate, spread: Array) -> ShapeError:
        """What the frame says of errors of shape that the influence matrix is not known to have."""
        sigma = np.sqrt(self.response.variance)
        known = None if self.doubt is None else self.doubt(estimate.loads, self.pixels)
        slope, residuals = self.response.slope(estimate.phase) / sigma, estimate.misfit.slope
        return shape_error(residuals, slope, self.influence, estimate.loads, spread, known)

    def images(self, estimate: Estimate) -> Array:
        """Mirror images of an explanation in its first channel, the likeliest first."""
        first = slice(self.lead)
        response, phase = self.response.at(first), estimate.phase[first]
        information = phase_information(phase, response)
        changes = reflections(phase + response.bias, self.influence[first], information)
        return estimate.loads + changes[:IMAGES]

    def gap(self, first: Array, second: Array) -> float:
        """Largest distance of two phases, known up to their signs if nothing is biased [rad]."""
        return float(self.gaps(first, [second])[0])

    def gaps(self, phase: Array, others: Sequence[Array]) -> Array:
        """`gap` of a phase from each of others, shape (k,) [rad]."""
        stack = np.reshape(others, (-1, len(phase)))
        apart = np.abs(stack - phase).max(axis=1)
        if not self.response.even:
            return np.asarray(apart)
        return np.minimum(apart, np.abs(stack + phase).max(axis=1))

    def pushing(self, estimate: Estimate) -> Estimate:
        """The one of a load and its negative that pushes, where both give the same frame."""
        pushes = estimate.loads[: len(estimate.loads) // 2].sum() >= 0
        if pushes or not self.response.even:
            return estimate
        return Estimate(-estimate.loads, -estimate.phase, estimate.misfit)
