"""A sheet of images of a data set, with their contacts drawn in."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from fringeforce.base.errors import InputError
from fringeforce.datasets.example import Example
from fringeforce.datasets.shard import Shard, examples
from fringeforce.datasets.skin_example import SkinExample
from fringeforce.datasets.study_file import load_dataset_study
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.plotting.axes import MILLI, STYLE, arrow_key

COLUMNS, LARGEST = 6, 24
COLOUR, SHEAR = "#e69f00", "#56b4e9"


def write_sheet(study: str | os.PathLike[str], path: str | os.PathLike[str]) -> None:
    """Draw the first images of a study, at most 24; see `draw_sheet`."""
    plan, sensor = load_dataset_study(study)
    draw_sheet(sensor, examples(Shard(plan, sensor, 0, min(plan.number, LARGEST))), path)


def draw_sheet(
    sensor: Pad | Sensor, shown: Sequence[Example | SkinExample], path: str | os.PathLike[str]
) -> None:
    """Write a picture of images: outlines of contacts, arrows of shear, forces as titles.

    Arrows are of one scale, whose key is below the first image.

    Parameters
    ----------
    sensor : Pad or Sensor
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
        longest = max((_shear(one) for one in shown if isinstance(one, Example)), default=0.0)
        for ax, one in zip(panels, shown, strict=False):
            if isinstance(one, SkinExample):
                _draw_line(ax, sensor, one)
            else:
                _draw(ax, sensor, one, longest, key=ax is panels[0])
        try:
            canvas.savefig(Path(path))
        except (OSError, ValueError) as error:
            raise InputError(f"{path} cannot be written: {error}.") from None


def _draw_line(ax: Axes, skin: Any, one: SkinExample) -> None:
    x = skin.pixel_positions * MILLI
    for _, found in one.contacts:
        centre, half = found.centre * MILLI, found.width / 2 * MILLI
        ax.axvspan(centre - half, centre + half, color=COLOUR, alpha=0.4, linewidth=0)
    for line in np.atleast_2d(one.image):
        ax.plot(x, line, color="black", linewidth=0.4)
    ax.set_ylim(0, skin.camera.full_scale)
    total = sum(found.forces[:, 0].sum() for _, found in one.contacts)
    ax.set_title(f"{one.number}: {total:.2g} N", pad=2)


def _shear(one: Example) -> float:
    """The largest tangential force of a contact [N]."""
    return max(float(np.hypot(*imprint.force[1:])) for _, imprint in one.contacts)


def _draw(ax: Axes, pad: Any, one: Example, longest: float, key: bool) -> None:
    x, y = pad.transducer.length / 2 * MILLI, pad.transducer.width / 2 * MILLI
    planes = one.image.reshape(-1, *one.image.shape[-2:])
    # y runs down the columns of an image
    extent = (-x, x, y, -y)
    ax.imshow(planes[0], cmap="gray", vmin=0, vmax=pad.camera.full_scale, extent=extent)
    unit = x / 2 / longest if longest > 0 else 0.0
    for _, imprint in one.contacts:
        centre = imprint.centre * MILLI
        ring = max(imprint.reach * MILLI, x / 50)
        ax.add_patch(Circle((centre[0], centre[1]), ring, fill=False, color=COLOUR, linewidth=0.8))
    places = np.array([imprint.centre[:2] * MILLI for _, imprint in one.contacts])
    shear = unit * np.array([imprint.force[1:] for _, imprint in one.contacts])
    arrows = ax.quiver(
        *places.T, *shear.T, angles="xy", scale_units="xy", scale=1, width=0.008, color=SHEAR
    )
    arrow_key(ax, arrows, longest if key else 0.0, unit, height=-0.06)
    total = sum(imprint.force[0] for _, imprint in one.contacts)
    ax.set_title(f"{one.number}: {total:.2g} N", pad=2)
