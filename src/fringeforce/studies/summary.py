"""What a designer wants to know of a sensor at one glance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.planning.candidates import fringes_per_pixel
from fringeforce.calibration.planning.plan import GAIN, Plan
from fringeforce.contacts.loads import paper_load
from fringeforce.contacts.press import Press
from fringeforce.design.pad import SQUARES, Pad
from fringeforce.design.parts import Layer
from fringeforce.design.strip import Sensor
from fringeforce.design.text import unit_at
from fringeforce.design.units import READABLE
from fringeforce.models.pad import PadModel
from fringeforce.models.strain_error import strain_error
from fringeforce.models.strip import SensorModel
from fringeforce.optics.camera import least_phase
from fringeforce.optics.photoelasticity import stress_optic_constant
from fringeforce.reading.reader import Reader
from fringeforce.reading.reading import Status

PLACES = {"camera scale": None}
NYQUIST = 0.5
"""Fringes per pixel up to which a camera resolves them."""
LINEAR = 0.1
"""Strain of the cover up to which linear elasticity is near enough."""


CONDITION = 1e3
"""Condition number up to which the error of the influence matrix, 1e-4, moves forces by less than a
tenth."""
TOLD = 0.1
"""Deviation of a force up to which frames tell it, as a share of it."""
MISSED = 0.01
"""Error of a force by large strain, over the largest, that hardly any use of a reading notices."""


def fringe_density(model: SensorModel) -> float:
    """Fringes per pixel under 1 N at 10 degrees on every tactel, where they are densest.

    Intensity repeats when the phase advances by 2 pi, so a camera resolves up to half a fringe per
    pixel (Nyquist).
    """
    return float(fringes_per_pixel(model, paper_load(model.sensor.tactels.count)))


def surface_strain(model: SensorModel) -> float:
    """Strain of the cover under 1 N spread over one pitch, as a fraction (linear elasticity)."""
    sensor = model.sensor
    area = sensor.tactels.pitch * sensor.transducer.width
    return 1.0 / area / sensor.transducer.compliant.youngs_modulus


def summary(model: SensorModel | PadModel) -> list[tuple[str, str]]:
    """Names and values, in the order of a person's questions.

    Parameters
    ----------
    model : SensorModel or PadModel
        The characterised sensor.

    Returns
    -------
    list of (str, str)
        Each a quantity and its value with unit.
    """
    return _SUMMARIES[model.sensor.kind](model)


def _strip_summary(model: SensorModel) -> list[tuple[str, str]]:
    sensor, reader = model.sensor, Reader(model)
    strip, camera = sensor.transducer, sensor.camera
    peaks = _named(np.abs(model.pixel_influence).max(axis=(0, 1)))
    density = fringe_density(model)
    pixel = _mm(strip.length / camera.pixels)
    told = float(f"{least_phase(sensor):.2g}")
    size = f"{_mm(strip.length)} x {_mm(strip.width)}"
    given = strip.plane == "given"
    drawn = [
        ("strip", f"{size}, {strip.edges} edges, plane {strip.plane}"),
        *_layers(sensor),
        _places(sensor),
    ]
    constant = [_constant(sensor)]
    if given:  # there is no strip behind a matrix
        drawn, constant = [("forces", f"{sensor.tactels.count}, over {_mm(strip.length)}")], []
    return [
        *drawn,
        ("camera", f"{camera.pixels} pixels of {pixel}, {camera.bits} bits"),
        *_channels(sensor),
        *constant,
        (
            "peak phase per newton",
            ", ".join(f"{peak:.3g} rad {name}" for name, peak in peaks.items())
            + f": {_judged(min(peaks.values()), told, unit=' rad', least=True)} (noise of a pixel)",
        ),
        *_told_apart(model, reader),
        ("a frame without lamp", _without_lamp(model, reader)),
        (
            "fringe density at 1 N, 10 degrees on all",
            f"{density:.3g} fringes per pixel: {_judged(density, NYQUIST)} (Nyquist), reached at "
            f"{NYQUIST / density:.3g} N",
        ),
        *([] if given else [_strain(model)]),
        ("solved by", provenance_words(model)),
    ]


def _without_lamp(model: SensorModel, reader: Reader) -> str:
    """What is read of a frame without any light but what fringes do not modulate."""
    dark = np.zeros(model.sensor.camera.pixels)
    status = reader.search(model.delivered(dark, rng=0, light=dark)).status
    if status is Status.NO_CONTACT:
        return (
            "reads as NO_CONTACT, for fields are dark without load: bad where nobody sees the "
            "lamp; a second of [[polariscope.channels]], with another bias, tells"
        )
    return f"good, refused as {status.name}"


def _channels(sensor: Sensor) -> list[tuple[str, str]]:
    """Light and noise of every channel, if there are several."""
    polariscope = sensor.polariscope
    told = [
        f"{1e9 * (one.wavelength or polariscope.wavelength):.4g} nm"
        + f" + {one.bias:g} degrees" * bool(one.bias)
        + f", {bright:.3g} over {dark:.3g}, noise {noise:.3g}"
        for one, bright, dark, noise in zip(
            polariscope.pictures, *sensor.light, sensor.noise, strict=True
        )
    ]
    return [("channels [grey levels]", "; ".join(told))] if len(told) > 1 else []


def _named(values: Array) -> dict[str, float]:
    """Values of the components of a force of a strip, of those that it has."""
    return {n: float(v) for n, v in zip(("normal", "tangential"), values, strict=True) if v > 0}


def _places(sensor: Sensor) -> tuple[str, str]:
    places = f"{sensor.tactels.count} at a pitch of {_mm(sensor.tactels.pitch)}"
    if sensor.skin is None:
        return "tactels", places
    return "skin", f"{_mm(sensor.skin.extent)} long, contacts anywhere by lines, {places}"


def _told_apart(model: SensorModel, reader: Reader) -> list[tuple[str, str]]:
    """How well one frame tells forces on tactels, or a contact on a skin."""
    sensor = model.sensor
    if sensor.skin is not None:
        cover = sensor.transducer.compliant
        width = cover.thickness
        area = width * sensor.transducer.width
        press = Press(x=0.0, normal=LINEAR * cover.youngs_modulus * area, width=width)
        return [_contact(reader, press)]
    columns = model.pixel_influence.reshape(sensor.camera.pixels, -1)
    condition = np.linalg.cond(columns[:, np.abs(columns).max(axis=0) > 0])
    std = _named(reader.bound(paper_load(sensor.tactels.count)).max(axis=0))
    words = ", ".join(f"{1e3 * one:.3g} mN {name}" for name, one in std.items())
    return [
        (
            "condition number",
            f"{condition:.4g} of the influence matrix: {_judged(condition, CONDITION)}",
        ),
        (
            "standard deviation of a force, one frame",
            f"{words} by noise, at 1 N, 10 degrees on all: "
            f"{_judged(max(std.values()), TOLD, 1e3, ' mN')}",
        ),
    ]


def _pad_summary(model: PadModel) -> list[tuple[str, str]]:
    pad = model.sensor
    block, tactels, camera = pad.transducer, pad.tactels, pad.camera
    middle = np.zeros((3, tactels.total, 3))
    middle[range(3), tactels.total // 2, range(3)] = 1.0
    normal, tangential, _ = [np.hypot(*one).max() for one in model.retardance(middle)]
    columns, rows = camera.pixels
    count = f"{tactels.count[0]} x {tactels.count[1]}"
    places = ("tactels", f"{count} at a pitch of {_mm(tactels.pitch)}")
    if pad.skin is not None:
        extent = " x ".join(map(_mm, pad.skin.extent))
        places = ("skin", f"{extent}, forces also on {count} squares of {_mm(tactels.side)}")
    return [
        ("pad", f"{_mm(block.length)} x {_mm(block.width)}, {block.sides} sides"),
        *_layers(pad),
        places,
        ("camera", f"{columns} x {rows} pixels, {camera.kind}, {camera.bits} bits"),
        _constant(pad),
        (
            "peak retardance per newton",
            f"{normal:.3g} rad normal, {tangential:.3g} rad tangential, both passes",
        ),
        _deviations(model),
        _strain(model),
        ("solved by", provenance_words(model)),
    ]


def _deviations(model: PadModel) -> tuple[str, str]:
    """How well one frame tells a small force on a tactel, or a contact on a skin."""
    pad, reader = model.sensor, Reader(model)
    if pad.skin is None:
        std = np.median(reader.bound(np.zeros((pad.tactels.total, 3))), axis=0)
        return "standard deviation of a force, one frame", (
            f"{1e3 * std[0]:.3g} mN normal, {1e3 * std[1:].max():.3g} mN tangential, at rest: "
            f"{_judged(std.max(), TOLD, 1e3, ' mN')}"
        )
    press = Press(x=0.0, y=0.0, normal=1.0, width=SQUARES * pad.transducer.compliant.thickness)
    return _contact(reader, press)


def _contact(reader: Reader, press: Press) -> tuple[str, str]:
    """Deviations of one contact."""
    total = reader.search(reader.model.expose([press], rng=0)).total
    name = f"standard deviation of a contact of {press.normal:.2g} N, one frame"
    if total is None:
        return name, "bad, such a contact is not read"
    std = total.force_std
    words = (
        f"{1e3 * std[0]:.3g} mN normal, {1e3 * std[1:].max():.3g} mN tangential, "
        f"{1e6 * total.place_std.max():.3g} um of its place"
    )
    return name, f"{words}: {_judged(std.max(), TOLD * press.normal, 1e3, ' mN')}"


_SUMMARIES: Mapping[str, Any] = {"strip": _strip_summary, "pad": _pad_summary}


def _layers(sensor: Sensor | Pad) -> list[tuple[str, str]]:
    return [
        (
            f"{name} layer",
            f"{_mm(layer.thickness)}, E = {layer.youngs_modulus / 1e6:.4g} MPa, "
            f"nu = {layer.poissons_ratio:.4g}{_law(layer)}",
        )
        for name, layer in (
            ("compliant", sensor.transducer.compliant),
            ("photoelastic", sensor.transducer.photoelastic),
        )
    ]


def _law(layer: Layer) -> str:
    """Coefficients of a strain energy that is not neo-Hookean."""
    found = layer.coefficients
    words = ", ".join(f"{name} = {value / 1e6:.3g} MPa" for name, value in found.items())
    return f", {words}" if len(found) > 1 else ""


def _constant(sensor: Sensor | Pad) -> tuple[str, str]:
    layer, light = sensor.transducer.photoelastic, sensor.polariscope
    constant = stress_optic_constant(layer, light.wavelength)
    return "stress-optic constant K_t", f"{1e3 * constant:.4g} rad/(MPa mm)"


def _strain(model: SensorModel | PadModel) -> tuple[str, str]:
    sensor = model.sensor
    if sensor.dimensions == 1 and not sensor.transducer.solved_in_a_plane:
        strain = surface_strain(cast(SensorModel, model))
        return "strain of the cover at 1 N", (
            f"{1e2 * strain:.2g} % over one pitch: {_judged(strain, LINEAR, 1e2, ' %')} (linear "
            f"theory), reached at {LINEAR / strain:.3g} N"
        )
    error = float(strain_error(sensor).max())
    missed = f"{1e2 * error:.2g} % of the largest force at 1 N, root mean square, to second order"
    if sensor.transducer.strain == "finite":
        if not isinstance(sensor, Sensor):
            taken = "deviations of readings allow for it"
        else:
            taken = "readings take it into account"
            if sensor.transducer.loads == "follower":
                missed += ", of loads that follow the surface"
        return "what linear theory misses", f'{missed}; {taken}, by strain = "finite"'
    judged = _judged(error, MISSED, 1e2, " %")
    return "what linear theory misses", f"{missed}: {judged}, reached at {MISSED / error:.3g} N"


def _judged(
    value: float, limit: float, factor: float = 1.0, unit: str = "", least: bool = False
) -> str:
    """Good or bad, with the limit that decides: the most that is good, or the least."""
    good = "good" if (value > limit if least else value < limit) else "bad"
    side = "below" if value < limit else "above"
    return f"{good}, {side} the limit of {limit * factor:.4g}{unit}"


def provenance_words(model: SensorModel | PadModel) -> str:
    """How a model was made: the method, then each fact as its name and value."""
    facts = dict(model.provenance)
    method = str(facts.pop("method", "a given influence matrix"))
    found = (f"{name} {_share(value)}" for name, value in facts.items())
    return ", ".join([method, *found])


def _share(value: Any) -> str:
    """A share in per cent; counts and words as they are."""
    return f"{1e2 * value:.2g} %" if isinstance(value, float) else str(value)


def calibration_summary(model: SensorModel | PadModel) -> list[str]:
    """What a calibration found, in lines: every unknown before and after, then the findings."""
    found = model.calibration
    if found is None:
        return ["not calibrated"]
    width = max(map(len, found.names))
    unknowns = zip(found.names, found.drawing, found.values, found.std, strict=True)
    lines = [f"  {name:<{width}}  {_change(model, name, *numbers)}" for name, *numbers in unknowns]
    return [*lines, f"  reduced chi-square {found.chi2:.4g}", *found.findings]


def plan_summary(plan: Plan, sensor: Sensor | Pad) -> list[str]:
    """What planned calibration loads are expected to achieve, in lines."""
    rows: list[tuple[str, ...]] = [("unknown", "value", "+/- before", "+/- after")]
    for name, *numbers in zip(plan.names, plan.values, plan.std[0], plan.std[-1], strict=True):
        factor, symbol = READABLE[_unit(sensor, name)]
        value, *std = (number * factor for number in numbers)
        rows.append((f"{name} [{symbol}]" if symbol else name, f"{value:.4g}",
                     *(f"{one:.2g}" for one in std)))  # fmt: skip
    width = max(len(name) for name, *_ in rows)
    lines = [f"  {name:<{width}}" + "".join(f"  {cell:>10}" for cell in row) for name, *row in rows]
    lines.append("  error of readings, over that of a perfectly known sensor")
    count = len(plan.loads)
    shown = sorted({0, *(k for k in (1, 2, 3, 5, 10, 20, 50, 100, 200, 500) if k < count), count})
    lines += [f"  after {k:>3} {_loads(k):<5}  {plan.ratio[k]:>10.4g}" for k in shown]
    if plan.enough < count:
        lines.append(
            f"  loads after number {plan.enough} gain less than {1e2 * GAIN:g} % all together"
        )
    return lines


def _loads(count: int) -> str:
    return "load" if count == 1 else "loads"


def _change(
    model: SensorModel | PadModel, name: str, before: float, after: float, std: float
) -> str:
    """An unknown before and after, to the second digit of its standard deviation."""
    factor, symbol = READABLE[_unit(model.sensor, name)]
    digits = max(0, 1 - int(np.floor(np.log10(std * factor)))) if std > 0 else 6
    found = f"{after * factor:.{digits}f} +/- {std * factor:.{digits}f} {symbol}".rstrip()
    return f"{before * factor:.6g} -> {found}"


def _unit(sensor: Sensor | Pad, name: str) -> str | None:
    """SI unit of an unknown of a calibration, by its name."""
    place = name in ("camera shift", "camera scale") or name.startswith("tactel ")
    return PLACES.get(name, "meter") if place else unit_at(sensor, name)


def _mm(value: float) -> str:
    return f"{value * 1e3:.4g} mm"
