"""The characterised sensor: one influence matrix, and everything that it predicts."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.arrays import numbers
from fringeforce.base.errors import FileFormatError, InputError
from fringeforce.base.progress import Progress
from fringeforce.base.storage import (
    FORCE_AXES,
    existing_file,
    new_file,
    read,
    read_by_tactel,
    text,
    write,
)
from fringeforce.contacts.loads import finite_loads
from fringeforce.design.files import parse_sensor
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import Tolerances, with_values
from fringeforce.estimation.likelihood import Response, misfit
from fringeforce.mechanics.elements import gauss_interpolation
from fringeforce.mechanics.mesh import Mesh, named_mesh, strip_mesh
from fringeforce.mechanics.stress import unit_stress
from fringeforce.mechanics.surface_influence import surface_influence
from fringeforce.models.as_built import (
    BuiltSensor,
    built,
    changes_influence,
    drawn,
    loosened,
    shape_errors,
)
from fringeforce.models.creep import Creep, checked_times, lasting_forces
from fringeforce.models.finite_strain import (
    Strain,
    checked_strain,
    finite_phase,
    finite_press_phase,
    strain_phase,
)
from fringeforce.models.imaging import (
    Calibration,
    Imaging,
    camera_response,
    designed_response,
    fringe_shares,
    pixel_noise,
)
from fringeforce.models.imaging_files import (
    read_calibration,
    read_imaging,
    write_calibration,
    write_imaging,
)
from fringeforce.models.presses import Presses, are_presses, press_phase
from fringeforce.models.strain_limit import warn_of_strain
from fringeforce.models.strip_width import light_line, strip_width
from fringeforce.models.temperature import frame_scale
from fringeforce.models.unlike_layers import ratio_powers, turned_phase
from fringeforce.optics import camera as camera_optics
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant
from fringeforce.optics.polariscope import Picture, pictures, together

Array = NDArray[np.float64]

COVER_MODULUS = "transducer.compliant.youngs_modulus"
"""Path of the value of a design that sets the ratio of the layers' moduli."""
STRIP = "model"
"""Kind of these files."""


