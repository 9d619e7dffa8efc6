"""From a model and a frame to a reading: search, climb, judge."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.design import Camera
from fringeforce.errors import InputError
from fringeforce.force.admissible import admissible
from fringeforce.force.bounds import covariance, phase_information
from fringeforce.force.estimate import Estimate, maximum_likelihood
from fringeforce.force.goodness import is_noise, reduced_chi_square
from fringeforce.force.likelihood import Response, misfit
from fringeforce.model import SensorModel
from fringeforce.optics.camera import noise_variance
from fringeforce.phase.folding import phase_pace
from fringeforce.phase.reflections import reflections
from fringeforce.phase.tracking import explanations
from fringeforce.reading import Reading, Status

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CANDIDATES = 6
"""Distinct interpretations of one search that are climbed to the top."""
SAME_PHASE = 0.5
"""Two interpretations whose phases are nowhere farther apart have the same top [rad]."""
RIVAL = 16.0
"""Twice the log-likelihood by which an explanation must beat another to rule it out."""
ROUNDS = 3
"""Times that the neighbours of a better neighbour are tried in turn."""
PULL = 5.0
"""Standard deviations by which a normal force must pull before an explanation is unphysical."""
GOODNESS = 6.0
"""Standard deviations of pure noise by which an explanation must beat silence to be a contact."""
OUTLIER, OUTLIERS = 5.0, 0.03
"""Residual that makes a pixel suspect, and the share of pixels that may be."""
SATURATION = 0.1
"""Share of pixels at full scale that tells of saturation."""
DENSE = 1.3
"""Pace of the phase beyond which pixels no longer follow [rad per pixel]."""


@dataclass(frozen=True, eq=False)
class Reader:
    """Reads frames of one sensor.

    Attributes
    ----------
    model : SensorModel
        The characterised sensor.
    friction : float or None
        If given, forces are limited to N >= 0 and |T| <= friction N.
    """

    model: SensorModel
    friction: float | None = None

    def __post_init__(self) -> None:
        if self.friction is not None and not self.friction > 0:
            raise InputError(
                f"friction = {self.friction}: must be greater than 0; leave it out for no limits."
            )

    @cached_property
    def response(self) -> Response:
        """What the sensor's camera makes of a phase."""
        return camera_response(self.model.sensor.camera)

    @cached_property
    def influence(self) -> Array:
        """Influence matrix at the pixels, shape (n_pixels, 2n) [rad/N]."""
        psi = self.model.pixel_influence
        return np.ascontiguousarray(psi.reshape(len(psi), -1))

    def read(self, frame: ArrayLike, mask: ArrayLike | None = None) -> Reading:
        """Read one frame without any earlier state.

        Parameters
        ----------
        frame : array_like, shape (n_pixels,)
            Grey levels.
        mask : array_like of bool, shape (n_pixels,), optional
            Pixels to leave out, where true.

        Returns
        -------
        Reading
            Never an error for a bad frame: its status says what to do.

        Raises
        ------
        InputError
            If the mask does not fit the sensor.
        """
        used = self._usable(mask)
        try:
            levels = np.asarray(frame, dtype=float)
        except (TypeError, ValueError):
            return self._bad(f"It holds {type(frame).__name__}, not grey levels.")
        if problem := self._problem(levels, used):
            return self._bad(problem)
        return self._interpreted(levels, used & ~_dead(levels, self.response))

    def _usable(self, mask: ArrayLike | None) -> Mask:
        pixels = len(self.influence)
        if mask is None:
            return np.ones(pixels, dtype=bool)
        masked = np.asarray(mask, dtype=bool)
        if masked.shape != (pixels,) or (~masked).sum() <= 2 * self.influence.shape[1]:
            raise InputError(
                f"A mask of shape {masked.shape} with {int((~masked).sum())} pixels to use does "
                f"not fit; this sensor has {pixels} pixels and needs more than "
                f"{2 * self.influence.shape[1]} of them."
            )
        return ~masked

    def _problem(self, levels: Array, used: Mask) -> str:
        camera = self.model.sensor.camera
        if levels.shape != used.shape:
            return f"It has the shape {levels.shape}; this sensor's frames have {used.shape}."
        seen = levels[used]
        if not np.isfinite(seen).all():
            return f"{int((~np.isfinite(seen)).sum())} pixels are not a number."
        if seen.min() < 0 or seen.max() > camera.full_scale:
            return (
                f"Grey levels from {seen.min():g} to {seen.max():g} exceed the converter's 0 to "
                f"{camera.full_scale}."
            )
        if np.ptp(seen) == 0 and camera.noise > 0.5:
            return f"All pixels are {seen[0]:g}."
        return ""

    def _interpreted(self, levels: Array, used: Mask) -> Reading:
        pixels = np.arange(len(levels))
        filled = levels if used.all() else np.interp(pixels, pixels[used], levels[used])
        intensity = (filled - self.response.offset) / self.response.amplitude
        variance = self.response.variance / self.response.amplitude**2
        tops: list[Estimate] = []
        for starts in explanations(intensity, variance, self.influence):
            found = self._climbed(levels, used, starts)
            fitting = [e for e in found if is_noise(e.misfit.slope, len(e.loads))]
            if fitting:
                return self._reading(levels, used, fitting)
            tops += found
        best = min(tops, key=lambda e: e.misfit.loss)
        return self._rescued(levels, used, best, intensity)

    def _climbed(self, levels: Array, used: Mask, starts: Array) -> list[Estimate]:
        """Tops of the likelihood that distinct starts lead to, the best first."""
        frame, influence = levels[used], self.influence[used]
        found: list[Estimate] = []
        for start in starts:
            phase = influence @ start
            if any(_gap(phase, e.phase) < SAME_PHASE for e in found):
                continue
            top = maximum_likelihood(frame, influence, self.response, start)
            if not any(_gap(top.phase, e.phase) < SAME_PHASE for e in found):
                found.append(top)
            if len(found) == CANDIDATES:
                break
        return sorted(found, key=lambda e: e.misfit.loss)

    def _rescued(self, levels: Array, used: Mask, best: Estimate, intensity: Array) -> Reading:
        """Leave out pixels that alone spoil the fit, or say why nothing explains the frame."""
        suspect = used.copy()
        suspect[used] = np.abs(best.misfit.slope) > OUTLIER
        if 0 < suspect.sum() <= OUTLIERS * len(levels):
            used = used & ~suspect
            frame, influence = levels[used], self.influence[used]
            best = maximum_likelihood(frame, influence, self.response, best.loads)
            if is_noise(best.misfit.slope, len(best.loads)):
                return self._reading(levels, used, [best])
        status = Status.MODEL_MISMATCH
        pace = phase_pace(intensity, self.response.variance / self.response.amplitude**2)
        if np.mean(levels >= self.model.sensor.camera.full_scale) > SATURATION:
            status = Status.SATURATED
        elif pace.max() > DENSE:
            status = Status.FRINGES_TOO_DENSE
        return self._stated(_pushing(best), used, status)

    def _reading(self, levels: Array, used: Mask, fitting: list[Estimate]) -> Reading:
        """Judge an explanation that fits, against silence and against its neighbours."""
        frame, best = levels[used], fitting[0]
        unknowns = len(best.loads)
        silence = self.response.level(np.zeros(len(frame)))
        gain = misfit(frame, silence, self.response).loss - best.misfit.loss
        if gain < unknowns + GOODNESS * np.sqrt(2 * unknowns):
            return self._stated(_pushing(best), used, Status.NO_CONTACT)
        tops = self._neighbours(frame, self.influence[used], fitting)
        best = tops[0]
        spread = covariance(best.phase, self.influence[used], self.response)
        deviations = np.sqrt(np.diag(spread))
        rivals = [e for e in tops if e.misfit.loss < best.misfit.loss + RIVAL]
        rivals = [e for e in rivals if _pull(e, deviations) < PULL] or rivals
        best, *rivals = rivals
        others = [e.loads for e in rivals if not _alike(e.loads, best.loads, deviations)]
        pushes = np.repeat([1.0, 0.0], unknowns // 2)
        if best.loads @ pushes < 3 * np.sqrt(pushes @ spread @ pushes):
            others.append(-best.loads)  # the sum of the pushes is too small to tell the sign
        return self._stated(best, used, Status.AMBIGUOUS if others else Status.OK, others)

    def _neighbours(self, frame: Array, influence: Array, found: list[Estimate]) -> list[Estimate]:
        """All explanations around the best one, the best first, each pushing."""
        tops, tried = list(found), None
        for _ in range(ROUNDS):
            best = min(tops, key=lambda e: e.misfit.loss)
            if tried is not None and best.misfit.loss > tried - 1:
                break
            tried = best.misfit.loss
            information = phase_information(best.phase, self.response)
            for change in reflections(best.phase, influence, information)[:CANDIDATES]:
                start = best.loads + change
                tops.append(maximum_likelihood(frame, influence, self.response, start))
        return sorted((_pushing(e) for e in tops), key=lambda e: e.misfit.loss)

    def _stated(
        self, best: Estimate, used: Mask, status: Status, rivals: list[Array] | None = None
    ) -> Reading:
        spread = covariance(best.phase, self.influence[used], self.response)
        loads, n = best.loads, len(best.loads) // 2
        limited = np.zeros(n, dtype=bool)
        if self.friction is not None:
            loads, limited = admissible(loads, spread, self.friction)
        return Reading(
            forces=loads.reshape(2, n),
            covariance=spread,
            phase=self.influence @ loads,
            chi2=reduced_chi_square(best.misfit.slope, len(loads)),
            status=status,
            detail="",
            alternatives=np.reshape(rivals or [], (-1, 2, n)),
            limited=limited,
        )

    def _bad(self, detail: str) -> Reading:
        pixels, unknowns = self.influence.shape
        return Reading(
            forces=np.full((2, unknowns // 2), np.nan),
            covariance=np.full((unknowns, unknowns), np.nan),
            phase=np.full(pixels, np.nan),
            chi2=np.nan,
            status=Status.BAD_FRAME,
            detail=detail,
            alternatives=np.empty((0, 2, unknowns // 2)),
            limited=np.zeros(unknowns // 2, dtype=bool),
        )


def camera_response(camera: Camera) -> Response:
    """Response of a camera; it clips only where its noise can carry a level beyond its range."""
    reach = camera.noise * (1 if camera.noise_model == "uniform" else 4)
    brightest = camera.offset + camera.amplitude + reach
    return Response(
        amplitude=camera.amplitude,
        offset=camera.offset,
        variance=noise_variance(camera),
        floor=0.0 if camera.offset - reach < -0.5 else -np.inf,
        ceiling=float(camera.full_scale) if brightest > camera.full_scale + 0.5 else np.inf,
    )


def _dead(levels: Array, response: Response) -> Mask:
    """Single pixels that stand out from both of their neighbours as no fringe does."""
    middle = (levels[:-2] + levels[2:]) / 2
    apart = np.abs(levels[2:] - levels[:-2])
    alone = np.abs(levels[1:-1] - middle)
    limit = max(8 * np.sqrt(response.variance), response.amplitude / 4)
    return np.pad((alone > limit) & (alone > 3 * apart), 1)


def _gap(first: Array, second: Array) -> float:
    """Largest distance of two phases, of which each is known up to its sign [rad]."""
    return float(min(np.abs(first - second).max(), np.abs(first + second).max()))


def _pushing(estimate: Estimate) -> Estimate:
    """The one of a load and its negative that pushes: both give the same frame."""
    if estimate.loads[: len(estimate.loads) // 2].sum() >= 0:
        return estimate
    return Estimate(-estimate.loads, -estimate.phase, estimate.misfit)


def _alike(first: Array, second: Array, deviations: Array) -> bool:
    """Whether two loads are the same within a reading's own deviations."""
    return bool((np.abs(first - second) < 2 * deviations).all())


def _pull(estimate: Estimate, spread: Array) -> float:
    """Largest normal force that pulls, in standard deviations."""
    n = len(spread) // 2
    return float((-estimate.loads[:n] / spread[:n]).max())
