"""The command that makes labelled images: dataset."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fringeforce.base.words import counted
from fringeforce.cli.arguments import Scheduler, Workers, usable_folder, writable
from fringeforce.cli.progress import progress_bar


def dataset(
    study: Annotated[
        Path, typer.Argument(help="Study file, such as examples/dataset/fingers.toml.")
    ],
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            metavar="<folder>",
            help="Folder of the data set; resumed if it exists.",
        ),
    ],
    sheet: Annotated[
        Path | None,
        typer.Option(
            metavar="<file>", help="Picture to write of the first images, such as sheet.png."
        ),
    ] = None,
    scheduler: Scheduler = None,
    workers: Workers = None,
) -> None:
    """Simulate labelled images of a pad or skin, to learn from.

    What presses is random.
    """
    from fringeforce.datasets.making import make_dataset
    from fringeforce.datasets.sheet import write_sheet

    usable_folder(output)
    writable(sheet, "pictures", study)
    with progress_bar() as advance:
        made = make_dataset(study, output, scheduler, workers, advance)
    parts = ", ".join(f"{count} {name}" for name, count in made.parts.items())
    print(
        f"{output}: {counted(sum(made.parts.values()), 'images')} ({parts}) in "
        f"{counted(len(made.shards), 'shards')}, "
        f"{made.size / 1e6:.3g} MB; {made.made} of them made now"
    )
    if sheet is not None:
        write_sheet(study, sheet)
        print(f"{sheet}: the first images drawn")
