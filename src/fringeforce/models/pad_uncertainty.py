"""What is uncertain about a pad, as unknowns beside the forces: the tolerances of its design.

Every tolerance becomes one or more standardised unknowns, each normal with mean 0 and variance 1.
Those of a group act alike:

- light: gain and offset of the grey levels, anew in every frame for `camera.drift`, gamma, and
  Karhunen-Loeve modes of the unevenness of the light over the picture;
- forms: what pixels measure of the light, for visibility, plates and angles;
- blur, and where the pixels look;
- influence: sizes and materials, from the exact series at +- one standard deviation;
- residual: Karhunen-Loeve modes of the two parts of a smooth random retardance;
- contacts: the functions of `pad_traction_modes` for the traction on every tactel.

A value without a tolerance has no unknown and costs nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fringeforce.base.arrays import Index
from fringeforce.base.errors import InputError
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import number_at, with_values
from fringeforce.estimation.likelihood import Response
from fringeforce.models import splines
from fringeforce.models.as_built import LIGHT_LENGTH, PLACEMENT, RESIDUAL, SIZE
from fringeforce.models.imaging import camera_response
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_influence import PadInfluence, Retardance, with_even_profile
from fringeforce.models.pad_series import PadSeries, SeriesInfluence
from fringeforce.models.pad_slices import block_of
from fringeforce.models.pad_traction_influence import TractionInfluence
from fringeforce.models.pad_traction_modes import UNSEEN, TractionMode, traction_modes
from fringeforce.models.uncertainty import DRIFTS, FOLLOWED_STDS, karhunen_loeve
from fringeforce.optics.area_camera import Lens, Picture, pictures

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Mask = NDArray[np.bool_]
Number = TypeVar("Number", bound=np.generic)
LinearInfluence = PadInfluence | SeriesInfluence

SMALLEST = 2e-6
"""Variance of a mode of a smooth field, relative to the largest, below which it is left out: of an
unevenness of 5 % that leaves .1 grey levels in the corners.  The .8 that 1e-4 would leave there are
more than the noise of a calibration's frames together."""
LIGHT = "camera.amplitude", "camera.offset"
REGISTRATION = "camera.shift_x", "camera.shift_y", "camera.scale"
BLUR, GAMMA, UNEVEN = "camera.blur", "camera.gamma", "camera.unevenness"
FIELDS = RESIDUAL, UNEVEN
"""Values that are smooth fields, of many unknowns each."""
EFFECTS = (
    "transducer.photoelastic.strain_optic_coefficient",
    "transducer.photoelastic.stress_optic_coefficient",
)
SCALING = *EFFECTS, "polariscope.wavelength"
"""Values that only scale the influence: with the effect, and with the inverse of the wavelength."""
LAYERS = "transducer.compliant.", "transducer.photoelastic."
PITCH = "tactels.pitch"
SHARPEST_LENS = 1e-2
"""Smallest point spread, in pixels, that a lens is computed for."""
NEGLIGIBLE_ENTRY = 1e-7
"""Share of the largest entry of a spline's derivative below which single precision rounds it
away."""
STD_STEP = 0.1
"""Step of numerical derivatives of the lens, in standard deviations."""


class ContactLight(Protocol):
    """Retardance of t functions of the tractions of n tactels; `TractionInfluence` is one."""

    def forward(self, shares: Array, forces: Array) -> Single:
        """Spline coefficients under shares (t, n) of forces (n, 3)."""
        ...

    def adjoint(self, grid: Single, tactels: Index) -> Array:
        """From derivatives by the coefficients to those by shares times forces, (t, l, 3)."""
        ...

    def matrices(self, x: Array, y: Array, begin: Index, end: Index) -> dict[int, Single]:
        """Retardance of some functions of every tactel, (3, 2, modes, r * c, l) each."""
        ...


@dataclass(frozen=True, eq=False)
class Group:
    """Unknowns of one kind.

    Attributes
    ----------
    path : str
        Dotted path of the design.
    begin, end : int
        Where they stand among the unknowns.
    std : float
        Standard deviation in the unit of the value.
    """

    path: str
    begin: int
    end: int
    std: float

    @property
    def place(self) -> slice:
        """Where they stand."""
        return slice(self.begin, self.end)


