"""One frame of a skin to one reading: contacts anywhere, as many as there are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.blas_threads import one_blas_thread
from fringeforce.base.errors import InputError
from fringeforce.estimation.bad_pixels import isolated
from fringeforce.estimation.binning import seen_means, slow_size
from fringeforce.estimation.followed_frames import JUMP
from fringeforce.estimation.frame_climb import CONVERGED
from fringeforce.estimation.frame_exposure import expose, node_phase
from fringeforce.estimation.hypotheses import NEGLIGIBLE_LOSS, SAME_PHASE, posterior_weights
from fringeforce.estimation.phase_stretches import motion
from fringeforce.estimation.residual_test import (
    FALSE_ALARM,
    FALSE_VERDICT,
    bumps_are_noise,
    square_limit,
)
from fringeforce.models.creep import Creep, Crept
from fringeforce.models.skin import (
    PLACE,
    WIDTH,
    YIELDING,
    Contacts,
    SkinModel,
    large_strain,
    variances,
)
from fringeforce.reading.faint_contacts import faint_starts, is_faint
from fringeforce.reading.frame_light import Lines
from fringeforce.reading.large_strain import SOLUTIONS
from fringeforce.reading.posterior_search import Effort, phase_information
from fringeforce.reading.reading import Reading, Status
from fringeforce.reading.skin_creep import check_rest
from fringeforce.reading.skin_departure_test import SkinDepartureTest
from fringeforce.reading.skin_fit import Explanation, Seen, climbed, renewed, strained
from fringeforce.reading.skin_result import SkinResult
from fringeforce.reading.skin_search import EFFORTS, MOST_CONTACTS, SkinSearch
from fringeforce.reading.strip_explanations import same_phase
from fringeforce.reading.strip_frames import HOPELESS_LOSS, StripFrames, doubted

SPAN = 1.5
"""Phase that bins of pixels may span while explanations are looked for, which takes a tenth of the
fringes' contrast [rad]."""
INCOMPLETE = 2e-3
"""Chance of noise below which the best that a search finds may not be all: contacts have so few
unknowns that wrong ones leave much more."""
SETTLED = 0.05
"""Chance of noise above which an explanation ends the search: one right one in twenty is compared
with others in vain, and a wrong one that leaves so little more than noise is rarer still."""
IMAGES, RIVAL_GROWTH, MENDING_GROWTH = 8, 250.0, 2500.0
"""Mirror images that are tried of an explanation, and the expected growth of the loss up to which
they are: of what explains the frame, of what does not."""
MISFIT = 1000.0
"""Weighted squares that pressures leave of the phase of a rival, beyond which no contacts cause it:
starts that led to explanations left up to 440."""
CERTAIN_FORCE = 20.0
"""Deviations of a contact's force from which it is not tried to do without: what only seemed to
press, after others were found too wide or too narrow, had up to 13."""
FAINT_FORCE = 3.0
"""Deviations of a contact's force below which a frame is explained without it."""
APART_WIDTHS = 1.5
"""Distance of two contacts over the sum of their half widths from which they stay two."""
OFF = 64.0
"""Loss beyond the best from which a climb is given up: what it may still fall is not well known."""
JUMPED = 2.0
"""Factor of a force from one frame to the next beyond which it is not the same contact that moved:
at hundreds of frames a second nothing presses twice as hard in one of them."""
PAUSE = 3
"""Candidates after which mirror images of the best so far are tried."""
STATED = [0, 1, 5]
"""Normal and tangential force and centre of pressure among the values of a total."""
SAME_CONTACT = 0.1
"""Distance between contacts, in half widths, below which they are the same one."""
Before = tuple[Explanation, float]
"""What explained the last frame, and its probability."""


