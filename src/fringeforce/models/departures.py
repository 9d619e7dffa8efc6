"""What a sensor may do that its design does not state: departures, each a change of a `FrameModel`.

A departure of one number, such as a shift of the camera, turns the model of the design into that of
a sensor which departs by so much.  One of many, such as a residual retardance that varies along the
strip, adds unknowns of its own.  Both have a generous standard deviation before any frame is seen.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.design.light import CROSSTALK, light_of_channels, pairs_of_channels
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import Tolerances, number_at, with_values
from fringeforce.estimation.frame_model import (
    FrameModel,
    Layout,
    contacts_scatter,
    moments_about,
    node_weights,
    pixels_at,
)
from fringeforce.mechanics.surface_influence import surface_influence
from fringeforce.models.as_built import LIGHT_LENGTH, PLACEMENT, RESIDUAL, WIDTH
from fringeforce.models.crosstalk import Crosstalk
from fringeforce.models.line_moments import mixed
from fringeforce.models.node_splines import coefficients
from fringeforce.models.strip import SensorModel, characterize
from fringeforce.models.strip_nodes import random_field
from fringeforce.models.strip_width import light_line
from fringeforce.models.uncertainty import Uncertainty, uncertainty
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

Array = NDArray[np.float64]

LAYERS = {
    "transducer.compliant.thickness": 0.05,
    "transducer.compliant.youngs_modulus": 0.2,
    "transducer.photoelastic.thickness": 0.05,
    "transducer.photoelastic.youngs_modulus": 0.2,
}
"""Standard deviations of the values of the layers, relative to them."""
CAMERA_SHIFT, CAMERA_SCALE = 0.1, 0.01
"""Sizes of departures of the camera: over the spacing of the tactels, and relative."""
COMMON_PLACE, SCATTER, CONTACT_WIDTH = 0.3, 0.1, 0.5
"""Sizes of departures of contacts over the spacing of the tactels: common place, place of each,
and width."""
LAMP, DARK, UNEVEN = 0.1, 0.02, 0.05
"""Sizes of departures of the light: amplitude and its change along the strip, relative; offset over
the full scale."""
VISIBILITY, BLUR, GAMMA, BANDWIDTH = 0.1, 6.0, 0.1, 20e-9
"""Sizes of departures of fringes, point spread [pixels], power of the response, spectrum [m]."""
LEAK = 0.05
"""Size of the cross-talk of each pair of channels, as a share of the light."""
RETARDANCE = 0.1
"""Size of the residual [rad]."""
FARTHEST_PLACE = 1.0
"""Common place of contacts that is followed, in spacings of the tactels."""
UNEVEN_LIGHT = "camera.unevenness"


def drawn_value(sensor: Sensor, path: str) -> float:
    """Number of a design at a path; the amplitude of a channel that states none is the camera's."""
    channels = light_of_channels(len(sensor.polariscope.pictures))
    if path in channels:
        return float(sensor.light[0][channels[path]])
    found = number_at(sensor, path)
    assert found is not None
    return found[0]


class Widened(NamedTuple):
    """A model with unknowns of its own for a departure.

    Attributes
    ----------
    model : FrameModel
        With the unknowns.
    where : ndarray of int, shape (k,)
        Where they stand.
    profiles : ndarray, shape (k, q)
        What departs, in its unit, for each of them: at the nodes or at the contacts.
    """

    model: FrameModel
    where: NDArray[np.int64]
    profiles: Array


@dataclass(frozen=True, eq=False)
class Departure:
    """One way in which a sensor may depart from its design.

    Attributes
    ----------
    path : str
        Dotted path of the value that departs, or what it is.
    deviation : float
        Standard deviation before any frame, in the unit of the value.
    one : callable, optional
        Model of a sensor that departs by a number, from that of the design.
    own : callable, optional
        For a departure of many numbers: the model with unknowns for them, from that of the design.
    limits : tuple of float
        Smallest and largest number.
    begins : tuple of float
        Numbers from which it is looked for; where zero changes nothing to first order, others.
    """

    path: str
    deviation: float
    one: Callable[[FrameModel, float], FrameModel] | None = None
    own: Callable[[FrameModel], Widened] | None = None
    limits: tuple[float, float] = (-inf, inf)
    begins: tuple[float, ...] = (0.0,)


