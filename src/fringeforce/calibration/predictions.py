"""Frames beside what their explanation lets expect of them.

A frame's own gain and offset are linear unknowns of that frame alone: they are set to their
likeliest values wherever the others are evaluated, and eliminated from the normal equations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.design_jacobian import DesignJacobian
from fringeforce.calibration.measurements import Measurements, Unknowns
from fringeforce.estimation.likelihood import Response, misfit

SUSPECT = 3.0
"""Times the median misfit beyond which a frame loses weight."""


@dataclass(frozen=True, eq=False)
class Predictions:
    """What the unknowns let expect of every frame, and how the frames differ from it.

    Attributes
    ----------
    phase : ndarray, shape (F, P)
        Phase of every frame, the analyser's turn included [rad].
    light : ndarray, shape (F, P)
        Normalised intensity.
    response : Response
        Response of the camera.
    scale : ndarray, shape (F, 1)
        Inverse standard deviation of the noise of every row, 1 / grey levels.
    shifts : ndarray, shape (2, F, P)
        What a frame's own gain and offset change, each by its standard deviation, over the noise.
    drift : ndarray, shape (2, F)
        Own gain and offset of the frames, in units of their standard deviations.
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

    def rows(self, chosen: slice) -> Predictions:
        """Some of the frames."""
        return Predictions(
            phase=self.phase[chosen],
            light=self.light[chosen],
            response=self.response,
            scale=self.scale[chosen],
            shifts=self.shifts[:, chosen],
            drift=self.drift[:, chosen],
            residuals=self.residuals[chosen],
            averaged=self.averaged[chosen],
        )


def predict(
    measured: Measurements, at: Unknowns, jacobian: DesignJacobian, weight: Array | None = None
) -> Predictions:
    """Compare all frames with what the unknowns let expect.

    Parameters
    ----------
    measured : Measurements
        The frames.
    at : Unknowns
        Unknowns that explain the frames.
    jacobian : DesignJacobian
        The matrix about a design.
    weight : ndarray, shape (P,), optional
        Weights of the pixels when a frame's own light is found; all alike if not given.
    """
    matrix = jacobian.matrix(at.design, at.positions(measured.sensor))
    phase = measured.loads @ matrix.T + measured.turned[:, None]
    light, response = np.sin(phase / 2) ** 2, at.response(measured)
    scale = np.sqrt(measured.averaged / response.variance)[:, None]
    root = np.sqrt(measured.averaged)[:, None]
    level = response.amplitude * light + response.offset
    residuals = misfit(measured.levels, level, response).slope * root
    gain, offset = measured.drift
    if not (gain or offset):
        none = np.empty((2, 0, light.shape[1]))
        return Predictions(
            phase, light, response, scale, none, np.zeros((2, 0)), residuals, measured.averaged
        )
    shifts = np.stack([gain * response.amplitude * light, np.full_like(light, offset)]) * scale
    even = np.ones(light.shape[1]) if weight is None else weight
    drift = frame_illumination(residuals, shifts, even)
    level = level + np.einsum("cf,cfp->fp", drift, shifts) / scale
    residuals = misfit(measured.levels, level, response).slope * root
    return Predictions(phase, light, response, scale, shifts, drift, residuals, measured.averaged)


def frame_illumination(residuals: Array, shifts: Array, weight: Array, prior: float = 1.0) -> Array:
    """Likeliest gain and offset of every frame, shape (2, F), over their standard deviations."""
    own = illumination_information(shifts, weight, prior)
    gradients = np.einsum("afp,fp,p->fa", shifts, residuals, weight)
    return -np.linalg.solve(own, gradients[..., None])[..., 0].T


def illumination_information(shifts: Array, weight: Array, prior: float) -> Array:
    """Information on every frame's gain and offset, that of the prior included, (F, 2, 2)."""
    return np.einsum("afp,bfp,p->fab", shifts, shifts, weight) + prior * np.eye(2)


def frame_weights(residuals: Array, averaged: Array) -> Array:
    """Weights of frames: less for those that fit much worse than most, shape (F,).

    Means of many frames are judged as single ones are: by grey levels, not by their own noise,
    beside which an unfinished fit is always wrong.
    """
    size = np.median(residuals**2, axis=1) / averaged
    return 1 / np.maximum(1, size / (SUSPECT * max(float(np.median(size)), 1e-12))) ** 2
