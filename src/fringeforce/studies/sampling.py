"""Designs of a study: from the unit cube to values at dotted paths of a design."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.design.strip import Sensor
from fringeforce.design.text import unit_at
from fringeforce.design.units import EXAMPLES, parse_quantity
from fringeforce.studies.study_file import DesignSampling, Parameter

Value = float | int | str
LARGEST_GRID = 1_000_000


@dataclass(frozen=True)
class Axis:
    """One varied design value.

    Attributes
    ----------
    path : str
        Dotted path in the design.
    unit : str or None
        "meter" or "pascal", if it has one.
    low, high : float
        Ends, in SI units; unused with choices.
    logarithmic : bool
        Whether equal ratios are equally likely.
    whole : bool
        Whether only whole numbers are values.
    choices : tuple
        Values without an order; empty for a range.
    points : int
        Values on a grid.
    """

    path: str
    unit: str | None
    low: float
    high: float
    logarithmic: bool
    whole: bool
    choices: tuple[Value, ...]
    points: int

    @property
    def text(self) -> bool:
        """Whether its values are words."""
        return any(isinstance(choice, str) for choice in self.choices)

    def value(self, share: float) -> Value:
        """Value at a share from 0 to 1 of the way from low to high, or of the choices."""
        if self.choices:
            return self.choices[min(int(share * len(self.choices)), len(self.choices) - 1)]
        if self.whole:
            count = round(self.high - self.low) + 1
            return round(self.low) + min(int(share * count), count - 1)
        if self.logarithmic:
            return float(self.low * (self.high / self.low) ** share)
        return float(self.low + (self.high - self.low) * share)

    def levels(self) -> list[Value]:
        """Values on a grid."""
        if self.choices:
            return list(self.choices)
        shares = np.linspace(0, 1, self.points) if self.points > 1 else np.array([0.5])
        return list(dict.fromkeys(self.value(share) for share in shares))


def axis(parameter: Parameter, sensor: Sensor) -> Axis:
    """Check a parameter against a design.

    Raises
    ------
    InputError
        If its path names no value of a design, its values have no unit where one is due, or its
        ends are not in order.
    """
    path = parameter.path
    current = value_at(sensor, path)
    unit = unit_at(sensor, path)
    whole = isinstance(current, int)
    if parameter.choices:
        chosen = tuple(_read(choice, path, unit) for choice in parameter.choices)
        return Axis(path, unit, 0.0, 0.0, False, whole, chosen, len(chosen))
    assert parameter.lowest is not None
    assert parameter.highest is not None
    low, high = (_read(end, path, unit) for end in (parameter.lowest, parameter.highest))
    if isinstance(low, str) or isinstance(high, str) or isinstance(current, str):
        raise InputError(f"{path} is text; list its values as choices.")
    logarithmic = parameter.scale == "log"
    if not low < high or (logarithmic and low <= 0):
        raise InputError(
            f"{path} goes from {parameter.lowest} to {parameter.highest}; the lowest must be below "
            "the highest, and above zero on a logarithmic scale."
        )
    return Axis(path, unit, low, high, logarithmic, whole, (), parameter.points)


def value_at(sensor: Sensor, path: str) -> Value:
    """The value of a design at a dotted path; InputError if there is none."""
    value: object = sensor
    for part in path.split("."):
        value = getattr(value, part, None) if part in getattr(value, "__dict__", {}) else None
    if isinstance(value, bool) or not isinstance(value, float | int | str):
        raise InputError(
            f"{path!r} names no value of a design; take a dotted path such as "
            "'transducer.compliant.thickness'."
        )
    return value


def designs(
    sampling: DesignSampling, axes: list[Axis], seed: np.random.SeedSequence
) -> list[dict[str, Value]]:
    """The designs of a sweep, as values by path.

    Raises
    ------
    InputError
        If a grid has more than a million designs.
    """
    if sampling.method == "grid":
        levels = [one.levels() for one in axes]
        count = int(np.prod([len(values) for values in levels], dtype=float))
        if count > LARGEST_GRID:
            raise InputError(f"A grid of {count:,} designs; take fewer points, or a hypercube.")
        paths = [one.path for one in axes]
        return [dict(zip(paths, values, strict=True)) for values in itertools.product(*levels)]
    from scipy.stats import qmc  # takes a quarter of a second, which workers of a sweep do without

    rng = np.random.default_rng(seed)
    if sampling.method == "sobol":
        # a power of two keeps the sequence balanced; what is asked for is its beginning
        power = int(np.ceil(np.log2(sampling.designs)))
        shares = qmc.Sobol(len(axes), rng=rng).random_base2(power)[: sampling.designs]
    else:
        shares = qmc.LatinHypercube(len(axes), rng=rng).random(sampling.designs)
    return [changes(axes, row) for row in shares]


def changes(axes: list[Axis], shares: Array) -> dict[str, Value]:
    """Values by path at shares from 0 to 1 of every axis, shape (d,)."""
    return {one.path: one.value(float(share)) for one, share in zip(axes, shares, strict=True)}


def _read(value: str | float | int, path: str, unit: str | None) -> Value:
    if unit is None:
        return value
    if not isinstance(value, str):
        raise InputError(
            f"{path} = {value} is a bare number; write it with its unit, as in {EXAMPLES[unit]}."
        )
    try:
        return parse_quantity(value, unit)
    except ValueError as error:
        raise InputError(f"{path} = {value!r} {error}.") from None
