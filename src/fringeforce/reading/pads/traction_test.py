"""Whether a frame shows tractions on tactels that the tolerances of a pad do not allow for.

Forces and functions of tractions that explain a frame are wrong where the true traction is none of
those that are allowed for, long before all pixels together show it.  Two numbers tell it of a
tactel:

- that of its functions x, which under their normal prior are normal with the covariance 1 - C where
  C is the one that the frame leaves: x' (1 - C)^-1 x;
- that of Rao's score test for functions of wider tolerances beside all that was fitted.

The frame tells them independently of each other, and their sum is a chi-square number.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array, Index, Single
from fringeforce.design.tolerances import Tolerances
from fringeforce.estimation.levenberg_marquardt import Curvature
from fringeforce.estimation.residual_test import FALSE_ALARM, square_limit
from fringeforce.estimation.score_test import Score
from fringeforce.models.as_built import PLACEMENT, SIZE
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_series import PadSeries
from fringeforce.models.pad_traction_influence import TractionInfluence
from fringeforce.models.pad_traction_modes import traction_modes
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.reading.pads.fit import Fit, Optimum
from fringeforce.reading.pads.light import FrameLight

WIDER = 0.1
"""What the tested functions allow for of place and size beyond the tolerances, over the side of a
square."""
TESTED = 48
"""Functions of a tactel that are tested at most, the strongest."""
PRESSED = 0.1
"""Share of the largest force from which a tactel is tested."""
MOST_NAMED = 3
"""Tactels that are named at most."""
LEAST_TOLD = 0.01
"""Share of the variance of an unknown that a frame must take away for it to be tested: what is left
is known to a thousandth or so, as of a lattice of pixels."""


class TractionTest:
    """Tests tractions on the tactels of one pad with tolerances of them.

    Parameters
    ----------
    model : PadModel
        The pad, as it is fitted.
    mechanics : PadSeries
        What tractions on it do.
    """

    def __init__(self, model: PadModel, mechanics: PadSeries) -> None:
        self._model, self._mechanics = model, mechanics

    @cached_property
    def _functions(self) -> TractionInfluence:
        pad = self._model.sensor
        stated = dict(pad.tolerances)
        beyond = WIDER * pad.tactels.side
        wide = {path: stated.get(path, 0.0) + beyond for path in (PLACEMENT, SIZE)}
        sensor = pad.model_copy(update={"tolerances": Tolerances({**stated, **wide})})
        profile = self._model.influence.profile
        functions = traction_modes(sensor, profile)[:TESTED]
        return TractionInfluence(self._mechanics, functions)

    def shown(self, fit: Fit, one: Optimum, curvature: Curvature) -> Index:
        """Tactels on which a frame shows a traction that is not allowed for.

        Parameters
        ----------
        fit : Fit
            The posterior of the frame.
        one : Optimum
            Where it is largest.
        curvature : Curvature
            That of the fit where the optimum was evaluated.
        """
        known, place = fit.uncertain, one.place
        if known is None or known.contacts is None:
            return np.zeros(0, dtype=np.intp)
        tactels, numbers = self._pressed(known, one, curvature)
        forces = place.about.forces.reshape(-1, 3)
        light = FrameLight(fit.model, fit.response, fit.frame, fit.used, known)
        by_modes, by_light = light.back(place, one.misfit.slope)
        gradient = replace(fit, reference=place.about).gathered(place, by_modes, by_light)
        fitted = curvature.kept(gradient), curvature.information
        grid = known.retarding(place.extra).gather(by_modes)
        limit = FALSE_ALARM / max(len(tactels), 1)
        slopes = np.moveaxis(self._functions.adjoint(grid, tactels), 1, 0)
        found = []
        for tactel, slope, own in zip(tactels.tolist(), slopes, numbers, strict=True):
            # the pressure, and the shear, which friction spreads another way
            apart = forces[tactel] * [[1, 0, 0], [0, 1, 1]]
            pull = (apart @ slope.T).ravel()
            across, information = fit.across(place, self._changes(fit, tactel, apart))
            score = Score.beside(fitted, curvature.kept(across), (pull, information))
            first, count = score.each()
            second, more = _unlikely(one.extra[own], curvature, forces.size + own)
            if first + second > square_limit(count + more, limit):
                found.append(tactel)
        return np.array(found, dtype=np.intp)

    def _pressed(
        self, known: PadUncertainty, one: Optimum, curvature: Curvature
    ) -> tuple[Index, list[Index]]:
        """Tactels that are pressed, and unknowns of each."""
        forces = one.place.about.forces
        strength = np.sqrt(np.square(forces.reshape(-1, 3)).sum(axis=1))
        held = known.deviations(curvature.holds(len(forces) + np.arange(known.size)))
        pressed = held.any(axis=0) & (strength > PRESSED * strength.max(initial=0.0))
        tactels = np.flatnonzero(pressed)
        numbers = known.deviations(np.arange(known.size))
        return tactels, [numbers[held[:, k], k] for k in tactels]

    def finding(self, tactels: Index) -> str:
        """What is said of tactels."""
        places = self._model.sensor.tactels.places[tactels]
        where = ", ".join(f"({x * 1e3:.3g}, {y * 1e3:.3g}) mm" for x, y in places[:MOST_NAMED])
        more = "" if len(places) <= MOST_NAMED else f" and {len(places) - MOST_NAMED} more"
        return (
            f"The contact on {'tactel' if len(places) == 1 else 'tactels'} at {where}{more} is "
            f"none that {PLACEMENT} and {SIZE} allow for; read the pad as a skin, which takes "
            "contacts anywhere, or widen these tolerances."
        )

    def _changes(self, fit: Fit, tactel: int, forces: Array) -> Callable[[int, Single], Single]:
        """Derivatives of the intensity by functions of forces (k, 3), as of `Fit.across`."""
        begin = np.zeros(self._model.sensor.tactels.total, dtype=np.intp)
        end = np.where(np.arange(len(begin)) == tactel, len(self._functions.functions), begin)
        whole = self._functions.matrices(*fit.sampling.places, begin, end)[tactel]
        retarded = np.tensordot(forces.astype(np.float32), whole, 1)
        flat = retarded.reshape(len(forces), -1, *retarded.shape[3:])

        def changes(_: int, slopes: Single) -> Single:
            each = np.einsum("sfp,cfpl->clsp", slopes, flat)
            return np.asarray(each.reshape(-1, *each.shape[2:]))

        return changes


def _unlikely(values: Array, curvature: Curvature, unknowns: Index) -> tuple[float, int]:
    """Chi-square number of standard normal unknowns as they were found, and what a frame tells."""
    at = curvature.at(unknowns)
    told, axes = np.linalg.eigh(np.eye(len(at)) - curvature.covariance[np.ix_(at, at)])
    some = told > LEAST_TOLD
    return float((np.square(values @ axes[:, some]) / told[some]).sum()), int(some.sum())
