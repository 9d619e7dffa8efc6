"""From phase lead to light: equation (11) of the paper, and what real polariscopes make of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.design.light import Channel, Plates, Polariscope
from fringeforce.optics.jones import Fringe, Jones, fringe, polariser, retarder


def intensity(phase: ArrayLike) -> Array:
    """Normalised intensity behind a dark-field circular polariscope, sin^2(p / 2).

    Parameters
    ----------
    phase : array_like, any shape
        Phase lead p [rad].

    Returns
    -------
    ndarray, same shape
        Between 0 and 1; equation (11).
    """
    return Fringe().intensity(phase)


@dataclass(frozen=True)
class Picture:
    """What one channel makes of the strip.

    Attributes
    ----------
    fringe : Fringe
        Light over the channel's phase lead.
    dispersion : float
        The channel's phase lead over that of the polariscope's own wavelength.
    """

    fringe: Fringe
    dispersion: float


def pictures(polariscope: Polariscope) -> list[Picture]:
    """What every channel of a circular polariscope makes of the strip.

    Light passes a polariser along x and a plate at 45 degrees, the strip, a plate at -45 degrees
    and the analyser, which stands across x in the dark field and is turned by half of the bias.
    The strain-optic coefficient is taken as that of all wavelengths, equation (2).
    """
    return [_picture(polariscope, channel) for channel in polariscope.pictures]


def together(polariscope: Polariscope, seen: list[Array]) -> Array:
    """Light of all channels, with the cross-talk between them.

    Parameters
    ----------
    polariscope : Polariscope
        Whose shares count.
    seen : list of ndarray, shape (..., n_pixels)
        Normalised intensity of each channel's own light.

    Returns
    -------
    ndarray, shape (..., n_channels, n_pixels), or (..., n_pixels) of a single one
    """
    if len(seen) == 1:
        return seen[0]
    light, shares = np.stack(seen, axis=-2), polariscope.channel_shares
    return np.asarray(shares @ light) if len(shares) else light


def _picture(polariscope: Polariscope, channel: Channel) -> Picture:
    plates = polariscope.plates or Plates()
    dispersion = polariscope.wavelength / (channel.wavelength or polariscope.wavelength)
    first, second = quarter_wave_plates(plates, dispersion)
    before = [polariser(0.0, plates.extinction_ratio), first]
    analyser = polariser((np.pi - np.radians(channel.bias)) / 2, plates.extinction_ratio)
    seen, v = fringe(before, [second, analyser]), polariscope.visibility
    if v < 1:
        # A sin^2 = A [1 - cos] / 2, and A [1 - V cos] / 2 = A V sin^2 + A (1 - V) / 2
        seen = replace(
            seen, amplitude=seen.amplitude * v, offset=seen.offset + seen.amplitude * (1 - v) / 2
        )
    bandwidth = polariscope.bandwidth if channel.bandwidth is None else channel.bandwidth
    spread = wave_number_spread(bandwidth, polariscope.wavelength / dispersion)
    return Picture(replace(seen, spread=spread), dispersion)


def wave_number_spread(bandwidth: float, wavelength: float) -> float:
    """Standard deviation of 1 / wavelength over its mean, of light that is Gaussian in it.

    With d the full width at half maximum in wave number over the mean, the wavelengths of half the
    maximum, wavelength / (1 -+ d / 2), lie  wavelength d / (1 - d^2 / 4)  apart, which is solved
    for d.

    Parameters
    ----------
    bandwidth : float
        Full width at half maximum in wavelength [m].
    wavelength : float
        That of the mean wave number [m].
    """
    share = bandwidth / wavelength
    # 2 (sqrt(1 + s^2) - 1) / s, without the loss of digits
    width = 2 * share / (1 + np.sqrt(1 + share**2))
    return float(width / (2 * np.sqrt(2 * np.log(2))))


def quarter_wave_plates(plates: Plates, dispersion: float = 1.0) -> tuple[Jones, Jones]:
    """The plates of a circular polariscope before and behind the strip, at 45 and -45 degrees.

    Parameters
    ----------
    plates : Plates
        What is wrong with them.
    dispersion : float
        Retardance of plates that are not achromatic, over that at their own wavelength.
    """
    quarter, turn = np.radians(90 + plates.retardance_error), np.radians(plates.angle_error)
    if plates.dispersion != "achromatic":
        quarter *= dispersion
    return retarder(quarter, turn + np.pi / 4), retarder(quarter, turn - np.pi / 4)
