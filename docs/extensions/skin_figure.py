"""The figure of a skin: pressure and shear of two cylinders, true and read, with its band."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from conventions_figure import NORMAL, TANGENTIAL
from matplotlib.figure import Figure

import fringeforce as ff
from fringeforce.models.presses import tractions

PRESSES = (
    ff.Press(x=-2.1e-3, normal=2.5, tangential=0.9, radius=6e-3),
    ff.Press(x=2.4e-3, normal=0.8, tangential=-0.2, radius=2e-3),
)


def save(path: Path) -> None:
    """Draw and write the figure; the same drawing gives the same bytes."""
    style: Any = {"svg.hashsalt": "fringeforce", "font.size": 9, "font.family": "sans-serif"}
    sensor = ff.load_sensor("skin").replace(**{"transducer.edges": "roller"})
    model = ff.characterize(sensor)
    reading = ff.Reader(model).read(model.expose(PRESSES, rng=0))
    traction = reading.traction
    assert traction is not None
    with mpl.rc_context(style):
        figure = Figure(figsize=(9, 3.4), layout="constrained")
        axes, x = figure.subplots(), traction.places * 1e3
        for part, (name, colour) in enumerate((("pressure", NORMAL), ("shear", TANGENTIAL))):
            value, std = traction.values[:, part] / 1e6, traction.std[:, part] / 1e6
            low, high = value - 2 * std, value + 2 * std
            axes.fill_between(x, low, high, color=colour, alpha=0.25, linewidth=0)
            axes.plot(x, value, color=colour, label=f"{name}, read")
            for number, press in enumerate(PRESSES):
                places, forces = tractions(sensor, press)
                area = np.gradient(places) * sensor.transducer.width
                axes.plot(
                    places * 1e3,
                    forces[:, part] / area / 1e6,
                    color="black",
                    linestyle="--" if part else "-",
                    linewidth=0.9,
                    label=f"{name}, true" if number == 0 else None,
                )
        axes.set(xlabel="x [mm]", ylabel="traction [MPa]", xlim=(-4.5, 4.5))
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(loc="upper right", frameon=False)
        figure.savefig(path, metadata={"Date": None})
