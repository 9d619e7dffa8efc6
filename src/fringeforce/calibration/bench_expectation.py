"""What is expected of a bench before its frames are seen: light, residual, lens, and scatter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.contact_phase import ContactPhases, ContactSize
from fringeforce.calibration.residual_length import FAINTEST
from fringeforce.design.light import CROSSTALK
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import Tolerances
from fringeforce.estimation.frame_model import EVEN, HERTZ, FrameModel
from fringeforce.models.as_built import LIGHT_LENGTH, PLACEMENT, WIDTH
from fringeforce.models.line_moments import FOLLOWED_STDS, MOMENTS, MOST_MOMENTS
from fringeforce.models.strip import characterize
from fringeforce.models.strip_nodes import random_field
from fringeforce.models.uncertainty import NARROW, uncertainty

DOUBT = {
    "place": 0.1e-3,
    "width": 0.3e-3,
    "normal": 0.01,
    "tangential": 0.01,
    "gain": 0.02,
    "offset": 0.01,
}
"""How much scatters at first if nobody states it: places and widths [m], forces over the whole
force of a contact, gain of the lamp, and offset over the amplitude.  The frames tell."""
FIELDS = {"residual": 0.3, "bright": 0.2, "dark": 0.05}
"""The same of the residual [rad], the unevenness of the light and that of the offset, over the
amplitude."""
ERRORS = {"height": 0.03, "slope": 0.03}
"""The same of columns' errors in height and in place, over the columns."""
SMOOTH = {"residual": 0, "bright": 1, "dark": 1, "height": 0, "slope": 0}
"""What has a size that the frames tell, and how many unknowns of each channel are free: the mean of
the light."""
LAMP, BLUR, GAMMA, SHIFT, SCALE = 0.5, 6.0, 0.1, 2.0, 10.0
"""Before the frames: amplitude, relative; blur [pixels]; gamma; shift and scale [their units]."""
THINNED = 2
"""Every so many samples between the nodes are enough for what is smooth over the cover."""


def smooth_fields(sensor: Sensor, x: Array, nodes: int, grey: Array) -> tuple[Array, Array, Array]:
    """Residual [rad], amplitude, relative, and offset [grey levels] that are expected, as modes.

    Parameters
    ----------
    sensor : Sensor
        The drawing.
    x : ndarray, shape (s,)
        Places of the samples between the nodes [m].
    nodes : int
        Number of nodes m.
    grey : ndarray, shape (C,)
        Usual amplitude of each channel, grey levels.

    Returns
    -------
    fields : ndarray, shape (r, m)
        Of the residual.
    brightness, darkness : ndarray, shape (2l, C m)
        What the same modes change in amplitude and offset: half of them the one, half the other.
        Each is of one channel; those that are even come first.
    """
    residual = random_field(x, sensor.polariscope.residual_length, nodes, FAINTEST)
    uneven = random_field(x, LIGHT_LENGTH * sensor.transducer.length, nodes)
    each = np.eye(len(grey))
    even, uneven = np.kron(each, np.ones((1, nodes))), np.kron(each, uneven)
    bright = np.concatenate([LAMP * even, FIELDS["bright"] * uneven])
    dark = FIELDS["dark"] * np.concatenate([even, uneven]) * np.repeat(grey, nodes)
    none = np.zeros(bright.shape)
    return (
        np.ascontiguousarray(FIELDS["residual"] * residual),
        np.concatenate([bright, none]).astype(np.float64),
        np.concatenate([none, dark]).astype(np.float64),
    )


def contact_size(sensor: Sensor, loads: BenchLoads) -> ContactSize:
    """How far contacts may lie from their places, and how wide they are, as stated or expected.

    Whatever presses on a skin, or has a radius, is round rather than flat.
    """
    cover = float(sensor.transducer.compliant.thickness)
    place = sensor.tolerances.get(PLACEMENT, DOUBT["place"])
    expected = DOUBT["width"] if sensor.skin is None else max(DOUBT["width"], cover)
    width, wide = float(sensor.tactels.contact_width), sensor.tolerances.get(WIDTH, expected)
    known = 2 * (MOST_MOMENTS / MOMENTS * cover - FOLLOWED_STDS * place)
    stated = min(float(np.nanmax(loads.widths, initial=0.0)) + FOLLOWED_STDS * wide, known)
    widest = max(width + FOLLOWED_STDS * wide, stated)
    rounded = sensor.skin is not None or bool(np.isfinite(loads.radii).any())
    reach = FOLLOWED_STDS * place + widest / 2
    return ContactSize(place, width, wide, widest, HERTZ if rounded else EVEN, reach)


def frame_template(sensor: Sensor, contacts: ContactPhases) -> tuple[FrameModel, Array, Array]:
    """Model of a frame without contacts and without its own light.

    Parameters
    ----------
    sensor : Sensor
        The drawing.
    contacts : ContactPhases
        Phase of contacts.

    Returns
    -------
    template : FrameModel
        Nodes, fields, light, lens.
    places : ndarray, shape (s,)
        Of samples between the nodes, where a camera as drawn looks [m].
    lamp : ndarray, shape (2, 2, C m)
        Changes of amplitude and offset with the gain and the offset of one frame.
    """
    kept = {path: std for path, std in sensor.tolerances.items() if path.startswith(CROSSTALK)}
    plain = sensor.model_copy(update={"tolerances": Tolerances(kept)})
    plain = plain.small_strain  # its second order is of tactels
    found = uncertainty(replace(characterize(plain), sensor=plain))
    x, frame = found.places, found.frame
    nodes, seen = len(frame.fixed), frame.visibility
    grey = frame.amplitude.reshape(len(frame.bias), -1).mean(axis=1)
    fields, brightness, darkness = smooth_fields(sensor, x, nodes, grey)
    lamp = np.zeros((2, 2, brightness.shape[1]))
    lamp[0, 0], lamp[1, 1] = DOUBT["gain"], DOUBT["offset"] * float(grey.mean())
    size = contacts.size
    template = frame._replace(
        mixing=contacts.mixing,
        reach=size.reach,
        place=size.place,
        width=size.width,
        width_std=size.width_std,
        narrow=NARROW * max(size.width, size.width_std),
        profile=size.profile,
        fields=fields,
        brightness=brightness,
        darkness=darkness,
        amplitude=frame.amplitude * seen,
        offset=frame.offset + frame.amplitude * (1 - seen) / 2,
        visibility=1.0,
        visibility_std=0.0,
        blur=max(frame.blur, 1.0),
        blur_std=BLUR,
        gamma_std=GAMMA,
        floor=0.0,
        ceiling=frame.full_scale,
    )
    return template, x[::THINNED], lamp
