"""Forces of a pad as CSV, one row for each tactel."""

from __future__ import annotations

import csv
import io

import numpy as np
from numpy.typing import NDArray

from fringeforce.design.pad import Pad, PadTactels
from fringeforce.io.tables import force_columns, reading_columns

Array = NDArray[np.float64]


def forces_text(tactels: PadTactels, forces: Array, std: Array | None = None) -> str:
    """A table of tactels, their places and forces, and standard deviations where they are known.

    Parameters
    ----------
    tactels : PadTactels
        Of the pad.
    forces, std : ndarray, shape (n, 3)
        N, T_x, T_y [N].
    """
    names = (force_columns if std is None else reading_columns)(Pad.components)
    numbers = np.hstack([tactels.places, forces, *([] if std is None else [std])])
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["tactel", "x_m", "y_m", *names])
    for number, row in enumerate(numbers.tolist(), 1):
        writer.writerow([number, *row])
    return out.getvalue()
