"""Commands from forces to frames and back: simulate, read."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from fringeforce.cli.arguments import Frames, Friction, Model, ModelError


def simulate(
    model: Model,
    forces: Annotated[Path, typer.Argument(help="CSV of loads: frame, tactel, normal_N, ...")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Frames file to write (HDF5).")],
    seed: Annotated[int, typer.Option(help="Seed of the camera's noise.")] = 0,
) -> None:
    """Expose frames as the sensor's camera would deliver them."""
    from fringeforce.files import load_strip_model, save_frames
    from fringeforce.tables import load_forces

    sensor_model = load_strip_model(model)
    loads = load_forces(forces, sensor_model.sensor.tactels.count)
    frames = sensor_model.expose(loads, rng=seed)
    save_frames(output, frames, sensor_model.pixel_positions, loads)
    print(f"{output}: {len(frames)} frames of {frames.shape[1]} pixels")


def read(
    model: Model,
    frames: Frames,
    output: Annotated[Path, typer.Option("-o", "--output", help="CSV of forces to write.")],
    plot: Annotated[bool, typer.Option("--plot", help="Draw the forces beside the CSV.")] = False,
    friction: Friction = None,
    model_error: ModelError = 0.0,
) -> None:
    """Read forces from frames, with their deviations and a verdict for each."""
    from rich.progress import track

    from fringeforce.files import load_frames, load_strip_model
    from fringeforce.pictures import draw_readings
    from fringeforce.reading.reader import Reader
    from fringeforce.tables import save_readings

    reader = Reader(load_strip_model(model), friction, model_error)
    images = load_frames(frames)
    readings = []
    for frame in track(images, "Reading", disable=not sys.stderr.isatty()):
        readings.append(reader.read(frame))
    statuses = save_readings(output, readings)
    print(f"{output}: " + ", ".join(f"{count} {name}" for name, count in statuses.items()))
    for status in {reading.status: reading for reading in readings}:
        if status.name != "OK":
            print(f"  {status.name}: {status.advice}")
    if plot:
        picture = output.with_suffix(".png")
        draw_readings(readings, picture)
        print(f"{picture}: the forces drawn")
