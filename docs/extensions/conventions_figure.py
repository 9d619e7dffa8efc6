"""The figure of axes, layers, signs and units: one drawing of the paper's strip."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

import fringeforce as ff

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Okabe and Ito's colours, which colour-blind people tell apart
NORMAL, TANGENTIAL, COVER, CLEAR = "#0072B2", "#D55E00", "#E8C9A0", "#CFE5F2"
DARK, BASE = "#222222", "#777777"
TACTEL = 9
FORCES = ff.polar(1.0, angle=10, n=11)


def save(path: Path) -> None:
    """Draw and write the figure; the same drawing gives the same bytes."""
    style: Any = {"svg.hashsalt": "fringeforce", "font.size": 10, "font.family": "sans-serif"}
    with mpl.rc_context(style):
        figure = Figure(figsize=(9, 7.2), layout="constrained")
        strip, phase, light = figure.subplots(3, 1, sharex=True, height_ratios=[2.6, 1, 1])
        model = ff.characterize(ff.load_sensor("saad"))
        _strip(strip, model.sensor)
        _phase(phase, model)
        _light(light, model)
        figure.savefig(path, metadata={"Date": None})


def _strip(axes: Axes, sensor: ff.Sensor) -> None:
    beam, places = sensor.transducer, 1e3 * sensor.tactels.positions
    a, b, half = (
        1e3 * beam.compliant.thickness,
        1e3 * beam.photoelastic.thickness,
        500 * beam.length,
    )
    axes.add_patch(Rectangle((-half, -a), 2 * half, a, facecolor=COVER, edgecolor=DARK))
    axes.add_patch(Rectangle((-half, -a - b), 2 * half, b, facecolor=CLEAR, edgecolor=DARK))
    axes.add_patch(
        Rectangle(
            (-half, -a - b - 0.3), 2 * half, 0.3, facecolor="none", edgecolor=BASE, hatch="///"
        )
    )
    axes.plot([-half, half], [-a, -a], color=DARK, linewidth=2)
    axes.plot(places, 0 * places, "|", color=DARK, markersize=9)
    for number in (1, 6, len(places)):
        axes.annotate(f"tactel {number}", (places[number - 1], 0.25), ha="center", fontsize=9)
    _loads(axes, places[TACTEL - 1])
    _axes(axes)
    axes.text(-half + 0.3, -a / 2, "compliant layer: a, E$_1$, $\\nu_1$", va="center", fontsize=9)
    axes.text(-half + 0.3, -a - 0.3, "mirror", va="center", fontsize=9)
    axes.text(
        -half + 0.3,
        -a - 0.75 * b,
        "photoelastic layer: b, E$_2$, $\\nu_2$, K$_s$",
        va="center",
        fontsize=9,
    )
    axes.text(-half + 0.3, -a - b - 0.72, "rigid base, bonded: u = w = 0", fontsize=9)
    _light_path(axes, a, b)
    axes.set(xlim=(-half - 1, half + 1), ylim=(-a - b - 1, 2.6), ylabel="z [mm]")
    axes.spines[["top", "right"]].set_visible(False)


def _loads(axes: Axes, x: float) -> None:
    """A pressing force, its two parts and the angle."""
    alpha = np.radians(35)
    tail = float(x - 2.2 * np.sin(alpha)), float(2.2 * np.cos(alpha))
    arrow = {"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0, "linewidth": 2}
    axes.annotate("", (x, 0), tail, arrowprops=arrow | {"color": DARK})
    axes.annotate("", (tail[0], 0), tail, arrowprops=arrow | {"color": NORMAL})
    axes.annotate("", (x, 0), (tail[0], 0), arrowprops=arrow | {"color": TANGENTIAL})
    axes.plot([x, x], [0, 2.2], ":", color=BASE, linewidth=1)
    axes.text(tail[0] - 0.2, 1.5, "N > 0 presses", ha="right", color=NORMAL)
    axes.text(x + 0.25, 0.8, "T > 0 points to +x", color=TANGENTIAL)
    axes.text(x - 0.42, 1.15, r"$\alpha$", color=DARK)
    axes.text(x + 0.25, 1.9, r"F,  N = F cos $\alpha$,  T = F sin $\alpha$", color=DARK)


def _axes(axes: Axes) -> None:
    arrow = {"arrowstyle": "-|>", "color": DARK, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (2.0, -1.7), (0, -1.7), arrowprops=arrow)
    axes.annotate("", (0, -0.6), (0, -1.7), arrowprops=arrow)
    axes.plot(0, -1.7, "o", color=DARK, markersize=7, fillstyle="none")
    axes.plot(0, -1.7, "x", color=DARK, markersize=4)
    axes.text(2.1, -1.75, "x, from the centre", va="center")
    axes.text(0.2, -0.95, "z, from the loaded surface", va="center")
    axes.text(-0.35, -2.1, "y, width t", va="center", ha="center")


def _light_path(axes: Axes, a: float, b: float) -> None:
    """Light enters through the base, is reflected by the mirror and leaves."""
    arrow = {"arrowstyle": "-|>", "color": NORMAL, "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (9.9, -a), (9.9, -a - b - 0.9), arrowprops=arrow)
    axes.annotate("", (10.3, -a - b - 0.9), (10.3, -a), arrowprops=arrow)
    axes.text(
        9.7, -a - b / 2, "light,\ntwice through", ha="right", va="center", fontsize=9, color=NORMAL
    )


def _phase(axes: Axes, model: ff.SensorModel) -> None:
    x = 1e3 * model.pixel_positions
    axes.axhline(0, color=BASE, linewidth=0.8)
    axes.plot(x, model.phase(FORCES), color=DARK)
    axes.set(ylabel="phase lead p\n[rad]")
    axes.text(-12.3, -6.6, "1 N at 10° on every tactel", fontsize=9)


def _light(axes: Axes, model: ff.SensorModel) -> None:
    x = 1e3 * model.pixel_positions
    axes.plot(x, model.expose(FORCES, rng=0), color=DARK, linewidth=0.6)
    axes.set(
        xlabel="x [mm]; pixel i of n sees ((i + 0.5)/n - 0.5) c", ylabel="frame\n[grey levels]"
    )
