"""Physical quantities as people write them, turned into SI floats and back."""

from __future__ import annotations

import math
import re
from functools import cache, lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pint import UnitRegistry
    from pint.facets.plain import PlainQuantity

EXAMPLES = {
    "meter": '"0.5 mm"',
    "pascal": '"11 MPa"',
    "newton": '"3 N"',
    "radian": '"0.1 rad"',
    "second": '"15 s"',
    "1/pascal": '"72 TPa^-1"',
    "newton/meter": '"7 N/mm"',
    "kelvin": '"20 degC"',
    "1/kelvin": '"-0.2 %/K"',
}
_PLURAL = {
    "1/pascal": "reciprocal pascals",
    "newton/meter": "newtons per meter",
    "kelvin": "kelvin",
    "1/kelvin": "per cent per kelvin",
}
READABLE = {"meter": (1e3, "mm"), "pascal": (1e-6, "MPa"), None: (1.0, "")}
"""Factor and symbol of the unit in which a person reads a quantity, by its SI unit."""
_PLEASANT = {
    "meter": ("mm", "um", "nm", "m"),
    "pascal": ("MPa", "kPa", "Pa"),
    "radian": ("rad",),
    "second": ("s", "ms"),
    "1/pascal": ("TPa^-1", "Pa^-1"),
    "kelvin": ("degC", "K"),
    "1/kelvin": ("%/K", "1/K"),
}
USUAL = {
    "meter": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9},
    "pascal": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9},
    "newton": {"N": 1.0, "mN": 1e-3},
    "radian": {"rad": 1.0},
    "second": {"s": 1.0, "ms": 1e-3},
    "1/pascal": {"Pa^-1": 1.0, "TPa^-1": 1e-12},
    "newton/meter": {"N/mm": 1e3},
    "1/kelvin": {"1/K": 1.0, "%/K": 1e-2},
}
"""Usual units, by the SI unit in which each is this factor: pint, which knows all others, takes a
third of a second to load."""
_PLAIN = re.compile(r"\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*(\S+)\s*")
_ANGLES = ("radian", "degree", "turn")


@cache
def _registry() -> UnitRegistry:
    from pint import UnitRegistry  # takes a third of a second, so only where a unit is read

    found = UnitRegistry(cache_folder=None, autoconvert_offset_to_baseunit=True)
    found.define("brewster = 1e-12 / pascal")  # of stress-optic coefficients
    return found


def _quantity(value: float | str, unit: str | None = None) -> PlainQuantity[float]:
    # made by the registry, from more bases than pint declares
    return _registry().Quantity(value, unit)  # pyrefly: ignore[bad-argument-count, bad-return]


def parse_quantity(text: str, unit: str) -> float:
    """Read a quantity such as "0.5 mm" in a unit's SI base.

    Parameters
    ----------
    text : str
        A number and a unit, in any spelling that pint knows.
    unit : str
        The SI unit that the quantity must be convertible to, one of `EXAMPLES`.

    Returns
    -------
    float
        The value in that unit.

    Raises
    ------
    ValueError
        If the text is no quantity of that dimension; the message says what is.
    """
    plain = _PLAIN.fullmatch(text)
    if plain and plain[2] in USUAL.get(unit, {}):
        return float(plain[1]) * USUAL[unit][plain[2]]

    from tokenize import TokenError

    from pint.errors import PintError

    example = EXAMPLES[unit]
    if "," in text:  # pint takes "0,5" for 05
        raise ValueError(f"has a comma; write a decimal point, as in {example}")
    try:
        quantity = _quantity(text)
        dimensionless = quantity.unitless if unit == "radian" else quantity.dimensionless
        if unit == "radian" and not dimensionless:
            # percent and the like have no dimension either
            names = [str(name) for name in dict(quantity.unit_items())]
            if not all(name.endswith(_ANGLES) for name in names):
                raise ValueError
        value = math.nan if dimensionless else float(quantity.to(unit).magnitude)
    except (PintError, TokenError, ArithmeticError, AssertionError, TypeError, ValueError):
        raise ValueError(
            f"is not a quantity in {_PLURAL.get(unit, unit + 's')}; write a number and a unit, as "
            f"in {example}{_meant(text, unit)}"
        ) from None
    if dimensionless:
        raise ValueError(f"has no unit; write one, as in {example}")
    return value


@lru_cache(maxsize=256)
def spell_quantity(value: float, unit: str) -> str:
    """Write an SI value in a pleasant unit such that it reads back to the same float."""
    candidates = []
    for name in _PLEASANT[unit]:
        factor = USUAL.get(unit, {}).get(name)
        shown = value / factor if factor else _quantity(value, unit).to(name).magnitude
        for number in (f"{shown:.12g}", repr(value)):
            text = f"{number} {name}"
            if parse_quantity(text, unit) == value:
                candidates.append(text)
    return min(candidates, key=len)


def _meant(text: str, unit: str) -> str:
    """A question, if only the case of letters keeps a text from having one of the usual units."""
    written = text.split()[-1].lstrip("0123456789.+-") if text.split() else ""
    for usual in _PLEASANT.get(unit, ()):
        if written != usual and written.casefold() == usual.casefold():
            return f" (did you mean {usual}?)"
    return ""
