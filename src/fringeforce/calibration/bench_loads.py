"""What a bench says of the loads behind its frames: by tactel, by place, or by time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array, Index, Mask, numbers
from fringeforce.base.errors import InputError
from fringeforce.contacts.press import Press


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
        return np.asarray(np.isfinite(self.forces).all(axis=-1), bool)

    @property
    def named(self) -> bool:
        """Whether all contacts are on tactels by their numbers."""
        return self.tactels is not None and bool((self.tactels >= 0)[self.present].all())

    @property
    def stated(self) -> bool:
        """Whether more is stated of any contact than its place and forces."""
        more = self.place_std, self.widths, self.radii, self.width_std, self.force_std
        return any(bool(np.isfinite(values).any()) for values in more)

    @property
    def magnitude(self) -> Array:
        """Size of all forces of a frame together, the sum over its contacts, shape (F,) [N]."""
        return np.linalg.norm(np.nan_to_num(self.forces), axis=-1).sum(axis=-1)

    def mapped(self, change: Callable[[Any], Any]) -> BenchLoads:
        """The same with every array changed, those that are None excepted."""
        values = ((one.name, getattr(self, one.name)) for one in fields(self))
        parts: dict[str, Any] = {k: None if v is None else change(v) for k, v in values}
        return BenchLoads(**parts)

    def rows(self, chosen: ArrayLike) -> BenchLoads:
        """Loads of some of the frames."""
        return self.mapped(lambda values: values[chosen])

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
        """The same as presses, for each frame, to simulate it.

        Widths that are not stated are lines, or points on a pad.

        Raises
        ------
        InputError
            If a contact does not press.
        """
        present = self.present
        pulling = present & (self.forces[..., 0] <= 0)
        if pulling.any():
            frame, contact = np.argwhere(pulling)[0]
            raise InputError(
                f"Frame {frame}: a contact with {self.forces[frame, contact, 0]:g} N of normal "
                "force does not press; a contact anywhere needs more than 0."
            )
        return [
            [self.press(frame, int(contact)) for contact in np.flatnonzero(pressing)]
            for frame, pressing in enumerate(present)
        ]

    def press(self, frame: int, contact: int) -> Press:
        """One contact of a frame as a press, with a friction that its shear does not exceed."""
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
    loads = numbers(forces, "Forces")
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


def loads_on_tactels(forces: ArrayLike, places: Array) -> BenchLoads:
    """Loads of tactels; those without a force have no contact.

    Parameters
    ----------
    forces : array_like, shape (F, n, components)
        [N].
    places : ndarray, shape (n, 1), or (n, 2) on a pad
        Of the tactels [m].
    """
    loads = np.asarray(forces, dtype=float)
    frame, tactel = np.nonzero(np.any(loads != 0, axis=-1))
    where = places[tactel]
    where = where[:, 0] if where.shape[1] == 1 else where
    return bench_loads(where, loads[frame, tactel], frame, len(loads), tactels=tactel)


def presses_as_loads(presses: Sequence[Sequence[Press]]) -> BenchLoads:
    """Loads from the presses of every frame on a strip, or on a pad where they have a y."""
    flat = [(frame, press) for frame, own in enumerate(presses) for press in own]
    width = [press.width if isinstance(press.width, int | float) else np.nan for _, press in flat]
    on_pad = any(press.y is not None for _, press in flat)
    places = [(press.x, press.y or 0.0) if on_pad else press.x for _, press in flat]
    forces = [(press.normal, *press.shear[: 2 if on_pad else 1]) for _, press in flat]
    return bench_loads(
        np.array(places),
        np.array(forces).reshape(len(flat), 3 if on_pad else 2),
        np.array([frame for frame, _ in flat], dtype=int),
        len(presses),
        widths=np.array(width),
        radii=np.array([np.nan if p.radius is None else p.radius for _, p in flat]),
    )


def in_words(loads: BenchLoads) -> list[str]:
    """What to press in each frame, in words.

    Left and right are those of someone who sees x point to the right; a pad's tangential forces are
    told by their axes.
    """
    said = []
    for frame, present in enumerate(loads.present):
        parts = [_words(loads, frame, int(contact)) for contact in np.flatnonzero(present)]
        said.append("; ".join(part for part in parts if part) or "no load")
    return said


def _words(loads: BenchLoads, frame: int, contact: int) -> str:
    normal, *shear = loads.forces[frame, contact]
    if not loads.forces[frame, contact].any():
        return ""
    tactel = -1 if loads.tactels is None else loads.tactels[frame, contact]
    where = [f"{value * 1e3:.1f} mm" for value in np.atleast_1d(loads.places[frame, contact])]
    place = (
        [f"{axis} {one}" for axis, one in zip("xy", where, strict=False)] if where[1:] else where
    )
    on = f"on tactel {tactel + 1} " if tactel >= 0 else ""
    names: Sequence[tuple[str, str]] = (("down", "up"), ("right", "left"))
    if shear[1:]:
        names = (("down", "up"), ("towards +x", "towards -x"), ("towards +y", "towards -y"))
    forces = [
        f"{abs(value):.3g} N {words[int(value < 0)]}"
        for value, words in zip((normal, *shear), names, strict=True)
        if f"{abs(value):.3g}" != "0"
    ]
    verb = "press" if normal > 0 else "push" if normal == 0 else "pull"
    return f"{verb} {on}at {', '.join([*place, *forces])}"
