"""Types of arrays, by what they hold, and numbers of what callers pass in."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import InputError

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Mask = NDArray[np.bool_]
Index = NDArray[np.intp]


def numbers(values: ArrayLike, what: str) -> Array:
    """Real numbers as an array of floats; what a masked array hides is not a number.

    Parameters
    ----------
    values : array_like
        Numbers of any type, or texts of numbers.
    what : str
        What they are, for the message.

    Raises
    ------
    InputError
        If they are complex, dates, ragged or no numbers at all.

    Examples
    --------
    >>> from fringeforce.base.arrays import numbers
    >>> numbers(["1", "2.5"], "Forces").tolist()
    [1.0, 2.5]
    """
    try:
        raw = np.asarray(values)
        if raw.dtype.kind in "cmM":
            raise ValueError(f"they are {raw.dtype}")
        seen = ~np.ma.getmaskarray(values) if isinstance(values, np.ma.MaskedArray) else True
        real = np.asarray(raw, dtype=float)
        return real if seen is True else np.where(seen, real, np.nan)
    except (TypeError, ValueError, OverflowError) as error:
        reason = str(error)[:200]
        raise InputError(f"{what} must be real numbers; these are none ({reason}).") from None