@dataclass(frozen=True, eq=False)
class SkinReader(StripFrames):
    """Reads frames of one skin, each for itself."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.model.sensor.transducer.influence_error:
            raise InputError(
                "transducer.influence_error is not allowed for on a skin; state what causes it, "
                "such as tolerances of the layers, or read tactels."
            )
        strip = self.model.sensor.transducer
        if self.relaxes and (strip.strain == "finite" or len(Creep.of_ratio(strip).amounts)):
            raise InputError(
                "Readings of skins allow for relaxation of layers that relax alike, under small "
                "strain; leave it out, state one for both layers, or take tactels."
            )

    @cached_property
    def skin(self) -> SkinModel:
        """What contacts do."""
        sensor = self.model.sensor
        assert sensor.skin is not None
        limit = sensor.skin.friction if self.friction is None else self.friction
        cover = sensor.transducer.compliant.thickness
        strain = large_strain(sensor, self.uncertain)
        half = sensor.skin.extent / 2
        return SkinModel(self.uncertain, sensor.tactels.positions, cover, limit, half, strain)

    @cached_property
    def _search(self) -> SkinSearch:
        return SkinSearch(self.skin)

    def trial(self, share: float, rng: np.random.Generator) -> NDArray[Any]:
        """A frame of a share of a newton in the middle, four thicknesses of the cover wide."""
        forces, places = np.zeros(self.forces_shape), self.skin.places
        forces[np.abs(places) < 2 * self.skin.cover, 0] = share
        forces /= np.count_nonzero(forces) or 1
        return self.model.expose(forces, rng, strain="linear")

    def creep_filter(self, history: float) -> None:
        """None: what follows a skin knows the creep of earlier loads before it reads a frame."""
        check_rest(self, history)

    def alone(self, levels: NDArray[Any], used: Mask) -> Reading:
        """Read a frame that was checked, without any earlier state."""
        return self.followed(levels, used, None)[0]

    @one_blas_thread()
    def followed(
        self,
        levels: NDArray[Any],
        used: Mask,
        before: Before | None,
        crept: Crept | None = None,
    ) -> tuple[Reading, Explanation | None]:
        """Read a frame that was checked, from what explained the last one if it is known."""
        seen, coarse, lines = self._seen(levels, used, crept)
        if before is not None:
            last, probability = before
            found = renewed(seen, climbed(coarse, last.contacts, last.others))
            fits = found.chance > FALSE_VERDICT and not found.spoilt(last.top.broken)
            if fits and goes_on(found, last):
                return self.stated(found, probability, tracked=True), found
        silent = self._silent(seen)
        met = self._met(seen, coarse, lines, silent)
        if not met or met[0].chance < FALSE_VERDICT:
            return self._refused(seen.frame, lines, met), None
        if silent is not None and silent.top.loss - met[0].top.loss < square_limit(
            2, FALSE_VERDICT
        ):
            return self.stated(silent, 1.0, Status.NO_CONTACT), silent
        reading, best = self._weighed(met, silent)
        if reading.ok and (said := self.departing(best)):
            return reading.departing(said), None
        return reading, best if reading.probability >= self.confidence else None

    def departing(self, one: Explanation) -> str:
        """What a frame shows of departures beside the contacts that explain it, in words.

        Nothing if it shows none.  What a calibration leaves uncertain would be taken for one, and
        so would what the elements of large strain miss, and creep.
        """
        if self.model.imaging is not None or self.skin.strain is not None or self.relaxes:
            return ""
        return self._departures.finding(one)

    @cached_property
    def _departures(self) -> SkinDepartureTest:
        return SkinDepartureTest(self.model, self.uncertain, self.skin)

    @one_blas_thread()
    def likeliest(
        self,
        levels: NDArray[Any],
        used: Mask,
        known: Contacts | None = None,
        efforts: tuple[Effort, ...] = EFFORTS,
    ) -> Explanation | None:
        """The likeliest explanation of a frame that was checked, if there is any.

        Contacts that are known, nearly, are not searched.  Few efforts are made in bins alone.
        """
        seen, coarse, lines = self._seen(levels, used)
        if known is not None:
            met = [renewed(seen, climbed(coarse, known))]
        else:
            met = self._met(seen, coarse, lines, self._silent(seen), efforts)
        fitting = [one for one in met if one.chance > FALSE_VERDICT]
        return max(fitting, key=lambda one: one.evidence, default=None)

    def still_silent(
        self, levels: NDArray[Any], used: Mask, silent: Explanation
    ) -> Explanation | None:
        """No contact after a frame of no contact, unless something shows."""
        frame = np.where(used, levels.astype(float), np.nan)
        posterior = replace(silent.posterior, frame=frame)
        top = posterior.climbed(silent.top.unknowns, heats=(), steps=(0, 2))
        if not top.chance > FALSE_ALARM:
            return None
        model = posterior.model
        left = (frame - expose(model, top.unknowns)[0]) / np.sqrt(model.variance)
        strip = self.model.sensor.transducer
        shortest = round(strip.compliant.thickness / strip.length * left.shape[-1])
        for line in np.nan_to_num(left).reshape(len(model.bias), -1):
            if not bumps_are_noise(line, shortest // len(model.bias), FALSE_VERDICT):
                return None
        return replace(silent, posterior=posterior, top=top)

    def without_faint(
        self, seen: Seen, found: Explanation, deviations: Array
    ) -> Explanation | None:
        """An explanation without contacts whose forces are none, as deviations tell [N].

        None is returned where all are, or where what is left does not explain the frame as likely.
        """
        kept = found.contacts.forces[:, 0] > FAINT_FORCE * deviations
        if not kept.any():
            return None
        rest = Contacts(*(part[kept] for part in found.contacts))
        pushed = seen._replace(push=float(rest.forces[:, 0].sum()))
        fewer = climbed(pushed, rest, found.others)
        return fewer if fewer.chance > FALSE_VERDICT else None

    def _seen(
        self, levels: NDArray[Any], used: Mask, crept: Crept | None = None
    ) -> tuple[Seen, Seen, Lines]:
        """A frame, the same in bins while explanations are looked for, and its lines."""
        frame = np.where(used, levels.astype(float), np.nan)
        # single pixels that nothing explains would spoil the means over bins; fits bear them
        alone = isolated(levels.astype(float), self.model.response)
        sound = np.where(alone, np.nan, frame)
        beam, drawn = self._search.beam, self.skin.uncertain.frame
        lines = beam.light.lines(sound)
        pace, _ = beam.light.true_pace(lines, lines.light)
        # contacts whose fringes run as fast as the frame's
        push = beam.pushing(pace) * np.sqrt(len(beam.model.moments))
        size = slow_size(drawn, float(pace.max()), SPAN)
        means = seen_means(sound, size, len(drawn.bias))
        coarse = Seen(self.skin.in_bins(size), means, push, crept)
        return Seen(self.skin, frame, push, crept), coarse, lines

    def _silent(self, seen: Seen) -> Explanation | None:
        """No contact, if that explains the frame."""
        nothing = Contacts(np.zeros((1, 2)), self.skin.drawn[None])
        posterior, start = seen.linear.posterior(nothing)
        alone = posterior.without()
        top = alone.climbed(start, heats=(), steps=(0, 2))
        if top.square > HOPELESS_LOSS * top.count:
            return None
        top = alone.climbed(top.unknowns, heats=(), steps=(0, 15))
        return Explanation(alone, top, nothing, nothing) if top.chance > FALSE_ALARM else None

    def _met(
        self,
        seen: Seen,
        coarse: Seen,
        lines: Lines,
        silent: Explanation | None,
        efforts: tuple[Effort, ...] = EFFORTS,
    ) -> list[Explanation]:
        """Explanations of a frame that may have weight, the best first, or the nearest to one.

        Where none is found in bins, pixels are looked at: few bins are broken sooner.
        """
        rough = self._silent(coarse) if silent is not None else None
        explained = self._explained(coarse, lines, rough, efforts)
        met = _ordered([
            silent if silent is not None and one is rough else renewed(seen, one)
            for one in _distinct(explained, NEGLIGIBLE_LOSS / 2)
        ])  # fmt: skip
        last = efforts is not EFFORTS or len(coarse.frame) == len(seen.frame)
        if last or (met and met[0].chance > FALSE_VERDICT):
            return met
        return self._met(seen, seen, lines, silent)

    def _explained(
        self,
        seen: Seen,
        lines: Lines,
        silent: Explanation | None,
        efforts: tuple[Effort, ...],
    ) -> list[Explanation]:
        """Explanations of a frame, the likeliest first, or the nearest to one."""
        met, tried = list[Explanation](), list[Array]()
        for number, phase in enumerate(self._search.phases(lines, efforts)):
            tried.append(phase)
            met = _ordered(met + self._pressed(seen, phase, met))
            if met and _settled(met[0]):
                break
            if met and number % PAUSE == PAUSE - 1 and met[0].top.square < 2 * met[0].top.count:
                met = _ordered(met + self._mirrored(seen, met[0], met, tried, MENDING_GROWTH))
                if _settled(met[0]):
                    break
        if silent is not None:
            met = _ordered([*met, silent])
        if met and met[0].chance > FALSE_VERDICT:
            if not is_faint(seen, met[0]):
                met = _ordered(met + self._mirrored(seen, met[0], met, tried, RIVAL_GROWTH))
            met = _ordered(met + self._simplified(seen, met[0]))
            while likewise := self._likewise(seen, met, silent):
                before, met = _likeliest(met), _ordered(met + likewise)
                if met[0] in likewise:
                    met = _ordered(met + self._simplified(seen, met[0]))
                if _same(_likeliest(met), before):
                    break
            if self.skin.strain is not None:
                solved = [self._solved(seen, one) for one in _distinct(met, NEGLIGIBLE_LOSS)]
                met = _ordered([one for one in solved if not one.folded])
        return met

    def _pressed(self, seen: Seen, phase: Array, met: list[Explanation]) -> list[Explanation]:
        """What contacts that cause about a phase explain, as few as do."""
        found = list[Explanation]()
        explained = bool(met) and _settled(met[0])
        best = met[0] if met and met[0].chance > FALSE_VERDICT else None
        wanted = phase - self._strained(best) - seen.known
        loads, misfit = self._search.pressed(wanted)
        if not loads[:, 0].sum() > 0 or (explained and misfit > MISFIT):
            return found
        bound = met[0].top.loss + OFF if explained else np.inf
        for count in range(self._search.fewest(loads), MOST_CONTACTS + 1):
            contacts = self._search.divided(loads, count)
            if contacts is None:
                break
            contacts = self._search.fitted(contacts, wanted)
            one = self._climbed(seen, contacts, best, bound=bound)
            better = not found or one.top.loss < found[-1].top.loss - NEGLIGIBLE_LOSS
            found.append(one)
            hopeless = one.top.loss > bound + HOPELESS_LOSS * one.top.count
            if _settled(one) or not better or hopeless:
                break
        return found

    def _climbed(
        self,
        seen: Seen,
        contacts: Contacts,
        best: Explanation | None,
        others: Array | None = None,
        bound: float = np.inf,
    ) -> Explanation:
        """The explanation that contacts lead to.

        Under large strain contacts of small strain are found, what large strain adds under these to
        the phase, and so on: first with what it adds under the likeliest ones so far.  Right ones
        leave no more than noise does, and what strain adds beyond what was taken.
        """
        skin = self.skin
        if skin.strain is None:
            return climbed(seen, contacts, others, bound=bound)
        beyond, missed = self._strained(best), np.inf
        one = climbed(seen.linear, contacts, beyond=beyond)
        for _ in range(SOLUTIONS):
            added = strained(skin, one.contacts)
            if added is None:
                return replace(one, solved=False, folded=True)
            known = phase_information(skin.uncertain.frame, one.phase)
            before, missed = missed, float(known @ np.square(added - beyond))
            most = square_limit(one.top.count, FALSE_VERDICT) + one.top.loss - one.top.square
            if missed < 1 or one.top.loss > min(most, bound) + missed:
                break
            # widths that are found too large and too small in turn come together half way
            beyond = added if missed < before / 2 else (added + beyond) / 2
            last = one.top.loss
            one = climbed(seen.linear, one.contacts, one.others, beyond=beyond)
            if abs(one.top.loss - last) < 1:
                break
        else:  # what strain adds depends much on the contacts: by its tangent
            return climbed(seen, one.contacts, np.append(0.0, one.others), bound=bound)
        return replace(one, solved=False)

    def _solved(self, seen: Seen, one: Explanation) -> Explanation:
        """An explanation with the strip solved at its contacts."""
        if one.solved:
            return one
        return climbed(seen, one.contacts, np.append(0.0, one.others))

    def strain_size(self, one: Explanation) -> float:
        """What large strain adds to the phase of an explanation, in deviations of the noise."""
        known = phase_information(self.skin.uncertain.frame, one.phase)
        return float(np.sqrt(known @ np.square(self._strained(one))))

    def _strained(self, one: Explanation | None) -> Array:
        """What large strain adds to the phase of an explanation at the nodes, shape (m,) [rad]."""
        if self.skin.strain is None or one is None:
            return np.zeros(len(self.skin.uncertain.frame.fixed))
        others = self.uncertain.frame.at.size - self.uncertain.frame.at.fields
        of_linear = one.others[len(one.others) - others :]
        return one.phase - node_phase(*self.skin.linear.frame(one.contacts, others=of_linear))

    def _mirrored(
        self,
        seen: Seen,
        best: Explanation,
        met: list[Explanation],
        tried: list[Array],
        growth: float,
    ) -> list[Explanation]:
        """Explanations near the mirror images of one."""
        found = list[Explanation]()
        for count, phase in enumerate(self._search.images(best.phase, seen.push, growth)):
            if count >= IMAGES:
                break
            if any(np.abs(phase - known).max() < SAME_PHASE / 2 for known in tried):
                continue
            tried.append(phase)
            found += self._pressed(seen, phase, met)
        return found

    def _likewise(
        self, seen: Seen, met: list[Explanation], silent: Explanation | None
    ) -> list[Explanation]:
        """Explanations of faint contacts, whose light hardly tells its sign, besides those met."""
        pushing = [one for one in met if one is not silent]
        found = list[Explanation]()
        while pushing:
            best = _likeliest(pushing)
            more = [
                self._climbed(seen, contacts, best, best.others, best.top.loss + OFF)
                for contacts in faint_starts(seen, best)
            ]
            found += more
            pushing = [one for one in more if _mass(one) > _mass(best) + CONVERGED]
        return found

    def _simplified(self, seen: Seen, best: Explanation) -> list[Explanation]:
        """Explanations with fewer contacts, as long as they are likelier."""
        found = list[Explanation]()
        while len(best.contacts.forces) > 1:
            starts = sorted(self._fewer(best), key=lambda start: start[0])[:2]
            if not starts:
                break
            caused = best.phase - self._strained(best) - seen.known
            tried = [
                self._climbed(seen, self._search.fitted(contacts, caused), best, best.others)
                for _, contacts in starts
            ]
            found += tried
            likeliest = max(tried, key=lambda one: one.evidence)
            if likeliest.evidence < best.evidence:
                break
            best = likeliest
        return found

    def _fewer(self, best: Explanation) -> Iterator[tuple[float, Contacts]]:
        """Contacts without one, or with two neighbours as one, and what that changes [N]."""
        forces, geometry = best.contacts
        variance = np.diag(np.linalg.inv(best.about.hessian))[: forces.size : 2]
        for k in np.flatnonzero(forces[:, 0] < CERTAIN_FORCE * np.sqrt(variance)):
            rest = np.arange(len(forces)) != k
            yield abs(float(forces[k, 0])), Contacts(forces[rest], geometry[rest])
        forces, geometry = best.contacts.sorted()
        reach = APART_WIDTHS * (geometry[:-1, WIDTH] + geometry[1:, WIDTH])
        for k in np.flatnonzero(np.diff(geometry[:, PLACE]) < reach):
            pair = slice(k, k + 2)
            share = np.maximum(forces[pair, 0], 0) + 1e-9
            share /= share.sum()
            one = self.skin.drawn.copy()
            one[PLACE] = share @ geometry[pair, PLACE]
            apart = np.square(geometry[pair, PLACE] - one[PLACE])
            one[WIDTH] *= np.sqrt(share @ (variances(geometry[pair]) + apart) / variances(one))
            gap = float(np.diff(geometry[pair, PLACE])[0])
            rest = (np.arange(len(forces)) < k) | (np.arange(len(forces)) > k + 1)
            both = Contacts(
                np.vstack([forces[rest], forces[pair].sum(axis=0)]),
                self.skin.limited(np.vstack([geometry[rest], one])),
            )
            yield float(forces[pair, 0].min()) * gap / self.skin.cover, both

    def _weighed(
        self, met: list[Explanation], silent: Explanation | None
    ) -> tuple[Reading, Explanation]:
        """The reading of the likeliest explanation, and that; `silent` is the one of no contact."""
        distinct = _distinct(met, NEGLIGIBLE_LOSS / 2)
        masses = np.array([_mass(one) for one in distinct])
        weights, best = posterior_weights(masses), distinct[masses.argmax()]
        mine = np.array([self._alike(one, best, silent) for one in distinct])
        others = [one for one, own in zip(distinct, mine, strict=True) if not own]
        probability = float(weights[mine].sum())
        chance = min(best.chance, float(np.exp(-_slip(best))))
        if chance < INCOMPLETE:
            probability = doubted(probability, chance)
        none = best is silent and probability >= self.confidence
        status = Status.NO_CONTACT if none else None
        return self.stated(best, probability, status, others=others), best

    def _alike(self, one: Explanation, best: Explanation, silent: Explanation | None) -> bool:
        """Whether a reading of the best explanation is right as well if another one is.

        Their phases are nearly the same, and the total of the other one, where both have contacts,
        lies within what the best one states at the confidence.
        """
        if one is best:
            return True
        near = same_phase(one.phase, best.phase)
        if not near or one is silent or best is silent:
            return near
        other, own = (SkinResult(self.skin, which).total() for which in (one, best))
        off = np.array([*(other.force - own.force), other.centre[0] - own.centre[0]])
        known = own.covariance[np.ix_(STATED, STATED)]
        limit = chdtri(len(STATED), 1 - self.confidence)
        return bool(off @ np.linalg.solve(known, off) < limit)

    def stated(
        self,
        best: Explanation,
        probability: float,
        status: Status | None = None,
        tracked: bool = False,
        others: list[Explanation] | None = None,
        like: SkinResult | None = None,
    ) -> Reading:
        """The reading of an explanation.

        Parameters
        ----------
        best : Explanation
            The likeliest.
        probability : float
            Its weight.
        status : Status, optional
            The verdict; that of the probability if not given.
        tracked : bool
            Whether it was followed.
        others : list of Explanation, optional
            What explains the frame as well.
        like : SkinResult, optional
            Of an earlier frame, whose covariance is as good.
        """
        if status is None:
            status = Status.OK if probability >= self.confidence else Status.AMBIGUOUS
        if (detail := self._unseen(best.posterior.frame)) and status.trusted:
            status = Status.AMBIGUOUS
        result = SkinResult(self.skin, best, like)
        shape = self.forces_shape
        rivals = np.array([SkinResult(self.skin, one).forces for one in others or []])
        return Reading.of(
            forces=partial(getattr, result, "forces"),
            shape=shape,
            covariance=result.covariance,
            phase=partial(self._caused, best),
            chi2=best.top.square / max(best.top.count - best.posterior.model.at.loads, 1.0),
            status=status,
            detail=detail,
            probability=probability,
            alternatives=rivals.reshape(-1, *shape),
            tracked=tracked,
            contacts=() if status is Status.NO_CONTACT else result.contacts,
            total=result.total,
            traction=partial(result.traction, self.model.sensor.transducer.width),
            std=result.std,
        )

    def _unseen(self, frame: Array) -> str:
        """What is said of a frame, of pixels or bins of them, if no light shows some of the skin.

        Stresses reach as far along the clear layer as it is thick, beside what presses.
        """
        lines = np.isfinite(frame).reshape(len(self.uncertain.frame.bias), -1)
        seen = np.asarray(lines.any(axis=0))
        first, last = self.model.pixel_positions[[0, -1]]
        half, reach = self.skin.half, self.model.sensor.transducer.photoelastic.thickness
        if seen.all() and first < reach - half and last > half - reach:
            return ""
        places = np.linspace(first, last, len(seen))[seen]
        shown = np.concatenate([[-half - reach], places, [half + reach]])
        dark = np.flatnonzero(np.diff(shown) > 2 * reach)
        if not len(dark):
            return ""
        gaps = zip(shown[dark] + reach, shown[dark + 1] - reach, strict=True)
        parts = " and ".join(f"from {1e3 * a:.2g} to {1e3 * b:.2g} mm" for a, b in gaps)
        return f"No light shows what presses {parts}."

    def _caused(self, best: Explanation) -> Array:
        """Phase at the pixels that the contacts of an explanation cause, shape (n_pixels,) [rad].

        By its linearisation where the surface folds a little beyond it.
        """
        skin = self.skin if best.solved else self.skin.linear
        try:
            found = skin.phase(best.contacts)
        except InputError:
            model, unknowns = best.posterior.model, np.zeros_like(best.top.unknowns)
            own = np.r_[: model.at.loads, model.at.fields : len(unknowns) - len(best.others)]
            unknowns[own] = best.top.unknowns[own]
            found = node_phase(model, unknowns) - self.uncertain.frame.fixed
        return self.at_pixels(found)

    def _refused(self, frame: Array, lines: Lines, met: list[Explanation]) -> Reading:
        """The reading of a frame that nothing explains."""
        status = self.refusal(frame, lines)
        if met:
            return self.stated(met[0], 0.0, status)
        nothing = np.zeros(self.forces_shape)
        return Reading.of(
            forces=nothing,
            covariance=np.diag(np.full(nothing.size, np.inf)),
            phase=partial(np.zeros, self.model.sensor.camera.pixels),
            chi2=np.inf,
            status=status,
            probability=0.0,
        )


def goes_on(found: Explanation, last: Explanation) -> bool:
    """Whether contacts may be those of the frame before: within half their widths, as strong.

    Their phase must have moved so little that no mirror image is nearer.
    """
    here, there = found.contacts.geometry, last.contacts.geometry
    beside = np.abs(here - there)[:, PLACE] <= np.maximum(here, there)[:, WIDTH]
    now, before = found.contacts.forces[:, 0], last.contacts.forces[:, 0]
    alike = (now <= JUMPED * before) & (before <= JUMPED * now)
    return bool((beside & alike).all()) and motion(found.phase, last.phase) < JUMP


def _settled(one: Explanation) -> bool:
    """Whether an explanation is good enough to end the search for others."""
    return one.chance > SETTLED and not one.spoilt(0.0)


def _slip(one: Explanation) -> float:
    """How unlikely the friction cone makes contacts, minus the logarithm of that; 0 if within it.

    The prior of a search, for contacts that push as the pace of the fringes tells, says so of
    strong ones; the pace of a faint frame is that of noise.  This is for the largest that is found.
    """
    forces, friction = one.contacts.forces, one.posterior.prior.friction
    if not len(forces):
        return 0.0
    variance = np.diag(np.linalg.inv(one.about.hessian))[: forces.size].reshape(-1, 2)
    variance = variance @ [friction**2, 1.0] + (YIELDING * np.abs(forces).max()) ** 2
    beyond = np.minimum(friction * forces[:, 0] - np.abs(forces[:, 1]), 0.0)
    return float(np.square(beyond) @ (1 / variance) / 2)


def _likeliest(met: list[Explanation]) -> Explanation:
    return max(met, key=_mass)


def _mass(one: Explanation) -> float:
    """Logarithm of the posterior mass of an explanation."""
    return one.evidence - _slip(one)


def _ordered(met: list[Explanation]) -> list[Explanation]:
    return sorted(met, key=lambda one: (one.folded, one.top.loss))


def _distinct(met: list[Explanation], margin: float) -> list[Explanation]:
    """Explanations of different contacts, the likeliest first, whose evidence is not far less."""
    distinct = list[Explanation]()
    for one in sorted(met, key=lambda own: -own.evidence):
        if one.folded or (distinct and one.evidence <= distinct[0].evidence - margin):
            continue
        if not any(_same(one, known) for known in distinct):
            distinct.append(one)
    return distinct


def _same(one: Explanation, other: Explanation) -> bool:
    """Whether two explanations have the same contacts, as far as deviations tell."""
    if len(one.contacts.forces) != len(other.contacts.forces):
        return False
    a, b = one.contacts.sorted(), other.contacts.sorted()
    apart = np.abs(a.geometry[:, PLACE] - b.geometry[:, PLACE])
    return bool((apart < SAME_CONTACT * a.geometry[:, WIDTH]).all())
