"""One frame of a strip to one reading, with all that is uncertain about the strip estimated."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh

from fringeforce.base.blas_threads import one_blas_thread
from fringeforce.base.errors import InputError
from fringeforce.contacts.friction_cone import within_friction_cone
from fringeforce.contacts.loads import checked_loads
from fringeforce.estimation.bad_pixels import isolated
from fringeforce.estimation.faint_light import faint_light
from fringeforce.estimation.followed_frames import JUMP
from fringeforce.estimation.frame_exposure import expose, node_phase
from fringeforce.estimation.frame_loss import Prior, pulls_at
from fringeforce.estimation.frame_model import FrameModel
from fringeforce.estimation.hypotheses import mixture
from fringeforce.estimation.information_filter import Undecided
from fringeforce.estimation.likelihood import NO_BIAS
from fringeforce.estimation.linearised_frame import (
    Linearised,
    linearise,
)
from fringeforce.estimation.phase_stretches import NOTHING, Hidden, crossed, sides_of
from fringeforce.estimation.posterior import (
    PRIOR_ROUNDS,
    Bins,
    Posterior,
    Top,
)
from fringeforce.estimation.residual_test import FALSE_ALARM, FALSE_VERDICT, square_limit
from fringeforce.estimation.uncertain_contacts import profile_basis
from fringeforce.models.line_moments import REGISTRATION
from fringeforce.reading.calibration_uncertainty import CalibrationUncertainty
from fringeforce.reading.contact_prior import (
    FRICTION,
    SHEAR_RATIO,
    contact_prior,
    push_of,
    unseen,
    unseen_words,
    widened,
)
from fringeforce.reading.departure_test import HARMLESS, DepartureTest
from fringeforce.reading.frame_light import Lines
from fringeforce.reading.frame_reader import FOLLOWING_STEPS
from fringeforce.reading.large_strain import SOLUTIONS, HigherOrders, StrainShift
from fringeforce.reading.nearby_sensor import centre_near, off
from fringeforce.reading.posterior_search import (
    BINS,
    FIRST_EFFORTS,
    PosteriorSearch,
)
from fringeforce.reading.reading import Reading, Status
from fringeforce.reading.strip_explanations import (
    Explanations,
    Weighed,
    held,
    not_too_wide,
    one_reading,
)
from fringeforce.reading.strip_frames import (
    HOPELESS_LOSS,
    MISSED,
    STILL_MISSED,
    StripFrames,
    doubted,
)
from fringeforce.reading.strip_search import IMAGES, StripFrameSearch, friction_is_idle, is_faint
from fringeforce.reading.tactel_aliases import TactelAlias

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

NARROWER = 1.3
"""How far the push of a prior is beyond the loads that were found where it is drawn up anew: wider
ones make forces uncertain that are small, and narrower ones hold them down."""
WIDENED = 0.05
"""Share of a standard deviation within which stated ones hold."""
TOLERATED_SOLVED = 0.1
"""What the model leaves of large strain where it was solved, over the deviations of forces by the
noise, root mean square over them, up to which it is not solved again, which leaves a tenth: half a
percent.  Where it was not solved, what is `HARMLESS` is a part of the deviations."""
MOVES = 3
"""Times that a frame is read again with products that are exact nearer to what was found."""
SENSORS = 8
"""Sensors, as found, of which a reader keeps what makes their frames."""
MOST_LEFT = np.pi
"""Phase beyond the second order that is not corrected: the loads are of another fringe [rad]."""
FOLDED = (
    "Large strain: under these loads the phase beyond the second order is not known, for the "
    "surface folds or no solution is near."
)


@dataclass(frozen=True, eq=False)
class Located:
    """From where the next frame can be followed.

    Attributes
    ----------
    posterior : Posterior
        Of the frame.
    top : Top
        The likeliest explanation.
    covariance : ndarray, shape (2n, 2n)
        Of its loads [N^2].
    offset : ndarray, shape (2n,)
        Loads of the reading beyond those of the top [N]: it is the mean of all explanations of its
        phase.
    between : ndarray, shape (2n, 2n)
        Covariance of these about their mean, and of what else the reading holds [N^2].
    reader : StripFrameReader
        Which read it.
    """

    posterior: Posterior
    top: Top
    covariance: Array
    offset: Array
    between: Array
    reader: StripFrameReader

    @property
    def several(self) -> bool:
        """Whether other explanations are so far off that they widen some deviation by `WIDENED`."""
        if not self.between.any():
            return False
        last = [len(self.offset) - 1] * 2
        widest = eigh(self.between, self.covariance, eigvals_only=True, subset_by_index=last)
        return bool(widest[0] > (1 + WIDENED) ** 2 - 1)


@dataclass(frozen=True, eq=False)
class Before:
    """What is known before a frame.

    Attributes
    ----------
    unknowns : ndarray, shape (size,), or None
        Of the last frame, if it is to be followed.
    frames : sequence of ndarray, shape (P,)
        Grey levels of the last frames that were read, of the same pixels, the last one last.
    undecided : Undecided, or None
        Where the phase may be another than what goes on from the last frame; None if anywhere.
    centre : mapping
        Values about which the last frame was read, as of `Uncertainty.centre`.
    """

    unknowns: Array | None = None
    frames: Sequence[NDArray[Any]] = ()
    undecided: Undecided | None = None
    centre: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class StripFrameReader(StripFrames):
    """Reads frames of one strip, each for itself."""

    _sensors: dict[tuple[Any, ...], StripFrameReader] = field(default_factory=dict)

    @property
    def influence(self) -> Array:
        """Influence matrix at the pixels of a frame, shape (P, 2n) [rad/N]."""
        return self.model.frame_influence

    @cached_property
    def calibration_uncertainty(self) -> CalibrationUncertainty | None:
        """What the calibration leaves uncertain, if there was one."""
        return CalibrationUncertainty.left_in(self.model)

    @cached_property
    def higher_orders(self) -> HigherOrders | None:
        """What the second order leaves of large strain; none of small strain."""
        finite = len(self.uncertain.frame.curvature) > 0
        return HigherOrders(self.model, self.uncertain) if finite else None

    @cached_property
    def _search(self) -> PosteriorSearch:
        centre = None if self.centre is None else off(self.uncertain)
        return PosteriorSearch(self.uncertain.frame, centre)

    @cached_property
    def _frame_search(self) -> StripFrameSearch:
        return StripFrameSearch(self._search, self._hidden)

    @cached_property
    def _alias(self) -> TactelAlias | None:
        """Other tactels that look alike, if the camera may be shifted."""
        sensor, modes = self.model.sensor, self.uncertain.modes
        shift = [number for number, mode in enumerate(modes) if mode.name == REGISTRATION[0]]
        if not shift:
            return None
        pitch = sensor.tactels.pitch / sensor.tolerances[REGISTRATION[0]]
        return TactelAlias(self.uncertain.frame.at.modes + shift[0], pitch, (sensor.tactels.count,))

    def _nearer(self, met: Explanations, top: Top) -> StripFrameReader:
        """What reads with products that are exact near a top; itself where they are small."""
        near = partial(met.near, top)
        centre = centre_near(self.uncertain, self.beside, top.unknowns, near)
        return self if centre is None else self._about(centre)

    def _about(self, centre: Mapping[str, float]) -> StripFrameReader:
        """What reads with products that are exact at other values, as of `Uncertainty.centre`."""
        if centre == self.uncertain.centre:
            return self
        key, kept = (self.noise, *centre.items()), self._sensors
        if (nearer := kept.get(key)) is None:  # threads share what is kept
            nearer = replace(self, centre=self.uncertain.about(centre))
            for oldest in list(kept)[: len(kept) + 1 - SENSORS]:
                kept.pop(oldest, None)
            kept[key] = nearer
        return nearer

    @cached_property
    def _profiles(self) -> Array:
        return profile_basis(self.uncertain.frame)

    @cached_property
    def mirrored(self) -> Hidden:
        """What noise hides of a phase; nothing where light tells it from mirror images."""
        biased = np.abs(np.sin(self.uncertain.frame.bias)).max() > NO_BIAS
        return NOTHING if biased else self._hidden

    @cached_property
    def _hidden(self) -> Hidden:
        model, strip = self.uncertain.frame, self.model.sensor.transducer
        # the phase is smooth over as many pixels as the cover is thick
        smooth = strip.compliant.thickness / strip.length * self.model.frame_shape[-1]
        return Hidden.beside(model, smooth)

    @property
    def hidden(self) -> float:
        """Difference of two phases about a multiple of pi that noise hides [rad]."""
        return self._hidden.difference

    def trial(self, share: float, rng: np.random.Generator) -> NDArray[Any]:
        """A frame of a share of a newton on every tactel."""
        forces = np.tile([share, 0.0], (self.model.sensor.tactels.count, 1))
        return self.model.expose(forces, rng, strain="linear")

    @cached_property
    def _bins(self) -> Bins:
        return Bins(self.uncertain.frame)

    def posterior(self, frame: Array, push: float, sound: Array | None = None) -> Posterior:
        """Posterior of a frame whose contacts push with about this force [N]."""
        loads = np.tile([push, SHEAR_RATIO * push], self.uncertain.frame.at.loads // 2)
        prior = contact_prior(self.uncertain.frame, push, self._friction)
        return Posterior(self.uncertain.under(loads), prior, frame, self._bins, sound)

    @property
    def _friction(self) -> float:
        """Friction of the prior; a stated one that is too narrow would leave no explanation."""
        stated = self.friction if self.beside else None
        return stated or FRICTION

    @property
    def beside(self) -> bool:
        """Whether places or widths of contacts are uncertain."""
        at = self.uncertain.frame.at
        return at.fields > at.place

    def alone(self, levels: NDArray[Any], used: Mask) -> Reading:
        """Read a frame that was checked, without any earlier state."""
        return self.followed(levels, used)[0]

    @one_blas_thread()
    def followed(
        self,
        levels: NDArray[Any],
        used: Mask,
        before: Before | None = None,
    ) -> tuple[Reading, Located | None]:
        """Read a frame that was checked, from the last one if it is to be followed.

        Parameters
        ----------
        levels, used
            As of `search`.
        before : Before, optional
            What is known before it; nothing if not given.

        Returns
        -------
        reading : Reading
            Of the frame.
        located : Located, or None
            From where the next one can be followed, if this one is explained.
        """
        before = before or Before()
        reader = self if before.unknowns is None else self._about(before.centre)
        return reader._followed(levels, used, before, MOVES)

    def _followed(
        self,
        levels: NDArray[Any],
        used: Mask,
        before: Before,
        moves: int,
        known: Sequence[Top] = (),
    ) -> tuple[Reading, Located | None]:
        frame = np.where(used, levels.astype(float), np.nan)
        # single pixels that nothing explains would spoil the means over blocks; fits bear them
        alone = isolated(levels.astype(float), self.model.response)
        sound = np.where(alone, np.nan, frame)
        lines = self._search.light.lines(sound)
        posterior = self._own(frame, lines, sound)
        if (last := before.unknowns) is not None:
            posterior = self._centred(posterior, last)
            top = posterior.climbed(last, heats=(), steps=(0, FOLLOWING_STEPS))
            if (met := self._onward(posterior, top, last, before.undecided)) is not None:
                return self._stated(met, tracked=True, earlier=before.frames)
        silent = self._silent(posterior)
        if silent is not None and self._plainly_nothing(posterior, silent):
            return self._stated(Explanations(posterior, [silent]), Status.NO_CONTACT)
        met = self._frame_search.explained(posterior, lines, silent, known=known)
        if moves and met.promising:
            nearer = self._nearer(met, (met.tops or met.rough)[0])
            if nearer is not self:
                anew = replace(before, unknowns=None)
                # errors of shape may have another number of modes there
                alike = nearer.uncertain.frame.at == self.uncertain.frame.at
                return nearer._followed(levels, used, anew, moves - 1, met.rough if alike else ())
        for _ in range(SOLUTIONS if self.higher_orders else 0):
            exact = self._centred(posterior, *met.best)
            if exact is posterior:
                break
            posterior, before_it = exact, met
            met = self._frame_search.explained(posterior, lines, silent)
            if not met.explained and met.loss >= before_it.loss:
                break
        if not self.beside and not (met.explained and friction_is_idle(met)):
            any_loads = posterior.under(posterior.prior._replace(friction=-1.0))
            other = self._frame_search.explained(any_loads, lines, silent, FIRST_EFFORTS)
            met = other if other.explained else met
        if not met.explained:
            return self._refused(posterior, lines), None
        met = self._narrowed(met)
        if silent is not None and self._nothing(silent, met.tops[0]):
            met = Explanations(posterior, [silent])
            return self._stated(met, Status.NO_CONTACT)
        if self.uncertain.shapes:
            posterior = met.posterior
            loads = met.tops[0].unknowns[: posterior.model.at.loads]
            model = self.uncertain.under(loads)._replace(fixed=posterior.model.fixed)
            posterior = replace(posterior, model=model)
            met = Explanations(posterior, [posterior.settled(top.unknowns) for top in met.tops])
        met.relight()
        for nearer, there, top in self._on_other_tactels(met, lines):
            if moves and there.mass(top) > met.posterior.mass(met.tops[0]):
                anew = replace(before, unknowns=None)
                return nearer._followed(levels, used, anew, moves - 1, [top])
            met.elsewhere.append((there, top))
        reading, located = self._stated(met, earlier=before.frames)
        if reading.ok and (said := self._departing(located.posterior, located.top)):
            return reading.departing(said), None
        return reading, located

    def _on_other_tactels(
        self, met: Explanations, lines: Lines
    ) -> Iterator[tuple[StripFrameReader, Posterior, Top]]:
        """Explanations on other tactels, under a camera that is shifted as much.

        With posteriors that are exact where they are, and what reads there.
        """
        if self._alias is None:
            return
        posterior, best, shift = met.posterior, met.tops[0].unknowns, self._alias.shift
        prior, loads = posterior.prior, posterior.model.at.loads

        def loss(unknowns: Array) -> float:
            return float(prior.precision[shift] * (unknowns[shift] - prior.mean[shift]) ** 2)

        for own, start in self._alias.images(best[:loads], best, loss):
            start[:loads] = own
            top = posterior.climbed(start, heats=(), steps=(0, FOLLOWING_STEPS))
            if top.loss > HOPELESS_LOSS * len(posterior.frame):
                continue
            nearer = self._nearer(met, top)
            if nearer is not self and nearer.uncertain.frame.at == self.uncertain.frame.at:
                there = nearer._own(posterior.frame, lines, posterior.sound).under(prior)
                yield nearer, there, there.settled(top.unknowns)
            else:
                yield self, posterior, top

    def _onward(
        self, posterior: Posterior, top: Top, last: Array, undecided: Undecided | None
    ) -> Explanations | None:
        """A top that goes on from the unknowns of the last frame, with its rivals; or none.

        Mirror images of its phase may be likelier than what went on from the last frame.
        """
        phase, met = posterior.phase(top), Explanations(posterior, [top])
        before = node_phase(posterior.model, last)
        if np.abs(phase - before).max() > JUMP or is_faint(posterior, top):
            return None
        if not self._tolerated(posterior, top.unknowns) or not met.explains(top, FALSE_VERDICT):
            return None
        if np.isfinite(self.mirrored.difference):
            within, rival = undecided or (None, None)
            for start in (top.unknowns,) if rival is None else (top.unknowns, rival):
                met.keep(posterior.settled(start, BINS))
            self._frame_search.improve(met, met.rough[0], stop=False, within=within)
            met.settle()
        near = np.abs(posterior.phase(met.tops[0]) - before).max() <= JUMP
        return met if near and met.explains(met.tops[0], FALSE_VERDICT) else None

    def images(
        self, model: FrameModel, prior: Prior, frame: Array, top: Top, within: Mask
    ) -> Array:
        """Starts in which a top's phase is mirrored within some nodes, shape (k, size)."""
        posterior = Posterior(model, prior, frame, self._bins)
        return self._search.images(posterior, top, push_of(prior), within)[:IMAGES]

    def _departing(self, posterior: Posterior, top: Top) -> str:
        """What a frame that loads explain shows of departures all the same.

        What a calibration leaves uncertain is none of the unknowns, and would be taken for one; so
        would motion in the mean of many frames.
        """
        if self.calibration_uncertainty is not None or self.noise != 1.0:
            return ""
        return self._departures.finding(posterior, top)

    @one_blas_thread()
    def departing(self, levels: NDArray[Any], used: Mask, unknowns: Array) -> str:
        """What a frame that was followed shows of departures, in words; nothing if it shows none.

        Parameters
        ----------
        levels, used
            As of `search`.
        unknowns : ndarray, shape (size,)
            What explains it.
        """
        posterior = self._centred(
            self.own_posterior(np.where(used, levels.astype(float), np.nan)), unknowns
        )
        top = posterior.climbed(unknowns, heats=(), steps=(0, FOLLOWING_STEPS))
        return self._departing(posterior, top)

    @cached_property
    def _departures(self) -> DepartureTest:
        return DepartureTest(self.model, self.uncertain)

    def quieter(self, noise: float) -> StripFrameReader:
        """What reads means of frames, whose noise has so large a share of one frame's variance."""
        if noise not in self._quieter:
            self._quieter[noise] = replace(self, noise=noise)
        return self._quieter[noise]

    @cached_property
    def _quieter(self) -> dict[float, StripFrameReader]:
        return {}

    def own_posterior(self, frame: Array) -> Posterior:
        """Posterior of a frame by itself, shape (P,); not finite where a pixel is not used."""
        return self._own(frame, self._search.light.lines(frame))

    def explanations(self, frame: Array, attempts: int, mend: bool) -> tuple[Posterior, list[Top]]:
        """What some attempts find in a frame, the best first, whether it explains it or not."""
        lines = self._search.light.lines(frame)
        posterior = self._own(frame, lines)
        return posterior, self._frame_search.found(posterior, lines, attempts, mend).tops

    def _own(self, frame: Array, lines: Lines, sound: Array | None = None) -> Posterior:
        pace, _ = self._search.light.true_pace(lines, lines.light)
        return self.posterior(frame, self._search.pushing(pace), sound=sound)

    def _silent(self, posterior: Posterior) -> Top | None:
        """No contact, if that explains the frame."""
        at = posterior.model.at
        alone = posterior.without()
        rough = alone.settled(np.zeros(at.size), BINS, rounds=1)
        if rough.loss > HOPELESS_LOSS * len(posterior.frame) / BINS:
            return None
        top = alone.climbed(rough.unknowns, heats=(), steps=(0, 15))
        return top if top.chance > FALSE_ALARM else None

    @cached_property
    def _least_contact(self) -> float:
        """How much better than no contact loads must explain a frame to be one."""
        return square_limit(self.uncertain.frame.at.loads, FALSE_VERDICT)

    def _nothing(self, silent: Top, best: Top) -> bool:
        return silent.loss - best.loss < self._least_contact

    def _plainly_nothing(self, posterior: Posterior, silent: Top) -> bool:
        """Whether no loads can explain a frame so much better than no contact, whatever they are.

        Loads so large that they are not faint would leave far more than noise of no contact.
        """
        if np.abs(posterior.phase(silent) - posterior.model.fixed).max() > self.hidden:
            return False
        left = self._faint_light @ pulls_at(posterior.model, posterior.frame, silent.unknowns)
        return float(left @ left) < self._least_contact

    @cached_property
    def _faint_light(self) -> Array:
        return faint_light(self.uncertain.frame, self.hidden)

    def _centred(self, posterior: Posterior, unknowns: Array | None = None) -> Posterior:
        """The posterior of a model that is exact at loads, where it is not as good as that."""
        if self.higher_orders is None or unknowns is None:
            return posterior
        loads = unknowns[: posterior.model.at.loads]
        left = self.higher_orders.left(loads, posterior.centre)
        share = HARMLESS if posterior.centre is None else TOLERATED_SOLVED
        if np.abs(left).max() > MOST_LEFT or self._tolerated(posterior, unknowns, share):
            return posterior
        return self.solved_at(posterior, loads)

    def solved_at(self, posterior: Posterior, loads: Array) -> Posterior:
        """The posterior with large strain solved at loads (2n,) [N]; as it is of small strain.

        And where the surface folds under them.
        """
        if self.higher_orders is None:
            return posterior
        try:
            phase = self.higher_orders.phase(loads)
        except InputError:
            return posterior
        model = posterior.model._replace(fixed=self.uncertain.frame.fixed + phase)
        return replace(posterior, model=model, centre=loads)

    def strain_shift(self, posterior: Posterior, unknowns: Array) -> StrainShift | None:
        """How far large strain moves loads near those of an explanation; none if it is small."""
        if self.higher_orders is None:
            return None
        about = Linearised(*linearise(posterior.model, posterior.prior, posterior.frame, unknowns))
        return self.higher_orders.shift(about, posterior.model, unknowns, posterior.centre)

    def _tolerated(self, posterior: Posterior, unknowns: Array, share: float = HARMLESS) -> bool:
        """Whether large strain moves an explanation's loads by less than a share of the noise."""
        shift = self.strain_shift(posterior, unknowns)
        return shift is None or shift.share(unknowns[: posterior.model.at.loads]) < share

    def _narrowed(self, met: Explanations) -> Explanations:
        """Explanations under a prior that is no wider than the loads of the best one.

        The pace of the fringes is that of noise where loads are faint.  What the frame tells of the
        size of the loads is the expectation of their square (Dempster, Laird and Rubin, J. Roy.
        Stat. Soc. B 39, 1, 1977).
        """
        for _ in range(PRIOR_ROUNDS):  # loads that the frame hardly tells shrink with their prior
            posterior, top = met.posterior, met.tops[0]
            loads = slice(posterior.model.at.loads)
            square = np.square(top.unknowns[loads]) + np.square(met.near(top)[loads])
            normal, shear = np.sqrt(square.reshape(-1, 2).mean(axis=0))
            push = max(float(normal), float(shear) / SHEAR_RATIO)
            if push * NARROWER > push_of(posterior.prior):
                break
            friction = posterior.prior.friction
            posterior = posterior.under(contact_prior(posterior.model, push, friction))
            met = Explanations(posterior, [posterior.settled(one.unknowns) for one in met.tops])
        return met

    def _stated(
        self,
        met: Explanations,
        status: Status | None = None,
        tracked: bool = False,
        earlier: Sequence[NDArray[Any]] = (),
    ) -> tuple[Reading, Located]:
        """The reading of explanations, and from where the next frame can be followed."""
        weighed = met.weighed(earlier)
        dark = unseen(met.posterior.prior, weighed[0].covariance)
        if dark.any():
            posterior = met.posterior.under(widened(met.posterior.prior, dark))
            met = Explanations(posterior, [posterior.settled(top.unknowns) for top in met.tops])
            weighed, status = met.weighed(earlier), None
        if status is None and not self.beside and met.posterior.prior.friction > 0:
            met, weighed = self._freed(met, weighed)
        posterior = met.posterior
        best, count = weighed[0], posterior.model.at.loads
        same = [one_reading(one, best, self.hidden, self._alias) for one in weighed]
        own = [one for one, is_same in zip(weighed, same, strict=True) if is_same]
        near = [one.top for one in own]
        weights = np.array([one.weight for one in own])
        weights /= weights.sum()
        means = np.array([top.unknowns[:count] for top in near])
        covariances = np.array([one.covariance for one in own])
        loads, covariance = mixture(weights, means, covariances)
        apart = means - loads
        between = (apart * weights[:, None]).T @ apart
        offset = loads - means[0]
        if not tracked:  # as frames before and after it, which are read by one linearisation
            for k, top in enumerate(near):
                if bent := posterior.propagated(top, self._profiles):
                    means[k], covariances[k] = bent
                if light := posterior.relit(top):
                    means[k] += light.offset
                    covariances[k] += light.covariance
            loads, covariance = mixture(weights, means, covariances)
        others = [one for one, is_same in zip(weighed, same, strict=True) if not is_same]
        alone = loads, covariance
        loads, covariance, others = self._held(others, *alone)
        probability = 1.0 - sum(one.weight for one in others)
        offset, between = offset + loads - alone[0], between + covariance - alone[1]
        located = Located(posterior, best.top, best.covariance, offset, between, self)
        seen = np.isfinite(posterior.frame)
        covariance = covariance + self.calibration_covariance(
            best.top.unknowns, seen, posterior.prior
        )
        detail, shift = "", self.strain_shift(posterior, best.top.unknowns)
        if shift is not None:
            covariance = covariance + shift.covariance(best.top.unknowns[:count])
            detail = "" if shift.share(best.top.unknowns[:count]) < HARMLESS else FOLDED
        if status is None and not tracked and posterior.model.at.size > count:
            chance = met.chance(near[0])
            if chance < MISSED:
                probability = doubted(probability, chance, STILL_MISSED)
        if status is None:
            sure = probability >= self.confidence and not detail
            status = Status.OK if sure else Status.AMBIGUOUS
        if dark.any():
            status = Status.AMBIGUOUS if dark.all() else status
            detail = detail or unseen_words(dark)
        limited = np.zeros(count // 2, dtype=bool)
        if self.friction is not None:
            loads, limited = within_friction_cone(loads, covariance, self.friction)
        alternatives = np.array([one.top.unknowns[:count] for one in others])
        reading = self.reading(
            loads, covariance, best.top, status, probability, limited, alternatives, tracked, detail
        )
        return reading, located

    def _freed(
        self, met: Explanations, weighed: list[Weighed]
    ) -> tuple[Explanations, list[Weighed]]:
        """Explanations fitted without friction, with the weights that they have with it.

        Where contacts are as drawn the phase tells the loads.  Friction would hold the errors of
        those that nothing touches below their deviations, which leave it out.  A fit that ends at
        a mirror image is another explanation, which friction excludes.
        """
        posterior = met.posterior.under(met.posterior.prior._replace(friction=-1.0))
        found = list[Weighed]()
        for one in weighed:
            top = posterior.settled(one.top.unknowns)
            phase, anywhere = posterior.phase(top), np.full(len(one.phase), np.inf)
            mirrored = crossed(phase, sides_of(one.phase), anywhere, self.mirrored)
            found.append(one if mirrored else replace(one, top=top))
        return Explanations(posterior, [one.top for one in found]), found

    def _held(
        self, others: list[Weighed], loads: Array, covariance: Array
    ) -> tuple[Array, Array, list[Weighed]]:
        """Loads and covariance that hold other explanations too, and those that are left.

        Only as many are held as a reading needs to be sure, and none where that is too few.
        """
        left, found = list(others), (loads, covariance)
        weights, means = [1 - sum(one.weight for one in left)], [loads]
        for one in others:
            if self._negligible(left):
                break
            shares, places = [*weights, one.weight], [*means, one.top.unknowns[: len(loads)]]
            wider = held(np.array(shares), np.array(places), covariance)
            if not_too_wide(wider[1], covariance):
                found, weights, means = wider, shares, places
                left.remove(one)
        return (*found, left) if self._negligible(left) else (loads, covariance, others)

    def _negligible(self, others: list[Weighed]) -> bool:
        """Whether explanations together have so little weight that the reading is sure."""
        return sum(one.weight for one in others) <= 1 - self.confidence

    def calibration_covariance(
        self, unknowns: Array, used: Mask, prior: Prior | None = None
    ) -> Array:
        """Covariance of loads that the calibration's own errors cause, shape (2n, 2n) [N^2].

        Parameters
        ----------
        unknowns : ndarray, shape (size,) or (2n,)
            All that explains a frame, or its loads alone [N].
        used : ndarray of bool, shape (P,)
            Pixels that were used.
        prior : Prior, optional
            Of the unknowns; one for contacts that push as these loads do if not given.
        """
        frame, count = self.uncertain.frame, self.uncertain.frame.at.loads
        if self.calibration_uncertainty is None:
            return np.zeros((count, count))
        whole = np.zeros(frame.at.size)
        whole[: len(unknowns)] = unknowns
        if prior is None:
            prior = self.prior_near(unknowns[:count])
        return self.calibration_uncertainty.covariance(frame, prior, whole, used)

    def expected_covariance(self, forces: ArrayLike) -> Array:
        """Covariance that a reading of a frame of these forces states, shape (2n, 2n) [N^2].

        Of a frame without noise, by the second order of large strain.

        Parameters
        ----------
        forces : array_like, shape (n, 2)
            Normal and tangential force of every tactel [N].
        """
        loads = checked_loads(forces, self.model.sensor.tactels.count).ravel()
        unknowns = np.zeros(self.uncertain.frame.at.size)
        unknowns[: len(loads)] = loads
        model, prior = self.uncertain.under(loads), self.prior_near(loads)
        frame = np.where(self.usable_pixels, expose(model, unknowns)[0], np.nan)
        covariance = Posterior(model, prior, frame, self._bins).covariance(Top(unknowns, 0, 0, 0))
        return covariance + self.calibration_covariance(unknowns, self.usable_pixels, prior)

    def prior_near(self, loads: Array) -> Prior:
        """Prior of unknowns for contacts that push as these loads (2n,) do [N]."""
        least = self._search.pushing(np.zeros(len(self.uncertain.frame.fixed)))
        push = max(float(np.abs(loads[::2]).mean()), least)
        return self.posterior(np.empty(0), push).prior

    def reading(
        self,
        loads: Array,
        covariance: Array,
        top: Top,
        status: Status,
        probability: float,
        limited: Mask,
        others: Array,
        tracked: bool = False,
        detail: str = "",
    ) -> Reading:
        """A reading of this strip from loads, shape (2n,) [N], and the rest as of `Reading`."""
        forces = loads.reshape(self.forces_shape)
        return Reading.of(
            forces=forces,
            covariance=covariance,
            phase=partial(self.model.phase, forces),
            chi2=top.square / max(top.count - len(loads), 1.0),
            status=status,
            detail=detail,
            probability=probability,
            alternatives=others.reshape(-1, *forces.shape),
            limited=limited,
            tracked=tracked,
        )

    def _refused(self, posterior: Posterior, lines: Lines) -> Reading:
        """The reading of a frame that nothing explains."""
        at, frame = posterior.model.at, posterior.frame
        status, seen = self.refusal(frame, lines), np.isfinite(frame)
        starts = next(self._search.attempts(lines, []))[0]
        top = posterior.climbed(starts[0]) if len(starts) else posterior.climbed(np.zeros(at.size))
        covariance = posterior.covariance(top)
        nothing = np.zeros(at.loads // 2, dtype=bool)
        loads = top.unknowns[: at.loads]
        covariance = covariance + self.calibration_covariance(top.unknowns, seen, posterior.prior)
        if (shift := self.strain_shift(posterior, top.unknowns)) is not None:
            covariance = covariance + shift.covariance(loads)
        return self.reading(loads, covariance, top, status, 0.0, nothing, np.empty(0))
