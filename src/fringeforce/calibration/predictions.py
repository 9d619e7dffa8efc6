"""Frames beside what their explanation lets expect of them.

A frame's own gain and offset are linear unknowns of that frame alone: they are set to their
likeliest values wherever the others are evaluated, and eliminated from the normal equations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.calibration.design_jacobian import DesignTangent
from fringeforce.calibration.measurements import Bench, Unknowns
from fringeforce.estimation.likelihood import Response, misfit

Array = NDArray[np.float64]

SUSPECT = 3.0
"""Times the median misfit beyond which a frame loses weight."""


@dataclass(frozen=True, eq=False)
class View:
    """What the unknowns let expect of every frame, and how the frames differ from it.

    Attributes
    ----------
    phase : ndarray, shape (F, P)
        Phase of every frame, the analyser's turn included [rad].
    light : ndarray, shape (F, P)
        Normalised intensity.
    response : Response
        Of the camera.
    scale : ndarray, shape (F, 1)
        Inverse deviation of the noise of every row, 1 / grey levels.
    shifts : ndarray, shape (2, F, P)
        What a frame's own gain and offset change, each by its deviation, in units of the noise.
    drift : ndarray, shape (2, F)
        Own gain and offset of the frames, in units of their deviations.
    residuals : ndarray, shape (F, P)
        Likelihood residuals in units of the noise.
    averaged : ndarray, shape (F,)
        How many frames each row is the mean of.
    """

    phase: Array
    light: Array
    response: Response
    scale: Array
    shifts: Array
    drift: Array
    residuals: Array
    averaged: Array

    def rows(self, chosen: slice) -> View:
        """Some of the frames."""
        return View(
            phase=self.phase[chosen],
            light=self.light[chosen],
            response=self.response,
            scale=self.scale[chosen],
            shifts=self.shifts[:, chosen],
            drift=self.drift[:, chosen],
            residuals=self.residuals[chosen],
            averaged=self.averaged[chosen],
        )


def seen(bench: Bench, at: Unknowns, tangent: DesignTangent, weight: Array | None = None) -> View:
    """Compare all frames with what the unknowns let expect.

    Parameters
    ----------
    bench : Bench
        The frames.
    at : Unknowns
        Their explanation.
    tangent : DesignTangent
        The matrix about a design.
    weight : ndarray, shape (P,), optional
        Of the pixels, when a frame's own light is found; all alike if not given.
    """
    matrix = tangent.matrix(at.design, at.positions(bench.sensor))
    phase = bench.loads @ matrix.T + bench.turned[:, None]
    light, response = np.sin(phase / 2) ** 2, at.response(bench)
    scale = np.sqrt(bench.averaged / response.variance)[:, None]
    root = np.sqrt(bench.averaged)[:, None]
    level = response.amplitude * light + response.offset
    residuals = misfit(bench.levels, level, response).slope * root
    gain, offset = bench.drift
    if not (gain or offset):
        none = np.empty((2, 0, light.shape[1]))
        return View(
            phase, light, response, scale, none, np.zeros((2, 0)), residuals, bench.averaged
        )
    shifts = np.stack([gain * response.amplitude * light, np.full_like(light, offset)]) * scale
    even = np.ones(light.shape[1]) if weight is None else weight
    drift = own_light(residuals, shifts, even)
    level = level + np.einsum("cf,cfp->fp", drift, shifts) / scale
    residuals = misfit(bench.levels, level, response).slope * root
    return View(phase, light, response, scale, shifts, drift, residuals, bench.averaged)


def own_light(residuals: Array, shifts: Array, weight: Array, prior: float = 1.0) -> Array:
    """Likeliest gain and offset of every frame, shape (2, F), in units of their deviations."""
    own = light_information(shifts, weight, prior)
    pull = np.einsum("afp,fp,p->fa", shifts, residuals, weight)
    return -np.linalg.solve(own, pull[..., None])[..., 0].T


def light_information(shifts: Array, weight: Array, prior: float) -> Array:
    """Information on every frame's gain and offset, that of the prior included, (F, 2, 2)."""
    return np.einsum("afp,bfp,p->fab", shifts, shifts, weight) + prior * np.eye(2)


def frame_weights(residuals: Array, averaged: Array) -> Array:
    """Weights of frames: less for those that fit much worse than most, shape (F,).

    Means of many frames are judged as single ones are: by grey levels, not by their own noise,
    beside which an unfinished fit is always wrong.
    """
    size = np.median(residuals**2, axis=1) / averaged
    return 1 / np.maximum(1, size / (SUSPECT * max(float(np.median(size)), 1e-12))) ** 2
