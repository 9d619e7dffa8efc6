"""Explanations of one frame of a strip: from starts of a beam search, and their mirror images."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.estimation.frame_exposure import node_phase
from fringeforce.estimation.hypotheses import NEGLIGIBLE_LOSS, MetPhases
from fringeforce.estimation.phase_stretches import Hidden
from fringeforce.estimation.posterior import HEATS, Posterior, Top
from fringeforce.estimation.residual_test import FALSE_VERDICT
from fringeforce.reading.contact_prior import push_of, slipping
from fringeforce.reading.frame_light import Lines
from fringeforce.reading.posterior_search import BINS, CANDIDATES, PosteriorSearch
from fringeforce.reading.strip_explanations import Explanations, alike_within, same_phase
from fringeforce.reading.strip_frames import MISSED

IMAGES = 6
"""Mirror images that are tried in a round, to mend what does not fit or to find what rivals it; of
a frame that is faint throughout, those in a row that lead to no new explanation of weight."""
DOUBTFUL = 0.1
"""Chance that noise leaves as much as an explanation does below which all its mirror images are
tried, and with more care: one right explanation in ten leaves that much."""
CAREFUL_HEATS, TRAPPED = (1000.0, *HEATS), 60.0
"""Factors on the variance of the noise of a climb that valleys of place and width hardly trap; and
how much more than an explanation of weight leaves one may leave that stays at the phase of its
image, to be climbed to once more so: those that were trapped ended up to 50 above."""
IMAGE_ROUNDS = 3
"""Rounds of mirror images without a better explanation, each from the best one so far."""
FAINT_PHASE = 1.5
"""Phase that a frame must reach to be followed from one to the next [rad]."""


@dataclass(frozen=True, eq=False)
class StripFrameSearch:
    """Looks for what explains frames of one strip.

    Attributes
    ----------
    beam : PosteriorSearch
        Finds starts, and mirror images.
    hidden : Hidden
        What noise hides of a phase.
    """

    beam: PosteriorSearch
    hidden: Hidden

    def explained(
        self,
        posterior: Posterior,
        lines: Lines,
        silent: Top | None,
        attempts: int | None = None,
        known: Sequence[Top] = (),
    ) -> Explanations:
        """Explanations of a frame, the best first; those known of a sensor nearby are tried first.

        They explain the frame in bins there, the best first.
        """
        met, tried = Explanations(posterior), MetPhases(posterior.even)
        starts = np.array([top.unknowns for top in known])
        losses = np.array([top.loss for top in known])
        done = self._tried([(starts, losses, 0.0)], posterior, met, tried)
        done = done or self._searched(posterior, lines, met, tried, attempts)
        if silent is not None:
            met.add(silent)
        if not done and not (met.tops and met.explains(met.tops[0], FALSE_VERDICT)):
            return met
        met.explained = True
        if met.rough:
            doubtful = not met.explains(met.tops[0], DOUBTFUL)
            self.improve(met, met.rough[0], stop=False, doubtful=doubtful)
        met.settle()
        turned = posterior.mirrored(met.tops[0].unknowns)
        if posterior.even and _may_push(posterior, turned):
            met.add(posterior.climbed(turned, heats=(), steps=(0, 15)))
        return met

    def found(self, posterior: Posterior, lines: Lines, attempts: int, mend: bool) -> Explanations:
        """What some attempts find in a frame, the best first, whether it explains it or not."""
        met = Explanations(posterior)
        self._searched(posterior, lines, met, MetPhases(posterior.even), attempts, mend)
        return met

    def _searched(
        self,
        posterior: Posterior,
        lines: Lines,
        met: Explanations,
        tried: MetPhases,
        attempts: int | None = None,
        mend: bool = True,
    ) -> bool:
        """Search until something explains the frame plainly, or so often; mend by mirror images."""
        efforts = islice(self.beam.attempts(lines, met.tops), attempts)
        return self._tried(efforts, posterior, met, tried, mend)

    def _tried(
        self,
        efforts: Iterable[tuple[Array, Array, float]],
        posterior: Posterior,
        met: Explanations,
        tried: MetPhases,
        mend: bool = True,
    ) -> bool:
        """Fit starts of one effort after the other until something explains the frame plainly."""
        at = posterior.model.at
        for starts, scores, _ in efforts:
            fits = list[Top]()
            done = False
            for start, score in zip(starts[:CANDIDATES], scores, strict=False):
                if done and score > scores[0] + NEGLIGIBLE_LOSS:
                    break
                phase = node_phase(posterior.model, start)
                if tried.holds(phase):
                    continue
                tried.add(phase, alike_within(phase))
                if posterior.even and start[: at.loads : 2].sum() < 0:
                    start = posterior.mirrored(start)
                if done:
                    bound = met.rough[0].loss + NEGLIGIBLE_LOSS
                    rough = posterior.settled(start, BINS, HEATS[1:], bound=bound)
                    met.keep(rough)
                else:
                    rough = posterior.settled(start, BINS, HEATS)
                    done = met.tried(rough)
                fits.append(rough)
                phase = posterior.phase(rough)
                tried.add(phase, alike_within(phase))
            if done:
                return True
            for rough in sorted(fits, key=lambda top: top.loss)[:3]:
                if mend and rough.loss < (1 + BINS) * rough.count:
                    self.improve(met, rough, stop=True)
                    if met.tops and met.explains(met.tops[0], MISSED):
                        return True
        return False

    def improve(
        self,
        met: Explanations,
        top: Top,
        stop: bool,
        within: Mask | None = None,
        doubtful: bool = False,
    ) -> None:
        """Look among mirror images of stretches of the phase, those of the best ones first.

        Images of a better one are looked for at once, and of rivals of the best one afterwards; all
        of them, and with care, if the explanation is doubtful.
        Where the phase is faint all along, light hardly tells the sign of any lobe, and there are
        far more rivals than `IMAGES`: there a round goes on as long as it finds new ones.
        """
        posterior, seen = met.posterior, MetPhases()
        told = self.hidden.along(len(posterior.model.fixed))
        seen.add(posterior.phase(top), told)
        at, found = posterior.model.at, met.tried if stop else met.keep
        if at.fields > at.place:
            heats = HEATS if stop else HEATS[1:]
            again = posterior.settled(posterior.drawn_in(top.unknowns), BINS, heats)
            found(again)
            top = min(top, again, key=lambda one: one.loss)
        rivals, known, ends = [top], MetPhases(), MetPhases()
        ends.add(first := posterior.phase(top), alike_within(first))
        rounds, faint = IMAGE_ROUNDS, is_faint(posterior, top)
        while rivals and rounds:
            top = posterior.settled(rivals.pop(0).unknowns, BINS)
            here, vain, better = posterior.phase(top), 0, False
            known.add(here, told)
            for start in self.beam.images(posterior, top, push_of(posterior.prior), within):
                phase = node_phase(posterior.model, start)
                if seen.holds(phase):
                    continue
                seen.add(phase, told)
                vain += not same_phase(phase, here)
                if vain > IMAGES and not doubtful:
                    break
                lightest = met.rough[0].loss + NEGLIGIBLE_LOSS
                reached = posterior.settled(start, BINS, HEATS[1:], bound=lightest + 8)
                trapped = lightest < reached.loss < lightest + TRAPPED
                trapped = trapped and same_phase(posterior.phase(reached), phase)
                if trapped or ((stop or doubtful) and reached.loss >= top.loss - 1):
                    careful = posterior.settled(posterior.drawn_in(start), BINS, CAREFUL_HEATS)
                    reached = min(reached, careful, key=lambda one: one.loss)
                best, ended = met.rough[0].loss, posterior.phase(reached)
                has_weight = reached.loss < best + NEGLIGIBLE_LOSS
                if faint and has_weight and not ends.holds(ended):
                    ends.add(ended, alike_within(ended))
                    vain = 0
                found(reached)
                rivals.append(reached)
                better = reached.loss < best - 1
                if better and not known.holds(posterior.phase(reached)):
                    break
            if stop and met.tops and met.explains(met.tops[0], MISSED):
                break
            rounds -= not better
            rivals = [one for one in rivals if one.loss < met.rough[0].loss + NEGLIGIBLE_LOSS]
            rivals = sorted(rivals, key=lambda one: one.loss)
            while rivals and known.holds(posterior.phase(rivals[0])):
                rivals.pop(0)


def is_faint(posterior: Posterior, top: Top) -> bool:
    """Whether the phase stays so small that loads are hardly told from others, or none."""
    return bool(np.abs(posterior.phase(top)).max() < FAINT_PHASE)


def friction_is_idle(met: Explanations) -> bool:
    """Whether friction does not hold down the loads of the best explanation."""
    posterior, loads = met.posterior, met.tops[0].unknowns[: met.posterior.model.at.loads]
    return slipping(posterior.prior, loads) < NEGLIGIBLE_LOSS


def _may_push(posterior: Posterior, unknowns: Array) -> bool:
    """Whether loads do not pull so much that no contact does."""
    normal = np.minimum(unknowns[: posterior.model.at.loads : 2], 0)
    return bool(np.square(normal / posterior.prior.yielding).sum() < 10 * NEGLIGIBLE_LOSS)
