"""A sheet of images of a data set, with their contacts drawn in."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from fringeforce.base.errors import InputError
from fringeforce.datasets.example import Example
from fringeforce.datasets.shard import Shard, examples
from fringeforce.datasets.study_file import load_dataset_study
from fringeforce.design.pad import Pad
from fringeforce.plotting.axes import MILLI, STYLE

COLUMNS, LARGEST = 6, 24
COLOUR, SHEAR = "#e69f00", "#56b4e9"


def write_sheet(study: str | os.PathLike[str], path: str | os.PathLike[str]) -> None:
    """Draw the first images of a study, at most 24; see `draw_sheet`."""
    plan, pad = load_dataset_study(study)
    draw_sheet(pad, examples(Shard(plan, pad, 0, min(plan.number, LARGEST))), path)


def draw_sheet(pad: Pad, shown: Sequence[Example], path: str | os.PathLike[str]) -> None:
    """Write a picture of images: outlines of contacts, arrows of shear, forces as titles.

    Parameters
    ----------
    pad : Pad
        What was pressed.
    shown : sequence of Example
        What to show.
    path : path
        Path of the picture; its ending says what kind.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    rows = -(-len(shown) // COLUMNS)
    with mpl.rc_context({**STYLE, "axes.grid": False, "font.size": 7}):
        canvas = Figure(figsize=(1.6 * COLUMNS, 1.8 * rows))
        panels = np.ravel(canvas.subplots(rows, COLUMNS, squeeze=False))
        for ax in panels:
            ax.set_axis_off()
        for ax, one in zip(panels, shown, strict=False):
            _draw(ax, pad, one)
        try:
            canvas.savefig(Path(path))
        except (OSError, ValueError) as error:
            raise InputError(f"{path} cannot be written: {error}.") from None


def _draw(ax: Axes, pad: Pad, one: Example) -> None:
    x, y = pad.transducer.length / 2 * MILLI, pad.transducer.width / 2 * MILLI
    planes = one.image.reshape(-1, *one.image.shape[-2:])
    # y runs down the columns of an image
    extent = (-x, x, y, -y)
    ax.imshow(planes[0], cmap="gray", vmin=0, vmax=pad.camera.full_scale, extent=extent)
    longest = max(float(np.hypot(*imprint.force[1:])) for _, imprint in one.contacts)
    for _, imprint in one.contacts:
        centre = imprint.centre * MILLI
        ring = max(imprint.reach * MILLI, x / 50)
        ax.add_patch(Circle((centre[0], centre[1]), ring, fill=False, color=COLOUR, linewidth=0.8))
        if longest > 0:
            arrow = imprint.force[1:] / longest * x / 3
            ax.annotate(
                "",
                xytext=(centre[0], centre[1]),
                xy=(centre[0] + arrow[0], centre[1] + arrow[1]),
                arrowprops={"arrowstyle": "->", "color": SHEAR, "linewidth": 0.8},
            )
    total = sum(imprint.force[0] for _, imprint in one.contacts)
    ax.set_title(f"{one.number}: {total:.2g} N", pad=2)
