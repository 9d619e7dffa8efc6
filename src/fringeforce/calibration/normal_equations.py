"""Normal equations of all unknowns: its expected grey levels, linearised."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.design_jacobian import DesignJacobian
from fringeforce.calibration.measurements import SHIFT, Measurements, Unknowns
from fringeforce.calibration.predictions import Predictions, frame_weights, predict

EVERY = slice(None)
"""All pixels."""


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Normal equations about some unknowns; m shared ones, two of each frame and pixel.

    Attributes
    ----------
    jacobian : LevelJacobian
        Derivatives that they are made from.
    weights : ndarray, shape (F, P)
        Weights of all levels.
    gradient : ndarray, shape (m,)
        Half that of the loss.
    hessian : ndarray, shape (m, m)
        Half the second derivatives, with frames' own light and pixels' pattern fixed.
    side, own : ndarray, shapes (m, 2F), (F, 2, 2)
        Mixed and pure ones of the frames' own gain and offset, their prior included.
    coupling : ndarray, shape (P, m + 2F, 2)
        Mixed ones with the pixels' pattern.
    pixel_gradient, pixels : ndarray, shapes (2, P), (2, 2, P)
        Gradient and second derivatives by the pattern itself.
    """

    jacobian: LevelJacobian
    weights: Array
    gradient: Array
    hessian: Array
    side: Array
    own: Array
    coupling: Array
    pixel_gradient: Array
    pixels: Array

    @property
    def predicted(self) -> Predictions:
        """What they were linearised about."""
        return self.jacobian.predicted

    def by_matrix(self, levels: Array) -> Array:
        """Mixed derivatives by every pixel's matrix and what changes levels (..., F, P)."""
        return np.swapaxes(self.weights * self.jacobian.turn * levels, -1, -2) @ self.jacobian.loads

    @property
    def profiled(self) -> Array:
        """Information on the shared unknowns once every frame's own light is free."""
        if not len(self.own):
            return self.hessian
        side = np.moveaxis(self.side.reshape(len(self.hessian), -1, 2), 1, 0)
        told = side @ np.linalg.solve(self.own, np.swapaxes(side, 1, 2))
        return self.hessian - told.sum(axis=0)

    @property
    def whole(self) -> Array:
        """Information on the shared unknowns and those of the frames, shape (m + 2F,) squared."""
        frames = len(self.own)
        corner = np.zeros((frames, 2, frames, 2))
        corner[np.arange(frames), :, np.arange(frames), :] = self.own
        corner = corner.reshape(2 * frames, 2 * frames)
        return np.block([[self.hessian, self.side], [self.side.T, corner]])


@dataclass(frozen=True, eq=False)
class LevelJacobian:
    """Jacobian of the expected grey levels: derivatives by all unknowns, in units of the noise.

    Attributes
    ----------
    predicted : Predictions
        Where they were taken.
    loads : ndarray, shape (F, 2n)
        Known loads [N].
    turn : ndarray, shape (F, P)
        By the phase [1/rad].
    changes : ndarray, shape (d + 2, P, 2n)
        Derivatives of the matrix by the design and the camera's place [rad/N].
    lit : ndarray, shape (2, F, P)
        By amplitude and offset at the pixel.
    basis : ndarray, shape (P, k)
        Smooth functions that make up the lighting.
    """

    predicted: Predictions
    loads: Array
    turn: Array
    changes: Array
    lit: Array
    basis: Array

    @property
    def moving(self) -> Array:
        """By the design and the camera's place, shape (d + 2, F, P)."""
        return self.turn * (self.loads @ np.swapaxes(self.changes, 1, 2))

    @property
    def dense(self) -> Array:
        """Derivatives by each shared unknown, shape (d + 2 + 2k, F, P)."""
        return np.concatenate([self.moving, *self.lit[:, None] * self.basis.T[None, :, None]])

    def frames(self) -> Iterator[LevelJacobian]:
        """Jacobians of one frame after the other."""
        for row in range(len(self.turn)):
            one = slice(row, row + 1)
            yield replace(
                self,
                predicted=self.predicted.rows(one),
                loads=self.loads[one],
                turn=self.turn[one],
                lit=self.lit[:, one],
            )

    def normal(self, weight: Array) -> NormalEquations:
        """Normal equations of the frames, with weights (P,) of the pixels."""
        predicted, moving, lit, basis = self.predicted, self.moving, self.lit, self.basis
        shares = frame_weights(predicted.residuals, predicted.averaged)
        weights = shares[:, None] * weight
        heavy = weights * lit
        flat = (moving * np.sqrt(weights)).reshape(len(moving), -1)
        to_pixels = np.einsum("mfp,kfp->mkp", moving, heavy)
        pixels = np.einsum("afp,bfp->abp", heavy, lit)
        mixed = np.concatenate(list(np.moveaxis(to_pixels @ basis, 1, 0)), axis=1)
        block = np.block([[basis.T @ (each[:, None] * basis) for each in row] for row in pixels])
        pixel_gradient = (heavy * predicted.residuals).sum(axis=1)
        to_frames, own, drifting = _drifting(predicted, moving, lit, weights, shares, basis)
        lights = np.einsum("pk,abp->pakb", basis, pixels).reshape(len(basis), -1, 2)
        return NormalEquations(
            jacobian=self,
            weights=weights,
            gradient=np.concatenate([flat @ (predicted.residuals * np.sqrt(weights)).ravel(),
                                     (pixel_gradient @ basis).ravel()]),
            hessian=np.block([[flat @ flat.T, mixed], [mixed.T, block]]),
            side=to_frames,
            own=own,
            coupling=np.concatenate([np.moveaxis(to_pixels, 2, 0), lights, drifting], axis=1),
            pixel_gradient=pixel_gradient,
            pixels=pixels,
        )  # fmt: skip


