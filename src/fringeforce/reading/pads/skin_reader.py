"""Frames of a pad's skin to readings: contacts anywhere, as many as there are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.arrays import Array, Mask
from fringeforce.estimation.covariance import covariance_of
from fringeforce.estimation.hypotheses import posterior_weights
from fringeforce.estimation.levenberg_marquardt import MOST_STEPS, Curvature
from fringeforce.estimation.residual_test import (
    FALSE_VERDICT,
    NEARLY_EXPLAINED,
    PLAIN,
    square_limit,
)
from fringeforce.models.creep import Crept
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_skin import FIRST_SHAPE, PLACE, SHAPE, SIZE_OF, PadSkinModel, matrix_of
from fringeforce.models.pad_skin_uncertainty import PadSkinUncertainty
from fringeforce.models.pad_uncertainty import PadUncertainty, uncertain
from fringeforce.reading.findings import Sized
from fringeforce.reading.frame_reader import FOLLOWING_STEPS
from fringeforce.reading.pads.departure_record import DepartureRecord
from fringeforce.reading.pads.departure_test import SkinDepartureTest
from fringeforce.reading.pads.fit import FIRST_STEPS
from fringeforce.reading.pads.light import Prior, expected_response
from fringeforce.reading.pads.pad_frames import PadFrames
from fringeforce.reading.pads.search import Search
from fringeforce.reading.pads.skin_fit import DENSE_REACH, SkinFit, SkinOptimum, SkinPlace
from fringeforce.reading.pads.skin_result import PadSkinResult
from fringeforce.reading.pads.skin_search import Patches
from fringeforce.reading.pads.verdict import FrameClassifier
from fringeforce.reading.reading import Reading, Status
from fringeforce.reading.skin_creep import SkinFrames, check_rest
from fringeforce.reading.skin_search import MOST_CONTACTS

COARSE_GAIN = 1e-3
"""Gain of the loss for a pixel that a step of contacts without shapes promises, below which shapes
join in."""
PROMISING_SQUARE = 4.0
"""Mean square that contacts without shapes leave, below which it is worth while to add these: those
of flat punches leave up to 2.6, and a long edge under 6 N 3.1."""
LIMITS = (0.7, 2.0), (0.9, 0.8), (1.4, 0.4), (2.2, 0.0), (3.5, 0.0), (6.0, 0.0)
"""Retardances of the pixels that count at first [rad], and how far beside them it is as low, in
thicknesses of the cover: what is far from a contact is below a quarter wave and tells its force and
place, then what is nearer its size.  Squares tell places to one or two thicknesses."""
NEARER = 4
"""Steps with each."""
SMALLER = 0.0, 0.4, 0.8
"""By which the logarithm of the sizes of contacts is lessened until what is far is explained."""
VAIN = 2
"""Divisions in a row that gain no more than noise makes, after which no more are tried: one alone
may end beside the contacts, as of a long edge."""
SAME_TOTAL = 5.0
"""Standard deviations of total force and centre up to which two explanations are one."""
UNSEEN_PART = "No light shows what presses on {share:.2g} % of the skin."


@dataclass(frozen=True, eq=False)
class Expected:
    """What the last frames let expect of the next one.

    Attributes
    ----------
    contacts : ndarray, shape (k, SIZE_OF)
        Where to follow it from.
    free : ndarray of bool, shape (k, SIZE_OF)
        Which of their unknowns are fitted.
    extra : ndarray, shape (q,)
        Unknowns of tolerances.
    prior : Prior, optional
        What is known of these; as stated if not given.
    probability : float
        Of the explanation that is followed.
    curvature : Curvature
        Used last.
    """

    contacts: Array
    free: Mask
    extra: Array
    prior: Prior | None
    probability: float
    curvature: Curvature


@dataclass(frozen=True, eq=False)
class PadSkinReader(PadFrames):
    """Reads frames of one pad's skin, each for itself."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.uncertain is not None:
            _ = self.uncertain.groups  # what cannot be allowed for is refused at once
        self.check_signed()

    def creep_filter(self, history: float) -> None:
        """None: what follows a skin knows the creep of earlier loads before it reads a frame."""
        check_rest(self, history)

    @cached_property
    def skin(self) -> PadSkinModel:
        """What contacts do."""
        return PadSkinModel(self.model.sensor)

    @cached_property
    def optics(self) -> PadModel:
        """The model with the depth profiles of the skin."""
        influence = replace(self.model.influence, profile=self.skin.profile.astype(float))
        return replace(self.model, influence=influence)

    @cached_property
    def uncertain(self) -> PadSkinUncertainty | None:
        """What is uncertain about the pad; none if nothing is."""
        if not uncertain(self.model.sensor):
            return None
        return PadSkinUncertainty(self.optics, skin=self.skin)

    @cached_property
    def _search(self) -> Search:
        if self.uncertain is None:
            return Search(self.model, self.response)
        squares = PadUncertainty.of(self.model)
        response = expected_response(self.response, squares)
        return Search(squares.model, response, squares.looseness, squares.still)

    @cached_property
    def _departures(self) -> SkinDepartureTest:
        return SkinDepartureTest(self.optics, self.skin)

    def search(self, levels: NDArray[Any], used: Mask, start: Array | None = None) -> Reading:
        """Read a frame that was checked, without an earlier state or from forces (n, 3) [N]."""
        return self.found(levels, used, start=start)[0]

    def found(
        self,
        levels: NDArray[Any],
        used: Mask,
        expected: Expected | None = None,
        start: Array | None = None,
        record: DepartureRecord | None = None,
        crept: Crept | None = None,
    ) -> tuple[Reading, SkinOptimum | None]:
        """Reading of a frame, and its contacts.

        Parameters
        ----------
        levels, used, start
            As of `search`.
        expected : Expected, optional
            What the last frames let expect; the frame is searched where following it fails.
        record : DepartureRecord, optional
            Of departures, in earlier frames.
        crept : Crept, optional
            What creep of earlier loads adds.
        """
        classifier = self.classifier(used)
        grey = classifier.filled(levels)
        fit = replace(self.fit(grey, classifier), crept=crept)
        if expected is not None:
            following = replace(fit, prior=expected.prior)
            start_at = following.at(following.limited(expected.contacts), expected.extra)
            one = following.climb(
                start_at, expected.free, FOLLOWING_STEPS, curvature=self.lasting(expected.curvature)
            )
            one = self._touching(following, one)
            if one is not None and not one.converged and self.explains(fit, classifier, one):
                one = following.climb(one.place, one.free, MOST_STEPS)
            if one is not None and one.converged and self.explains(fit, classifier, one):
                reading = self._stated(fit, one, expected.probability, tracked=True)
                if not (reading.ok and record is not None and record.due(one.place.modes)):
                    return reading, one
                if not self._departing(fit, one, record):
                    return reading, one
                # other contacts may explain the frame, which these have told nothing of
                record.forget()
        nothing = self._silence(fit)
        silent = classifier.noise(nothing.left.slope, 0)
        met = self._met(fit, classifier, silent, start)
        good = [one for one in met if self.explains(fit, classifier, one)]
        if silent and not any(
            nothing.left.loss - one.loss > _noise_makes(one.free) for one in good
        ):
            return self._nothing(fit, nothing.left.slope), None
        if not good:
            best = min(met, key=lambda one: one.loss, default=None)
            status = classifier.refusal(fit.frame)
            return self._refused(fit, best, status), None
        good.sort(key=lambda one: -self._mass(one))
        while len(good) > 1 and self._departing(fit, good[0]):
            del good[0]
        if shown := self._departing(fit, good[0], record):
            finding = self._departures.finding(shown)
            return self._refused(fit, good[0], Status.MODEL_MISMATCH, (finding,)), None
        weights = posterior_weights(np.array([self._mass(one) for one in good]))
        best = good[0]
        own = np.array([self._same(best, one) for one in good])
        reading = self._stated(
            fit,
            best,
            float(weights[own].sum()),
            others=[one for one, mine in zip(good, own, strict=True) if not mine],
        )
        return reading, best if reading.probability >= self.confidence else None

    def _departing(
        self, fit: SkinFit, one: SkinOptimum, record: DepartureRecord | None = None
    ) -> list[Sized]:
        """Departures that a frame shows beside contacts; creep would be taken for one."""
        return [] if self.relaxes else self._departures.shown(fit, one, record)

    def likeliest(self, levels: NDArray[Any], used: Mask) -> SkinOptimum | None:
        """The contacts that explain a checked frame best, if only roughly; none if none do."""
        classifier = self.classifier(used)
        met = self._met(self.fit(classifier.filled(levels), classifier), classifier)
        return min(met, key=lambda one: one.loss, default=None)

    def _met(
        self,
        fit: SkinFit,
        classifier: FrameClassifier,
        silent: bool = False,
        start: Array | None = None,
    ) -> list[SkinOptimum]:
        """Where a search ends, or a start, in turn; the last explain the frame if any do."""
        met, ends = list[SkinOptimum](), list[SkinOptimum]()
        starts = self._starts(fit, classifier) if start is None else iter([start])
        for forces in starts:
            own = self._pressed(fit, classifier, forces, silent, ends)
            met += own
            if silent or any(self.explains(fit, classifier, one) for one in own):
                break
            if own and any(self._again(own[0], end) for end in ends):
                break
            ends += own[:1]
        return met

    def fit(self, grey: Array, classifier: FrameClassifier) -> SkinFit:
        """The posterior of a frame, as a row of grey levels."""
        return SkinFit(self.optics, self.skin, self.response, grey, classifier.used, self.uncertain)

    def _silence(self, fit: SkinFit) -> SkinPlace:
        """No contact, with the unknowns of tolerances that explain a frame best without any."""
        none = np.zeros((0, SIZE_OF))
        if self.uncertain is None:
            return fit.without_contacts()
        free = none.astype(bool)
        found = fit.climb(none, free, FIRST_STEPS)
        if found.loss < PROMISING_SQUARE * len(fit.frame):
            found = fit.climb(fit.at(none, found.extra), free, MOST_STEPS)
        return fit.without_contacts(found.extra)

    def _touching(self, fit: SkinFit, one: SkinOptimum) -> SkinOptimum | None:
        """The same without contacts that noise may have made, or None if all are such."""
        gone = self._faint(one)
        if not gone.any() or gone.all():
            return None if gone.all() else one
        fewer = fit.climb(fit.at(one.contacts[~gone], one.extra), one.free[~gone], FOLLOWING_STEPS)
        return fewer if fewer.loss - one.loss < _noise_makes(one.free[gone]) else one

    def _faint(self, one: SkinOptimum) -> Mask:
        """Contacts whose force alone does not tell them from what noise makes, shape (k,)."""
        normal = np.zeros(one.free.size, dtype=bool)
        normal[::SIZE_OF] = True
        own = np.diag(one.curvature.covariance)[: one.free.sum()]
        variance = own[normal[one.free.ravel()]]
        limits = [_noise_makes(own) for own in one.free]
        return np.square(one.contacts[:, 0]) < limits * variance

    def _starts(self, fit: SkinFit, classifier: FrameClassifier) -> Iterator[Array]:
        for forces, _ in self._search.attempts(fit.frame, classifier.used):
            yield forces.reshape(-1, 3)

    def _pressed(
        self,
        fit: SkinFit,
        classifier: FrameClassifier,
        forces: Array,
        weak: bool,
        ends: list[SkinOptimum],
    ) -> list[SkinOptimum]:
        """What contacts that act about like forces on squares explain, as few as do.

        Where nothing may touch, the strongest alone is looked for, whose shape would not show.
        What was divided in vain before is not divided again.
        """
        patches = Patches.of(self.model.sensor, forces, self._least)
        if not patches.members:
            return []
        if weak:
            return [self._climbed(fit, patches.strongest.contacts, shapes=False)]
        met = [self._climbed(fit, patches.contacts)]
        if any(self._again(met[0], end) for end in ends):
            return met
        vain = 0
        while not self._plain(fit, classifier, met[-1]) and len(patches.members) < MOST_CONTACTS:
            divided = patches.divided(self._worst(fit, met[-1]))
            if divided is None:
                break
            patches = divided
            one, before = self._climbed(fit, patches.contacts), met[-1]
            gain = before.loss - one.loss
            if gain < 0:
                break
            met.append(one)
            # without shapes, what is left says little of how many there are
            shaped = _whole(before) and _whole(one)
            vain = vain + 1 if shaped and gain < _noise_makes(one.free[0]) else 0
            if vain == VAIN:
                break
        while self.explains(fit, classifier, met[-1]):
            fewer = self._without_weakest(fit, met[-1])
            if fewer is None or not self.explains(fit, classifier, fewer):
                break
            met.append(fewer)
        return met

    def _again(self, one: SkinOptimum, other: SkinOptimum) -> bool:
        """Whether two searches have ended at the same contacts, as far as noise tells."""
        alike = one.free.shape == other.free.shape and _whole(one) and _whole(other)
        near = alike and abs(one.loss - other.loss) < _noise_makes(one.free)
        return near and self._same(one, other)

    def _without_weakest(self, fit: SkinFit, one: SkinOptimum) -> SkinOptimum | None:
        """The same without its weakest contact, if that is faint, or beside another.

        Where the first start was far off, a division finds the contact and leaves another beside.
        """
        weak = int(one.contacts[:, 0].argmin())
        rest = np.delete(one.contacts, weak, axis=0)
        if not len(rest):
            return None
        apart = np.linalg.norm(rest[:, PLACE:SHAPE] - one.contacts[weak, PLACE:SHAPE], axis=1)
        reach = [np.linalg.norm(matrix_of(c[SHAPE:FIRST_SHAPE]), 2) for c in one.contacts]
        near = DENSE_REACH * self._cover + reach[weak] + np.delete(reach, weak)
        if (apart > near).all() and not self._faint(one)[weak]:
            return None
        rest[int((apart - near).argmin()), :PLACE] += one.contacts[weak, :PLACE]
        return fit.climb(fit.at(rest, one.extra), np.ones(rest.shape, dtype=bool), FOLLOWING_STEPS)

    @cached_property
    def _least(self) -> float:
        """Force whose largest retardance is as the noise of one pixel [N]."""
        noise = np.sqrt(self.response.variance) / np.max(self.response.amplitude)
        return float(noise / self._search.strongest)

    def _worst(self, fit: SkinFit, one: SkinOptimum) -> int:
        """The contact beside which most is left."""
        x, y = self.model.pixel_positions
        left = np.square(one.place.left.slope).reshape(-1, len(y), len(x)).sum(axis=0)
        left -= left.mean()
        sums = []
        for contact in one.contacts:
            matrix = matrix_of(contact[SHAPE:FIRST_SHAPE]) + DENSE_REACH * self._cover * np.eye(2)
            t = np.stack(np.meshgrid(x - contact[PLACE], y - contact[PLACE + 1]), axis=-1)
            inside = np.square(t @ np.linalg.inv(matrix)).sum(axis=-1) < 1
            sums.append(float(left[inside].sum()))
        return int(np.argmax(sums))

    def _plain(self, fit: SkinFit, classifier: FrameClassifier, one: SkinOptimum) -> bool:
        """Whether contacts leave plainly nothing but noise."""
        return classifier.noise(one.place.left.slope, one.taken(fit), PLAIN)

    @property
    def _cover(self) -> float:
        return self.model.sensor.transducer.compliant.thickness

    def _climbed(self, fit: SkinFit, contacts: Array, shapes: bool = True) -> SkinOptimum:
        """Contacts without shapes first, then, if that is promising and wanted, with them."""
        free = np.zeros(contacts.shape, dtype=bool)
        free[:, :FIRST_SHAPE] = True
        pixels, (here, left) = len(fit.frame), self._far(fit, contacts, free)
        for limit in LIMITS[1:]:
            if left > PROMISING_SQUARE:
                return fit.climb(here, free, 1)
            here, left = self._below(fit, here, free, limit)
        one = fit.climb(here, free, MOST_STEPS, close=COARSE_GAIN * pixels)
        if not shapes or one.loss > PROMISING_SQUARE * pixels:
            return one
        return fit.climb(one.place, np.ones(contacts.shape, dtype=bool), MOST_STEPS)

    def _far(self, fit: SkinFit, contacts: Array, free: Mask) -> tuple[SkinPlace, float]:
        """Contacts that explain what is far from them, where nothing is ambiguous, and how well.

        Those that are taken for too large leave too little out, and smaller ones are tried.
        """
        tried = list[tuple[SkinPlace, float]]()
        for smaller in SMALLER:
            start = contacts.copy()
            start[:, SHAPE] -= smaller
            tried.append(self._below(fit, fit.at(fit.limited(start)), free, LIMITS[0]))
            if tried[-1][1] < NEARLY_EXPLAINED:
                break
        return min(tried, key=lambda one: one[1])

    def _below(
        self, fit: SkinFit, here: SkinPlace, free: Mask, limit: tuple[float, float]
    ) -> tuple[SkinPlace, float]:
        """Contacts after some steps by the pixels below a retardance, and what they leave there."""
        far = fit.below(here, limit[0], limit[1] * self._cover)
        few, count = replace(fit, used=far), max(int(far.sum()), 1)
        one = few.climb(few.at(here.contacts, here.extra), free, NEARER, close=COARSE_GAIN * count)
        return fit.at(one.contacts, one.extra), one.loss / count

    def explains(self, fit: SkinFit, classifier: FrameClassifier, one: SkinOptimum) -> bool:
        """Whether contacts leave nothing but noise."""
        return classifier.noise(one.place.left.slope, one.taken(fit))

    def _mass(self, one: SkinOptimum) -> float:
        """Logarithm of the posterior mass about an explanation, by Laplace's approximation."""
        _, std = self.skin.drawn(len(one.contacts))
        _, size = np.linalg.slogdet(one.curvature.information)
        return -(one.loss + float(size)) / 2 - float(np.log(std[one.free]).sum())

    def _same(self, one: SkinOptimum, other: SkinOptimum) -> bool:
        """Whether two explanations have the same total, as far as deviations tell."""
        totals = [self._result(each).total() for each in (one, other)]
        std = np.maximum(totals[0].std, totals[1].std)[[0, 1, 2, 6, 7]]
        first, second = (np.concatenate([total.force, total.centre]) for total in totals)
        return bool((np.abs(first - second) < SAME_TOTAL * std).all())

    def _result(self, one: SkinOptimum, fit: SkinFit | None = None) -> PadSkinResult:
        """What is stated of an explanation; with what creep leaves uncertain if a fit is given."""

        def joint() -> Array:
            whole = np.zeros((one.free.size,) * 2)
            own = np.flatnonzero(one.free)
            whole[np.ix_(own, own)] = one.curvature.covariance[: len(own), : len(own)]
            if fit is not None and fit.crept is not None:
                change = fit.by_creep(one)[: len(own)]
                whole[np.ix_(own, own)] += change @ change.T
            return whole

        return PadSkinResult(self.model.sensor, one.contacts, joint)

    def _stated(
        self,
        fit: SkinFit,
        one: SkinOptimum,
        probability: float,
        status: Status | None = None,
        tracked: bool = False,
        others: list[SkinOptimum] | None = None,
        findings: tuple[str, ...] = (),
    ) -> Reading:
        if status is None:
            status = Status.OK if probability >= self.confidence else Status.AMBIGUOUS
        if (detail := self._unseen(fit)) and status.trusted:
            status = Status.AMBIGUOUS
        result = self._result(one, fit)
        left = one.place.left.slope
        count = len(left) if fit.used is None else int(fit.used.sum())
        rivals = np.array([self._result(other).forces for other in others or []])
        return Reading.of(
            forces=result.forces,
            covariance=result.covariance,
            phase=partial(self._retardance, fit, one),
            chi2=float(left @ left) / max(count - one.taken(fit), 1),
            status=status,
            detail=detail,
            probability=probability,
            alternatives=rivals.reshape(-1, *result.forces.shape),
            tracked=tracked,
            findings=findings,
            contacts=result.contacts,
            total=result.total,
            traction=result.traction,
            std=result.std,
        )

    def _retardance(self, fit: SkinFit, one: SkinOptimum) -> Array:
        whole = 2 * self.skin.profile.sum(axis=0)
        return np.einsum("k,fkrc->frc", whole, one.place.modes).astype(float)

    def _unseen(self, fit: SkinFit) -> str:
        """What is said of a frame if no light shows some of the skin."""
        unseen = self.classifier(self.usable(None) if fit.used is None else fit.used).unseen
        return UNSEEN_PART.format(share=1e2 * unseen.mean()) if unseen.any() else ""

    def _nothing(self, fit: SkinFit, left: Array) -> Reading:
        forces, none = np.zeros(self.forces_shape), np.zeros((0, SIZE_OF))
        result = PadSkinResult(self.model.sensor, none, lambda: np.zeros((0, 0)))
        detail = self._unseen(fit)
        return Reading.of(
            forces=forces,
            covariance=np.zeros((forces.size, forces.size)),
            phase=partial(self.model.retardance, forces),
            chi2=float(np.square(left).mean()),
            status=Status.AMBIGUOUS if detail else Status.NO_CONTACT,
            detail=detail,
            total=result.total,
            traction=result.traction,
        )

    def _refused(
        self,
        fit: SkinFit,
        best: SkinOptimum | None,
        status: Status,
        findings: tuple[str, ...] = (),
    ) -> Reading:
        if best is not None:
            return self._stated(fit, best, 0.0, status, findings=findings)
        forces = np.zeros(self.forces_shape)
        return Reading.of(
            forces=forces,
            covariance=np.diag(np.full(forces.size, np.inf)),
            phase=partial(self.model.retardance, forces),
            chi2=np.inf,
            status=status,
            probability=0.0,
        )

    def bound(self, forces: ArrayLike) -> Array:
        """Smallest deviations that an unbiased reading of squares can have, shape (n, 3) [N].

        Infinite where nothing presses.
        """
        loads = self.model.checked(forces, single=True)
        patches = Patches.of(self.model.sensor, loads)
        if not patches.members:  # what small forces change depends on where they are
            return np.full(self.forces_shape, np.inf)
        fit = self.fit(np.zeros(self.pixels), self.classifier(self.usable(None)))
        contacts = patches.contacts
        free = np.ones(contacts.shape, dtype=bool)
        place = fit.at(contacts)
        joint = covariance_of(fit.information(place, free))[: free.size, : free.size]
        return PadSkinResult(self.model.sensor, contacts, lambda: joint).std()


