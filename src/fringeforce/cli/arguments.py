"""Arguments that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

Design = Annotated[str, typer.Argument(help="Design file, or the name of a shipped design.")]
Model = Annotated[Path, typer.Argument(help="Model file that `characterize` or `calibrate` wrote.")]
Frames = Annotated[
    Path,
    typer.Argument(
        help="Frames: .h5, .npy, .png or .tiff; a row each, or an image each for a pad."
    ),
]
Scheduler = Annotated[
    str | None, typer.Option(help="Dask scheduler to use, such as tcp://127.0.0.1:8786.")
]
Friction = Annotated[
    float | None, typer.Option(help="Limit forces to N >= 0 and |T| <= friction N.")
]
ModelError = Annotated[
    float, typer.Option(help="Relative error of shape of an uncalibrated model, such as 0.03.")
]
Rate = Annotated[
    float | None,
    typer.Option("--line-rate", "--frame-rate", help="Lines, or images of a pad, per second."),
]
Exposure = Annotated[float | None, typer.Option(help="Exposure of a line or image in seconds.")]
Workers = Annotated[int | None, typer.Option(help="Processes; one for each core if not given.")]


def is_model(path: str) -> bool:
    """Whether a path means a model file, and not a design."""
    from h5py import is_hdf5

    from fringeforce.base.storage import HDF5

    return Path(path).suffix.lower() in HDF5 or is_hdf5(path)


def draw_beside(output: Path, words: str, draw: Callable[[Path], object]) -> None:
    """Draw a picture beside a file that was written, and say what it shows."""
    picture = output.with_suffix(".png")
    draw(picture)
    print(f"{picture}: {words}")
