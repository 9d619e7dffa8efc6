"""The kinds of numbers that a design consists of."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import numpy as np
from pydantic import AfterValidator, AllowInfNan, BeforeValidator, Field, Strict, ValidationInfo

from fringeforce.design.units import EXAMPLES, parse_quantity


def _quantity(unit: str, above: float | None = None, least: float | None = None) -> Any:
    """A physical quantity: text with a unit, or, from Python only, an SI float."""

    def read(value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, str):
            return parse_quantity(value, unit)
        units_required = bool(info.context and info.context["units_required"])
        if units_required and not isinstance(value, bool) and isinstance(value, int | float):
            raise ValueError(f"is a bare number; write it with its unit, as in {EXAMPLES[unit]}")
        return value

    return Annotated[
        float,
        Strict(),
        AllowInfNan(False),
        Field(gt=above, ge=least, json_schema_extra={"unit": unit}),
        BeforeValidator(read),
    ]


def _plain_integer(value: Any) -> Any:
    """NumPy's whole numbers, as a sweep over np.arange hands them in, as Python's."""
    return int(value) if isinstance(value, np.integer) else value


def _plain_list(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


if TYPE_CHECKING:
    Length = Pressure = Force = Place = Extent = Angle = Time = float
    # one of the two is stated
    StrainOptic = StressOptic = TemperatureCoefficient = Temperature = float
else:
    Length, Pressure = _quantity("meter", above=0), _quantity("pascal", above=0)
    Force, Place = _quantity("newton", above=0), _quantity("meter")
    Extent, Angle = _quantity("meter", least=0), _quantity("radian")
    Time = _quantity("second", above=0)
    Temperature = _quantity("kelvin", least=0)
Places = Annotated[tuple[Place, ...], BeforeValidator(_plain_list)]
"""Several places along the strip [m]."""
Finite = Annotated[float, AllowInfNan(False), Strict()]
Coefficients = Annotated[tuple[Finite, ...], BeforeValidator(_plain_list)]
"""Ratios of coefficients of a strain energy."""
UNSTATED: Any = None
if not TYPE_CHECKING:
    StrainOptic = Annotated[Finite, Field(gt=0)] | None
    StressOptic = _quantity("1/pascal", above=0) | None
    TemperatureCoefficient = _quantity("1/kelvin") | None
Share = Annotated[Finite, Field(ge=0, le=1)]


def percent(value: Any) -> Any:
    """A share written in per cent, "1 %", as a number."""
    if not isinstance(value, str):
        return value
    try:
        return float(value.strip().removesuffix("%")) / (100 if value.strip()[-1:] == "%" else 1)
    except ValueError:
        raise ValueError('is no share; write a number or per cent, such as "1 %"') from None


Percent = Annotated[Finite, Field(ge=0), BeforeValidator(percent)]
"""A share of something, 0.01 or "1 %"."""
Visibility = Annotated[Finite, Field(gt=0, le=1)]
"""Visibility of fringes, (brightest - darkest) / (brightest + darkest)."""
Count = Annotated[int, Strict(), Field(ge=1), BeforeValidator(_plain_integer)]


def _ascending(value: Any) -> Any:
    if value[0] > value[1]:
        raise ValueError(f"begins above its end; write [{value[1]:g}, {value[0]:g}]")
    return value


Value = TypeVar("Value")
Range = Annotated[tuple[Value, Value], AfterValidator(_ascending)]
"""Lowest and highest of values that are drawn or varied."""