def _whole(one: SkinOptimum) -> bool:
    """Whether all unknowns of contacts were fitted, their shapes as well."""
    return bool(one.free.all())


def _moved(here: SkinOptimum, change: Array) -> Array:
    """What forces, places and sizes make of a change of contacts, shape (k, SIZE_OF).

    Shapes of pressures, of which one frame tells little, change by noise.
    """
    moving = np.zeros(here.free.shape, dtype=bool)
    moving[:, :FIRST_SHAPE] = True
    which, count = moving[here.free], int(here.free.sum())
    known = here.curvature.information[:count, :count][which]
    found = np.zeros(moving.shape)
    found[here.free & moving] = np.linalg.solve(known[:, which], known @ change[here.free])
    return found


def _kept(here: SkinOptimum, change: Array, earlier: Array | None) -> float:
    """Share of the last change of contacts that the next is expected to have.

    It is the share of the change before it that the last one had, as far as noise tells: of a
    steady motion all, of noise nothing.
    """
    if earlier is None or earlier.shape != change.shape:
        return 0.0
    count = int(here.free.sum())
    known = here.curvature.information[:count, :count]
    last, first = change[here.free], earlier[here.free]
    return float(np.clip((last @ known @ first) / max(first @ known @ first, 1.0), 0.0, 1.0))


