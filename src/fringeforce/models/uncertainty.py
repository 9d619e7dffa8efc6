"""What is uncertain about a strip, as unknowns beside the loads: the tolerances of its design.

Every tolerance becomes one or more standardised unknowns of a `FrameModel`: design values and the
camera's registration turn the influence matrix, contacts land beside their tactels and are as wide
as they are, the residual is a smooth random field, and the light is as bright as it is.  A value
without a tolerance has no unknown and costs nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.frame_exposure import influence_slopes
from fringeforce.estimation.frame_model import (
    EVEN,
    FrameModel,
    Layout,
    contacts_scatter,
    influence_as_drawn,
    pixels_at,
)
from fringeforce.models.as_built import (
    PLACEMENT,
    RESIDUAL,
    SHAPE_LENGTH,
    WIDTH,
)
from fringeforce.models.crosstalk import Crosstalk
from fringeforce.models.design_modes import DRIFTS, BuiltInfluence, Mode, design_modes, drift_modes
from fringeforce.models.finite_strain import second_order_influence
from fringeforce.models.imaging import camera_response, pixel_noise
from fringeforce.models.line_moments import FOLLOWED_STDS, LineMoments, mixed
from fringeforce.models.node_splines import coefficients
from fringeforce.models.strip import SensorModel
from fringeforce.models.strip_nodes import (
    SMALLEST,
    SPLINE_SAMPLES,
    at_nodes,
    pixel_nodes,
    random_field,
    samples_along,
)
from fringeforce.optics.polariscope import pictures, together

Array = NDArray[np.float64]

NARROW = 0.125
"""Share of a width below which it is kept positive smoothly."""
BROKEN = 1e-3
"""Share of pixels that show anything at all: a line camera of good quality has fewer."""


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
        """The same of what is neither as if contacts moved nor a change of scale, (d,)."""
        changes = self.frame.influence[:, 0]
        if len(self.frame.scaling):
            as_drawn = influence_as_drawn(self.frame)
            changes = changes - self.frame.scaling[:, None, None, None] * as_drawn
        return self._over_peak(changes)

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
    return _uncertainty(BuiltInfluence(model, samples_along(model), residual), {})


def _uncertainty(matrix: BuiltInfluence, centre: Mapping[str, float]) -> Uncertainty:
    model, x = matrix.model, matrix.x
    sensor, imaging = model.sensor, model.imaging
    std = dict(sensor.tolerances)
    first, weights, positions = pixel_nodes(model)
    pixel = model.pixel_positions
    nodes, half = (len(x) - 1) // SPLINE_SAMPLES + 3, sensor.transducer.length / 2
    shown = _inside(x, half)
    if imaging is not None:
        nearest = np.clip(np.rint(positions), 0, len(pixel) - 1).astype(np.int64)
        shown |= ~imaging.usable.reshape(-1, len(pixel))[:, nearest].any(axis=0)
    built, seen = matrix.off(centre)
    psi = matrix.seen(built, seen) * shown[:, None, None]
    lines = LineMoments.of(built.sensor, std, seen, shown)
    modes = design_modes(matrix, built, centre, nodes, lines) + drift_modes(model)
    modes.sort(key=lambda mode: not mode.influence)
    beside = psi.copy()  # to which single values add up at the centre
    for mode in modes:
        for power, change in enumerate(mode.influence, 1):
            beside -= change * centre.get(mode.name, 0.0) ** power * shown[:, None, None]
    turning = [mode for mode in modes if mode.influence]
    moving = np.array([lines.moving.get(mode.name, lines.still) for mode in turning])
    moving = moving.reshape(-1, sensor.tactels.count)[: len(turning) if lines.moving else 0]
    scaling = np.array([_scaling(mode.influence[0], psi) for mode in turning])
    scaling = scaling[: len(turning) if lines.moments.shape[2] > 1 else 0]
    as_drawn = lines.nominal if len(scaling) else np.empty(0)
    origin = np.array([centre.get(mode.name, 0.0) for mode in turning])
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
        drawn=as_drawn,
        scaling=scaling,
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


def _scaling(change: Array, psi: Array) -> float:
    """Relative change of what contacts add that lie beside their tactels, or are wider.

    To first order it is the change along the strip, and the nearest multiple of it.
    """
    slope, own = np.diff(psi, axis=0).ravel(), np.diff(change, axis=0).ravel()
    square = float(slope @ slope)
    return float(slope @ own) / square if square else 0.0


def _size(profile: Array | float) -> float:
    return float(np.max(np.abs(profile)))


def _profiles(rows: list[Array | float], shape: tuple[int, int]) -> Array:
    """At the nodes of all channels in turn, from those of a shape (channels, nodes)."""
    found = np.array([np.broadcast_to(row, shape) for row in rows], dtype=float)
    return found.reshape(-1, shape[0] * shape[1])


def _inside(x: Array, half: float) -> NDArray[np.bool_]:
    """Whether places are on a strip of this half length, its very ends included."""
    return np.abs(x) <= half * (1 + 1e-9)
