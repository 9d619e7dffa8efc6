"""Forces of a strip that creeps, from the loads that each frame shows by itself.

A frame shows g = f + sum_k c_k z_k, with the lags z_k of all loads f so far.  The lags follow from
the forces as they are read, linear from one frame to the next, so that g and the lags before give
f.  Uncertain are the terms of the relaxation, for each of which a filter of its own runs with that
term one standard deviation off, and the loads that acted before the first frame.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.errors import InputError
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import number_at, with_values
from fringeforce.estimation.residual_test import FALSE_CONTACT, square_limit
from fringeforce.models.creep import Creep
from fringeforce.models.uncertainty import RELAXATION
from fringeforce.reading.batch import Batch
from fringeforce.reading.reading import Reading, Status

Array = NDArray[np.float64]

FADING = "The frame shows creep of earlier loads, which fades; nothing touches the sensor now."


class CreepFilter:
    """Takes the creep of earlier loads out of readings in a row.

    Parameters
    ----------
    sensor : Sensor
        The strip.
    history : float
        Standard deviation of the forces that acted for long before the first frame [N].

    Raises
    ------
    InputError
        If the history is no standard deviation.
    """

    def __init__(self, sensor: Sensor, history: float) -> None:
        if not (np.isfinite(history) and history >= 0):
            raise InputError(
                f"history = {history:g} N is no standard deviation; give 0 or more newtons."
            )
        changed = {
            path: found[0] + std
            for path, std in sensor.tolerances.items()
            if path.startswith(RELAXATION) and (found := number_at(sensor, path))
        }
        drawings = [sensor, *(with_values(sensor, {path: v}) for path, v in changed.items())]
        self._ways = [Creep.of(drawing.transducer) for drawing in drawings]
        self._history = history
        self.reset()

    def reset(self) -> None:
        """Forget all earlier loads."""
        self._time: float | None = None

    def next(self, time: float, shown: Array, touched: bool) -> tuple[Array, float, Array]:
        """Forces of the next frame.

        Parameters
        ----------
        time : float
            Of the frame [s].
        shown : ndarray, shape (n, 2)
            Loads that it shows by itself [N].
        touched : bool
            Whether it shows any.

        Returns
        -------
        forces : ndarray, shape (n, 2)
            That act [N].
        share : float
            Change of the forces with the loads that are shown.
        modes : ndarray, shape (u, 2n)
            What each uncertainty of the creep changes in them, a standard deviation each [N].

        Raises
        ------
        InputError
            If the time is none, or lies before that of the last frame.
        """
        if self._time is None:
            self._time, count = time, len(self._ways)
            self._forces = [np.zeros_like(shown)] * count
            self._lags = [np.zeros((len(way.rates), *shown.shape)) for way in self._ways]
            self._left = np.full(len(self._ways[0].rates), self._history)
        interval = time - self._time
        if not interval >= 0:
            raise InputError(
                f"A frame at {time:g} s follows one at {self._time:g} s; times must not descend."
            )
        self._time, found, share = time, list[Array](), 1.0
        for k, way in enumerate(self._ways):
            _, _, new = way.weights(interval)
            nothing = np.zeros_like(shown)
            lags = way.passed(self._lags[k], self._forces[k], nothing, interval)
            own = 1 / (1 + float(way.amounts @ new))
            forces = own * (shown - np.tensordot(way.amounts, lags, 1)) if touched else nothing
            self._lags[k] = lags + np.multiply.outer(new, forces)
            self._forces[k] = forces
            found.append(forces)
            share = own if k == 0 else share
        drawn = self._ways[0]
        self._left = drawn.weights(interval)[0] * self._left
        modes = [(other - found[0]).reshape(1, -1) for other in found[1:]]
        before = share * float(drawn.amounts @ self._left)
        return found[0], share, np.concatenate([*modes, before * np.eye(shown.size)])

    def reading(self, found: Reading, time: float) -> Reading:
        """A reading without creep, if its frame is explained."""
        if not found.status.usable:
            return found
        touched = found.status is not Status.NO_CONTACT
        forces, share, modes = self.next(time, found.forces, touched)
        covariance = share**2 * found.covariance + modes.T @ modes
        status, detail = found.status, found.detail
        if touched and _nothing(forces, covariance):
            status, detail = Status.NO_CONTACT, FADING
        return Reading.of(
            forces=forces,
            chi2=found.chi2,
            status=status,
            covariance=covariance,
            phase=lambda: found.phase,
            detail=detail,
            alternatives=forces + share * (found.alternatives - found.forces),
            limited=found.limited,
            tracked=found.tracked,
            probability=found.probability,
        )

    def batch(self, found: Batch, times: Array) -> None:
        """Take the creep out of readings of a recording, in place."""
        for row, time in enumerate(times):
            status = found.status[row]
            if not status.usable:
                continue
            touched = status is not Status.NO_CONTACT
            forces, share, modes = self.next(float(time), found.forces[row], touched)
            variance = share**2 * found.std[row] ** 2
            variance += np.square(modes).sum(axis=0).reshape(variance.shape)
            covariance = np.diag(variance.ravel())
            if found.covariance is not None:
                covariance = share**2 * found.covariance[row] + modes.T @ modes
                found.covariance[row] = covariance
            if touched and _nothing(forces, covariance):
                found.status[row] = Status.NO_CONTACT
            found.forces[row], found.std[row] = forces, np.sqrt(variance)


def _nothing(forces: Array, covariance: Array) -> bool:
    """Whether forces are no more than their deviations leave of none."""
    flat = forces.ravel()
    return bool(flat @ np.linalg.solve(covariance, flat) < square_limit(flat.size, FALSE_CONTACT))
