"""What is written down of the loads of a bench: contacts at places, or at tactels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.contacts.press import Press
from fringeforce.design.strip import Sensor

NAMED = 0.1
"""Share of the largest force below which a part of a description is left out."""


@dataclass(frozen=True, eq=False)
class KnownLoads:
    """Contacts of F frames, k at most in each; what is not stated is not a number.

    Attributes
    ----------
    places : ndarray, shape (F, k)
        Along the strip [m]; not a number where a frame has fewer contacts.
    forces : ndarray, shape (F, k, 2)
        Normal and tangential [N]; zero there.
    widths : ndarray, shape (F, k)
        Of the contacts [m].
    place_std, width_std : ndarray, shape (F, k)
        How far places and widths may be wrong, one standard deviation [m].
    force_std : ndarray, shape (F, k, 2)
        How far forces may be wrong [N].
    tactels : ndarray of int, shape (F, k)
        Tactel of each contact, counted from 0; -1 where there is none.
    """

    places: Array
    forces: Array
    widths: Array
    place_std: Array
    width_std: Array
    force_std: Array
    tactels: Index

    @classmethod
    def of(cls, places: Array, forces: Array) -> KnownLoads:
        """Contacts of which nothing else is stated."""
        none = np.full(places.shape, np.nan)
        tactels = np.full(places.shape, -1)
        return cls(places, forces, none, none, none, np.full(forces.shape, np.nan), tactels)

    @classmethod
    def at_tactels(cls, sensor: Sensor, forces: Array) -> KnownLoads:
        """Loads of tactels, shape (F, n, 2) [N]; those without any are not touched."""
        touched = np.abs(forces).max(axis=2) > 0
        most = max(int(touched.sum(axis=1).max(initial=0)), 1)
        places, found = np.full((len(forces), most), np.nan), np.zeros((len(forces), most, 2))
        tactels = np.full(places.shape, -1)
        for row, (load, where) in enumerate(zip(forces, touched, strict=True)):
            count = int(where.sum())
            places[row, :count] = sensor.tactels.positions[where]
            found[row, :count] = load[where]
            tactels[row, :count] = np.flatnonzero(where)
        return replace(cls.of(places, found), tactels=tactels)

    @classmethod
    def of_presses(cls, presses: Sequence[Sequence[Press]]) -> KnownLoads:
        """Presses of every frame; the width of one with a radius is left to the fit."""
        most = max([1, *map(len, presses)])
        places, widths = np.full((2, len(presses), most), np.nan)
        forces = np.zeros((len(presses), most, 2))
        for row, own in enumerate(presses):
            for column, press in enumerate(own):
                places[row, column] = press.x
                forces[row, column] = press.normal, press.shear[0]
                if isinstance(press.width, int | float):
                    widths[row, column] = press.width
        return replace(cls.of(places, forces), widths=widths)

    def __len__(self) -> int:
        return len(self.places)

    @property
    def touched(self) -> Mask:
        """Frames with a contact, shape (F,)."""
        return np.isfinite(self.places).any(axis=1)

    def rows(self, chosen: Any) -> KnownLoads:
        """Some of the frames."""
        return KnownLoads(*(getattr(self, name)[chosen] for name in self.__dataclass_fields__))

    def with_unloaded(self, count: int) -> KnownLoads:
        """The same with frames behind them that nothing touches."""
        parts = []
        for name in self.__dataclass_fields__:
            values = getattr(self, name)
            none = {"forces": 0.0, "tactels": -1}.get(name, np.nan)
            more = np.full((count, *values.shape[1:]), none, dtype=values.dtype)
            parts.append(np.concatenate([values, more]))
        return KnownLoads(*parts)

    def described(self, row: int) -> str:
        """The largest forces of a frame in words."""
        own = np.flatnonzero(np.isfinite(self.places[row]))
        places = [
            f"tactel {self.tactels[row, j] + 1}"
            if self.tactels[row, j] >= 0
            else f"{self.places[row, j] * 1e3:.3g} mm"
            for j in own
        ]
        return described(self.forces[row, own], places)


def described(forces: Array, places: Sequence[str]) -> str:
    """The largest of some forces in words.

    Parameters
    ----------
    forces : ndarray, shape (k, 2)
        Normal and tangential [N].
    places : sequence of str
        Where they act.
    """
    largest = np.abs(forces).max(initial=0.0)
    if largest == 0:
        return "no load"
    order = np.unravel_index(np.argsort(-np.abs(forces), axis=None), forces.shape)
    words = [
        f"{forces[j, kind]:.3g} N {('normal', 'tangential')[kind]} {_at(places[j])}"
        for j, kind in zip(*order, strict=True)
        if abs(forces[j, kind]) > NAMED * largest
    ]
    return ", ".join(words[:3]) + (" and more" if words[3:] else "")


def _at(place: str) -> str:
    return f"on {place}" if place.startswith("tactel") else f"at {place}"