def matrix_changes(
    measured: Measurements, at: Unknowns, jacobian: DesignJacobian, pixels: slice = EVERY
) -> Array:
    """Derivatives of the matrix by the design and the camera's place, shape (d + 2, p, 2n).

    Parameters
    ----------
    measured, at, jacobian
        Frames, their explanation, and the matrix about a design.
    pixels : slice
        Pixels that are wanted.
    """
    positions = at.positions(measured.sensor)[pixels]
    slope = jacobian.matrix(at.design, positions, slope=True)
    along = np.stack([slope * SHIFT, slope * measured.sensor.pixel_positions[pixels, None]])
    return np.concatenate([jacobian.at(positions)[1:], along])


def linearised(
    measured: Measurements, at: Unknowns, jacobian: DesignJacobian, weight: Array
) -> NormalEquations:
    """Normal equations of all frames; parameters as in `predict`."""
    return level_jacobian(measured, at, jacobian, weight).normal(weight)


def level_jacobian(
    measured: Measurements, at: Unknowns, jacobian: DesignJacobian, weight: Array | None = None
) -> LevelJacobian:
    """Jacobian of the grey levels of all frames; parameters as in `predict`."""
    predicted = predict(measured, at, jacobian, weight)
    gain = np.ones((len(predicted.residuals), 1))
    if measured.drift[0]:
        gain += measured.drift[0] * predicted.drift[0][:, None]
    even = np.broadcast_to(predicted.scale, predicted.light.shape)
    return LevelJacobian(
        predicted=predicted,
        loads=measured.loads,
        turn=predicted.response.slope(predicted.phase) * predicted.scale * gain,
        changes=matrix_changes(measured, at, jacobian),
        lit=np.stack([predicted.light * gain * predicted.scale, even]),
        basis=measured.basis,
    )


def _drifting(
    predicted: Predictions, moving: Array, lit: Array, weights: Array, shares: Array, basis: Array
) -> tuple[Array, Array, Array]:
    """Second derivatives by the frames' own light: mixed, pure, and with the pattern."""
    frames, shifts = predicted.shifts.shape[1], predicted.shifts
    unknowns = len(moving) + 2 * basis.shape[1]
    if not frames:
        none = np.empty((len(basis), 0, 2))
        return np.empty((unknowns, 0)), np.empty((0, 2, 2)), none
    heavy = weights * shifts
    to_moving = np.einsum("mfp,cfp->mfc", moving, heavy)
    with_pixels = heavy[:, None] * lit
    to_lights = np.einsum("cafp,pk->akfc", with_pixels, basis, optimize=True)
    side = np.concatenate([to_moving, to_lights.reshape(-1, frames, 2)])
    own = np.einsum("afp,bfp->fab", heavy, shifts) + shares[:, None, None] * np.eye(2)
    with_pattern = np.einsum("cafp->pfca", with_pixels).reshape(len(basis), -1, 2)
    return side.reshape(unknowns, -1), own, with_pattern
