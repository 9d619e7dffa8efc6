"""Whether a strip's frame that is explained shows a departure from the design all the same.

The residual test takes all waves of phase together.  A score test asks for one departure at a time,
beside the loads and what the design allows for, and shows what is ten times smaller.  Of several
that are plain, the evidence says which it is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, pairwise
from typing import NamedTuple, TypeVar

import numpy as np

from fringeforce.base.arrays import Array, Index
from fringeforce.design.light import CROSSTALK, light_of_channels, pairs_of_channels
from fringeforce.design.tolerances import Tolerances, with_values
from fringeforce.estimation.frame_exposure import NARROWEST_BLUR, positive
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.frame_model import FrameModel
from fringeforce.estimation.information_filter import DRIFT_FRAMES
from fringeforce.estimation.linearised_frame import (
    Linearised,
    banded,
    linearise,
    pulled_phase,
    shared_information,
    spread_profiles,
)
from fringeforce.estimation.posterior import Posterior, Top
from fringeforce.estimation.residual_test import FALSE_ALARM, square_limit
from fringeforce.estimation.score_test import Score
from fringeforce.models.as_built import PLACEMENT, RESIDUAL, WIDTH
from fringeforce.models.departures import (
    LAYERS,
    LEAK,
    UNEVEN_LIGHT,
    Departures,
    drawn_value,
)
from fringeforce.models.node_splines import coefficients
from fringeforce.models.strip import SensorModel
from fringeforce.models.uncertainty import Uncertainty, uncertainty
from fringeforce.reading.findings import RIVAL, Departing, Sized, sentence

VISIBILITY, BLUR, GAMMA = "polariscope.visibility", "camera.blur", "camera.gamma"
SHAPE = "shape"
"""Name of the modes of an error of the influence matrix."""
LIGHT = (
    *("camera.shift", "camera.scale", BLUR, GAMMA, "camera.amplitude", "camera.offset"),
    *(UNEVEN_LIGHT, VISIBILITY, RESIDUAL, CROSSTALK),
)
"""What is tested of camera and polariscope."""
SIZES = "transducer.compliant.thickness", "transducer.photoelastic.thickness"
"""What is tested of the layers; their moduli show by their ratio alone beside forces of any size,
and so little that a cover a fifth stiffer is three standard deviations of a frame."""
HARMLESS = 0.5
"""Standard deviations by which what a model leaves out moves forces at most if it is no matter,
however plain it is: errors grow by an eighth."""
STRONGER = 2.0
"""Square of the phase over that of the last test from which a frame that follows is tested: what is
pressed harder shows what was hidden."""
LOOK_INTERVAL = 16
"""Frames between looks at the phase of those that follow."""
RELATIVE_STEP = 0.01
"""Share of a size by which its derivative is taken: meshes differ by a hundredth of the change."""
SHARPEST = 0.04
"""Blur at which its derivative is taken if there is none: its square is a thousandth of that of the
least that fringes of a few pixels show [pixels]."""
D = TypeVar("D", bound=Departing)


class Retests:
    """When frames that follow are tested again."""

    def __init__(self) -> None:
        self.begin(0.0)

    def begin(self, strength: float) -> None:
        """After a test of a frame, or its search, with this square of the phase at the nodes."""
        self._strength, self._since, self._looked = strength, 0, 0

    def due(self, frames: int, phase: Callable[[], Array]) -> bool:
        """Whether the last of some more frames is to be tested, as its phase at the nodes says."""
        self._since += frames
        if self._since < self._looked + LOOK_INTERVAL:
            return False
        self._looked = self._since
        nodes = phase()
        strength = float(nodes @ nodes)
        if self._since < DRIFT_FRAMES and strength < STRONGER * self._strength:
            return False
        self.begin(strength)
        return True


class Tested(NamedTuple):
    """A departure that frames are tested for.

    Attributes
    ----------
    path : str
        Dotted path of the value that departs.
    deviation : float
        Generous standard deviation: relative for layers and the amplitude, else in the unit of the
        value.
    one : bool
        Whether it is one number, or many along the strip.
    """

    path: str
    deviation: float
    one: bool


@dataclass(frozen=True, eq=False)
class StripDepartureTest:
    """Score tests of what the design of a strip does not allow for, beside loads of any kind.

    Attributes
    ----------
    model : SensorModel
        As drawn.
    uncertain : Uncertainty
        What its design states.
    """

    model: SensorModel
    uncertain: Uncertainty

    @cached_property
    def tested(self) -> tuple[Tested, ...]:
        """What is tested, sizes last; what the design allows for is fitted in its place."""
        sensor = self.model.sensor
        stated = {*_places(self.uncertain), *sensor.tolerances}
        paths = LIGHT + (SIZES if sensor.transducer.solved_in_a_plane else ())
        paths += tuple(light_of_channels(len(sensor.polariscope.pictures)))
        return tuple(
            Tested(one.path, one.deviation, one.one is not None)
            for one in Departures(self.model, self.uncertain).all
            if one.path in paths and one.path not in stated
        )

    @cached_property
    def _wide(self) -> Uncertainty:
        """The same strip, where what is tested is uncertain as well."""
        sensor, wide = self.model.sensor, dict(self.model.sensor.tolerances)
        camera = sensor.camera
        for one in self.tested:
            if one.path == UNEVEN_LIGHT:
                camera = camera.model_copy(update={"unevenness": one.deviation})
            elif one.path == CROSSTALK:
                wide |= dict.fromkeys(pairs_of_channels(len(sensor.polariscope.channels)), LEAK)
            elif one.path not in SIZES:
                wide[one.path] = one.deviation * self._unit(one)
        block = sensor.transducer.small_strain
        made = sensor.model_copy(
            update={"tolerances": Tolerances(wide), "camera": camera, "transducer": block}
        )
        residual, centre = self.uncertain.matrix.residual, self.uncertain.centre
        found = uncertainty(replace(self.model, sensor=made), residual).about(centre)
        drawn = self.uncertain.frame
        # what is tested is none, where powers beyond the first change nothing
        powers = np.ascontiguousarray(found.frame.influence[:, : drawn.influence.shape[1]])
        frame = found.frame._replace(curvature=drawn.curvature, influence=powers)
        return replace(found, frame=frame if BLUR in sensor.tolerances else _sharp(frame))

    def _unit(self, departure: Tested) -> float:
        """What the size of a departure is relative to; one if it is not."""
        relative = departure.path in LAYERS or departure.path.endswith(".amplitude")
        return drawn_value(self.model.sensor, departure.path) if relative else 1.0

    @cached_property
    def _fitted(self) -> Index:
        """Where the unknowns of the design stand among all, loads first."""
        wide, stated = _places(self._wide), _places(self.uncertain)
        order = np.concatenate([wide[name] for name in stated])
        return order[np.argsort(np.concatenate(list(stated.values())))]

    @cached_property
    def _groups(self) -> list[Index]:
        places = _places(self._wide)
        return [places[one.path] for one in self.tested if one.path not in SIZES]

    @cached_property
    def _resized(self) -> Array:
        """Change of the influence matrix at the nodes with a deviation of each size, (k, 2n, m).

        Of known loads a size changes the phase alone, whose derivative takes one solution.
        """
        sensor, uncertain = self.model.sensor, self.uncertain
        half, nodes = sensor.transducer.length / 2, len(uncertain.frame.fixed)
        plain = sensor.model_copy(update={"tolerances": Tolerances()})
        places = np.clip(uncertain.places, -half, half)
        drawn, found = self.model.influence(places), np.zeros((0, uncertain.frame.at.loads, nodes))
        for one in self.tested:
            if one.path in SIZES:
                other = with_values(plain, {one.path: self._unit(one) * (1 + RELATIVE_STEP)})
                change = (
                    (self.model.of(other).influence(places) - drawn) * one.deviation / RELATIVE_STEP
                )
                change = np.moveaxis(change * uncertain.shown[:, None, None], 0, 2)
                own = coefficients(change, nodes).reshape(1, -1, nodes)
                found = np.concatenate([found, own])
        return found

    def _told(
        self, posterior: Posterior, model: FrameModel, found: Array, forces: Array
    ) -> list[Score]:
        """What a frame tells of everything that is tested, in its deviations, beside the rest.

        Parameters
        ----------
        posterior : Posterior
            Of the frame.
        model : FrameModel
            Where what is tested is uncertain as well; it may have more unknowns in the place of
            loads than the strip.
        found : ndarray, shape (size,)
            Unknowns that explain the frame.
        forces : ndarray, shape (2n,)
            Of the strip's tactels, or line loads [N].
        """
        own, base = posterior.model, self._wide.frame.at
        model = model._replace(variance=own.variance, floor=own.floor, ceiling=own.ceiling)
        more = model.at.size - base.size
        fitted = np.append(np.arange(base.loads + more), self._fitted[base.loads :] + more)
        unknowns, precision = np.zeros(model.at.size), np.zeros(model.at.size)
        unknowns[fitted], precision[fitted] = found, posterior.prior.precision
        mean = np.zeros(model.at.size)
        mean[fitted] = posterior.prior.mean
        prior = Prior(mean, precision, posterior.prior.friction, posterior.prior.yielding)
        about = Linearised(*linearise(model, prior, posterior.frame, unknowns))
        loss = about.hessian + about.cone
        tested = more + np.concatenate([*self._groups, np.empty(0, dtype=np.intp)])
        waves = np.einsum("kam,a->km", self._resized, forces)
        seen = spread_profiles(model, unknowns, waves)
        weighed = banded(about, seen)
        both = shared_information(model, about, seen, weighed)
        changes = np.zeros((len(tested) + len(waves),) * 2)
        changes[: len(tested), : len(tested)] = loss[np.ix_(tested, tested)]
        changes[len(tested) :, len(tested) :] = seen @ weighed.T
        all_of_them = Score.beside(
            (about.gradient[fitted], loss[np.ix_(fitted, fitted)]),
            np.concatenate([loss[np.ix_(fitted, tested)], both[fitted]], axis=1),
            (
                np.concatenate([about.gradient[tested], waves @ pulled_phase(about)]),
                changes,
            ),
        )
        counts = [*map(len, self._groups), *[1] * len(waves)]
        ends = accumulate(counts, initial=0)
        return [all_of_them.of(slice(*each)) for each in pairwise(ends)]

    def _size(self, departure: Tested, score: Score) -> float:
        """By how much it departs, as of the linear model."""
        if not departure.one:
            return float(np.sqrt(np.mean(np.square(score.size @ self._profiles(departure)))))
        if departure.path != BLUR:
            return departure.deviation * score.best
        drawn = self.model.sensor.camera.blur or 0.0
        square = drawn**2 + departure.deviation**2 * score.best
        return float(np.sqrt(max(square, 0.0))) - drawn

    def _profiles(self, departure: Tested) -> Array:
        """What each unknown of a departure of many numbers changes at the nodes, shape (k, m)."""
        frame, group = self._wide.frame, _places(self._wide)[departure.path]
        if departure.path == RESIDUAL:
            return frame.fields[group - frame.at.fields]
        if departure.path == CROSSTALK:
            return departure.deviation * np.eye(len(group))
        return frame.brightness[group - frame.at.modes, : len(frame.fixed)]  # all channels alike


@dataclass(frozen=True, eq=False)
class DepartureTest(StripDepartureTest):
    """The same beside loads of tactels."""

    def finding(self, posterior: Posterior, top: Top) -> str:
        """What is said of departures that a frame shows plainly; nothing if it shows none.

        Parameters
        ----------
        posterior : Posterior
            Of the frame.
        top : Top
            Where it is largest.
        """
        found = self.shown(posterior, top)
        return sentence(found, self.model) if found else ""

    def shown(self, posterior: Posterior, top: Top) -> list[Sized]:
        """Departures that a frame shows plainly and cannot tell apart, the likeliest first."""
        if not self.tested:
            return []
        loads = np.arange(posterior.model.at.loads)
        return plain(self.tested, self.scores(posterior, top), loads, self._size)

    def scores(self, posterior: Posterior, top: Top) -> list[Score]:
        """What a frame tells of everything that is tested, in its deviations, beside the rest."""
        own = posterior.model
        loads = top.unknowns[: own.at.loads]
        wide = self._wide.under(loads)._replace(fixed=own.fixed)
        return self._told(posterior, wide, top.unknowns, loads)


def plain(
    tested: Sequence[D],
    scores: Sequence[Score],
    stated: Index,
    size: Callable[[D, Score], float],
    chance: float = FALSE_ALARM,
) -> list[Sized]:
    """Departures that a frame shows plainly and cannot tell apart, the likeliest first.

    Parameters
    ----------
    tested : sequence
        Departures.
    scores : sequence of Score
        What the frame tells of each.
    stated : ndarray of int
        Where what a reading states stands among what was fitted: it is a matter to move it.
    size : callable
        By how much one departs.
    chance : float
        Of noise that seems to show one.
    """
    found = list[tuple[float, Sized]]()
    for one, score in zip(tested, scores, strict=True):
        square, freedom = score.plain()
        if square > square_limit(freedom, chance) and score.moves(stated) > HARMLESS:
            sized = Sized(one, size(one, score), float(np.sqrt(square)))
            if sized.size:  # a picture that seems sharper than without any blur does not depart
                found.append((score.evidence(), sized))
    found.sort(key=lambda each: -each[0])
    return [sized for evidence, sized in found if evidence > found[0][0] - 2 * RIVAL]


def _sharp(frame: FrameModel) -> FrameModel:
    """The same model, whose blur begins as drawn, and changes its square by that of the deviation.

    Where there is none the derivative by the blur itself would be zero.
    """
    drawn = max(frame.blur, SHARPEST)
    value = drawn - NARROWEST_BLUR**2 / (4 * drawn)  # of which `positive` makes what is drawn
    slope = positive(value, NARROWEST_BLUR)[1]
    return frame._replace(blur=value, blur_std=frame.blur_std**2 / (2 * drawn * slope))


def _places(uncertain: Uncertainty) -> Mapping[str, Index]:
    """Where the unknowns of each value stand."""
    at = uncertain.frame.at
    names = [
        *["loads"] * at.place,
        *[PLACEMENT] * (at.width - at.place),
        *[WIDTH] * (at.fields - at.width),
        *[RESIDUAL] * (at.modes - at.fields - uncertain.shapes),
        *[SHAPE] * uncertain.shapes,
        *[mode.name for mode in uncertain.modes],
        *[VISIBILITY] * (at.blur - at.visibility),
        *[BLUR] * (at.gamma - at.blur),
        *[GAMMA] * (at.crosstalk - at.gamma),
        *[CROSSTALK] * (at.size - at.crosstalk),
    ]
    return {name: np.flatnonzero([one == name for one in names]) for name in dict.fromkeys(names)}
