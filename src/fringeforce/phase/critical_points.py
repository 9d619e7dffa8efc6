"""Critical points of a noise-free intensity and their classes, Section IV of the paper.

Where intensity has an extremum the phase either crosses a multiple of pi (class 1 at I = 1, class 2
at I = 0) or turns (class 3).  Derivatives of the intensity tell the two apart in principle: at a
crossing the first that does not vanish has order 2r with r odd, at a touch r is even.  Sampled, the
same is seen better in the half-angle: sqrt(I) = |sin(p/2)| and sqrt(1 - I) = |cos(p/2)| are smooth
functions but for the change of sign at a crossing, so the classes are told by which sign makes the
samples smooth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

Array = NDArray[np.float64]

BEFORE, AFTER = 6, 4
"""Samples on either side of an extremum that a smooth curve must follow."""
ROUNDING = 2e-15
"""Relative steps of the intensity below which they are no more than rounding."""
DEGREE = 5
"""Degree of that curve, where there are samples enough."""


@dataclass(frozen=True)
class CriticalPoint:
    """An extremum of the intensity.

    Attributes
    ----------
    index : int
        First sample after the critical point.
    kind : int
        Class 1 (bright, the phase crosses), 2 (dark, the phase crosses) or 3 (the phase turns).
    """

    index: int
    kind: int


def critical_points(intensity: Array) -> list[CriticalPoint]:
    """Find and classify the extrema of a noise-free intensity.

    Parameters
    ----------
    intensity : ndarray, shape (P,)
        Normalised intensity sin^2(p/2), 0 to 1.

    Returns
    -------
    list of CriticalPoint
        In the order of the samples.

    Notes
    -----
    A phase that passes a multiple of pi and turns back within about one sample cannot be told from
    one that turns just before it; more samples resolve it.  Nor can a crossing within the last few
    samples of an end be told from a turn.
    """
    sine, cosine = np.sqrt(intensity), np.sqrt(1 - intensity)
    signed = {False: sine.copy(), True: cosine.copy()}
    found: list[CriticalPoint] = []
    extrema = _extrema(intensity)
    for number, (first, last, bright) in enumerate(extrema):
        stop = extrema[number + 1][0] + 1 if number + 1 < len(extrema) else len(intensity)
        values = signed[bright]
        crossing = _crossing(values, first, last, stop)
        if crossing is None:
            found.append(CriticalPoint(last + 1, 3))
        else:
            values[crossing:] *= -1
            found.append(CriticalPoint(crossing, 1 if bright else 2))
    return found


def _extrema(intensity: Array) -> list[tuple[int, int, bool]]:
    """First and last sample of every extremum, and whether it is a maximum."""
    steps = np.diff(intensity)
    steps = np.sign(np.where(np.abs(steps) < ROUNDING * intensity[1:], 0, steps))
    moving = np.nonzero(steps)[0]
    turns = np.nonzero(np.diff(steps[moving]))[0]
    return [
        (int(moving[turn]) + 1, int(moving[turn + 1]), bool(steps[moving[turn]] > 0))
        for turn in turns
    ]


def _crossing(values: Array, first: int, last: int, stop: int) -> int | None:
    """Sample from which on the sign must change for the values to be smooth, if it must.

    Values before the extremum carry their sign already; `stop` ends what follows it.  An extremum
    so flat that rounding makes it a plateau is seen from farther away.
    """
    stride = max((last - first + 1) // 3, 1)
    low, high = max(first - BEFORE * stride, 0), min(stop, last + 1 + AFTER * stride)
    window = np.arange(low, high, stride)
    best, lowest = None, _roughness(values[window])
    for crossing in range(first, last + 2, stride):
        roughness = _roughness(np.where(window < crossing, 1, -1) * values[window])
        if roughness < lowest:
            best, lowest = crossing, roughness
    return best


def _roughness(values: Array) -> float:
    """Sum of squares that a polynomial leaves of evenly spaced samples."""
    degree = min(DEGREE, len(values) - 2)
    if degree < 1:
        return 0.0
    basis = np.linalg.qr(legvander(np.linspace(-1, 1, len(values)), degree))[0]
    left = values - basis @ (basis.T @ values)
    return float(left @ left)
