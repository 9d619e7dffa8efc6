"""Temperature: what it does to the stress-optic effect of a clear layer, and so to the phase.

To first order the coefficient is C(T) = C(T0) (1 + a (T - T0)); phases of the same stresses scale
alike (Dally and Riley, Experimental Stress Analysis, 3rd ed., section 13.6, of fringe values).
Readings are made as at T0, and their forces divided by that scale, which is exact for small strain.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.design.pad import Pad
from fringeforce.design.parts import PhotoelasticLayer
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import Tolerances
from fringeforce.models.presses import are_presses

LAYER = "transducer.photoelastic."
COEFFICIENT, REFERENCE = f"{LAYER}temperature_coefficient", f"{LAYER}reference_temperature"
COLDEST = 150.0
"""Below it no clear elastomer is soft; degrees Celsius taken for kelvin are [K]."""


def optical_scale(
    layer: PhotoelasticLayer, tolerances: Tolerances, temperature: ArrayLike
) -> tuple[Array, Array]:
    """Stress-optic coefficient over that at the reference temperature.

    Parameters
    ----------
    layer : PhotoelasticLayer
        That has a temperature coefficient.
    tolerances : Tolerances
        Of its design: those of the coefficient and of the reference temperature count.
    temperature : array_like
        Of the layer [K].

    Returns
    -------
    scale, std : ndarray, of the shape of the temperature
        1 + a (T - T0), and its standard deviation, which grows with the distance from T0.

    Raises
    ------
    InputError
        If the layer has no coefficient, a temperature is none in kelvin, or the effect vanishes.

    Examples
    --------
    >>> from fringeforce.models.temperature import optical_scale
    >>> sensor = ff.load_sensor("saad").replace(
    ...     **{"transducer.photoelastic.temperature_coefficient": "-0.2 +/- 0.05 %/K"}
    ... )
    >>> scale, std = optical_scale(sensor.transducer.photoelastic, sensor.tolerances, 303.15)
    >>> round(float(scale), 3), round(float(std), 3)
    (0.98, 0.005)
    """
    slope, reference = layer.temperature_coefficient, layer.reference_temperature
    if slope is None:
        raise InputError(
            "A temperature was given, and the design does not say what it does; state "
            'temperature_coefficient = "-0.2 %/K" under [transducer.photoelastic], as the data '
            "sheet or a measurement says, or leave the temperature out."
        )
    given = np.asarray(temperature, dtype=float)
    if not (np.isfinite(given) & (given >= COLDEST)).all():
        wrong = given[~(np.isfinite(given) & (given >= COLDEST))].flat[0]
        raise InputError(
            f"temperature = {wrong:g} K has to be finite and at least {COLDEST:g} K; give kelvin, "
            "such as 298.15 for 25 degC."
        )
    scale = 1 + slope * (given - reference)
    if not (scale > 0).all():
        raise InputError(
            f"temperature = {given[~(scale > 0)].flat[0]:g} K leaves no stress-optic effect with "
            f"{slope * 100:g} %/K from {reference:g} K on; check both."
        )
    std = np.hypot(
        tolerances.get(COEFFICIENT, 0.0) * (given - reference),
        tolerances.get(REFERENCE, 0.0) * slope,
    )
    return scale, std


def frame_scale(
    sensor: Sensor | Pad, temperature: ArrayLike | None, frames: tuple[int, ...]
) -> Array:
    """What temperature does to the phase of frames, shape (..., 1), one without a temperature.

    Parameters
    ----------
    sensor : Sensor or Pad
        The design.
    temperature : array_like, optional
        One for all frames, or one each [K].
    frames : tuple of int
        Shape of the frames' batch.

    Raises
    ------
    InputError
        As of `optical_scale`, or if there are not as many as frames.
    """
    if temperature is None:
        return np.ones(1)
    scale, _ = optical_scale(sensor.transducer.photoelastic, sensor.tolerances, temperature)
    if scale.shape not in ((), frames):
        raise InputError(
            f"Temperatures of shape {scale.shape} do not fit frames of shape {frames}; give one, "
            "or one each."
        )
    return scale[..., None]


def warm_forces(pad: Pad, forces: Any, temperature: ArrayLike | None) -> Any:
    """Forces, shape (..., n, 3), that show at the reference temperature what these do at another.

    Parameters
    ----------
    pad : Pad
        The design.
    forces : array_like, shape (..., n, 3)
        Of tactels [N].
    temperature : array_like, optional
        As of `frame_scale`.

    Raises
    ------
    InputError
        As of `frame_scale`, or for presses, whose pressures are not scaled.
    """
    if temperature is None:
        return forces
    if are_presses(forces):
        raise InputError("Temperatures go with forces of tactels, not with presses; leave one out.")
    loads = np.asarray(forces, dtype=float)
    return loads * frame_scale(pad, temperature, loads.shape[:-2])[..., None]
