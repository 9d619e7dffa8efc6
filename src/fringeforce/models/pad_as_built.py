"""One real pad: a design whose tolerances have been drawn, exposed as often as wanted.

Values of the design are drawn once.  The residual is a smooth random field for each of its two
parts, which all slices of the photoelastic layer share.  The traction on each tactel is drawn anew
for every frame: it is uniform over a rectangle, whose centre is normal about the tactel with the
deviation `tactels.placement` along either axis, and whose sides are normal about `tactels.size`
with the deviation of that.
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
from fringeforce.models.as_built import FIELD_STEP, LIGHT_LENGTH, PLACEMENT, RESIDUAL, SIZE
from fringeforce.models.creep import crept_forces
from fringeforce.models.pad_presses import press_slices
from fringeforce.models.pad_slices import block_of, slice_retardance
from fringeforce.models.presses import Presses, are_presses
from fringeforce.models.temperature import warm_forces
from fringeforce.optics import camera as camera_optics

Array = NDArray[np.float64]
Single = NDArray[np.float32]


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
    light : ndarray, shape (rows, columns), optional
        Light over that of the design, at every pixel.

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
    light: Array | None = None

    @property
    def _touched_anew(self) -> bool:
        return any(path in self.drawing.tolerances for path in (PLACEMENT, SIZE))

    def contacts(self, frames: int | tuple[int, ...] = (), rng: camera_optics.Rng = None) -> Array:
        """Draw where the tractions of tactels are in frames.

        Parameters
        ----------
        frames : int or tuple of int
            Number of frames, or shape of a batch.
        rng : int, numpy.random.Generator or None
            Source of the draws.

        Returns
        -------
        ndarray, shape (..., n, 4)
            Of each tactel how far the centre is beside it along x and y, and the sides along x and
            y [m].
        """
        generator = np.random.default_rng(rng)
        tactels, tolerances = self.drawing.tactels, self.drawing.tolerances
        shape = (*np.atleast_1d(np.asarray(frames, dtype=int)), tactels.total, 2)
        beside = tolerances.get(PLACEMENT, 0.0) * generator.standard_normal(shape)
        longer = tolerances.get(SIZE, 0.0) * generator.standard_normal(shape)
        # a side that would be less than nothing is that of its mirror image
        return np.concatenate([beside, np.abs(tactels.side + longer)], axis=-1)

    def intensity(self, forces: ArrayLike | Presses, contacts: Array | None = None) -> Array:
        """Share of a perfect dark field's light that each pixel gets, shape (..., *frame_shape).

        Parameters
        ----------
        forces : array_like, shape (..., n, 3), or sequence of Press
            N, T_x, T_y of every tactel [N], or what really touches, in one frame or in several.
        contacts : ndarray, shape (..., n, 4), optional
            Where the tractions are, as of `contacts`; on their squares if not given.
        """
        if are_presses(forces):
            if len(forces) and isinstance(forces[0], Sequence):
                return np.array([self.intensity(one) for one in forces])
            pad = self.model.sensor
            slices = press_slices(pad, forces, *pad.pixel_positions)
            return self.seen(slices).reshape(self.model.frame_shape).astype(float)
        loads = self.model.checked(cast(ArrayLike, forces))
        flat = loads.reshape(-1, *loads.shape[-2:])
        drawn = [None] * len(flat) if contacts is None else contacts.reshape(*flat.shape[:2], 4)
        found = [self._intensity(*one) for one in zip(flat, drawn, strict=True)]
        return np.array(found, dtype=float).reshape(*loads.shape[:-2], *self.model.frame_shape)

    def _intensity(self, forces: Array, contact: Array | None) -> Single:
        slices = self.model.slices(forces).astype(float)
        if contact is not None:
            pad = self.model.sensor
            tactels = pad.tactels
            # what differs from the squares, whose sides the series need not have
            loads = [
                (Patches(tactels.places + contact[:, :2], contact[:, 2:]), forces),
                (Patches(tactels.places, self.drawing.tactels.side), -forces),
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
        times: ArrayLike | None = None,
    ) -> NDArray[np.unsignedinteger]:
        """Frames that the camera of this pad would deliver, each with contacts of its own.

        Parameters
        ----------
        forces : array_like, shape (..., n, 3), or sequence of Press
            N, T_x, T_y of every tactel [N], or what really touches, as of `intensity`.
        rng : int, numpy.random.Generator or None
            Source of contacts, light and noise.
        contacts : ndarray, shape (..., n, 4), optional
            Where the tractions are, if it is known; drawn anew for every frame if not given.
        temperature, times
            As of `PadModel.expose`.
        """
        generator, axes = np.random.default_rng(rng), len(self.model.frame_shape)
        if contacts is None and not are_presses(forces) and self._touched_anew:
            contacts = self.contacts(np.shape(cast(ArrayLike, forces))[:-2], generator)
        shown = crept_forces(self.model.sensor, forces, times)
        light = self.intensity(warm_forces(self.model.sensor, shown, temperature), contacts)
        camera = self.model.sensor.camera
        light = light if self.light is None else light * self.light
        return camera_optics.expose(camera, light, generator, frame_axes=axes)


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
    uneven, light = model.sensor.camera.unevenness, None
    if uneven:
        length = LIGHT_LENGTH * model.sensor.transducer.length
        light = np.maximum(1 + uneven * smooth_image(x, y, length, generator), 0.0)
    return BuiltPad(drawing, model, residual, light)


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
