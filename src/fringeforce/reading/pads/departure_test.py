"""Whether a frame that loads explain shows a departure from the design all the same.

The residual test takes all pixels together, of which noise leaves some hundreds in the sum of their
squares.  A score test asks for one departure at a time, beside loads that are fitted already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Index, Single
from fringeforce.design.tolerances import Tolerances
from fringeforce.estimation.levenberg_marquardt import Curvature
from fringeforce.estimation.residual_test import FALSE_ALARM, PLAIN
from fringeforce.estimation.score_test import Score
from fringeforce.models.as_built import PLACEMENT, SIZE
from fringeforce.models.departures import LAYERS
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_departures import PadDeparture, departing, pad_departures
from fringeforce.models.pad_series import PadSeries
from fringeforce.models.pad_skin import PadSkinModel
from fringeforce.models.pad_skin_uncertainty import PadSkinUncertainty
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.models.pad_unknowns import BLUR
from fringeforce.reading.departure_test import plain
from fringeforce.reading.findings import Sized, sentence
from fringeforce.reading.pads.departure_record import DepartureRecord, FullTest
from fringeforce.reading.pads.fit import Fit, Optimum
from fringeforce.reading.pads.light import FrameLight, Place
from fringeforce.reading.pads.skin_fit import SkinFit, SkinOptimum

OPTICS = "camera.", "polariscope."
"""What departs besides layers."""
SOFTNESS = "transducer.compliant.youngs_modulus", "transducer.photoelastic.youngs_modulus"
"""What shows by its ratio alone beside forces of any size; the first stands for both."""


class DepartureTest:
    """Score tests of single numbers that a design does not allow for.

    Parameters
    ----------
    model : PadModel
        The pad.
    paths : tuple of str
        Beginnings of the paths that are tested.
    """

    def __init__(self, model: PadModel, paths: tuple[str, ...]) -> None:
        self._model, self._paths = model, paths

    @cached_property
    def tested(self) -> tuple[PadDeparture, ...]:
        """What is tested; what the design allows for is fitted in its place."""
        return tuple(
            one
            for one in pad_departures(self._model)
            if one.one
            and one.path.startswith(self._paths)
            and one.path not in self._model.sensor.tolerances
        )

    def finding(self, found: Sequence[Sized]) -> str:
        """What is said of departures that are shown."""
        return sentence(found, self._model)

    def _shown(
        self,
        found: Score,
        modes: NDArray[np.floating],
        record: DepartureRecord | None,
        test: FullTest | None = None,
    ) -> list[Sized]:
        """Departures that are shown plainly and cannot be told apart, the likeliest first.

        Parameters
        ----------
        found : Score
            What a frame tells.
        modes : ndarray
            Of the retardance of the frame.
        record : DepartureRecord, optional
            What earlier frames tell, which is added.
        test : FullTest, optional
            What serves frames that follow.
        """
        if record is None:
            return self._plain(found)
        each = found, record.together(found)
        record.add(found)
        record.tested(modes, any(self._doubtful(one) for one in each), test)
        return self._plain(each[0]) or self._plain(each[1])

    def _doubtful(self, found: Score) -> bool:
        return bool(self._plain(found, PLAIN / len(self.tested)))

    def _plain(self, found: Score, chance: float = FALSE_ALARM) -> list[Sized]:
        scores = [found.of(slice(k, k + 1)) for k in range(len(self.tested))]
        return plain(self.tested, scores, np.arange(len(found.fitted)), self._size, chance)

    def _size(self, departure: PadDeparture, score: Score) -> float:
        """By how much it departs, as of the linear model."""
        deviations = score.best
        if departure.path != BLUR:
            return deviations * departure.deviation
        # a blur acts by its square, and was differentiated where it begins
        drawn, begin = self._model.sensor.camera.blur or 0.0, departure.begin * departure.deviation
        square = drawn**2 + 2 * (drawn + begin) * deviations * departure.deviation
        return float(np.sqrt(max(square, 0.0))) - drawn


class SkinDepartureTest(DepartureTest):
    """The same beside contacts on a skin.

    Layers are not tested: they show where bodies are near each other only, and change little there.

    Parameters
    ----------
    optics : PadModel
        The pad with the depth profiles of the skin.
    skin : PadSkinModel
        What contacts do.
    """

    def __init__(self, optics: PadModel, skin: PadSkinModel) -> None:
        super().__init__(optics, OPTICS)
        self._skin = skin

    @cached_property
    def _known(self) -> PadSkinUncertainty:
        """What departs, as unknowns beside those of the design."""
        return PadSkinUncertainty(departing(self._model, self.tested), skin=self._skin)

    def shown(
        self, fit: SkinFit, one: SkinOptimum, record: DepartureRecord | None = None
    ) -> list[Sized]:
        """Departures that a frame shows plainly and cannot tell apart, the likeliest first.

        Parameters
        ----------
        fit : SkinFit
            The posterior of the frame.
        one : SkinOptimum
            Where it is largest.
        record : DepartureRecord, optional
            What earlier frames tell, which is added.
        """
        return self._shown(self.told(fit, one), one.place.modes, record) if self.tested else []

    def told(self, fit: SkinFit, one: SkinOptimum) -> Score:
        """What the frame tells of each that is tested, by itself, beside contacts and the rest."""
        wide, extra = replace(fit, uncertain=self._known, prior=None), self._extra(fit, one)
        at_rest = wide.at(one.contacts, extra)
        here = replace(at_rest, extra=extra + begun(self._known, self.tested))
        gradient, information = wide.gradient(here, one.free), wide.information(here, one.free)
        first = len(gradient) - self._known.size
        # the prior is not of what departs, which is at zero
        gradient[first:] -= wide.known.precision @ (here.extra - extra)
        numbers = _numbers(self._known, self.tested)
        tested = first + numbers
        fitted = np.delete(np.arange(len(gradient)), tested)
        own = np.diag(information)[tested] - np.diag(wide.known.precision)[numbers]
        return Score.beside(
            (gradient[fitted], information[np.ix_(fitted, fitted)]),
            information[np.ix_(fitted, tested)],
            (gradient[tested], np.diag(own)),
        )

    def _extra(self, fit: SkinFit, one: SkinOptimum) -> Array:
        """Unknowns (q,) as they were fitted, and zero for what departs."""
        extra = np.zeros(self._known.size)
        if fit.uncertain is not None:
            for group in fit.uncertain.groups:
                same = self._known.group(group.path)
                assert same is not None
                extra[same.place] = one.extra[group.place]
        return extra


class SquaresDepartureTest(DepartureTest):
    """The same beside forces on squares.

    Parameters
    ----------
    model : PadModel
        The pad, as it is fitted.
    mechanics : PadSeries
        What its layers do.
    """

    def __init__(self, model: PadModel, mechanics: PadSeries) -> None:
        # tractions that are spread otherwise look like another cover
        spread = {PLACEMENT, SIZE} & set(model.sensor.tolerances)
        layers = () if spread else tuple(path for path in LAYERS if path != SOFTNESS[1])
        super().__init__(model, (*OPTICS, *layers))
        self._mechanics = mechanics

    @cached_property
    def _optics(self) -> tuple[PadDeparture, ...]:
        return tuple(one for one in self.tested if one.path.startswith(OPTICS))

    @cached_property
    def _known(self) -> PadUncertainty:
        """What departs of camera and polariscope, and nothing else, as unknowns."""
        sensor = self._model.sensor
        camera = sensor.camera.model_copy(update={"drift": 0.0})
        drawn = sensor.model_copy(update={"tolerances": Tolerances(), "camera": camera})
        return PadUncertainty(departing(replace(self._model, sensor=drawn), self._optics))

    @cached_property
    def _begun(self) -> Array:
        return begun(self._known, self._optics)

    @cached_property
    def _numbers(self) -> Index:
        return _numbers(self._known, self._optics)

    def _layers(self, fit: Fit, place: Place) -> list[Single]:
        """Derivatives of the retardance of the modes by layers, (2, modes, rows, columns) each."""
        known = fit.uncertain
        retarding = self._model.retarding if known is None else known.retarding(place.extra)
        changes = [
            self._mechanics.changes(one.path, one.deviation * one.unit)[0]
            for one in self.tested[len(self._optics) :]
        ]
        return [retarding.spread(one.forward(place.forces)) for one in changes]

    def shown(
        self,
        fit: Fit,
        one: Optimum,
        curvature: Curvature,
        record: DepartureRecord | None = None,
    ) -> list[Sized]:
        """Departures that a frame shows plainly and cannot tell apart, the likeliest first.

        Parameters
        ----------
        fit : Fit
            The posterior of the frame.
        one : Optimum
            Where it is largest.
        curvature : Curvature
            That of the fit where the optimum was evaluated.
        record : DepartureRecord, optional
            What earlier frames tell, which is added.
        """
        if not self.tested:
            return []
        test = self.full(fit, one, curvature)
        found = self._shown(test.score, one.place.modes, record, test)
        return [each for first in found for each in (first, *self._equal(first))]

    def deviations(self, fit: Fit, one: Optimum, curvature: Curvature) -> dict[str, float]:
        """Smallest deviations that each departure can be told with beside forces, by its path.

        They are relative for layers and the amplitude, else in the unit of the value.
        """
        known = self.full(fit, one, curvature).score.information.diagonal()
        return {
            departure.path: departure.deviation / float(np.sqrt(max(each, np.finfo(float).tiny)))
            for departure, each in zip(self.tested, known, strict=True)
        }

    def _equal(self, found: Sized) -> list[Sized]:
        """What no frame can tell from it."""
        if found.departure.path != SOFTNESS[0]:
            return []
        others = (one for one in pad_departures(self._model) if one.path == SOFTNESS[1])
        return [Sized(one, -found.size / (1 + found.size), found.significance) for one in others]

    def doubts(self, fit: Fit, one: Optimum, record: DepartureRecord) -> bool:
        """Whether a frame that follows, with those before it, calls for a test.

        Its score, by the information of the last test if that serves it, is added if not.

        Parameters
        ----------
        fit : Fit
            The posterior of the frame.
        one : Optimum
            Where it is largest.
        record : DepartureRecord
            What earlier frames tell.
        """
        test = record.serving(one.place.modes)
        if test is None:
            return False
        pulls = self._back(fit, one, test.layers)[0]
        moved = np.concatenate([one.forces - one.place.forces, one.extra - one.place.extra])
        score = test.score._replace(pull=pulls + test.across.T @ moved)
        if self._doubtful(record.together(score)):
            return True
        record.add(score)
        return False

    def _back(self, fit: Fit, one: Optimum, layers: list[Single]) -> tuple[Array, Single]:
        """Half the derivative of the loss by what is tested, shape (k,), and by the modes."""
        here = replace(one.place, extra=self._begun)
        light = FrameLight(fit.model, fit.response, fit.frame, fit.used, self._known)
        by_modes, by_light = light.back(here, one.misfit.slope)
        by_layers = [float(np.vdot(image, by_modes)) for image in layers]
        return np.append(by_light[self._numbers], by_layers), by_modes

    def full(self, fit: Fit, one: Optimum, curvature: Curvature) -> FullTest:
        """What the frame tells of each that is tested, by itself, beside forces and tolerances."""
        known, sampling, place, numbers = self._known, fit.sampling, one.place, self._numbers
        here = replace(place, extra=self._begun)
        layers = self._layers(fit, place)
        pulls, by_modes = self._back(fit, one, layers)
        rows, columns = sampling.rows, sampling.columns
        few = [image[..., rows[:, None], columns] for image in layers]
        retarded = [
            *known.camera.moved(place.modes, rows, columns),
            *enumerate(few, known.size),
        ]

        def changes(k: int, slopes: Single) -> Single:
            found = np.zeros((known.size + len(few), *slopes.shape[::2]), dtype=np.float32)
            for number, change in sampling.by_light(known, here, k):
                found[number] += change
            for number, image in retarded:
                flat = image.reshape(-1, slopes.shape[-1])
                found[number] += np.einsum("sfp,fp->sp", slopes, flat)
            return np.concatenate([found[numbers], found[known.size :]])

        across, own = fit.across(place, changes)
        if fit.uncertain is None:
            fitted = fit.gathered(place, by_modes, np.zeros(0))
        else:
            fitted = replace(fit, reference=place.reference).gradient(place, one.misfit)
        known_of = curvature.kept(fitted), curvature.information
        score = Score.beside(known_of, curvature.kept(across), (pulls, own))
        return FullTest(score, across, layers)


def begun(known: PadUncertainty, departures: Sequence[PadDeparture]) -> Array:
    """Unknowns from which departures are looked for, shape (q,)."""
    extra = np.zeros(known.size)
    for departure in departures:
        group = known.group(departure.path)
        if departure.begin and group is not None:
            extra[group.place] = departure.begin
    return extra


def _numbers(known: PadUncertainty, departures: Sequence[PadDeparture]) -> Index:
    """Where departures by single numbers stand among the unknowns."""
    groups = [known.group(departure.path) for departure in departures]
    return np.array([group.begin for group in groups if group is not None], dtype=np.intp)
