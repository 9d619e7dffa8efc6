"""What is uncertain about a strip, as unknowns beside the loads: the tolerances of its design.

Every tolerance becomes one or more standardised unknowns of a `FrameModel`: design values and the
camera's registration turn the influence matrix, contacts land beside their tactels and are as wide
as they are, the residual is a smooth random field, and the light is as bright as it is.  A value
without a tolerance has no unknown and costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property, partial
from itertools import accumulate
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import cheb2poly, chebvander
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fringeforce.design.light import CHANNELS, CROSSTALK, Polariscope, pairs_of_channels
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import REACH, number_at, with_values
from fringeforce.estimation.frame_exposure import influence_slopes
from fringeforce.estimation.frame_model import (
    EVEN,
    FrameModel,
    Layout,
    contacts_scatter,
    node_weights,
    pixels_at,
)
from fringeforce.models.as_built import (
    LIGHT_LENGTH,
    PLACEMENT,
    RESIDUAL,
    SHAPE_LENGTH,
    WIDTH,
    changes_influence,
)
from fringeforce.models.creep import TERMS, Creep
from fringeforce.models.finite_strain import second_order_influence
from fringeforce.models.imaging import camera_response, pixel_noise
from fringeforce.models.line_moments import FOLLOWED_STDS, REGISTRATION, LineMoments, mixed
from fringeforce.models.node_splines import coefficients, fitted, sampled
from fringeforce.models.smooth_field import karhunen_loeve
from fringeforce.models.strip import COVER_MODULUS, SensorModel
from fringeforce.models.temperature import COEFFICIENT, REFERENCE
from fringeforce.optics.polariscope import pictures, together

Array = NDArray[np.float64]

NODES = 5
"""Nodes in the thickness of the cover, which smooths everything that passes through it: cubic
splines on them are good to 1e-4 of the peak of a line load."""
SPLINE_SAMPLES, FIELD_SAMPLES = 8, 2
"""Samples between neighbouring nodes by which splines are fitted, and of random fields."""
SMALLEST = 5e-4
"""Variance of a mode of a random field, relative to the largest, below which it is left out."""
NARROW = 0.125
"""Share of a width below which it is kept positive smoothly."""
DEGREES = 4, 8, 16
"""Degrees of the polynomials that the influence matrix is followed by, of which the least that is
enough is taken: a camera that is shifted by a contact's width takes the last."""
LEFT_OUT = 5e-4
"""Share of a load's largest influence that they may leave out within `REACH` deviations: less than
a pixel's noise in the phase of all loads."""
BROKEN = 1e-3
"""Share of pixels that show anything at all: a line camera of good quality has fewer."""
RELAXATION = f"{TERMS[0]}."
RELAXING = tuple(f"{path}." for path in TERMS)
"""Begin of the paths of values that act over time, which `reading.creep` allows for."""
THERMAL = COEFFICIENT, REFERENCE
"""Paths of what temperature does to the light, which readings are scaled for."""
RATIO = "relaxation of one layer"
"""Name of the mode of layers that relax unlike."""
DRIFTS = ("camera.drift", "offset drift", RATIO)
"""Names of the modes that are new in every frame."""