@dataclass(frozen=True, eq=False)
class PadUncertainty:
    """A pad with all that is uncertain about it.

    Attributes
    ----------
    model : PadModel
        Whose design has the tolerances; of its depth profiles one is even where there is a
        residual.
    series : PadSeries, optional
        Of the same pad with other tolerances, whose influences are taken where they are known.
    """

    model: PadModel
    series: PadSeries | None = None

    @classmethod
    def of(cls, model: PadModel, series: PadSeries | None = None) -> PadUncertainty:
        """That of a model, whose depth profiles need not be able to hold a residual."""
        if RESIDUAL in model.sensor.tolerances:
            weights = block_of(model.sensor).depths(len(model.influence.profile))[1]
            model = replace(model, influence=with_even_profile(model.influence, weights))
        return cls(model, series)

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """Unknowns by kind.

        Raises
        ------
        InputError
            If readings of pads do not allow for a tolerance.
        """
        pad, found, begin = self.model.sensor, list[Group](), 0
        stated = dict(pad.tolerances)
        if pad.camera.unevenness:
            stated[UNEVEN] = pad.camera.unevenness
        if pad.camera.drift:
            stated[DRIFTS[0]] = pad.camera.drift
        for path, std in stated.items():
            if problem := refusal(pad, path):
                raise InputError(problem)
            count = 1
            if path == RESIDUAL:
                count = 2 * len(self._fields[2])
            elif path == UNEVEN:
                count = len(self._shades[2])
            elif path in (PLACEMENT, SIZE):
                continue
            found.append(Group(path, begin, begin + count, std))
            begin += count
        if self.tractions:
            size = pad.tactels.total * len(self.tractions)
            found.append(Group(PLACEMENT, begin, begin + size, 1.0))
        return tuple(found)

    @cached_property
    def size(self) -> int:
        """Number of unknowns."""
        return self.groups[-1].end if self.groups else 0

    @cached_property
    def lasting(self) -> Mask:
        """Unknowns that stay as they are from frame to frame, shape (size,)."""
        lasts = np.ones(self.size, dtype=bool)
        for group in self.groups:
            lasts[group.place] = group.path not in (DRIFTS[0], PLACEMENT)
        return lasts

    @cached_property
    def expected(self) -> tuple[Array, Array]:
        """Mean, shape (size,), and precision, (k, k), of the unknowns before any frame.

        The last ones, of tractions, are apart from all, and have a precision of one.
        """
        known, tractions, mean = self.model.known, self.group(PLACEMENT), np.zeros(self.size)
        count = self.size if tractions is None else tractions.begin
        if known is None:
            return mean, np.eye(count)
        places = {group.path: (group.place, group.std) for group in self.groups}
        mean[:count], precision = known.expected(places, count)
        return mean, precision

    def group(self, path: str) -> Group | None:
        """The unknowns of a value; those of contacts are at the path of their placement."""
        return next((group for group in self.groups if group.path == path), None)

    @cached_property
    def looseness(self) -> float:
        """Standard deviation of what they change of the sine of a retardance, where it is a half.

        Contacts and sizes are left out, which change it near contacts only.
        """
        pad, square = self.model.sensor, 0.0
        for group in self.groups:
            if group.path in FIELDS:
                squares, lasting = np.ones(self.size), self.lasting
                precision = self.expected[1][np.ix_(lasting, lasting)]
                squares[lasting] = np.diag(np.linalg.inv(precision))
                own = squares[group.place]
                residual = group.path == RESIDUAL
                square += self.residual_square(own) if residual else self.uneven_square(own) / 4
            elif group.path == GAMMA:
                square += (group.std * np.log(2)) ** 2
            elif group.path in ("camera.amplitude", "polariscope.visibility"):
                square += (group.std / (2 * value_of(pad, group.path))) ** 2
            elif group.path == "camera.offset":
                square += (2 * group.std / pad.camera.amplitude) ** 2
            elif group.path == DRIFTS[0]:
                square += group.std**2 / 4
        return float(np.sqrt(square))

    # light and camera

    @cached_property
    def brightness(self) -> Array:
        """Change of the amplitude with every unknown, as a share of it, shape (size,)."""
        found, camera = np.zeros(self.size), self.model.sensor.camera
        for group in self.groups:
            if group.path == "camera.amplitude":
                found[group.place] = group.std / camera.amplitude
            elif group.path == DRIFTS[0]:
                found[group.place] = group.std
        return found

    @cached_property
    def darkness(self) -> Array:
        """Change of the offset with every unknown, grey levels, shape (size,)."""
        found = np.zeros(self.size)
        if group := self.group("camera.offset"):
            found[group.place] = group.std
        return found

    @property
    def gamma(self) -> float:
        """Power of the grey level, as drawn."""
        return float(self.model.sensor.camera.gamma)

    def gamma_at(self, extra: Array) -> float:
        """The same under unknowns, shape (size,)."""
        group = self.group(GAMMA)
        by = 0.0 if group is None else group.std * float(extra[group.begin])
        return max(self.gamma + by, self.gamma / 2)

    @cached_property
    def _shades(self) -> tuple[Array, Array, NDArray[np.intp]]:
        """Modes of the unevenness of the light.

        Fields along y and along x at the pixels, and numbers (k, 2) of those that each mode is the
        product of.
        """
        block, found = self.model.sensor.transducer, []
        x, y = self.model.sensor.pixel_positions
        for places, side in ((y, block.width), (x, block.length)):
            found.append(karhunen_loeve(places, LIGHT_LENGTH * side, SMALLEST))
        sizes = np.outer(*(np.square(field).sum(axis=1) for field in found))
        return found[0], found[1], np.argwhere(sizes > SMALLEST * sizes.max())

    def unevenness(self, extra: Array) -> Array:
        """Share by which every pixel is brighter under unknowns, shape (rows, columns)."""
        group = self.group(UNEVEN)
        assert group is not None
        across, along, chosen = self._shades
        shares = np.zeros((len(across), len(along)))
        shares[chosen[:, 0], chosen[:, 1]] = group.std * extra[group.place]
        return np.asarray(across.T @ shares @ along)

    def unevenness_adjoint(self, image: Array) -> Array:
        """Derivative by these unknowns from that by the share of every pixel."""
        group = self.group(UNEVEN)
        assert group is not None
        across, along, chosen = self._shades
        shares = group.std * across @ image @ along.T
        return np.asarray(shares[chosen[:, 0], chosen[:, 1]])

    def unevenness_at(self, rows: Index, columns: Index) -> Single:
        """Modes of the share at all pairs of rows and columns of pixels, shape (k, r * c)."""
        group = self.group(UNEVEN)
        assert group is not None
        across, along, chosen = self._shades
        fields = across[chosen[:, 0]][:, rows, None] * along[chosen[:, 1]][:, None, columns]
        return np.asarray(group.std * fields.reshape(len(chosen), -1), dtype=np.float32)

    def uneven_square(self, squares: Array) -> float:
        """Mean square of the share over the picture, from those of its unknowns."""
        rows, columns = (np.arange(0, n, 4) for n in self.model.frame_shape[-2:])
        return float(np.square(self.unevenness_at(rows, columns)).mean(axis=1) @ squares)

    @property
    def expected_light(self) -> Array | None:
        """Share of the light of every pixel that is expected, (rows, columns); none if all."""
        group, mean = self.group(UNEVEN), self.expected[0]
        return None if group is None or not mean[group.place].any() else 1 + self.unevenness(mean)

    @cached_property
    def forms(self) -> list[tuple[int, list[Array]]]:
        """Unknowns that change what pixels measure, and by how much each picture's forms do."""
        pad, found = self.model.sensor, []
        for group in self.groups:
            if _is_form(group.path):
                value = value_of(pad, group.path)
                step = STD_STEP * group.std
                low, high = _room(pad, group.path, value, step)
                ends = [pictures(with_values(pad, {group.path: end})) for end in (low, high)]
                share = group.std / (high - low)
                change = [share * (up.forms - down.forms) for down, up in zip(*ends, strict=True)]
                found.append((group.begin, change))
        return found

    @cached_property
    def acts_on_light(self) -> bool:
        """Whether any unknown changes light or camera, and not the retardance alone."""
        changed = self.brightness.any() or self.darkness.any() or self.forms
        return bool(changed) or any(self.group(path) for path in (BLUR, GAMMA, UNEVEN))

    def pictures(self, extra: Array) -> tuple[Picture, ...]:
        """What the channels measure under unknowns, shape (size,)."""
        seen = self.model.pictures
        for number, changes in self.forms:
            seen = tuple(
                replace(picture, forms=picture.forms + extra[number] * change)
                for picture, change in zip(seen, changes, strict=True)
            )
        return seen

    def lens(self, extra: Array) -> Lens | None:
        """The lens under unknowns."""
        group = self.group(BLUR)
        return self.model.lens if group is None else self._lens(extra[group.begin])

    def lens_change(self, extra: Array) -> tuple[Lens, Lens, float]:
        """Lenses a little sharper and a little less sharp, and how far apart the unknowns are."""
        group = self.group(BLUR)
        assert group is not None
        here = float(extra[group.begin])
        ends = self._lens_ends.get(here)
        if ends is None:
            low = max(here - STD_STEP, self._sharpest)
            high = max(here + STD_STEP, low + STD_STEP)
            ends = self._lens(low), self._lens(high), high - low
            self._lens_ends.clear()
            self._lens_ends[here] = ends
        return ends

    @cached_property
    def _lens_ends(self) -> dict[float, tuple[Lens, Lens, float]]:
        """Those of `lens_change` at the last blur, for gradient and information want them."""
        return {}

    @property
    def _sharpest(self) -> float:
        group = self.group(BLUR)
        assert group is not None
        x = self.model.sensor.pixel_positions[0]
        return float(
            (SHARPEST_LENS * (x[1] - x[0]) - (self.model.sensor.camera.blur or 0)) / group.std
        )

    def _lens(self, unknown: float) -> Lens:
        group, pad = self.group(BLUR), self.model.sensor
        assert group is not None
        blur = (pad.camera.blur or 0) + max(unknown, self._sharpest) * group.std
        lens = Lens.of(with_values(pad, {BLUR: float(blur)}))
        assert lens is not None
        return lens

    @cached_property
    def registration(self) -> tuple[Group, ...]:
        """Unknowns of where the pixels look."""
        return tuple(group for group in self.groups if group.path in REGISTRATION)

    def looking(self, extra: Array) -> Pad:
        """The design with its camera where it is under unknowns."""
        pad = self.model.sensor
        values = {
            group.path: value_of(pad, group.path) + group.std * float(extra[group.begin])
            for group in self.registration
        }
        return with_values(pad, values)

    def retarding(self, extra: Array) -> Retardance:
        """From spline coefficients to the pixels, where they look under unknowns."""
        if not self.registration or not any(extra[group.begin] for group in self.registration):
            return self.model.retarding
        return Retardance.at(self.model.influence, *self.looking(extra).pixel_positions)

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
        """Derivative by the same unknowns, shape (size,), from that by the modes at all pixels."""
        found = np.zeros(self.size)
        if not self.registration:
            return found
        (x, y), (by_x, by_y) = self.model.sensor.pixel_positions, self._slopes
        # products of all pairs of places take less than derivatives at all pixels
        one, other = (part.reshape(-1, *part.shape[2:]) for part in (modes, by_modes))
        columns = other.reshape(-1, len(x)).T @ one.reshape(-1, len(x))
        rows = np.matmul(other, one.swapaxes(1, 2)).sum(axis=0)
        along, across = (
            np.asarray(slopes.multiply(pairs).sum(axis=1)).ravel()
            for slopes, pairs in ((by_x, columns), (by_y, rows))
        )
        for group in self.registration:
            a, b = _shares(group.path, x, y)
            found[group.begin] = group.std * float(a @ along + b @ across)
        return found

    # mechanics

    @cached_property
    def values(self) -> tuple[tuple[Group, tuple[LinearInfluence, ...]], ...]:
        """Unknowns of sizes and materials, and the change of the influence with their powers."""
        return tuple(
            (group, self._changes(group))
            for group in self.groups
            if group.path in SCALING or group.path.startswith(LAYERS) or group.path == PITCH
        )

    @cached_property
    def mechanics(self) -> PadSeries:
        """Of a pad with roller sides, in the depth profiles of the model."""
        base = self.model.influence
        if self.series is not None and self.series.base.modes == base.modes:
            return self.series
        return PadSeries(self.model.sensor, base)

    def _changes(self, group: Group) -> tuple[LinearInfluence, ...]:
        value = value_of(self.model.sensor, group.path)
        if group.path not in SCALING:
            return self.mechanics.changes(group.path, group.std)
        share = group.std / value
        powers = (share,) if group.path in EFFECTS else (-share, share**2)
        return tuple(_scaled(self.model.influence, power) for power in powers)

    @cached_property
    def tractions(self) -> tuple[TractionMode, ...]:
        """How the traction on every tactel may be unlike that on its square."""
        return traction_modes(self.model.sensor, self.model.influence.profile)

    @cached_property
    def contacts(self) -> ContactLight | None:
        """Light of these functions, if there are any."""
        if not self.tractions:
            return None
        return TractionInfluence(self.mechanics, self.tractions)

    def deviations(self, extra: NDArray[Number]) -> NDArray[Number]:
        """Of what is told of all unknowns, shape (size,), that of the tractions, (functions, n)."""
        group = self.group(PLACEMENT)
        assert group is not None
        return extra[group.place].reshape(-1, int(np.prod(self.model.influence.count)))

    @cached_property
    def _fields(self) -> tuple[Array, Array, NDArray[np.intp], Array]:
        """Modes of one part of the residual.

        Spline coefficients of the fields along y and along x, numbers (k, 2) of those that each
        mode is the product of, and depth profiles, shape (modes,), of a retardance of unit depth
        integral over both passes that is the same at all depths.
        """
        pad, base = self.model.sensor, self.model.influence
        length = pad.polariscope.residual_length
        fields = [karhunen_loeve(places, length, SMALLEST) for places in (base.y, base.x)]
        across, along = (
            field @ splines.coefficients(places).T
            for field, places in zip(fields, (base.y, base.x), strict=True)
        )
        sizes = np.outer(*(np.square(field).sum(axis=1) for field in fields))
        chosen = np.argwhere(sizes > SMALLEST * sizes.max())
        weights = block_of(pad).depths(len(base.profile))[1]
        even, *_ = np.linalg.lstsq(base.profile, weights / (2 * weights.sum()))
        return across, along, chosen, even

    def coefficients(self, forces: Array, extra: Array, reference: Array | None = None) -> Single:
        """Spline coefficients of the retardance, shape (2, modes, ny, nx) [rad].

        Parameters
        ----------
        forces : ndarray, shape (3 n,)
            Forces [N].
        extra : ndarray, shape (size,)
            The unknowns.
        reference : ndarray, shape (3 n,), optional
            Forces that the spread of tractions is relative to; the forces themselves if not given.
        """
        spread = forces if reference is None else reference
        grid = self.model.influence.forward(forces)
        for group, powers in self.values:
            for power, change in enumerate(powers, 1):
                grid += np.float32(extra[group.begin] ** power) * change.forward(forces)
        if self.contacts is not None:
            own = self.deviations(self.shown(spread)).any(axis=0)
            grid += self.contacts.forward(own * self.deviations(extra), spread.reshape(-1, 3))
        if self.group(RESIDUAL):
            grid += self.residual(extra)
        return grid

    def residual(self, extra: Array) -> Single:
        """Spline coefficients of the retardance without forces, shape (2, modes, ny, nx) [rad]."""
        group = self.group(RESIDUAL)
        assert group is not None
        across, along, chosen, even = self._fields
        shares = np.zeros((2, len(across), len(along)))
        shares[:, chosen[:, 0], chosen[:, 1]] = extra[group.place].reshape(2, -1)
        fields = group.std * across.T @ shares @ along
        return np.asarray(even[:, None, None] * fields[:, None], dtype=np.float32)

    def coefficients_adjoint(
        self, forces: Array, extra: Array, grid: Single, reference: Array | None = None
    ) -> tuple[Array, Array]:
        """Derivatives by forces (3 n,) and unknowns (size,) from that by spline coefficients."""
        by_forces = self.model.influence.adjoint(grid)
        by_extra = np.zeros(self.size)
        for group, powers in self.values:
            unknown = float(extra[group.begin])
            for power, change in enumerate(powers, 1):
                back = change.adjoint(grid)
                by_forces = by_forces + unknown**power * back
                by_extra[group.begin] += power * unknown ** (power - 1) * float(back @ forces)
        loads = (forces if reference is None else reference).reshape(-1, 3)
        if self.contacts is not None:
            own = self.deviations(self.shown(loads)).any(axis=0)
            back = self.contacts.adjoint(grid, np.flatnonzero(own))
            self.deviations(by_extra)[:, own] = np.einsum("tlc,lc->tl", back, loads[own])
            if reference is None:
                pulled = np.einsum("tlc,tl->lc", back, self.deviations(extra)[:, own])
                by_forces.reshape(-1, 3)[own] += pulled
        if group := self.group(RESIDUAL):
            by_extra[group.place] = self.residual_adjoint(grid)
        return by_forces, by_extra

    def residual_adjoint(self, grid: Single) -> Array:
        """Derivatives by the unknowns of the residual from that by spline coefficients."""
        group = self.group(RESIDUAL)
        assert group is not None
        across, along, chosen, even = self._fields
        fields = np.einsum("fkyx,k->fyx", grid, even)
        shares = group.std * across @ fields @ along.T
        return shares[:, chosen[:, 0], chosen[:, 1]].ravel()

    def residual_square(self, squares: Array) -> float:
        """Mean square of the residual over the pad, from those of its unknowns [rad^2]."""
        base = self.model.influence
        fields, _ = self.residual_at(base.x[::4], base.y[::4])
        shares = np.square(fields).mean(axis=1)
        return float(shares @ squares.reshape(2, -1).sum(axis=0) / 2)

    @cached_property
    def still(self) -> Single | None:
        """Spline coefficients of the residual that is expected, if any is [rad]."""
        group, mean = self.group(RESIDUAL), self.expected[0]
        if group is None or not mean[group.place].any():
            return None
        return self.residual(mean)

    def residual_at(self, x: Array, y: Array) -> tuple[Single, Single]:
        """Modes of one part of the residual, and depth profiles.

        The modes are those at all pairs of places along x and y, shape (k, len(y) * len(x)).
        """
        group, base = self.group(RESIDUAL), self.model.influence
        assert group is not None
        across, along, chosen, even = self._fields
        at_y, at_x = splines.basis(base.y, y) @ across.T, splines.basis(base.x, x) @ along.T
        fields = group.std * at_y[:, None, chosen[:, 0]] * at_x[:, chosen[:, 1]]
        flat = fields.reshape(-1, len(chosen)).T
        return np.ascontiguousarray(flat, dtype=np.float32), even.astype(np.float32)

    def shown(self, forces: Array) -> Mask:
        """Unknowns that show at all under forces (3 n,), shape (size,)."""
        found = np.ones(self.size, dtype=bool)
        if group := self.group(PLACEMENT):
            strength = np.square(forces.reshape(-1, 3)).sum(axis=1)
            squares = np.array([one.square for one in self.tractions])
            found[group.place] = (np.outer(squares, strength) > UNSEEN).ravel()
        return found


