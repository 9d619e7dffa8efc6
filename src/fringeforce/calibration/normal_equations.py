"""Frames against expected grey levels, linearised in all unknowns.

A frame's own gain and offset are linear unknowns of that frame alone: they are set to their
likeliest values wherever the others are evaluated, and eliminated from the normal equations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.calibration.bench import SHIFT, Bench, Unknowns
from fringeforce.calibration.design_tangent import DesignTangent
from fringeforce.force.likelihood import Response, misfit

Array = NDArray[np.float64]

EVERY = slice(None)
"""All pixels."""
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
    slopes : ndarray, shape (F, P)
        Residuals in units of the noise.
    """

    phase: Array
    light: Array
    response: Response
    scale: Array
    shifts: Array
    drift: Array
    slopes: Array


@dataclass(frozen=True, eq=False)
class Derivatives:
    """What the levels of every frame change with, in units of the noise.

    Attributes
    ----------
    loads : ndarray, shape (F, 2n)
        Known loads [N].
    weights : ndarray, shape (F, P)
        Of all levels.
    turn : ndarray, shape (F, P)
        Derivative by the phase [1/rad].
    lit : ndarray, shape (2, F, P)
        Derivatives by amplitude and offset [1 / grey levels].
    changes : ndarray, shape (d + 2, P, 2n)
        Derivatives of the matrix by the design and the camera's place [rad/N].
    """

    loads: Array
    weights: Array
    turn: Array
    lit: Array
    changes: Array

    @property
    def moving(self) -> Array:
        """Derivatives by design and place of the camera, shape (d + 2, F, P)."""
        return self.turn * (self.loads @ np.swapaxes(self.changes, 1, 2))

    def by_matrix(self, levels: Array) -> Array:
        """Mixed derivatives by every pixel's matrix and what changes levels (..., F, P)."""
        return np.swapaxes(self.weights * self.turn * levels, -1, -2) @ self.loads


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
    slopes = misfit(bench.levels, level, response).slope * root
    gain, offset = bench.drift
    if not (gain or offset):
        none = np.empty((2, 0, light.shape[1]))
        return View(phase, light, response, scale, none, np.zeros((2, 0)), slopes)
    shifts = np.stack([gain * response.amplitude * light, np.full_like(light, offset)]) * scale
    even = np.ones(light.shape[1]) if weight is None else weight
    drift = own_light(slopes, shifts, even)
    level = level + np.einsum("cf,cfp->fp", drift, shifts) / scale
    slopes = misfit(bench.levels, level, response).slope * root
    return View(phase, light, response, scale, shifts, drift, slopes)


def own_light(slopes: Array, shifts: Array, weight: Array, prior: float = 1.0) -> Array:
    """Likeliest gain and offset of every frame, shape (2, F), in units of their deviations."""
    own = np.einsum("afp,bfp,p->fab", shifts, shifts, weight) + prior * np.eye(2)
    pull = np.einsum("afp,fp,p->fa", shifts, slopes, weight)
    return -np.linalg.solve(own, pull[..., None])[..., 0].T


def frame_weights(slopes: Array, averaged: Array) -> Array:
    """Weights of frames: less for those that fit much worse than most, shape (F,).

    Means of many frames are judged as single ones are: by grey levels, not by their own noise,
    beside which an unfinished fit is always wrong.
    """
    size = np.median(slopes**2, axis=1) / averaged
    return 1 / np.maximum(1, size / (SUSPECT * max(float(np.median(size)), 1e-12))) ** 2


def linearised(bench: Bench, at: Unknowns, tangent: DesignTangent, weight: Array) -> Normal:
    """Normal equations of all frames; parameters as in `seen`."""
    view, basis = seen(bench, at, tangent, weight), bench.basis
    shares = frame_weights(view.slopes, bench.averaged)
    derivatives = _derivatives(bench, at, tangent, view, shares[:, None] * weight)
    weights, lit, moving = derivatives.weights, derivatives.lit, derivatives.moving
    heavy = weights * lit
    flat = (moving * np.sqrt(weights)).reshape(len(moving), -1)
    to_pixels = np.einsum("mfp,kfp->mkp", moving, heavy)
    pixels = np.einsum("afp,bfp->abp", heavy, lit)
    mixed = np.concatenate(list(np.moveaxis(to_pixels @ basis, 1, 0)), axis=1)
    block = np.block([[basis.T @ (each[:, None] * basis) for each in row] for row in pixels])
    pixel_gradient = (heavy * view.slopes).sum(axis=1)
    to_frames, own, drifting = _drifting(view, moving, lit, weights, shares, basis)
    lights = np.einsum("pk,abp->pakb", basis, pixels).reshape(len(basis), -1, 2)
    return Normal(
        view=view,
        derivatives=derivatives,
        gradient=np.concatenate([flat @ (view.slopes * np.sqrt(weights)).ravel(),
                                 (pixel_gradient @ basis).ravel()]),
        hessian=np.block([[flat @ flat.T, mixed], [mixed.T, block]]),
        side=to_frames,
        own=own,
        coupling=np.concatenate([np.moveaxis(to_pixels, 2, 0), lights, drifting], axis=1),
        pixel_gradient=pixel_gradient,
        pixels=pixels,
    )  # fmt: skip


def _derivatives(
    bench: Bench, at: Unknowns, tangent: DesignTangent, view: View, weights: Array
) -> Derivatives:
    gain = np.ones((len(weights), 1))
    if bench.drift[0]:
        gain += bench.drift[0] * view.drift[0][:, None]
    return Derivatives(
        loads=bench.loads,
        weights=weights,
        turn=view.response.slope(view.phase) * view.scale * gain,
        lit=np.stack([view.light * gain * view.scale, np.broadcast_to(view.scale, weights.shape)]),
        changes=matrix_changes(bench, at, tangent),
    )


def matrix_changes(
    bench: Bench, at: Unknowns, tangent: DesignTangent, pixels: slice = EVERY
) -> Array:
    """Derivatives of the matrix by the design and the camera's place, shape (d + 2, p, 2n).

    Parameters
    ----------
    bench, at, tangent
        As in `seen`.
    pixels : slice
        Those that are wanted.
    """
    positions = at.positions(bench.sensor)[pixels]
    slope = tangent.matrix(at.design, positions, slope=True)
    along = np.stack([slope * SHIFT, slope * bench.sensor.pixel_positions[pixels, None]])
    return np.concatenate([tangent.at(positions)[1:], along])


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
