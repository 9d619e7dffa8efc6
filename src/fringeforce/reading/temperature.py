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


def checked_scales(
    sensor: Sensor | Pad, temperatures: ArrayLike | None, frames: int
) -> tuple[Array, Array] | None:
    """Scales of frames and their standard deviations, shape (F,) each; none without temperatures.

    Raises
    ------
    InputError
        If the sensor is of finite strain, or as of `optical_scale`.
    """
    if temperatures is None:
        return None
    if getattr(sensor.transducer, "strain", "linear") == "finite":
        raise InputError(
            "Readings take temperatures of strips and pads of small strain; leave the temperature "
            "out, and state in the design the coefficient at that temperature."
        )
    layer = sensor.transducer.photoelastic
    scale, std = optical_scale(layer, sensor.tolerances, temperatures)
    if scale.shape not in ((), (1,), (frames,)):
        raise InputError(
            f"temperatures of shape {scale.shape} do not fit {frames} frames; give one or one each."
        )
    return np.broadcast_to(scale, frames), np.broadcast_to(std, frames)


def scale_batch(found: Batch, scales: Array, stds: Array) -> None:
    """Scale readings of a recording, in place."""
    one, relative = scales[:, None, None], (stds / scales)[:, None, None]
    found.forces[:] /= one
    found.std[:] = np.hypot(found.std / one, relative * found.forces)
    if found.covariance is not None:
        modes = (relative * found.forces).reshape(len(found), -1)
        found.covariance[:] = found.covariance / one**2 + modes[:, :, None] * modes[:, None, :]
    if found.resultants is not None:
        for row, (felt, scale, std) in enumerate(zip(found.resultants, scales, stds, strict=True)):
            factor, share = 1 / float(scale), float(std / scale)
            found.resultants[row] = tuple(one.scaled(factor, share) for one in felt)
