"""Forces of a strip or pad that creeps, from the loads that each frame shows by itself.

A frame shows g = f + sum_k c_k z_k, with the lags z_k of all loads f so far.  The lags follow from
the forces as they are read, linear from one frame to the next, so that g and the lags before give
f.  Uncertain are the terms of the relaxation, for each of which a filter of its own runs with that
term one standard deviation off, and the loads that acted before the first frame.

In a recording, frames that show nothing but creep tell of both (`CreepFilter.smoothed`).  With the
uncertain e ~ N(0, 1), each mode a column of M, loads without creep are r_t + M_t e up to the noise
of frame t alone.  Where nothing acts they are none, so that one least squares over all such frames
gives e and its covariance, and with them the forces of every frame, earlier ones too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

from fringeforce.base.errors import InputError
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import REACH, number_at, with_values
from fringeforce.estimation.residual_test import FALSE_VERDICT, PLAIN, square_limit
from fringeforce.models.creep import Creep
from fringeforce.models.design_modes import RELAXING
from fringeforce.reading.batch import Batch
from fringeforce.reading.reading import Reading, Status

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

STD_STEP = 0.1
"""Step of numerical derivatives, in standard deviations of a term."""
CLEAR = 30.0
"""Deviations from none of loads that a frame has to show to tell of terms: weaker ones, whose light
is of second order, are read too large, by 0.3 deviations at 15."""
EDGE = 1
"""Frames next to a contact that do not count as free of it: it may just begin or end there."""
GAUSS_NEWTON_STEPS = 3
"""Gauss-Newton steps of the terms between choices of the frames in which nothing acts; terms that
are 20 % off converge to 1e-3 of their deviations."""
FADING = (
    "Residual indentation: creep of earlier loads explains what the frame shows, and fades; "
    "nothing touches the sensor now."
)


class UncertainCreep:
    """Creep of a sensor whose terms are uncertain.

    Parameters
    ----------
    sensor : Sensor or Pad
        The sensor.
    """

    def __init__(self, sensor: Sensor | Pad) -> None:
        self._sensor = sensor
        self._terms = {
            path: (found[0], std)
            for path, std in sensor.tolerances.items()
            if path.startswith(RELAXING) and (found := number_at(sensor, path))
        }

    def __len__(self) -> int:
        """How many values are uncertain."""
        return len(self._terms)

    def ways(self, values: Array | None = None, step: float = 1.0) -> list[Creep]:
        """Creep of terms that are so many deviations off, and with each one `step` more.

        Parameters
        ----------
        values : ndarray, shape (u,), optional
            Deviations of the terms; none if not given.
        step : float
            Deviations by which each is more.
        """
        off = np.zeros(len(self)) if values is None else values
        found, kept = [], np.clip(off, step - REACH, REACH - step)
        for own in (kept, *(kept + step * np.eye(len(kept)))):
            terms = {
                path: value + e * std
                for (path, (value, std)), e in zip(self._terms.items(), own, strict=True)
            }
            found.append(Creep.of(with_values(self._sensor, terms).transducer))
        return found


class CreepFilter:
    """Takes the creep of earlier loads out of readings in a row.

    Parameters
    ----------
    sensor : Sensor or Pad
        The strip or pad.
    history : float
        Standard deviation of the forces that acted for long before the first frame [N].

    Raises
    ------
    InputError
        If the history is no standard deviation.
    """

    def __init__(self, sensor: Sensor | Pad, history: float) -> None:
        if not (np.isfinite(history) and history >= 0):
            raise InputError(
                f"history = {history:g} N is no standard deviation; give 0 or more newtons."
            )
        self._uncertain = UncertainCreep(sensor)
        self._ways = self._uncertain.ways()
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
        missed = drawn.ripple * (share * shown - found[0]) if touched else np.zeros_like(shown)
        return (
            found[0],
            share,
            np.concatenate([*modes, missed.reshape(1, -1), before * np.eye(shown.size)]),
        )

    def reading(self, found: Reading, time: float) -> Reading:
        """A reading without creep, if its frame is explained."""
        if not found.status.usable:
            return found
        touched = found.status is not Status.NO_CONTACT
        forces, share, modes = self.next(time, found.forces, touched)
        covariance = share**2 * found.covariance + modes.T @ modes
        status, detail, findings = found.status, found.detail, tuple[str, ...]()
        if touched and _nothing(forces, covariance):
            status, detail, findings = Status.NO_CONTACT, FADING, (FADING,)
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
            findings=findings,
        )

    def smoothed(self, found: Batch, times: Array) -> None:
        """Take the creep out of a whole recording, in place, with what later frames tell.

        Noise that lags hold of earlier frames is left out; it is a hundredth of that of a frame.
        The covariances of its frames have to be there.
        """
        assert found.covariance is not None
        rows = np.flatnonzero([status.usable for status in found.status])
        when, size = times[rows], found.forces[0].size
        shown = found.forces[rows].reshape(-1, size)
        spread = found.covariance[rows].copy()
        seen = np.array([s is not Status.NO_CONTACT for s in found.status[rows]], dtype=bool)
        self.batch(found, times)
        if not len(self._uncertain) and not self._history:
            return
        free = np.array([s is Status.NO_CONTACT for s in found.status[rows]], dtype=bool)
        clear = np.einsum("ti,ti->t", shown, np.linalg.solve(spread, shown[..., None])[..., 0])
        fading = (
            seen & (clear > CLEAR**2) & binary_erosion(free, iterations=EDGE, border_value=True)
        )
        values, steps = np.zeros(len(self._uncertain) + size), 0
        while fading.any():
            values[-size:], steps = 0.0, steps + 1
            ways = self._uncertain.ways(values[:-size], STD_STEP)
            left, share, modes = self._unrolled(ways, when, shown, seen & ~fading)
            noise = share[:, None, None] ** 2 * spread
            missed = ways[0].ripple * (share[:, None] * shown - left)
            noise += missed[:, :, None] * missed[:, None, :]
            left -= modes @ values  # those of the drawing, by the slope here
            precision = np.eye(modes.shape[2])
            told = np.linalg.solve(noise[fading], modes[fading]).transpose(0, 2, 1)
            precision += np.einsum("tui,tiv->uv", told, modes[fading])
            pull = np.einsum("tui,ti->u", told, left[fading])
            covariance = np.linalg.inv(precision)
            values = -covariance @ pull
            left += modes @ values
            noise += modes @ covariance @ modes.transpose(0, 2, 1)
            if steps % GAUSS_NEWTON_STEPS:
                continue
            plain = np.array(
                [_nothing(*one, chance=PLAIN) for one in zip(left, noise, strict=True)]
            )
            if plain[fading].all():
                break
            fading &= plain
        else:
            return
        for row, forces, whole, felt in zip(rows, left, noise, seen, strict=True):
            if not felt:
                continue
            found.forces[row] = forces.reshape(found.forces[row].shape)
            found.std[row] = np.sqrt(np.diag(whole)).reshape(found.std[row].shape)
            found.covariance[row] = whole
            if _nothing(forces, whole):
                found.status[row] = Status.NO_CONTACT

    def _unrolled(
        self, ways: list[Creep], times: Array, shown: Array, acts: Mask
    ) -> tuple[Array, Array, Array]:
        """Loads of frames without creep, what they change with those shown, and their modes.

        Parameters
        ----------
        ways : list of Creep
            As of `UncertainCreep.ways`, by `STD_STEP`.
        times : ndarray, shape (F,)
            [s].
        shown : ndarray, shape (F, 2n)
            Loads of each frame by itself [N].
        acts : ndarray of bool, shape (F,)
            Frames in which any force acts.
        """
        drawn, *others = (_without(way, times, shown, acts, 0.0)[0] for way in ways)
        _, share = _without(ways[0], times, shown[:, :0], acts, 0.0)
        before, _ = _without(ways[0], times, np.zeros((len(times), 1)), acts, self._history)
        terms = np.array([(other - drawn) / STD_STEP for other in others]).reshape(
            len(others), *drawn.shape
        )
        history = before[:, :, None] * np.eye(shown.shape[1])
        return drawn, share, np.concatenate([np.moveaxis(terms, 0, 2), history], axis=2)

    def batch(self, found: Batch, times: Array) -> None:
        """Take the creep out of readings of a recording with covariances, in place."""
        assert found.covariance is not None
        for row, time in enumerate(times):
            status = found.status[row]
            if not status.usable:
                continue
            touched = status is not Status.NO_CONTACT
            forces, share, modes = self.next(float(time), found.forces[row], touched)
            covariance = share**2 * found.covariance[row] + modes.T @ modes
            if touched and _nothing(forces, covariance):
                found.status[row] = Status.NO_CONTACT
            found.forces[row], found.covariance[row] = forces, covariance
            found.std[row] = np.sqrt(np.diag(covariance)).reshape(forces.shape)


def _without(
    way: Creep, times: Array, shown: Array, acts: Mask, before: float
) -> tuple[Array, Array]:
    """Loads less creep, shape (F, c), and their change with those shown, shape (F,).

    Lags begin at a load that acted for long before.
    """
    lags = np.full((len(way.rates), shown.shape[1]), before)
    forces, nothing = np.zeros(shown.shape[1]), np.zeros(shown.shape[1])
    left, share = np.empty_like(shown), np.empty(len(times))
    for t, interval in enumerate(np.diff(times, prepend=times[0])):
        _, _, new = way.weights(float(interval))
        lags = way.passed(lags, forces, nothing, float(interval))
        share[t] = 1 / (1 + float(way.amounts @ new))
        left[t] = share[t] * (shown[t] - way.amounts @ lags)
        forces = left[t] if acts[t] else nothing
        lags = lags + np.multiply.outer(new, forces)
    return left, share


def _nothing(forces: Array, covariance: Array, chance: float = FALSE_VERDICT) -> bool:
    """Whether forces are no more than their deviations leave of none."""
    flat = forces.ravel()
    return bool(flat @ np.linalg.solve(covariance, flat) < square_limit(flat.size, chance))
