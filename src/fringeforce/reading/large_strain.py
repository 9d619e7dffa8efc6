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

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.estimation.frame_model import FrameModel
from fringeforce.estimation.linearised_frame import Linearised, shared_information, spread_profiles
from fringeforce.models.finite_strain import beyond_second_order
from fringeforce.models.node_splines import coefficients
from fringeforce.models.strain_error import SLOPE
from fringeforce.models.strip import SensorModel
from fringeforce.models.uncertainty import Uncertainty

PATTERNS = 8
"""Load patterns that tell what the second order leaves: their mean square is known to a half."""
SQUASHED = 0.1
"""Strain of the cover under the largest force of a pattern, its pressure over the modulus: half as
much leaves too little to be told from rounding, twice as much folds the surface at some widths."""
SOLUTIONS = 8
"""Most times that large strain is solved for one explanation: each leaves a tenth to a third."""
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
        return reach(loads, centre) * self._modes

    @property
    def _modes(self) -> Array:
        return self._patterns / np.sqrt(len(self._patterns))

    def shift(
        self, about: Linearised, model: FrameModel, unknowns: Array, centre: Array | None
    ) -> StrainShift:
        """How far what is left moves the loads of an explanation of a frame.

        Parameters
        ----------
        about : Linearised
            The frame's loss about it.
        model : FrameModel
            That is exact at the centre.
        unknowns : ndarray, shape (size,)
            The explanation.
        centre : ndarray, shape (2n,), optional
            Loads [N]; none if not given.
        """
        waves = spread_profiles(model, unknowns, self._modes)
        shared = shared_information(model, about, waves)
        hessian, count = about.hessian + about.cone, model.at.loads
        moved = np.linalg.solve(hessian, shared)[:count]
        noise = np.asarray(np.diag(np.linalg.inv(about.hessian))[:count], dtype=float)
        return StrainShift(np.asarray(moved @ moved.T, dtype=float), noise, centre)


@dataclass(frozen=True, eq=False)
class StrainShift:
    """How far what the model leaves of large strain moves loads, near those of one frame.

    Attributes
    ----------
    unit : ndarray, shape (2n, 2n)
        Covariance of the loads for a `reach` of one [1/N^4].
    noise : ndarray, shape (2n,)
        Variances by the noise [N^2].
    centre : ndarray, shape (2n,), or None
        Loads at which the model is exact, none if not given [N].
    """

    unit: Array
    noise: Array
    centre: Array | None

    def covariance(self, loads: Array) -> Array:
        """Covariance of loads (2n,), shape (2n, 2n) [N^2]."""
        return reach(loads, self.centre) ** 2 * self.unit

    def share(self, loads: Array) -> float:
        """Deviations over those of the noise, root mean square over the loads."""
        return reach(loads, self.centre) * float(np.sqrt((np.diag(self.unit) / self.noise).mean()))


def reach(loads: Array, centre: Array | None) -> float:
    """Size of what is left under loads of a model that is exact at a centre, over patterns [N^3].

    Third power of the largest force; near the centre its change.
    """
    size = _size(loads)
    if centre is None:
        return size**3
    far = 3 * max(size, _size(centre)) ** 2 * _size(loads - centre)
    return min(size**3, far) + MESH * size**3


def _size(loads: Array) -> float:
    """The largest force, normal or tangential."""
    return float(np.abs(loads).max())
