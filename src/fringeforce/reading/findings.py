"""Departures in words: what seems to differ from the design, by how much, and what to do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects, label

from fringeforce.design.light import CHANNELS, CROSSTALK
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.models.as_built import PLACEMENT, RESIDUAL, SIZE, WIDTH
from fringeforce.models.departures import UNEVEN_LIGHT

UNEXPLAINED = (
    "No departure from the design that the model knows explains this frame. Check that the design "
    "is of this sensor, and that nothing covers the light."
)
"""Where nothing fits."""
RMS = "root mean square"
RIVAL = np.log(20.0)
"""Logarithm of the evidence by which the likeliest departure must lead to be the only one named:
"strong" evidence (Kass and Raftery, J. Am. Stat. Assoc. 90, 773, 1995)."""
HOPELESS = 1.5
"""Loss over the smallest from which a departure is not followed further."""
FOLLOWED = 6
"""Departures that are followed to their best, of those that explain most after a few steps."""
MOST_NAMED = 4
"""Departures that are named together at most."""
PARTLY = 1.5
"""Reduced chi-square below which a departure is named that does not explain all of the frame."""


class Model(Protocol):
    """What a frame departs from; `SensorModel` and `PadModel` are such."""

    @property
    def sensor(self) -> Any:
        """The design, of a strip or a pad."""
        ...


class Departing(Protocol):
    """What departs."""

    @property
    def path(self) -> str:
        """Dotted path of the value that departs, or what it is."""
        ...

    @property
    def one(self) -> object:
        """True if it is one number."""
        ...


class Fitted(Protocol):
    """A departure as a frame shows it, of a strip or a pad."""

    @property
    def departure(self) -> Departing:
        """What departs."""
        ...

    @property
    def size(self) -> float:
        """By how much, root mean square if it is many numbers."""
        ...

    @property
    def significance(self) -> float:
        """Standard deviations between this and the design."""
        ...


@dataclass(frozen=True)
class Sized:
    """A departure and by how much a frame shows it.

    Attributes
    ----------
    departure : Departing
        What departs.
    size : float
        By how much, root mean square if it is many numbers.
    significance : float
        Standard deviations between this and the design.
    """

    departure: Departing
    size: float
    significance: float


def sentence(fits: Sequence[Fitted], model: Model, explained: bool = True) -> str:
    """One finding.

    Parameters
    ----------
    fits : sequence of Fitted
        What a frame cannot tell apart, the likeliest first; one if it can.
    model : SensorModel or PadModel
        That the frame departs from.
    explained : bool
        Whether the likeliest explains all of the frame.
    """
    claims = [f"{_claim(fit, model)} ({_deviations(fit)})" for fit in fits]
    text = claims[0][0].upper() + claims[0][1:]
    if len(claims) > 1:
        others = ", or ".join(claims[1:])
        text += f", or {others}, which this frame cannot tell apart"
    if not explained:
        text += ", though this does not explain all of the frame"
    return f"{text}; {_remedy([fit.departure.path for fit in fits], model)}."


def together(fits: Sequence[Fitted], model: Model) -> str:
    """One finding about departures that explain a frame only together.

    Parameters
    ----------
    fits : sequence of Fitted
        The departures, the most significant first.
    model : SensorModel or PadModel
        That the frame departs from.
    """
    claims = [f"{_claim(fit, model)} ({_deviations(fit)})" for fit in fits]
    said = ", ".join(claims[:-1]) + " and " + claims[-1]
    remedy = _remedy([fit.departure.path for fit in fits], model, " and ")
    return f"Several departures together explain this frame: {said}; {remedy}."


def covered(pixels: NDArray[np.bool_], sensor: Sensor) -> str:
    """One finding about stretches of a strip that show something else than its load.

    Parameters
    ----------
    pixels : ndarray of bool, shape (P,)
        Where.
    sensor : Sensor
        The design.
    """
    at = 1e3 * sensor.pixel_positions
    parts, _ = label(pixels)
    places = [f"from {at[x].min():.2f} to {at[x].max():.2f} mm" for (x,) in find_objects(parts)]
    return _covered(places, sensor)


def covered_of_pad(pixels: NDArray[np.bool_], sensor: Pad) -> str:
    """The same of patches of a pad's picture, the largest first.

    Parameters
    ----------
    pixels : ndarray of bool, shape (channels * P,)
        Where, in any channel.
    sensor : Pad
        The design.
    """
    columns, rows = (1e3 * at for at in sensor.pixel_positions)
    parts, _ = label(pixels.reshape(-1, len(rows), len(columns)).any(axis=0), np.ones((3, 3)))
    found = sorted(find_objects(parts), key=lambda one: -parts[one].size)
    places = [
        f"at x = {columns[x].min():.1f} to {columns[x].max():.1f} mm, "
        f"y = {rows[y].min():.1f} to {rows[y].max():.1f} mm"
        for y, x in found
    ]
    more = len(places) - MOST_NAMED
    return _covered(places[:MOST_NAMED] + [f"in {more} other places"] * (more > 0), sensor)


def _covered(places: list[str], sensor: Sensor | Pad) -> str:
    said = ", ".join(places[:-1]) + " and " + places[-1] if places[1:] else places[0]
    return (
        f"Loads explain this frame but for what it shows {said}: dirt, a hair, or light from "
        f"elsewhere? Clean the {sensor.kind} there, or mask these pixels."
    )


def _deviations(fit: Fitted) -> str:
    return f"{fit.significance:.0f} standard deviations"


def _claim(fit: Fitted, model: Model) -> str:
    departure, size = fit.departure, fit.size
    path, number = _channel(departure.path)
    said = (_ONE[path] if departure.one else _MANY[path])(size, model)
    return said.replace("the light", f"the light of channel {number}") if number else said


def _channel(path: str) -> tuple[str, int]:
    """Path of what one channel has of its own, as that of the camera, and its number; 0 of all."""
    if not path.startswith(CHANNELS):
        return path, 0
    *_, place, name = path.split(".")
    return f"camera.{name}", int(place) + 1


def _named(path: str) -> str:
    """What to give a tolerance, for a departure of a path."""
    name, number = _channel(path)
    *_, last = name.split(".")
    return f"{last} of channel {number} in polariscope.channels" if number else path


def _length(metres: float) -> str:
    return f"{abs(metres) * 1e3:.2g} mm"


def _percent(share: float) -> str:
    return f"{abs(share) * 100:.2g} %"


def _layer(name: str, more: str, less: str) -> Callable[[float, Model], str]:
    return lambda by, _: f"the {name} seems {_percent(by)} {more if by > 0 else less} than drawn"


def _blur(by: float, model: Model) -> str:
    sensor = model.sensor
    pixels = by * float(np.ravel(sensor.camera.pixels)[0]) / sensor.transducer.length
    if not sensor.camera.blur:
        return f"the picture seems blurred by {_length(by)} ({abs(pixels):.2g} pixels)"
    return f"the picture's blur seems {_length(by)} {'larger' if by > 0 else 'smaller'} than drawn"


def _response(by: float, model: Model) -> str:
    stated = model.sensor.camera.gamma
    return f"the camera's response seems to have a gamma of {stated + by:.3g}, not {stated:g}"


def _visibility(by: float, model: Model) -> str:
    stated = model.sensor.polariscope.visibility
    return f"the visibility of the fringes seems {stated + by:.3g}, not {stated:g}"


def _width(by: float, model: Model) -> str:
    stated = model.sensor.tactels.contact_width
    return f"the contacts seem {_length(stated + by)} wide, not {stated * 1e3:g} mm"


def _widths(by: float) -> str:
    return f"the contacts seem {_length(by)} {RMS} wider or narrower than drawn, each by its own"


_ONE: dict[str, Callable[[float, Model], str]] = {
    "camera.shift": lambda by, _: f"the camera seems shifted by {by * 1e3:.2g} mm",
    "camera.shift_x": lambda by, _: f"the camera seems shifted along x by {by * 1e3:.2g} mm",
    "camera.shift_y": lambda by, _: f"the camera seems shifted along y by {by * 1e3:.2g} mm",
    "camera.scale": lambda by, _: (
        f"the camera's scale seems {_percent(by)} {'larger' if by > 0 else 'smaller'} than drawn"
    ),
    "camera.blur": _blur,
    "camera.gamma": _response,
    "camera.amplitude": lambda by, _: (
        f"the light seems {_percent(by)} {'brighter' if by > 0 else 'dimmer'} than drawn"
    ),
    "camera.offset": lambda by, _: (
        f"the dark level of the camera seems {abs(by):.2g} grey levels "
        f"{'higher' if by > 0 else 'lower'} than drawn"
    ),
    "polariscope.visibility": _visibility,
    "polariscope.bandwidth": lambda by, _: (
        f"the light's spectrum seems {abs(by) * 1e9:.2g} nm {'wider' if by > 0 else 'narrower'} "
        "than drawn"
    ),
    PLACEMENT: lambda by, _: f"all contacts seem {by * 1e3:.2g} mm beside their tactels",
    WIDTH: _width,
    "transducer.compliant.thickness": _layer("compliant layer", "thicker", "thinner"),
    "transducer.compliant.youngs_modulus": _layer("compliant layer", "stiffer", "softer"),
    "transducer.photoelastic.thickness": _layer("photoelastic layer", "thicker", "thinner"),
    "transducer.photoelastic.youngs_modulus": _layer("photoelastic layer", "stiffer", "softer"),
}
_MANY: dict[str, Callable[[float, Model], str]] = {
    UNEVEN_LIGHT: lambda by, _: f"the light seems uneven along the strip by {_percent(by)} {RMS}",
    RESIDUAL: lambda by, model: (
        f"the {model.sensor.kind} seems to have a residual retardance of {by:.2g} rad {RMS} "
        "without load"
    ),
    CROSSTALK: lambda by, _: (
        f"each channel seems to see {_percent(by)} {RMS} of the light of each other one beyond "
        "what is drawn: cross-talk"
    ),
    PLACEMENT: lambda by, _: (
        f"the contacts seem {_length(by)} {RMS} beside their tactels, each by its own distance"
    ),
    WIDTH: lambda by, _: _widths(by),
    SIZE: lambda by, _: _widths(by),
}
_NOT_TOLERANCES: dict[str, str] = {
    "polariscope.bandwidth": "state polariscope.bandwidth",
    UNEVEN_LIGHT: "state camera.unevenness",
}
"""What to do about departures that no tolerance allows for."""


def _remedy(paths: list[str], model: Model, between: str = " or ") -> str:
    stated = {CROSSTALK if path.startswith(CROSSTALK) else path for path in model.sensor.tolerances}
    unique = list(dict.fromkeys(paths))
    found = [_NOT_TOLERANCES[path] for path in unique if path in _NOT_TOLERANCES]
    given = [path for path in unique if path not in _NOT_TOLERANCES and path not in stated]
    wider = [path for path in unique if path not in _NOT_TOLERANCES and path in stated]
    if given:
        found.append(f"give {between.join(map(_named, given))} a tolerance")
    if wider:
        found.append(f"widen the tolerance of {between.join(map(_named, wider))}")
    if model.sensor.kind == "strip" and not {
        "tactels.placement",
        "tactels.contact_width",
    }.isdisjoint(unique):
        found.append("take a skin in the place of tactels, which reads contacts anywhere,")
    return ", ".join(found) + " or calibrate" * (not model.sensor.calibration_refusal)
