"""What a noisy frame says of the phase before any model: how fast it runs, and where it may be.

Intensity folds the phase: I = sin^2(p/2) is met by p = +-w + 2 pi q with w = 2 arcsin sqrt(I).
Folding keeps the pace, |dw/dx| = |dp/dx|, so the pace is known everywhere and the phase up to a
sign and a multiple.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d

Array = NDArray[np.float64]

WINDOW = 32
"""Pixels over which the local pace is averaged."""
MODEL_ERROR = 0.02
"""Standard deviation of a block's phase beyond its noise, for taking it as linear [rad]."""


@dataclass(frozen=True, eq=False)
class Fringes:
    """A line of fringes, sin^2((p + bias) / 2) of a phase p that is linear in the loads.

    Attributes
    ----------
    intensity : ndarray, shape (P,)
        Normalised intensity along the strip, noise included.
    variance : float
        Of the noise of one pixel, in the same unit.
    influence : ndarray, shape (P, m)
        Phase per unit load at every pixel.
    bias : float
        Phase added to that of the loads [rad].
    seen : ndarray of bool, shape (P,), optional
        Pixels that saw the intensity; the others bridge a gap between them.  All if not given.
    """

    intensity: Array
    variance: float
    influence: Array
    bias: float = 0.0
    seen: NDArray[np.bool_] | None = None

    @property
    def unbiased(self) -> Fringes:
        """The same, bias from -pi/2 to pi/2: a bright field is a dark one upside down."""
        turns = np.rint(self.bias / np.pi)
        upright = self.intensity if turns % 2 == 0 else 1 - self.intensity
        return replace(self, intensity=upright, bias=self.bias - np.pi * turns)

    @property
    def steps(self) -> NDArray[np.bool_]:
        """From which pixels to the next the phase can be seen to run, shape (P - 1,)."""
        seen = np.ones(len(self.intensity), dtype=bool) if self.seen is None else self.seen
        return seen[:-1] & seen[1:]


@dataclass(frozen=True, eq=False)
class FoldedPhase:
    """Phases that blocks of pixels allow: +-fold + 2 pi q.

    Attributes
    ----------
    fold : ndarray, shape (b,)
        Folded phase w of every block, 0 to pi [rad].
    variance : ndarray, shape (b,)
        Of the phase [rad^2]; infinite where no pixel saw it.
    single : ndarray of bool, shape (b,)
        Where +w and -w cannot be told apart and their middle, 0 or pi, stands for both.
    bias : ndarray, shape (b,)
        Phase among it that no load causes [rad].
    influence : ndarray, shape (b, m)
        Influence matrix of the blocks [rad per unit load].
    """

    fold: Array
    variance: Array
    single: NDArray[np.bool_]
    bias: Array
    influence: Array


def phase_pace(intensity: Array, variance: float) -> Array:
    """Local pace of the phase from the mean square step of the intensity.

    For a phase that runs evenly by k per pixel the mean square step of sin^2(p/2) is
    (1 - cos k) / 4, plus twice the noise's variance.

    Parameters
    ----------
    intensity : ndarray, shape (P,)
        Normalised intensity, noise included.
    variance : float
        Of the noise of one pixel.

    Returns
    -------
    ndarray, shape (P,)
        Magnitude of the phase's step from pixel to pixel, 0 to pi [rad].
    """
    window = min(WINDOW, len(intensity) - 1)
    steps = np.diff(intensity) ** 2
    before = window // 2
    padded = np.pad(steps, (before, window - before), mode="edge")
    mean = np.convolve(padded, np.full(window, 1 / window), mode="valid")[: len(intensity)]
    return np.arccos(np.clip(1 - 4 * np.maximum(mean - 2 * variance, 0), -1, 1))


def block_edges(pace: Array, extent: float, largest: int = 8) -> NDArray[np.intp]:
    """Cut a frame into blocks that are long where the phase is slow and short where it runs.

    Parameters
    ----------
    pace : ndarray, shape (P,)
        Local pace of the phase [rad per pixel].
    extent : float
        Phase that a block may span [rad].
    largest : int
        Pixels that a block may span.

    Returns
    -------
    ndarray of int, shape (b + 1,)
        Boundaries of the blocks, from 0 to P.
    """
    length = np.clip(extent / np.maximum(pace, 1e-9), 1, largest).astype(np.intp)
    # no block is longer than any pixel within its reach allows
    allowed = minimum_filter1d(length, largest, origin=-(largest // 2), mode="nearest").tolist()
    edges = [0]
    while edges[-1] < len(pace):
        edges.append(edges[-1] + int(allowed[edges[-1]]))
    edges[-1] = len(pace)
    return np.array(edges)


def folded_phase(fringes: Fringes, edges: NDArray[np.intp]) -> FoldedPhase:
    """Fold the phase of every block of pixels, with a variance from its own intensity.

    The slope of intensity over phase is sqrt(I (1 - I)); where it vanishes, the noise itself limits
    how far the phase can be from the turning point.

    Parameters
    ----------
    fringes : Fringes
        A line of fringes.
    edges : ndarray of int, shape (b + 1,)
        Boundaries of the blocks.
    """
    line = fringes.unbiased
    seen = np.ones(len(line.intensity)) if line.seen is None else line.seen.astype(float)
    count = np.add.reduceat(seen, edges[:-1])
    size = np.maximum(count, 1)
    mean = np.clip(np.add.reduceat(seen * line.intensity, edges[:-1]) / size, 0, 1)
    noise = line.variance / size
    fold = 2 * np.arcsin(np.sqrt(mean))
    spread = noise / (mean * (1 - mean) + np.sqrt(noise) / 2) + MODEL_ERROR**2
    dark, bright = fold, np.pi - fold
    distance = np.minimum(dark, bright)
    single = 2 * distance < 1.5 * np.sqrt(spread)
    return FoldedPhase(
        fold=np.where(single, np.where(dark < bright, 0.0, np.pi), fold),
        variance=np.where(count > 0, np.where(single, spread + distance**2, spread), np.inf),
        single=single,
        bias=np.full(len(size), line.bias),
        influence=np.add.reduceat(seen[:, None] * line.influence, edges[:-1]) / size[:, None],
    )


def interleaved(channels: Sequence[FoldedPhase]) -> FoldedPhase:
    """Folded phases of several channels as one row, block by block, where pixels saw them."""
    stacked = {
        field.name: np.stack([getattr(channel, field.name) for channel in channels], axis=1)
        for field in fields(FoldedPhase)
    }
    known = np.isfinite(stacked["variance"])
    return FoldedPhase(**{key: values[known] for key, values in stacked.items()})
