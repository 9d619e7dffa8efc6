"""What an eye or a camera sees of a pad, as colours for a screen."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Single
from fringeforce.design.light import Plates
from fringeforce.design.pad import Pad, PadPolariscope
from fringeforce.models.pad import PadModel
from fringeforce.optics import camera as camera_optics
from fringeforce.optics.area_camera import MOSAIC, Picture, measure
from fringeforce.optics.arrangement import arranged
from fringeforce.optics.colour import encoded, light_colour, white_light
from fringeforce.optics.integrated import turn

Octets = NDArray[np.uint8]

COARSE, FINE = 96, 256
"""Pixels along the longer side of what the eye sees: while something moves, and at rest."""
WAVELENGTHS = np.linspace(420e-9, 680e-9, 10)
"""That stand for white light [m]."""
SLICE = 64
"""Pixels along the longer side of a picture of a slice."""


def views(pad: Pad) -> list[tuple[str, str]]:
    """What can be looked at: keys and names."""
    nanometres = pad.polariscope.wavelength * 1e9
    found = [("white", "White light"), ("light", f"Light of {nanometres:.4g} nm")]
    several = len(pad.polariscope.pictures) > 1
    for number, channel in enumerate(pad.polariscope.pictures):
        own = f"channel {number + 1}, " if several else ""
        if pad.camera.kind == "polarisation":
            angles = np.ravel(MOSAIC)
            found += [
                (f"picture-{number}-{k}", f"{own}analyser {angles[k]:g}°".capitalize())
                for k in np.argsort(angles)
            ]
        elif several or channel.arrangement not in (None, "dark field"):
            kind = channel.arrangement or "dark field"
            turned = f" {channel.angle:g}°" if kind in ("plane", "analyser") else ""
            found.append((f"picture-{number}-0", f"{own}{kind}{turned}".capitalize()))
        found.append((f"camera-{number}", f"{own}camera frame".capitalize()))
    return found


def eye(model: PadModel, longest: int) -> PadModel:
    """A pad seen on fewer pixels by a perfect lens."""
    light = {"channels": ()}
    camera = {"pixels": _pixels(model.sensor, longest), "blur": None, "kind": "ordinary"}
    return replace(model, sensor=model.sensor.replace(camera=camera, polariscope=light))


def coarse(model: PadModel, longest: int) -> PadModel:
    """A pad and its lens before a camera of fewer pixels."""
    camera = {"pixels": _pixels(model.sensor, longest)}
    return replace(model, sensor=model.sensor.replace(camera=camera))


def _pixels(pad: Pad, longest: int) -> list[int]:
    sides = np.array([pad.transducer.length, pad.transducer.width])
    return (2 * np.maximum(np.round(longest / 2 * sides / sides.max()), 1)).astype(int).tolist()


def seen(model: PadModel, view: str, slices: Single) -> Octets:
    """Colours of a view that an eye has, shape (rows, columns, 3), sRGB.

    Parameters
    ----------
    model : PadModel
        Model of the pad itself.
    view : str
        A key of `views`, not a camera's.
    slices : ndarray, shape (slices, 2, rows, columns)
        Single-pass retardance at the polariscope's wavelength [rad].
    """
    light = model.sensor.polariscope
    if view == "white":
        pictures = [_dark_picture(light, wavelength) for wavelength in WAVELENGTHS]
        share = np.stack([_intensity(slices, one) for one in pictures], axis=-1)
        return encoded(share @ white_light(WAVELENGTHS).astype(np.float32))
    colour, picture = light.wavelength, _dark_picture(light, light.wavelength)
    if view != "light":
        number, kind = (int(part) for part in view.split("-")[1:])
        several = model.pictures[number]
        picture = Picture(several.dispersion, several.forms[kind : kind + 1])
        colour = light.pictures[number].wavelength or colour
    return encoded(_intensity(slices, picture)[..., None] * light_colour(colour).astype(np.float32))


def exposed(model: PadModel, view: str, modes: Single, seed: int) -> NDArray[np.unsignedinteger]:
    """One channel of the camera alone, shape (rows, columns).

    Parameters
    ----------
    model : PadModel
        Model of a pad before the camera.
    view : str
        The camera's key.
    modes : ndarray, shape (2, modes, rows, columns)
        Single-pass retardance at the polariscope's wavelength [rad].
    seed : int
        Seed of the camera's noise.
    """
    share, _ = model.picture(modes, model.pictures[int(view.split("-")[1])])
    return camera_optics.expose(model.sensor.camera, share.reshape(modes.shape[2:]), seed)


def camera_picture(model: PadModel, view: str, frame: NDArray[Any]) -> Octets:
    """Grey levels of one channel, stretched to eight bits, shape (rows, columns, 1)."""
    levels = frame.reshape(-1, *frame.shape[-2:])[int(view.split("-")[1])]
    scale = 255 / model.sensor.camera.full_scale
    return np.round(levels[..., None] * scale).astype(np.uint8)


def polarised_picture(model: PadModel, frame: NDArray[Any]) -> Octets:
    """What a polarisation camera has measured of the light, shape (rows, columns, 3), sRGB.

    Every four pixels give Stokes' parameters of linear polarisation: the mean intensity becomes
    brightness, the direction hue, and the degree of polarisation saturation, so that light which is
    circular is grey.

    Parameters
    ----------
    model : PadModel
        Model of a pad with `camera.kind = "polarisation"`.
    frame : ndarray
        Frame as its camera takes it, a mosaic.
    """
    levels = frame.reshape(-1, *frame.shape[-2:])[0].astype(np.float32)
    height, width = (size // 2 * 2 for size in levels.shape)
    behind = {
        angle: levels[row:height:2, column:width:2]
        for row, angles in enumerate(MOSAIC)
        for column, angle in enumerate(angles)
    }
    total = (behind[0.0] + behind[45.0] + behind[90.0] + behind[135.0]) / 2
    first, second = behind[0.0] - behind[90.0], behind[45.0] - behind[135.0]
    hue = np.arctan2(second, first) / (2 * np.pi) % 1
    degree = np.minimum(np.hypot(first, second) / np.maximum(total, 1.0), 1.0)
    value = np.minimum(total / model.sensor.camera.full_scale, 1.0)
    away = np.abs((6 * hue[..., None] + np.array([0.0, 4.0, 2.0])) % 6 - 3)
    colour = 1 - degree[..., None] * (1 - np.clip(away - 1, 0, 1))
    return np.round(255 * value[..., None] * colour).astype(np.uint8)


def seen_through(slices: Single) -> Single:
    """Share of the light that an ideal circular dark field lets through slices."""
    return _intensity(slices, _dark(None, 1.0))


def _dark_picture(light: PadPolariscope, wavelength: float) -> Picture:
    """A circular dark field."""
    return _dark(light.plates, light.wavelength / wavelength)


@lru_cache(maxsize=64)
def _dark(plates: Plates | None, dispersion: float) -> Picture:
    return Picture(dispersion, arranged("dark field", 0.0, plates, dispersion)[None])


def _intensity(slices: Single, picture: Picture) -> Single:
    stack = slices.reshape(*slices.shape[:2], -1) * np.float32(picture.dispersion)
    light = np.empty((3, stack.shape[2]), dtype=np.float32)
    turn(stack, light)
    share = np.empty(stack.shape[2], dtype=np.float32)
    measure(light, picture.packed, np.zeros(len(share), dtype=np.uint8), share)
    return share.reshape(slices.shape[2:])
