"""The table of materials as a page shows it."""

from __future__ import annotations

from fringeforce.design.materials import materials

HEAD = "| name | E | nu | fringe value | what it is |\n|---|---|---|---|---|\n"


def table() -> str:
    """Rows of all materials, and below them the sources of their numbers."""
    rows, sources = [], dict[str, list[str]]()
    for found in materials().values():
        fringe = found.values.get("fringe_value", "")
        at = f" at {found.values['wavelength']}" if fringe else ""
        modulus, ratio = (found.values.get(k, "") for k in ("youngs_modulus", "poissons_ratio"))
        cells = (f"`{found.name}`", modulus, ratio, fringe + at, found.about)
        rows.append("| " + " | ".join(cells).replace("+/-", "±") + " |")
        sources.setdefault(found.source, []).append(found.name)
    said = [f"- {', '.join(names)}: {source}." for source, names in sources.items()]
    return HEAD + "\n".join(rows) + "\n\n" + "\n".join(said) + "\n"
