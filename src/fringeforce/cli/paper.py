"""The command that reproduces the paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fringeforce.cli.arguments import Design


def reproduce(
    design: Design = "saad",
    out: Annotated[
        Path, typer.Option("--out", help="Folder for the pictures and the page.")
    ] = Path("demo"),
) -> None:
    """Reproduce the paper's figures and statements as one page."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    from fringeforce.design import load_strip
    from fringeforce.reproduction.report import reproduce

    sensor = load_strip(design)
    columns = TextColumn("{task.description:<52}"), BarColumn(), MofNCompleteColumn()
    with Progress(*columns) as progress:
        task = progress.add_task("Characterising")

        def advance(title: str, number: int, count: int) -> None:
            progress.update(task, description=title, completed=number, total=count)

        page = reproduce(sensor, out, advance)
    print(f"Open {page} in a browser.")
