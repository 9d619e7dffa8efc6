"""Strain energies of layers: coefficients as they are published, and their ratios.

A layer that states C10 and C01 (Mooney and Rivlin) or C10, C20 and C30 (Yeoh) as pressures states
its modulus at small strain by them, E = 4 (1 + nu) (C10 + C01).  A design keeps that modulus, which
tolerances and calibration may change, and beside it the ratios of the coefficients to C10 + C01.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeGuard

from pydantic_core import InitErrorDetails

from fringeforce.design.tolerances import is_tolerance, parse_tolerance, problem_at
from fringeforce.design.units import parse_quantity

LAWS: Mapping[str, tuple[str, ...]] = {
    "mooney_rivlin": ("C10", "C01"),
    "yeoh": ("C10", "C20", "C30"),
}
"""Keys of a layer, one of which it may have, and the coefficients that each takes."""
MODULUS = "youngs_modulus"
ROUNDING = 1e-9
"""By how much ratios may miss their sum, for rounding."""


def initial(law: str, coefficients: tuple[float, ...]) -> float:
    """C10 + C01, half the shear modulus at small strain."""
    return sum(coefficients) if law == "mooney_rivlin" else coefficients[0]


def are_pressures(coefficients: Any) -> TypeGuard[Sequence[Any]]:
    """Whether coefficients are written with units, and so say how stiff a layer is."""
    return isinstance(coefficients, list | tuple) and any(
        isinstance(one, str) for one in coefficients
    )


def checked_ratios(law: str, ratios: tuple[float, ...]) -> tuple[float, ...]:
    """Ratios of the coefficients of a law; none for a neo-Hookean layer.

    Raises
    ------
    ValueError
        If they are too many or too few, or C10 + C01 is not 1.
    """
    if not ratios:
        return ratios
    _count(law, ratios)
    if abs(initial(law, ratios) - 1) > ROUNDING:
        whole = "C10 + C01" if law == "mooney_rivlin" else "C10"
        raise ValueError(
            f"are plain numbers, which are ratios beside {MODULUS}, with {whole} = 1; write "
            f"coefficients with their units, as in {_example(law)}"
        )
    return ratios


def as_ratios(
    place: tuple[str, ...], layer: dict[str, Any], problems: list[InitErrorDetails]
) -> None:
    """Turn the pressures that a layer states into its modulus and ratios, in place.

    Parameters
    ----------
    place : tuple of str
        Of the layer in the design.
    layer : dict
        Plain values of the layer, Poisson's ratio among them.
    problems : list
        Gains what is wrong with the coefficients.
    """
    own = layer.get(MODULUS)
    for law in LAWS:
        if not are_pressures(stated := layer.get(law)):
            continue
        modulus = "1 MPa"  # stands in, so that nothing else is missed
        try:
            ratios, shear = ratios_of(law, stated)
            layer[law] = ratios
            modulus = f"{4 * (1 + _poissons_ratio(layer)) * shear!r} Pa"
            if own is not None:
                shown = ", ".join(f"{one:.4g}" for one in ratios)
                raise ValueError(
                    f"says how stiff the layer is, and so does {MODULUS}; leave one of them out, "
                    f"or write ratios beside {MODULUS}: {law} = [{shown}]"
                )
        except ValueError as error:
            layer.pop(law)
            problems.append(problem_at((*place, law), list(stated), str(error)))
        if own is None:
            layer[MODULUS] = modulus


def ratios_of(law: str, stated: Sequence[Any]) -> tuple[tuple[float, ...], float]:
    """Ratios of coefficients that are written with units, and C10 + C01 [Pa].

    Raises
    ------
    ValueError
        If one is no pressure or has a tolerance, they are too many or too few, or C10 + C01 is not
        above zero.

    Examples
    --------
    >>> from fringeforce.design.strain_energy import ratios_of
    >>> ratios_of("mooney_rivlin", ["0.375 MPa", "125 kPa"])
    ((0.75, 0.25), 500000.0)
    """
    _count(law, stated)
    if any(is_tolerance(one) for one in stated):
        raise ValueError(
            f"takes no tolerances; give {MODULUS} one, and write ratios beside it, with "
            "C10 + C01 = 1"
        )
    found = list[float]()
    for name, one in zip(LAWS[law], stated, strict=True):
        try:
            found.append(parse_quantity(one if isinstance(one, str) else f"{one}", "pascal"))
        except ValueError as error:
            raise ValueError(f"has a {name} that {error}") from None
    shear = initial(law, tuple(found))
    if not shear > 0:
        raise ValueError(
            f"is unstable: the shear modulus at small strain, 2 (C10 + C01), is {2 * shear:g} Pa; "
            "it must be greater than 0"
        )
    return tuple(one / shear for one in found), shear


def _count(law: str, values: Sequence[Any]) -> None:
    names = LAWS[law]
    if len(values) != len(names):
        raise ValueError(
            f"takes {len(names)} values, {', '.join(names)}, as in {_example(law)}; "
            f"{len(values)} are given"
        )


def _example(law: str) -> str:
    few = '["0.12 MPa", "0.03 MPa"]'
    return few if law == "mooney_rivlin" else '["0.11 MPa", "-0.01 MPa", "2 kPa"]'


def _poissons_ratio(layer: Mapping[str, Any]) -> float:
    """Poisson's ratio of a layer; one that is no number is refused where it stands."""
    value = layer.get("poissons_ratio")
    if isinstance(value, str) and is_tolerance(value):
        try:
            value = parse_tolerance(value, None)[1]
        except ValueError:
            value = None
    known = isinstance(value, int | float) and -1 < value < 0.5
    return float(value) if known else 0.0
