"""The command that reproduces the paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fringeforce.cli.arguments import Design, usable_folder
from fringeforce.cli.progress import compiling, progress_bar


def reproduce(
    design: Design = "saad",
    out: Annotated[
        Path,
        typer.Option("--out", metavar="<folder>", help="Folder for the pictures and the page."),
    ] = Path("demo"),
) -> None:
    """Reproduce the paper's figures and statements as one page."""
    from fringeforce.base.errors import InputError
    from fringeforce.design.files import load_strip
    from fringeforce.reproduction.report import reproduce

    usable_folder(out)
    sensor = load_strip(design)
    if sensor.skin is not None:
        raise InputError(
            f"{design} has a skin, and the paper's figures are of tactels; take a design such as "
            "saad."
        )
    with compiling(), progress_bar("Characterising", width=52) as advance:
        page = reproduce(sensor, out, advance)
    print(f"Open {page} in a browser.")
