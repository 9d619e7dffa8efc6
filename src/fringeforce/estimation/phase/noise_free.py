"""The phase from a noise-free intensity, equation (12) of the paper.

The intensity is even in the phase and blind to multiples of 2 pi, so both come with the start: the
indices m, n, k at the edge where the scan begins.  The paper starts with zeros, which hold for an
edge phase in [-pi, 0]: always for free edges, whose phase is zero, and not for held ones.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import InputError
from fringeforce.estimation.phase.critical_points import LOST, CriticalPoint, critical_points

Array = NDArray[np.float64]
Indices = tuple[int, int, int]

SHORTEST = 8
"""Samples below which nothing can be classified."""
TOLERANCE = 1e-12
"""How far beyond 0 and 1 an intensity may lie by rounding."""


def recover_phase(
    intensity: ArrayLike,
    start: Indices | None = None,
    direction: Literal["forward", "backward"] = "forward",
    edge_phase: float | None = None,
) -> Array:
    """Recover the phase from a noise-free intensity, sample by sample.

    p = -2 pi m - (-1)^(m + n) 2 arcsin sqrt(I), with m <- m + (-1)^k where the phase crosses an odd
    multiple of pi, n <- n + 1 where it crosses an even one, and k <- k + 1 where it turns.

    Parameters
    ----------
    intensity : array_like, shape (P,)
        Normalised intensity I = sin^2(p/2) without noise, evenly spaced.
    start : (int, int, int), optional
        Indices m, n, k at the edge where the scan starts, see `start_indices`.  If not given,
        m = n = 0, which holds for an edge phase in [-pi, 0], and k = 0 or 1 as the intensity
        grows or falls there.
    direction : "forward" or "backward"
        Scan from the first sample to the last, or from the last to the first.
    edge_phase : float, optional
        Phase at the edge where the scan starts, if known [rad]; without `start` it must lie in
        [-pi, 0].

    Returns
    -------
    ndarray, shape (P,)
        Phase [rad].

    Raises
    ------
    InputError
        If the intensity cannot be one, if the scan cannot start at its edge, or if the start says
        that the phase rises where the intensity says that it falls, or the reverse.

    Notes
    -----
    Exact but for rounding, which is about 4e-16 rad over the distance from the nearest multiple of
    pi, as long as the samples tell crossings from turns: `critical_points` says when they do not,
    as where a phase turns very near a multiple of pi between two samples.

    Examples
    --------
    >>> phase = -5 * np.exp(-(np.linspace(-3, 3, 1001) ** 2))
    >>> bool(np.allclose(ff.recover_phase(np.sin(phase / 2) ** 2), phase))
    True
    """
    if direction not in ("forward", "backward"):
        raise InputError(f"direction = {direction!r}: must be 'forward' or 'backward'.")
    light = _checked(intensity)
    if start is None:
        _check_edge(edge_phase, direction)
    if direction == "backward":
        light = light[::-1]
    fold = 2 * np.arcsin(np.sqrt(light))
    points = critical_points(light)
    m, n, k = (0, 0, None) if start is None else start
    k = _first_turns(light, points, m, n, k)
    phase, done = np.empty_like(fold), 0
    for point in points:
        phase[done : point.index] = _branch(fold[done : point.index], m, n)
        done = point.index
        if point.kind == 1:
            m += (-1) ** k
        elif point.kind == 2:
            n += 1
        else:
            k += 1
    phase[done:] = _branch(fold[done:], m, n)
    return phase[::-1] if direction == "backward" else phase


def start_indices(edge_phase: float, rising: bool = False) -> Indices:
    """Indices m, n, k for a scan that starts at a known phase.

    Parameters
    ----------
    edge_phase : float
        Phase at the edge where the scan starts [rad].
    rising : bool
        Whether the phase grows along the scan from there, which for a backward scan is towards
        lower x.

    Returns
    -------
    (int, int, int)
        m, n, k of equation (12); n and k are 0 or 1.

    Raises
    ------
    InputError
        If the phase is not finite.
    """
    if not np.isfinite(edge_phase):
        raise InputError(f"edge_phase = {edge_phase}: must be a finite number of radians.")
    half_turns = round(edge_phase / np.pi)
    rest = edge_phase - np.pi * half_turns
    # at a multiple of pi it is the slope that says which side the phase goes to
    above = rising if abs(rest) < LOST else rest > 0
    interval = half_turns if above else half_turns - 1  # from pi interval to pi (interval + 1)
    m = -((interval + 1) // 2)
    # even intervals lie above -2 pi m, where (12) needs m + n odd, and odd ones below it
    n = (m + interval + 1) % 2
    return m, n, int(rising)


def _branch(fold: Array, m: int, n: int) -> Array:
    """Equation (12)."""
    return -2 * np.pi * m - (-1) ** (m + n) * fold


def _first_turns(
    light: Array, points: list[CriticalPoint], m: int, n: int, given: int | None
) -> int:
    """Index k at the start: even where the phase falls, as branch and intensity tell.

    Where the intensity hardly moves from the first sample to the second, a given index that differs
    may come from the edge's rounding and is no contradiction.
    """
    if points and points[0].kind != 3:
        growing = points[0].kind == 1
    else:
        change = light[points[0].index if points else -1] - light[0]
        if change == 0:
            return given or 0
        growing = bool(change > 0)
    rising = growing == ((m + n) % 2 == 1)
    clear = abs(light[1] - light[0]) > 1e-12
    if given is not None and clear and given % 2 != rising:
        raise InputError(
            f"k = {given} says that the phase {'rises' if given % 2 else 'falls'} at the start of "
            f"the scan; with m = {m} and n = {n} the intensity says that it "
            f"{'rises' if rising else 'falls'}. Take m, n, k from "
            "start_indices(edge_phase, rising=...), with the slope along the scan."
        )
    return int(rising)


def _check_edge(edge_phase: float | None, direction: str) -> None:
    if edge_phase is None or -np.pi <= edge_phase <= 0:
        return
    edge, other = ("left", "backward") if direction == "forward" else ("right", "forward")
    raise InputError(
        f"The phase at the {edge} edge is {edge_phase:.4g} rad, outside [-pi, 0], where the "
        "indices m = n = 0 hold. Edges that are held carry stress, so a large load takes their "
        f"phase out of that interval; scan {other} if the other edge is within it, or give "
        f"start=start_indices({edge_phase:.4g}, rising=...)."
    )


def _checked(intensity: ArrayLike) -> Array:
    light = np.asarray(intensity, dtype=float)
    if light.ndim != 1 or len(light) < SHORTEST:
        raise InputError(
            f"An intensity of shape {light.shape} is no line of fringes; give at least {SHORTEST} "
            "samples along one axis."
        )
    outside = ~((light >= -TOLERANCE) & (light <= 1 + TOLERANCE))
    if outside.any():
        where = int(np.argmax(outside))
        raise InputError(
            f"Intensity {light[where]:g} at sample {where} is not between 0 and 1; subtract the "
            "offset and divide by the amplitude, and use Reader for noisy frames."
        )
    return np.clip(light, 0, 1)
