"""One frame of a pad to one reading, without any earlier state or from forces nearly right."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.arrays import Array, Mask
from fringeforce.estimation.covariance import covariance_of, marginal_information
from fringeforce.estimation.levenberg_marquardt import Curvature
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_departures import PadDeparture
from fringeforce.models.pad_series import PadSeries
from fringeforce.models.pad_uncertainty import PadUncertainty, Reference, uncertain
from fringeforce.models.pad_unknowns import REGISTRATION
from fringeforce.reading.frame_reader import FOLLOWING_STEPS
from fringeforce.reading.pads.departure_record import DepartureRecord
from fringeforce.reading.pads.departure_test import SquaresDepartureTest
from fringeforce.reading.pads.fit import Fit, Optimum
from fringeforce.reading.pads.light import Prior, Start, expected_response
from fringeforce.reading.pads.mirror_images import Mirror, Verdict, are_apart, weighed
from fringeforce.reading.pads.pad_frames import PadFrames
from fringeforce.reading.pads.sampling import Sampling, for_covariance, for_steps
from fringeforce.reading.pads.search import Search
from fringeforce.reading.pads.traction_test import TractionTest
from fringeforce.reading.pads.verdict import FrameClassifier
from fringeforce.reading.reading import Reading
from fringeforce.reading.tactel_aliases import TactelAlias

DEPTH = 4
"""Times that mirror images are tried, each time of what is likelier than all before."""
IMAGE_EXCESS = 0.5
"""Mean square by which a mirror image may be worse than what it is an image of, to be tried."""
FAINT = "Too little shows to rule out all other forces."
BETWEEN = (
    "A contact seems to lie between tactels, and how much each of them carries does not show; a "
    "skin reads contacts anywhere."
)
"""Why other forces may explain a frame as well."""

BESIDE = 2, 4, 8
"""Places beside those that forces do not explain from which a search does not begin again, in turn:
the more noise there is, the less the edges of what is wrong show."""


@dataclass(frozen=True, eq=False)
class Earlier:
    """What earlier frames tell of the next one.

    Attributes
    ----------
    start : Start, optional
        Where to follow it from; it is searched without one.
    curvature : Curvature, optional
        Of a place near by.
    prior : Prior, optional
        Of the unknowns of tolerances; as stated if not given.
    probability : float
        Of the explanation that is followed.
    record : DepartureRecord, optional
        Of departures.
    """

    start: Start | None = None
    curvature: Curvature | None = None
    prior: Prior | None = None
    probability: float = 1.0
    record: DepartureRecord | None = None


@dataclass(frozen=True, eq=False)
class PadFrameReader(PadFrames):
    """Reads frames of one pad, each for itself or from forces that are nearly right."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.uncertain is not None:
            _ = self.uncertain.groups  # what cannot be allowed for is refused at once

    @cached_property
    def usable_pixels(self) -> Mask:
        """Pixels that may be used where there is no mask, in one row."""
        return self.model.usable

    @cached_property
    def uncertain(self) -> PadUncertainty | None:
        """What is uncertain about the pad; none if nothing is."""
        return PadUncertainty.of(self.model) if uncertain(self.model.sensor) else None

    @cached_property
    def _fitted(self) -> PadModel:
        """What is fitted: the model, with a depth profile more where there is a residual."""
        return self.model if self.uncertain is None else self.uncertain.model

    @cached_property
    def mechanics(self) -> PadSeries:
        """What tractions on the pad do."""
        if self.uncertain is not None:
            return self.uncertain.mechanics
        return PadSeries(self.model.sensor, self.model.influence)

    @cached_property
    def stepping(self) -> Sampling:
        """Pixels of a matrix that leads to forces."""
        return for_steps(self._fitted, self.uncertain)

    @cached_property
    def _stating(self) -> Sampling:
        return for_covariance(self._fitted, self.uncertain)

    @cached_property
    def _search(self) -> Search:
        self.check_signed()
        still = None if self.uncertain is None else self.uncertain.still
        response = expected_response(self.response, self.uncertain)
        return Search(self._fitted, response, self._looseness, still)

    @cached_property
    def _departures(self) -> SquaresDepartureTest:
        return SquaresDepartureTest(self._fitted, self.mechanics)

    @cached_property
    def _tractions(self) -> TractionTest:
        return TractionTest(self._fitted, self.mechanics)

    @cached_property
    def _looseness(self) -> float:
        """What tolerances change of the sine of a retardance, as `Search` wants it."""
        return 0.0 if self.uncertain is None else self.uncertain.looseness

    @cached_property
    def _mirror(self) -> Mirror:
        waves = {picture.dispersion for picture in self.model.pictures}
        return Mirror(self._search.places, tuple(sorted(waves)))

    def search(self, levels: NDArray[Any], used: Mask, start: Array | None = None) -> Reading:
        """Read a frame that was checked, without an earlier state or from forces (n, 3) [N]."""
        classifier = self.classifier(used)
        return self._searched(classifier.filled(levels), start, classifier)[0]

    def likeliest(self, levels: NDArray[Any], used: Mask) -> Optimum:
        """Forces that explain a frame best in which something touches.

        Where all that shows came to be believed, others are not looked for.
        """
        classifier = self.classifier(used)
        fit = self._fit(classifier.filled(levels), self.stepping, classifier)
        optima = list[Optimum]()
        for forces, whole in self._search.attempts(fit.frame, classifier.used):
            optima.append(self._climbed(fit, forces))
            if whole or classifier.explained(optima[-1]):
                break
        return min(optima, key=lambda optimum: optimum.loss)

    def found(self, levels: NDArray[Any], used: Mask, known: Earlier) -> tuple[Reading, Optimum]:
        """Reading of a frame that comes soon after others, and where it is.

        Parameters
        ----------
        levels, used
            As of `search`.
        known : Earlier
            What the others tell; the frame is searched where following it fails.
        """
        classifier = self.classifier(used)
        grey = classifier.filled(levels)
        if (start := known.start) is not None:
            fit = replace(self._fit(grey, self.stepping, classifier), prior=known.prior)
            if self.uncertain is not None:
                # tractions are spread as forces of the last frame let expect
                fit = replace(fit, reference=Reference(start.forces, start.extra))
                start = fit.at(start.forces, start.extra)
            optimum = fit.climb(start, FOLLOWING_STEPS, self.lasting(known.curvature))
            if classifier.explained(optimum):
                count, none = len(optimum.forces), np.empty((0, len(optimum.forces)))
                matrix = optimum.curvature.information
                verdict = Verdict(optimum.forces, matrix[:count, :count], none, known.probability)

                def spread() -> Array:
                    return optimum.curvature.covariance[:count, :count]

                silence = classifier.silence(fit)
                return (
                    classifier.reading(optimum, verdict, silence, spread, tracked=True),
                    optimum,
                )
        return self._searched(grey, None, classifier, known.record)

    def _searched(
        self,
        levels: Array,
        start: Array | None,
        classifier: FrameClassifier,
        record: DepartureRecord | None = None,
    ) -> tuple[Reading, Optimum]:
        """Reading of a frame without an earlier state, or from a start, and where it is."""
        fit = self._fit(levels, self.stepping, classifier)
        silence = classifier.silence(fit)
        if start is not None:
            optima, sure = [fit.climb(self.model.checked(start, single=True).ravel())], True
        else:
            optima, sure = self._explanations(fit, classifier, silence)
        best = optima[0]
        stating = self._fit(levels, self._stating, classifier)
        whole = stating.curvature(best.place)
        fine = marginal_information(whole.information, len(best.forces))
        if not classifier.explained(best):
            return classifier.unexplained(levels, best, partial(covariance_of, fine)), best
        doubt = "" if best.settled else BETWEEN
        if start is None and not (sure and self._stays_this_side(fine)):
            doubt = FAINT
        verdict = weighed([optimum for optimum in optima if classifier.explained(optimum)], fine)
        spread = partial(covariance_of, verdict.information)
        reading = classifier.reading(best, verdict, silence, spread, doubt=doubt)
        if reading.ok:
            reading = self._tested(reading, stating, best, whole, record)
        return reading, best

    def doubted(self, levels: NDArray[Any], used: Mask, optimum: Optimum, known: Earlier) -> bool:
        """Whether a frame that `found` followed, with those before it, calls for a test."""
        if known.record is None:
            return False
        classifier = self.classifier(used)
        fit = self._fit(classifier.filled(levels), self.stepping, classifier)
        return self._departures.doubts(fit, optimum, known.record)

    def tested(
        self, reading: Reading, levels: NDArray[Any], used: Mask, optimum: Optimum, known: Earlier
    ) -> Reading:
        """A reading by `found` that followed, or its refusal if the frame shows a departure.

        Parameters
        ----------
        reading : Reading
            Of the frame.
        levels, used, known
            As of `found`.
        optimum : Optimum
            Where it is.
        """
        classifier = self.classifier(used)
        fit = self._fit(classifier.filled(levels), self._stating, classifier)
        fit = replace(fit, prior=known.prior)
        return self._tested(reading, fit, optimum, fit.curvature(optimum.place), known.record)

    @property
    def tests_all(self) -> bool:
        """Whether every frame is to be tested, as tractions begin anew in each."""
        return self.uncertain is not None and self.uncertain.contacts is not None

    def _tested(
        self,
        reading: Reading,
        fit: Fit,
        optimum: Optimum,
        curvature: Curvature,
        record: DepartureRecord | None,
    ) -> Reading:
        """A reading, or its refusal if the frame shows a departure beside the forces."""
        findings = []
        if len(tactels := self._tractions.shown(fit, optimum, curvature)):
            findings.append(self._tractions.finding(tactels))
        if shown := self._departures.shown(fit, optimum, curvature, record):
            findings.append(self._departures.finding(shown))
        return reading.departing(*findings) if findings else reading

    def _explanations(
        self, fit: Fit, classifier: FrameClassifier, silence: float
    ) -> tuple[list[Optimum], bool]:
        """Where a search, and mirror images of what it finds, lead, and whether that is all.

        The likeliest comes first.
        """
        optima: list[Optimum] = []
        sure = False
        for forces, whole in self._search.attempts(fit.frame, classifier.used):
            optima.append(self._climbed(fit, forces))
            plain = classifier.plain(optima[-1], silence)
            sure |= whole or plain
            if classifier.explained(optima[-1]) and plain:
                break
        optima.sort(key=lambda optimum: optimum.misfit.loss)
        for beside in BESIDE:
            if classifier.explained(optima[0]):
                break
            grown = self._search.again(fit.frame, classifier.used, optima[0].forces, beside)
            if grown is None:
                break
            optima.append(self._climbed(fit, grown))
            sure |= classifier.plain(optima[-1], silence)
            optima.sort(key=lambda optimum: optimum.misfit.loss)
        if classifier.explained(optima[0]):
            optima = self._with_images(fit, classifier, optima)
            optima += self._on_other_tactels(fit, optima[0])
            optima.sort(key=lambda optimum: optimum.misfit.loss)
        return optima, sure

    @cached_property
    def _aliases(self) -> tuple[TactelAlias, ...]:
        """Other tactels that look alike, along each axis along which the camera may be shifted."""
        known, tactels = self.uncertain, self.model.sensor.tactels
        groups = [] if known is None else [known.group(path) for path in REGISTRATION[:2]]
        return tuple(
            TactelAlias(group.begin, tactels.pitch / group.std, tactels.count, axis)
            for axis, group in enumerate(groups)
            if group is not None
        )

    def _on_other_tactels(self, fit: Fit, likeliest: Optimum) -> list[Optimum]:
        """Where an explanation leads on other tactels, under a camera that is shifted as much."""
        if self.uncertain is None:
            return []
        known = fit.prior or Prior.stated(self.uncertain)
        starts = [(likeliest.forces, likeliest.extra)]
        for alias in self._aliases:
            starts += [image for one in starts for image in alias.images(*one, known.loss)]
        return [fit.climb(fit.at(*start)) for start in starts[1:]]

    def _climbed(self, fit: Fit, forces: Array) -> Optimum:
        """Where forces of a search lead."""
        if not fit.is_as_drawn:
            # far from the top, tolerances would take over what forces must explain, and a curve
            # of the camera hides where they are
            forces = fit.as_drawn.climb(forces).forces
        return fit.climb(forces)

    def _stays_this_side(self, information: Array) -> bool:
        """Whether no push is uncertain by as much as takes retardance from one fold to beyond it.

        Where one is, as may be where a mask hides its tactel, deviations, which are those of a
        linear model, do not say how far other forces are that explain a frame as well.
        """
        deviations = np.sqrt(np.diag(covariance_of(information))[::3])
        most = self._search.strongest * max(self._mirror.dispersions)
        return bool(deviations.max() * most < np.pi / 2)

    def _with_images(
        self, fit: Fit, classifier: FrameClassifier, optima: list[Optimum]
    ) -> list[Optimum]:
        """Explanations, and where their mirror images lead, the likeliest first."""
        shown = None
        if classifier.used is not None:
            counts = classifier.used.reshape(len(self.model.pictures), -1)
            shown = np.asarray(counts.any(axis=0), dtype=bool)
        for _ in range(DEPTH):
            likeliest = optima[0]
            for forces in self._mirror.images(likeliest.forces, shown):
                start = fit.at(forces, likeliest.extra)
                if fit.misfit(start).loss < likeliest.misfit.loss + IMAGE_EXCESS * self.pixels:
                    optima.append(fit.climb(start))
            optima.sort(key=lambda optimum: optimum.misfit.loss)
            # what returned to where it was an image of has the same images again
            known = marginal_information(likeliest.curvature.information, len(likeliest.forces))
            if not are_apart(optima[0].forces, likeliest.forces, known):
                break
        return optima

    def bound(self, forces: ArrayLike) -> Array:
        """Smallest deviations that an unbiased reading can have, shape (n, 3) [N]."""
        loads = self.model.checked(forces, single=True)
        fit = self._bare
        whole = fit.curvature(fit.at(loads.ravel())).information
        information = marginal_information(whole, loads.size)
        return np.sqrt(np.diag(covariance_of(information))).reshape(loads.shape)

    @property
    def tested_departures(self) -> tuple[PadDeparture, ...]:
        """What frames that forces explain are tested for, as the design does not allow for it."""
        return self._departures.tested

    def departure_bound(self, forces: ArrayLike) -> dict[str, float]:
        """Smallest deviations that single departures can be told with from one frame.

        Parameters
        ----------
        forces : array_like, shape (n, 3)
            What acts, and has to be told from the frame as well [N].

        Returns
        -------
        dict
            By dotted path, of what the design does not allow for: relative for layers and the
            amplitude, else in the unit of the value.
        """
        loads, fit = self.model.checked(forces, single=True).ravel(), self._bare
        place = fit.at(loads)
        whole = fit.curvature(place)
        here = Optimum(loads, whole, place, fit.misfit(place), extra=place.extra)
        return self._departures.deviations(fit, here, whole)

    @property
    def _bare(self) -> Fit:
        """The likelihood of no frame in particular."""
        unmasked = self.classifier(self.usable(None))
        return self._fit(np.zeros(self.pixels), self._stating, unmasked)

    def _fit(self, levels: Array, sampling: Sampling, classifier: FrameClassifier) -> Fit:
        return Fit(self._fitted, self.response, sampling, levels, classifier.used)
