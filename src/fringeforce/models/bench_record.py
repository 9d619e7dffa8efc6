"""What a calibration leaves to be looked at: the contacts as found, and what frames leave over."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class BenchRecord:
    """Frames and contacts behind a calibration; F frames, C contacts, H forces put aside.

    The columns of contacts are: place along the strip [m], normal and tangential force [N], and
    whole width [m]; what is not stated, or could not be found, is not a number.

    Attributes
    ----------
    frames : ndarray of int, shape (C,)
        Frame of each contact.
    written, found, std : ndarray, shape (C, 4)
        Contacts as written down, as the frames show them, and the standard deviations of these.
    residuals : ndarray, shape (F, B)
        Residuals of groups of neighbouring pixels, scaled so that noise alone has unit variance;
        not a number where no pixel of a group is used.
    misfits : ndarray, shape (F,)
        Reduced chi-square of every frame, how far its contacts moved included.
    aside : ndarray, shape (H, 4)
        Forces of frames that were put aside: frame, 0 for normal and 1 for tangential, force found
        less force written [N], and its standard deviation [N].  Errors of frames that are not
        explained are not numbers.
    """

    frames: Index
    written: Array
    found: Array
    std: Array
    residuals: Array
    misfits: Array
    aside: Array
