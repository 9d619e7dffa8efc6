"""One real sensor: a design whose tolerances have been drawn, exposed as often as wanted.

Every toleranced value is drawn once from a normal distribution about what is drawn, cut off where
its field has a limit.  Three are not one number for a sensor: the residual is a smooth random field
along the strip, and place and width of the contacts are drawn anew for every frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from fringeforce.base.errors import InputError
from fringeforce.contacts.loads import finite_loads
from fringeforce.design.parts import Design
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import Limits, limits, number_at, with_values
from fringeforce.mechanics.surface_influence import SurfaceInfluence, surface_influence
from fringeforce.models.presses import Presses, are_presses
from fringeforce.models.strip_width import light_line
from fringeforce.models.temperature import COEFFICIENT, REFERENCE
from fringeforce.optics import camera as camera_optics
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

Array = NDArray[np.float64]
AnyDesign = TypeVar("AnyDesign", bound=Design)

RESIDUAL, PLACEMENT, WIDTH = "polariscope.residual", "tactels.placement", "tactels.contact_width"
SIZE = "tactels.size"
ANEW = PLACEMENT, WIDTH, SIZE
"""Paths of values of the contacts, which differ from frame to frame."""
INFLUENCE_ERROR = "transducer.influence_error"
SHAPE_LENGTH = 1 / 16
"""Correlation length of errors of shape of the influence matrix, as a share of the strip."""
LIGHT_LENGTH = 0.3
"""Correlation length of uneven light, as a share of the strip: lamps and lenses are wider."""
MECHANICAL = "transducer.", "tactels.", "polariscope.wavelength"
"""Beginnings of the paths on which the influence matrix depends."""
FIELD_STEP = 8
"""Points of a residual field in one correlation length; a cubic spline between them is good to
2e-5 of its standard deviation."""
FARTHEST_STDS = 6.0
"""Standard deviations beside a tactel up to which contacts are solved for: 2 in 1e9 lie beyond and
are moved there."""


class StripModel(Protocol):
    """What is asked of the model of a drawn design; `SensorModel` is one."""

    @property
    def sensor(self) -> Sensor:
        """The design."""
        ...

    @property
    def pixel_positions(self) -> Array:
        """Where the camera's pixels look, shape (n_pixels,) [m]."""
        ...

    def phase(self, forces: ArrayLike | Presses) -> Array:
        """Phase lead at the pixels [rad]."""
        ...

    def influence(self, x: ArrayLike) -> Array:
        """Influence matrix at places [rad/N]."""
        ...

    def loaded_phase(
        self,
        forces: ArrayLike | Presses,
        *,
        times: ArrayLike | None = None,
        temperature: ArrayLike | None = None,
    ) -> Array:
        """Phase lead at the pixels, with what creep and temperature do to it [rad]."""
        ...

    def lit_phase(
        self, phase: Array, times: ArrayLike | None, temperature: ArrayLike | None
    ) -> Array:
        """Phases of frames with what creep and temperature do to them [rad]."""
        ...

    def delivered(
        self, phase: ArrayLike, rng: camera_optics.Rng = None, light: Array | None = None
    ) -> NDArray[Any]:
        """Frames of given phase leads."""
        ...


class Contacts(NamedTuple):
    """Where the forces of frames act.

    Attributes
    ----------
    centres, widths : ndarray, shape (..., n)
        Of the contact at every tactel [m].
    """

    centres: Array
    widths: Array


