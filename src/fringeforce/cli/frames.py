"""Commands from forces to frames and back: simulate, read."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from fringeforce.cli.arguments import (
    Frames,
    Friction,
    Model,
    Tolerance,
    draw_beside,
    with_tolerances,
)
from fringeforce.cli.progress import progress_bar


def simulate(
    model: Model,
    forces: Annotated[
        Path,
        typer.Argument(
            help="CSV of loads: frame, tactel, normal_N, tangential_N; a pad: tangential_x_N, _y_N."
        ),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="Frames file to write (HDF5).")],
    seed: Annotated[int, typer.Option(help="Seed of the camera's noise.")] = 0,
) -> None:
    """Expose frames as the sensor's camera would deliver them."""
    from fringeforce.io.frames import save_frames
    from fringeforce.io.tables import load_forces
    from fringeforce.models.files import load_model

    found = load_model(model)
    loads = load_forces(forces, found.sensor.tactels.total, found.sensor.components)
    frames = found.expose(loads, rng=seed)
    save_frames(output, frames, found.pixel_positions, loads)
    print(f"{output}: {len(frames)} frames of {' x '.join(map(str, frames.shape[1:]))} pixels")


def read(
    model: Model,
    frames: Frames,
    output: Annotated[Path, typer.Option("-o", "--output", help="CSV of forces to write.")],
    plot: Annotated[bool, typer.Option("--plot", help="Draw the forces beside the CSV.")] = False,
    friction: Friction = None,
    tolerance: Tolerance = None,
) -> None:
    """Read forces from frames, with their deviations and a verdict for each."""
    from fringeforce.io.frames import load_frames
    from fringeforce.io.tables import save_readings
    from fringeforce.models.files import load_model
    from fringeforce.plotting.figures import draw_readings
    from fringeforce.reading.reader import Reader

    found = with_tolerances(load_model(model), tolerance)
    sensor, reader = found.sensor, Reader(found, friction)
    images = load_frames(frames, sensor.dimensions)
    readings: Any = []
    with progress_bar() as advance:
        for reading in reader.stream(images):
            readings.append(reading)
            advance("Reading", len(readings), len(images))
    statuses = save_readings(output, readings, sensor.components)
    print(f"{output}: " + ", ".join(f"{count} {name}" for name, count in statuses.items()))
    for status in {reading.status: reading for reading in readings}:
        if status.name != "OK":
            print(f"  {status.name}: {status.advice}")
    if plot:
        draw_beside(output, "the forces drawn", partial(draw_readings, sensor, readings))
