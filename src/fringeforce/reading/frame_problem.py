"""One frame before its explanations: how they are found, compared and varied.

Arrays only: grey levels, an influence matrix and the camera's response.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.bounds import covariance, phase_information
from fringeforce.estimation.estimate import Estimate, evaluated
from fringeforce.estimation.likelihood import Response
from fringeforce.estimation.model_discrepancy import ModelDiscrepancy, model_discrepancy
from fringeforce.estimation.phase.reflections import reflections
from fringeforce.estimation.residual_test import FALSE_ALARM, absorbed, is_noise
from fringeforce.estimation.strip import Strip
from fringeforce.estimation.strip_fit import Optimum, Phases, climb, node_phase
from fringeforce.estimation.vector_loops import Single

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Doubt = Callable[[Array, Mask], Array]
"""From loads (2n,) and pixels (P,) to what k independent errors besides noise do to group sums of
their grey levels in units of the noise, shape (p // GROUP, k)."""

IMAGES = 16
"""Mirror images of one explanation that are tried."""
THIN, THINNEST = 0.2, 4
"""They are found from pixels between which the phase runs so far [rad], at most so many apart."""


@dataclass(frozen=True, eq=False)
class FrameProblem:
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
    pixels : ndarray of bool, shape (P,)
        Which pixels they are.
    strip : Strip
        These pixels for the compiled loops.
    packed : ndarray, shape (P,)
        Grey levels for them.
    calibration_uncertainty : callable, optional
        What grey levels are uncertain by besides noise.
    """

    frame: Array
    influence: Array
    response: Response
    lead: int
    pixels: Mask
    strip: Strip
    packed: Single
    calibration_uncertainty: Doubt | None = None

    @classmethod
    def of(
        cls,
        levels: Array,
        used: Mask,
        influence: Array,
        response: Response,
        strip: Strip,
        channels: int,
        calibration_uncertainty: Doubt | None,
    ) -> FrameProblem:
        """Of a frame and the pixels to use; see `interpretation.interpret`."""
        return cls(
            frame=levels[used],
            influence=influence[used],
            response=response.at(used),
            lead=int(np.count_nonzero(used[: len(used) // channels])),
            pixels=used,
            strip=strip.under(response, used),
            packed=np.where(used, levels, 0).astype(np.float32),
            calibration_uncertainty=calibration_uncertainty,
        )

    def only(self, sound: Mask) -> FrameProblem:
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
            strip=self.strip.without(pixels),
        )

    def climbed(self, start: Array) -> Estimate:
        """Optimum of the likelihood that a start leads to."""
        return self.estimate(climb(self.strip, self.packed, start, 30, 1e-3).loads)

    def optimum(self, start: Array) -> Optimum:
        """The same, but for a tenth of a deviation."""
        return climb(self.strip, self.packed, start, 30, 0.01)

    def near_optimum(self, start: Array) -> Optimum:
        """Near enough to be ranked."""
        return climb(self.strip, self.packed, start, 8, 1.0)

    def estimate(self, loads: Array) -> Estimate:
        """Given loads and what they leave of the frame."""
        return evaluated(self.frame, self.influence, self.response, loads)

    def explained(self, loads: Array, chance: float = FALSE_ALARM) -> bool:
        """Whether loads leave nothing of the frame but noise; see `is_noise`."""
        found, m = self.estimate(loads), len(loads)
        left = found.misfit.slope
        # what a fit takes from sums over neighbours need not be known where it does not matter
        if is_noise(left, m, chance) or not is_noise(left, m, chance, taken=0):
            return is_noise(left, m, chance)
        slope = self.response.slope(found.phase) / np.sqrt(self.response.variance)
        taken = absorbed(slope, self.influence, self.covariance(found))
        return is_noise(left, m, chance, taken)

    def covariance(self, estimate: Estimate) -> Array:
        """Covariance of an estimate."""
        return covariance(estimate.phase, self.influence, self.response)

    def model_discrepancy(self, estimate: Estimate, spread: Array) -> ModelDiscrepancy:
        """What the frame says of errors of shape that the influence matrix is not known to have."""
        sigma = np.sqrt(self.response.variance)
        known = (
            None
            if self.calibration_uncertainty is None
            else self.calibration_uncertainty(estimate.loads, self.pixels)
        )
        slope, residuals = self.response.slope(estimate.phase) / sigma, estimate.misfit.slope
        return model_discrepancy(residuals, slope, self.influence, estimate.loads, spread, known)

    def images(self, loads: Array) -> Array:
        """Mirror images of an explanation in its first channel, the likeliest first."""
        phase = self.influence[: self.lead] @ loads
        pace = np.abs(np.diff(phase)).max()
        thin = slice(0, self.lead, int(np.clip(THIN / max(pace, 1e-9), 1, THINNEST)))
        response, influence = self.response.at(thin), self.influence[thin]
        information = thin.step * phase_information(phase[thin], response)
        changes = reflections(phase[thin] + response.bias, influence, information)
        return loads + changes[:IMAGES]

    def phases(self, optima: Iterable[Optimum] = ()) -> Phases:
        """Phases of explanations, which are known up to their signs if nothing is biased."""
        found = Phases(self.response.even, self.strip.watched.size)
        for optimum in optima:
            found.add(optimum.phase)
        return found

    def phase(self, loads: Array) -> Single:
        """Phase under given loads, to compare with those."""
        return node_phase(self.strip, loads)

    def pushing(self, loads: Array) -> Array:
        """The one of a load and its negative that pushes, where both give the same frame."""
        pushes = loads[::2].sum() >= 0
        return loads if pushes or not self.response.even else -loads
