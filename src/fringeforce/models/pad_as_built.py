"""One real pad: a design whose tolerances have been drawn, exposed as often as wanted.

Values of the design are drawn once.  The residual is a smooth random field for each of its two
parts, which all slices of the photoelastic layer share.  The traction on each square is drawn anew
for every frame: it is

    (force / area) (1 + c_1 xi + c_2 eta + c_3 P_2(xi) + c_4 P_2(eta) + c_5 xi eta + ...)

with xi, eta from -1 to 1 over the square, Legendre's P_2, and all products of the third and the
fourth order.  c_1 and c_2 move its centre by side / 6 each, c_3 and c_4 widen it by side / 5
(sqrt(12) times its standard deviation along an axis), c_5 turns its axes; those of higher orders
are as large as c_3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import RectBivariateSpline
from scipy.ndimage import convolve1d

from fringeforce.design.pad import Pad
from fringeforce.mechanics.solid.block import Patches
from fringeforce.models.as_built import FIELD_STEP, PLACEMENT, RESIDUAL, SIZE
from fringeforce.models.pad_presses import press_slices
from fringeforce.models.pad_slices import block_of, slice_retardance
from fringeforce.models.presses import Presses, are_presses
from fringeforce.models.temperature import warm_forces
from fringeforce.optics import camera as camera_optics

Array = NDArray[np.float64]
Single = NDArray[np.float32]

HIGHEST = 4
"""Order of the polynomials of a traction.

