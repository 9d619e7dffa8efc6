"""What the second order leaves of the phase under large strain, and how far it moves a reading.

It is of third order in the loads.  A few load patterns, solved once, tell its size and shapes; what
is left for loads f, of a model that is exact at loads f_0, is no more than these by the third power
of the largest force, or 3 |f|^2 |f - f_0| if that is less.  It is small, so that the loads are not
sought again: they follow it by -H^-1 X, with the curvature H of a frame's unknowns and X that they
share with the phase.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import InputError
from fringeforce.estimation.frame_exposure import expose
from fringeforce.estimation.frame_fit import (
    Linearised,
    Prior,
    linearise,
    shared_information,
    spread_profiles,
)
from fringeforce.estimation.frame_model import FrameModel
from fringeforce.models.finite_strain import beyond_second_order
from fringeforce.models.strip import SensorModel
from fringeforce.models.uncertainty import Uncertainty, coefficients

PATTERNS = 8
"""Load patterns that tell what the second order leaves: their mean square is known to a half."""
SQUASHED = 0.1
"""Strain of the cover under the largest force of a pattern, its pressure over the modulus: half as
much leaves too little to be told from rounding, twice as much folds the surface at some widths."""
SLOPE = 0.3
"""Largest tangential over normal force of a pattern, as of contacts that stick."""
MESH = 0.02
"""Share that the elements of the second order leave of what is beyond it, against finer ones."""


@dataclass(frozen=True, eq=False)
class HigherOrders:
    """Of a strip of large strain.

    Attributes
    ----------
    model : SensorModel
        The strip.
    uncertain : Uncertainty
        Its frame's model.
    """

    model: SensorModel
    uncertain: Uncertainty

    def phase(self, loads: Array) -> Array:
        """What the second order leaves at the nodes under loads (2n,), shape (m,) [rad].

        Raises
        ------
        InputError
            If the surface folds under them.
        """
        half = self.model.sensor.transducer.length / 2
        x = np.clip(self.uncertain.places, -half, half)
        found = beyond_second_order(self.model.sensor, x, loads.reshape(-1, 2))
        return coefficients(found * self.uncertain.shown, len(self.uncertain.frame.fixed))

    @cached_property
    def _patterns(self) -> Array:
        """Phases that are left, over the third power of the largest force, shape (k, m)."""
        sensor, rng = self.model.sensor, np.random.default_rng(0)
        tactels, transducer = sensor.tactels, sensor.transducer
        area = tactels.contact_width * transducer.width
        largest = SQUASHED * transducer.compliant.youngs_modulus * area
        found = list[Array]()
        for _ in range(PATTERNS):
            normal = rng.uniform(0, largest, tactels.count)
            slope = rng.uniform(-SLOPE, SLOPE, tactels.count)
            loads = np.stack([normal, slope * normal], axis=1).ravel()
            try:
                found.append(self.phase(loads) / _size(loads) ** 3)
            except InputError:  # a narrow contact on a soft cover
                continue
        if not found:
            raise InputError(
                f"Contacts {tactels.contact_width * 1e3:g} mm wide fold the surface at a strain of "
                f'{SQUASHED:.0%} of the cover; take wider ones, or strain = "linear".'
            )
        return np.array(found)

    def left(self, loads: Array, centre: Array | None) -> Array:
        """Modes of what is left under loads of a model that is exact at a centre, shape (k, m).

        The mean square of the patterns, each a standardised unknown [rad].
        """
        size = _size(loads)
        reach = size**3
        if centre is not None:
            far = 3 * max(size, _size(centre)) ** 2 * _size(loads - centre)
            reach = min(reach, far) + MESH * size**3
        return reach / np.sqrt(len(self._patterns)) * self._patterns

    def moved(
        self, about: Linearised, model: FrameModel, unknowns: Array, centre: Array | None
    ) -> Array:
        """How far the modes of `left` move the loads, shape (2n, k) [N]."""
        count = model.at.loads
        waves = spread_profiles(model, unknowns, self.left(unknowns[:count], centre))
        shared = shared_information(model, about, waves)
        return np.asarray(np.linalg.solve(about.hessian + about.cone, shared)[:count], dtype=float)

    def covariance(self, prior: Prior, unknowns: Array, used: Mask, centre: Array | None) -> Array:
        """Covariance of the loads that explain a frame by what is left, shape (2n, 2n) [N^2].

        Parameters
        ----------
        prior : Prior
            Of the unknowns.
        unknowns : ndarray, shape (size,)
            What explains the frame.
        used : ndarray of bool, shape (P,)
            Pixels that were used.
        centre : ndarray, shape (2n,), optional
            Loads at which the model is exact; none if not given [N].
        """
        model = self.uncertain.frame
        frame = np.where(used, expose(model, unknowns)[0], np.nan)
        about = Linearised(*linearise(model, prior, frame, unknowns))
        moved = self.moved(about, model, unknowns, centre)
        return np.asarray(moved @ moved.T, dtype=float)


def _size(loads: Array) -> float:
    """The largest force, normal or tangential."""
    return float(np.abs(loads).max())