@dataclass(frozen=True, eq=False)
class Mode:
    """One standardised unknown that changes influence matrix or light.

    Attributes
    ----------
    name : str
        Dotted path of the design, or what it is.
    std : float
        Its standard deviation, in the unit of the value.
    influence : tuple of ndarray, shape (s, n, 2)
        Change of the influence matrix along the strip with each power of the unknown, beside that
        it moves the contacts [rad/N].
    brightness, darkness : ndarray, shape (m,) or (C, 1), or float
        Change of the amplitude, relative to it, and of the offset, grey levels; along the strip or
        of each channel.
    """

    name: str
    std: float
    influence: tuple[Array, ...] = ()
    brightness: Array | float = 0.0
    darkness: Array | float = 0.0


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """A strip with all that is uncertain about it.

    Attributes
    ----------
    frame : FrameModel
        From unknowns to grey levels.
    modes : tuple of Mode
        Unknowns of influence matrix and light, in the order of the frame's.
    shape : ndarray, shape (m, m)
        Covariance along the strip of the relative errors of shape of each column of the influence
        matrix; empty if there are none.
    shapes : int
        Modes that stand for them, the last ones of the frame's fields.
    places : ndarray, shape (s,)
        Of samples along the strip, evenly spaced from the second node to the last but one [m].
    shown : ndarray of bool, shape (s,)
        Where influence counts: on the strip, and beyond its ends where no pixel is usable, for a
        step at the end would ring in the splines of the pixels beside it.
    matrix : BuiltInfluence
        Influence of sensors that are not as drawn.
    centre : mapping
        Values, by path, in deviations from what is drawn, at which all that turns the influence
        matrix acts together exactly; elsewhere single ones do.
    """

    frame: FrameModel
    modes: tuple[Mode, ...]
    shape: Array
    shapes: int
    places: Array
    shown: NDArray[np.bool_]
    matrix: BuiltInfluence
    centre: Mapping[str, float] = field(default_factory=dict)

    def about(self, centre: Mapping[str, float]) -> Uncertainty:
        """The same, exact for other values that act together.

        Parameters
        ----------
        centre : mapping
            As the attribute.
        """
        return _uncertainty(self.matrix, centre) if centre != self.centre else self

    @cached_property
    def turns(self) -> Array:
        """Change of the influence over its peak by a deviation of each mode that turns it, (d,)."""
        return self._over_peak(influence_slopes(self.frame, np.zeros(self.frame.at.size)))

    @cached_property
    def turns_contacts(self) -> Array:
        """The same of what is not as if contacts moved, (d,)."""
        return self._over_peak(self.frame.influence[:, 0])

    def _over_peak(self, changes: Array) -> Array:
        peak = max(np.abs(self.frame.moments[:, :, 0]).max(), np.finfo(float).tiny)
        return np.asarray(np.abs(changes).max(axis=(1, 2, 3)) / peak)

    @cached_property
    def lasting(self) -> NDArray[np.bool_]:
        """Unknowns that stay as they are from frame to frame, shape (size,)."""
        at = self.frame.at
        lasts = np.arange(at.size) >= at.loads
        for number, mode in enumerate(self.modes):
            lasts[at.modes + number] = mode.name not in DRIFTS
        return lasts

    def under(self, loads: Array) -> FrameModel:
        """The frame's model with the errors of shape that loads of about this size cause.

        Every column of the matrix has an error of its own, so that squares of their parts add up.

        Parameters
        ----------
        loads : ndarray, shape (2n,)
            Loads [N].
        """
        if not self.shapes:
            return self.frame
        fields = self.frame.fields.copy()
        fields[len(fields) - self.shapes :] = shape_modes(
            self.frame, self.shape, loads, self.shapes
        )
        return self.frame._replace(fields=fields)


def shape_modes(frame: FrameModel, shape: Array, loads: Array, count: int) -> Array:
    """Modes of the phase's error, shape (count, m) [rad]: eigenvectors of its covariance."""
    parts = (frame.moments[:, :, 0] * loads.reshape(-1, 2, 1)).reshape(len(loads), -1)
    values, vectors = np.linalg.eigh(shape * (parts.T @ parts))
    kept = slice(None, -count - 1, -1)
    return (vectors[:, kept] * np.sqrt(np.maximum(values[kept], 0))).T


def uncertainty(model: SensorModel, residual: Array | None = None) -> Uncertainty:
    """Unknowns of a model, from the tolerances of its design and the drift of its light.

    Parameters
    ----------
    model : SensorModel
        As drawn or calibrated; the tolerances of a calibrated one are what may change after it.
    residual : ndarray, shape (k, m), optional
        Modes of the residual at the nodes, of unit variance each [rad]; those of the drawing's
        correlation length and tolerance if not given.  See `places_of_fields`.

    Raises
    ------
    InputError
        If contacts of uncertain place or width are on a strip in three dimensions.
    """
    return _uncertainty(BuiltInfluence(model, _samples(model), residual), {})


