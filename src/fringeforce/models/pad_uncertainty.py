"""What is uncertain about a pad, as unknowns beside the forces: the tolerances of its design.

Every tolerance becomes one or more standardised unknowns, each normal with mean 0 and variance 1.
Those of a group act alike:

- camera: see `pad_camera`; `camera.drift` changes the light anew in every frame;
- smooth fields: Karhunen-Loeve modes of the unevenness of the light and of the two parts of the
  residual retardance;
- influence: layers, from the exact series at +- one standard deviation; the pitch, and what only
  scales it, exactly; what several of these change together is the product of what each changes;
- contacts: the functions of `pad_traction_modes` for the traction on every tactel.

A value without a tolerance has no unknown and costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Index, Mask, Single
from fringeforce.base.errors import InputError
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import with_values
from fringeforce.estimation.likelihood import Response
from fringeforce.models.as_built import PLACEMENT, RESIDUAL, SIZE
from fringeforce.models.design_modes import DRIFTS, RELAXING, THERMAL
from fringeforce.models.imaging import camera_response
from fringeforce.models.line_moments import FOLLOWED_STDS
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_camera import CameraUncertainty
from fringeforce.models.pad_fields import PadResidual, shades_of
from fringeforce.models.pad_influence import PadInfluence, Retardance, with_even_profile
from fringeforce.models.pad_series import PadSeries, SeriesInfluence
from fringeforce.models.pad_slices import block_of
from fringeforce.models.pad_traction_influence import TractionInfluence
from fringeforce.models.pad_traction_modes import UNSEEN, TractionMode, traction_modes
from fringeforce.models.pad_turned_influence import TurnedInfluence, TurnedSeries
from fringeforce.models.pad_unknowns import (
    EFFECTS,
    FIELDS,
    GAMMA,
    LAYERS,
    LIGHT,
    PITCH,
    SCALING,
    STD_STEP,
    UNEVEN,
    Group,
    group_at,
    refusal,
    value_of,
)
from fringeforce.models.smooth_field import SmoothField

Number = TypeVar("Number", bound=np.generic)
Made = TypeVar("Made")
LinearInfluence = PadInfluence | SeriesInfluence

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


class Reference(NamedTuple):
    """What the spread of tractions is relative to: forces, shape (3 n,) [N], and unknowns."""

    forces: Array
    extra: Array


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
        stated = _of_frames(pad)
        if pad.camera.unevenness:
            stated[UNEVEN] = pad.camera.unevenness
        if pad.camera.drift:
            stated[DRIFTS[0]] = pad.camera.drift
        for path, std in stated.items():
            if problem := refusal(pad, path):
                raise InputError(problem)
            count = 1
            if path == RESIDUAL:
                count = len(self.residual)
            elif path == UNEVEN:
                count = len(self.shades)
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
        return group_at(self.groups, path)

    @cached_property
    def camera(self) -> CameraUncertainty:
        """Light and camera with what is uncertain about them; tractions stand behind that."""
        own = tuple(group for group in self.groups if group.path != PLACEMENT)
        return CameraUncertainty(self.model, own)

    # smooth fields, where the design has a tolerance of them

    @cached_property
    def shades(self) -> SmoothField:
        """Share by which every pixel is brighter."""
        return shades_of(self.model.sensor)

    @cached_property
    def residual(self) -> PadResidual:
        """Retardance without forces."""
        return PadResidual.of(self.model.sensor, self.model.influence)

    @property
    def expected_light(self) -> Array | None:
        """Share of the light of every pixel that is expected, (rows, columns); none if all."""
        group, mean = self.group(UNEVEN), self.expected[0]
        if group is None or not mean[group.place].any():
            return None
        return 1 + self.shades.field(mean[group.place])

    @cached_property
    def still(self) -> Single | None:
        """Spline coefficients of the residual that is expected, if any is [rad]."""
        group, mean = self.group(RESIDUAL), self.expected[0]
        if group is None or not mean[group.place].any():
            return None
        return self.residual.coefficients(mean[group.place])

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
                square += self.residual.square(own) if residual else self.shades.square(own) / 4
            elif group.path == GAMMA:
                square += (group.std * np.log(2)) ** 2
            elif group.path in ("camera.amplitude", "polariscope.visibility"):
                square += (group.std / (2 * value_of(pad, group.path))) ** 2
            elif group.path == "camera.offset":
                square += (2 * group.std / pad.camera.amplitude) ** 2
            elif group.path == DRIFTS[0]:
                square += group.std**2 / 4
        return float(np.sqrt(square))

    def retarding(self, extra: Array) -> Retardance:
        """From spline coefficients to the pixels, where they look under unknowns."""
        if not self.camera.moves(extra):
            return self.model.retarding
        return Retardance.at(self.model.influence, *self.camera.looking(extra).pixel_positions)

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
    def seen_turning(self) -> tuple[Group, ...]:
        """Unknowns of layers, pitch and camera, which turn the influence that pixels see."""
        return (*self.turning, *self.camera.registration)

    @cached_property
    def turns(self) -> Array:
        """Change of the influence over its peak by a deviation of each of `seen_turning`, (d,).

        It is that of the tactel in the corner, which pitch and camera move most.
        """
        push, drawn = np.zeros(self.model.influence.shapes[0]), np.zeros(self.size)
        push[0] = 1.0
        grid = self.model.influence.forward(push)
        modes = self.model.retarding.spread(grid)
        everywhere = (np.arange(count) for count in modes.shape[-2:])
        moved = [np.abs(one).max() for _, one in self.camera.moved(modes, *everywhere)]
        turned = [np.abs(one.forward(push)).max() for _, one in self.slopes(drawn)]
        return np.array([*turned / np.abs(grid).max(), *moved / np.abs(modes).max()])

    def share(self, extra: Array) -> float:
        """Optical effect over that of the drawing under unknowns, shape (size,)."""
        return float(np.prod([1.0, *(_scaled(*one, extra)[0] for one in self._shares)]))

    @property
    def scales(self) -> bool:
        """Whether light hardly tells forces from unknowns, as from those that scale it."""
        return bool(self.scaling or self.turning)

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

    def by_scaling(
        self, forces: Array, extra: Array, reference: Reference | None = None
    ) -> Iterator[tuple[int, Single]]:
        """Numbers of unknowns that scale the influence, and derivatives of `lit` by them."""
        if scaled := self.scaled(extra):
            lit = self._driven(forces, extra)
            if reference is None:
                lit += self._beside(forces, extra)
            yield from ((number, np.float32(slope) * lit) for number, slope in scaled)

    def by_turning(
        self, forces: Array, extra: Array, reference: Reference | None = None
    ) -> Iterator[tuple[int, Single]]:
        """Numbers of unknowns of layers and pitch, and derivatives of `lit` by them."""
        if not self.turning:
            return
        share, synthesis = np.float32(self.share(extra)), self.mechanics.synthesis
        contacts = self._turned_contacts(extra) if reference is None else None
        pitch = self.group(PITCH)
        for number, slope in self.slopes(extra):
            grid = slope.forward(forces)
            if contacts is not None:
                own = self.deviations(self.shown(forces)).any(axis=0)
                told = own * self.deviations(extra), forces.reshape(-1, 3)
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

    def coefficients(
        self, forces: Array, extra: Array, reference: Reference | None = None
    ) -> Single:
        """Spline coefficients of the retardance, shape (2, modes, ny, nx) [rad].

        Parameters
        ----------
        forces : ndarray, shape (3 n,)
            Forces [N].
        extra : ndarray, shape (size,)
            The unknowns.
        reference : Reference, optional
            What the spread of tractions is relative to; the forces and unknowns themselves if not
            given.
        """
        grid = self.lit(forces, extra, reference)
        if group := self.group(RESIDUAL):
            grid += self.residual.coefficients(extra[group.place])
        return grid

    def lit(self, forces: Array, extra: Array, reference: Reference | None = None) -> Single:
        """The same of forces alone."""
        grid = self._driven(forces, extra)
        grid += self._beside(forces, extra, reference)
        return grid

    def _driven(self, forces: Array, extra: Array) -> Single:
        """The same of forces whose tractions are as drawn."""
        grid = self.influence(extra).forward(forces)
        for group, powers in self.values:
            for power, change in enumerate(powers, 1):
                grid += np.float32(extra[group.begin] ** power) * change.forward(forces)
        return grid

    def _beside(
        self, forces: Array, extra: Array, reference: Reference | None = None
    ) -> Single | float:
        """What their tractions add that are not as drawn."""
        about = reference or Reference(forces, extra)
        contacts = self.contacts_under(about.extra)
        if contacts is None:
            return 0.0
        own = self.deviations(self.shown(about.forces)).any(axis=0)
        light = contacts.forward(own * self.deviations(extra), about.forces.reshape(-1, 3))
        return np.float32(self.share(about.extra)) * light

    def coefficients_adjoint(
        self, forces: Array, extra: Array, grid: Single, reference: Reference | None = None
    ) -> tuple[Array, Array]:
        """Derivatives by forces (3 n,) and unknowns (size,) from that by spline coefficients."""
        about = reference or Reference(forces, extra)
        by_forces = self.influence(extra).adjoint(grid)
        by_extra, pulled = np.zeros(self.size), float(by_forces @ forces)
        for group, powers in self.values:
            unknown = float(extra[group.begin])
            for power, change in enumerate(powers, 1):
                back = change.adjoint(grid)
                by_forces = by_forces + unknown**power * back
                by_extra[group.begin] += power * unknown ** (power - 1) * float(back @ forces)
        for number, own in self.by_turning(forces, extra, reference):
            by_extra[number] = np.vdot(own, grid)
        loads, contacts = about.forces.reshape(-1, 3), self.contacts_under(about.extra)
        if contacts is not None:
            own = self.deviations(self.shown(about.forces)).any(axis=0)
            back = self.share(about.extra) * contacts.adjoint(grid, np.flatnonzero(own))
            self.deviations(by_extra)[:, own] = np.einsum("tlc,lc->tl", back, loads[own])
            if reference is None:
                spread = np.einsum("tlc,tl->lc", back, self.deviations(extra)[:, own])
                pulled += float(np.vdot(spread, loads[own]))
                by_forces.reshape(-1, 3)[own] += spread
        for number, slope in self.scaled(extra):
            by_extra[number] = slope * pulled
        if group := self.group(RESIDUAL):
            by_extra[group.place] = self.residual.adjoint(grid)
        return by_forces, by_extra

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
    return bool(_of_frames(pad) or pad.camera.drift or pad.camera.unevenness)


def _of_frames(pad: Pad) -> dict[str, float]:
    """Tolerances but for those of creep and temperature, which are allowed for over time."""
    elsewhere = (*RELAXING, *THERMAL)
    return {path: std for path, std in pad.tolerances.items() if not path.startswith(elsewhere)}


def pad_response(pad: Pad) -> Response:
    """What the camera makes of light: it clips where tolerances let that be too bright."""
    camera, stated = pad.camera, pad.tolerances.get(LIGHT[0], 0.0)
    shares = stated / camera.amplitude, camera.drift, camera.unevenness
    return camera_response(camera, brighter=FOLLOWED_STDS * float(np.linalg.norm(shares)))


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
