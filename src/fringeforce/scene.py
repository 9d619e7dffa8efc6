"""The used pixels of one frame, and what they show of loads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.force.bounds import covariance, phase_information, systematic_covariance
from fringeforce.force.estimate import Estimate, maximum_likelihood
from fringeforce.force.likelihood import Response
from fringeforce.force.shape import ShapeError, shape_error
from fringeforce.phase.reflections import reflections

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Doubt = Callable[[Array], Array]
"""From loads (2n,) to modes (k, P) of what the grey levels are uncertain by besides noise."""

IMAGES = 16
"""Mirror images of one explanation that are tried."""


@dataclass(frozen=True, eq=False)
class Scene:
    """The pixels of one frame that are used, and what they can show."""

    frame: Array
    influence: Array
    response: Response
    model_error: float
    doubt: Doubt

    def at(self, pixels: Mask) -> Scene:
        """The same frame by fewer of its pixels."""
        return Scene(
            self.frame[pixels],
            self.influence[pixels],
            self.response.at(pixels),
            self.model_error,
            lambda loads: self.doubt(loads)[:, pixels],
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

    def shape_error(self, estimate: Estimate, spread: Array, doubt: Array) -> ShapeError:
        """What the frame says of errors of shape beyond modes of doubt (k, P)."""
        slope = self.response.slope(estimate.phase) / np.sqrt(self.response.variance)
        modes = doubt / np.sqrt(self.response.variance)
        residuals = estimate.misfit.slope
        return shape_error(residuals, slope, self.influence, estimate.loads, spread, modes)

    def systematic(self, estimate: Estimate, spread: Array, doubt: Array) -> Array:
        """Covariance that modes of doubt (k, P) add to loads of covariance (m, m) from noise."""
        return systematic_covariance(estimate.phase, self.influence, self.response, spread, doubt)

    def images(self, estimate: Estimate) -> Array:
        """Mirror images of an explanation, the likeliest first."""
        information = phase_information(estimate.phase, self.response)
        changes = reflections(estimate.phase, self.influence, information)
        return estimate.loads + changes[:IMAGES]
