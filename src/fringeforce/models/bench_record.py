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

    The columns of contacts are: place along the strip, or along x and y of a pad [m], normal and
    tangential force, on a pad along x and y [N], and whole width [m]; what is not stated, or could
    not be found, is not a number.  So there are m = 4 columns of a strip and m = 6 of a pad.

    Attributes
    ----------
    frames : ndarray of int, shape (C,)
        Frame of each contact.
    written, found, std : ndarray, shape (C, m)
        Contacts as written down, as the frames show them, and the standard deviations of these.
    residuals : ndarray, shape (F, B), or (F, rows, columns) of a pad
        Residuals of groups of neighbouring pixels, scaled so that noise alone has unit variance;
        not a number where no pixel of a group is used.
    misfits : ndarray, shape (F,)
        Reduced chi-square of every frame, how far its contacts moved included.
    aside : ndarray, shape (H, 4)
        Forces of frames that were put aside: frame, component, 0 for the normal one, force found
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

    @property
    def dimensions(self) -> int:
        """Dimensions of the loaded surface: 1 of a strip, 2 of a pad."""
        return self.written.shape[1] // 2 - 1
