"""From light to grey levels, equation (13) of the paper."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import InputError
from fringeforce.design.parts import Converter

Lighting = tuple[NDArray[np.float64], NDArray[np.float64]]
Rng = int | np.random.Generator | None


def grey_levels(
    camera: Converter, intensity: ArrayLike, lighting: Lighting | None = None
) -> NDArray[np.float64]:
    """Grey levels before noise and rounding, A I + I_o.

    Parameters
    ----------
    camera : Converter
        Converter whose amplitude A and offset I_o are in grey levels.
    intensity : array_like, any shape
        Normalised intensity, 0 to 1.
    lighting : pair of ndarray, shape (n_pixels,), optional
        Amplitude and offset of every pixel in place of the camera's.
    """
    amplitude, offset = (camera.amplitude, camera.offset) if lighting is None else lighting
    return amplitude * np.asarray(intensity, dtype=float) + offset


def expose(
    camera: Converter, intensity: ArrayLike, rng: Rng = None, lighting: Lighting | None = None
) -> NDArray[np.unsignedinteger]:
    """Frames as the camera delivers them, equation (13).

    Parameters
    ----------
    camera : Converter
        Amplitude, offset, noise and number of bits.
    intensity : array_like, shape (..., n_pixels)
        Normalised intensity, 0 to 1; leading axes are a batch.
    rng : int, numpy.random.Generator or None
        Source of the noise: a seed, a generator that goes on from where it is, or None for fresh
        noise.
    lighting : pair of ndarray, shape (n_pixels,), optional
        Amplitude and offset of every pixel in place of the camera's, grey levels.

    Returns
    -------
    ndarray, same shape
        Rounded to the nearest integer and clipped to the converter's range; uint8 up to 8 bits,
        uint16 above.

    Raises
    ------
    InputError
        If the intensity is not finite.
    """
    levels = grey_levels(camera, intensity, lighting)
    if not np.isfinite(levels).all():
        raise InputError(
            "The intensity holds values that are not finite, which no camera can expose; "
            "check the forces or the phase it was computed from."
        )
    noisy = levels + _noise(camera, levels.shape, np.random.default_rng(rng))
    dtype = np.uint8 if camera.bits <= 8 else np.uint16
    return np.clip(np.rint(noisy), 0, camera.full_scale).astype(dtype)


def noise_variance(camera: Converter) -> float:
    """Variance of one pixel's grey level, noise and rounding together [squared grey levels].

    A uniform noise of half width h has h^2/3, rounding to whole levels adds 1/12.
    """
    noise = camera.noise**2
    return (noise if camera.noise_model == "gaussian" else noise / 3) + 1 / 12


def _noise(
    camera: Converter, shape: tuple[int, ...], generator: np.random.Generator
) -> NDArray[np.float64]:
    if camera.noise_model == "gaussian":
        return generator.normal(0.0, camera.noise, shape)
    return generator.uniform(-camera.noise, camera.noise, shape)
