"""Forces of a pad as CSV, one row for each tactel."""

from __future__ import annotations

import csv
import io

import numpy as np
from numpy.typing import NDArray

from fringeforce.pads.design import PadTactels

Array = NDArray[np.float64]
FORCES = ("normal_N", "shear_x_N", "shear_y_N")


def forces_text(tactels: PadTactels, forces: Array, std: Array | None = None) -> str:
    """A table of tactels, their places and forces, and standard deviations where they are known.

    Parameters
    ----------
    tactels : PadTactels
        Of the pad.
    forces, std : ndarray, shape (n, 3)
        N, T_x, T_y [N].
    """
    spread = [name.replace("_N", "_std_N") for name in FORCES] if std is not None else []
    numbers = np.hstack([tactels.places, forces, *([] if std is None else [std])])
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["tactel", "x_m", "y_m", *FORCES, *spread])
    for number, row in enumerate(numbers.tolist(), 1):
        writer.writerow([number, *row])
    return out.getvalue()
