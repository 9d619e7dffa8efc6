"""What is uncertain about the light and the camera of a pad.

- Light: gain and offset of the grey levels, and gamma.
- Forms: what pixels measure of the light, for visibility, plates and angles.
- Blur, and where the pixels look.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from fringeforce.base.arrays import Array, Index, Single
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import with_values
from fringeforce.models import splines
from fringeforce.models.design_modes import DRIFTS
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_unknowns import (
    BLUR,
    GAMMA,
    REGISTRATION,
    STD_STEP,
    UNEVEN,
    Group,
    group_at,
    is_form,
    value_of,
)
from fringeforce.optics.area_camera import Lens, Picture, pictures

SHARPEST_LENS = 1e-2
"""Smallest point spread, in pixels, that a lens is computed for."""
NEGLIGIBLE_ENTRY = 1e-7
"""Share of the largest entry of a spline's derivative below which single precision rounds it
away."""
SLOPE_BLOCK = 32
"""Pixels whose derivatives are taken together, about as many as their splines reach beyond them."""


@dataclass(frozen=True, eq=False)
class CameraUncertainty:
    """Light and camera of a pad with all that is uncertain about them.

    Attributes
    ----------
    model : PadModel
        Of the pad.
    groups : tuple of Group
        Unknowns of the pad; others may stand behind them.
    """

    model: PadModel
    groups: tuple[Group, ...]

    @property
    def size(self) -> int:
        """Number q of unknowns that are looked at; of more, those behind do nothing here."""
        return self.groups[-1].end if self.groups else 0

    def group(self, path: str) -> Group | None:
        """The unknowns of a value, if it has some."""
        return group_at(self.groups, path)

    @cached_property
    def acts_on_light(self) -> bool:
        """Whether any unknown changes light or camera, and not the retardance alone."""
        changed = self.brightness.any() or self.darkness.any() or self.forms
        return bool(changed) or any(self.group(path) for path in (BLUR, GAMMA, UNEVEN))

    # light

    @cached_property
    def brightness(self) -> Array:
        """Change of the amplitude with every unknown, as a share of it, shape (q,)."""
        found, camera = np.zeros(self.size), self.model.sensor.camera
        for group in self.groups:
            if group.path == "camera.amplitude":
                found[group.place] = group.std / camera.amplitude
            elif group.path == DRIFTS[0]:
                found[group.place] = group.std
        return found

    @cached_property
    def darkness(self) -> Array:
        """Change of the offset with every unknown, grey levels, shape (q,)."""
        found = np.zeros(self.size)
        if group := self.group("camera.offset"):
            found[group.place] = group.std
        return found

    def gain(self, extra: Array) -> float:
        """Amplitude over that of the drawing under unknowns, shape (at least q,)."""
        return 1.0 + float(self.brightness @ extra[: self.size])

    def dark(self, extra: Array) -> float:
        """Grey levels beside the offset of the drawing under unknowns."""
        return float(self.darkness @ extra[: self.size])

    def gamma(self, extra: Array) -> float:
        """Power of the grey level under unknowns."""
        drawn, group = float(self.model.sensor.camera.gamma), self.group(GAMMA)
        by = 0.0 if group is None else group.std * float(extra[group.begin])
        return max(drawn + by, drawn / 2)

    @cached_property
    def forms(self) -> list[tuple[int, list[Array]]]:
        """Unknowns that change what pixels measure, and by how much each picture's forms do."""
        pad, found = self.model.sensor, []
        for group in self.groups:
            if is_form(group.path):
                value = value_of(pad, group.path)
                step = STD_STEP * group.std
                low, high = _room(group.path, value, step)
                ends = [pictures(with_values(pad, {group.path: end})) for end in (low, high)]
                share = group.std / (high - low)
                change = [share * (up.forms - down.forms) for down, up in zip(*ends, strict=True)]
                found.append((group.begin, change))
        return found

    def pictures(self, extra: Array) -> tuple[Picture, ...]:
        """What the channels measure under unknowns."""
        seen = self.model.pictures
        for number, changes in self.forms:
            seen = tuple(
                replace(picture, forms=picture.forms + extra[number] * change)
                for picture, change in zip(seen, changes, strict=True)
            )
        return seen

    # blur

    def lens(self, extra: Array) -> Lens | None:
        """The lens under unknowns."""
        group = self.group(BLUR)
        return self.model.lens if group is None else self.lens_at(extra[group.begin])

    def lens_change(self, extra: Array) -> tuple[Lens, Lens, float]:
        """Lenses a little sharper and a little less sharp, and how far apart the unknowns are."""
        group = self.group(BLUR)
        assert group is not None
        here = float(extra[group.begin])
        ends = self._lens_ends.get(here)
        if ends is None:
            low = max(here - STD_STEP, self._sharpest)
            high = max(here + STD_STEP, low + STD_STEP)
            ends = self.lens_at(low), self.lens_at(high), high - low
            self._lens_ends.clear()
            self._lens_ends[here] = ends
        return ends

    @cached_property
    def _lens_ends(self) -> dict[float, tuple[Lens, Lens, float]]:
        """Those of `lens_change` at the last blur, for gradient and information want them."""
        return {}

    @property
    def pixel(self) -> float:
        """Distance of pixels [m]."""
        return float(np.diff(self.model.sensor.pixel_positions[0][:2])[0])

    @property
    def _sharpest(self) -> float:
        group = self.group(BLUR)
        assert group is not None
        drawn = self.model.sensor.camera.blur or 0.0
        return (SHARPEST_LENS * self.pixel - drawn) / group.std

    def lens_at(self, unknown: float) -> Lens:
        """The lens under the unknown of the blur."""
        group, pad = self.group(BLUR), self.model.sensor
        assert group is not None
        blur = (pad.camera.blur or 0) + max(unknown, self._sharpest) * group.std
        lens = Lens.of(with_values(pad, {BLUR: float(blur)}))
        assert lens is not None
        return lens

    # where the pixels look

    @cached_property
    def registration(self) -> tuple[Group, ...]:
        """Unknowns of where the pixels look."""
        return tuple(group for group in self.groups if group.path in REGISTRATION)

    def moves(self, extra: Array) -> bool:
        """Whether pixels look elsewhere under unknowns than as drawn."""
        return any(extra[group.begin] for group in self.registration)

    def looking(self, extra: Array) -> Pad:
        """The design with its camera where it is under unknowns."""
        pad = self.model.sensor
        values = {
            group.path: value_of(pad, group.path) + group.std * float(extra[group.begin])
            for group in self.registration
        }
        return with_values(pad, values)

    @cached_property
    def _slopes(self) -> tuple[csr_array, csr_array]:
        """From pixels to derivatives there, along x and along y [1/m].

        Differences of neighbours are off by several percent where tractions of the fourth order
        are seen with fifteen pixels a tactel.
        """
        x, y = self.model.sensor.pixel_positions
        found = []
        for slopes in (splines.slopes(x), splines.slopes(y)):
            shown = np.abs(slopes) > NEGLIGIBLE_ENTRY * np.abs(slopes).max()
            found.append(csr_array(np.where(shown, slopes, 0.0).astype(np.float32)))
        return found[0], found[1]

    @cached_property
    def _blocks(self) -> list[list[tuple[slice, slice, Single]]]:
        """The same for some pixels at a time, from those near them."""
        found = []
        for slopes in self._slopes:
            blocks = list[tuple[slice, slice, Single]]()
            for begin in range(0, slopes.shape[0], SLOPE_BLOCK):
                here = slice(begin, begin + SLOPE_BLOCK)
                near = np.unique(slopes[here].indices)
                reach = slice(near[0], near[-1] + 1)
                blocks.append((here, reach, slopes[here, reach].toarray()))
            found.append(blocks)
        return found

    def moved(self, modes: Single, rows: Index, columns: Index) -> Iterator[tuple[int, Single]]:
        """Derivatives of retardance by unknowns of where the pixels look, at a lattice.

        Parameters
        ----------
        modes : ndarray, shape (2, modes, rows, columns)
            At all pixels [rad].
        rows, columns : ndarray of int, shape (r,), (c,)
            Of the lattice.

        Yields
        ------
        number : int
            Of the unknown.
        derivative : ndarray, shape (2, modes, r, c)
        """
        if not self.registration:
            return
        (x, y), (by_x, by_y) = self.model.sensor.pixel_positions, self._slopes
        along = modes[:, :, rows] @ by_x[columns].toarray().T
        across = by_y[rows].toarray() @ modes[..., columns]
        for group in self.registration:
            a, b = _shares(group.path, x[columns], y[rows])
            yield group.begin, np.float32(group.std) * (a * along + b[:, None] * across)

    def by_registration(self, modes: Single, by_modes: Single) -> Array:
        """Derivative by the same unknowns, shape (q,), from that by the modes at all pixels."""
        found = np.zeros(self.size)
        if not self.registration:
            return found
        (x, y), (by_x, by_y) = self.model.sensor.pixel_positions, self._blocks
        # products of pairs of places near each other take less than derivatives at all pixels
        one, other = (part.reshape(-1, *part.shape[2:]) for part in (modes, by_modes))
        flat, others = one.reshape(-1, len(x)), other.reshape(-1, len(x))
        along = np.concatenate(
            [np.vecdot(weights, others[:, here].T @ flat[:, near]) for here, near, weights in by_x]
        )
        across = np.concatenate(
            [
                np.vecdot(weights, (other[:, here] @ one[:, near].swapaxes(1, 2)).sum(axis=0))
                for here, near, weights in by_y
            ]
        )
        for group in self.registration:
            a, b = _shares(group.path, x, y)
            found[group.begin] = group.std * float(a @ along + b @ across)
        return found


def _shares(path: str, x: Array, y: Array) -> tuple[Single, Single]:
    """How far columns and rows look further along x and along y, shapes of x and y."""
    if path == "camera.scale":
        return x.astype(np.float32), y.astype(np.float32)
    along = np.float32(path == "camera.shift_x")
    return np.full(len(x), along, np.float32), np.full(len(y), 1 - along, np.float32)


def _room(path: str, value: float, step: float) -> tuple[float, float]:
    """Values a step below and above, within what the field allows."""
    if path == "polariscope.visibility":
        return value - step, min(value + step, 1.0)
    if path.endswith("extinction_ratio"):
        return max(value - step, 0.0), value + step
    return value - step, value + step
