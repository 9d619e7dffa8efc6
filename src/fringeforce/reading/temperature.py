"""Forces of a strip or pad whose temperature is not the one that its design is of.

A frame at temperature T shows s f, with s = 1 + a (T - T0) of `models.temperature`.  Forces are
what a frame shows over s; how uncertain s is adds one mode to their covariance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.models.temperature import optical_scale
from fringeforce.reading.batch import Batch
from fringeforce.reading.reading import Reading


def checked_scales(
    sensor: Sensor | Pad, temperatures: ArrayLike | None, frames: int
) -> tuple[Array, Array] | None:
    """Scales of frames and their standard deviations, shape (F,) each; none without temperatures.

    Raises
    ------
    InputError
        If the sensor is a skin or of finite strain, or as of `optical_scale`.
    """
    if temperatures is None:
        return None
    if sensor.skin is not None or getattr(sensor.transducer, "strain", "linear") == "finite":
        raise InputError(
            "Readings take temperatures of strips and pads with tactels and small strain; leave "
            "the temperature out, and state in the design the coefficient at that temperature."
        )
    layer = sensor.transducer.photoelastic
    scale, std = optical_scale(layer, sensor.tolerances, temperatures)
    if scale.shape not in ((), (1,), (frames,)):
        raise InputError(
            f"temperatures of shape {scale.shape} do not fit {frames} frames; give one or one each."
        )
    return np.broadcast_to(scale, frames), np.broadcast_to(std, frames)


def scaled_reading(found: Reading, scale: float, std: float) -> Reading:
    """A reading as at the reference temperature to one at another."""
    if not found.status.usable:
        return found
    forces, relative = found.forces / scale, std / scale
    mode = relative * forces.ravel()
    return Reading.of(
        forces=forces,
        chi2=found.chi2,
        status=found.status,
        covariance=lambda: found.covariance / scale**2 + np.outer(mode, mode),
        phase=lambda: found.phase,
        detail=found.detail,
        alternatives=found.alternatives / scale,
        limited=found.limited,
        tracked=found.tracked,
        probability=found.probability,
    )


def scale_batch(found: Batch, scales: Array, stds: Array) -> None:
    """Scale readings of a recording, in place."""
    one, relative = scales[:, None, None], (stds / scales)[:, None, None]
    found.forces[:] /= one
    found.std[:] = np.hypot(found.std / one, relative * found.forces)
    if found.covariance is not None:
        modes = (relative * found.forces).reshape(len(found), -1)
        found.covariance[:] = found.covariance / one**2 + modes[:, :, None] * modes[:, None, :]
