"""From phase lead to light: equation (11) of the paper, and what real polariscopes make of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.design_optics import Channel, Plates, Polariscope
from fringeforce.optics.jones import Fringe, fringe, polariser, retarder


def intensity(phase: ArrayLike) -> NDArray[np.float64]:
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


def _picture(polariscope: Polariscope, channel: Channel) -> Picture:
    plates = polariscope.plates or Plates()
    dispersion = polariscope.wavelength / (channel.wavelength or polariscope.wavelength)
    quarter = np.radians(90 + plates.retardance_error)
    if plates.dispersion != "achromatic":
        quarter *= dispersion
    turn, leak = np.radians(plates.angle_error), plates.extinction_ratio
    eighth, bias = np.pi / 4, np.radians(channel.bias)
    before = [polariser(0.0, leak), retarder(quarter, eighth + turn)]
    analyser = polariser(np.pi / 2 - bias / 2, leak)
    return Picture(fringe(before, [retarder(quarter, -eighth + turn), analyser]), dispersion)
