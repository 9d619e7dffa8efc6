"""What data sheets state of layers: materials by name, stress-optic coefficients, fringe values.

A photoelastic layer of stress-optic coefficient C and thickness h retards light of wavelength
lambda by C h (s1 - s2), and shows a fringe for every f / h of principal stress difference, so that
its fringe value is f = lambda / C (Dally and Riley, Experimental Stress Analysis, 3rd ed., section
13.3).  The strain-optic coefficient K_s of the paper gives C = (1 + nu) K_s / E, equation (2).
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pydantic_core import InitErrorDetails

from fringeforce.design.light_sources import wavelength_text
from fringeforce.design.strain_energy import LAWS, MODULUS, as_ratios, ratios_of
from fringeforce.design.tolerances import is_tolerance, parse_tolerance, problem_at
from fringeforce.design.units import parse_quantity
from fringeforce.design.validation import suggestion

FRINGE_VALUE, STRESS_OPTIC = "fringe_value", "stress_optic_coefficient"
EFFECT = "strain_optic_coefficient", STRESS_OPTIC, FRINGE_VALUE
"""Keys that state how strong the photoelastic effect is, one of which a layer has."""
LAYERS = "compliant", "photoelastic"


@dataclass(frozen=True)
class Material:
    """A material, as published.

    Attributes
    ----------
    name, about, source : str
        What it is called, what it is, and who says so.
    values : mapping
        Keys of a layer with their texts, tolerances among them; "fringe_value" counts at
        "wavelength", and coefficients of a strain energy are lists of texts.
    """

    name: str
    about: str
    source: str
    values: Mapping[str, Any]


@cache
def materials() -> dict[str, Material]:
    """Materials by name."""
    text = Path(__file__).with_name("materials.toml").read_text(encoding="utf-8")
    return {
        name: Material(name, entry.pop("about"), entry.pop("source"), entry)
        for name, entry in tomllib.loads(text).items()
    }


def stress_optic_text(fringe_value: Any, wavelength: Any) -> str:
    """The stress-optic coefficient that a fringe value means, with its tolerance.

    Parameters
    ----------
    fringe_value : str
        Such as "7 N/mm" or "7.0 N/mm +/- 5 %".
    wavelength : str
        Of the light that it was measured in.

    Raises
    ------
    ValueError
        If one of them is no such quantity.

    Examples
    --------
    >>> from fringeforce.design.materials import stress_optic_text
    >>> stress_optic_text("7.0 N/mm +/- 5 %", "546 nm")
    '7.8e-11 Pa^-1 +/- 5 %'
    """
    length = _number(wavelength, "meter")[0]
    value, std = _number(fringe_value, "newton/meter")
    if not value > 0:
        raise ValueError("is no fringe value; it must be greater than zero")
    text = f"{length / value!r} Pa^-1"
    return f"{text} +/- {100 * std / value:.12g} %" if is_tolerance(fringe_value) else text


def as_values(values: Mapping[str, Any]) -> tuple[dict[str, Any], list[InitErrorDetails]]:
    """Values of a design with those of its materials, as the fields of a design state them.

    Fringe values become stress-optic coefficients; coefficients of a strain energy become Young's
    modulus and ratios.

    Parameters
    ----------
    values : mapping
        Plain nested values, as in a file.

    Returns
    -------
    values : dict
        What was stated wins over what a material has.
    problems : list
        Of materials, fringe values and coefficients, with their places.
    """
    changed, problems = dict(values), list[InitErrorDetails]()
    transducer, light = values.get("transducer"), values.get("polariscope")
    if not isinstance(transducer, Mapping):
        return changed, problems
    changed["transducer"] = whole = dict(transducer)
    for key in LAYERS:
        if not isinstance(layer := whole.get(key), Mapping):
            continue
        whole[key] = layer = dict(layer)
        name = layer.get("material")
        found = materials().get(name) if isinstance(name, str) else None
        if name is not None and found is None:
            place = "transducer", key, "material"
            hint = suggestion(str(name), list(materials())).rstrip(".")
            text = f"is no material of the table ({hint})"
            problems.append(problem_at(place, name, text))
        known = found.values if found is not None else {}
        if layer.get("poissons_ratio") is None and "poissons_ratio" in known:
            layer["poissons_ratio"] = known["poissons_ratio"]
        as_ratios(("transducer", key), layer, problems)
        _add(layer, known, effect=key == LAYERS[1])
        if (stated := layer.get(FRINGE_VALUE)) is not None:
            wavelength = light.get("wavelength") if isinstance(light, Mapping) else None
            at, wrong = ("polariscope", "wavelength"), wavelength
            try:
                wavelength = wavelength_text(wavelength)
                at, wrong = ("transducer", key, FRINGE_VALUE), stated
                text = stress_optic_text(stated, wavelength)
            except ValueError as error:
                problems.append(problem_at(at, wrong, str(error)))
                text = "1 TPa^-1"  # stands in, so that nothing else is missed
            layer.pop(FRINGE_VALUE)
            if layer.get(STRESS_OPTIC) is None:
                layer[STRESS_OPTIC] = text
    return changed, problems


def by_strain(design: Any) -> Any:
    """The same design with its photoelastic effect stated by a strain-optic coefficient."""
    layer = design.transducer.photoelastic
    value = layer.stress_optic * layer.youngs_modulus / (1 + layer.poissons_ratio)
    path = "transducer.photoelastic.strain_optic_coefficient"
    return design if layer.effect == EFFECT[0] else design.replace(**{path: value})


def _add(layer: dict[str, Any], known: Mapping[str, Any], effect: bool) -> None:
    """Add what is known of a material and a layer does not state."""
    if MODULUS in known and layer.get(MODULUS) is None:
        layer[MODULUS] = known[MODULUS]
    if not any(layer.get(law) for law in LAWS):
        layer.update({law: ratios_of(law, known[law])[0] for law in LAWS if law in known})
    stated = any(layer.get(own) is not None for own in EFFECT)
    if effect and not stated and FRINGE_VALUE in known:
        layer[STRESS_OPTIC] = stress_optic_text(known[FRINGE_VALUE], known["wavelength"])


def _number(text: Any, unit: str) -> tuple[float, float]:
    """A quantity and its standard deviation; floats are in the unit."""
    if isinstance(text, str):
        if is_tolerance(text):
            _, value, std = parse_tolerance(text, unit)
            return value, std
        return parse_quantity(text, unit), 0.0
    if isinstance(text, int | float) and not isinstance(text, bool):
        return float(text), 0.0
    raise ValueError("needs a wavelength of the polariscope beside it")
