"""The light of a design and who sees it: a polariscope, perfect or not, and a line camera."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, model_validator

from fringeforce.design.fields import (
    Angle,
    Count,
    Extent,
    Finite,
    Length,
    Percent,
    Place,
    Visibility,
)
from fringeforce.design.light_sources import Wavelength, with_bandwidth
from fringeforce.design.parts import Converter, Part


class Light(Part):
    """Light whose wavelength may name a source, which then has a bandwidth."""

    @model_validator(mode="before")
    @classmethod
    def _bandwidth_of_the_source(cls, values: Any) -> Any:
        return with_bandwidth(values)


class Channel(Light):
    """One picture of the strip among those that are taken together."""

    wavelength: Wavelength | None = Field(
        default=None,
        description='wavelength in vacuum [m], or a light source such as "red LED" with its '
        "bandwidth; that of the polariscope if not given",
        json_schema_extra={"unit": "meter"},
    )
    bandwidth: Extent | None = Field(
        default=None,
        description="full width at half maximum of the spectrum in wavelength [m]; that of the "
        "polariscope if not given",
        json_schema_extra={"unit": "meter"},
    )
    bias: Finite = Field(
        default=0.0,
        description="phase added to the strip's [degrees]: 0 dark field, 180 bright field, 90 a "
        "quarter wave; the analyser is turned by half of it",
    )


class Plates(Part):
    """What is wrong with the polarisers and the two quarter-wave plates."""

    retardance_error: Finite = Field(
        default=0.0, gt=-90, lt=90, description="retardance beyond a quarter wave [degrees]"
    )
    angle_error: Finite = Field(
        default=0.0, gt=-45, lt=45, description="turn of both plates out of their place [degrees]"
    )
    extinction_ratio: Finite = Field(
        default=0.0, ge=0, lt=1, description="share of blocked light that passes a polariser"
    )
    dispersion: Literal["achromatic", "quarter wave at wavelength"] = Field(
        default="achromatic",
        description="whether the plates are a quarter wave for every channel, or only for the "
        "polariscope's own wavelength",
    )


class Polariscope(Light):
    """The light, the polarisers and the pictures that are taken of the strip together."""

    wavelength: Wavelength = Field(
        description='wavelength in vacuum [m], or a light source such as "red LED", with its '
        "bandwidth",
    )
    channels: tuple[Channel, ...] = Field(
        default=(), description="pictures that make up one frame; one of a dark field if not given"
    )
    plates: Plates | None = Field(
        default=None, description="errors of polarisers and plates; perfect ones if not given"
    )
    bandwidth: Extent = Field(
        default=0.0,
        description="full width at half maximum of the spectrum in wavelength [m], Gaussian in "
        "1 / wavelength; of every channel that states none.  Fringes of a high order lose contrast",
        json_schema_extra={"ideal": True},
    )
    visibility: Visibility = Field(
        default=1.0,
        description="V of fringes, I = [1 - V cos p] / 2: extinction, misalignment, stray light",
        json_schema_extra={"ideal": True},
    )
    residual: Angle = Field(
        default=0.0,
        description="phase lead without load [rad]; its tolerance is the standard deviation of a "
        "smooth random field along the strip",
        json_schema_extra={"ideal": True},
    )
    residual_length: Length = Field(
        default=5e-3,
        description="correlation length of the residual [m]: stresses that casting and bonding "
        "leave vary over no less than the layer's thickness (Saint-Venant's principle), and the "
        "ends of a strip differ",
        json_schema_extra={"ideal": True, "unit": "meter"},
    )

    @property
    def pictures(self) -> tuple[Channel, ...]:
        """The channels, at least one."""
        return self.channels or (Channel(),)


class Camera(Converter):
    """The line camera of a strip."""

    pixels: Count = Field(description="pixels along the strip")
    line_position: Place | None = Field(
        default=None,
        description="where the line that it sees lies across the strip [m]; in the middle if not "
        'given; only with plane = "3d"',
        json_schema_extra={"unit": "meter"},
    )
    line_width: Length | None = Field(
        default=None,
        description="width of the line across the strip [m]; narrow if not given; only with "
        'plane = "3d"',
        json_schema_extra={"unit": "meter"},
    )

    shift: Place = Field(
        default=0.0,
        description="how far along the strip the pixels look beside where they are drawn [m]",
        json_schema_extra={"ideal": True, "unit": "meter"},
    )
    scale: Finite = Field(
        default=1.0,
        gt=0,
        description="distance between pixels on the strip over that of the drawing",
        json_schema_extra={"ideal": True},
    )
    unevenness: Percent = Field(
        default=0.0,
        description="relative standard deviation of the light along the strip, a smooth random "
        'field, such as "3 %"',
        json_schema_extra={"ideal": True},
    )
    blur: Extent | None = Field(
        default=None,
        description="standard deviation of the Gaussian point spread, on the sensor, in metres of "
        "the strip [m]; none if not given",
        json_schema_extra={"ideal": True, "unit": "meter"},
    )

    def check_line(self, width: float, plane: str) -> None:
        """Refuse a line that does not lie on a strip, or that its plane state cannot tell.

        Parameters
        ----------
        width : float
            Width of the strip [m].
        plane : str
            Plane state of the strip.

        Raises
        ------
        ValueError
            Saying what to do.
        """
        position, seen = self.line_position or 0.0, self.line_width or 0.0
        given = {"line_position": self.line_position, "line_width": self.line_width}
        for name, value in given.items():
            if value is not None and plane != "3d":
                raise ValueError(
                    f'{name} = {value * 1e3:g} mm: plane = "{plane}" is the same all over the '
                    f'width; take plane = "3d" or leave {name} out'
                )
        if abs(position) + seen / 2 > width / 2 * (1 + 1e-9):
            raise ValueError(
                f"the camera's line at {position * 1e3:g} mm, {seen * 1e3:g} mm wide, leaves the "
                f"strip, which ends at {width / 2 * 1e3:g} mm on either side; narrow the line or "
                "move it to the middle"
            )
