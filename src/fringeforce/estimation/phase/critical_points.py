"""Critical points of a noise-free intensity and their classes, Section IV of the paper.

At a critical point of I = sin^2(p/2) the phase either crosses a multiple of pi (class 1 at I = 1,
class 2 at I = 0) or turns (class 3).  Derivatives of I tell these apart in principle: where the
phase meets a multiple of pi as (x - x0)^r the first that does not vanish has order 2r, with r odd
where it crosses and even where it only touches.  Samples tell it better through the phase itself,
which is smooth: 2 arcsin sqrt(I) and 2 arcsin sqrt(1 - I) are its distance from a multiple of pi,
which changes sign at a crossing and not at a touch, so the signs are those that make it smoothest.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flips = tuple[int, ...]

LOST = 1e-7
"""Distance from a multiple of pi below which rounding of the intensity hides the phase [rad]."""
ROUNDING = 4e-16
"""Rounding of an intensity, as the product of a distance and its error [rad^2]."""
DIFFERENCE_ORDER = 6
"""Order of the difference that measures how smooth a phase is."""
FLAT_ORDER = 10
"""The same where it meets a multiple of pi so flatly that rounding hides several samples."""
LARGEST_STEP = 1.0
"""Step of the phase from sample to sample that is not thought possible [rad]."""
BEAM = 8
"""Ways to set the signs that are kept where critical points crowd."""


@dataclass(frozen=True)
class CriticalPoint:
    """A critical point of the intensity.

    Attributes
    ----------
    index : int
        First sample beyond the critical point.
    kind : int
        Class 1 (bright, the phase crosses), 2 (dark, the phase crosses) or 3 (the phase turns).
    """

    index: int
    kind: int


@dataclass(frozen=True)
class _Approach:
    """Samples `first` to `last` where the phase comes nearest to a multiple of pi.

    Each choice lists the steps (sample before each) where the phase would cross; `stride` is how
    far apart samples must be taken for rounding not to hide the phase of more than two or three.
    """

    first: int
    last: int
    stride: int
    choices: tuple[Flips, ...]


def critical_points(intensity: Array) -> list[CriticalPoint]:
    """Find and classify the critical points of a noise-free intensity.

    Parameters
    ----------
    intensity : ndarray, shape (P,)
        Normalised intensity sin^2(p/2), 0 to 1, evenly spaced, rounded as float64 is.

    Returns
    -------
    list of CriticalPoint
        In the order of the samples.  A point where the phase only touches a multiple of pi is of
        class 3, whatever its order.

    Notes
    -----
    Resolution ends in three places.  A phase that passes a multiple of pi and turns back between
    two samples cannot be told from one that turns just before it; the latter is taken, and only
    more samples would tell.  A phase that turns within 1e-7 rad of a multiple of pi is taken as
    touching it, because float64 holds no more of the intensity there.  And a crossing within such
    a distance of the first or last sample is not seen.  Twenty samples to a fringe (steps of
    0.3 rad) are enough for a phase that bends smoothly from sample to sample; a kink of size e
    hides turns and crossings that stay within about e of a multiple of pi.  Touches and crossings
    are told apart up to order r = 6; flatter ones look alike as far as rounding lets them be seen.
    """
    crossings = _crossings(intensity)
    crossed = np.zeros(len(intensity) - 1, dtype=bool)
    crossed[crossings] = True
    steps = _signed(*_steps(intensity), crossed)
    distance, bright = _distance(intensity)
    rounding = _rounding(distance)
    sure = np.abs(steps) > 2 * (rounding[1:] + rounding[:-1])
    moving = np.nonzero((sure | crossed) & (steps != 0))[0]
    found = [CriticalPoint(step + 1, 1 if bright[step] else 2) for step in crossings]
    rising = steps[moving] > 0
    found += [CriticalPoint(int(moving[turn]), 3) for turn in np.nonzero(np.diff(rising))[0] + 1]
    # a turn right after a crossing shares its sample
    return sorted(found, key=lambda point: (point.index, point.kind))


def _distance(intensity: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Distance of the phase from the nearest multiple of pi [rad], and whether that is odd."""
    bright = intensity > 0.5
    rest = np.where(bright, 1 - intensity, intensity)
    return 2 * np.arcsin(np.sqrt(rest)), bright


def _steps(intensity: Array) -> tuple[Array, Array]:
    """Steps of the phase from sample to sample as it starts, without and with a crossing [rad].

    Both have shape (P - 1,), and one sign throughout: that of a phase that leaves dark points
    upwards, so every crossing turns all later steps around.
    """
    distance, bright = _distance(intensity)
    slope = np.where(bright, -1.0, 1.0)
    along = np.diff(slope * distance) + np.pi * np.diff(bright.astype(float))
    return along, -slope[:-1] * (distance[:-1] + distance[1:])


