"""The characterised pad: from forces to images, and back by the adjoint."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import FileFormatError, InputError
from fringeforce.base.progress import Progress
from fringeforce.base.storage import existing_file, new_file, read, text, write
from fringeforce.contacts.loads import checked_loads
from fringeforce.design.files import parse_sensor
from fringeforce.design.pad import Pad, PadTactels
from fringeforce.design.tolerances import Tolerances
from fringeforce.mechanics.solid.block import Block, Patches, SolidInfluence
from fringeforce.mechanics.solid.fourier import stress_influence
from fringeforce.mechanics.solid.sides import sided_influence
from fringeforce.models.as_built import changes_influence, drawn, loosened
from fringeforce.models.creep import Creep, checked_times, crept_forces
from fringeforce.models.imaging import Calibration
from fringeforce.models.imaging_files import read_calibration, write_calibration
from fringeforce.models.pad_as_built import BuiltPad, built_pad
from fringeforce.models.pad_influence import PadInfluence, Retardance, compressed
from fringeforce.models.pad_knowledge import PadKnowledge
from fringeforce.models.pad_presses import press_slices
from fringeforce.models.pad_slices import block_of
from fringeforce.models.pad_symmetry import PARITIES, load_basis
from fringeforce.models.presses import Presses, are_presses
from fringeforce.models.strain_limit import warn_of_strain
from fringeforce.models.temperature import warm_forces
from fringeforce.optics import camera as camera_optics
from fringeforce.optics.area_camera import Lens, Picture, measure, measure_back, mosaic, pictures
from fringeforce.optics.integrated import double_pass, turn_modes, turn_modes_back
from fringeforce.optics.photoelasticity import stress_optic_constant

Array = NDArray[np.float64]
Single = NDArray[np.float32]

PAD = "pad"
"""Kind of these files."""
LABELS = tuple(
    "_".join("even" if sign > 0 else "odd" for sign in parity) + "_{}" for parity in PARITIES
)
"""Names of the four quarters of the influence by their symmetry."""
SIDE_SAMPLES, SLICES = 96, 8
"""Places along either side, and depths, at which stresses are taken."""


@dataclass(frozen=True, eq=False, repr=False)
class PadModel:
    """What one pad does to forces.

    Images have the shape (rows, columns): rows along y, columns along x, the first of each at the
    most negative coordinate.  Frames of several channels have the shape (channels, rows, columns).
    Forces have the shape (..., n, 3): N, T_x, T_y of tactel ix * count_y + iy [N].

    Attributes
    ----------
    sensor : Pad
        The design it belongs to.
    influence : PadInfluence
        Retardance per force.
    provenance : mapping
        How it came about, in words and numbers.
    calibration : Calibration, optional
        What a calibration found.
    known : PadKnowledge, optional
        What is known together of the tolerances that last; each by itself if not given.
    """

    sensor: Pad
    influence: PadInfluence
    provenance: Mapping[str, str | float] = field(default_factory=dict)
    calibration: Calibration | None = None
    known: PadKnowledge | None = None

    def __repr__(self) -> str:
        """One line."""
        return f"<PadModel of {self.sensor.name!r}>"

    @property
    def frame_shape(self) -> tuple[int, ...]:
        """Shape of a frame: (rows, columns), or (channels, rows, columns) if there are several."""
        return self.sensor.frame_shape

    @property
    def _image(self) -> tuple[int, int]:
        columns, rows = self.sensor.camera.pixels
        return rows, columns

    @cached_property
    def usable(self) -> NDArray[np.bool_]:
        """Pixels that see the pad, those that a calibration found dead excepted, in one row."""
        usable = np.tile(seen_pixels(self.sensor), len(self.pictures))
        if self.calibration is not None:
            usable[list(self.calibration.dead)] = False
        return usable

    @property
    def pixel_positions(self) -> tuple[Array, Array]:
        """Where the camera's pixels look, along x (columns) and along y (rows) [m]."""
        return self.sensor.pixel_positions

    @property
    def slice_heights(self) -> Array:
        """Where the slices lie, shape (slices,) [m]; 0 is the loaded surface, -thickness the base.

        They are those of a Gauss-Legendre rule, the one at the mirror first.
        """
        return block_of(self.sensor).depths(len(self.influence.profile))[0]

    @cached_property
    def pictures(self) -> tuple[Picture, ...]:
        """What the channels measure."""
        return pictures(self.sensor)

    @cached_property
    def kinds(self) -> NDArray[np.uint8]:
        """Which form of a picture each pixel measures, shape (rows * columns,)."""
        return mosaic(*self._image, len(self.pictures[0].forms))

    @cached_property
    def lens(self) -> Lens | None:
        """What blurs the light, if anything does."""
        return Lens.of(self.sensor)

    @cached_property
    def retarding(self) -> Retardance:
        """From forces to the retardance of every depth profile at every pixel."""
        return Retardance.at(self.influence, *self.sensor.pixel_positions)

    @cached_property
    def profile(self) -> Single:
        """What each mode adds to each slice, shape (slices, modes)."""
        return self.influence.profile.astype(np.float32)

    def modes(self, forces: ArrayLike) -> Single:
        """Single-pass retardance of every depth profile at every pixel.

        Parameters
        ----------
        forces : array_like, shape (n, 3)
            N, T_x, T_y of every tactel [N].

        Returns
        -------
        ndarray, shape (2, modes, rows, columns)
            (A, B) of every profile, at the polariscope's wavelength [rad].
        """
        return self.retarding.forward(self.checked(forces, single=True))

    def slices(self, forces: ArrayLike) -> Single:
        """Single-pass retardance of every slice at every pixel, at the polariscope's wavelength.

        Parameters
        ----------
        forces : array_like, shape (n, 3)
            N, T_x, T_y of every tactel [N].

        Returns
        -------
        ndarray, shape (slices, 2, rows, columns)
            (A, B) of every slice, the one at the mirror first [rad].
        """
        return np.asarray(np.einsum("sk,fkrc->sfrc", self.profile, self.modes(forces)))

    def retardance(self, forces: ArrayLike | Presses) -> Array:
        """Depth integral of the retardance over both passes, shape (..., 2, rows, columns) [rad].

        Its two parts are those between 0 and 90 degrees and between 45 and 135; the size is the
        number of fringes times 2 pi where the stress does not turn over the depth.
        """
        if are_presses(forces):
            return self._of_presses(forces, lambda slices: 2 * slices.sum(axis=0))
        loads = self.checked(cast(ArrayLike, forces))
        flat = loads.reshape(-1, *loads.shape[-2:])
        whole = 2 * self.influence.profile.sum(axis=0)
        found = [np.einsum("k,fkrc->frc", whole, self.modes(load)) for load in flat]
        return np.array(found).reshape(*loads.shape[:-2], 2, *self._image)

    def intensity(self, forces: ArrayLike | Presses) -> Array:
        """Share of a perfect dark field's light that each pixel gets, shape (..., *frame_shape).

        Parameters
        ----------
        forces : array_like, shape (..., n, 3), or sequence of Press
            N, T_x, T_y of every tactel [N]; or what really touches, in one frame or, as a sequence
            of such sequences, in several.
        """
        if are_presses(forces):
            return self._of_presses(forces, self._seen)
        loads = self.checked(cast(ArrayLike, forces))
        flat = loads.reshape(-1, *loads.shape[-2:])
        found = [self._intensity(self.modes(load)) for load in flat]
        return np.array(found, dtype=float).reshape(*loads.shape[:-2], *self.frame_shape)

    def _of_presses(self, presses: Sequence[Any], made: Callable[[Array], ArrayLike]) -> Array:
        """What is made of the slices under presses, of one frame or of several."""
        if len(presses) and isinstance(presses[0], Sequence):
            return np.array([self._of_presses(one, made) for one in presses])
        return np.asarray(made(press_slices(self.sensor, presses, *self.pixel_positions)), float)

    def _seen(self, slices: Array) -> Single:
        return self.seen(slices).reshape(self.frame_shape)

    def _intensity(self, modes: Single) -> Single:
        return np.stack([self.picture(modes, picture)[0] for picture in self.pictures])

    def picture(self, modes: Single, picture: Picture) -> tuple[Single, Single]:
        """Intensity of one picture, shape (P,), and the light behind it, shape (3, P)."""
        light = self.light(modes, picture)
        return self.measured(light, picture, self.lens), light

    def seen(self, slices: ArrayLike) -> Single:
        """Intensity of light through slices of any retardance, shape (channels, P).

        Parameters
        ----------
        slices : array_like, shape (slices, 2, rows, columns)
            Single-pass retardance, as of `slices` [rad].
        """
        stack, found = np.asarray(slices, dtype=np.float32), []
        for picture in self.pictures:
            light = double_pass(np.float32(picture.dispersion) * stack)
            flat = np.ascontiguousarray(light.reshape(3, -1), dtype=np.float32)
            found.append(self.measured(flat, picture, self.lens))
        return np.stack(found)

    def light(self, modes: Single, picture: Picture) -> Single:
        """Light at every pixel after both passes, shape (3, P), at the wavelength of a picture."""
        flat = modes.reshape(*modes.shape[:2], -1)
        light = np.empty((3, flat.shape[2]), dtype=np.float32)
        turn_modes(flat, np.float32(picture.dispersion) * self.profile, light)
        return light

    def measured(self, light: Single, picture: Picture, lens: Lens | None) -> Single:
        """Intensity, shape (P,), of light, shape (3, P), behind a lens."""
        if lens is None:
            seen = np.empty(light.shape[1], dtype=np.float32)
            measure(light, picture.packed, self.kinds, seen)
            return seen
        seen = np.empty((len(picture.packed), light.shape[1]), dtype=np.float32)
        for kind, image in enumerate(seen):
            measure(light, picture.packed, np.full_like(self.kinds, kind), image)
        sharp = seen.reshape(-1, *self._image)
        blurred = lens.forward(sharp).reshape(seen.shape)
        return np.take_along_axis(blurred, self.kinds[None], axis=0)[0]

    def picture_adjoint(
        self,
        modes: Single,
        picture: Picture,
        light: Single,
        pull: Single,
        lens: Lens | None = None,
    ) -> Single:
        """Derivative by the modes, same shape, from that by the intensity of one picture, (P,).

        The lens is the model's own if none is given.
        """
        flat, lens = modes.reshape(*modes.shape[:2], -1), lens or self.lens
        by_light = np.zeros_like(light)
        if lens is None:
            measure_back(light, picture.packed, self.kinds, pull, by_light)
        else:
            for kind in range(len(picture.packed)):
                share = np.where(self.kinds == kind, pull, np.float32(0)).reshape(self._image)
                sharp = lens.adjoint(share).ravel()
                measure_back(light, picture.packed, np.full_like(self.kinds, kind), sharp, by_light)
        gradient, profile = np.empty_like(flat), np.float32(picture.dispersion) * self.profile
        turn_modes_back(flat, profile, light, by_light, gradient)
        return gradient.reshape(modes.shape)

    def expose(
        self,
        forces: ArrayLike | Presses,
        rng: camera_optics.Rng = None,
        as_built: camera_optics.Rng = None,
        temperature: ArrayLike | None = None,
        times: ArrayLike | None = None,
    ) -> NDArray[np.unsignedinteger]:
        """Frames that the camera would deliver, shape (..., *frame_shape), uint8 or uint16.

        Parameters
        ----------
        forces : array_like, shape (..., n, 3), or sequence of Press
            N, T_x, T_y of every tactel [N], or what really touches, as of `intensity`.
        rng : int, numpy.random.Generator or None
            Source of the noise, and of light that drifts.
        as_built : int or numpy.random.Generator, optional
            Source of one pad, drawn from the tolerances of the design, that all frames are of; the
            pad as drawn if not given.
        temperature : array_like, shape () or (...), optional
            Of the photoelastic layer, for all frames or each [K]; that of the design if not given.
        times : array_like, shape (F,), optional
            When the frames are exposed [s].  Loads change linearly from one to the next, nothing
            acted before the first, and a pad that relaxes creeps; without them it does not.

        Warns
        -----
        LargeStrainWarning
            If loads strain the cover further than small strain holds.
        """
        warn_of_strain(self.sensor, forces)
        if as_built is not None:
            built = self.as_built(as_built)
            return built.expose(forces, rng, temperature=temperature, times=times)
        camera, axes = self.sensor.camera, len(self.frame_shape)
        if times is not None and are_presses(forces):
            warm_forces(self.sensor, forces, temperature)  # refuses a temperature
            light = self._creeping(forces, times)
        else:
            shown = crept_forces(self.sensor, forces, times)
            light = self.intensity(warm_forces(self.sensor, shown, temperature))
        return camera_optics.expose(camera, light, rng, frame_axes=axes)

    def _creeping(self, presses: Sequence[Any], times: ArrayLike) -> Array:
        """Light of presses in frames in a row, shape (F, *frame_shape), as the pad creeps."""
        own = checked_times(times, len(presses))
        if not all(isinstance(frame, Sequence) for frame in presses):
            raise InputError("times go with frames in a row; give a list of presses for each.")
        slices = (press_slices(self.sensor, frame, *self.pixel_positions) for frame in presses)
        creep = Creep.of(self.sensor.transducer)
        found = [self._seen(one + added) for one, added in creep.each(own, slices)]
        return np.array(found, dtype=float)

    def as_built(self, rng: camera_optics.Rng = None) -> BuiltPad:
        """Draw one real pad from the tolerances of the design.

        Parameters
        ----------
        rng : int, numpy.random.Generator or None
            Source of the draws.
        """
        generator = np.random.default_rng(rng)
        pad = drawn(self.sensor, generator)
        samples = len(self.influence.x), len(self.influence.profile)
        anew = changes_influence(self.sensor.tolerances)
        model = characterize_pad(pad, None, *samples) if anew else replace(self, sensor=pad)
        return built_pad(self.sensor, model, generator)

    def with_tolerances(self, **stated: Any) -> PadModel:
        """The same model with other tolerances, which readings allow for.

        Parameters
        ----------
        **stated
            Values of the design by dotted path, as of `Pad.replace`:
            ``with_tolerances(**{"camera.shift_x": "0 +/- 0.05 mm"})``.

        Raises
        ------
        DesignError
            If the design does not have such a value.
        InputError
            If a value changes on which the influence depends.

        Examples
        --------
        >>> pad = ff.load_sensor("pad").replace(tactels={"count": [2, 2]})
        >>> loose = ff.characterize(pad).with_tolerances(**{"camera.drift": "1 %"})
        >>> loose.sensor.camera.drift
        0.01
        """
        return replace(self, sensor=loosened(self.sensor, stated))

    def as_skin(self) -> PadModel:
        """The same pad as a skin, which reads contacts anywhere in the place of forces on tactels.

        What a calibration found, and what it left uncertain, is the same.

        Raises
        ------
        DesignError
            If the pad cannot have a skin: its sides are not rollers, or its strain is finite.

        Examples
        --------
        >>> pad = ff.load_sensor("pad").replace(tactels={"count": [2, 2]})
        >>> ff.characterize(pad).as_skin().sensor.skin.extent
        (0.025, 0.025)
        """
        pad, block, influence = self.sensor, self.sensor.transducer, self.influence
        own = {path: s for path, s in pad.tolerances.items() if not path.startswith("tactels.")}
        skin = {"extent": [block.length, block.width]}
        made = pad.model_copy(update={"tolerances": Tolerances(own)}).replace(skin=skin)
        found = characterize_pad(made, None, len(influence.x), len(influence.profile))
        return replace(found, calibration=self.calibration, known=self.known)

    def checked(self, forces: ArrayLike, single: bool = False) -> Array:
        """Forces as floats of shape (..., n, 3); InputError if they are another pad's."""
        loads = checked_loads(forces, self.sensor.tactels.total, 3)
        if (single and loads.ndim > 2) or not np.isfinite(loads).all():
            raise InputError(
                f"Forces of shape {loads.shape} are those of several frames, or are not finite; "
                f"give {loads.shape[-2:]} finite ones."
            )
        return loads

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the model to an HDF5 file, all of it or nothing; `fringeforce.load_model` reads it.

        It holds the design, the provenance, and the compressed influence.
        """
        influence = self.influence
        slices, modes = influence.profile.shape
        with new_file(path, PAD) as file:
            file.attrs["design"] = self.sensor.to_toml()
            file.attrs["provenance"] = json.dumps(dict(self.provenance))
            write(file, "x", influence.x, ("x",), "m", "samples along the pad")
            write(file, "y", influence.y, ("y",), "m", "samples across the pad")
            write(file, "slice", np.arange(slices), ("slice",), None, "from the mirror to the base")
            heights = self.slice_heights
            write(file, "height", heights, ("slice",), "m", "of slices; the loaded surface is 0")
            write(file, "mode", np.arange(modes), ("mode",), None, "number of the depth profile")
            write(file, "profile", influence.profile, ("slice", "mode"), "1", "depth profiles")
            for label, quarter in zip(LABELS, influence.quarters, strict=True):
                name = label.format("influence")
                file.create_dataset(name, data=quarter)
                file[name].attrs["long_name"] = "spline coefficients of retardance per load"
                file[name].attrs["units"] = "rad/N"
            if self.calibration is not None:
                write_calibration(file, self.calibration)
            if self.known is not None:
                self.known.write(file)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> PadModel:
        """Read a model that `save` wrote.

        Raises
        ------
        FileFormatError
            If the file is missing, truncated, of another kind, or damaged.
        """
        with existing_file(path, PAD) as file:
            pad = parse_sensor(text(file, "design"), source=f"The design inside {path}")
            provenance = json.loads(text(file, "provenance"))
            x, y, profile = (read(file, name) for name in ("x", "y", "profile"))
            quarters = tuple(read(file, label.format("influence")) for label in LABELS)
            calibration, known = read_calibration(file), PadKnowledge.read(file)
        rows = 2 * profile.shape[1] * (len(x) // 2) * (len(y) // 2)
        expected = (
            [(rows, len(load_basis(pad.tactels.count, parity))) for parity in PARITIES]
            if pad.kind == "pad"
            else []
        )
        if [quarter.shape for quarter in quarters] != expected:
            raise FileFormatError(
                f"{path} is damaged: its influence does not fit its design. Characterise it again."
            )
        influence = PadInfluence(pad.tactels.count, x, y, profile, quarters)
        return cls(pad, influence, provenance, calibration, known)


def seen_pixels(pad: Pad) -> NDArray[np.bool_]:
    """Pixels of a picture that see the pad, in one row, shape (rows * columns,)."""
    ends = pad.transducer.length / 2, pad.transducer.width / 2
    x, y = (np.abs(looks) <= end for looks, end in zip(pad.pixel_positions, ends, strict=True))
    return np.asarray(np.outer(y, x).ravel(), dtype=bool)


def characterize_pad(
    pad: Pad,
    influence: SolidInfluence | None = None,
    samples: int = SIDE_SAMPLES,
    slices: int = SLICES,
    progress: Progress | None = None,
) -> PadModel:
    """Reduce a design to its influence: an exact series, with elements where sides are not rollers.

    Parameters
    ----------
    pad : Pad
        The design.
    influence : SolidInfluence, optional
        Stresses per force where they are known already, such as from finite elements.
    samples, slices : int
        Places along either side, an even number, and depths, at which stresses are computed.
    progress : callable, optional
        Told words, the steps done and their count, where elements are solved.
    """
    block, layer = block_of(pad), pad.transducer.photoelastic
    constant = stress_optic_constant(layer, pad.polariscope.wavelength)
    if influence is None and block.sides == "roller":
        method = "double Fourier series"
        solved = _between_rollers(block, pad.tactels, samples, slices, constant)
    else:
        method = "given"
        if influence is None:
            method = "double Fourier series, and finite elements for the sides"
            patches = Patches(pad.tactels.places, pad.tactels.side)
            places = _samples(block, samples)
            influence = sided_influence(block, patches, *places, slices, progress=progress)
        solved = compressed(influence, pad.tactels.count, constant)
    found, left_out, asymmetry = solved
    provenance = {
        "method": method,
        "samples": f"{len(found.x)} x {len(found.y)}",
        "slices": len(found.profile),
        "depth profiles": found.modes,
        "left out by depth profiles": left_out,
        "asymmetry averaged away": asymmetry,
    }
    return PadModel(pad, found, provenance)


@lru_cache(maxsize=2)
def _between_rollers(
    block: Block, tactels: PadTactels, samples: int, slices: int, constant: float
) -> tuple[PadInfluence, float, float]:
    """What the series finds; kept, for pads of other cameras and light have the same stresses."""
    patches = Patches(tactels.places, tactels.side)
    stresses = stress_influence(block, patches, *_samples(block, samples), slices)
    return compressed(stresses, tactels.count, constant)


def _samples(block: Block, samples: int) -> tuple[Array, Array]:
    """Places along x and along y at which stresses are computed."""
    x, y = (np.linspace(-side / 2, side / 2, samples) for side in (block.length, block.width))
    return x, y
