"""Whether a frame that contacts explain shows a departure of camera or polariscope all the same.

The residual test takes all pixels together, of which noise leaves some hundreds in the sum of their
squares.  The score test (Rao, Math. Proc. Camb. Phil. Soc. 44, 50-57, 1948) asks for one departure
at a time: with s half the derivative of the loss by its unknown, and V the information about it
beside the contacts, s^2 / V is a chi-square number of one degree of freedom where there is no
departure.  Contacts are fitted already, and nothing else is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.estimation.residual_test import square_limit
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_departures import PadDeparture, departing, pad_departures
from fringeforce.models.pad_skin import PadSkinModel
from fringeforce.models.pad_skin_uncertainty import PadSkinUncertainty
from fringeforce.reading.pads.skin_fit import SkinFit, SkinOptimum

TESTED = "camera.", "polariscope."
"""What departs.  Layers show where bodies are near each other only, and change little there."""


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


class DepartureTest:
    """Score tests of what a design does not allow for.

    Parameters
    ----------
    optics : PadModel
        The pad with the depth profiles of the skin.
    skin : PadSkinModel
        What contacts do.
    """

    def __init__(self, optics: PadModel, skin: PadSkinModel) -> None:
        self._optics, self._skin = optics, skin

    @cached_property
    def _departures(self) -> tuple[PadDeparture, ...]:
        stated = self._optics.sensor.tolerances
        return tuple(
            one
            for one in pad_departures(self._optics)
            if one.one and one.path.startswith(TESTED) and one.path not in stated
        )

    @cached_property
    def _known(self) -> PadSkinUncertainty:
        """What departs, as unknowns beside those of the design."""
        return PadSkinUncertainty(departing(self._optics, self._departures), skin=self._skin)

    def shown(self, fit: SkinFit, one: SkinOptimum) -> list[Sized]:
        """Departures that a frame shows plainly beside contacts, the most significant first.

        Parameters
        ----------
        fit : SkinFit
            The posterior of the frame.
        one : SkinOptimum
            Where it is largest.
        """
        groups = [self._known.group(departure.path) for departure in self._departures]
        numbers = np.array([group.begin for group in groups if group is not None], dtype=int)
        if not len(numbers):
            return []
        wide = replace(fit, uncertain=self._known, prior=None)
        here = wide.at(one.contacts, self._extra(fit, one))
        gradient, information = wide.gradient(here, one.free), wide.information(here, one.free)
        tested = len(gradient) - self._known.size + numbers
        fitted = np.delete(np.arange(len(gradient)), tested)
        across = information[np.ix_(fitted, tested)]
        beside = np.linalg.solve(
            information[np.ix_(fitted, fitted)], np.column_stack([across, gradient[fitted]])
        )
        scores = gradient[tested] - across.T @ beside[:, -1]
        stated = np.diag(wide.known.precision)[numbers]
        told = np.diag(information)[tested] - stated - (across * beside[:, :-1]).sum(axis=0)
        # what contacts hide even where it departs by a generous tolerance is not tested
        squares = np.square(scores) / np.maximum(told, 1.0)
        found = [
            Sized(departure, -score / known * group.std / departure.unit, float(np.sqrt(square)))
            for departure, group, score, known, square in zip(
                self._departures, groups, scores.tolist(), told.tolist(), squares, strict=True
            )
            if group is not None and known > 1 and square > square_limit(1)
        ]
        return sorted(found, key=lambda each: -each.significance)

    def _extra(self, fit: SkinFit, one: SkinOptimum) -> Array:
        """Unknowns (q,) as they were fitted, and zero for what departs."""
        extra = np.zeros(self._known.size)
        if fit.uncertain is not None:
            for group in fit.uncertain.groups:
                same = self._known.group(group.path)
                assert same is not None
                extra[same.place] = one.extra[group.place]
        return extra
