"""From light to grey levels, equation (13) of the paper."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import correlate1d
from scipy.special import ive

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.design.parts import Converter
from fringeforce.design.strip import Sensor

Lighting = tuple[Array, Array]
Rng = int | np.random.Generator | None


def grey_levels(camera: Converter, intensity: ArrayLike, lighting: Lighting | None = None) -> Array:
    """Grey levels before noise and rounding, A I + I_o.

    Parameters
    ----------
    camera : Converter
        Converter whose amplitude A and offset I_o are in grey levels.
    intensity : array_like, any shape
        Normalised intensity, 0 to 1.
    lighting : pair of ndarray, optional
        Amplitude and offset of every pixel or channel in place of the camera's.
    """
    amplitude, offset = (camera.amplitude, camera.offset) if lighting is None else lighting
    return amplitude * np.asarray(intensity, dtype=float) + offset


def expose(
    camera: Converter,
    intensity: ArrayLike,
    rng: Rng = None,
    lighting: Lighting | None = None,
    frame_axes: int | None = None,
    noise: Array | None = None,
) -> NDArray[np.unsignedinteger]:
    """Frames as the camera delivers them, equation (13).

    The light drifts from frame to frame, the camera's response follows, then noise and rounding.

    Parameters
    ----------
    camera : Converter
        Amplitude, offset, noise and number of bits.
    intensity : array_like, shape (..., n_pixels)
        Normalised intensity, 0 to 1; leading axes are a batch.
    rng : int, numpy.random.Generator or None
        Source of the noise: a seed, a generator that goes on from where it is, or None for fresh
        noise.
    lighting : pair of ndarray, optional
        Amplitude and offset of every pixel or channel in place of the camera's, grey levels.
    frame_axes : int, optional
        Trailing axes of one frame, which share its light; all axes if not given.
    noise : ndarray, optional
        Of every channel, in place of the camera's, grey levels.

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
    generator, light = np.random.default_rng(rng), np.asarray(intensity, dtype=float)
    if camera.drift:
        batch = light.ndim - (light.ndim if frame_axes is None else frame_axes)
        shape = light.shape[:batch] + (1,) * (light.ndim - batch)
        light = light * (1 + generator.normal(0.0, camera.drift, shape))
    levels = delivered(camera, light, lighting)
    noisy = levels + (camera.noise if noise is None else noise) * _noise(
        camera, levels.shape, generator
    )
    dtype = np.uint8 if camera.bits <= 8 else np.uint16
    return np.clip(np.rint(noisy), 0, camera.full_scale).astype(dtype)


def delivered(
    camera: Converter, light: ArrayLike, lighting: tuple[Array, Array] | None = None
) -> Array:
    """Grey levels without noise, behind the camera's response; parameters as of `expose`.

    Raises
    ------
    InputError
        If the intensity is not finite.
    """
    levels = grey_levels(camera, light, lighting)
    if not np.isfinite(levels).all():
        raise InputError(
            "The intensity holds values that are not finite, which no camera can expose; "
            "check the forces or the phase it was computed from."
        )
    if camera.response == "linear" and camera.gamma == 1:
        return levels
    share = encoded(levels / camera.full_scale, camera.response)
    return camera.full_scale * share**camera.gamma


def encoded(light: ArrayLike, response: str) -> Array:
    """Grey level over light, both as shares of the full scale.

    Parameters
    ----------
    light : array_like, any shape
        0 or more; what lies below counts as 0.
    response : str
        "linear", "sRGB" (IEC 61966-2-1:1999, equations 5 and 6), or a gamma such as "0.45", the
        power.
    """
    share = np.maximum(np.asarray(light, dtype=float), 0.0)
    if response == "linear":
        return share
    if response == "sRGB":
        return np.where(share <= 0.0031308, 12.92 * share, 1.055 * share ** (1 / 2.4) - 0.055)
    return share ** float(response)