A traction on a share s of the side has the coefficients (2 n + 1) mean P_n(s t), -1 < t < 1: with
s = 0.9 that of the fourth order, -0.57, is larger than that of the second, -0.48.  A cover of a
quarter of the side leaves exp(-(n + 1/2) / 2) of order n, a tenth of the fourth, which a frame of 8
bits shows, and a twenty-fifth of the sixth, which is left out."""
SHAPES = (
    *((1, 0), (0, 1), (2, 0), (0, 2), (1, 1)),
    *((order - k, k) for order in range(3, HIGHEST + 1) for k in range(order + 1)),
)
"""Orders along x and y of the polynomials of a traction beyond the uniform one."""
CENTRE_SHARE, WIDTH_SHARE = 1 / 6, 1 / 5
"""By what share of the side of a square the first and the second polynomials move its centre and
widen it."""
TURNED = float(np.sqrt(0.72))
"""Standard deviation of that of xi eta over that of the second ones, so that the matrix of
second moments is as likely in any axes (2 / 15 by sqrt 2, over 1 / 9)."""


def spreads(pad: Pad) -> Array:
    """Standard deviations of the coefficients of a traction, shape (14,), in the order of `SHAPES`.

    Parameters
    ----------
    pad : Pad
        The design with its tolerances.
    """
    side = pad.tactels.side
    first = pad.tolerances.get(PLACEMENT, 0.0) / (CENTRE_SHARE * side)
    second = pad.tolerances.get(SIZE, 0.0) / (WIDTH_SHARE * side)
    higher = [second] * (len(SHAPES) - 5)
    return np.array([first, first, second, second, TURNED * second, *higher])


class DrawnModel(Protocol):
    """What is asked of the model of a drawn design; `PadModel` is one."""

    @property
    def sensor(self) -> Pad:
        """The design."""
        ...

    @property
    def frame_shape(self) -> tuple[int, ...]:
        """Shape of a frame."""
        ...

    def slices(self, forces: ArrayLike) -> Single:
        """Retardance of every slice [rad]."""
        ...

    def checked(self, forces: ArrayLike, single: bool = False) -> Array:
        """Forces as floats."""
        ...

    def seen(self, slices: ArrayLike) -> Single:
        """Intensity of light through slices."""
        ...


@dataclass(frozen=True, eq=False)
class BuiltPad:
    """One pad made from a drawing with tolerances; `PadModel.as_built` makes it.

    Attributes
    ----------
    drawing : Pad
        The design with its tolerances.
    model : PadModel
        The pad's own model: its design holds the values that were drawn, which readers of the
        drawing's model do not know.
    residual : ndarray, shape (2, rows, columns)
        Retardance (A, B) over both passes without load [rad].

    Examples
    --------
    >>> drawing = ff.load_sensor("pad").replace(
    ...     tactels={"count": [2, 2]}, **{"polariscope.residual": "0 +/- 0.05 rad"}
    ... )
    >>> real = ff.characterize(drawing).as_built(rng=0)
    >>> real.expose(np.zeros((4, 3)), rng=1).shape
    (256, 256)
    """

    drawing: Pad
    model: DrawnModel
    residual: Array

    def contacts(self, frames: int | tuple[int, ...] = (), rng: camera_optics.Rng = None) -> Array:
        """Draw how the tractions on the squares are spread in frames.

        Parameters
        ----------
        frames : int or tuple of int
            Number of frames, or shape of a batch.
        rng : int, numpy.random.Generator or None
            Source of the draws.

        Returns
        -------
        ndarray, shape (..., n, 14)
            Coefficients of the polynomials of each tactel, as at the top of this page.
        """
        generator = np.random.default_rng(rng)
        shape = (*np.atleast_1d(np.asarray(frames, dtype=int)), self.drawing.tactels.total)
        return spreads(self.drawing) * generator.standard_normal((*shape, len(SHAPES)))

    def intensity(self, forces: ArrayLike | Presses, contacts: Array | None = None) -> Array:
        """Share of a perfect dark field's light that each pixel gets, shape (..., *frame_shape).

        Parameters
        ----------
        forces : array_like, shape (..., n, 3), or sequence of Press
            N, T_x, T_y of every tactel [N], or what really touches, in one frame or in several.
        contacts : ndarray, shape (..., n, 14), optional
            How the tractions are spread; uniform if not given.
        """
        if are_presses(forces):
            if len(forces) and isinstance(forces[0], Sequence):
                return np.array([self.intensity(one) for one in forces])
            pad = self.model.sensor
            slices = press_slices(pad, forces, *pad.pixel_positions)
            return self.seen(slices).reshape(self.model.frame_shape).astype(float)
        loads = self.model.checked(cast(ArrayLike, forces))
        flat = loads.reshape(-1, *loads.shape[-2:])
        spread = (
            [None] * len(flat) if contacts is None else contacts.reshape(len(flat), -1, len(SHAPES))
        )
        found = [self._intensity(*one) for one in zip(flat, spread, strict=True)]
        return np.array(found, dtype=float).reshape(*loads.shape[:-2], *self.model.frame_shape)

    def _intensity(self, forces: Array, contact: Array | None) -> Single:
        slices = self.model.slices(forces).astype(float)
        if contact is not None and contact.any():
            pad = self.model.sensor
            loads = [
                (Patches(pad.tactels.places, pad.tactels.side, orders), forces * one[:, None])
                for orders, one in zip(SHAPES, contact.T, strict=True)
            ]
            ends = np.array([pad.transducer.length, pad.transducer.width]) / 2
            x, y = (
                np.clip(places, -end, end)
                for places, end in zip(pad.pixel_positions, ends, strict=True)
            )
            slices += slice_retardance(pad, loads, x, y, len(slices))
        return self.seen(slices)

    def seen(self, slices: ArrayLike) -> Single:
        """Intensity of light through slices, as of `PadModel.seen`, with the residual as well."""
        stack = np.asarray(slices)
        weights = block_of(self.model.sensor).depths(len(stack))[1]
        share = weights / (2 * weights.sum())
        return self.model.seen(stack + share[:, None, None, None] * self.residual)

    def expose(
        self,
        forces: ArrayLike | Presses,
        rng: camera_optics.Rng = None,
        contacts: Array | None = None,
        temperature: ArrayLike | None = None,
    ) -> NDArray[np.unsignedinteger]:
        """Frames that the camera of this pad would deliver, each with contacts of its own.

        Parameters
        ----------
        forces : array_like, shape (..., n, 3), or sequence of Press
            N, T_x, T_y of every tactel [N], or what really touches, as of `intensity`.
        rng : int, numpy.random.Generator or None
            Source of contacts, light and noise.
        contacts : ndarray, shape (..., n, 14), optional
            How the tractions are spread, if it is known; drawn anew for every frame if not given.
        temperature : array_like, shape () or (...), optional
            Of the photoelastic layer, as of `PadModel.expose` [K].
        """
        generator, axes = np.random.default_rng(rng), len(self.model.frame_shape)
        if contacts is None and not are_presses(forces) and spreads(self.drawing).any():
            contacts = self.contacts(np.shape(cast(ArrayLike, forces))[:-2], generator)
        light = self.intensity(warm_forces(self.model.sensor, forces, temperature), contacts)
        return camera_optics.expose(self.model.sensor.camera, light, generator, frame_axes=axes)


def built_pad(drawing: Pad, model: DrawnModel, generator: np.random.Generator) -> BuiltPad:
    """Add to the model of a drawn design what is not one number.

    Parameters
    ----------
    drawing : Pad
        The design with its tolerances.
    model : PadModel
        Of the values that were drawn from it.
    generator : numpy.random.Generator
        Source of the residual's fields.
    """
    x, y = model.sensor.pixel_positions
    residual = np.zeros((2, len(y), len(x)))
    std = drawing.tolerances.get(RESIDUAL, 0.0)
    if std:
        length = drawing.polariscope.residual_length
        residual = std * np.stack([smooth_image(x, y, length, generator) for _ in range(2)])
    return BuiltPad(drawing, model, residual)


def smooth_image(x: Array, y: Array, length: float, generator: np.random.Generator) -> Array:
    """A Gaussian process of unit variance with covariance exp(-(distance / length)^2 / 2).

    White noise behind a Gaussian filter along either axis, as `as_built.smooth_field` does it.

    Parameters
    ----------
    x, y : ndarray, shape (columns,), (rows,)
        Places, ascending [m].
    length : float
        Correlation length [m].
    generator : numpy.random.Generator
        Source of the noise.

    Returns
    -------
    ndarray, shape (rows, columns)
    """
    step, reach = length / FIELD_STEP, 5 * FIELD_STEP
    grids = [np.arange(places[0] - 2 * step, places[-1] + 3 * step, step) for places in (y, x)]
    kernel = np.exp(-np.square(np.arange(-reach, reach + 1) / FIELD_STEP))
    kernel /= np.linalg.norm(kernel)
    values = generator.standard_normal([len(grid) + 2 * reach for grid in grids])
    for axis in (0, 1):
        values = convolve1d(values, kernel, axis)
    smooth = values[reach:-reach, reach:-reach]
    return np.asarray(RectBivariateSpline(grids[0], grids[1], smooth)(y, x))
