"""The light of a design: a polariscope with one channel or several, perfect or not."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from fringeforce.fields import Finite, Length


class Channel(BaseModel):
    """One picture of the strip among those that are taken together."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    wavelength: Length | None = Field(
        default=None,
        description="wavelength in vacuum [m]; that of the polariscope if not given",
        json_schema_extra={"unit": "meter"},
    )
    bias: Finite = Field(
        default=0.0,
        description="phase added to the strip's [degrees]: 0 dark field, 180 bright field, 90 a "
        "quarter wave; the analyser is turned by half of it",
    )


class Plates(BaseModel):
    """What is wrong with the polarisers and the two quarter-wave plates."""

    model_config = ConfigDict(frozen=True, extra="forbid")

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


class Polariscope(BaseModel):
    """The light, the polarisers and the pictures that are taken of the strip together."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    wavelength: Length = Field(description="wavelength in vacuum [m]")
    channels: tuple[Channel, ...] = Field(
        default=(), description="pictures that make up one frame; one of a dark field if not given"
    )
    plates: Plates | None = Field(
        default=None, description="errors of polarisers and plates; perfect ones if not given"
    )

    @property
    def pictures(self) -> tuple[Channel, ...]:
        """The channels, at least one."""
        return self.channels or (Channel(),)
