"""The figure of what tolerances do to a reading: deviations of the forces under each of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from conventions_figure import NORMAL, TANGENTIAL
from matplotlib.figure import Figure

import fringeforce as ff

TOLERANCES: dict[str, dict[str, str]] = {
    "noise alone": {},
    "light 3 %": {"camera.drift": "3 %"},
    "visibility\n0.97 ± 0.02": {"polariscope.visibility": "0.97 +/- 0.02"},
    "cover 0.5 mm\n± 5 %": {"transducer.compliant.thickness": "0.5 mm +/- 5 %"},
    "residual\n0.05 rad": {"polariscope.residual": "0 +/- 0.05 rad"},
    "place\n0.1 mm": {"tactels.placement": "0 +/- 0.1 mm"},
    "width 0.4\n± 0.2 mm": {"tactels.contact_width": "0.4 +/- 0.2 mm"},
}
"""Names of the bars and tolerances of the drawing; the last bar has all of them."""


def save(path: Path) -> None:
    """Draw and write the figure; the same drawing gives the same bytes."""
    style: Any = {"svg.hashsalt": "fringeforce", "font.size": 9, "font.family": "sans-serif"}
    forces = ff.polar(1.0, angle=10, n=11)
    sets = [*TOLERANCES.values(), {k: v for one in TOLERANCES.values() for k, v in one.items()}]
    bounds = [ff.Reader(ff.characterize(_drawn(stated))).bound(forces) for stated in sets]
    spread = 1e3 * np.sqrt(np.square(bounds).mean(axis=1))
    with mpl.rc_context(style):
        figure = Figure(figsize=(9, 3.6), layout="constrained")
        axes, place = figure.subplots(), np.arange(len(sets))
        for part, (name, colour) in enumerate((("normal", NORMAL), ("tangential", TANGENTIAL))):
            bars = axes.bar(place + 0.4 * part - 0.2, spread[:, part], 0.38, color=colour)
            bars.set_label(name)
            axes.bar_label(bars, [f"{value:.0f}" for value in spread[:, part]], fontsize=8)
        axes.set_xticks(place, [*TOLERANCES, "all together"])
        axes.set(ylabel="standard deviation of a force [mN]")
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(loc="upper left", frameon=False)
        figure.savefig(path, metadata={"Date": None})


def _drawn(stated: dict[str, str]) -> ff.Sensor:
    return ff.load_sensor("saad").replace(**{"camera.amplitude": 237.0}).replace(**stated)
