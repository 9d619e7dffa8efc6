"""What a person decides about a planar pad: validated, immutable, in SI units and radians.

Axes: x along the pad and the rows of an image, y across it and down the columns, both from the
middle; z upwards from the loaded surface.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from fringeforce.base.arrays import Array
from fringeforce.design.fields import Angle, Extent, Finite, Length, Percent, Place, Visibility
from fringeforce.design.light import Plates
from fringeforce.design.light_sources import Wavelength
from fringeforce.design.parts import (
    Converter,
    Design,
    Layer,
    Part,
    PhotoelasticLayer,
    Relaxation,
    RelaxationTerm,
    check_thickness,
)
from fringeforce.design.strip import Section, Transducer


def _pair(value: Any) -> tuple[int, int]:
    numbers = np.asarray(value, dtype=object)
    whole = all(isinstance(n, int | np.integer) and not isinstance(n, bool) for n in numbers.flat)
    if numbers.shape != (2,) or not whole or min(numbers) < 1:
        raise ValueError("must be two whole numbers of 1 or more, such as [11, 11]")
    return int(numbers[0]), int(numbers[1])


Pair = Annotated[tuple[int, int], BeforeValidator(_pair)]


def _two(value: Any) -> Any:
    if isinstance(value, str) or np.shape(value) != (2,):
        raise ValueError('must be two lengths, such as ["22 mm", "22 mm"]')
    return tuple(value)


Sides = Annotated[tuple[Length, Length], BeforeValidator(_two)]
"""Lengths along x and y [m]."""


WIDEST = 500.0
"""Longest side of a pad in thicknesses of its cover: the series of its stresses has 4.4 waves for
each, along x and along y, and six numbers for every pair of waves and slice."""


class PadTransducer(Part):
    """The block: a compliant cover on a photoelastic layer that is bonded to a rigid base."""

    length: Length = Field(description="side along x [m]")
    width: Length = Field(description="side along y [m]")
    sides: Literal["free", "bonded", "roller"] = Field(
        description='all four: "free", "bonded", or "roller", which no side leaves but slides along'
    )
    strain: Literal["linear", "finite"] = Field(
        default="linear",
        description='"linear" for small loads; with "finite" deviations of forces on tactels allow '
        "for what large strain changes",
        json_schema_extra={"ideal": True},
    )
    relaxation: Relaxation = Field(
        default=(),
        description='of both layers alike: [["6 %", "0.4 s"], ["4 %", "15 s"]], or tables of share '
        "and time, whose shares may have tolerances",
        json_schema_extra={"ideal": True},
    )
    compliant: Layer
    photoelastic: PhotoelasticLayer

    @property
    def relaxations(self) -> tuple[tuple[RelaxationTerm, ...], tuple[RelaxationTerm, ...]]:
        """Terms of the compliant and of the photoelastic layer."""
        return self.relaxation, self.relaxation

    @property
    def solved_in_a_plane(self) -> bool:
        """Whether a plane model of the block can be solved for contacts anywhere: it has none."""
        return False

    @model_validator(mode="after")
    def _has_layers_of_its_size(self) -> PadTransducer:
        longest, cover = max(self.length, self.width), self.compliant.thickness
        check_thickness(longest, self.compliant, self.photoelastic)
        if longest > WIDEST * cover:
            raise ValueError(
                f"compliant.thickness = {cover * 1e3:.4g} mm is less than 1/{WIDEST:g} of the "
                f"longest side, {longest * 1e3:.4g} mm, which takes more waves than fit in memory; "
                "are both units right?"
            )
        return self

    @model_validator(mode="after")
    def _relaxes_as_one(self) -> PadTransducer:
        if self.compliant.relaxation or self.photoelastic.relaxation:
            raise ValueError(
                "layers that relax unlike are of strips; state transducer.relaxation, of both "
                "layers of a pad alike"
            )
        if self.strain == "finite" and (self.relaxation or self.photoelastic.optical_creep):
            raise ValueError(
                'a pad creeps under strain = "linear"; leave "finite" out, or relaxation and '
                "optical_creep"
            )
        return self


class PadTactels(Part):
    """Where forces act: squares under a uniform traction, in rows and columns about the centre."""

    count: Pair = Field(description="number along x and along y")
    pitch: Length = Field(description="distance between neighbours, along x and y [m]")
    size: Length | None = Field(
        default=None,
        description="side of a square [m]; the pitch if not given.  Its tolerance says how wide "
        "the tractions on the squares are, along x and along y, anew in every frame",
        json_schema_extra={"unit": "meter"},
    )
    placement: Place = Field(
        default=0.0,
        description="how far from the middles of their squares the tractions act [m]; only with a "
        "tolerance about 0, along x and along y, anew in every frame",
        json_schema_extra={"ideal": True, "unit": "meter"},
    )

    @model_validator(mode="after")
    def _apart(self) -> PadTactels:
        if self.placement:
            raise ValueError(
                f"placement = {self.placement * 1e3:g} mm: tactels of a pad stand where they are "
                'drawn; state a tolerance about 0, such as "0 +/- 0.1 mm"'
            )
        if self.side > self.pitch * (1 + 1e-12):
            raise ValueError(
                f"squares of {self.side * 1e3:g} mm overlap at a pitch of {self.pitch * 1e3:g} mm; "
                "take a smaller size or a larger pitch"
            )
        return self

    @property
    def side(self) -> float:
        """Side of a square [m]."""
        return self.pitch if self.size is None else self.size

    @property
    def total(self) -> int:
        """Number of tactels."""
        return self.count[0] * self.count[1]

    @property
    def places(self) -> Array:
        """Centres along x and y, shape (total, 2) [m]; tactel ix * count[1] + iy."""
        x, y = ((np.arange(n) - (n - 1) / 2) * self.pitch for n in self.count)
        grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
        return np.asarray(grid.reshape(-1, 2), dtype=np.float64)


SQUARES = 4.0
"""Side of the squares in which forces on a skin are stated, in thicknesses of the cover."""


class PadSkin(Part):
    """Where contacts land anywhere, in the place of tactels."""

    extent: Sides = Field(
        description="lengths of the skin along x and along y, centred on the pad [m]",
        json_schema_extra={"unit": "meter"},
    )
    friction: Finite = Field(default=1.0, gt=0, description="largest |tangential| / normal force")
    resolution: Length | None = Field(
        default=None,
        description="side of the squares in which forces are stated [m]; four times the cover's "
        "thickness if not given",
        json_schema_extra={"unit": "meter"},
    )

    def squares(self, cover: float) -> PadTactels:
        """Squares all over it, for a cover of some thickness [m]."""
        side = SQUARES * cover if self.resolution is None else self.resolution
        pitch = min(self.extent) / max(round(min(self.extent) / side), 1)
        x, y = (int(length / pitch * (1 + 1e-9)) for length in self.extent)
        return PadTactels(count=(x, y), pitch=pitch)


def _squares(data: dict[str, Any]) -> PadTactels:
    """Squares of the skin that a design has."""
    skin, transducer = data.get("skin"), data.get("transducer")
    if skin is None and "skin" in data:
        raise PydanticCustomError(
            "no_tactels",
            "say where forces act: give a table of tactels, or a skin for contacts anywhere",
        )
    if skin is None or transducer is None:  # has problems of its own
        return PadTactels(count=(1, 1), pitch=1e-3)
    return skin.squares(transducer.compliant.thickness)


class PadChannel(Part):
    """One picture of the pad among those that are taken together."""

    wavelength: Wavelength | None = Field(
        default=None,
        description='wavelength in vacuum [m], or a light source such as "red LED", of which '
        "pads take the wavelength alone; that of the polariscope if not given",
        json_schema_extra={"unit": "meter"},
    )
    arrangement: Literal["dark field", "bright field", "plane", "analyser"] | None = Field(
        default=None,
        description="polarisers and plates; dark field if not given.  A polarisation camera "
        "brings its own analysers and is lit with circular light",
    )
    angle: Finite = Field(default=0.0, description="of polariser or analyser, from x [degrees]")


class PadPolariscope(Part):
    """The light, the polarisers and the pictures that are taken together."""

    wavelength: Wavelength = Field(
        description='wavelength in vacuum [m], or a light source such as "red LED", of which '
        "pads take the wavelength alone",
    )
    channels: tuple[PadChannel, ...] = Field(
        default=(), description="pictures that make up one frame; one if not given"
    )
    plates: Plates | None = Field(
        default=None, description="errors of polarisers and plates; perfect ones if not given"
    )
    visibility: Visibility = Field(
        default=1.0,
        description="of fringes: 1 - visibility of the light has lost its polarisation",
        json_schema_extra={"ideal": True},
    )
    residual: Angle = Field(
        default=0.0,
        description="retardance over both passes without load [rad]; only with a tolerance about "
        "0, the standard deviation of the smooth random fields of its two parts, A and B",
        json_schema_extra={"ideal": True},
    )
    residual_length: Length = Field(
        default=5e-3,
        description="correlation length of the residual [m]",
        json_schema_extra={"ideal": True, "unit": "meter"},
    )

    @model_validator(mode="before")
    @classmethod
    def _without_crosstalk(cls, values: Any) -> Any:
        if isinstance(values, Mapping) and "crosstalk" in values:
            raise ValueError(
                "has a crosstalk, which readings of pads do not allow for; it is for strips with "
                "several channels: leave it out"
            )
        return values

    @model_validator(mode="after")
    def _without_mean(self) -> PadPolariscope:
        if self.residual:
            raise ValueError(
                f"residual = {self.residual:g} rad: the residual of a pad has a direction at every "
                'place; state a tolerance about 0, such as "0 +/- 0.1 rad"'
            )
        return self

    @property
    def pictures(self) -> tuple[PadChannel, ...]:
        """The channels, at least one."""
        return self.channels or (PadChannel(),)


class AreaCamera(Converter):
    """The camera below the pad; its picture ends where the pad ends."""

    pixels: Pair = Field(description="pixels along x and along y")
    kind: Literal["ordinary", "polarisation"] = Field(
        default="ordinary",
        description='"polarisation" has analysers at 0 and 45 degrees before the pixels of even '
        "rows in turn, at 135 and 90 degrees before those of odd rows",
    )
    unevenness: Percent = Field(
        default=0.0,
        description="relative standard deviation of the light over the picture, a smooth random "
        'field, such as "3 %"',
        json_schema_extra={"ideal": True},
    )
    blur: Extent | None = Field(
        default=None,
        description="standard deviation of the lens's point spread, on the pad [m]; none if not "
        "given",
        json_schema_extra={"unit": "meter"},
    )
    shift_x: Place = Field(
        default=0.0,
        description="how far along x the pixels look beside where they are drawn [m]",
        json_schema_extra={"ideal": True, "unit": "meter"},
    )
    shift_y: Place = Field(
        default=0.0,
        description="the same along y [m]",
        json_schema_extra={"ideal": True, "unit": "meter"},
    )
    scale: Finite = Field(
        default=1.0,
        gt=0,
        description="distance between pixels on the pad over that of the drawing",
        json_schema_extra={"ideal": True},
    )


class Pad(Design):
    """A complete planar pad, from block to camera.

    Every number is an SI float; in `Pad(...)` and `replace` a quantity may also be given as text
    with a unit.
    """

    kind: Literal["pad"] = "pad"
    components: ClassVar = ("normal", "tangential_x", "tangential_y")
    rivals: ClassVar = {"skin": "tactels", "tactels": "skin"}
    name: str
    transducer: PadTransducer
    skin: PadSkin | None = Field(
        default=None,
        description="contacts anywhere, in the place of tactels; none if not given",
        json_schema_extra={"ideal": True},
    )
    tactels: PadTactels = Field(
        default_factory=_squares,
        validate_default=True,
        description="where forces act; of a skin, the squares in which they are stated",
    )
    polariscope: PadPolariscope
    camera: AreaCamera

    @property
    def section(self) -> Section:
        """Along the shorter side, in plane strain, as under rows of equal contacts."""
        pad, tactels = self.transducer, self.tactels
        block = Transducer(
            length=pad.length,
            width=tactels.side,
            edges="roller" if pad.sides == "roller" else "free",
            plane="strain",
            compliant=pad.compliant,
            photoelastic=pad.photoelastic,
        )
        return Section(block, min(tactels.count), tactels.pitch, tactels.side)

    @property
    def derived(self) -> frozenset[str]:
        """Tables that follow from others: the squares of a skin."""
        return frozenset() if self.skin is None else frozenset(["tactels"])

    @model_validator(mode="after")
    def _tactels_or_skin(self) -> Pad:
        if self.skin is None:
            return self
        if "tactels" in self.model_fields_set:
            raise ValueError(
                "has both tactels and a skin; give tactels for forces at certain places, or a skin "
                "for contacts anywhere"
            )
        block, extent = self.transducer, self.skin.extent
        if block.strain == "finite":
            raise ValueError(
                'skin: readings of skins are of small strain; take strain = "linear", or tactels'
            )
        for axis, own, side in zip("xy", extent, (block.length, block.width), strict=True):
            if own > side * (1 + 1e-9):
                raise ValueError(
                    f"skin: an extent of {own * 1e3:g} mm along {axis} reaches beyond the pad's "
                    f"{side * 1e3:g} mm; take a smaller skin or a larger pad"
                )
        if block.sides != "roller":
            raise ValueError(
                f'skin: contacts anywhere need sides = "roller", not "{block.sides}": their light '
                "is that of the exact series"
            )
        return self

    @model_validator(mode="after")
    def _looks_at_itself(self) -> Pad:
        """Refuse a camera of which no pixel sees the pad."""
        camera, block = self.camera, self.transducer
        looking = ("x", camera.shift_x, block.length), ("y", camera.shift_y, block.width)
        for axis, shift, side in looking:
            if abs(shift) - camera.scale * side / 2 >= side / 2:
                raise ValueError(
                    f"the camera looks beside the pad: shift_{axis} = {shift * 1e3:g} mm, and the "
                    f"pad's sides are {side / 2 * 1e3:g} mm from its middle; state where it looks"
                )
        return self

    @model_validator(mode="after")
    def _fits(self) -> Pad:
        tactels, block = self.tactels, self.transducer
        for axis, n, side in zip("xy", tactels.count, (block.length, block.width), strict=True):
            reach = (n - 1) * tactels.pitch + tactels.side
            if reach > side * (1 + 1e-9):
                raise ValueError(
                    f"tactels: {n} squares at a pitch of {tactels.pitch * 1e3:g} mm reach over "
                    f"{reach * 1e3:g} mm along {axis}, beyond the pad's {side * 1e3:g} mm; take "
                    "fewer tactels, a smaller pitch or a larger pad"
                )
        own = [c for c in self.polariscope.pictures if c.arrangement is not None]
        if self.camera.kind == "polarisation" and own:
            raise ValueError(
                f"polariscope.channels: arrangement = {own[0].arrangement!r} does not go with a "
                "polarisation camera, which brings its own analysers; leave it out, or take an "
                "ordinary camera"
            )
        return self

    @property
    def frame_shape(self) -> tuple[int, ...]:
        """Shape of a frame: (rows, columns), or (channels, rows, columns) if there are several."""
        channels, image = len(self.polariscope.pictures), self.camera.pixels[::-1]
        return image if channels == 1 else (channels, *image)

    @property
    def noise(self) -> Array:
        """Noise of all channels, shape (1,), grey levels."""
        return np.array([self.camera.noise])

    @property
    def pixel_positions(self) -> tuple[Array, Array]:
        """Where the pixels look, along x (columns) and along y (rows) [m]."""
        sides, camera = (self.transducer.length, self.transducer.width), self.camera
        x, y = (
            shift + camera.scale * ((np.arange(n) + 0.5) / n - 0.5) * side
            for shift, n, side in zip(
                (camera.shift_x, camera.shift_y), camera.pixels, sides, strict=True
            )
        )
        return x, y