@dataclass(frozen=True, eq=False)
class BuiltSensor:
    """One sensor made from a drawing with tolerances; `SensorModel.as_built` makes it.

    Attributes
    ----------
    drawing : Sensor
        The design with its tolerances.
    model : SensorModel
        The sensor's own model: its design holds the values that were drawn, which readers of the
        drawing's model do not know.
    residual : ndarray, shape (n_pixels,)
        Phase lead without load [rad].
    surface : SurfaceInfluence, optional
        What tractions at any place do at the pixels, if contacts differ from frame to frame.
    light : ndarray, shape (n_pixels,), optional
        Light along the strip over that of the drawing, if it is uneven.

    Examples
    --------
    >>> drawing = ff.load_sensor("saad").replace(**{"tactels.placement": "0 +/- 0.1 mm"})
    >>> real = ff.characterize(drawing).as_built(rng=0)
    >>> real.expose([ff.polar(1.0, angle=10, n=11)] * 3, rng=1).shape
    (3, 2048)
    """

    drawing: Sensor
    model: StripModel
    residual: Array
    surface: SurfaceInfluence | None = None
    light: Array | None = None

    def contacts(
        self, frames: int | tuple[int, ...] = (), rng: camera_optics.Rng = None
    ) -> Contacts:
        """Draw where the forces of frames act.

        Parameters
        ----------
        frames : int or tuple of int
            Number of frames, or shape of a batch.
        rng : int, numpy.random.Generator or None
            Source of the draws.
        """
        generator, tactels = np.random.default_rng(rng), self.model.sensor.tactels
        shape = (*np.atleast_1d(np.asarray(frames, dtype=int)), tactels.count)
        std = self.drawing.tolerances
        beside = generator.normal(tactels.placement, std.get(PLACEMENT, 0.0), shape)
        width = tactels.contact_width, std.get(WIDTH, 0.0)
        widths = _truncated(*width, Limits(low=0.0), generator, shape)
        return Contacts(tactels.positions + beside, widths)

    def phase(self, forces: ArrayLike | Presses, contacts: Contacts | None = None) -> Array:
        """Phase lead at the pixels, residual included, shape (..., n_pixels) [rad].

        Parameters
        ----------
        forces : array_like, shape (..., n, 2)
            Normal and tangential force of every tactel [N].
        contacts : Contacts, optional
            Where they act, of a shape that fits the forces; at the places and under the widths of
            the design if not given.
        """
        if contacts is None or are_presses(forces):
            return self.model.phase(forces) + self.residual
        sensor = self.model.sensor
        loads = finite_loads(cast(ArrayLike, forces), sensor.tactels.count)
        surface = self.surface
        if surface is None or not surface.covers(*contacts):
            surface = _surface(sensor, *contacts)
        layer = sensor.transducer.photoelastic
        constant = stress_optic_constant(layer, sensor.polariscope.wavelength)
        shape = np.broadcast_shapes(loads.shape[:-1], contacts.centres.shape, contacts.widths.shape)
        centres, widths = (np.broadcast_to(part, shape) for part in contacts)
        shares = surface.shares(centres.ravel(), widths.ravel()).reshape(*shape, -1)
        lines = np.einsum("...ck,...ct->...kt", shares, loads)
        stress = surface.stress.reshape(len(surface.stress), -1)
        flat = lines.reshape(*lines.shape[:-2], -1) @ stress.T
        return phase_lead(flat, constant) + self.residual

    def expose(
        self,
        forces: ArrayLike | Presses,
        rng: camera_optics.Rng = None,
        contacts: Contacts | None = None,
        times: ArrayLike | None = None,
        temperature: ArrayLike | None = None,
    ) -> NDArray[np.unsignedinteger]:
        """Frames that the camera of this sensor would deliver, each with contacts of its own.

        Parameters
        ----------
        forces : array_like, shape (..., n, 2)
            Normal and tangential force of every tactel [N].
        rng : int, numpy.random.Generator or None
            Source of contacts, light and noise.
        contacts : Contacts, optional
            Where the forces act, if it is known; drawn anew for every frame if not given.
        times, temperature
            As of `SensorModel.expose`.

        Returns
        -------
        ndarray, shape (..., *frame_shape)
            Grey levels, uint8 up to 8 bits and uint16 above.
        """
        generator, transducer = np.random.default_rng(rng), self.model.sensor.transducer
        if contacts is None and self.surface is not None and not are_presses(forces):
            contacts = self.contacts(np.shape(cast(ArrayLike, forces))[:-2], generator)
        one, other = transducer.relaxations
        scattered = contacts is not None or transducer.influence_error
        if times is not None and one != other and scattered:
            raise InputError(
                "Layers that relax unlike are simulated with contacts and columns as drawn; leave "
                "placement, contact_width and influence_error without a tolerance, or state one "
                "relaxation of both layers."
            )
        if contacts is None:
            loaded = self.model.loaded_phase(forces, times=times, temperature=temperature)
        else:
            loaded = self.phase(forces, contacts) - self.residual
            loaded = self.model.lit_phase(loaded, times, temperature)
        return self.model.delivered(loaded + self.residual, generator, self.light)


def drawn(design: AnyDesign, generator: np.random.Generator) -> AnyDesign:
    """A design with values drawn from its tolerances, and without tolerances.

    What is made may break a rule of drawings, such as a light that the converter clips.

    Parameters
    ----------
    design : Design
        Of a strip or a pad.
    generator : numpy.random.Generator
        Source of the draws.
    """
    values: dict[str, Any] = {"tolerances": type(design.tolerances)()}
    for path, std in design.tolerances.items():
        found = number_at(design, path)
        if found is not None and path not in (RESIDUAL, *ANEW):
            values[path] = float(_truncated(found[0], std, limits(found[1]), generator, ()))
    return with_values(design, values)


