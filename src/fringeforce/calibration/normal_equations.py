"""Frames against expected grey levels, linearised in all unknowns.

A frame's own gain and offset are linear unknowns of that frame alone: they are set to their
likeliest values wherever the others are evaluated, and eliminated from the normal equations.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fringeforce.calibration.bench import Bench, Unknowns
from fringeforce.calibration.derivatives import Derivatives, matrix_changes
from fringeforce.calibration.design_tangent import DesignTangent
from fringeforce.force.likelihood import Response, misfit

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


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal equations about some unknowns; m of the bench, two of each frame and pixel.

    Attributes
    ----------
    view : View
        What they were linearised about.
    derivatives : Derivatives
        That they are made from.
    gradient : ndarray, shape (m,)
        Half that of the loss.
    hessian : ndarray, shape (m, m)
        Half the second derivatives, with frames' own light and pixels' pattern fixed.
    side, own : ndarray, shapes (m, 2F), (F, 2, 2)
        Mixed and pure ones of the frames' own gain and offset, their prior included.
    coupling : ndarray, shape (P, m + 2F, 2)
        Mixed ones with the pixels' pattern.
    pixel_gradient, pixels : ndarray, shapes (2, P), (2, 2, P)
        Those of the pattern itself.
    """

    view: View
    derivatives: Derivatives
    gradient: Array
    hessian: Array
    side: Array
    own: Array
    coupling: Array
    pixel_gradient: Array
    pixels: Array

    @property
    def profiled(self) -> Array:
        """Information on the unknowns of the bench once every frame's own light is free."""
        if not len(self.own):
            return self.hessian
        side = np.moveaxis(self.side.reshape(len(self.hessian), -1, 2), 1, 0)
        told = side @ np.linalg.solve(self.own, np.swapaxes(side, 1, 2))
        return self.hessian - told.sum(axis=0)

    @property
    def whole(self) -> Array:
        """Information on the unknowns of the bench and of the frames, shape (m + 2F,) squared."""
        frames = len(self.own)
        corner = np.zeros((frames, 2, frames, 2))
        corner[np.arange(frames), :, np.arange(frames), :] = self.own
        corner = corner.reshape(2 * frames, 2 * frames)
        return np.block([[self.hessian, self.side], [self.side.T, corner]])


@dataclass(frozen=True, eq=False)
class LevelSlopes:
    """Derivatives of the expected grey levels by all unknowns, in units of the noise.

    Attributes
    ----------
    view : View
        Where they were taken.
    loads : ndarray, shape (F, 2n)
        Known loads [N].
    turn : ndarray, shape (F, P)
        By the phase [1/rad].
    changes : ndarray, shape (d + 2, P, 2n)
        Those of the matrix by the design and the camera's place [rad/N].
    lit : ndarray, shape (2, F, P)
        By amplitude and offset at the pixel.
    basis : ndarray, shape (P, k)
        Smooth functions that make up the lighting.
    """

    view: View
    loads: Array
    turn: Array
    changes: Array
    lit: Array
    basis: Array

    @cached_property
    def moving(self) -> Array:
        """By the design and the camera's place, shape (d + 2, F, P)."""
        return self.turn * (self.loads @ np.swapaxes(self.changes, 1, 2))

    @property
    def dense(self) -> Array:
        """Unknown by unknown of the bench, shape (d + 2 + 2k, F, P)."""
        return np.concatenate([self.moving, *self.lit[:, None] * self.basis.T[None, :, None]])

    def frames(self) -> Iterator[LevelSlopes]:
        """Those of one frame after the other."""
        for row in range(len(self.turn)):
            one = slice(row, row + 1)
            yield replace(
                self,
                view=self.view.rows(one),
                loads=self.loads[one],
                turn=self.turn[one],
                lit=self.lit[:, one],
            )

    def normal(self, weight: Array) -> Normal:
        """Normal equations of the frames, with weights (P,) of the pixels."""
        view, moving, lit, basis = self.view, self.moving, self.lit, self.basis
        shares = frame_weights(view.residuals, view.averaged)
        weights = shares[:, None] * weight
        heavy = weights * lit
        flat = (moving * np.sqrt(weights)).reshape(len(moving), -1)
        to_pixels = np.einsum("mfp,kfp->mkp", moving, heavy)
        pixels = np.einsum("afp,bfp->abp", heavy, lit)
        mixed = np.concatenate(list(np.moveaxis(to_pixels @ basis, 1, 0)), axis=1)
        block = np.block([[basis.T @ (each[:, None] * basis) for each in row] for row in pixels])
        pixel_gradient = (heavy * view.residuals).sum(axis=1)
        to_frames, own, drifting = _drifting(view, moving, lit, weights, shares, basis)
        lights = np.einsum("pk,abp->pakb", basis, pixels).reshape(len(basis), -1, 2)
        return Normal(
            view=view,
            derivatives=Derivatives(self.loads, weights, self.turn, lit, self.changes),
            gradient=np.concatenate([flat @ (view.residuals * np.sqrt(weights)).ravel(),
                                     (pixel_gradient @ basis).ravel()]),
            hessian=np.block([[flat @ flat.T, mixed], [mixed.T, block]]),
            side=to_frames,
            own=own,
            coupling=np.concatenate([np.moveaxis(to_pixels, 2, 0), lights, drifting], axis=1),
            pixel_gradient=pixel_gradient,
            pixels=pixels,
        )  # fmt: skip


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


def linearised(bench: Bench, at: Unknowns, tangent: DesignTangent, weight: Array) -> Normal:
    """Normal equations of all frames; parameters as in `seen`."""
    return level_slopes(bench, at, tangent, weight).normal(weight)


def level_slopes(
    bench: Bench, at: Unknowns, tangent: DesignTangent, weight: Array | None = None
) -> LevelSlopes:
    """Derivatives of the grey levels of all frames; parameters as in `seen`."""
    view = seen(bench, at, tangent, weight)
    gain = np.ones((len(view.residuals), 1))
    if bench.drift[0]:
        gain += bench.drift[0] * view.drift[0][:, None]
    even = np.broadcast_to(view.scale, view.light.shape)
    return LevelSlopes(
        view=view,
        loads=bench.loads,
        turn=view.response.slope(view.phase) * view.scale * gain,
        changes=matrix_changes(bench, at, tangent),
        lit=np.stack([view.light * gain * view.scale, even]),
        basis=bench.basis,
    )


def _drifting(
    view: View, moving: Array, lit: Array, weights: Array, shares: Array, basis: Array
) -> tuple[Array, Array, Array]:
    """Second derivatives by the frames' own light: mixed, pure, and with the pattern."""
    frames, shifts = view.shifts.shape[1], view.shifts
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