def _noise_makes(free: Mask) -> float:
    """What contacts that noise alone makes gain of the loss at most, as of `FALSE_VERDICT`."""
    return square_limit(float(free.sum()), FALSE_VERDICT)


class PadSkinFollower(SkinFrames):
    """Follows the frames of a pad's skin from the contacts of the last one.

    Parameters
    ----------
    single : PadSkinReader
        What searches.
    """

    def __init__(self, single: PadSkinReader) -> None:
        self._single = single
        super().__init__(single)

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the harmonics of tractions."""
        return self._single.skin.loads(np.zeros((0, SIZE_OF))).shape

    def caused(self, reading: Reading) -> Array | None:
        """Harmonics of the tractions of the last contacts, shape (3, m, n) [N]."""
        if self._last is None:
            return None
        return self._single.skin.loads(self._last.contacts).astype(float)

    def shows(self, crept: Crept) -> bool:
        """Whether noise does not hide what creep adds to a frame without contacts."""
        single, none = self._single, np.zeros((0, SIZE_OF))
        fit = single.fit(np.zeros(single.pixels), single.classifier(single.usable(None)))
        with_it, without = (replace(fit, crept=own).at(none).level for own in (crept, None))
        square = float((np.square(with_it - without) / single.response.variance).sum())
        return square > square_limit(1, FALSE_VERDICT)

    def reset(self) -> None:
        """Forget the last readings: the next frame is searched."""
        self._last: SkinOptimum | None = None
        self._change: Array | None = None
        self._expected: Expected | None = None
        self._record = DepartureRecord()

    def read(self, levels: NDArray[Any], used: Mask) -> Reading:
        """Read the next frame, which was checked, shape (P,)."""
        expected = self._expected
        reading, here = self._single.found(
            levels, used, expected, record=self._record, crept=self.crept
        )
        before, self._last = self._last, here
        if here is None:
            self._expected = None
            return reading
        known, prior = self._single.uncertain, None
        if known is not None:
            told = None if expected is None or not reading.tracked else expected.prior
            first = told or Prior.stated(known)
            # a matrix that served before has told already
            fresh = expected is None or here.curvature is not expected.curvature
            prior = first.after(known, here.extra, here.curvature if fresh else None)
        earlier, self._change = self._change, None
        ahead = here.contacts
        if before is not None and reading.tracked and len(before.contacts) == len(ahead):
            self._change = _moved(here, here.contacts - before.contacts)  # none has gone
            ahead = ahead + _kept(here, self._change, earlier) * self._change
        extra = here.extra if prior is None else prior.mean
        self._expected = Expected(
            ahead, here.free, extra, prior, reading.probability, here.curvature
        )
        return reading
