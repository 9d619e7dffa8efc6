"""The light of a design and who sees it: a polariscope, perfect or not, and a line camera."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator

from fringeforce.base.arrays import Array
from fringeforce.design.fields import (
    Angle,
    Count,
    Extent,
    Finite,
    Length,
    Percent,
    Place,
    Share,
    Visibility,
)
from fringeforce.design.light_sources import Wavelength, with_bandwidth
from fringeforce.design.parts import Converter, Part
from fringeforce.design.tolerances import is_tolerance, parse_tolerance, split_tolerance

CROSSTALK = "polariscope.crosstalk"
"""Path of the shares of light that channels have in each other; each has its numbers behind it."""
CHANNELS = "polariscope.channels."
"""Begin of the paths of what channels have of their own."""
MOST_CROSSTALK = 0.5
"""Share of a channel that others stay below: the rest tells whose it is, and the channels apart."""


def pairs_of_channels(count: int) -> dict[str, tuple[int, int]]:
    """Every pair of so many channels, whose first sees light of the second, by its path."""
    several = range(count)
    return {f"{CROSSTALK}.{c}.{d}": (c, d) for c in several for d in several if c != d}


def light_of_channels(count: int) -> dict[str, int]:
    """Every one of so many channels, by the path of its amplitude; none if there is one."""
    return {f"{CHANNELS}{c}.amplitude": c for c in range(count) if count > 1}


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
    amplitude: Finite | None = Field(
        default=None,
        gt=0,
        description="A of this channel, grey levels between dark and bright, such as those of a "
        "weaker LED; that of the camera if not given",
    )
    offset: Finite | None = Field(
        default=None,
        ge=0,
        description="I_o of this channel, grey levels of darkness; that of the camera if not given",
    )
    noise: Finite | None = Field(
        default=None,
        gt=0,
        description="noise of this channel, grey levels, such as that of a colour which the white "
        "balance amplifies; that of the camera if not given",
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
    crosstalk: tuple[tuple[Share, ...], ...] = Field(
        default=(),
        description="cross-talk between channels, such as that of a colour camera under red, green "
        "and blue light: the share that the light of each other channel has in the fringes of "
        'one, "5 %" or "5 +/- 2 %" for all pairs alike, whose per cent are of the whole light.  '
        "Or a row for each channel, with a share for each, and 0 for its own, which has the rest; "
        "the tolerance is of each share on its own",
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

    @classmethod
    def in_full(cls, values: Any) -> Any:
        """The same, with a share for each pair of channels."""
        if not isinstance(values, Mapping) or "crosstalk" not in values:
            return values
        stated, channels = values["crosstalk"], values.get("channels")
        count = len(channels) if isinstance(channels, list | tuple) else 0
        return {**values, "crosstalk": _pairs(stated, count)}

    @field_validator("crosstalk", mode="before")
    @classmethod
    def _between_channels(cls, stated: Any, info: ValidationInfo) -> Any:
        count = len(info.data.get("channels", ()))
        if isinstance(whole := _pairs(stated, count), list):
            return whole
        if count < 2:
            raise ValueError(
                f"is between several channels, and there {'is one' if count else 'are none'}; list "
                "them in polariscope.channels, or leave crosstalk out"
            )
        raise ValueError(
            "is no share of the light of each other channel; it is from 0 to less than "
            f'{MOST_CROSSTALK / (count - 1):.3g} for {count} channels: write "5 %" or "5 +/- 2 %"'
        )

    @field_validator("crosstalk", mode="after")
    @classmethod
    def _less_than_its_own(
        cls, shares: tuple[tuple[float, ...], ...], info: ValidationInfo
    ) -> tuple[tuple[float, ...], ...]:
        count = len(info.data.get("channels", ()))
        if shares and {len(shares), *map(len, shares)} != {count}:
            raise ValueError(
                f"has {len(shares)} rows of {max(map(len, shares))} shares for {count} channels; "
                'give a row for each channel with a share for each, or one for all pairs, "5 %"'
            )
        for number, row in enumerate(shares):
            if row[number]:
                raise ValueError(
                    f"has a share of {row[number]:g} of channel {number + 1} in itself; write 0 "
                    "there, for its own light has what the others leave"
                )
            if sum(row) >= MOST_CROSSTALK:
                raise ValueError(
                    f"makes {sum(row):.0%} of channel {number + 1} light of others; it must be "
                    f"less than {MOST_CROSSTALK:.0%}, or it is a picture of another channel"
                )
        return shares

    @property
    def channel_shares(self) -> Array:
        """Share of every channel's light in each, shape (C, C); (0, 0) without cross-talk."""
        if not self.crosstalk:
            return np.empty((0, 0))
        others = np.array(self.crosstalk)
        return others + np.diag(1 - others.sum(axis=1))

    @property
    def pictures(self) -> tuple[Channel, ...]:
        """The channels, at least one."""
        return self.channels or (Channel(),)


def _pairs(stated: Any, count: int) -> Any:
    """A list of shares for each of so many channels, where what is stated can be one."""
    if isinstance(stated, list | tuple):
        rows = [row if isinstance(row, list | tuple) else [row] for row in stated]
        return [[_share(one) for one in row] for row in rows]
    alike = _share(stated)
    try:
        number = parse_tolerance(alike, None)[1] if is_tolerance(alike) else float(alike)
    except (TypeError, ValueError):
        return stated
    if count < 2 or not 0 <= number < MOST_CROSSTALK / (count - 1):
        return stated
    return [[0.0 if c == d else alike for d in range(count)] for c in range(count)]


def _share(value: Any) -> Any:
    """A share in per cent as a number, with its tolerance if it has one; else as it is.

    The sign of per cent at the end counts for both numbers.
    """
    if not isinstance(value, str) or not value.strip().endswith("%"):
        return value
    parts = split_tolerance(value) if is_tolerance(value) else (value,)
    try:
        shares = [float(part.removesuffix("%")) / 100 for part in parts]
    except ValueError:
        return value
    return shares[0] if len(shares) == 1 else f"{shares[0]!r} +/- {shares[1]!r}"


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