def places_of_fields(model: SensorModel) -> tuple[Array, int]:
    """Where samples of random fields lie along a strip, shape (s,) [m], and the number of nodes."""
    x = _samples(model)
    return x[:: SPLINE_SAMPLES // FIELD_SAMPLES], (len(x) - 1) // SPLINE_SAMPLES + 3


def _samples(model: SensorModel) -> Array:
    """Places of the samples between the nodes, shape (s,) [m]."""
    pixel, positions = model.pixel_positions, _nodes(model)[2]
    return np.asarray(pixel[0] + positions * (pixel[-1] - pixel[0]) / max(len(pixel) - 1, 1))


@dataclass(frozen=True, eq=False)
class BuiltInfluence:
    """Influence matrix of sensors whose values are not as drawn.

    Attributes
    ----------
    model : SensorModel
        As drawn or calibrated.
    x : ndarray, shape (s,)
        Places along the strip where the drawing's camera looks [m].
    residual : ndarray, shape (k, m), or None
        As of `uncertainty`.
    """

    model: SensorModel
    x: Array
    residual: Array | None = None
    _solved: dict[tuple[str, float], SensorModel] = field(default_factory=dict)

    def built(self, values: Mapping[str, float]) -> SensorModel:
        """The model with other values of the design, by path; those of single ones are kept."""
        key = next(iter(values.items()))
        if len(values) == 1 and key in self._solved:
            return self._solved[key]
        design = with_values(self._plain, values)
        drawn = design == self._plain and not self.calibrated
        model = self.model if drawn else self.model.of(design)
        if len(values) == 1:
            self._solved[key] = model
        return model

    @property
    def calibrated(self) -> bool:
        """Whether the model is of one sensor that was measured, and not as drawn."""
        return self.model.calibration is not None or self.model.imaging is not None

    @cached_property
    def _plain(self) -> Sensor:
        sensor = self.model.sensor
        return sensor.replace(tolerances=dict.fromkeys(sensor.tolerances, 0.0))

    def off(self, off: Mapping[str, float]) -> tuple[SensorModel, Array]:
        """The model whose values are so many deviations off, and where its camera looks, (s,)."""
        sensor, places, values = self.model.sensor, self.x, dict[str, float]()
        for path, e in off.items():
            if path in REGISTRATION:
                places = places + e * self.step(path)
            elif (found := number_at(sensor, path)) is not None:
                values[path] = found[0] + e * sensor.tolerances[path]
        return self.built(values) if values else self.model, places

    def __call__(self, off: Mapping[str, float]) -> Array:
        """Influence matrix of these, shape (s, n, 2) [rad/N]."""
        model, places = self.off(off)
        return self.seen(model, places)

    def seen(self, model: SensorModel, places: Array) -> Array:
        """Influence matrix of a model at places on the strip, shape (s, n, 2) [rad/N]."""
        half = self.model.sensor.transducer.length / 2
        return model.influence(np.clip(places, -half, half))

    def step(self, path: str) -> Array:
        """How far a deviation of the camera's shift or scale moves what it sees, shape (s,) [m]."""
        std = self.model.sensor.tolerances[path]
        return std * (self.x if path == "camera.scale" else np.ones_like(self.x))


def _uncertainty(matrix: BuiltInfluence, centre: Mapping[str, float]) -> Uncertainty:
    model, x = matrix.model, matrix.x
    sensor, imaging = model.sensor, model.imaging
    std = dict(sensor.tolerances)
    first, weights, positions = _nodes(model)
    pixel = model.pixel_positions
    nodes, half = (len(x) - 1) // SPLINE_SAMPLES + 3, sensor.transducer.length / 2
    shown = _inside(x, half)
    if imaging is not None:
        nearest = np.clip(np.rint(positions), 0, len(pixel) - 1).astype(np.int64)
        shown |= ~imaging.usable.reshape(-1, len(pixel))[:, nearest].any(axis=0)
    built, seen = matrix.off(centre)
    psi = matrix.seen(built, seen) * shown[:, None, None]
    lines = LineMoments.of(built.sensor, std, seen, shown)
    modes = _design_modes(matrix, built, centre, nodes, lines) + _drift(model)
    modes.sort(key=lambda mode: not mode.influence)
    beside = psi.copy()  # to which single values add up at the centre
    for mode in modes:
        for power, change in enumerate(mode.influence, 1):
            beside -= change * centre.get(mode.name, 0.0) ** power * shown[:, None, None]
    turning = [mode for mode in modes if mode.influence]
    moving = np.array([lines.moving.get(mode.name, lines.still) for mode in turning])
    moving = moving.reshape(-1, sensor.tactels.count)[: len(turning) if lines.moving else 0]
    origin = np.array([centre.get(mode.name, 0.0) for mode in turning])[: len(moving)]
    light, camera = sensor.polariscope, sensor.camera
    fixed = np.full(nodes, light.residual)
    if imaging is not None and imaging.residual is not None:
        fixed = at_nodes(model, imaging.residual)
    fields, residual = np.empty((0, nodes)), std.get(RESIDUAL, 0.0)
    if matrix.residual is not None:
        fields = matrix.residual
    elif residual:
        fields = residual * random_field(x, light.residual_length, nodes)
    error = sensor.transducer.influence_error
    shape = np.empty((0, 0))
    shapes = 0
    if error:
        columns = coefficients(np.moveaxis(psi, 0, 2), nodes).reshape(-1, nodes).T
        along = np.arange(nodes) / (nodes - 3)
        distance = np.subtract.outer(along, along) / SHAPE_LENGTH
        shape = error**2 * np.exp(-np.square(distance) / 2)
        values = np.linalg.eigvalsh(shape * (columns @ columns.T))
        shapes = int(np.sum(values > SMALLEST * values.max()))
    fields = np.concatenate([fields, np.zeros((shapes, nodes))])
    seen = pictures(light.model_copy(update={"visibility": 1.0}))
    fringes = [picture.fringe for picture in seen]
    pixels = camera.pixels
    if imaging is None:
        bright = together(light, [np.array([f.amplitude]) for f in fringes])
        dark = together(light, [np.array([f.offset]) for f in fringes])
        drawn, black = sensor.light
        amplitude = np.repeat(drawn * np.ravel(bright), pixels)
        offset = np.repeat(black + drawn * np.ravel(dark), pixels)
        visibility = light.visibility
    else:  # measured amplitudes hold the visibility already
        amplitude, offset, visibility = imaging.amplitude, imaging.offset, 1.0
    visibility_std = std.get("polariscope.visibility", 0.0)
    noise, light_variance = pixel_noise(sensor, imaging)
    per_metre = pixels / sensor.transducer.length
    blur, blur_std = (camera.blur or 0.0) * per_metre, std.get("camera.blur", 0.0) * per_metre
    gamma_std = std.get("camera.gamma", 0.0)
    crosstalk = Crosstalk.of(light, std)
    counts = (
        2 * sensor.tactels.count,
        sensor.tactels.count if PLACEMENT in std else 0,
        sensor.tactels.count if WIDTH in std else 0,
        len(fields),
        len(modes),
        1 if visibility_std else 0,
        1 if blur_std else 0,
        1 if gamma_std else 0,
        len(crosstalk.leaks),
    )
    begins = [0, *accumulate(counts)]
    loads = begins[1]
    at = Layout(loads, *begins[1:])
    bright = max(float(np.linalg.norm([_size(m.brightness) for m in modes])), 0.0) if modes else 0.0
    response = camera_response(
        camera, amplitude, offset, noise, light_variance, FOLLOWED_STDS * bright
    )
    width = float(sensor.tactels.contact_width)
    places, widths = std.get(PLACEMENT, 0.0), std.get(WIDTH, 0.0)
    frame = FrameModel(
        **mixed(
            coefficients(lines.about(beside), nodes),
            lines.reach,
            contacts_scatter(places, moving),
            (width, widths),
        ),
        **pixels_at(first, weights, len(seen)),
        reach=lines.reach,
        place=places,
        width=width,
        width_std=widths,
        narrow=NARROW * max(width, widths),
        profile=EVEN,
        moving=moving,
        origin=origin,
        fields=np.ascontiguousarray(fields),
        fixed=fixed,
        influence=coefficients(_powers([mode.influence for mode in turning], psi), nodes),
        curvature=coefficients(_curvature(model, np.clip(x, -half, half), shown), nodes),
        brightness=_profiles([mode.brightness for mode in modes], (len(seen), nodes)),
        darkness=_profiles([mode.darkness for mode in modes], (len(seen), nodes)),
        amplitude=np.asarray(amplitude, dtype=float),
        offset=np.asarray(offset, dtype=float),
        dispersion=np.array([picture.dispersion for picture in seen]),
        bias=np.array([fringe.bias for fringe in fringes]),
        spread=np.array([fringe.spread for fringe in fringes]),
        visibility=float(visibility),
        visibility_std=float(visibility_std),
        blur=float(blur),
        blur_std=float(blur_std),
        gamma=camera.gamma
        * (1.0 if camera.response in ("linear", "sRGB") else float(camera.response)),
        gamma_std=gamma_std,
        crosstalk=crosstalk.shares,
        leaks=crosstalk.leaks,
        srgb=camera.response == "sRGB",
        variance=np.asarray(response.variance, dtype=float),
        floor=response.floor,
        ceiling=response.ceiling,
        full_scale=float(camera.full_scale),
        broken=BROKEN,
        at=at,
    )
    return Uncertainty(frame, tuple(modes), shape, shapes, x, shown, matrix, dict(centre))


class Crosstalk(NamedTuple):
    """Cross-talk between channels, as of `FrameModel`.

    Attributes
    ----------
    shares : ndarray, shape (C, C + 1)
        Of the light of every channel in the fringes of each, and what is added to them; shape
        (0, 1) without cross-talk.
    leaks : ndarray, shape (k, C, C + 1)
        What a standard deviation of each uncertain share changes.
    """

    shares: Array
    leaks: Array

    @classmethod
    def of(cls, light: Polariscope, std: Mapping[str, float]) -> Crosstalk:
        """Of a polariscope and the tolerances of its design.

        Plates that are no quarter wave for all channels make the fringes of some weaker and leave
        light without fringes, so that a share of the light is not one of the fringes.

        Parameters
        ----------
        light : Polariscope
            With its channels.
        std : mapping
            Standard deviations by dotted path.
        """
        seen = pictures(light.model_copy(update={"visibility": 1.0}))
        count, pairs = len(seen), pairs_of_channels(len(seen))
        uncertain = {path: pair for path, pair in pairs.items() if std.get(path)}
        shares = light.channel_shares
        if not (len(shares) or uncertain):
            return cls(np.empty((0, 1)), np.empty((0, 0, 1)))
        shares = shares if len(shares) else np.eye(count)
        changes = np.zeros((len(uncertain), count, count))
        for change, (path, (c, d)) in zip(changes, uncertain.items(), strict=True):
            change[c, d], change[c, c] = std[path], -std[path]
        strength = np.array([one.fringe.amplitude for one in seen])
        mean = strength + 2 * np.array([one.fringe.offset for one in seen])
        whole = (shares @ strength)[:, None]
        added = -(changes @ mean)[..., None] / (whole * light.visibility)
        return cls(
            np.pad(shares * strength / whole, ((0, 0), (0, 1))),
            np.concatenate([changes * strength / whole, added], axis=2),
        )


def _powers(modes: list[tuple[Array, ...]], psi: Array) -> Array:
    """Changes of the influence matrix, shape (d, q, n, 2, m), zero beyond each mode's powers."""
    most = max(map(len, modes), default=1)
    found = np.zeros((len(modes), most, *psi.shape[1:], len(psi)))
    for d, powers in enumerate(modes):
        for q, change in enumerate(powers):
            found[d, q] = np.moveaxis(change, 0, 2)
    return found


def _curvature(model: SensorModel, x: Array, shown: NDArray[np.bool_]) -> Array:
    """Second order of the phase in the loads, shape (2n, 2n, s), or (0, 0, s) without.

    Small strain has none, and a skin is solved at the contacts that are found.
    """
    if model.sensor.transducer.strain != "finite" or model.sensor.skin is not None:
        return np.empty((0, 0, len(x)))
    return np.moveaxis(second_order_influence(model.sensor, x) * shown[:, None, None], 0, 2)


def _size(profile: Array | float) -> float:
    return float(np.max(np.abs(profile)))


def _profiles(rows: list[Array | float], shape: tuple[int, int]) -> Array:
    """At the nodes of all channels in turn, from those of a shape (channels, nodes)."""
    found = np.array([np.broadcast_to(row, shape) for row in rows], dtype=float)
    return found.reshape(-1, shape[0] * shape[1])


def _nodes(model: SensorModel) -> tuple[NDArray[np.int64], Array, Array]:
    """First node and weights of every pixel of one channel, and places of samples in pixels."""
    pixels = model.sensor.camera.pixels
    seen = model.pixel_positions
    step = abs(float(seen[-1] - seen[0])) / max(pixels - 1, 1)
    spacing = model.sensor.transducer.compliant.thickness / NODES
    steps = max(int(np.ceil(pixels * step / spacing)), 4)
    steps = min(steps, max(pixels, 4))
    count = steps + 3
    first, weights = node_weights(1 + (np.arange(pixels) + 0.5) * steps / pixels, count)
    return first, weights, _places_in_pixels(pixels, steps)


def at_nodes(model: SensorModel, values: Array) -> Array:
    """Coefficients at the nodes of values at the pixels of one row, shape (..., P) to (..., m)."""
    samples = len(_nodes(model)[2])
    sides = _sides_of_pixels(values.shape[-1], samples)
    rows = values.reshape(-1, values.shape[-1])
    return fitted(sides @ rows.T, samples).reshape(*values.shape[:-1], sides.shape[0])


@cache
def _sides_of_pixels(pixels: int, samples: int) -> csr_array:
    """From values at pixels to what `fitted` takes of the samples between them, shape (m, P)."""
    steps = (samples - 1) // SPLINE_SAMPLES
    places = np.clip(_places_in_pixels(pixels, steps), 0, pixels - 1)
    left = np.minimum(places.astype(np.int64), pixels - 2)
    share = places - left
    between = csr_array(
        (
            np.stack([1 - share, share], axis=1).ravel(),
            np.stack([left, left + 1], axis=1).ravel(),
            2 * np.arange(samples + 1),
        ),
        shape=(samples, pixels),
    )
    return csr_array(sampled(samples, steps + 3) @ between)


def _places_in_pixels(pixels: int, steps: int) -> Array:
    """Places of the samples in pixels, so many steps between nodes along them."""
    return np.arange(SPLINE_SAMPLES * steps + 1) / SPLINE_SAMPLES * pixels / steps - 0.5


def _design_modes(
    matrix: BuiltInfluence,
    built: SensorModel,
    centre: Mapping[str, float],
    nodes: int,
    lines: LineMoments,
) -> list[Mode]:
    """Unknowns of the values of the drawing, in the order of their paths.

    The camera looks from the centre's place, and what it sees is the centre's strip where it looks
    elsewhere; of single values of the strip all others are as drawn.
    """

    def beside(path: str, whole: Callable[[float], Array]) -> Callable[[float], Array]:
        """Influence matrix of a value without what it changes by moving contacts."""
        return lambda e: whole(e) - lines.moved(path, e - centre.get(path, 0.0))

    sensor, x, modes = matrix.model.sensor, matrix.x, []
    half = sensor.transducer.length / 2
    taken = {PLACEMENT, WIDTH, RESIDUAL, "polariscope.visibility", "camera.blur", "camera.gamma"}
    elsewhere = (*RELAXING, *THERMAL, CROSSTALK)
    channels = sensor.polariscope.pictures
    looking = {path: e for path, e in centre.items() if path in REGISTRATION}

    for path, std in sensor.tolerances.items():
        if path.startswith(CHANNELS):
            modes += _channel_modes(sensor, path, std)
            continue
        found = number_at(sensor, path)
        if path in taken or found is None or path.startswith(elsewhere):
            continue
        value = found[0]
        if path == "camera.amplitude":
            shown = np.array([[one.amplitude is None] for one in channels])
            modes.append(Mode(path, std, brightness=shown * (std / value)))
        elif path == "camera.offset":
            shown = np.array([[one.offset is None] for one in channels])
            modes.append(Mode(path, std, darkness=shown * std))
        elif path in REGISTRATION:
            on = np.abs(x) + REACH * np.abs(matrix.step(path)) <= half
            one = beside(path, partial(_looking, matrix, built, looking, path))
            modes.append(Mode(path, std, _powers_of(one, on)))
        elif changes_influence([path]):
            one = beside(path, partial(_one, matrix, looking, path))
            modes.append(Mode(path, std, _powers_of(one)))
    last = float(Creep.of_ratio(sensor.transducer).amounts.sum())
    if last:  # loads of any age: the ratio is anywhere between those of first and last
        value = sensor.transducer.compliant.youngs_modulus
        spread, places = value * abs(last) / np.sqrt(3), matrix.off(looking)[1]

        def relaxed(e: float) -> Array:
            return matrix.seen(matrix.built({COVER_MODULUS: value + e * spread}), places)

        modes.append(Mode(RATIO, spread, _powers_of(relaxed, reach=np.sqrt(3))))
    uneven = sensor.camera.unevenness
    if uneven:
        for row in uneven * random_field(x, sensor.transducer.length * LIGHT_LENGTH, nodes):
            modes.append(Mode("camera.unevenness", uneven, brightness=row))
    return modes


def _channel_modes(sensor: Sensor, path: str, std: float) -> list[Mode]:
    """Unknowns of the light of one channel, of which other values are taken as they are."""
    *_, number, name = path.split(".")
    own = np.eye(len(sensor.polariscope.pictures))[:, [int(number)]]
    if name == "amplitude":
        return [Mode(path, std, brightness=own * (std / sensor.light[0][int(number)]))]
    return [Mode(path, std, darkness=own * std)] if name == "offset" else []


def _looking(
    matrix: BuiltInfluence, built: SensorModel, others: Mapping[str, float], path: str, e: float
) -> Array:
    """Influence matrix of a strip where the camera looks so many deviations elsewhere."""
    return matrix.seen(built, matrix.off({**others, path: e})[1])


def _one(matrix: BuiltInfluence, others: Mapping[str, float], path: str, e: float) -> Array:
    """Influence matrix where one value is so many deviations off, beside others."""
    return matrix({**others, path: e})


def _powers_of(
    influence: Callable[[float], Array],
    on: NDArray[np.bool_] | slice = slice(None),
    reach: float = REACH,
) -> tuple[Array, ...]:
    """Changes of the influence matrix with the powers of an unknown.

    Of the polynomial through the zeros of the slope of a Chebyshev polynomial, whose series falls
    off geometrically (Trefethen, Approximation Theory and Approximation Practice, chapter 8), what
    is below `LEFT_OUT` is cut off.

    Parameters
    ----------
    influence : callable
        The matrix, shape (s, n, 2), for a value of the unknown.
    on : ndarray of bool, shape (s,), optional
        Where polynomials are to follow; everywhere if not given.
    reach : float
        Largest value that is likely.
    """
    found: dict[float, Array] = {0.0: influence(0.0)}
    largest = np.maximum(np.abs(found[0.0]).max(axis=0), np.finfo(float).tiny)
    for degree in DEGREES:
        at = [float(t) for t in np.round(np.cos(np.pi * np.arange(degree + 1) / degree), 12)]
        for t in at:
            if t not in found:
                found[t] = influence(reach * t)
        values = np.array([found[t] for t in at])
        series = np.tensordot(np.linalg.inv(chebvander(at, degree)), values, axes=1)
        sizes = (np.abs(series[:, on]).max(axis=1) / largest).max(axis=(1, 2))
        beyond = np.append(np.cumsum(sizes[::-1])[::-1], 0.0)[1:]
        count = max(int(np.argmax(beyond < LEFT_OUT)), 1)
        if count < degree - 1:  # what is left out was seen
            break
    powers = np.zeros((count, count + 1))
    for k in range(count + 1):
        own = cheb2poly(np.eye(count + 1)[k])[1:]
        powers[: len(own), k] = own
    powers /= reach ** np.arange(1, count + 1)[:, None]
    return tuple(np.tensordot(powers, series[: count + 1], axes=1))


def _drift(model: SensorModel) -> list[Mode]:
    """Light that changes from frame to frame."""
    imaging, camera = model.imaging, model.sensor.camera
    gain, offset = (camera.drift, 0.0) if imaging is None else imaging.drift
    modes = [Mode(DRIFTS[0], gain, brightness=gain)] if gain else []
    return modes + ([Mode(DRIFTS[1], offset, darkness=offset)] if offset else [])


def _inside(x: Array, half: float) -> NDArray[np.bool_]:
    """Whether places are on a strip of this half length, its very ends included."""
    return np.abs(x) <= half * (1 + 1e-9)


def random_field(x: Array, length: float, nodes: int, smallest: float = SMALLEST) -> Array:
    """Modes of a smooth random field at the nodes, shape (k, m); see `karhunen_loeve`.

    Parameters
    ----------
    x : ndarray, shape (s,)
        Places of samples, as those of `Uncertainty` [m].
    length : float
        Correlation length [m].
    nodes : int
        Number of nodes m.
    smallest : float
        As of `karhunen_loeve`.
    """
    samples = x[:: SPLINE_SAMPLES // FIELD_SAMPLES]
    return coefficients(karhunen_loeve(samples, length, smallest), nodes)
