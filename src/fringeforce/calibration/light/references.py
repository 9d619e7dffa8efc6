"""Frames that show the light alone: in the dark, unloaded, and with the analyser turned.

Behind crossed polarisers the grey level is A sin^2(p/2) + I_o, so without load it is the offset
I_o.  An analyser turned by 90 degrees passes what was blocked: A cos^2(p/2) + I_o, which without
load is I_o + A.  The mean of k such frames therefore enters a fit as one row of a load that is
zero, of a phase that is 0 or pi, and of a noise that is smaller by the root of k.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.optics.camera import noise_variance

CLIPPED = 0.01
"""Share of grey levels at full scale beyond which a reference says nothing of the light."""


@dataclass(frozen=True, eq=False)
class References:
    """Frames without load; each kind may be missing.

    Attributes
    ----------
    dark : array_like, shape (k, n_pixels), or (k, rows, columns) of a pad, optional
        Light off: the dark level of every pixel.
    unloaded : array_like, same shape, optional
        Light on, polarisers crossed: the offset I_o.
    bright : array_like, same shape, optional
        Light on, the analyser turned by 90 degrees: I_o + A.

    Examples
    --------
    >>> ff.References(dark=np.full((10, 2048), 3)).unloaded is None
    True
    """

    dark: ArrayLike | None = None
    unloaded: ArrayLike | None = None
    bright: ArrayLike | None = None

    def checked(self, sensor: Sensor | Pad) -> dict[str, Array]:
        """Frames of every kind that is there, as floats of shape (k, P).

        Raises
        ------
        InputError
            If one does not fit the camera, is saturated, or is darker than it must be.
        """
        found, camera = {}, sensor.camera
        for kind in ("dark", "unloaded", "bright"):
            if getattr(self, kind) is None:
                continue
            levels, shape = np.asarray(getattr(self, kind), dtype=float), sensor.frame_shape
            levels = levels[None] if levels.shape == shape else levels
            if levels.shape[1:] != shape or not len(levels):
                raise InputError(
                    f"{kind.capitalize()} frames of shape {levels.shape} do not fit this "
                    f"{sensor.kind}; give (frames, {', '.join(map(str, shape))})."
                )
            levels = levels.reshape(len(levels), -1)
            if not ((levels >= 0) & (levels <= camera.full_scale)).all():
                raise InputError(
                    f"{kind.capitalize()} frames hold grey levels that are not from 0 to "
                    f"{camera.full_scale}; check the camera's bits in the design."
                )
            if (full := (levels >= camera.full_scale).mean()) > CLIPPED:
                raise InputError(
                    f"{full:.0%} of the grey levels of the {kind} frames are at "
                    f"{camera.full_scale}; shorten the exposure of all frames and take them again."
                )
            found[kind] = levels
        kinds = list(found)
        for darker, brighter in pairwise(kinds):
            low, high = np.median(found[darker]), np.median(found[brighter])
            if low > high + np.sqrt(noise_variance(camera, float(sensor.noise.max()))):
                raise InputError(
                    f"The {darker} frames (median {low:g}) are brighter than the {brighter} ones "
                    f"({high:g}); were they swapped?"
                )
        return found
