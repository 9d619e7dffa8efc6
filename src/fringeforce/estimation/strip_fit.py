"""Climb to the top of a frame's likelihood from anywhere near it, in single precision.

The method of `levenberg_marquardt` in compiled loops, ten times as fast and exact to a hundredth of
what noise does: for the many starts of a search, of which few are right.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import entry, inner
from fringeforce.estimation.evaluation import compare, evaluate, load_frame, workspace_for
from fringeforce.estimation.information import fill_information
from fringeforce.estimation.levenberg_marquardt import FACTOR, FIRST, STRONGEST
from fringeforce.estimation.strip import Strip
from fringeforce.estimation.vector_loops import Single, combine, copy, factorise, solve, square_sum

Array = NDArray[np.float64]

_ZERO = np.float32(0)


@dataclass(frozen=True, eq=False)
class Optimum:
    """Loads at, or nearly at, a top of the likelihood.

    Attributes
    ----------
    loads : ndarray, shape (m,)
        The loads [N].
    phase : ndarray, shape (nodes,)
        Phase that they cause at the nodes; see `node_phase` [rad].
    loss : float
        Twice the negative logarithm of the likelihood, less a constant.
    """

    loads: Array
    phase: Single
    loss: float


def climb(strip: Strip, frame: NDArray[Any], start: Array, steps: int, tolerance: float) -> Optimum:
    """Climb from loads that are nearly right.

    Parameters
    ----------
    strip : Strip
        The pixels.
    frame : ndarray, shape (P,)
        Grey levels, finite.
    start : ndarray, shape (m,)
        Loads to start from [N].
    steps : int
        Largest number of steps.
    tolerance : float
        Gain of twice the log-likelihood below which a step is the last.
    """
    loads = np.array(start, dtype=float)
    loss = _climb(strip.arrays, frame, loads, steps, tolerance)
    return Optimum(loads, node_phase(strip, loads), loss)


def node_phase(strip: Strip, loads: Array) -> Single:
    """Phase that loads cause at the nodes of the information [rad].

    The phase bends so little between them that two explanations are told apart there as well as
    at all pixels.  Where no pixel is used it is zero.
    """
    phase = np.empty_like(strip.watched)
    _node_phase(strip.nodes, loads, strip.watched, phase)
    return phase


@entry
def _node_phase(nodes, loads, watched, phase) -> None:
    short = np.zeros(len(nodes), np.float32)
    copy(loads, short)
    combine(nodes, short, np.zeros_like(watched), phase)
    phase *= watched


class Phases:
    """Phases of explanations so far, to tell whether another is new.

    Parameters
    ----------
    even : bool
        Whether a phase and its negative are one.
    size : int
        Nodes of a phase.
    """

    def __init__(self, even: bool, size: int) -> None:
        self._even, self._count = even, 0
        self._kept = np.empty((32, size), dtype=np.float32)

    def __len__(self) -> int:
        return self._count

    def add(self, phase: Single) -> None:
        """Remember one more."""
        self._make_workspace(1)
        self._kept[self._count] = phase
        self._count += 1

    def admit(self, strip: Strip, loads: Array, apart: float) -> NDArray[np.int64]:
        """Remember phases under several loads, shape (k, m), that are new; returns of which."""
        self._make_workspace(len(loads))
        known = self._kept, self._count, np.float32(apart), self._even
        fresh = _admit(strip.nodes, strip.watched, loads, *known)
        self._count += len(fresh)
        return fresh

    def _make_workspace(self, count: int) -> None:
        while len(self._kept) < self._count + count:
            self._kept = np.concatenate([self._kept, np.empty_like(self._kept)])

    def know(self, phase: Single, apart: float) -> bool:
        """Whether one of them lies nowhere farther from a phase than so much [rad]."""
        return _known(self._kept[: self._count], phase, np.float32(apart), self._even)

    def distance(self, phase: Single) -> float:
        """Largest distance from the nearest of them, infinite if there are none [rad]."""
        return float(_distance(self._kept[: self._count], phase, self._even))


@entry
def _known(others, phase, apart, even) -> bool:
    for other in others:
        plain, mirrored = np.int32(0), np.int32(not even)
        for k in range(len(phase)):
            plain += np.int32(abs(phase[k] - other[k]) >= apart)
            mirrored += np.int32(abs(phase[k] + other[k]) >= apart)
        if plain == 0 or mirrored == 0:
            return True
    return False


@entry
def _admit(nodes, watched, loads, kept, count, apart, even):
    fresh, found = np.empty(len(loads), np.int64), 0
    for i in range(len(loads)):
        place = count + found
        _node_phase(nodes, loads[i], watched, kept[place])
        if not _known(kept[:place], kept[place], apart, even):
            fresh[found] = i
            found += 1
    return fresh[:found]


@entry
def _distance(others, phase, even):
    nearest = np.inf
    for other in others:
        plain, mirrored = _ZERO, _ZERO
        for k in range(len(phase)):
            plain = max(plain, abs(phase[k] - other[k]))
            mirrored = max(mirrored, abs(phase[k] + other[k]))
        nearest = min(nearest, min(plain, mirrored) if even else plain)
    return nearest


@entry
def _climb(strip, frame, loads, steps, tolerance) -> float:
    """Move loads to the top; returns their loss."""
    rows, size = len(strip.nodes), strip.loads
    work, phase = workspace_for(strip), np.empty_like(strip.inverse)
    gradient = work.gradient
    load_frame(strip, frame, work)
    slope, level = np.empty_like(phase), np.empty_like(phase)
    information, factor = np.empty((rows, rows)), np.empty((rows, rows))
    step, start, downhill = np.empty(size), np.empty(size), np.empty(rows)
    evaluate(strip, loads, phase, slope, level)
    loss = _loss(strip, slope, level, work)
    damping = FIRST
    for _ in range(steps):
        fill_information(strip.nodes, strip.shares, (slope * work.root) ** 2, information)
        _factorise(information, size, 1e-6, factor)
        solve(factor, size, gradient, step)
        if np.dot(step, gradient[:size]) < tolerance / 10:
            break
        before = loss
        copy(loads, start)
        copy(gradient, downhill)
        while True:
            _factorise(information, size, damping, factor)
            solve(factor, size, downhill, step)
            copy(start - step, loads)
            evaluate(strip, loads, phase, slope, level)
            loss = _loss(strip, slope, level, work)
            if loss <= before or damping > STRONGEST:
                break
            damping = max(FACTOR * damping, FIRST)
        if loss > before:
            copy(start, loads)
            loss = before
            break
        damping /= FACTOR
        if before - loss < tolerance:
            break
    return loss


@inner
def _loss(strip, slope, level, work) -> float:
    """Twice the negative logarithm of the likelihood, less a constant; see `compare`."""
    return compare(strip, slope, level, work) + float(square_sum(work.left))


@inner
def _factorise(information, size, damping, factor) -> None:
    """Cholesky factor of H + lambda diag H."""
    trace = 0.0
    for j in range(size):
        trace += information[j, j]
    for j in range(size):
        copy(information[j], factor[j])
    for j in range(size):
        factor[j, j] += damping * information[j, j]
    factorise(factor, size, 1e-12 * trace + 1e-12)
