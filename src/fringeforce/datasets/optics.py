"""What is wrong with the optics of one image, and the image that comes of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Single
from fringeforce.base.errors import InputError
from fringeforce.contacts.press import Tractions
from fringeforce.datasets.study_file import OpticsRanges
from fringeforce.design.light import Plates
from fringeforce.design.pad import Pad
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_influence import Retardance
from fringeforce.models.pad_presses import press_slices
from fringeforce.optics import camera as camera_optics
from fringeforce.optics.integrated import LARGEST


@dataclass(frozen=True, eq=False)
class Optics:
    """The optics of one image.

    Attributes
    ----------
    light : float
        Over that of the design.
    gradient : (float, float)
        Change of light from the middle to the pad's right and to its lower end, of the mean.
    vignetting : float
        Loss of light in the corners.
    noise : float
        As in a design [grey levels].
    blur : float
        Standard deviation of the lens's point spread on the pad [m].
    wavelength_error : float
        True wavelength less that of the design [m].
    extinction_ratio : float
        Share of blocked light that passes a polariser.
    shift : (float, float)
        Shift of the camera along x and y [pixels].
    dead : ndarray, shape (d, 3)
        Row, column and grey level of pixels that show it always.
    """

    light: float
    gradient: tuple[float, float]
    vignetting: float
    noise: float
    blur: float
    wavelength_error: float
    extinction_ratio: float
    shift: tuple[float, float]
    dead: NDArray[np.int64]


def drawn_optics(ranges: OpticsRanges, pad: Pad, rng: np.random.Generator) -> Optics:
    """Optics at random."""
    plates, camera = pad.polariscope.plates or Plates(), pad.camera
    # everything is drawn whatever the ranges are, so that one of them changes nothing else
    size, direction = rng.uniform(*ranges.gradient), rng.uniform(0, 2 * np.pi)
    single = {
        "light": ranges.light,
        "vignetting": ranges.vignetting,
        "noise": ranges.noise or (camera.noise,) * 2,
        "blur": ranges.blur or (camera.blur or 0.0,) * 2,
        "wavelength_error": ranges.wavelength_error,
        "extinction_ratio": ranges.extinction_ratio or (plates.extinction_ratio,) * 2,
    }
    values = {name: float(rng.uniform(*ends)) for name, ends in single.items()}
    shift = rng.uniform(*ranges.shift, size=2)
    columns, rows = camera.pixels
    count = int(rng.integers(ranges.dead_pixels[0], ranges.dead_pixels[1] + 1))
    places = rng.choice(rows * columns, min(count, rows * columns), replace=False, shuffle=False)
    levels = rng.choice((0, camera.full_scale), len(places))
    dead = np.stack([*np.divmod(np.sort(places), columns), levels], axis=1)
    slope = size * np.array([np.cos(direction), np.sin(direction)]) / np.sqrt(2)
    return Optics(
        gradient=(float(slope[0]), float(slope[1])),
        shift=(float(shift[0]), float(shift[1])),
        dead=dead,
        **values,
    )


def image_of(
    model: PadModel,
    acting: Array | Sequence[Tractions],
    optics: Optics,
    rng: np.random.Generator,
) -> NDArray[np.unsignedinteger]:
    """The image that the camera delivers.

    Parameters
    ----------
    model : PadModel
        Model of the design.
    acting : ndarray, shape (n, 3), or sequence of Tractions
        N, T_x, T_y of every tactel [N], each uniform on its square; or small forces where they act,
        whose light the exact series of roller sides knows.
    optics : Optics
        In place of those of the design.
    rng : numpy.random.Generator
        Generator of the noise.

    Returns
    -------
    ndarray, shape frame_shape
        Grey levels.

    Raises
    ------
    InputError
        If a slice turns light by more than a wave.
    """
    varied = PadModel(_with_optics(model.sensor, optics), model.influence)
    x, y = (
        centres + moved * (centres[1] - centres[0])
        for centres, moved in zip(model.sensor.pixel_positions, optics.shift, strict=True)
    )
    if isinstance(acting, np.ndarray):
        modes = _modes(varied, acting, x, y)
        intensity = np.stack([varied.picture(modes, picture)[0] for picture in varied.pictures])
    else:
        slices = press_slices(model.sensor, acting, x, y)
        _check_turns(slices[..., ::4, ::4])
        intensity = varied.seen(slices)
    camera = varied.sensor.camera
    amplitude = camera.amplitude * optics.light * _lighting(varied.sensor, optics)
    lighting = amplitude, np.full_like(amplitude, camera.offset)
    frame = camera_optics.expose(camera, intensity.reshape(model.frame_shape), rng, lighting)
    rows, columns, levels = optics.dead.T
    frame[..., rows, columns] = levels
    return frame


def _with_optics(pad: Pad, optics: Optics) -> Pad:
    """The design with other light and lens; no rule of designs holds for what went wrong."""
    light = pad.polariscope
    plates = (light.plates or Plates()).model_copy(
        update={"extinction_ratio": optics.extinction_ratio}
    )
    channels = tuple(
        channel.model_copy(
            update={
                "wavelength": (channel.wavelength or light.wavelength) + optics.wavelength_error
            }
        )
        for channel in light.pictures
    )
    polariscope = light.model_copy(update={"plates": plates, "channels": channels})
    lens = {"noise": optics.noise, "blur": optics.blur or None}
    camera = pad.camera.model_copy(update=lens)
    return pad.model_copy(update={"polariscope": polariscope, "camera": camera})


def _modes(model: PadModel, forces: Array, x: Array, y: Array) -> Single:
    """Retardance of every depth profile at columns and rows."""
    influence = model.influence
    modes = Retardance.at(influence, x, y).forward(model.checked(forces, single=True))
    # stresses are smooth, so that some pixels know how far the largest turn is
    _check_turns(np.tensordot(influence.profile, modes[..., ::4, ::4], (1, 1)))
    return modes


def _check_turns(slices: Array) -> None:
    """InputError if a slice turns light by more than a wave."""
    if not np.sqrt((slices**2).sum(axis=1).max()) <= LARGEST:
        raise InputError(
            "The contacts turn light by more than a wave in one slice of the pad; take smaller "
            "forces."
        )


def _lighting(pad: Pad, optics: Optics) -> Array:
    """Light at every pixel over that in the middle, shape (rows, columns)."""
    columns, rows = pad.camera.pixels
    x, y = np.linspace(-1, 1, columns), np.linspace(-1, 1, rows)[:, None]
    even = 1 + optics.gradient[0] * x + optics.gradient[1] * y
    return np.clip(even, 0, None) * (1 - optics.vignetting * (x**2 + y**2) / 2)
