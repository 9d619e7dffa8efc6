"""Loads that a bench wrote down by time, and how late its log is against the frames."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.calibration.bench_loads import BenchLoads, bench_loads

REACH = 2.0
"""Delay up to which a log and frames are searched for each other: clocks started by hand [s]."""


@dataclass(frozen=True, eq=False)
class LoadLog:
    """What a bench wrote down by time, of one contact or of several side by side.

    Attributes
    ----------
    times : ndarray, shape (T,)
        Ascending, on the log's own clock [s].
    places, forces, place_std, force_std, widths, radii, width_std
        As in `BenchLoads`, with T moments in the place of F frames; not a number where a contact
        does not exist.

    Raises
    ------
    InputError
        If times do not ascend, or shapes differ.

    Examples
    --------
    >>> from fringeforce.calibration.load_log import load_log
    >>> log = load_log([0.0, 1.0], [1e-3, 2e-3], [(0.0, 0.0), (2.0, 0.5)])
    >>> log.at([0.4], delay=0.1).forces[0]
    array([[1.  , 0.25]])
    """

    times: Array
    places: Array
    forces: Array
    place_std: Array
    force_std: Array
    widths: Array
    radii: Array
    width_std: Array

    def __post_init__(self) -> None:
        self._moments()
        times = self.times
        if times.shape != (len(self.forces),) or len(times) < 2:
            raise InputError(
                f"A log has {times.size} times for {len(self.forces)} loads; give one for each, "
                "two or more."
            )
        if not (np.diff(times) > 0).all():
            late = int(np.argmin(np.diff(times) > 0)) + 1
            raise InputError(
                f"Time {times[late]:g} s of a log follows {times[late - 1]:g} s; times must ascend."
            )

    def _moments(self) -> BenchLoads:
        parts: dict[str, Any] = {one.name: getattr(self, one.name) for one in fields(self)}
        del parts["times"]
        return BenchLoads(**parts)

    @property
    def magnitude(self) -> Array:
        """Size of all forces together, shape (T,) [N]."""
        return self._moments().magnitude

    def at(self, frame_times: ArrayLike, delay: float, reach: float = REACH) -> BenchLoads:
        """Loads of frames, linear between the moments of the log.

        Frame times t belong to log times t + delay: a positive delay is that of a log that says
        everything later than the camera.  Before its first and after its last moment a log says
        what it says there.

        Parameters
        ----------
        frame_times : array_like, shape (F,)
            When the frames were exposed [s].
        delay : float
            Of the log [s].
        reach : float
            Largest time by which frames may lie beyond the log [s].

        Raises
        ------
        InputError
            If frames lie beyond the log by more than that.
        """
        wanted = np.asarray(frame_times, dtype=float) + delay
        first, last = self.times[[0, -1]]
        beyond = max(first - wanted.min(initial=first), wanted.max(initial=last) - last)
        if not beyond <= reach:
            raise InputError(
                f"Frames from {wanted.min() - delay:.6g} to {wanted.max() - delay:.6g} s lie "
                f"{beyond:.3g} s beyond the log, which goes from {first:.6g} to {last:.6g} s; up "
                f"to {reach:g} s can be searched. Give times of one clock, a longer log, or frames "
                "within it."
            )
        left = np.clip(np.searchsorted(self.times, wanted) - 1, 0, len(self.times) - 2)
        step = self.times[left + 1] - self.times[left]
        share = np.clip((wanted - self.times[left]) / step, 0.0, 1.0)
        parts: dict[str, Any] = {}
        for one in fields(BenchLoads):
            if one.name == "tactels":
                continue
            values = getattr(self, one.name)
            weight = share.reshape(-1, *[1] * (values.ndim - 1))
            start, end = values[left], values[left + 1]
            # a moment itself counts where its neighbour has no such contact
            between = (1 - weight) * start + weight * end
            parts[one.name] = np.where(weight == 0, start, np.where(weight == 1, end, between))
        return BenchLoads(**parts)


def load_log(
    times: ArrayLike,
    places: ArrayLike,
    forces: ArrayLike,
    contacts: ArrayLike | None = None,
    **stated: ArrayLike,
) -> LoadLog:
    """A log from a list of moments, each of one contact.

    Parameters
    ----------
    times : array_like, shape (m,)
        When [s].
    places : array_like, shape (m,), or (m, 2) on a pad
        Where [m]; not a number where nothing is stated because nothing presses.
    forces : array_like, shape (m, 2), or (m, 3) on a pad
        How much [N].
    contacts : array_like of int, shape (m,), optional
        Number of the contact of each moment, from 0; one contact if not given.  Each is linear
        between its own moments, and does not exist before its first and after its last.
    **stated
        place_std, force_std, widths, radii and width_std, for each moment or one for all.

    Raises
    ------
    InputError
        If one contact has two loads at one time, or shapes differ.
    """
    when = np.asarray(times, dtype=float)
    which = np.zeros(len(when), int) if contacts is None else np.asarray(contacts, dtype=int)
    series = [np.flatnonzero(which == number) for number in np.unique(which)]
    moments = np.unique(when)
    tables = []
    for rows in series:
        rows = rows[np.argsort(when[rows], kind="stable")]
        twice = np.flatnonzero(np.diff(when[rows]) == 0)
        if twice.size:
            raise InputError(
                f"A contact has two loads at {when[rows[twice[0]]]:g} s; give one, or number "
                "several contacts in a column 'contact'."
            )
        own: dict[str, Any] = {name: np.asarray(v, dtype=float) for name, v in stated.items()}
        one = bench_loads(
            _filled(when[rows], np.asarray(places, dtype=float)[rows]),
            np.asarray(forces, dtype=float)[rows],
            **{name: value[rows] if value.ndim else value for name, value in own.items()},
        )
        tables.append(_resampled(one, when[rows], moments))
    parts = {
        one.name: np.concatenate([getattr(table, one.name) for table in tables], axis=1)
        for one in fields(BenchLoads)
        if one.name != "tactels"
    }
    return LoadLog(moments, **parts)


def _filled(times: Array, places: Array) -> Array:
    """Places of moments that state none: between those that do."""
    columns = places.reshape(len(places), -1).T
    filled = []
    for column in columns:
        known = np.isfinite(column)
        filled.append(np.interp(times, times[known], column[known]) if known.any() else column)
    return np.array(filled).T.reshape(places.shape)


def _resampled(loads: BenchLoads, own: Array, moments: Array) -> BenchLoads:
    """One contact at the moments of all."""
    inside = (moments >= own.min(initial=np.inf)) & (moments <= own.max(initial=-np.inf))

    def on_moments(values: Array) -> Array:
        columns = values.reshape(len(own), -1).T
        found = np.array([np.interp(moments, own, column) for column in columns]).T
        found[~inside] = np.nan
        return found.reshape(len(moments), *values.shape[1:])

    return loads.mapped(on_moments)
