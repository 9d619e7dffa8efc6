"""Pictures of results, written to files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from fringeforce.base.errors import InputError
from fringeforce.base.storage import writing
from fringeforce.models.pad import PadModel
from fringeforce.models.strip import SensorModel
from fringeforce.plotting.axes import figure
from fringeforce.plotting.calibration import draw_misfit


def draw_residuals(model: SensorModel | PadModel, path: Path) -> None:
    """Write a picture of what a calibrated model leaves of the frames that it was fitted to.

    Parameters
    ----------
    model : SensorModel or PadModel
        Calibrated.
    path : Path
        Path of the picture.

    Raises
    ------
    InputError
        If the model has no record of a calibration.
    FileFormatError
        If the picture cannot be written.
    """
    found = model.calibration
    if found is None or found.record is None:
        raise InputError("This model has no record of a calibration; calibrate it first.")
    canvas = draw_misfit(found.record, found.outliers)
    with writing(path):
        canvas.savefig(path)


def draw_plan(ratio: ArrayLike, path: Path) -> None:
    """Write a picture of what calibration errors add to readings, over the number of loads.

    Parameters
    ----------
    ratio : array_like, shape (k + 1,)
        Error of readings over that of a perfectly known sensor, from no calibration load on.

    Raises
    ------
    FileFormatError
        If the picture cannot be written.
    """
    excess = np.asarray(ratio)[1:] - 1
    with _picture(path) as ax:
        ax.semilogy(1 + np.arange(len(excess)), 100 * excess, "o-", markersize=4)
        ax.set(
            xlabel="calibration loads", ylabel="readings err more than\nwith a known sensor by [%]"
        )


@contextmanager
def _picture(path: Path, width: float = 8.0, height: float = 3.6) -> Iterator[Axes]:
    """Axes of a picture that is written at the end; its size is in inches."""
    with figure(width, height) as (canvas, ax):
        yield ax
        with writing(path):
            canvas.savefig(path)
