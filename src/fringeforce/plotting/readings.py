"""Readings of a recording as one picture: verdicts, forces with bands, contacts, maps."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from fringeforce.base.arrays import Array
from fringeforce.base.storage import writing
from fringeforce.contacts.resultant import TOUCHED, Resultant, touch
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.plotting.axes import MILLI, STYLE, forces, pad_forces, tractions
from fringeforce.reading.reading import Reading, Status

COLOURS = {
    Status.OK: "#009e73",
    Status.NO_CONTACT: "#c8c8c8",
    Status.AMBIGUOUS: "#e69f00",
    Status.MODEL_MISMATCH: "#d55e00",
    Status.SATURATED: "#cc79a7",
    Status.FRINGES_TOO_DENSE: "#56b4e9",
    Status.BAD_FRAME: "#000000",
}
"""Colours of verdicts in the band over the frames."""
BAND = 2.0
"""Half width of bands [standard deviations]."""
NAMED = 6
"""Tactels at most that have a colour of their own: of those that are touched, with most force."""
MAPS = 3
"""Frames of a pad that are drawn as maps."""
DOTS = 60
"""Frames up to which each has a dot, so that one between refused ones is seen."""

Curve = tuple[str, str, Array, Array]
"""Label, colour, values and deviations, shape (k,) or (k, contacts), of a line or of dots."""
Panel = tuple[str, list[Curve], list[tuple[str, Array]]]
"""Quantity and unit, what was read, and colours and values of what acted."""


def draw_readings(
    sensor: Sensor | Pad, readings: Sequence[Reading], path: Path, applied: Array | None = None
) -> None:
    """Write a picture of the forces of one frame, or of many in their order.

    Over the frames a band tells the verdicts.  Forces have bands of two standard deviations; those
    of refused frames are not drawn.

    Parameters
    ----------
    sensor : Sensor or Pad
        The design.
    readings : sequence of Reading
        One for each frame.
    path : Path
        Path of the picture.
    applied : ndarray, shape (k, n, components), optional
        Forces that acted, where they are known [N].

    Raises
    ------
    FileFormatError
        If the picture cannot be written.
    """
    draw = _draw_one if len(readings) == 1 else _draw_many
    with mpl.rc_context(STYLE):
        canvas = draw(sensor, readings, applied)
        with writing(path):
            canvas.savefig(path)


def _draw_one(sensor: Sensor | Pad, readings: Sequence[Reading], applied: Array | None) -> Figure:
    reading, flat = readings[0], sensor.dimensions == 1
    canvas = Figure(figsize=(8.0, 3.6) if flat else (5.4, 4.4))
    ax = canvas.add_subplot()
    ax.set_title(reading.status.name, loc="left", fontsize=10)
    if sensor.kind == "pad":
        pad_forces(ax, sensor, reading.forces)
    elif reading.traction is not None:
        tractions(ax, reading.traction.places, reading.traction.values, reading.traction.std)
    else:
        forces(ax, reading.forces, reading.std)
        if applied is not None:
            tactel = np.arange(1, applied.shape[1] + 1)
            style: Any = {"linestyle": "", "marker": "x", "color": "black", "zorder": 4}
            for shift, part in zip((-0.12, 0.12), applied[0].T, strict=True):
                ax.plot(tactel + shift, part, label="applied" if shift < 0 else "_", **style)
            ax.legend()
    return canvas


def _draw_many(sensor: Sensor | Pad, readings: Sequence[Reading], applied: Array | None) -> Figure:
    panels = _panels(sensor, readings, applied)
    maps = sensor.kind == "pad"
    heights = [0.25, *(2.0 for _ in panels)]
    if maps:
        heights.append(2.4)
    canvas = Figure(figsize=(9.0, 0.9 + sum(heights)))
    rows = canvas.add_gridspec(len(heights), 1, height_ratios=heights)
    band = canvas.add_subplot(rows[0])
    _draw_band(band, readings)
    for number, (label, curves, truth) in enumerate(panels, 1):
        ax = canvas.add_subplot(rows[number], sharex=band)
        _draw_curves(ax, curves, truth)
        ax.set(ylabel=label, xlim=(-0.5, len(readings) - 0.5))
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
        if ax.get_legend_handles_labels()[0] and (number == 1 or len(panels) == 3):
            _legend(ax)
        if number == len(panels):
            ax.set_xlabel("frame")
        else:
            ax.tick_params(labelbottom=False)
    if sensor.kind == "pad":
        _draw_maps(canvas, rows[len(heights) - 1], sensor, readings)
    return canvas


def _draw_band(ax: Axes, readings: Sequence[Reading]) -> None:
    """The verdict of every frame as a colour, with the number of each."""
    verdicts = [reading.status for reading in readings]
    colours = np.array([to_rgb(COLOURS[status]) for status in verdicts])
    extent = (-0.5, len(readings) - 0.5, 0, 1)
    ax.imshow(colours[None], aspect="auto", extent=extent, interpolation="nearest")
    known = [status for status in COLOURS if status in verdicts]
    ax.legend(
        [Patch(color=COLOURS[status]) for status in known],
        [f"{status.name} {verdicts.count(status)}" for status in known],
        loc="lower left", bbox_to_anchor=(0, 1), ncols=4, fontsize=8, borderaxespad=0.2,
    )  # fmt: skip
    ax.set(yticks=[])
    ax.tick_params(labelbottom=False, length=0)
    ax.grid(visible=False)
    ax.spines[:].set_visible(False)


def _draw_curves(ax: Axes, curves: Sequence[Curve], truth: Sequence[tuple[str, Array]]) -> None:
    for label, colour, value, std in curves:
        frame = np.arange(len(value))
        if value.ndim == 2:  # contacts, which come and go: a dot each, with its deviation
            frame = np.broadcast_to(frame[:, None], value.shape)
            seen = np.isfinite(value)
            ax.errorbar(
                frame[seen], value[seen], BAND * std[seen], color=colour, label=label,
                linestyle="", marker="o", markersize=3, elinewidth=1.0,
            )  # fmt: skip
            continue
        marker = "." if len(value) <= DOTS else ""
        ax.plot(frame, value, color=colour, label=label, marker=marker, linewidth=1.2)
        low, high = value - BAND * std, value + BAND * std
        ax.fill_between(frame, low, high, color=colour, alpha=0.25, linewidth=0)
    for colour, value in truth:
        ax.plot(value, color=colour, linestyle="--", linewidth=0.9, zorder=3)
    ax.axhline(0, color="#888888", linewidth=0.6, zorder=0)


def _legend(ax: Axes) -> None:
    found = dict(zip(*ax.get_legend_handles_labels()[::-1], strict=True))
    if "others" in found:
        found["others"] = found.pop("others")  # last
    lines = [line for line in ax.get_lines() if line.get_linestyle() == "--"]
    if lines:
        found["applied"] = Line2D([], [], color="black", linestyle="--", linewidth=0.9)
    ax.legend(
        found.values(), found.keys(), loc="upper left", bbox_to_anchor=(1, 1), fontsize=8,
        title="bands: 2 deviations", title_fontsize=7,
    )  # fmt: skip


def _panels(
    sensor: Sensor | Pad, readings: Sequence[Reading], applied: Array | None
) -> list[Panel]:
    if sensor.dimensions == 1 and sensor.skin is not None:
        return _contact_panels(readings)
    if sensor.dimensions > 1:
        return _sum_panels(sensor, readings, applied)
    return _tactel_panels(readings, applied)


def _tactel_panels(readings: Sequence[Reading], applied: Array | None) -> list[Panel]:
    values, std = (
        np.array([part(r) if r.status.usable else np.nan * r.forces for r in readings])
        for part in (lambda r: r.forces, lambda r: r.std)
    )
    count = values.shape[1]
    most = np.nan_to_num(np.abs(values)).max(axis=(0, 2))
    touched: Any = np.any(np.abs(values) > TOUCHED * std, axis=(0, 2))
    named = sorted(k for k in np.argsort(-most)[:NAMED] if touched[k])
    cycle = STYLE["axes.prop_cycle"].by_key()["color"]
    colour = {tactel: cycle[place % len(cycle)] for place, tactel in enumerate(named)}
    order = [*(k for k in range(count) if k not in colour), *named]
    panels: list[Panel] = []
    for part, name in enumerate(("normal", "tangential")):
        curves: list[Curve] = []
        for k in order:
            shown = f"tactel {k + 1}" if k in colour else "_"
            if k == order[0] and k not in colour:
                shown = "others"
            curves.append((shown, colour.get(k, "#b0b0b0"), values[:, k, part], std[:, k, part]))
        acted = [] if applied is None else [(colour[k], applied[:, k, part]) for k in named]
        panels.append((f"{name} force [N]", curves, acted))
    return panels


def _sum_panels(pad: Any, readings: Sequence[Reading], applied: Array | None) -> list[Panel]:
    """Sums over a pad, normal and along x and y."""
    totals = [_total(pad, reading) for reading in readings]
    values, std = (
        np.array([np.full(3, np.nan) if t is None else part(t) for t in totals])
        for part in (lambda t: t.force, lambda t: t.std[:3])
    )
    colours = STYLE["axes.prop_cycle"].by_key()["color"]
    curves: list[Curve] = [
        (name, colours[k], values[:, k], std[:, k])
        for k, name in enumerate(("normal", "along x", "along y"))
    ]
    acted = [] if applied is None else [(colours[k], applied.sum(axis=1)[:, k]) for k in range(3)]
    return [("force on all\nof the pad [N]", curves, acted)]


def _total(pad: Any, reading: Reading) -> Resultant | None:
    if not reading.status.usable:
        return None
    return reading.total or touch(pad, reading).total


def _contact_panels(readings: Sequence[Reading]) -> list[Panel]:
    """Place, force and width of every contact on a skin, and a dot for each."""
    felt = [reading.contacts if reading.status.usable else () for reading in readings]
    most = max((len(contacts) for contacts in felt), default=0) or 1
    cells = np.full((4, 2, len(felt), most), np.nan)  # quantity, value or deviation
    for frame, contacts in enumerate(felt):
        for number, one in enumerate(contacts):
            width = one.width or 0.0, one.width_std or 0.0
            pairs = zip((one.centre[0], *one.force, width[0]), (one.std[5], *one.std[:2], width[1]),
                        strict=True)  # fmt: skip
            cells[:, :, frame, number] = list(pairs)
    place, normal, tangential, width = cells
    blue, orange = STYLE["axes.prop_cycle"].by_key()["color"][:2]
    return [
        ("place of\ncontacts [mm]", [("_", blue, *(MILLI * place))], []),
        ("force of\ncontacts [N]",
         [("normal", blue, *normal), ("tangential", orange, *tangential)], []),
        ("width of\ncontacts [mm]", [("_", blue, *(MILLI * width))], []),
    ]  # fmt: skip


def _draw_maps(canvas: Figure, row: Any, pad: Pad, readings: Sequence[Reading]) -> None:
    """Maps of frames that can be used, evenly spread, from the first to the last."""
    usable = [k for k, reading in enumerate(readings) if reading.status is Status.OK]
    if not usable:
        usable = [k for k, reading in enumerate(readings) if reading.status.usable]
    chosen = sorted({usable[round(p)] for p in np.linspace(0, len(usable) - 1, MAPS)})
    for place, ax in enumerate(row.subgridspec(1, MAPS).subplots()):
        if place >= len(chosen):
            ax.set_axis_off()
            continue
        pad_forces(ax, pad, readings[chosen[place]].forces)
        ax.set_title(f"frame {chosen[place]}", fontsize=9, loc="left")
