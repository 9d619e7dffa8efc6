"""Values with standard deviations, in words, and how far these reach."""

from __future__ import annotations

import math

INTERVAL = 1.96
"""Standard deviations of a 95 % interval of a normal distribution, to either side."""


def measured(value: float, std: float, unit: str) -> str:
    """A value with its standard deviation, of which two digits tell something.

    Parameters
    ----------
    value, std : float
        In the unit; a deviation that is not finite, or none, is left out.
    unit : str
        Behind the numbers.

    References
    ----------
    JCGM 100:2008 (GUM), section 7.2.6.
    """
    if not (math.isfinite(std) and std > 0):
        return f"{value:.4g} {unit}"
    # rounded first: 0.0996 has its two digits at 0.10
    digits = max(1 - math.floor(math.log10(float(f"{std:.1e}"))), 0)
    return f"{value:.{digits}f} +/- {std:.{digits}f} {unit}"
