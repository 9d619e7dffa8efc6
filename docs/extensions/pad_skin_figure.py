"""The figure of a pad's skin: pressure and shear of two bodies along a line, true and read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from conventions_figure import NORMAL, TANGENTIAL
from matplotlib.figure import Figure

import fringeforce as ff
from fringeforce.models.pad_presses import pad_tractions

PRESSES = (
    ff.Press(x=-3.1e-3, y=0.1e-3, normal=5.0, tangential=(1.5, 0.0), radius=8e-3),
    ff.Press(x=3.3e-3, y=0.1e-3, normal=4.0, tangential=(-0.6, 0.0), width=3.6e-3, profile="flat"),
)


def save(path: Path) -> None:
    """Draw and write the figure; the same drawing gives the same bytes."""
    style: Any = {"svg.hashsalt": "fringeforce", "font.size": 9, "font.family": "sans-serif"}
    model = ff.characterize(ff.load_sensor("pad-skin"))
    frame = model.expose(PRESSES, rng=0)
    traction = ff.Reader(model).read(frame).traction
    assert traction is not None
    rows = np.unique(traction.places[:, 1])
    line = rows[np.abs(rows - 0.1e-3).argmin()]
    own = traction.places[:, 1] == line
    x = traction.places[own, 0] * 1e3
    with mpl.rc_context(style):
        figure = Figure(figsize=(9, 3.4), layout="constrained")
        image, axes = figure.subplots(1, 2, width_ratios=(1, 2.2))
        image.imshow(frame[::2, ::2], cmap="gray", origin="lower", extent=(-12.5, 12.5) * 2)
        image.set(xlabel="x [mm]", ylabel="y [mm]", title="one kind of pixels")
        for part, (name, colour) in enumerate((("pressure", NORMAL), ("shear", TANGENTIAL))):
            value, std = traction.values[own, part] / 1e6, traction.std[own, part] / 1e6
            band = value - 2 * std, value + 2 * std
            axes.fill_between(x, *band, color=colour, alpha=0.25, linewidth=0)
            axes.plot(x, value, color=colour, label=f"{name}, read")
            for number, press in enumerate(PRESSES):
                axes.plot(
                    *_true(press, line, part),
                    color="black",
                    linestyle="--" if part else "-",
                    linewidth=0.9,
                    label=f"{name}, true" if number == 0 else None,
                )
        axes.set(xlabel=f"x [mm], at y = {line * 1e3:.1f} mm", ylabel="traction [MPa]")
        axes.set_xlim(-6, 6)
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(loc="upper right", frameon=False)
        figure.savefig(path, metadata={"Date": None})


def _true(press: ff.Press, line: float, part: int) -> tuple[np.ndarray, np.ndarray]:
    """True traction along a line: places [mm] and values [MPa]."""
    if press.radius is None:
        half = float(np.max(press.width or 0.0)) / 2
        ends = press.x + np.array([-half, -half, half, half])
        peak = (press.normal, press.shear[0])[part] / (np.pi * half**2)
        return ends * 1e3, np.array([0.0, peak, peak, 0.0]) / 1e6
    places, forces = pad_tractions(ff.load_sensor("pad-skin"), press)
    step = np.diff(np.unique(places[:, 0].round(9))).min()
    row = np.abs(places[:, 1] - line) < step / 2
    return places[row, 0] * 1e3, forces[row, part] / step**2 / 1e6
