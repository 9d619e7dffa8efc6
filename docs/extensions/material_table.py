"""The tables of materials and of light sources as a page shows them."""

from __future__ import annotations

from fringeforce.design.light_sources import light_sources
from fringeforce.design.materials import materials
from fringeforce.design.units import parse_quantity

LIGHTS = "| name | peak | full width at half maximum | what it is |\n|---|---|---|---|\n"
HEAD = (
    "| name | E | \u03bd | fringe value{at} | Yeoh's C10, C20, C30 in kPa | what it is |\n"
    "|---|---|---|---|---|---|\n"
)


def table() -> str:
    """Rows of all materials, and below them the sources of their numbers."""
    rows, sources = [], dict[str, list[str]]()
    lights = {found.values.get("wavelength") for found in materials().values()} - {None}
    for found in materials().values():
        fringe = found.values.get("fringe_value", "")
        at = f" at {found.values['wavelength']}" if fringe and len(lights) > 1 else ""
        modulus, ratio = (found.values.get(k, "") for k in ("youngs_modulus", "poissons_ratio"))
        law = ",\u00a0".join(_kilopascals(one) for one in found.values.get("yeoh", []))
        numbers = _unbroken(modulus), _unbroken(ratio), _unbroken(fringe) + at, law
        rows.append("| " + " | ".join((f"`{found.name}`", *numbers, found.about)) + " |")
        sources.setdefault(found.source, []).append(found.name)
    at = f" at {lights.pop()}" if len(lights) == 1 else ""
    return HEAD.format(at=at) + _page(rows, sources)


def lights() -> str:
    """Rows of all light sources, and below them the sources of their numbers."""
    rows, sources = [], dict[str, list[str]]()
    for one in light_sources().values():
        rows.append(f"| `{one.name}` | {one.wavelength} | {one.bandwidth} | {one.about} |")
        sources.setdefault(one.source, []).append(one.name)
    return LIGHTS + _page(rows, sources)


def _kilopascals(text: str) -> str:
    return f"{parse_quantity(text, 'pascal') / 1e3:.3g}"


def _unbroken(number: str) -> str:
    """A number with its unit, and its tolerance; a line may end between them alone."""
    parts = (part.strip().replace(" ", "\u00a0") for part in number.split("+/-"))
    return " ±\u00a0".join(parts)


def _page(rows: list[str], sources: dict[str, list[str]]) -> str:
    said = [f"- {', '.join(names)}: {source}." for source, names in sources.items()]
    return "\n".join(rows) + "\n\n" + "\n".join(said) + "\n"
