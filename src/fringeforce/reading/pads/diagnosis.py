"""What may be wrong with a pad whose frame nothing explains: the likeliest departure.

A departure is a generous tolerance, so that it is fitted as any other: its unknowns stand beside
the forces, and the evidence of each weighs how well it explains the frame against how much it could
explain (MacKay, Neural Computation 4, 415-447, 1992).  Forces start from a reading that allows for
several at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.models.as_built import PLACEMENT, RESIDUAL, SIZE
from fringeforce.models.pad_as_built import CENTRE, WIDTH, spreads
from fringeforce.models.pad_departures import PadDeparture, departing, pad_departures
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.reading.findings import (
    HOPELESS,
    PARTLY,
    RIVAL,
    UNEXPLAINED,
    sentence,
    together,
)
from fringeforce.reading.pads.fit import Fit, Optimum
from fringeforce.reading.pads.sampling import Sampling, lattice
from fringeforce.reading.pads.single_frame import PadFrameReader
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
SIDE = 32
"""Rows and columns of pixels of the matrix of a fit."""
BEGUN = 2
"""Steps after which departures are compared."""
FOLLOWED, STEPS = 6, 20
"""Departures that are followed to their best, and steps for each."""
MOST = 3
"""Departures that are named together at most."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """Departures as a frame shows them, fitted together.

    Attributes
    ----------
    departures : tuple of PadDeparture
        What departs.
    fit : Fit
        The posterior of the frame with their unknowns.
    optimum : Optimum
        Where it is largest.
    """

    departures: tuple[PadDeparture, ...]
    fit: Fit
    optimum: Optimum

    @cached_property
    def evidence(self) -> float:
        """Logarithm of the posterior mass, less a constant of the frame."""
        matrix = self.fit.information(self.optimum.place)
        _, size = np.linalg.slogdet(matrix)
        return -(self.optimum.misfit.loss + float(size)) / 2

    def sized(self) -> list[Sized]:
        """Each departure with its size, the most significant first."""
        found = [self._sized(departure) for departure in self.departures]
        return sorted(found, key=lambda one: -one.significance)

    def _sized(self, departure: PadDeparture) -> Sized:
        known, extra = self.fit.uncertain, self.optimum.extra
        assert known is not None
        group = known.group(PLACEMENT if departure.path == SIZE else departure.path)
        assert group is not None
        begin = len(self.optimum.forces)
        own = np.arange(group.begin, group.end)
        own = own[known.shown(self.optimum.forces)[own]]
        part = self.optimum.curvature.covariance[np.ix_(begin + own, begin + own)]
        if departure.one:
            size = float(extra[own[0]]) * group.std / departure.unit
            return Sized(departure, size, float(abs(extra[own[0]]) / np.sqrt(part[0, 0])))
        square = float(extra[own] @ np.linalg.solve(part, extra[own]))
        # the normal deviate of a chi-square number (Fisher)
        significance = float(np.sqrt(2 * square) - np.sqrt(2 * len(own) - 1))
        return Sized(departure, self._spread(departure, extra), max(significance, 0.0))

    def _spread(self, departure: PadDeparture, extra: Array) -> float:
        """Root mean square of many numbers, of contacts that show."""
        known = self.fit.uncertain
        assert known is not None
        if departure.path == RESIDUAL:
            grid = known.coefficients(np.zeros_like(self.optimum.forces), extra)
            modes = known.model.retarding.spread(grid)
            whole = 2 * np.einsum("k,fkrc->frc", known.model.profile.sum(axis=0), modes)
            return float(np.sqrt(np.mean(np.square(whole))))
        seen = known.shown(self.optimum.forces)
        side, stds = known.model.sensor.tactels.side, spreads(known.model.sensor)
        first = departure.path == PLACEMENT
        wanted = [std for std in (stds[:2] if first else stds[2:4]) if std]
        chosen = [one for one in known.contacts if one[0] in wanted]
        share = CENTRE if first else WIDTH
        moved = [share * side * std * extra[place][seen[place]] for std, place, _ in chosen]
        return float(np.sqrt(np.mean(np.square(moved)))) if moved else 0.0


@dataclass(frozen=True)
class Sized:
    """A departure and by how much a frame shows it.

    Attributes
    ----------
    departure : PadDeparture
        What departs.
    size : float
        By how much, root mean square if it is many numbers.
    significance : float
        Standard deviations between this and the design.
    """

    departure: PadDeparture
    size: float
    significance: float


class PadDiagnosis:
    """Names the departures of one pad in frames that its reader refuses.

    Parameters
    ----------
    reader : PadFrameReader
        Of the design.
    """

    def __init__(self, reader: PadFrameReader) -> None:
        self.reader = reader
        self.departures = pad_departures(reader.model)
        self._samplings: dict[tuple[PadDeparture, ...], Sampling] = {}
        self._first = reader.uncertain or PadUncertainty.of(reader.model)

    @cached_property
    def _everything(self) -> PadFrameReader:
        wide = tuple(one for one in self.departures if one.path in TOGETHER)
        return PadFrameReader(departing(self.reader.model, wide))

    def findings(self, levels: NDArray[Any], used: Mask) -> tuple[str, ...]:
        """Sentences about a frame: the likeliest departure, or that there is none.

        Parameters
        ----------
        levels : ndarray, shape (channels * P,)
            Grey levels.
        used : ndarray of bool, same shape
            Pixels that count.
        """
        classifier = self.reader.classifier(used)
        grey = classifier.filled(levels)
        starts = self._starts(levels, used)
        chosen: tuple[PadDeparture, ...] = ()
        first: Candidate | None = None
        model, among = self.reader.model, self.departures
        for _ in range(MOST):
            left = tuple(one for one in among if one not in chosen)
            found = self._candidates(grey, classifier, starts, (chosen, left))
            best = found[0]
            first = first or best
            if classifier.explained(best.optimum):
                if len(best.departures) > 1:
                    return (together(best.sized(), model),)
                named = [one for one in found if one.evidence > best.evidence - RIVAL]
                alike = [one for one in named if classifier.explained(one.optimum)]
                return (sentence([one.sized()[0] for one in alike], model),)
            chosen, starts = best.departures, [best.optimum.forces]
            # what explained little alone explains little beside others
            among = tuple(one.departures[-1] for one in found)
            if len(among) < 2:
                break
        assert first is not None
        if classifier.chi2(first.optimum) < PARTLY:
            return (sentence(first.sized(), model, explained=False),)
        return (UNEXPLAINED,)

    def _starts(self, levels: NDArray[Any], used: Mask) -> list[Array]:
        """Forces from which departures are looked for."""
        reading = self._everything.search(levels, used)
        return [reading.forces.ravel()]

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
            self._begun(grey, classifier, start, (*chosen, departure))
            for departure in tried
            for start in starts
        ]
        begun.sort(key=lambda one: one.optimum.misfit.loss)
        least = begun[0].optimum.misfit.loss
        promising = [one for one in begun if one.optimum.misfit.loss < HOPELESS * least]
        found = []
        for one in promising[:FOLLOWED]:
            here = one.fit.at(one.optimum.forces, one.optimum.extra)
            found.append(replace(one, optimum=one.fit.climb(here, STEPS)))
        return sorted(found, key=lambda one: -one.evidence)

    def _begun(
        self,
        grey: Array,
        classifier: FrameClassifier,
        forces: Array,
        departures: tuple[PadDeparture, ...],
    ) -> Candidate:
        sampling = self._sampling(departures)
        known = sampling.uncertain
        assert known is not None
        response = self.reader.response
        fit = Fit(known.model, response, sampling, grey, classifier.used)
        extra = np.zeros(known.size)
        for departure in departures:
            group = known.group(departure.path)
            if departure.begin and group is not None:
                extra[group.place] = departure.begin
        return Candidate(departures, fit, fit.climb(fit.at(forces, extra), BEGUN))

    def _sampling(self, departures: tuple[PadDeparture, ...]) -> Sampling:
        """What a fit needs of departures; kept of single ones, for all combinations are too many.

        Every frame tries all single departures, and each combination once at most.
        """
        if departures in self._samplings:
            return self._samplings[departures]
        known = PadUncertainty.of(departing(self.reader.model, departures), self._first)
        found = lattice(known.model, SIDE, known)
        if len(departures) == 1:
            self._samplings[departures] = found
        return found