def decoded(level: ArrayLike, response: str) -> Array:
    """Light over grey level, both as shares of the full scale: the inverse of `encoded`.

    Parameters
    ----------
    level : array_like, any shape
        0 or more; what lies below counts as 0.
    response : str
        As of `encoded`.
    """
    share = np.maximum(np.asarray(level, dtype=float), 0.0)
    if response == "linear":
        return share
    if response == "sRGB":
        return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.asarray(share ** (1 / float(response)))


def encoded_slope(light: ArrayLike, response: str) -> Array:
    """Derivative of what `encoded` returns by the light, which must be above zero."""
    share = np.asarray(light, dtype=float)
    if response == "linear":
        return np.ones_like(share)
    if response == "sRGB":
        return np.where(share <= 0.0031308, 12.92, 1.055 / 2.4 * share ** (1 / 2.4 - 1))
    return np.asarray(float(response) * share ** (float(response) - 1))


def blurred(light: Array, deviation: float) -> Array:
    """Lines of light behind a Gaussian point spread; what lies beyond is as the end is.

    A sampled Gaussian damps a wave of k per pixel by exp(-(k deviation)^2 / 2) as long as it is a
    pixel wide or wider.  A narrower one is the discrete Gaussian of the same variance, which damps
    it by exp(deviation^2 (cos k - 1)) (Lindeberg, IEEE Trans. Pattern Anal. Mach. Intell. 12, 234,
    1990).

    Parameters
    ----------
    light : ndarray, shape (..., n_pixels)
        Normalised intensity.
    deviation : float
        Standard deviation of the point spread [pixels].
    """
    reach = int(np.ceil(8 * deviation)) + 4
    steps = np.arange(-reach, reach + 1)
    if deviation < 1:
        kernel = ive(np.abs(steps), deviation**2)
    else:
        kernel = np.exp(-np.square(steps / deviation) / 2)
    return np.asarray(correlate1d(light, kernel / kernel.sum(), mode="nearest"))


def designed_lighting(sensor: Sensor) -> Lighting:
    """Amplitude and offset of a design, which frames of its channels can be multiplied with."""
    amplitude, offset = sensor.light
    return by_channel(sensor, amplitude), by_channel(sensor, offset)


def by_channel(sensor: Sensor, values: Array) -> Array:
    """Values of channels, shape (C,), as frames of a strip can be multiplied with."""
    return values.reshape((-1,) if len(sensor.frame_shape) == 1 else (-1, 1))


def on_sensor(sensor: Sensor, light: Array) -> Array:
    """Lines of light on a strip as they reach its camera's pixels, shape (..., n_pixels)."""
    camera = sensor.camera
    if not camera.blur:
        return light
    return blurred(light, camera.blur * camera.pixels / sensor.transducer.length)


def noise_variance(camera: Converter, noise: Array | float | None = None) -> Any:
    """Variance of one pixel's grey level, noise and rounding together [squared grey levels].

    A uniform noise of half width h has h^2/3, rounding to whole levels adds 1/12.

    Parameters
    ----------
    camera : Converter
        Whose noise it is.
    noise : float or ndarray, optional
        Of channels or pixels, in place of the camera's, grey levels.

    Returns
    -------
    float or ndarray
        As the noise.
    """
    square = np.square(camera.noise if noise is None else noise)
    return (square if camera.noise_model == "gaussian" else square / 3) + 1 / 12


def least_phase(sensor: Sensor) -> float:
    """Phase that changes a grey level of a strip by its noise, halfway from dark to bright [rad].

    Of the channel that tells most.
    """
    sigma = np.sqrt(noise_variance(sensor.camera, sensor.noise))
    return float(np.min(2 * sigma / sensor.light[0]))


def _noise(camera: Converter, shape: tuple[int, ...], generator: np.random.Generator) -> Array:
    """Noise of one grey level."""
    if camera.noise_model == "gaussian":
        return generator.standard_normal(shape)
    return generator.uniform(-1.0, 1.0, shape)
