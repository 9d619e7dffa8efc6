"""Explanations of a strip's frame that were met: which have weight, and which are one reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from fringeforce.estimation.frame_climb import CONVERGED
from fringeforce.estimation.hypotheses import (
    NEGLIGIBLE_LOSS,
    SAME_PHASE,
    mixture,
    posterior_weights,
)
from fringeforce.estimation.linearised_frame import Linearised
from fringeforce.estimation.posterior import Posterior, Top
from fringeforce.estimation.residual_test import FALSE_VERDICT, GROUP, square_limit
from fringeforce.reading.frame_reader import FOLLOWING_STEPS
from fringeforce.reading.posterior_search import BINS
from fringeforce.reading.strip_frames import HOPELESS_LOSS, MISSED
from fringeforce.reading.tactel_aliases import TactelAlias

Array = NDArray[np.float64]

FAINT_SHARE = 0.1
"""Share of the largest phase below which two phases are alike, where that is less than
`SAME_PHASE`: the light of a faint touch hardly tells a phase from its mirror image, which is near.
"""
SPARE = 2.0
"""How many times as much loss an explanation may leave as one without weight: few contacts
outweigh many that leave less."""
COUNTED = 1e-6
"""Posterior weight from which an explanation counts: a thousandth of what a sure reading may lack,
so that hundreds of those left out change nothing."""
MOST_TOLD = float(-2 * np.log(1e-4))
"""Most loss that earlier frames add to an explanation: one that they speak for is wrong once in ten
thousand for reasons that no frame shows."""
WIDEST = 2.0
"""How many times as wide a covariance may become, in any direction, to hold another explanation:
deviations that are twice as large there tell more than an ambiguous reading."""


@dataclass(frozen=True, eq=False)
class Weighed:
    """An explanation of a frame and its posterior weight.

    Attributes
    ----------
    top : Top
        The estimate.
    covariance : ndarray, shape (2n, 2n)
        Of its loads [N^2].
    phase : ndarray, shape (m,)
        At the nodes [rad].
    weight : float
        Share of the posterior.
    """

    top: Top
    covariance: Array
    phase: Array
    weight: float


class Explanations:
    """Explanations of one frame that were met, the best first.

    `rough` are those of the frame in bins; `explained` is whether any of them explains it.
    `elsewhere` are others of weight, with posteriors that are exact where they are.
    """

    def __init__(self, posterior: Posterior, tops: list[Top] | None = None) -> None:
        self.posterior, self.rough, self.explained = posterior, list[Top](), False
        self.tops = sorted(tops or [], key=lambda one: one.loss)
        self.elsewhere = list[tuple[Posterior, Top]]()
        self._chances = dict[int, float]()
        self._nears, self._settled = dict[int, Array](), list[Top]()

    @property
    def best(self) -> list[Array]:
        """Unknowns of the best one, whether it explains the frame or not; none if none was met."""
        return [top.unknowns for top in (self.tops[:1] or self.rough[:1])]

    @property
    def promising(self) -> bool:
        """Whether the best one explains the frame, or nearly so."""
        return self.explained or any(
            rough.loss < HOPELESS_LOSS * len(self.posterior.frame) / BINS
            for rough in self.rough[:1]
        )

    @property
    def loss(self) -> float:
        """Loss of the best one in bins."""
        return self.rough[0].loss if self.rough else np.inf

    def chance(self, top: Top) -> float:
        """Chance that noise leaves as large waves of phase."""
        if id(top) not in self._chances:
            self._chances[id(top)] = self.posterior.waves_chance(top)
        return self._chances[id(top)]

    def keep(self, rough: Top) -> None:
        """Keep an explanation of the frame in bins, to settle it if it may have weight."""
        self.rough.append(rough)
        self.rough.sort(key=lambda one: one.loss)

    def tried(self, rough: Top) -> bool:
        """Keep an explanation of the frame in bins; whether it explains the frame plainly."""
        self.keep(rough)
        if rough is not self.rough[0] or rough.loss > (1 + BINS) * rough.count:
            return False
        return self.explains(self._settle(rough), MISSED)

    def _settle(self, rough: Top) -> Top:
        self._settled.append(rough)
        top = self.posterior.settled(rough.unknowns, tolerance=0.03)
        self.add(top)
        return top

    def settle(self) -> None:
        """Add all explanations that may have weight."""
        for rough in self.rough:
            if rough.loss > self.rough[0].loss + SPARE * NEGLIGIBLE_LOSS:
                break
            if not self.tops:
                self._settle(rough)
                continue
            best = self.posterior.linearised(self.tops[0])
            if not any(_same(rough, known, best) for known in self._settled):
                self._settle(rough)

    def near(self, top: Top) -> Array:
        """Standard deviations of all unknowns about an explanation, shape (size,)."""
        if id(top) not in self._nears:
            self._nears[id(top)] = np.sqrt(
                np.diag(np.linalg.inv(self.posterior.linearised(top).hessian))
            )
        return self._nears[id(top)]

    def add(self, top: Top) -> None:
        """Keep an explanation of the frame."""
        self.tops.append(top)
        self.tops.sort(key=lambda one: one.loss)

    def relight(self) -> None:
        """Add what the best one leads to where the light is as far from it as may be."""
        posterior, best = self.posterior, self.tops[0]
        if (light := posterior.relit(best)) is None:
            return
        for start in light.ends:
            rough = posterior.settled(start, BINS)
            if not _same(rough, best, posterior.linearised(best)):
                self.add(posterior.settled(rough.unknowns))

    def explains(self, top: Top, chance: float) -> bool:
        """Whether an explanation leaves nothing but noise."""
        if top.chance < FALSE_VERDICT:
            return False
        return self.chance(top) > chance

    def weighed(self, earlier: Sequence[NDArray[Any]] = ()) -> list[Weighed]:
        """Explanations that count with their weights, the heaviest first.

        Parameters
        ----------
        earlier : sequence of ndarray, shape (P,)
            Grey levels of frames before this one, of the same pixels, the last one last.
        """
        found = list[tuple[Top, Linearised]]()
        posterior = self.posterior
        for top in self.tops:
            if top.loss > self.tops[0].loss + SPARE * NEGLIGIBLE_LOSS:
                break
            about = posterior.linearised(top)
            if not any(_same(top, other, about) for other, _ in found):
                found.append((top, about))
        each, masses = [(posterior, top) for top, _ in found] + self.elsewhere, np.zeros(1)
        if len(each) > 1:
            masses = np.array([own.mass(top) for own, top in each])
            own = slice(len(found))
            masses[own] -= told_before(posterior, [top for top, _ in found], earlier) / 2
        weighed = [
            Weighed(top, own.covariance(top), own.phase(top), float(share))
            for (own, top), share in zip(each, posterior_weights(masses), strict=True)
            if share >= COUNTED
        ]
        return sorted(weighed, key=lambda one: -one.weight)


def told_before(posterior: Posterior, tops: list[Top], earlier: Sequence[NDArray[Any]]) -> Array:
    """Loss by which earlier frames speak against explanations of a frame, shape (k,).

    They count as far back as all are alike but for noise, as frames of the same loads: the mean
    has less of it.  What climbs to the same explanation of the mean is told by one frame alone, and
    so are all if none explains the mean.  They do not speak for what this frame leaves no weight:
    that leads to another explanation of the mean.

    Parameters
    ----------
    posterior : Posterior
        Of the frame.
    tops : list of Top
        Explanations of it.
    earlier : sequence of ndarray, shape (P,)
        As of `Explanations.weighed`.
    """
    told, model = np.zeros(len(tops)), posterior.model
    frames = np.array([*earlier, posterior.frame], dtype=float)
    frames[:, ~np.isfinite(posterior.frame)] = np.nan
    while len(frames) > 1 and not alike(frames, model.variance):
        frames = frames[len(frames) // 2 :]
    if len(frames) == 1:
        return told
    quiet = model._replace(variance=model.variance / len(frames))
    mean = replace(posterior, model=quiet, frame=frames.mean(axis=0), sound=None, shared=None)
    met = [mean.climbed(top.unknowns, heats=(), steps=(0, FOLLOWING_STEPS)) for top in tops]
    about, best = mean.linearised(met[0]), min(met, key=lambda top: top.loss)
    if mean.waves_chance(best) < MISSED:
        return told
    for k in range(1, len(tops)):
        if not _same(met[k], met[0], about):
            told[k] = mean.data_loss(met[k]) - mean.data_loss(met[0])
            told[k] -= posterior.data_loss(tops[k]) - posterior.data_loss(tops[0])
    losses = np.array([top.loss for top in tops])
    with_weight = losses <= losses.min() + NEGLIGIBLE_LOSS
    return np.clip(told, np.where(with_weight, -MOST_TOLD, 0.0), MOST_TOLD)


def alike(frames: Array, variance: Array) -> bool:
    """Whether the first and the second half of some frames, shape (k, P), differ by noise alone.

    By sums over neighbouring pixels, which noise changes less than motion does.
    """
    half = len(frames) // 2
    change = frames[half:].mean(axis=0) - frames[:half].mean(axis=0)
    starts = np.arange(0, len(change), GROUP)
    noise = np.add.reduceat(np.isfinite(change) * variance, starts)
    sums, noise = np.add.reduceat(np.nan_to_num(change), starts)[noise > 0], noise[noise > 0]
    noise *= 1 / half + 1 / (len(frames) - half)
    return float((np.square(sums) / noise).sum()) < square_limit(len(sums), MISSED)


def _same(top: Top, other: Top, about: Linearised) -> bool:
    """Whether two tops are as near, in every unknown, as climbs end at one solution."""
    apart = top.unknowns - other.unknowns
    return float(apart @ about.hessian @ apart) < CONVERGED * len(apart)


def same_phase(phase: Array, other: Array) -> bool:
    """Whether two phases are of one explanation."""
    return bool(np.abs(phase - other).max() < alike_within(other))


def alike_within(phase: Array) -> float:
    """Distance from a phase below which others are of the same explanation [rad]."""
    return min(SAME_PHASE, FAINT_SHARE * float(np.abs(phase).max()))


def one_reading(one: Weighed, best: Weighed, hidden: float, alias: TactelAlias | None) -> bool:
    """Whether two explanations are one reading: of one phase, or no farther apart than deviations.

    Phases are one where noise hides their difference, unless they are of other tactels.  The
    deviations are those that are stated, of both as a mixture: their loads differ by one of them
    root mean square at most, and the mixture has at most twice the variance of the best alone.
    """
    if alias is not None and alias.between(one.top.unknowns, best.top.unknowns):
        return False
    if np.abs(one.phase - best.phase).max() < min(alike_within(best.phase), hidden):
        return True
    count = len(best.covariance)
    apart = one.top.unknowns[:count] - best.top.unknowns[:count]
    square = float(apart @ np.linalg.solve(best.covariance, apart))
    share = one.weight / (one.weight + best.weight)
    between = share * (1 - share) * square
    return between <= count and square / (1 + between) <= count


def held(weights: Array, means: Array, alone: Array) -> tuple[Array, Array]:
    """Mean of a mixture, and a covariance that holds each part as one deviation off, rms.

    The second moments of a mixture hardly know of a part of little weight, and a normal
    distribution of these denies it.  One that is wider in the direction of that part holds both.

    Parameters
    ----------
    weights : ndarray, shape (k,)
        Of the parts.
    means : ndarray, shape (k, 2n)
        Of their loads [N].
    alone : ndarray, shape (2n, 2n)
        Covariance of each [N^2].

    Returns
    -------
    mean : ndarray, shape (2n,)
        Of all [N].
    covariance : ndarray, shape (2n, 2n)
        That of the mixture, wider in the directions of parts that are farther off [N^2].
    """
    mean, covariance = mixture(weights / weights.sum(), means, alone)
    for apart in means - mean:
        square = float(apart @ np.linalg.solve(covariance, apart))
        if square > len(apart):
            covariance = covariance + (1 / len(apart) - 1 / square) * np.outer(apart, apart)
    return mean, covariance


def not_too_wide(covariance: Array, alone: Array) -> bool:
    """Whether a covariance is nowhere wider than another one by more than `WIDEST`."""
    last = [len(alone) - 1] * 2
    widest = eigh(covariance, alone, eigvals_only=True, subset_by_index=last)[0]
    return bool(widest <= WIDEST**2)
