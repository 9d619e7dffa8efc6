"""Frames with known loads against a model with unknowns: the damped fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from fringeforce.calibration import checks
from fringeforce.calibration.design_jacobian import DesignTangent
from fringeforce.calibration.light.fixed_pattern_noise import eliminated
from fringeforce.calibration.measurements import Bench, Unknowns
from fringeforce.calibration.normal_equations import NormalEquations, linearised
from fringeforce.calibration.predictions import View, frame_weights, seen
from fringeforce.design.strip import Sensor
from fringeforce.estimation.levenberg_marquardt import Expansion, Stop, minimise

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

PRIOR = {"shift": 2.0, "scale": 0.1, "amplitude": 0.5, "offset": 0.2}
"""Standard deviations of camera and light before any frame is seen; light in units of A."""
STAGES = (3.0, 10.0, np.inf)
"""Largest phase of the frames that enter, stage by stage: few fringes bear a rough model [rad]."""
FAR = 0.15
"""Change of a design's entry up to which a tangent is followed."""
SETTLED = 1e-4
"""Gain of twice the log-likelihood below which a step is the last: a hundredth of a deviation."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Unknowns, how sure they are, and what they were found with.

    Attributes
    ----------
    unknowns : Unknowns
        The estimate.
    covariance : ndarray
        Of all unknowns, for unit reduced chi-square.
    tangent : DesignTangent
        About which the matrix was linear.
    normal : NormalEquations
        The frames linearised there.
    """

    unknowns: Unknowns
    covariance: Array
    tangent: DesignTangent
    normal: NormalEquations


def light_basis(pixels: int, count: int) -> Array:
    """Cubic B-splines along the frame that sum to one, shape (pixels, count)."""
    degree = min(3, count - 1)
    inner = np.linspace(0, 1, count - degree + 1)
    knots = np.concatenate([np.zeros(degree), inner, np.ones(degree)])
    places = (np.arange(pixels) + 0.5) / pixels
    return BSpline.design_matrix(places, knots, degree).toarray()


def on_strip(positions: Array, sensor: Sensor) -> Mask:
    """Pixels that see the strip and not its end, shape (P,)."""
    margin = 2 * sensor.transducer.length / sensor.camera.pixels
    return np.abs(positions) < sensor.transducer.length / 2 - margin


def pixel_weight(bench: Bench, at: Unknowns, sound: Mask) -> Array:
    """One for sound pixels that see the strip, zero for the others, shape (P,)."""
    return (sound & on_strip(at.positions(bench.sensor), bench.sensor)).astype(float)


def start(bench: Bench, parameters: int) -> Unknowns:
    """Unknowns as drawn."""
    camera, ones = bench.sensor.camera, np.ones(bench.basis.shape[1])
    lights = camera.amplitude * ones, camera.offset * ones
    return Unknowns(np.zeros(parameters), np.zeros(2), *lights)


def precision(bench: Bench, design: Array) -> Array:
    """Inverse variances of the unknowns before any frame is seen.

    Parameters
    ----------
    bench : Bench
        The frames.
    design : ndarray, shape (d,)
        Standard deviations of the design's entries.
    """
    size, k = bench.sensor.camera.amplitude, bench.basis.shape[1]
    deviations = np.concatenate(
        [
            design,
            [PRIOR["shift"], PRIOR["scale"]],
            np.full(k, PRIOR["amplitude"] * size),
            np.full(k, PRIOR["offset"] * size),
        ]
    )
    return 1 / deviations**2


def climb(bench: Bench, at: Unknowns, tangent: DesignTangent, sound: Mask, steps: int = 12) -> Fit:
    """Minimise the frames' loss with the matrix linear in the design; see `minimise`.

    Frames that fit much worse than most lose weight in every step, so that a wrong press cannot
    pull the others along.

    Parameters
    ----------
    bench : Bench
        The frames.
    at : Unknowns
        Where to start.
    tangent : DesignTangent
        The matrix about a design.
    sound : ndarray of bool, shape (P,)
        Pixels to use.
    steps : int
        Largest number of steps.
    """
    prior = precision(bench, tangent.deviations)
    origin = start(bench, len(at.design)).flat

    def expand(here: Unknowns) -> Expansion[Unknowns]:
        weight = pixel_weight(bench, here, sound)
        normal = linearised(bench, here, tangent, weight)
        shares = frame_weights(normal.view.residuals, bench.averaged)

        def loss(place: Unknowns, view: View) -> float:
            return _loss(view, weight, shares) + float(prior @ (place.flat - origin) ** 2)

        def ahead(step: Array) -> tuple[Unknowns, float]:
            reach = np.abs((here.design + step[: len(here.design)]) - tangent.centre)
            there = here.moved(step * (FAR / reach.max(initial=FAR)))
            return there, loss(there, seen(bench, there, tangent, weight))

        gradient = normal.gradient + prior * (here.flat - origin)
        return Expansion(
            loss(here, normal.view), gradient, lambda: normal.profiled + np.diag(prior), ahead
        )

    def within(place: Unknowns) -> bool:
        return bool(np.abs(place.design - tangent.centre).max(initial=0.0) <= 0.99 * FAR)

    at = minimise(at, expand, steps, Stop(near=SETTLED), within).place
    weight = pixel_weight(bench, at, sound)
    normal = linearised(bench, at, tangent, weight)
    return Fit(at, _covariance(bench, normal, prior), tangent, normal)


def _covariance(bench: Bench, normal: NormalEquations, prior: Array) -> Array:
    """Of the unknowns of the bench, with frames' own light and the pixels' pattern free."""
    unknowns = len(prior)
    if bench.pattern is None:
        information = normal.profiled + np.diag(prior)
    else:
        pixels = bench.pattern.information(normal.pixels)
        information = eliminated(normal.whole, normal.coupling, pixels)
        information[np.diag_indices(unknowns)] += prior
    return np.asarray(np.linalg.inv(information), float)[:unknowns, :unknowns]


def residuals(
    bench: Bench, at: Unknowns, tangent: DesignTangent, weight: Array | None = None
) -> Array:
    """Residuals of all frames in units of the noise, shape (F, P)."""
    return seen(bench, at, tangent, weight).residuals


def calm(bench: Bench, at: Unknowns, tangent: DesignTangent, limit: float) -> Mask:
    """Frames whose phase is small enough, but never less than the calmest quarter, shape (F,)."""
    phase = bench.loads @ tangent.matrix(at.design, at.positions(bench.sensor)).T
    peaks = np.abs(phase).max(axis=1)
    return peaks <= max(limit, float(np.quantile(peaks, 0.25)))


def sifted(bench: Bench, at: Unknowns, tangent: DesignTangent, sound: Mask) -> tuple[Mask, Mask]:
    """Pixels and frames that do not contradict the others, shapes (P,) and (F,).

    Parameters
    ----------
    bench : Bench
        All frames.
    at : Unknowns
        Their explanation.
    tangent : DesignTangent
        The matrix about a design.
    sound : ndarray of bool, shape (P,)
        Pixels by which frames are judged.
    """
    seen_strip = on_strip(at.positions(bench.sensor), bench.sensor)
    used = sound & seen_strip
    left = residuals(bench, at, tangent, used.astype(float))
    single = left / np.sqrt(bench.averaged)[:, None]
    kept = ~checks.misfitting_frames(single[:, used])
    return ~(checks.misfitting_pixels(left[kept]) & seen_strip), kept


def _loss(view: View, weight: Array, shares: Array) -> float:
    own = (view.drift**2).sum(axis=0) if view.drift.size else np.zeros(len(shares))
    return float(shares @ (view.residuals**2 @ weight + own))
