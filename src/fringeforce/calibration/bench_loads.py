"""What a bench says of the loads behind its frames: by tactel, by place, or by time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.base.errors import InputError
from fringeforce.contacts.press import Press

REACH = 2.0
"""Delay up to which a log and frames are searched for each other: clocks started by hand [s]."""


@dataclass(frozen=True, eq=False)
class BenchLoads:
    """Known loads of F frames, at most k contacts in each.

    What is not stated, and what belongs to a contact that a frame does not have, is not a number.

    Attributes
    ----------
    places : ndarray, shape (F, k), or (F, k, 2) on a pad
        Where each contact is written down to be [m].
    forces : ndarray, shape (F, k, 2), or (F, k, 3) on a pad
        Normal force into the surface, and tangential force towards +x, on a pad +x and +y [N].
    place_std : ndarray, shape (F, k)
        Standard deviation of a place, along every axis [m].
    force_std : ndarray, shape of `forces`
        Standard deviations of the forces [N].
    widths, width_std : ndarray, shape (F, k)
        Whole widths of the contacts, and their standard deviations [m].
    radii : ndarray, shape (F, k)
        Radii of the indenters [m].
    tactels : ndarray of int, shape (F, k), optional
        Tactels that were pressed, counted from 0; -1 where there is no contact, or one anywhere.
        None if no contact is on a tactel by its number.

    Raises
    ------
    InputError
        If shapes differ.

    Examples
    --------
    >>> from fringeforce.calibration.bench_loads import bench_loads, in_words
    >>> loads = bench_loads([3e-3, 1e-3], [(2.7, -1.3), (1.0, 0.2)], frames=[0, 2])
    >>> loads.places.shape, loads.present.sum(axis=1)
    ((3, 1), array([1, 0, 1]))
    >>> in_words(loads)[0]
    'press at 3.0 mm, 2.7 N down, 1.3 N left'
    """

    places: Array
    forces: Array
    place_std: Array
    force_std: Array
    widths: Array
    radii: Array
    width_std: Array
    tactels: Index | None = None

    def __post_init__(self) -> None:
        shape = self.forces.shape[:2]
        axes = (2,) if self.forces.shape[-1:] == (3,) else ()
        wanted = {"places": (*shape, *axes), "force_std": self.forces.shape}
        for one in fields(self):
            value = getattr(self, one.name)
            expected = wanted.get(one.name, self.forces.shape if one.name == "forces" else shape)
            if value is not None and (value.shape != expected or self.forces.ndim != 3):
                raise InputError(
                    f"{one.name} of loads has the shape {value.shape}; it must be {expected}, "
                    "frames by contacts, as forces are (frames, contacts, components)."
                )

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.forces)

    @property
    def present(self) -> Mask:
        """Which contacts there are, shape (F, k)."""
        return np.isfinite(self.forces).all(axis=-1)

    @property
    def magnitude(self) -> Array:
        """Size of all forces of a frame together, the sum over its contacts, shape (F,) [N]."""
        return np.linalg.norm(np.nan_to_num(self.forces), axis=-1).sum(axis=-1)

    def rows(self, chosen: ArrayLike) -> BenchLoads:
        """Loads of some of the frames."""
        parts = {one.name: getattr(self, one.name) for one in fields(self)}
        return BenchLoads(**{k: v if v is None else v[chosen] for k, v in parts.items()})

    def on_tactels(self, count: int) -> Array:
        """Forces of every tactel, shape (F, count, components) [N].

        Raises
        ------
        InputError
            If a contact is not on a tactel by its number.
        """
        present = self.present
        numbers = np.full(present.shape, -1) if self.tactels is None else self.tactels
        free = present & ((numbers < 0) | (numbers >= count))
        if free.any():
            raise InputError(
                f"Contact {free.argmax() % free.shape[1] + 1} of frame {free.any(1).argmax()} is "
                f"not on one of {count} tactels; loads by place have no tactels."
            )
        found = np.zeros((len(self), count, self.forces.shape[-1]))
        frame, contact = np.nonzero(present)
        np.add.at(found, (frame, numbers[frame, contact]), self.forces[frame, contact])
        return found

    def presses(self) -> list[list[Press]]:
        """The same as presses, for each frame, to simulate it; only those that press.

        Widths that are not stated are lines, or points on a pad.
        """
        return [
            [self._press(frame, contact) for contact in np.flatnonzero(pressing)]
            for frame, pressing in enumerate(self.present & (self.forces[..., 0] > 0))
        ]

    def _press(self, frame: int, contact: int) -> Press:
        x, *y = np.atleast_1d(self.places[frame, contact]).tolist()
        normal, *shear = self.forces[frame, contact].tolist()
        radius, width = (float(v[frame, contact]) for v in (self.radii, self.widths))
        ratio = float(np.linalg.norm(shear)) / normal
        return Press(
            x=x,
            y=y[0] if y else None,
            normal=normal,
            tangential=(shear[0], shear[1]) if y else shear[0],
            width=None if np.isnan(width) or not np.isnan(radius) else width,
            radius=None if np.isnan(radius) else radius,
            friction=max(ratio * (1 + 1e-9), 0.6),
        )


def bench_loads(
    places: ArrayLike,
    forces: ArrayLike,
    frames: ArrayLike | None = None,
    count: int | None = None,
    *,
    place_std: ArrayLike = np.nan,
    force_std: ArrayLike = np.nan,
    widths: ArrayLike = np.nan,
    radii: ArrayLike = np.nan,
    width_std: ArrayLike = np.nan,
    tactels: ArrayLike | None = None,
) -> BenchLoads:
    """Loads from a list of contacts; several of one frame stand side by side.

    Parameters
    ----------
    places : array_like, shape (c,), or (c, 2) on a pad
        Of the contacts [m].
    forces : array_like, shape (c, 2), or (c, 3) on a pad
        Normal and tangential [N].
    frames : array_like of int, shape (c,), optional
        Frame of each contact, counted from 0; one after the other if not given.
    count : int, optional
        Number of frames; up to the last that has a contact if not given.
    place_std, force_std, widths, radii, width_std, tactels
        As in `BenchLoads`, for each contact or one for all.

    Raises
    ------
    InputError
        If shapes differ or a frame is beyond the number of frames.
    """
    loads = np.asarray(forces, dtype=float)
    if loads.ndim != 2 or loads.shape[1] not in (2, 3):
        raise InputError(
            f"Forces of shape {loads.shape} are no list of contacts; give (contacts, 2) in "
            "newtons, or (contacts, 3) on a pad."
        )
    number = len(loads)
    frame = np.arange(number) if frames is None else np.asarray(frames, dtype=int)
    total = int(frame.max(initial=-1)) + 1 if count is None else count
    if frame.shape != (number,) or (frame < 0).any() or (frame >= total).any():
        raise InputError(
            f"Frames of {number} contacts must be {number} whole numbers from 0 to {total - 1}."
        )
    order = np.argsort(frame, kind="stable")
    first = np.searchsorted(frame[order], frame[order])
    slot = np.empty(number, dtype=int)
    slot[order] = np.arange(number) - first
    most = int(slot.max(initial=0)) + 1
    axes = (2,) if loads.shape[1] == 3 else ()

    def table(values: ArrayLike, shape: tuple[int, ...] = (), empty: float = np.nan) -> Array:
        found = np.full((total, most, *shape), empty)
        found[frame, slot] = np.broadcast_to(np.asarray(values, dtype=float), (number, *shape))
        return found

    std = np.asarray(force_std, dtype=float)
    return BenchLoads(
        table(places, axes),
        table(loads, loads.shape[1:]),
        table(place_std),
        table(std[:, None] if std.ndim == 1 else std, loads.shape[1:]),
        table(widths),
        table(radii),
        table(width_std),
        None if tactels is None else table(tactels, (), -1).astype(np.intp),
    )


def loads_on_tactels(forces: ArrayLike, positions: Array) -> BenchLoads:
    """Loads of tactels; those without a force have no contact.

    Parameters
    ----------
    forces : array_like, shape (F, n, components)
        [N].
    positions : ndarray, shape (n,), or (n, 2) on a pad
        Places of the tactels [m].
    """
    loads = np.asarray(forces, dtype=float)
    frame, tactel = np.nonzero(np.any(loads != 0, axis=-1))
    return bench_loads(
        positions[tactel], loads[frame, tactel], frame, len(loads), tactels=tactel
    )


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
    >>> from fringeforce.calibration.bench_loads import load_log
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
        parts = {one.name: getattr(self, one.name) for one in fields(self)}
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
        parts = {}
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
    series = [np.flatnonzero(which == number) for number in range(which.max(initial=0) + 1)]
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
        own = {name: np.asarray(value, dtype=float) for name, value in stated.items()}
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

    parts = {one.name: getattr(loads, one.name) for one in fields(loads)}
    return BenchLoads(**{k: None if v is None else on_moments(v) for k, v in parts.items()})


def in_words(loads: BenchLoads) -> list[str]:
    """What to press in each frame, in words.

    Directions are those of someone who looks at the strip with x to the right; on a pad the second
    tangential force is towards +y, "up", or -y, "down", so that the normal one is "into" it.
    """
    said = []
    for frame, present in enumerate(loads.present):
        parts = [_words(loads, frame, contact) for contact in np.flatnonzero(present)]
        said.append("; ".join(part for part in parts if part) or "no load")
    return said


def _words(loads: BenchLoads, frame: int, contact: int) -> str:
    normal, *shear = loads.forces[frame, contact]
    if not loads.forces[frame, contact].any():
        return ""
    tactel = -1 if loads.tactels is None else loads.tactels[frame, contact]
    place = [f"{value * 1e3:.1f}" for value in np.atleast_1d(loads.places[frame, contact])]
    where = f"tactel {tactel + 1}" if tactel >= 0 else f"{', '.join(place)} mm"
    names: Sequence[tuple[str, str]] = (("down", "up"), ("right", "left"))
    if shear[1:]:
        names = (("down", "up"), ("towards +x", "towards -x"), ("towards +y", "towards -y"))
    forces = [
        f"{abs(value):.2g} N {words[value < 0]}"
        for value, words in zip((normal, *shear), names, strict=True)
        if f"{abs(value):.2g}" != "0"
    ]
    verb = "press" if normal > 0 else "pull"
    return f"{verb} {'on' if tactel >= 0 else 'at'} {where}, {', '.join(forces)}"
