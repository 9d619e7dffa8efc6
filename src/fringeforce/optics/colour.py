"""The colours in which a screen shows light of one wavelength or of many."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array
from fringeforce.optics import camera

_TO_RGB = np.array(
    [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
)
"""From CIE XYZ to linear RGB of IEC 61966-2-1."""


def light_colour(wavelength: float) -> Array:
    """Linear RGB of monochromatic light, brightest channel one, shape (3,).

    Parameters
    ----------
    wavelength : float
        In metres.
    """
    rgb = np.clip(_TO_RGB @ tristimulus(wavelength), 0, None)
    return rgb / rgb.max() if rgb.max() > 0 else np.ones(3)


def white_light(wavelengths: Array) -> Array:
    """What each of many wavelengths adds to linear RGB, shape (n, 3); all together make white.

    Parameters
    ----------
    wavelengths : ndarray, shape (n,)
        Evenly spaced, of equal power, over the visible spectrum [m].
    """
    rgb = np.array([_TO_RGB @ tristimulus(wavelength) for wavelength in wavelengths])
    return rgb / rgb.sum(axis=0)


def encoded(rgb: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Linear RGB as the eight bits of a screen (IEC 61966-2-1), clipped to what it can show."""
    step = np.clip(rgb, 0, 1) * (len(_ENCODED) - 1) + 0.5
    return _ENCODED[step.astype(np.uint16)]


def tristimulus(wavelength: float) -> Array:
    """CIE 1931 XYZ of monochromatic light, shape (3,).

    Gaussian fits by Wyman, Sloan and Shirley, J. Comput. Graph. Tech. 2 (2), 2013; the wavelength
    is in metres.
    """
    nm = wavelength * 1e9

    def lobe(height: float, centre: float, left: float, right: float) -> float:
        slope = left if nm < centre else right
        return height * np.exp(-0.5 * ((nm - centre) * slope) ** 2)

    return np.array(
        [
            lobe(1.056, 599.8, 1 / 37.9, 1 / 31.0)
            + lobe(0.362, 442.0, 1 / 16.0, 1 / 26.7)
            + lobe(-0.065, 501.1, 1 / 20.4, 1 / 26.2),
            lobe(0.821, 568.8, 1 / 46.9, 1 / 40.5) + lobe(0.286, 530.9, 1 / 16.3, 1 / 31.1),
            lobe(1.217, 437.0, 1 / 11.8, 1 / 36.0) + lobe(0.681, 459.0, 1 / 26.0, 1 / 13.8),
        ]
    )


_ENCODED = np.round(255 * camera.encoded(np.linspace(0, 1, 16384), "sRGB")).astype(np.uint8)
