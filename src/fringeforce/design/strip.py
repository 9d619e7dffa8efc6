"""What a person decides about a sensor: validated, immutable, in SI units and radians."""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from fringeforce.base.arrays import Array
from fringeforce.design.fields import (
    Count,
    Extent,
    Finite,
    Length,
    Percent,
    Place,
    Places,
)
from fringeforce.design.light import Camera, Polariscope
from fringeforce.design.parts import (
    Design,
    Layer,
    Part,
    PhotoelasticLayer,
    Relaxation,
    RelaxationTerm,
    check_thickness,
)

SURELY = 3.5
"""Standard deviations of shift and scale up to which a pixel has to see the strip to be used."""
Plane = Literal["stress", "strain", "3d", "given"]
"""What a strip is modelled in."""


class Transducer(Part):
    """The strip: a compliant cover on a photoelastic layer that is bonded to a rigid base."""

    length: Length = Field(description="full length c along x [m]")
    width: Length = Field(description="width t along y [m]")
    edges: Literal["free", "roller"] = Field(
        description='lateral edges: "free" (Case 1) or "roller", u = 0 without friction (Case 2)'
    )
    plane: Plane = Field(
        default="stress",
        description='"stress" for narrow strips, "strain" for wide ones, "3d" for any width, '
        '"given" where the influence matrix was given and the layers say nothing',
    )
    strain: Literal["linear", "finite"] = Field(
        default="linear",
        description='"linear" for small loads; "finite" for hyperelastic layers under large '
        "strain, in a plane, with contacts of some width or a skin",
        json_schema_extra={"ideal": True},
    )
    loads: Literal["dead", "follower"] = Field(
        default="dead",
        description='under large strain: "dead" tractions keep their direction, "follower" ones '
        "turn with the surface that they press; forces are then normal and tangential to the line "
        "between the ends of each deformed contact, on a skin to the surface at each place",
        json_schema_extra={"ideal": True},
    )
    influence_error: Percent = Field(
        default=0.0,
        description="relative standard deviation of smooth errors in the shape of the influence "
        'matrix, such as "3 %" for a strip that was never calibrated',
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

    @model_validator(mode="after")
    def _has_layers_of_its_size(self) -> Self:
        if self.plane != "given":
            check_thickness(max(self.length, self.width), self.compliant, self.photoelastic)
        return self

    @model_validator(mode="after")
    def _relaxes_as_one_model_knows(self) -> Self:
        unlike = self.compliant.relaxation or self.photoelastic.relaxation
        if self.relaxation and unlike:
            raise ValueError(
                "has a relaxation of both layers and one of a single layer; state both layers' "
                "terms in their own tables"
            )
        changing = self.relaxation or unlike or self.photoelastic.optical_creep
        if changing and not self.solved_in_a_plane:
            raise ValueError('relaxation takes plane = "stress" or "strain"; leave it out')
        if self.strain == "finite" and (refused := self.large_creep_refusal):
            raise ValueError(refused)
        return self

    @model_validator(mode="after")
    def _follows_large_strain(self) -> Self:
        if self.loads == "follower" and self.strain == "linear":
            raise ValueError(
                'loads = "follower" turns with a surface that strain = "linear" leaves as it is; '
                'take strain = "finite", or leave loads out'
            )
        return self

    @property
    def small_strain(self) -> Self:
        """The same strip of small strain."""
        return self.model_copy(update={"strain": "linear", "loads": "dead"})

    @property
    def relaxations(self) -> tuple[tuple[RelaxationTerm, ...], tuple[RelaxationTerm, ...]]:
        """Terms of the compliant and of the photoelastic layer."""
        if self.relaxation:
            return self.relaxation, self.relaxation
        return self.compliant.relaxation, self.photoelastic.relaxation

    @property
    def large_creep_refusal(self) -> str:
        """Why large strain does not creep as this strip does; empty if it does, or nothing creeps.

        Strains under loads that last are those of loads with their lags where all stresses relax
        by one factor.
        """
        clear, (one, other) = self.photoelastic, self.relaxations
        by_strain = clear.effect == "strain_optic_coefficient"
        if not (one or other or clear.optical_creep):
            return ""
        if by_strain and one == other and not clear.optical_creep:
            return ""
        return (
            'relaxation under strain = "finite" takes the same terms of both layers and the '
            "strain-optic law, without optical_creep; state transducer.relaxation and "
            'strain_optic_coefficient, or take strain = "linear"'
        )

    @property
    def solved_in_a_plane(self) -> bool:
        """Whether a plane model of the strip can be solved for contacts anywhere."""
        return self.plane in ("stress", "strain")


class Tactels(Part):
    """Where forces act: line loads, evenly spaced and centred on the strip, or placed singly."""

    count: Count = Field(description="number of tactels")
    pitch: Length = Field(description="distance between neighbours, of the drawing [m]")
    # the key of a design is `positions`; the attribute of that name always has a place for each
    placed: Places | None = Field(
        default=None,
        alias="positions",
        description="single places along x, ascending [m]; without them the pitch says where",
        json_schema_extra={"unit": "meter"},
    )
    placement: Place = Field(
        default=0.0,
        description="how far beside its tactel each contact lands [m]; its tolerance is drawn anew "
        "with every contact",
        json_schema_extra={"ideal": True, "unit": "meter"},
    )
    contact_width: Extent = Field(
        default=0.0,
        description="width of each contact, under a uniform traction [m]; 0 is a line.  Its "
        "tolerance is drawn anew with every contact; calibration takes lines",
        json_schema_extra={"ideal": True, "unit": "meter"},
    )

    @model_validator(mode="after")
    def _ascending(self) -> Tactels:
        if self.placed is None:
            return self
        if len(self.placed) != self.count:
            raise ValueError(
                f"{len(self.placed)} positions do not fit count = {self.count}; give one for every "
                "tactel, or none and the pitch alone"
            )
        if (np.diff(self.placed) <= 0).any():
            number = int(np.flatnonzero(np.diff(self.placed) <= 0)[0]) + 1
            raise ValueError(
                f"positions must ascend: tactel {number + 1} at {self.placed[number] * 1e3:g} mm "
                f"does not lie right of tactel {number} at {self.placed[number - 1] * 1e3:g} mm; "
                "sort them"
            )
        return self

    @property
    def positions(self) -> Array:
        """Places of the tactels along x, shape (count,) [m]."""
        if self.placed is not None:
            return np.array(self.placed)
        return (np.arange(self.count, dtype=np.float64) - (self.count - 1) / 2) * self.pitch

    @property
    def total(self) -> int:
        """Number of tactels."""
        return self.count

    @property
    def places(self) -> Array:
        """Places of the tactels along x, shape (total, 1) [m]."""
        return self.positions[:, None]


LINES = 0.2
"""Distance between the line loads of a skin, in thicknesses of the cover: what is narrower than the
cover is thick does not pass through it."""
BEYOND = 2.0
"""How far line loads go on beyond each end of a skin, where the strip does, in thicknesses of the
cover: half the width of the widest contact that is read with its middle on an end."""


class Skin(Part):
    """Where contacts land anywhere, in the place of tactels."""

    extent: Length = Field(description="length of the skin along x, centred on the strip [m]")
    friction: Finite = Field(default=1.0, gt=0, description="largest |tangential| / normal force")
    resolution: Length | None = Field(
        default=None,
        description="distance between the places at which tractions are stated [m]; a fifth of the "
        "cover's thickness if not given",
        json_schema_extra={"unit": "meter"},
    )

    def lines(self, transducer: Transducer) -> Tactels:
        """Line loads all over it, and beyond its ends for contacts that lie across them."""
        cover = transducer.compliant.thickness
        spacing = LINES * cover if self.resolution is None else self.resolution
        count = max(round(self.extent / spacing), 5)
        pitch = self.extent / count
        room = int((transducer.length - self.extent) / 2 / pitch) - 1
        beyond = max(min(round(BEYOND * cover / pitch), room), 0)
        return Tactels(count=count + 1 + 2 * beyond, pitch=pitch)


def _lines(data: dict[str, Any]) -> Tactels:
    """Line loads of the skin that a design has."""
    skin, transducer = data.get("skin"), data.get("transducer")
    if skin is None and "skin" in data:
        raise PydanticCustomError(
            "no_tactels",
            "say where forces act: give a table of tactels, or a skin for contacts anywhere",
        )
    if skin is None or transducer is None:  # has problems of its own
        return Tactels(count=1, pitch=1e-3)
    return skin.lines(transducer)


def _light(polariscope: Polariscope, camera: Camera) -> tuple[list[float], ...]:
    """Amplitude, offset and noise of every channel: its own, or those of the camera."""
    return tuple(
        [
            getattr(camera if getattr(one, name) is None else one, name)
            for one in polariscope.pictures
        ]
        for name in ("amplitude", "offset", "noise")
    )


class Section(NamedTuple):
    """A section through neighbouring contacts, solved in a plane.

    Attributes
    ----------
    block : Transducer
        The layers and their edges, in a plane.
    contacts : int
        Their number, beside each other.
    pitch : float
        Distance between them [m].
    width : float
        Width of each [m].
    """

    block: Transducer
    contacts: int
    pitch: float
    width: float


class Sensor(Design):
    """A complete sensor, from strip to camera.

    Numbers are SI floats; `Sensor(...)` and `replace` also take text with a unit.

    Examples
    --------
    >>> ff.load_sensor("saad").replace(**{"transducer.width": "3 mm"}).transducer.width
    0.003
    """

    kind: ClassVar[Literal["strip"]] = "strip"
    components: ClassVar = ("normal", "tangential")
    rivals: ClassVar = {"skin": "tactels", "tactels": "skin"}
    name: str = Field(description="what to call the sensor")
    transducer: Transducer
    skin: Skin | None = Field(
        default=None,
        description="contacts anywhere, in the place of tactels; none if not given",
        json_schema_extra={"ideal": True},
    )
    tactels: Tactels = Field(
        default_factory=_lines,
        validate_default=True,
        description="where forces act; of a skin, line loads all over it",
    )
    polariscope: Polariscope
    camera: Camera

    @property
    def small_strain(self) -> Self:
        """The same sensor of small strain."""
        return self.model_copy(update={"transducer": self.transducer.small_strain})

    @property
    def section(self) -> Section:
        """Contacts as wide as stated, or as the cover is thick; of a skin, side by side."""
        block, tactels = self.transducer, self.tactels
        width = tactels.contact_width or block.compliant.thickness
        if self.skin is not None:
            return Section(block, max(int(self.skin.extent / width), 1), width, width)
        return Section(block, tactels.count, tactels.pitch, width)

    @property
    def derived(self) -> frozenset[str]:
        """Tables that follow from others: the line loads of a skin."""
        return frozenset() if self.skin is None else frozenset(["tactels"])

    @model_validator(mode="after")
    def _tactels_or_skin(self) -> Self:
        if self.skin is not None and "tactels" in self.model_fields_set:
            raise ValueError(
                "has both tactels and a skin; give tactels for forces at certain places, or a skin "
                "for contacts anywhere"
            )
        return self

    @field_validator("tactels", mode="after")
    @classmethod
    def _on_the_strip(cls, tactels: Tactels, info: ValidationInfo) -> Tactels:
        transducer = info.data.get("transducer")
        if transducer is None:
            return tactels
        outermost, half = np.abs(tactels.positions).max(), transducer.length / 2
        if outermost >= half:
            single = tactels.placed is not None
            kind = "" if single else f" at a pitch of {tactels.pitch * 1e3:g} mm"
            remedy = "positions nearer to it" if single else "a smaller pitch"
            raise ValueError(
                f"the outermost of {tactels.count} tactels{kind} sits {outermost * 1e3:g} mm "
                f"from the centre, beyond the strip's end at {half * 1e3:g} mm; take fewer "
                f"tactels, {remedy} or a longer strip"
            )
        if transducer.plane == "given" and (tactels.placement or tactels.contact_width):
            raise ValueError(
                'placement and contact_width do not go with plane = "given", whose influence '
                "matrix says what a force does; leave them out"
            )
        wide = tactels.contact_width or info.data.get("skin") is not None
        if transducer.strain == "finite" and not transducer.solved_in_a_plane:
            raise ValueError(
                f'strain = "finite" is solved in a plane, not with plane = "{transducer.plane}"; '
                'take plane = "stress" or "strain", or strain = "linear"'
            )
        if transducer.strain == "finite" and not wide:
            raise ValueError(
                'strain = "finite" takes contacts of some width, for under a line strain has no '
                "bound; give tactels.contact_width, or a skin"
            )
        centres = tactels.positions + tactels.placement
        outermost = np.abs(centres).max() + tactels.contact_width / 2
        if outermost > half:
            raise ValueError(
                f"contacts {tactels.contact_width * 1e3:g} mm wide, {tactels.placement * 1e3:g} mm "
                f"beside their tactels, reach {outermost * 1e3:g} mm from the centre, beyond the "
                f"strip's end at {half * 1e3:g} mm; take narrower contacts, fewer tactels or a "
                "longer strip"
            )
        return tactels

    @field_validator("camera", mode="after")
    @classmethod
    def _line_on_the_strip(cls, camera: Camera, info: ValidationInfo) -> Camera:
        transducer = info.data.get("transducer")
        if transducer is not None:
            camera.check_line(transducer.width, transducer.plane)
        return camera

    @field_validator("camera", mode="after")
    @classmethod
    def _takes_the_light(cls, camera: Camera, info: ValidationInfo) -> Camera:
        polariscope = info.data.get("polariscope")
        if polariscope is None:
            return camera
        for number, light in enumerate(zip(*_light(polariscope, camera), strict=True)):
            try:
                camera.check_light(*light)
            except ValueError as error:
                raise ValueError(f"channel {number + 1}: {error}") from None
        return camera

    @model_validator(mode="after")
    def _looks_at_itself(self) -> Self:
        """Refuse a camera of which no pixel sees the strip, or none surely does."""
        half, x, camera = self.transducer.length / 2, self._places(), self.camera
        stated = f"shift = {1e3 * camera.shift:g} mm and scale = {camera.scale:g}"
        ends = f"the strip's ends are {1e3 * half:g} mm from its middle"
        if not (np.abs(x) <= half).any():
            raise ValueError(
                f"the camera looks beside the strip: with {stated} its pixels are at x from "
                f"{1e3 * x.min():.4g} mm to {1e3 * x.max():.4g} mm, and {ends}; state where it "
                "looks"
            )
        shift, scale = (self.tolerances.get(f"camera.{name}", 0.0) for name in ("shift", "scale"))
        reach = np.abs(x) + SURELY * np.hypot(shift, scale * x)
        if not (reach <= half).any():
            raise ValueError(
                f"camera.shift = {1e3 * camera.shift:g} +/- {1e3 * shift:g} mm and camera.scale = "
                f"{camera.scale:g} +/- {scale:g} are too uncertain: at {SURELY:g} standard "
                f"deviations no pixel surely sees the strip, and {ends}; state smaller tolerances"
            )
        return self

    def _places(self) -> Array:
        """Centres of the pixels along x [m]."""
        n = self.camera.pixels
        drawn = ((np.arange(n) + 0.5) / n - 0.5) * self.transducer.length
        return self.camera.scale * drawn + self.camera.shift

    @property
    def light(self) -> tuple[Array, Array]:
        """Amplitude and offset of every channel, shape (C,) each, grey levels."""
        amplitude, offset, _ = _light(self.polariscope, self.camera)
        return np.array(amplitude), np.array(offset)

    @property
    def noise(self) -> Array:
        """Noise of every channel, shape (C,), grey levels, as of `camera.noise`."""
        return np.array(_light(self.polariscope, self.camera)[2])

    @property
    def frame_shape(self) -> tuple[int, ...]:
        """Shape of a frame: (n_pixels,), or (n_channels, n_pixels) if there are several."""
        pictures, pixels = len(self.polariscope.pictures), self.camera.pixels
        return (pixels,) if pictures == 1 else (pictures, pixels)

    @property
    def calibration_refusal(self) -> str:
        """Why frames of known loads are not compared with this design; empty if they are."""
        if not self.polariscope.plates:
            return ""
        return (
            "Known loads are compared behind perfect plates; give a design without "
            "polariscope.plates."
        )

    @cached_property
    def pixel_positions(self) -> Array:
        """Centres of the pixels along x, shape (pixels,) [m]."""
        return self._places()