def _signed(along: Array, across: Array, crossed: NDArray[np.bool_]) -> Array:
    """Steps of the phase, but for a common sign, where it crosses in some of them [rad]."""
    behind = np.cumsum(crossed, axis=-1) - crossed
    return np.where(behind % 2, -1.0, 1.0) * np.where(crossed, across, along)


def _rounding(distance: Array) -> Array:
    """Error of a distance from a multiple of pi by rounding of the intensity [rad]."""
    return ROUNDING / np.maximum(distance, np.sqrt(ROUNDING))


def _crossings(intensity: Array) -> list[int]:
    """Samples before each crossing of a multiple of pi."""
    clusters = _clusters(_approaches(intensity))
    return [flip for cluster in clusters for flip in _smoothest(intensity, cluster)]


def _approaches(intensity: Array) -> list[_Approach]:
    """Where the phase may cross a multiple of pi: the least distances from one."""
    distance, _ = _distance(intensity)
    seen = np.where(distance < LOST, 0.0, distance)
    starts = np.concatenate(([0], np.nonzero(np.diff(seen))[0] + 1))
    values = np.concatenate(([np.inf], seen[starts], [np.inf]))
    ends = np.concatenate((starts[1:], [len(seen)])) - 1
    found = []
    for run in np.nonzero((values[1:-1] < values[:-2]) & (values[1:-1] < values[2:]))[0]:
        first, last = int(starts[run]), int(ends[run])
        length = last - first + 1
        lost = seen[first] == 0
        if lost and (first == 0 or last == len(seen) - 1):
            continue
        blurred = lost and length > 1
        gaps = {first - 1, (first + last) // 2, last}
        # beyond for two samples only, a phase has its other crossing two steps farther off
        gaps |= set() if blurred else {first - 3, first - 2, last + 1, last + 2}
        possible = sorted(
            gap
            for gap in gaps
            if 0 <= gap < len(seen) - 1 and seen[gap] + seen[gap + 1] < LARGEST_STEP
        )
        if possible:
            sizes = range(2 if blurred else 4)
            choices = [flips for size in sizes for flips in combinations(possible, size)]
            stride = max(2, (length + 1) // 2) if blurred else 1
            found.append(_Approach(first, last, stride, tuple(choices)))
    return found


def _reach(stride: int) -> int:
    """Samples on either side that tell how smooth a phase is."""
    return stride * (DIFFERENCE_ORDER if stride == 1 else FLAT_ORDER)


def _clusters(approaches: list[_Approach]) -> list[list[_Approach]]:
    """Groups of approaches so close that they can only be judged together."""
    groups: list[list[_Approach]] = []
    for approach in approaches:
        before = groups[-1][-1] if groups else None
        if before and approach.first - before.last <= _reach(max(before.stride, approach.stride)):
            groups[-1].append(approach)
        else:
            groups.append([approach])
    return groups


def _smoothest(intensity: Array, cluster: list[_Approach]) -> Flips:
    """Crossings of a cluster that make the phase smoothest, and no more than it takes."""
    stride = max(approach.stride for approach in cluster)
    reach = _reach(stride)
    low = max(cluster[0].first - reach, 0)
    ends = [approach.first for approach in cluster[1:]]
    ends.append(min(cluster[-1].last + reach + 1, len(intensity)))
    kept: list[Flips] = [()]
    for approach, end in zip(cluster, ends, strict=True):
        tried = [
            flips + choice
            for flips in kept
            for choice in approach.choices
            if not (flips and choice and choice[0] <= flips[-1])
        ]
        crossed = np.zeros((len(tried), end - low - 1), dtype=bool)
        for row, flips in zip(crossed, tried, strict=True):
            row[[flip - low for flip in flips if flip < end - 1]] = True
        costs = _roughness(intensity[low:end], crossed, stride)
        kept = [tried[rank] for rank in np.argsort(costs, kind="stable")[:BEAM]]
    return kept[0]


def _roughness(light: Array, crossed: NDArray[np.bool_], stride: int) -> Array:
    """Sum of squared differences of the phase for every row of crossings, with a price on each."""
    if len(light) <= 2 * stride:
        stride = max((len(light) - 1) // 2, 1)
    order = min(_reach(stride), len(light) - 1) // stride
    weights = np.array([(-1) ** term * comb(order, term) for term in range(order + 1)])
    steps = _signed(*_steps(light), crossed)
    phase = np.concatenate((np.zeros((len(crossed), 1)), np.cumsum(steps, axis=-1)), axis=-1)
    width = len(light) - order * stride
    rough = np.zeros((len(crossed), width))
    for term, weight in enumerate(weights):
        rough += weight * phase[:, term * stride : term * stride + width]
    # what rounding alone may add to a sum of squares, so that fewer crossings win a tie
    error = _rounding(_distance(light)[0]).max()
    price = float(np.sum(weights**2)) * error**2
    return np.sum(rough**2, axis=-1) + price * crossed.sum(axis=-1)
