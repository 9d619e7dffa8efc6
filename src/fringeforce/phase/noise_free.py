"""The phase from a noise-free intensity, equation (12) of the paper."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.errors import InputError
from fringeforce.phase.critical_points import critical_points

Array = NDArray[np.float64]
Indices = tuple[int, int, int]

SHORTEST = 8
"""Samples below which nothing can be classified."""
TOLERANCE = 1e-9
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
        Indices m, n, k at the edge where the scan starts, see `start_indices`; m = n = 0 if not
        given, which holds for an edge phase in [-pi, 0].
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
        If the intensity cannot be one, or the scan cannot start at its edge.

    Notes
    -----
    A frame tells neither the phase's sign nor a multiple of 2 pi: both come with the start.
    """
    if direction not in ("forward", "backward"):
        raise InputError(f"direction = {direction!r}: must be 'forward' or 'backward'.")
    light = _checked(intensity)
    if start is None:
        _check_edge(edge_phase, direction)
    if direction == "backward":
        light = light[::-1]
    fold = 2 * np.arcsin(np.sqrt(light))
    m, n, k = start if start is not None else (0, 0, _first_turns(light))
    phase, done = np.empty_like(fold), 0
    for point in critical_points(light):
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
        Phase at the edge [rad].
    rising : bool
        Whether the phase grows along the scan.

    Raises
    ------
    InputError
        If the phase is not finite.
    """
    if not np.isfinite(edge_phase):
        raise InputError(f"edge_phase = {edge_phase}: must be a finite number of radians.")
    m = -round(edge_phase / (2 * np.pi))
    rest = edge_phase + 2 * np.pi * m
    n = m if rest < 0 or (rest == 0 and not rising) else m + 1
    return m, n % 2, int(rising)


def _branch(fold: Array, m: int, n: int) -> Array:
    """Equation (12)."""
    return -2 * np.pi * m - (-1) ** (m + n) * fold


def _first_turns(light: Array) -> int:
    """Index k at an edge phase in [-pi, 0]: the phase falls where the intensity rises."""
    steps = np.diff(light)
    moving = np.nonzero(steps)[0]
    return int(len(moving) > 0 and steps[moving[0]] < 0)


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
            "offset and divide by the amplitude, and use SensorModel.read for noisy frames."
        )
    return np.clip(light, 0, 1)
