"""Commands of the public benchmark: make and score."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from fringeforce.cli.help import Command
from fringeforce.cli.progress import progress_bar

benchmark = typer.Typer(
    name="benchmark",
    help="Make frames for any reader, and score what it reads.",
    no_args_is_help=True,
    rich_markup_mode=None,
)


@benchmark.command(cls=Command)
def make(
    folder: Annotated[Path, typer.Argument(help="New folder for frames and truth.")],
    frames: Annotated[
        int,
        typer.Option(
            metavar="<count>", help="Public frames of each track, and as many hidden ones."
        ),
    ] = 100,
    track: Annotated[
        list[str] | None,
        typer.Option(
            metavar="<track>",
            help="One of drawn, built, soft, touch, held, and again for more; all if not given.",
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            metavar="<number>",
            help="Start of the random numbers: the same seed makes the same frames; another one "
            "each time if not given.",
        ),
    ] = None,
) -> None:
    """Simulate frames, half with their truth, half to be read.

    Give away everything but the folder `truth`.
    """
    from fringeforce.scoring.making import make_benchmark
    from fringeforce.scoring.tracks import TRACKS

    with progress_bar() as advance:
        names = make_benchmark(folder, frames, seed, tuple(track or ()), advance)
    for name in names:
        print(f"{name}: {TRACKS[name].about}")
    print(f"{folder}: {frames} public and {frames} hidden frames of each; keep {folder / 'truth'}")


@benchmark.command(cls=Command)
def score(
    folder: Annotated[Path, typer.Argument(help="Folder that `benchmark make` made.")],
    answers: Annotated[
        Path, typer.Argument(help="Folder with a CSV of each track, such as drawn.csv.")
    ],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="<file>", help="Scores to write besides (JSON)."),
    ] = None,
) -> None:
    """Compare readings of the hidden frames with their truth."""
    from rich.console import Console
    from rich.table import Table

    from fringeforce.base.storage import whole_file
    from fringeforce.scoring.scores import score as scored

    found = scored(folder, answers)
    table = Table("track", "frames", "answered", "rms [N]", "worst [N]", "inside 95 %", "wrong")
    for one in found:
        shares = [_percent(value) for value in (one.answered, one.inside, one.wrong)]
        newtons = [f"{value:.3g}" for value in (one.rms, one.worst)]
        table.add_row(one.track, str(one.frames), shares[0], *newtons, *shares[1:])
    Console().print(table)
    if output is not None:
        rows = [
            {key: None if value != value else value for key, value in asdict(one).items()}
            for one in found
        ]
        with whole_file(output) as place:
            place.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


def _percent(share: float) -> str:
    return "-" if math.isnan(share) else f"{share:.1%}".replace("%", " %")
