"""Sources that are made before a build: API pages, design fields, commands, the figure."""

from __future__ import annotations

import re
from pathlib import Path

import api_pages
import conventions_figure
import design_fields
import material_table
import number_table
import pad_skin_figure
import skin_figure
import tolerance_figure
from sphinx.application import Sphinx
from typer.testing import CliRunner

import fringeforce
from fringeforce.cli import app as commands


def make(app: Sphinx) -> None:
    """Write everything into `generated`, which git ignores."""
    folder = Path(app.srcdir) / "generated"
    rooms = api_pages.rooms()
    for room, modules in rooms.items():
        _write(folder / "modules" / f"{room}.rst", api_pages.page(room, modules))
    _write(folder / "modules" / "index.rst", api_pages.index(list(rooms)))
    for name in fringeforce.__all__:
        _write(folder / "api" / f"{name}.rst", api_pages.public(name))
    _write(folder / "parts" / "design-fields.md", design_fields.tables())
    _write(folder / "parts" / "materials.md", material_table.table())
    _write(folder / "parts" / "light_sources.md", material_table.lights())
    _write(folder / "parts" / "numbers-deciding.md", number_table.deciding())
    for room in number_table.ROOMS:
        _write(folder / "parts" / f"numbers-{room}.md", number_table.table(room))
    _write(folder / "parts" / "commands.md", command_help())
    _gallery(folder / "gallery" / "index.md", "sphinx_gallery.gen_gallery" in app.extensions)
    conventions_figure.save(folder / "conventions.svg")
    skin_figure.save(folder / "skin.svg")
    pad_skin_figure.save(folder / "pad-skin.svg")
    tolerance_figure.save(folder / "tolerances.svg")


def _gallery(page: Path, made: bool) -> None:
    """A page in the gallery's place, unless sphinx-gallery makes one itself."""
    if made:
        page.unlink(missing_ok=True)
    else:
        _write(page, "# Gallery\n\nThis copy of the sources has no examples/gallery.\n")


def command_help() -> str:
    """What `--help` says of every command, in Markdown."""
    runner = CliRunner(env={"COLUMNS": "88", "TERM": "dumb"})
    parts = []
    for name in ("", *_registered()):
        said = runner.invoke(commands, [*name.split(), "--help"]).output
        title = f"fringeforce {name}".strip()
        parts.append(f"## `{title}`\n\n```text\n{said.strip()}\n```")
    return "\n\n".join(parts) + "\n"


def plain_bars(
    app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Let |T| mean an absolute value, and (..., *shape) a shape."""
    for number, line in enumerate(lines):
        if "`" not in line:
            lines[number] = re.sub(r"\||(?<=, )\*(?=\w+\))", r"\\\g<0>", line)


def _registered() -> list[str]:
    """Names of commands, those of a group behind it."""
    from typer.main import get_group

    names = []
    for name, command in get_group(commands).commands.items():
        names += [name, *(f"{name} {inner}" for inner in getattr(command, "commands", ()))]
    return names


def _write(path: Path, text: str) -> None:
    """Leave files alone that are right already, so that pages are not built again for nothing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Make the sources before they are looked for."""
    app.connect("builder-inited", make, priority=100)
    app.connect("autodoc-process-docstring", plain_bars, priority=600)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