@dataclass(frozen=True, eq=False)
class Departures:
    """Departures of one strip; what they need is computed once, when it is first needed.

    Attributes
    ----------
    model : SensorModel
        As drawn or calibrated.
    uncertain : Uncertainty
        What its design states.
    """

    model: SensorModel
    uncertain: Uncertainty

    @cached_property
    def all(self) -> tuple[Departure, ...]:
        """All that can be told of this strip."""
        return (*self._camera(), *self._light(), *self._contacts(), *self._layers())

    @property
    def pitch(self) -> float:
        """Spacing of the tactels, or a millimetre if there is one; of a skin its cover [m]."""
        sensor = self.model.sensor
        if sensor.skin is not None:
            return float(sensor.transducer.compliant.thickness)
        places = sensor.tactels.positions
        return float(np.diff(places).min()) if len(places) > 1 else 1e-3

    @property
    def pixel(self) -> float:
        """Length of strip that a pixel sees [m]."""
        return self.model.sensor.transducer.length / self.model.sensor.camera.pixels

    def _camera(self) -> list[Departure]:
        shift, frame = CAMERA_SHIFT * self.pitch, self.uncertain.frame
        found = [
            Departure("camera.shift", shift, lambda frame, by: self._moved(frame, by, 0.0)),
            Departure("camera.scale", CAMERA_SCALE, lambda frame, by: self._moved(frame, 0.0, by)),
            Departure(
                "camera.blur",
                BLUR * self.pixel,
                lambda frame, by: frame._replace(blur=max(frame.blur + by / self.pixel, 0.0)),
                limits=(-frame.blur * self.pixel, inf),
                begins=(BLUR * self.pixel / 3, 2 * BLUR * self.pixel),
            ),
        ]
        if frame.gamma > 0:
            found.append(
                Departure(
                    "camera.gamma",
                    GAMMA,
                    lambda frame, by: frame._replace(gamma=frame.gamma + by),
                    limits=(-frame.gamma / 2, inf),
                )
            )
        return found

    def _light(self) -> list[Departure]:
        full, frame = self.uncertain.frame.full_scale, self.uncertain.frame
        polariscope = self.model.sensor.polariscope
        alike = [one.amplitude is None for one in polariscope.pictures]
        lit = {"camera.amplitude": np.array(alike)}
        lit |= {
            path: np.arange(len(alike)) == c for path, c in light_of_channels(len(alike)).items()
        }
        spread = float(np.max(frame.spread))
        crosstalk = Departure(CROSSTALK, LEAK, own=self._leaky)
        per_metre = 1 / (polariscope.wavelength * np.sqrt(8 * np.log(2)))
        return [
            *[
                Departure(path, LAMP, partial(_brighter, which), limits=(-0.9, inf))
                for path, which in lit.items()
                if which.any()
            ],
            Departure(
                "camera.offset",
                DARK * full,
                lambda frame, by: frame._replace(offset=frame.offset + by),
            ),
            Departure(
                "polariscope.visibility",
                VISIBILITY,
                lambda frame, by: frame._replace(visibility=frame.visibility + by),
                limits=(-0.9 * frame.visibility, 1 - frame.visibility + 1e-9),
            ),
            Departure(
                "polariscope.bandwidth",
                BANDWIDTH,
                lambda frame, by: frame._replace(spread=frame.spread + by * per_metre),
                limits=(-spread / per_metre, inf),
                begins=(BANDWIDTH,),
            ),
            Departure(UNEVEN_LIGHT, UNEVEN, own=self._uneven),
            Departure(RESIDUAL, RETARDANCE, own=self._residual),
            *[crosstalk] * (len(frame.bias) > 1),
        ]

    def _contacts(self) -> list[Departure]:
        if not self.model.sensor.transducer.solved_in_a_plane:
            return []
        most = FARTHEST_PLACE * self.pitch
        wide = CONTACT_WIDTH * self.pitch
        width = self.uncertain.frame.width
        return [
            Departure(
                PLACEMENT,
                COMMON_PLACE * self.pitch,
                lambda frame, by: self._placed(frame, by, 0.0),
                limits=(-most, most),
                begins=(0.0, most / 2, -most / 2),
            ),
            Departure(
                WIDTH,
                wide,
                lambda frame, by: self._placed(frame, 0.0, by),
                limits=(-width, 4 * wide),
            ),
            Departure(PLACEMENT, SCATTER * self.pitch, own=partial(self._each, PLACEMENT)),
            Departure(WIDTH, wide / 2, own=partial(self._each, WIDTH)),
        ]

    def _layers(self) -> list[Departure]:
        if self.model.sensor.transducer.plane == "given":
            return []
        return [
            Departure(path, share, partial(self._made, path), limits=(-0.5, inf))
            for path, share in LAYERS.items()
        ]

    def _moved(self, frame: FrameModel, by: float, scale: float) -> FrameModel:
        """The camera looks elsewhere; beyond its ends it sees what is there."""
        places, count = self.uncertain.places, len(frame.fixed)
        step = (places[-1] - places[0]) / (count - 3)
        # cubic weights give back where a pixel looks
        own = slice(0, len(frame.first) // len(frame.bias))
        along = frame.first[own] + frame.weights[own] @ np.arange(4.0)
        x = places[0] + (along - 1) * step
        moved = along + (by + scale * x) / step
        first, weights = node_weights(np.clip(moved, 1, count - 2), count)
        return frame._replace(**pixels_at(first, weights, len(frame.bias)))

    def _uneven(self, frame: FrameModel) -> Widened:
        places, at = self.uncertain.places, frame.at
        length = LIGHT_LENGTH * abs(places[-1] - places[0])
        field = UNEVEN * random_field(places, length, len(frame.fixed))
        wider = frame._replace(
            brightness=np.concatenate([frame.brightness, np.tile(field, len(frame.bias))]),
            darkness=np.concatenate([frame.darkness, np.tile(0 * field, len(frame.bias))]),
            at=_grown(at, "modes", len(field)),
        )
        return Widened(wider, np.arange(at.visibility, at.visibility + len(field)), field)

    def _residual(self, frame: FrameModel) -> Widened:
        length, at = self.model.sensor.polariscope.residual_length, frame.at
        field = RETARDANCE * random_field(self.uncertain.places, length, len(frame.fixed))
        wider = frame._replace(
            fields=np.concatenate([frame.fields, field]), at=_grown(at, "fields", len(field))
        )
        return Widened(wider, np.arange(at.modes, at.modes + len(field)), field)

    def _leaky(self, frame: FrameModel) -> Widened:
        """Every channel with a share of its own of the light of each other one."""
        pairs, at = pairs_of_channels(len(frame.bias)), frame.at
        found = Crosstalk.of(self.model.sensor.polariscope, dict.fromkeys(pairs, LEAK))
        stated = frame.leaks if len(frame.leaks) else found.leaks[:0]
        wider = frame._replace(
            crosstalk=found.shares,
            leaks=np.concatenate([stated, found.leaks]),
            at=_grown(at, "crosstalk", len(pairs)),
        )
        return Widened(wider, np.arange(at.size, wider.at.size), LEAK * np.eye(len(pairs)))

    @cached_property
    def _lines(self) -> Callable[[float, float], Array]:
        """Influence of contacts moved and widened by so much, less that of the nominal ones."""
        sensor = self.model.sensor
        strip, tactels = sensor.transducer, sensor.tactels
        half, x = strip.length / 2, self.uncertain.places
        centres = tactels.positions + tactels.placement
        reach = (
            FARTHEST_PLACE * self.pitch + 2 * CONTACT_WIDTH * self.pitch + tactels.contact_width / 2
        )
        surface = surface_influence(
            strip,
            max(centres[0] - reach, -half),
            min(centres[-1] + reach, half),
            np.clip(x, -half, half),
            light_line(strip, sensor.camera),
        )
        constant = stress_optic_constant(strip.photoelastic, sensor.polariscope.wavelength)
        seen, nodes = self.uncertain.shown, len(self.uncertain.frame.fixed)
        stress = np.ascontiguousarray(np.moveaxis(surface.stress, 1, 0)).reshape(
            len(surface.places), -1
        )

        def influence(by: float, wider: float) -> Array:
            widths = np.full(len(centres), max(tactels.contact_width + wider, 0.0))
            lines = surface.shares(centres + by, widths) @ stress
            lead = phase_lead(lines.reshape(len(centres), len(x), 2), constant)
            return coefficients(np.moveaxis(lead * seen[:, None], 2, 1), nodes)

        drawn = influence(0.0, 0.0)
        return lambda by, wider: influence(by, wider) - drawn

    def _placed(self, frame: FrameModel, by: float, wider: float) -> FrameModel:
        """All contacts beside their places, and wider."""
        if frame.moments.shape[2] == 1:
            return with_moments(frame, frame.moments + self._lines(by, wider)[:, :, None])
        moments = moments_about(frame.moments, np.full(len(frame.moments), by / frame.reach))
        return with_moments(frame._replace(width=max(frame.width + wider, 0.0)), moments)

    def _each(self, path: str, frame: FrameModel) -> Widened:
        """Every contact with a place or a width of its own."""
        wide, at = self._contact_frame(path, frame), frame.at
        count = self.model.sensor.tactels.count
        begin, end = (at.place, at.width) if path == PLACEMENT else (at.width, at.fields)
        grown = at if end > begin else _grown(at, "place" if path == PLACEMENT else "width", count)
        wider = frame._replace(
            moments=wide.moments,
            profiles=wide.profiles,
            mixing=wide.mixing,
            reach=wide.reach,
            place=wide.place,
            width_std=wide.width_std,
            narrow=wide.narrow,
            at=grown,
        )
        std = wide.place if path == PLACEMENT else wide.width_std
        return Widened(wider, np.arange(begin, begin + count), std * np.eye(count))

    def _contact_frame(self, path: str, frame: FrameModel) -> FrameModel:
        """Contacts of uncertain place or width, besides what is uncertain of them already."""
        std = SCATTER if path == PLACEMENT else CONTACT_WIDTH / 2
        stated = self.model.sensor.tolerances.get(path, 0.0)
        kept = {PLACEMENT: frame.place, WIDTH: frame.width_std}
        kept[path] = max(std * self.pitch, 3 * stated)
        kept = {own: value for own, value in kept.items() if value}
        known = tuple(kept.items())
        if known not in self._contact_frames:
            sensor = self.model.sensor.model_copy(update={"tolerances": Tolerances(kept)})
            self._contact_frames[known] = uncertainty(replace(self.model, sensor=sensor)).frame
        return self._contact_frames[known]

    @cached_property
    def _contact_frames(self) -> dict[tuple[tuple[str, float], ...], FrameModel]:
        return {}

    def _made(self, path: str, frame: FrameModel, share: float) -> FrameModel:
        """A layer that is not as drawn, by a parabola through three solutions."""
        ahead, behind = self._solved(path)
        step = LAYERS[path]
        t = share / step
        change = (ahead - behind) / 2 * t + (ahead + behind) / 2 * t * t
        moments = frame.moments.copy()
        moments[:, :, 0] += coefficients(np.moveaxis(change, 0, 2), len(frame.fixed))
        return with_moments(frame, moments)

    def _solved(self, path: str) -> tuple[Array, Array]:
        """Changes of the influence matrix at the nodes with a value, ahead and behind."""
        if path not in self._solutions:
            sensor, x = self.model.sensor, self.uncertain.places
            half = sensor.transducer.length / 2
            plain = sensor.model_copy(update={"tolerances": Tolerances()})
            value = drawn_value(sensor, path)
            places, drawn = np.clip(x, -half, half), self._drawn.influence
            behind, ahead = (
                characterize(with_values(plain, {path: value * (1 + way * LAYERS[path])}))
                for way in (-1, 1)
            )
            nominal = drawn(places)
            self._solutions[path] = (
                ahead.influence(places) - nominal,
                behind.influence(places) - nominal,
            )
        return self._solutions[path]

    @cached_property
    def _drawn(self) -> SensorModel:
        """The design as drawn, which a calibrated model is not."""
        if self.model.imaging is None and self.model.calibration is None:
            return self.model
        return characterize(self.model.sensor.model_copy(update={"tolerances": Tolerances()}))

    @cached_property
    def _solutions(self) -> dict[str, tuple[Array, Array]]:
        return {}


def _brighter(which: NDArray[np.bool_], frame: FrameModel, by: float) -> FrameModel:
    """Some channels with more light."""
    lines = frame.amplitude.reshape(len(which), -1) * (1 + by * which[:, None])
    return frame._replace(amplitude=lines.ravel())


def _grown(at: Layout, group: str, count: int) -> Layout:
    """A layout with more unknowns at the end of a group."""
    names = Layout._fields
    return Layout(*(begin + count * (place > names.index(group)) for place, begin in enumerate(at)))


def plain_moments(frame: FrameModel) -> FrameModel:
    """The same model with contacts as drawn taken together, where none is uncertain."""
    at, order = frame.at, frame.moments.shape[2]
    if order == 1 or at.fields > at.place:
        return frame
    half, even = frame.width / 2 / frame.reach, np.arange(0, order, 2)
    nominal = np.zeros(order)
    nominal[even] = half**even / (even + 1)
    moments = np.einsum("k,ntkm->ntm", nominal, frame.moments)[:, :, None]
    return with_moments(frame, np.ascontiguousarray(moments))


def with_moments(frame: FrameModel, moments: Array) -> FrameModel:
    """The same model with other moments of its contacts, shape (n, 2, K, m)."""
    width = frame.width, frame.width_std
    scatter = contacts_scatter(frame.place, frame.moving)
    return frame._replace(**mixed(moments, frame.reach, scatter, width))