@dataclass(frozen=True, eq=False, repr=False)
class SensorModel:
    """What one sensor does to forces, equation (10.a) of the paper.

    Attributes
    ----------
    sensor : Sensor
        The design it belongs to.
    breaks : ndarray, shape (e + 1,)
        Boundaries of the elements along the strip [m].
    psi : ndarray, shape (M, n, 2)
        Influence matrix at the stations [rad/N]: [..., 0] of normal, [..., 1] of tangential forces.
    provenance : mapping
        How it came about, in words and numbers.
    imaging : Imaging, optional
        Measured registration and lighting; without it the pixels are as designed.
    calibration : Calibration, optional
        What the calibration behind the model found.

    Examples
    --------
    >>> ff.characterize(ff.load_sensor("saad")).phase(ff.polar(1.0, 10, n=11), [0.0]).round(2)
    array([-6.41])
    """

    sensor: Sensor
    breaks: Array
    psi: Array
    provenance: Mapping[str, str | int] = field(default_factory=dict)
    imaging: Imaging | None = None
    calibration: Calibration | None = None

    def __repr__(self) -> str:
        """One line."""
        return f"<SensorModel of {self.sensor.name!r}>"

    @property
    def x(self) -> Array:
        """Stations along the strip, the Gauss points of its elements, shape (M,) [m]."""
        return Mesh(self.breaks, np.empty(0), self._order).stations

    @property
    def _order(self) -> int:
        return len(self.psi) // (len(self.breaks) - 1)

    def influence(self, x: ArrayLike) -> Array:
        """Influence matrix at any place, as accurate as the elements are.

        Parameters
        ----------
        x : array_like, shape (m,)
            Positions along the strip [m].

        Returns
        -------
        ndarray, shape (m, n, 2)
            Phase lead per force [rad/N].

        Raises
        ------
        InputError
            If a position lies outside the strip.
        """
        points = np.atleast_1d(np.asarray(x, dtype=float))
        half = self.sensor.transducer.length / 2
        inside = np.abs(points) <= half * (1 + 1e-12)
        if not inside.all():
            raise InputError(
                f"x = {points[~inside][0]:g} m lies outside the strip, which ends at "
                f"+-{half:g} m; positions are in metres from its centre."
            )
        stations = gauss_interpolation(self._order, self.breaks, points)
        return (stations @ self.psi.reshape(len(self.psi), -1)).reshape(-1, *self.psi.shape[1:])

    @cached_property
    def pixel_influence(self) -> Array:
        """Influence matrix at the pixels, shape (n_pixels, n, 2) [rad/N]; 0 beside the strip."""
        x, half = self.pixel_positions, self.sensor.transducer.length / 2
        return self.influence(np.clip(x, -half, half)) * (np.abs(x) <= half)[:, None, None]

    @property
    def pixel_positions(self) -> Array:
        """Where the camera's pixels look, as measured or as designed, shape (n_pixels,) [m]."""
        return self.sensor.pixel_positions if self.imaging is None else self.imaging.positions

    @cached_property
    def frame_shape(self) -> tuple[int, ...]:
        """Shape of a frame: (n_pixels,), or (n_channels, n_pixels) if there are several."""
        return self.sensor.frame_shape

    @property
    def lighting(self) -> tuple[Array, Array]:
        """Amplitude and offset, as measured at every pixel or as designed, grey levels.

        Both can be multiplied with frames, whose shape is `frame_shape`.
        """
        if self.imaging is not None:
            seen = self.imaging
            return seen.amplitude.reshape(self.frame_shape), seen.offset.reshape(self.frame_shape)
        return camera_optics.designed_lighting(self.sensor)

    @cached_property
    def _pictures(self) -> list[Picture]:
        light = self.sensor.polariscope
        if self.imaging is not None:  # measured amplitudes hold the visibility already
            light = light.model_copy(update={"visibility": 1.0})
        return pictures(light)

    @property
    def dispersions(self) -> tuple[float, ...]:
        """Phase lead of every channel over that of the polariscope's own wavelength."""
        return tuple(picture.dispersion for picture in self._pictures)

    @cached_property
    def frame_influence(self) -> Array:
        """Influence matrix at the pixels of all channels in turn, shape (size of a frame, 2n)."""
        psi = self.pixel_influence.reshape(len(self.pixel_influence), -1)
        return np.concatenate([ratio * psi for ratio in self.dispersions])

    @cached_property
    def response(self) -> Response:
        """What the camera makes of the phases of all channels, as measured or as designed."""
        camera, imaging = self.sensor.camera, self.imaging
        if imaging is None:
            return designed_response(self.sensor, self._pictures)
        bias = np.repeat([one.fringe.bias for one in self._pictures], camera.pixels)
        shares = fringe_shares(self.sensor.polariscope, self._pictures)
        light = imaging.amplitude, imaging.offset, *pixel_noise(self.sensor, imaging)
        return replace(camera_response(camera, *light), bias=bias, shares=shares)

    def phase(
        self,
        forces: ArrayLike | Presses,
        x: ArrayLike | None = None,
        strain: Strain | None = None,
    ) -> Array:
        """Phase lead under given forces, equation (10.a).

        Parameters
        ----------
        forces : array_like, shape (..., n, 2), or sequence of Press
            Normal (pressing) and tangential (towards +x) force of every tactel [N]; or what really
            touches, in one frame or, as a sequence of such sequences, in several.
        x : array_like, shape (m,), optional
            Positions along the strip [m]; the camera's pixels if not given.
        strain : {"linear", "finite"}, optional
            Whether strain is small, or the strip hyperelastic and solved anew for every frame, in
            about a second; as the design says if not given.

        Returns
        -------
        ndarray, shape (..., m) or (..., n_pixels)
            Phase lead [rad].

        Raises
        ------
        InputError
            If strain is finite and the strip three-dimensional or its contacts without width, or it
            has no stable state under the loads.
        """
        if checked_strain(strain or self.sensor.transducer.strain) == "finite":
            where = self.pixel_positions if x is None else np.asarray(x, dtype=float)
            if are_presses(forces):
                return finite_press_phase(self.sensor, where, forces)
            loads = finite_loads(cast(ArrayLike, forces), self.sensor.tactels.count)
            if self.calibration is not None:  # whose columns may be those of no design
                return self.phase(loads, x, strain="linear") + strain_phase(
                    self.sensor, where, loads
                )
            return finite_phase(self.sensor, where, loads)
        if are_presses(forces):
            where = self.pixel_positions if x is None else np.asarray(x, dtype=float)
            return press_phase(self.sensor, where, forces)
        influence = self.pixel_influence if x is None else self.influence(x)
        loads = finite_loads(cast(ArrayLike, forces), self.sensor.tactels.count)
        return loads.reshape(*loads.shape[:-2], -1) @ influence.reshape(len(influence), -1).T

    def intensity(self, forces: ArrayLike) -> Array:
        """Normalised intensity at the camera's pixels, equation (11), behind polariscope and lens.

        Parameters
        ----------
        forces : array_like, shape (..., n, 2)
            Normal and tangential force of every tactel [N].

        Returns
        -------
        ndarray, shape (..., *frame_shape)
            Share of what a perfect dark field lets through at most.
        """
        return self._light(self._with_residual(self.phase(forces)))

    def _with_residual(self, phase: Array) -> Array:
        if self.imaging is not None and self.imaging.residual is not None:
            return phase + self.imaging.residual
        residual = self.sensor.polariscope.residual
        return phase + residual if residual else phase

    def _light(self, phase: Array) -> Array:
        """Normalised intensity of all channels at phase leads, shape (..., n_pixels)."""
        seen = [p.fringe.intensity(p.dispersion * phase) for p in self._pictures]
        return camera_optics.on_sensor(self.sensor, together(self.sensor.polariscope, seen))

    def expose(
        self,
        forces: ArrayLike | Presses,
        rng: camera_optics.Rng = None,
        as_built: camera_optics.Rng = None,
        strain: Strain | None = None,
        times: ArrayLike | None = None,
        temperature: ArrayLike | None = None,
    ) -> NDArray[np.unsignedinteger]:
        """Frames that the camera would deliver, equation (13).

        Parameters
        ----------
        forces : array_like, shape (..., n, 2), or sequence of Press
            Normal and tangential force of every tactel [N], or what really touches, as of `phase`.
        rng : int, numpy.random.Generator or None
            Source of the noise, and of all that changes from frame to frame.
        as_built : int or numpy.random.Generator, optional
            Source of one sensor, drawn from the tolerances of the design, that all frames are of;
            the sensor as drawn if not given.  `as_built` keeps such a sensor.
        strain : {"linear", "finite"}, optional
            As of `phase`.
        times : array_like, shape (F,), optional
            When the frames are exposed [s].  Loads change linearly from one to the next, nothing
            acted before the first, and a strip that relaxes creeps; without them it does not.
        temperature : array_like, shape () or (...), optional
            Of the photoelastic layer, for all frames or each [K]; that of the design if not given.

        Returns
        -------
        ndarray, shape (..., *frame_shape)
            Grey levels, uint8 up to 8 bits and uint16 above.

        Warns
        -----
        LargeStrainWarning
            If loads strain the cover further than small strain holds, and `strain` is not given.
        """
        if strain is None:
            warn_of_strain(self.sensor, forces)
        if as_built is not None:
            if checked_strain(strain or self.sensor.transducer.strain) == "finite":
                raise InputError(
                    "A sensor as built has small strain; leave as_built out for finite strain."
                )
            return self.as_built(as_built).expose(forces, rng, times=times, temperature=temperature)
        loaded = self.loaded_phase(forces, strain, times, temperature)
        return self.delivered(self._with_residual(loaded), rng)

    def loaded_phase(
        self,
        forces: ArrayLike | Presses,
        strain: Strain | None = None,
        times: ArrayLike | None = None,
        temperature: ArrayLike | None = None,
    ) -> Array:
        """Phase leads of the frames that `expose` delivers, without the residual.

        Parameters
        ----------
        forces, strain, times, temperature
            As of `expose`.

        Returns
        -------
        ndarray, shape (..., n_pixels)
            With what creep and temperature do to them [rad].
        """
        transducer = self.sensor.transducer
        ratio = Creep.of_ratio(transducer)
        finite = checked_strain(strain or transducer.strain) == "finite"
        if times is not None and finite and (refused := transducer.large_creep_refusal):
            raise InputError(f"{refused[0].upper()}{refused[1:]}.")
        if times is not None and finite and len(Creep.of(transducer).rates):
            # strains are those of loads with their lags at once, and so is the light of strain
            loads = self._loads_in_a_row(forces, times)
            phase = self.phase(lasting_forces(transducer, loads, times), strain=strain)
            return frame_scale(self.sensor, temperature, phase.shape[:-1]) * phase
        if times is not None and len(ratio.rates):
            phase = self._turned_phase(forces, times, ratio)
        else:
            phase = self.phase(forces, strain=strain)
        return self.lit_phase(phase, times, temperature)

    def lit_phase(
        self, phase: Array, times: ArrayLike | None, temperature: ArrayLike | None
    ) -> Array:
        """Phases of frames, shape (..., n_pixels), with what creep and temperature do to them."""
        scale = frame_scale(self.sensor, temperature, phase.shape[:-1])
        return scale * self._crept(phase, times)

    def _crept(self, phase: Array, times: ArrayLike | None) -> Array:
        if times is None:
            return phase
        if phase.ndim != 2:
            raise InputError(f"times go with frames in a row, not with shape {phase.shape[:-1]}.")
        own = checked_times(times, len(phase))
        return phase + Creep.of(self.sensor.transducer).added(own, phase)

    def _loads_in_a_row(self, forces: ArrayLike | Presses, times: ArrayLike) -> Array:
        """Forces of frames in a row, shape (F, n, 2) [N]."""
        if are_presses(forces):
            raise InputError(
                "Large strain that creeps is simulated with forces on tactels; give forces of "
                "shape (F, n, 2)."
            )
        loads = finite_loads(cast(ArrayLike, forces), self.sensor.tactels.count)
        if loads.ndim != 3:
            raise InputError(f"times go with frames in a row, not with shape {loads.shape[:-2]}.")
        return loads

    def _turned_phase(self, forces: ArrayLike | Presses, times: ArrayLike, ratio: Creep) -> Array:
        """Phases of frames in a row, of layers that relax unlike, before they creep alike."""
        if are_presses(forces) or self.imaging is not None:
            raise InputError(
                "Layers that relax unlike are simulated as drawn and with forces on tactels; give "
                "forces of shape (F, n, 2) to the model of the drawing."
            )
        loads = self._loads_in_a_row(forces, times)
        own = checked_times(times, len(loads))
        return turned_phase(self._ratio_powers, ratio, own, loads.reshape(len(loads), -1))

    @cached_property
    def _ratio_powers(self) -> Array:
        """Matrices of the powers of what relaxation changes in the ratio of the moduli."""
        plain = self.sensor.model_copy(update={"tolerances": Tolerances()})
        modulus = self.sensor.transducer.compliant.youngs_modulus

        def influence(factor: float) -> Array:
            other = self.of(with_values(plain, {COVER_MODULUS: factor * modulus}))
            return other.pixel_influence.reshape(len(self.pixel_positions), -1)

        last = float(Creep.of_ratio(self.sensor.transducer).amounts.sum())
        return ratio_powers(influence, last)

    def delivered(
        self, phase: ArrayLike, rng: camera_optics.Rng = None, light: Array | None = None
    ) -> NDArray[np.unsignedinteger]:
        """Frames of given phase leads, such as those of another solution of the mechanics.

        Parameters
        ----------
        phase : array_like, shape (..., n_pixels)
            Phase lead at the polariscope's wavelength, residual included [rad].
        rng : int, numpy.random.Generator or None
            Source of drift and noise.
        light : ndarray, shape (n_pixels,), optional
            Light along the strip over that of the drawing.

        Returns
        -------
        ndarray, shape (..., *frame_shape)
            Grey levels, uint8 up to 8 bits and uint16 above.

        Warns
        -----
        LargeStrainWarning
            If loads strain the cover further than small strain holds, and `strain` is not given.
        """
        seen = self._light(np.asarray(phase, dtype=float)) * (1.0 if light is None else light)
        frame_axes = len(self.frame_shape)
        noise = camera_optics.by_channel(self.sensor, self.sensor.noise)
        return camera_optics.expose(
            self.sensor.camera, seen, rng, self.lighting, frame_axes, noise=noise
        )

    def as_built(self, rng: camera_optics.Rng = None) -> BuiltSensor:
        """Draw one real sensor from the tolerances of the design.

        Materials, sizes, light and camera are drawn once, and the mechanics solved again where they
        change; the residual is drawn as a field along the strip.  `BuiltSensor.expose` then draws
        place and width of the contacts, light and noise for every frame.

        Parameters
        ----------
        rng : int, numpy.random.Generator or None
            Source of the draws.

        Raises
        ------
        InputError
            If the model is calibrated: it is of one sensor already.
        """
        if self.calibration is not None or self.imaging is not None:
            raise InputError(
                "This model is calibrated, so that it is of one sensor already; draw others from "
                "the model of the drawing, characterize(sensor)."
            )
        generator = np.random.default_rng(rng)
        design = drawn(self.sensor, generator)
        anew = changes_influence(self.sensor.tolerances)
        model = self.of(design) if anew else replace(self, sensor=design)
        error = design.transducer.influence_error
        if error:
            psi = model.psi * (1 + error * shape_errors(model.x, model.psi.shape[1:], generator))
            model = replace(model, psi=psi)
        return built(self.sensor, model, generator)

    def of(self, sensor: Sensor) -> SensorModel:
        """The model of a design whose numbers differ; a given matrix only scales with its optics.

        Parameters
        ----------
        sensor : Sensor
            The other design.
        """
        if sensor.transducer.plane != "given":
            return characterize(sensor)
        there, here = (
            stress_optic_constant(s.transducer.photoelastic, s.polariscope.wavelength)
            for s in (sensor, self.sensor)
        )
        return replace(self, sensor=sensor, psi=self.psi * (there / here))

    def with_tolerances(self, **stated: Any) -> SensorModel:
        """The same model with other tolerances, which readings allow for.

        Parameters
        ----------
        **stated
            Values of the design by dotted path, as of `Sensor.replace`:
            ``with_tolerances(**{"camera.shift": "0 +/- 0.05 mm"})``.

        Raises
        ------
        DesignError
            If the design does not have such a value.
        InputError
            If a value changes on which the influence matrix depends.

        Examples
        --------
        >>> model = ff.characterize(ff.load_sensor("saad"))
        >>> loose = model.with_tolerances(**{"transducer.influence_error": "3 %"})
        >>> loose.sensor.transducer.influence_error
        0.03
        """
        return replace(self, sensor=loosened(self.sensor, stated))

    def residuals(self, frames: ArrayLike, forces: ArrayLike) -> Array:
        """What known forces leave of frames, in units of the noise; zero where no pixel is usable.

        Parameters
        ----------
        frames : array_like, shape (..., *frame_shape)
            Grey levels.
        forces : array_like, shape (..., n, 2)
            Forces that acted [N].

        Returns
        -------
        ndarray, shape (..., *frame_shape)
            With a standard deviation of one if the model explains the frames.
        """
        grey = numbers(frames, "Grey levels")
        seen = camera_optics.delivered(self.sensor.camera, self.intensity(forces), self.lighting)
        expected = seen.reshape(*seen.shape[: seen.ndim - len(self.frame_shape)], -1)
        usable = 1 if self.imaging is None else self.imaging.usable
        left = misfit(grey.reshape(expected.shape), expected, self.response).slope
        return (-left * usable).reshape(grey.shape)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the model to an HDF5 file, all of it or nothing; `fringeforce.load_model` reads it.

        It holds the influence matrix, the design, the provenance, and the calibration if any.
        """
        places = self.sensor.tactels.positions
        with new_file(path, STRIP) as file:
            file.attrs["design"] = self.sensor.to_toml()
            file.attrs["provenance"] = json.dumps(dict(self.provenance))
            write(file, "x", self.x, ("x",), "m", "stations along the strip")
            write(
                file,
                "component",
                self.sensor.components,
                ("component",),
                None,
                "direction of the force",
            )
            write(file, "tactel", places, ("tactel",), "m", "places of the tactels")
            write(file, "breaks", self.breaks, ("breaks",), "m", "boundaries of the elements")
            write(file, "psi", self.psi, ("x", *FORCE_AXES), "rad/N", "influence matrix")
            if self.imaging is not None:
                write_imaging(file, self.imaging)
            if self.calibration is not None:
                write_calibration(file, self.calibration)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> SensorModel:
        """Read a model that `save` wrote.

        Raises
        ------
        FileFormatError
            If the file is missing, truncated, of another kind, or damaged.
        """
        with existing_file(path, STRIP) as file:
            model = cls(
                sensor=parse_sensor(text(file, "design"), source=f"The design inside {path}"),
                breaks=read(file, "breaks"),
                psi=read_by_tactel(file, "psi"),
                provenance=json.loads(text(file, "provenance")),
                imaging=read_imaging(file),
                calibration=read_calibration(file),
            )
        expected = (model.sensor.tactels.count, 2)
        columns = len(model.breaks) - 1
        imaging = model.imaging
        if imaging is not None and (
            len(imaging.positions) != model.sensor.camera.pixels
            or len(imaging.amplitude) != np.prod(model.frame_shape)
        ):
            raise FileFormatError(
                f"{path} is damaged: its imaging has {len(imaging.positions)} pixels, with light "
                f"of {len(imaging.amplitude)}, and a frame {model.frame_shape}. Calibrate the "
                "sensor again."
            )
        if model.psi.shape[1:] != expected or columns < 1 or len(model.psi) % columns:
            raise FileFormatError(
                f"{path} is damaged: an influence matrix of shape {model.psi.shape} does not fit "
                f"{columns} elements and {expected[0]} tactels. Characterise the design again."
            )
        return model


def characterize(
    sensor: Sensor, mesh: Mesh | str | None = None, progress: Progress | None = None
) -> SensorModel:
    """Reduce a design to its influence matrix, with finite elements (Section III of the paper).

    Parameters
    ----------
    sensor : Sensor
        The design.
    mesh : Mesh or str, optional
        The elements; those that the design asks for if not given.
    progress : callable, optional
        Told words, the steps done and their count where they take seconds, in three dimensions.

    Returns
    -------
    SensorModel
        On the default mesh its influence matrix is within 1e-4 of the exact one of a plane.
    """
    if sensor.transducer.plane == "given":
        raise InputError(
            'transducer.plane = "given": the influence matrix of this design was given, and there '
            "is nothing to solve; keep the model that has it, model_from_influence(...)."
        )
    if sensor.skin or sensor.tactels.contact_width or sensor.tactels.placement:
        return _distributed(sensor, mesh)
    if sensor.transducer.plane == "3d" and mesh in (None, "default"):
        found = strip_width(sensor, progress=progress)
        facts = {"method": "finite elements, 3-D", "order": found.order, "unknowns": found.unknowns}
        return SensorModel(sensor, found.breaks, found.psi, facts)
    transducer, positions = sensor.transducer, sensor.tactels.positions
    if mesh is None or isinstance(mesh, str):
        mesh = named_mesh(mesh or "default", transducer, positions)
    return reduced(sensor, mesh, unit_stress(transducer, positions, mesh, mesh.stations))


def _distributed(sensor: Sensor, mesh: Mesh | str | None) -> SensorModel:
    """The influence matrix of contacts that are not lines at the tactels' places."""
    if mesh not in (None, "default"):
        raise InputError(
            "A mesh of one's own has its line loads at the tactels' places; leave mesh out, or "
            "tactels.contact_width and tactels.placement."
        )
    tactels, transducer = sensor.tactels, sensor.transducer
    centres, half = tactels.positions + tactels.placement, tactels.contact_width / 2
    places = strip_mesh(transducer, tactels.positions)
    line = light_line(transducer, sensor.camera)
    surface = surface_influence(
        transducer, centres[0] - half, centres[-1] + half, places.stations, line
    )
    constant = stress_optic_constant(transducer.photoelastic, sensor.polariscope.wavelength)
    widths = np.full(tactels.count, tactels.contact_width)
    facts = {"method": "finite elements, distributed loads", "line loads": len(surface.places)}
    psi = phase_lead(surface.under(centres, widths), constant)
    return SensorModel(sensor, places.x, psi, facts)


def reduced(sensor: Sensor, mesh: Mesh, stress: Array) -> SensorModel:
    """The influence matrix of stresses that are known already.

    Parameters
    ----------
    sensor : Sensor
        The design.
    mesh : Mesh
        The elements by which its strip was solved.
    stress : ndarray, shape (m, n, 2)
        What the light sees at the stations of the mesh, under a unit force on each of its
        tactels, as of `integrated_stress` [Pa m / N].
    """
    layer = sensor.transducer.photoelastic
    constant = stress_optic_constant(layer, sensor.polariscope.wavelength)
    return SensorModel(
        sensor=sensor,
        breaks=mesh.x,
        psi=phase_lead(stress, constant),
        provenance={
            "method": "finite elements",
            "order": mesh.order,
            "columns": len(mesh.x) - 1,
            "rows": len(mesh.z) - 1,
            "unknowns": mesh.unknowns,
        },
    )
