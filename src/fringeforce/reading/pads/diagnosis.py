"""What may be wrong with a pad whose frame nothing explains: the likeliest departure.

A departure is a generous tolerance, so that it is fitted as any other: its unknowns stand beside
the forces, and the evidence of each weighs how well it explains the frame against how much it could
explain (MacKay, Neural Computation 4, 415-447, 1992).  Forces start from a reading that allows for
several at once.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.levenberg_marquardt import MOST_STEPS, Curvature
from fringeforce.models.as_built import PLACEMENT, RESIDUAL, SIZE
from fringeforce.models.pad_departures import PadDeparture, departing, pad_departures
from fringeforce.models.pad_skin_uncertainty import PadSkinUncertainty
from fringeforce.models.pad_uncertainty import PadUncertainty, Reference
from fringeforce.reading.findings import (
    FOLLOWED,
    HOPELESS,
    MOST_NAMED,
    PARTLY,
    RIVAL,
    UNEXPLAINED,
    Sized,
    covered_of_pad,
    sentence,
    together,
)
from fringeforce.reading.hidden_pixels import Explained, Hidden, hidden_pixels
from fringeforce.reading.pads.departure_test import begun
from fringeforce.reading.pads.fit import FIRST_STEPS, NEGLIGIBLE_GAIN, Fit, Optimum
from fringeforce.reading.pads.pad_frames import PadFrames
from fringeforce.reading.pads.sampling import Sampling
from fringeforce.reading.pads.single_frame import PadFrameReader
from fringeforce.reading.pads.skin_fit import SkinFit, SkinOptimum
from fringeforce.reading.pads.skin_reader import PadSkinReader
from fringeforce.reading.pads.verdict import FrameClassifier

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

TOGETHER = (
    "camera.shift_x",
    "camera.shift_y",
    "camera.blur",
    "camera.amplitude",
    "polariscope.visibility",
    RESIDUAL,
)
"""Departures that the reading from which others start allows for at once."""
UNSEEN = PLACEMENT, SIZE
"""Departures of which a skin shows nothing."""


class AnyOptimum(Protocol):
    """Where a posterior is largest; `Optimum` and `SkinOptimum` are such."""

    @property
    def loss(self) -> float:
        """Twice the negative logarithm, less a constant."""
        ...

    @property
    def extra(self) -> Array:
        """Unknowns of tolerances."""
        ...

    @property
    def curvature(self) -> Curvature:
        """Of loads and then of the unknowns of tolerances."""
        ...


@dataclass(frozen=True, eq=False)
class Candidate:
    """Departures as a frame shows them, fitted together.

    Attributes
    ----------
    departures : tuple of PadDeparture
        What departs.
    known : PadUncertainty
        The same as unknowns.
    optimum : AnyOptimum
        Where the posterior of the frame is largest.
    start : ndarray
        Its forces on squares, or contacts.
    shown : ndarray of bool, shape (q,)
        Unknowns that show at all.
    left : ndarray, shape (channels * P,)
        Residuals.
    taken : int
        Degrees of freedom that loads take.
    information : callable
        Computes half the second derivative of the loss.
    followed : callable
        The same some steps further on.
    sharpened : callable, optional
        The same where no step gains more than noise in one number, if climbs end before.
    """

    departures: tuple[PadDeparture, ...]
    known: PadUncertainty
    optimum: AnyOptimum
    start: Array
    shown: Mask
    left: Array
    taken: int
    information: Callable[[], Array]
    followed: Callable[[int], Candidate]
    sharpened: Callable[[], Candidate] | None = None

    @cached_property
    def evidence(self) -> float:
        """Logarithm of the posterior mass, less a constant of the frame."""
        _, size = np.linalg.slogdet(self.information())
        return -(self.optimum.loss + float(size)) / 2

    def sized(self) -> list[Sized]:
        """Each departure with its size, the most significant first."""
        found = [self._sized(departure) for departure in self.departures]
        return sorted(found, key=lambda one: -one.significance)

    def _sized(self, departure: PadDeparture) -> Sized:
        extra, curvature = self.optimum.extra, self.optimum.curvature
        group = self.known.group(PLACEMENT if departure.path == SIZE else departure.path)
        assert group is not None
        own = np.arange(group.begin, group.end)
        behind = curvature.size - len(extra)
        own = own[self.shown[own] & curvature.holds(behind + own)]
        at = curvature.at(behind + own)
        part = curvature.covariance[np.ix_(at, at)]
        if departure.one:
            size = float(extra[own[0]]) * group.std / departure.unit
            return Sized(departure, size, float(abs(extra[own[0]]) / np.sqrt(part[0, 0])))
        square = float(extra[own] @ np.linalg.solve(part, extra[own]))
        # the normal deviate of a chi-square number (Fisher)
        significance = float(np.sqrt(2 * square) - np.sqrt(2 * len(own) - 1))
        return Sized(departure, self._spread(departure), max(significance, 0.0))

    def _spread(self, departure: PadDeparture) -> float:
        """Root mean square of many numbers, of contacts that show."""
        known, extra = self.known, self.optimum.extra
        if still := known.group(RESIDUAL) if departure.path == RESIDUAL else None:
            modes = known.model.retarding.spread(known.residual.coefficients(extra[still.place]))
            whole = 2 * np.einsum("k,fkrc->frc", known.model.profile.sum(axis=0), modes)
            return float(np.sqrt(np.mean(np.square(whole))))
        # the strongest function that is odd along an axis moves a traction, even ones widen it
        first = departure.path == PLACEMENT
        odd = [one.shape.odd for one in known.tractions]
        moved = []
        for sign in ((1, 0), (0, 1)) if first else ((0, 0),):
            for number in [k for k, own in enumerate(odd) if own == sign][: 1 if first else 2]:
                own = known.deviations(self.shown)[number]
                moved.append(departure.deviation * known.deviations(extra)[number, own])
        each = np.concatenate([*moved, np.zeros(0)])
        return float(np.sqrt(np.mean(np.square(each)))) if each.size else 0.0


class PadDiagnosis(ABC):
    """Names the departures of one pad in frames that its reader refuses.

    Parameters
    ----------
    frames : PadFrames
        Reader of the design.
    """

    def __init__(self, frames: PadFrames) -> None:
        self.frames = frames
        self.departures = self.possible()
        self._wide = departing(
            frames.model, tuple(one for one in self.departures if one.path in TOGETHER)
        )

    def possible(self) -> tuple[PadDeparture, ...]:
        """All departures that can be told."""
        return pad_departures(self.frames.model)

    @abstractmethod
    def starts(self, levels: NDArray[Any], used: Mask) -> list[Array]:
        """Loads from which departures are looked for."""

    @abstractmethod
    def begun(
        self,
        grey: Array,
        classifier: FrameClassifier,
        start: Array,
        departures: tuple[PadDeparture, ...],
    ) -> Candidate:
        """Departures after some steps from loads."""

    @abstractmethod
    def undeparted(self, levels: NDArray[Any], used: Mask) -> Explained | None:
        """A frame as the design alone explains it at best; none if it finds no load."""

    def hidden(self, levels: NDArray[Any], used: Mask) -> Hidden | None:
        """What shows something else where loads explain all the rest: dirt, a hair, a glint."""
        variance = float(np.mean(self.frames.response.variance))
        bits = self.frames.model.sensor.camera.bits
        return hidden_pixels(lambda shown: self.undeparted(levels, shown), used, bits, variance)

    def _explained(self, left: Array, taken: int, evidence: float, used: Mask) -> Explained:
        shape = self.frames.model.frame_shape[-2:]
        noise = self.frames.classifier(used).noise(left, taken)
        return Explained(left.reshape(-1, *shape), noise, evidence)

    def findings(self, levels: NDArray[Any], used: Mask) -> tuple[str, ...]:
        """Sentences about a frame: the likeliest departure, or that there is none.

        Parameters
        ----------
        levels : ndarray, shape (channels * P,)
            Grey levels.
        used : ndarray of bool, same shape
            Pixels that count.
        """
        hidden = self.hidden(levels, used)
        classifier = self.frames.classifier(used)
        grey = classifier.filled(levels)
        starts = self.starts(levels, used)
        chosen: tuple[PadDeparture, ...] = ()
        first: Candidate | None = None
        model, among = self.frames.model, self.departures

        def explained(one: Candidate) -> bool:
            return classifier.noise(one.left, one.taken)

        for _ in range(MOST_NAMED if starts else 0):
            left = tuple(one for one in among if one not in chosen)
            found = self._candidates(grey, classifier, starts, (chosen, left))
            best = found[0]
            first = first or best
            if hidden is not None and hidden.evidence > best.evidence:
                return (covered_of_pad(hidden.pixels, model.sensor),)
            if explained(best):
                if len(best.departures) > 1:
                    return (together(best.sized(), model),)
                named = [one for one in found if one.evidence > best.evidence - RIVAL]
                alike = [one for one in named if explained(one)]
                return (sentence([one.sized()[0] for one in alike], model),)
            chosen, starts = best.departures, [best.start]
            # what explained little alone explains little beside others
            among = tuple(one.departures[-1] for one in found)
            if len(among) < 2:
                break
        if first is not None and classifier.reduced(first.left, first.taken) < PARTLY:
            return (sentence(first.sized(), model, explained=False),)
        return (UNEXPLAINED,)

    def _candidates(
        self,
        grey: Array,
        classifier: FrameClassifier,
        starts: Sequence[Array],
        which: tuple[tuple[PadDeparture, ...], tuple[PadDeparture, ...]],
    ) -> list[Candidate]:
        """Departures beside those that were chosen, followed to their best, the likeliest first.

        `which` holds those that were chosen, and those that are tried.
        """
        chosen, tried = which
        begun = [
            self.begun(grey, classifier, start, (*chosen, departure))
            for departure in tried
            for start in starts
        ]
        begun.sort(key=lambda one: one.optimum.loss)
        least = begun[0].optimum.loss
        promising = [one for one in begun if one.optimum.loss < HOPELESS * least]
        found = [one.followed(MOST_STEPS) for one in promising[:FOLLOWED]]
        likely = max(one.evidence for one in found) - NEGLIGIBLE_GAIN * starts[0].size / 2
        sharp = [
            one.sharpened() if one.sharpened and one.evidence > likely else one for one in found
        ]
        return sorted(sharp, key=lambda one: -one.evidence)


class PadSquaresDiagnosis(PadDiagnosis):
    """The same of forces on squares.

    Parameters
    ----------
    reader : PadFrameReader
        Of the design.
    """

    def __init__(self, reader: PadFrameReader) -> None:
        super().__init__(reader)
        self._samplings: dict[tuple[PadDeparture, ...], Sampling] = {}
        self._reader = reader

    @cached_property
    def _everything(self) -> PadFrameReader:
        return PadFrameReader(self._wide)

    def undeparted(self, levels: NDArray[Any], used: Mask) -> Explained:
        """As of `PadDiagnosis`."""
        best = self._reader.likeliest(levels, used)
        return self._explained(best.misfit.slope, len(best.forces), best.mass, used)

    def starts(self, levels: NDArray[Any], used: Mask) -> list[Array]:
        """As of `PadDiagnosis`."""
        return [self._everything.likeliest(levels, used).forces]

    def begun(
        self,
        grey: Array,
        classifier: FrameClassifier,
        start: Array,
        departures: tuple[PadDeparture, ...],
    ) -> Candidate:
        """As of `PadDiagnosis`."""
        sampling = self._sampling(departures)
        known = sampling.uncertain
        assert known is not None
        # tractions are spread as forces of the reading let expect, which need not be found again
        about = Reference(start, begun(known, departures))
        fit = Fit(
            known.model, self.frames.response, sampling, grey, classifier.used, reference=about
        )
        here = fit.at(*about)
        return self._candidate(departures, known, fit, fit.climb(here, FIRST_STEPS))

    def _candidate(
        self,
        departures: tuple[PadDeparture, ...],
        known: PadUncertainty,
        fit: Fit,
        optimum: Optimum,
    ) -> Candidate:
        def followed(steps: int) -> Candidate:
            here = fit.at(optimum.forces, optimum.extra)
            return self._candidate(departures, known, fit, fit.climb(here, steps))

        def sharpened() -> Candidate:
            here = fit.at(optimum.forces, optimum.extra)
            found = fit.climb(here, MOST_STEPS, optimum.curvature, fine=True)
            return self._candidate(departures, known, fit, found)

        return Candidate(
            departures,
            known,
            optimum,
            optimum.forces,
            known.shown(optimum.forces),
            optimum.misfit.slope,
            len(optimum.forces),
            lambda: optimum.curvature.information,
            followed,
            sharpened,
        )

    def _sampling(self, departures: tuple[PadDeparture, ...]) -> Sampling:
        """What a fit needs of departures; kept of single numbers, which every frame tries.

        All combinations are too many to keep, and matrices of tractions are too large.  The
        influence of squares is that of the readers, with as many depth profiles.
        """
        if departures in self._samplings:
            return self._samplings[departures]
        known = PadUncertainty.of(departing(self.frames.model, departures), self._reader.mechanics)
        ours, theirs = self._reader.stepping, self._everything.stepping
        alike = known.model.influence.modes == ours.model.influence.modes
        found = replace(ours if alike else theirs, model=known.model, uncertain=known)
        if len(departures) == 1 and departures[0].one:
            self._samplings[departures] = found
        return found


class PadSkinDiagnosis(PadDiagnosis):
    """The same of contacts anywhere on a skin.

    Parameters
    ----------
    reader : PadSkinReader
        Of the design.
    """

    def __init__(self, reader: PadSkinReader) -> None:
        super().__init__(reader)
        self._reader = reader
        self._known: dict[PadDeparture, PadSkinUncertainty] = {}

    def possible(self) -> tuple[PadDeparture, ...]:
        """As of `PadDiagnosis`; a skin has no tactels."""
        return tuple(one for one in super().possible() if one.path not in UNSEEN)

    @cached_property
    def _everything(self) -> PadSkinReader:
        return PadSkinReader(self._wide)

    def undeparted(self, levels: NDArray[Any], used: Mask) -> Explained | None:
        """As of `PadDiagnosis`; none where nothing touches."""
        best = self._reader.likeliest(levels, used)
        if best is None:
            return None
        classifier = self._reader.classifier(used)
        fit = self._reader.fit(classifier.filled(levels), classifier)
        _, size = np.linalg.slogdet(fit.information(best.place, best.free))
        mass = -(best.loss + float(size)) / 2
        return self._explained(best.place.left.slope, best.taken(fit), mass, used)

    def starts(self, levels: NDArray[Any], used: Mask) -> list[Array]:
        """As of `PadDiagnosis`; none where nothing touches."""
        best = self._everything.likeliest(levels, used)
        return [] if best is None else [best.contacts]

    def begun(
        self,
        grey: Array,
        classifier: FrameClassifier,
        start: Array,
        departures: tuple[PadDeparture, ...],
    ) -> Candidate:
        """As of `PadDiagnosis`."""
        known = self._uncertain(departures)
        fit = replace(self._everything.fit(grey, classifier), model=known.model, uncertain=known)
        here, free = fit.at(start, begun(known, departures)), np.ones(start.shape, dtype=bool)
        return self._candidate(departures, known, fit, fit.climb(here, free, FIRST_STEPS))

    def _candidate(
        self,
        departures: tuple[PadDeparture, ...],
        known: PadSkinUncertainty,
        fit: SkinFit,
        optimum: SkinOptimum,
    ) -> Candidate:
        def followed(steps: int) -> Candidate:
            here = fit.at(optimum.contacts, optimum.extra)
            return self._candidate(departures, known, fit, fit.climb(here, optimum.free, steps))

        return Candidate(
            departures,
            known,
            optimum,
            optimum.contacts,
            np.ones(known.size, dtype=bool),
            optimum.place.left.slope,
            optimum.taken(fit),
            lambda: fit.information(optimum.place, optimum.free),
            followed,
        )

    def _uncertain(self, departures: tuple[PadDeparture, ...]) -> PadSkinUncertainty:
        """Departures as unknowns, with the depth profiles of all; single ones are kept."""
        if len(departures) == 1 and departures[0] in self._known:
            return self._known[departures[0]]
        everything = self._everything
        sensor = departing(self.frames.model, departures).sensor
        found = PadSkinUncertainty(replace(everything.optics, sensor=sensor), skin=everything.skin)
        if len(departures) == 1:
            self._known[departures[0]] = found
        return found