def uncertain(pad: Pad) -> bool:
    """Whether anything is uncertain about a pad besides noise."""
    return bool(pad.tolerances or pad.camera.drift or pad.camera.unevenness)


def pad_response(pad: Pad) -> Response:
    """What the camera makes of light: it clips where tolerances let that be too bright."""
    camera, stated = pad.camera, pad.tolerances.get(LIGHT[0], 0.0)
    shares = stated / camera.amplitude, camera.drift, camera.unevenness
    return camera_response(camera, brighter=FOLLOWED_STDS * float(np.linalg.norm(shares)))


def refusal(pad: Pad, path: str) -> str:
    """Why readings of a pad do not allow for a tolerance; empty if they do."""
    own_waves = any(channel.wavelength for channel in pad.polariscope.pictures)
    if path == "polariscope.wavelength" and own_waves:
        effect = f"transducer.photoelastic.{pad.transducer.photoelastic.effect}"
        return (
            "polariscope.wavelength has a tolerance beside channels of their own wavelengths; give "
            f"{effect} one instead, which acts on all."
        )
    known = (*LIGHT, *REGISTRATION, *SCALING, BLUR, GAMMA, *FIELDS, DRIFTS[0])
    if pad.skin is None:
        known = (*known, PLACEMENT, SIZE, PITCH)
    if path in known or path.startswith(LAYERS) or _is_form(path):
        return ""
    return (
        f"{path} has a tolerance that readings of pads do not allow for; leave it out to read, or "
        "calibrate. as_built draws it."
    )


def _is_form(path: str) -> bool:
    return path == "polariscope.visibility" or (
        path.startswith(("polariscope.plates.", "polariscope.channels."))
        and not path.endswith(".wavelength")
    )


def _shares(path: str, x: Array, y: Array) -> tuple[Single, Single]:
    """How far columns and rows look further along x and along y, shapes of x and y."""
    if path == "camera.scale":
        return x.astype(np.float32), y.astype(np.float32)
    along = np.float32(path == "camera.shift_x")
    return np.full(len(x), along, np.float32), np.full(len(y), 1 - along, np.float32)


def value_of(pad: Pad, path: str) -> float:
    """The number that a design states at a path."""
    found = number_at(pad, path)
    assert found is not None
    return found[0]


def _room(pad: Pad, path: str, value: float, step: float) -> tuple[float, float]:
    """Values a step below and above, within what the field allows."""
    if path == "polariscope.visibility":
        return value - step, min(value + step, 1.0)
    if path.endswith("extinction_ratio"):
        return max(value - step, 0.0), value + step
    return value - step, value + step


def _scaled(influence: PadInfluence, share: float) -> PadInfluence:
    quarters = tuple(np.float32(share) * quarter for quarter in influence.quarters)
    return replace(influence, quarters=quarters)