def changes_influence(paths: Iterable[str]) -> bool:
    """Whether the influence matrix depends on one of these values."""
    return any(path.startswith(MECHANICAL) for path in set(paths) - {*ANEW, COEFFICIENT, REFERENCE})


def loosened(design: AnyDesign, stated: Mapping[str, Any]) -> AnyDesign:
    """A design with other tolerances, for a model that is characterised already.

    Parameters
    ----------
    design : Design
        Of a strip or a pad.
    stated : mapping
        Values by dotted path, as of `Design.replace`.

    Raises
    ------
    DesignError
        If the design does not have such a value.
    InputError
        If a value changes on which the influence matrix depends.
    """
    changed = design.replace(**stated)
    for path in stated:
        before, after = (number_at(one, path) for one in (design, changed))
        moved = before is not None and after is not None and before[0] != after[0]
        if moved and path != INFLUENCE_ERROR and changes_influence([path]):
            raise InputError(
                f"{path} = {stated[path]} changes the influence matrix, and not only what is "
                "uncertain about it; characterise the changed design."
            )
    return changed


def built(drawing: Sensor, model: StripModel, generator: np.random.Generator) -> BuiltSensor:
    """Add to the model of a drawn design what is not one number.

    Parameters
    ----------
    drawing : Sensor
        The design with its tolerances.
    model : SensorModel
        Of the values that were drawn from it.
    generator : numpy.random.Generator
        Source of the residual field.
    """
    std, polariscope, x = drawing.tolerances, model.sensor.polariscope, model.pixel_positions
    residual = np.full(len(x), polariscope.residual)
    if RESIDUAL in std:
        field = smooth_field(x, polariscope.residual_length, generator)
        residual = residual + std[RESIDUAL] * field
    uneven, light = model.sensor.camera.unevenness, None
    if uneven:
        length = LIGHT_LENGTH * model.sensor.transducer.length
        light = np.maximum(1 + uneven * smooth_field(x, length, generator), 0.0)
    if PLACEMENT not in std and WIDTH not in std:
        return BuiltSensor(drawing, model, residual, light=light)
    tactels = model.sensor.tactels
    beside = abs(tactels.placement) + FARTHEST_STDS * std.get(PLACEMENT, 0.0)
    width = tactels.contact_width + FARTHEST_STDS * std.get(WIDTH, 0.0) + 2 * beside
    surface = _surface(model.sensor, tactels.positions, np.array(width))
    return BuiltSensor(drawing, model, residual, surface, light)


def _surface(sensor: Sensor, centres: Array, widths: Array) -> SurfaceInfluence:
    """Line loads as far as contacts reach."""
    first, last = float(np.min(centres - widths / 2)), float(np.max(centres + widths / 2))
    line = light_line(sensor.transducer, sensor.camera)
    return surface_influence(sensor.transducer, first, last, sensor.pixel_positions, line)


def shape_errors(x: Array, shape: tuple[int, ...], generator: np.random.Generator) -> Array:
    """Errors of shape of unit variance of every column of an influence matrix at stations x."""
    order, length = np.argsort(x, kind="stable"), (x.max() - x.min()) * SHAPE_LENGTH
    found = np.empty((len(x), *shape))
    for column in np.ndindex(*shape):
        found[order, *column] = smooth_field(x[order], length, generator)
    return found


def smooth_field(x: Array, length: float, generator: np.random.Generator) -> Array:
    """A Gaussian process of unit variance with covariance exp(-(distance / length)^2 / 2).

    White noise behind a Gaussian filter of standard deviation length / sqrt(2) (Rasmussen and
    Williams, Gaussian Processes for Machine Learning, section 4.2.1).

    Parameters
    ----------
    x : ndarray, shape (m,)
        Places, ascending [m].
    length : float
        Correlation length [m].
    generator : numpy.random.Generator
        Source of the noise.
    """
    step = length / FIELD_STEP
    grid = np.arange(x[0] - 2 * step, x[-1] + 3 * step, step)
    reach = 5 * FIELD_STEP
    kernel = np.exp(-np.square(np.arange(-reach, reach + 1) / FIELD_STEP))
    white = generator.standard_normal(len(grid) + 2 * reach)
    values = np.convolve(white, kernel / np.linalg.norm(kernel), mode="valid")
    return np.asarray(CubicSpline(grid, values)(x))


def _truncated(
    mean: float,
    std: float,
    allowed: Limits,
    generator: np.random.Generator,
    shape: tuple[int, ...],
) -> Array:
    """Normal draws, repeated where they leave the limits."""
    values = np.asarray(generator.normal(mean, std, shape))
    inside = np.vectorize(allowed.allow, otypes=[bool])
    while not (good := inside(values)).all():
        values = np.where(good, values, generator.normal(mean, std, shape))
    return values
