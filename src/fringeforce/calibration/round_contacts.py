"""Contacts under round indenters whose radii are stated: how wide they are, and their tractions.

Contact mechanics on the strip as drawn tells them (`contacts.cylinder`).  A shear that partly
sticks is spread wider than the pressure that it needs, up to twice by its square (Mindlin), and on
a layer both are fuller than Hertz's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.contacts.press import Tractions
from fringeforce.design.strip import Sensor
from fringeforce.estimation.frame_model import HERTZ, moment_table
from fringeforce.models.line_moments import MOST_MOMENTS
from fringeforce.models.presses import tractions


def under_radii(sensor: Sensor, loads: BenchLoads) -> tuple[BenchLoads, Array]:
    """Loads with the widths that radii make, where nobody states one, and shapes of the contacts.

    Parameters
    ----------
    sensor : Sensor
        The drawing.
    loads : BenchLoads
        F frames of at most k contacts.

    Returns
    -------
    loads : BenchLoads
        With whole widths of contacts of Hertz's profile that spread as much.
    shapes : ndarray, shape (F, k, 2, MOST_MOMENTS)
        Moments of pressure and shear less those of Hertz's profile of that width, per force
        [powers of m]; zero where no radius is stated, or nothing presses.
    """
    shapes = np.zeros((*loads.present.shape, 2, MOST_MOMENTS))
    pressing = loads.present & np.isfinite(loads.radii) & (loads.forces[..., 0] > 0)
    if not pressing.any():
        return loads, shapes
    known = sensor
    if sensor.transducer.plane == "3d":
        # of three dimensions nothing is known under a cylinder, and a plane is a tenth off
        plane = sensor.transducer.model_copy(update={"plane": "stress"})
        known = sensor.model_copy(update={"transducer": plane})
    widths = loads.widths.copy()
    for f, k in np.argwhere(pressing):
        found = tractions(known, replace(loads.press(f, k), x=0.0))
        if not np.isfinite(widths[f, k]):
            widths[f, k] = found.width
        shapes[f, k] = _shape(found)
    return replace(loads, widths=widths), shapes


def _shape(found: Tractions) -> Array:
    """Moments of pressure and shear less those of Hertz's profile as wide as the pressure."""
    number = np.arange(MOST_MOMENTS)
    powers = np.power(found.places[:, None], number)
    table = moment_table(MOST_MOMENTS, HERTZ)
    even = np.where(number % 2, 0.0, table[number, number // 2])
    hertz = even * (found.width / 2) ** number
    shape = np.zeros((2, MOST_MOMENTS))
    for own, forces in zip(shape, found.forces.T, strict=True):
        if total := forces.sum():
            own[:] = forces @ powers / total - hertz
    return shape
