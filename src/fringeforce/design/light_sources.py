"""LEDs by name: peak wavelength and spectral width, as data sheets state them.

A data sheet states the spectral half-width: the distance between the two wavelengths at which the
spectrum has half of its peak, which is the full width at half maximum and the `bandwidth` of a
polariscope.  `fringeforce.optics.polariscope.wave_number_spread` turns it into the standard
deviation of a Gaussian spectrum of 1 / wavelength, whose mean is 1 / peak wavelength.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator

from fringeforce.design.fields import Length


@dataclass(frozen=True)
class LightSource:
    """An LED, as published.

    Attributes
    ----------
    name, about : str
        What it is called and made of.
    wavelength, bandwidth : str
        Peak wavelength and full width at half maximum, such as "635 nm" and "17 nm".
    source : str
        Who says so.
    """

    name: str
    about: str
    wavelength: str
    bandwidth: str
    source: str


@cache
def light_sources() -> dict[str, LightSource]:
    """Light sources by name.

    Examples
    --------
    >>> from fringeforce.design.light_sources import light_sources
    >>> light_sources()["red LED"].wavelength
    '635 nm'
    """
    text = Path(__file__).with_name("light_sources.toml").read_text(encoding="utf-8")
    return {name: LightSource(name, **entry) for name, entry in tomllib.loads(text).items()}


def named(value: Any) -> LightSource | None:
    """The light source that a wavelength names, if any.

    Examples
    --------
    >>> from fringeforce.design.light_sources import named
    >>> named("red LED").bandwidth
    '17 nm'
    >>> named("632.8 nm")
    """
    return light_sources().get(value) if isinstance(value, str) else None


def with_bandwidth(values: Any) -> Any:
    """A table of a design with the bandwidth of the light source that its wavelength names.

    Parameters
    ----------
    values : mapping
        Keys of a polariscope or a channel; a bandwidth that they state is kept.

    Examples
    --------
    >>> from fringeforce.design.light_sources import with_bandwidth
    >>> with_bandwidth({"wavelength": "red LED", "bias": 90})
    {'bandwidth': '17 nm', 'wavelength': 'red LED', 'bias': 90}
    """
    found = named(values.get("wavelength")) if isinstance(values, Mapping) else None
    return values if found is None else {"bandwidth": found.bandwidth, **values}


def wavelength_text(value: Any) -> Any:
    """The wavelength of a light source that is named; any other value as it is.

    Raises
    ------
    ValueError
        If a text begins like a name and there is no such light source.

    Examples
    --------
    >>> from fringeforce.design.light_sources import wavelength_text
    >>> wavelength_text("red LED"), wavelength_text("632.8 nm")
    ('635 nm', '632.8 nm')
    """
    if (found := named(value)) is not None:
        return found.wavelength
    if isinstance(value, str) and value.strip()[:1].isalpha():
        known = ", ".join(map(repr, light_sources()))
        raise ValueError(
            f'is no light source of the table; take a wavelength such as "632.8 nm", or one of '
            f"{known}"
        )
    return value


LONGEST = 1e-3
"""Wavelength beyond which light is none [m], and nanometres were given as metres."""


def _of_light(value: float) -> float:
    if value > LONGEST:
        raise ValueError('is no wavelength of light; write its unit, as in "632.8 nm"')
    return value


Wavelength = Annotated[Length, AfterValidator(_of_light), BeforeValidator(wavelength_text)]
"""A wavelength in vacuum [m], or the name of a light source."""
