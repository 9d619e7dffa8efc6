"""What is uncertain about a pad, as unknowns beside the forces: the tolerances of its design.

Every tolerance becomes one or more standardised unknowns, each normal with mean 0 and variance 1.
Those of a group act alike:

- light: gain and offset of the grey levels, anew in every frame for `camera.drift`, gamma, and
  Karhunen-Loeve modes of the unevenness of the light over the picture;
- forms: what pixels measure of the light, for visibility, plates and angles;
- blur, and where the pixels look;
- influence: layers, from the exact series at +- one standard deviation; the pitch, and what only
  scales it, exactly; what several of these change together is the product of what each changes;
- residual: Karhunen-Loeve modes of the two parts of a smooth random retardance;
- contacts: the functions of `pad_traction_modes` for the traction on every tactel.

A value without a tolerance has no unknown and costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol, TypeVar

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
from fringeforce.models.pad_turned_influence import TurnedInfluence, TurnedSeries
from fringeforce.models.uncertainty import DRIFTS, FOLLOWED_STDS, karhunen_loeve
from fringeforce.optics.area_camera import Lens, Picture, pictures

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Mask = NDArray[np.bool_]
Number = TypeVar("Number", bound=np.generic)
Made = TypeVar("Made")
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
"""Step of numerical derivatives of lens and pitch, in standard deviations."""
LEAST_EFFECT = 0.1
"""Share of an optical effect or a wavelength below which none is tried: light without it tells of
nothing."""


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

    @property
    def values(self) -> tuple[tuple[Group, tuple[LinearInfluence, ...]], ...]:
        """Unknowns of which powers change the influence, each by itself; those of calibrations."""
        return ()

    @cached_property
    def turning(self) -> tuple[Group, ...]:
        """Unknowns of layers and pitch."""
        return tuple(
            group
            for group in self.groups
            if group.path == PITCH or (group.path.startswith(LAYERS) and group.path not in SCALING)
        )

    @cached_property
    def scaling(self) -> tuple[Group, ...]:
        """Unknowns that only scale the influence."""
        return tuple(group for group in self.groups if group.path in SCALING)

    @cached_property
    def turns(self) -> Array:
        """Change of the influence over its peak by a deviation of each of `turning`, (d,).

        It is that of the tactel in the corner, which the pitch moves most.
        """
        push = np.zeros(self.model.influence.shapes[0])
        push[0] = 1.0
        peak = np.abs(self.model.influence.forward(push)).max()
        slopes = self.slopes(np.zeros(self.size))
        return np.array([np.abs(one.forward(push)).max() / peak for _, one in slopes])

    def share(self, extra: Array) -> float:
        """Optical effect over that of the drawing under unknowns, shape (size,)."""
        return float(np.prod([1.0, *(_scaled(*one, extra)[0] for one in self._shares)]))

    def scaled(self, extra: Array) -> list[tuple[int, float]]:
        """Numbers of unknowns that scale the influence, and derivatives of its logarithm."""
        return [(one[0].begin, _scaled(*one, extra)[1]) for one in self._shares]

    @cached_property
    def _shares(self) -> tuple[tuple[Group, float], ...]:
        """Unknowns that scale, and their deviations over the values."""
        pad = self.model.sensor
        return tuple((group, group.std / value_of(pad, group.path)) for group in self.scaling)

    @cached_property
    def _layers(self) -> tuple[tuple[Group, tuple[Single, ...]], ...]:
        """Unknowns of layers, and changes of the waves with their powers."""
        return tuple(
            (
                group,
                tuple(one.waves for one in self.mechanics.changes(group.path, group.std)),
            )
            for group in self.turning
            if group.path != PITCH
        )

    def _pitched(self, deviations: float) -> Pad:
        """The design with its pitch so many deviations off."""
        pad, group = self.model.sensor, self.group(PITCH)
        assert group is not None
        return with_values(pad, {PITCH: value_of(pad, PITCH) + deviations * group.std})

    @cached_property
    def _last(self) -> dict[str, tuple[tuple[float, ...], Any]]:
        """What was made last, and for which unknowns: gradient and information ask again."""
        return {}

    def _again(self, name: str, extra: Array, make: Callable[[], Made]) -> Made:
        """What was made last, if the unknowns of layers and pitch are the same."""
        key = tuple(float(extra[group.begin]) for group in self.turning)
        last = self._last.get(name)
        if last is None or last[0] != key:
            last = self._last[name] = key, make()
        return last[1]

    def turned(self, extra: Array) -> TurnedSeries:
        """The series where layers and pitch are off, all together."""
        return self._again("series", extra, lambda: self._turned(extra))

    def _turned(self, extra: Array) -> TurnedSeries:
        waves, tactels, pitch = None, None, self.group(PITCH)
        if any(extra[group.begin] for group, _ in self._layers):
            waves = self.mechanics.synthesis.waves.copy()
            for group, powers in self._layers:
                for power, change in enumerate(powers, 1):
                    waves += np.float32(extra[group.begin] ** power) * change
        if pitch is not None and extra[pitch.begin]:
            tactels = self._pitched(float(extra[pitch.begin]))
        return TurnedSeries(self.mechanics, waves, tactels)

    def influence(self, extra: Array) -> TurnedInfluence:
        """Retardance per force under unknowns of sizes and materials."""
        added = (
            ()
            if not self.turning
            else self._again("added", extra, lambda: self.turned(extra).added)
        )
        return TurnedInfluence(self.model.influence, added, self.share(extra))

    def slopes(self, extra: Array) -> list[tuple[int, SeriesInfluence]]:
        """Numbers of the unknowns of layers and pitch, and derivatives of the influence by them.

        They are those of the effect as drawn.
        """
        if not self.turning:
            return []
        return self._again("slopes", extra, lambda: self._slopes_of(extra))

    def by_turning(
        self, forces: Array, extra: Array, reference: Array | None = None
    ) -> Iterator[tuple[int, Single]]:
        """Numbers of the same unknowns, and derivatives of `lit` by them."""
        if not self.turning:
            return
        share, synthesis = np.float32(self.share(extra)), self.mechanics.synthesis
        contacts, pitch = self._turned_contacts(extra), self.group(PITCH)
        spread = forces if reference is None else reference
        for number, slope in self.slopes(extra):
            grid = slope.forward(forces)
            if contacts is not None:
                own = self.deviations(self.shown(spread)).any(axis=0)
                told = own * self.deviations(extra), spread.reshape(-1, 3)
                if pitch is not None and number == pitch.begin:
                    ends = self._again("ends", extra, lambda: self._contact_ends(extra))
                    behind, ahead = (end.harmonics(*told) for end in ends)
                    harmonics = (ahead - behind) / np.float32(2 * STD_STEP)
                else:
                    harmonics = contacts.harmonics(*told)
                grid += replace(synthesis, waves=slope.waves).modes(harmonics)
            yield number, share * grid

    def _contact_ends(self, extra: Array) -> list[TractionInfluence]:
        """Light of tractions at a pitch a little smaller and a little larger."""
        pitch, drawn, turned = self.group(PITCH), self._drawn_contacts, self.turned(extra)
        assert pitch is not None
        assert drawn is not None
        here = float(extra[pitch.begin])
        ends = [self._pitched(here + way * STD_STEP) for way in (-1, 1)]
        return [drawn.under(replace(turned, tactels=end)) for end in ends]

    def _slopes_of(self, extra: Array) -> list[tuple[int, SeriesInfluence]]:
        turned, layers, found = self.turned(extra), dict(self._layers), []
        for group in self.turning:
            here = float(extra[group.begin])
            if group.path == PITCH:
                ends = [self._pitched(here + way * STD_STEP) for way in (-1, 1)]
                found.append((group.begin, turned.by_pitch(ends, 2 * STD_STEP)))
                continue
            slope = sum(
                np.float32(power * here ** (power - 1)) * change
                for power, change in enumerate(layers[group], 1)
            )
            found.append((group.begin, turned.by_waves(np.asarray(slope, dtype=np.float32))))
        return found

    @cached_property
    def mechanics(self) -> PadSeries:
        """Of a pad with roller sides, in the depth profiles of the model."""
        base = self.model.influence
        if self.series is not None and self.series.base.modes == base.modes:
            return self.series
        return PadSeries(self.model.sensor, base)

    @cached_property
    def tractions(self) -> tuple[TractionMode, ...]:
        """How the traction on every tactel may be unlike that on its square."""
        return traction_modes(self.model.sensor, self.model.influence.profile)

    @cached_property
    def contacts(self) -> ContactLight | None:
        """Light of these functions, if there are any."""
        return self._drawn_contacts

    @cached_property
    def _drawn_contacts(self) -> TractionInfluence | None:
        return TractionInfluence(self.mechanics, self.tractions) if self.tractions else None

    def contacts_under(self, extra: Array) -> ContactLight | None:
        """The same where layers and pitch are off, of the effect as drawn."""
        return self._turned_contacts(extra) if self.turning else self.contacts

    def _turned_contacts(self, extra: Array) -> TractionInfluence | None:
        drawn = self._drawn_contacts
        if drawn is None:
            return None
        return self._again("contacts", extra, lambda: drawn.under(self.turned(extra)))

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
        grid = self.lit(forces, extra, reference)
        if self.group(RESIDUAL):
            grid += self.residual(extra)
        return grid

    def lit(self, forces: Array, extra: Array, reference: Array | None = None) -> Single:
        """The same of forces alone."""
        spread = forces if reference is None else reference
        grid = self.influence(extra).forward(forces)
        for group, powers in self.values:
            for power, change in enumerate(powers, 1):
                grid += np.float32(extra[group.begin] ** power) * change.forward(forces)
        contacts = self.contacts_under(extra)
        if contacts is not None:
            own = self.deviations(self.shown(spread)).any(axis=0)
            light = contacts.forward(own * self.deviations(extra), spread.reshape(-1, 3))
            grid += np.float32(self.share(extra)) * light
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
        by_forces, share = self.influence(extra).adjoint(grid), self.share(extra)
        by_extra, pulled = np.zeros(self.size), float(by_forces @ forces)
        for group, powers in self.values:
            unknown = float(extra[group.begin])
            for power, change in enumerate(powers, 1):
                back = change.adjoint(grid)
                by_forces = by_forces + unknown**power * back
                by_extra[group.begin] += power * unknown ** (power - 1) * float(back @ forces)
        for number, own in self.by_turning(forces, extra, reference):
            by_extra[number] = np.vdot(own, grid)
        loads = (forces if reference is None else reference).reshape(-1, 3)
        contacts = self.contacts_under(extra)
        if contacts is not None:
            own = self.deviations(self.shown(loads)).any(axis=0)
            back = share * contacts.adjoint(grid, np.flatnonzero(own))
            self.deviations(by_extra)[:, own] = np.einsum("tlc,lc->tl", back, loads[own])
            spread = np.einsum("tlc,tl->lc", back, self.deviations(extra)[:, own])
            pulled += float(np.vdot(spread, loads[own]))
            if reference is None:
                by_forces.reshape(-1, 3)[own] += spread
        for number, slope in self.scaled(extra):
            by_extra[number] = slope * pulled
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


def _scaled(group: Group, share: float, extra: Array) -> tuple[float, float]:
    """Factor of the influence by an unknown, and the derivative of its logarithm.

    Parameters
    ----------
    group : Group
        Of the effect, or of the wavelength, which divides it.
    share : float
        Its deviation over its value.
    extra : ndarray, shape (size,)
        The unknowns.
    """
    ratio = max(1 + share * float(extra[group.begin]), LEAST_EFFECT)
    return (ratio, share / ratio) if group.path in EFFECTS else (1 / ratio, -share / ratio)
