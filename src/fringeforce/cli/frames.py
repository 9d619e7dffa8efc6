"""Commands from forces to frames and back: simulate, read."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fringeforce.base.words import counted
from fringeforce.cli.arguments import (
    Frames,
    Friction,
    Mask,
    ModelOrDesign,
    RegionFile,
    Temperature,
    Tolerance,
    counted_frames,
    draw_beside,
    frames_and_times,
    sensor_and_model,
    stated_mask,
    stated_tolerances,
    temperatures,
    writable,
)
from fringeforce.cli.progress import compiling, progress_bar

if TYPE_CHECKING:
    from fringeforce.reading.reading import Reading

DIAGNOSED = 4
"""Refused frames of a recording that are diagnosed: each takes a second, or some."""


def simulate(
    model: ModelOrDesign,
    forces: Annotated[
        Path,
        typer.Argument(
            help="CSV of loads with the columns frame, tactel or x_mm, normal_N, tangential_N; of "
            "a pad also y_mm, and tangential_x_N, tangential_y_N."
        ),
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="<file>", help="Frames file to write (HDF5).")
    ],
    seed: Annotated[
        int,
        typer.Option(
            metavar="<number>",
            help="Start of the random numbers of the camera's noise: the same seed makes the same "
            "frames.",
        ),
    ] = 0,
    fps: Annotated[
        float | None,
        typer.Option(
            metavar="<Hz>",
            help="Frames per second, which the file keeps; a sensor that relaxes does not creep "
            "without.",
        ),
    ] = None,
    temperature: Temperature = None,
) -> None:
    """Simulate frames of the sensor's camera under given loads.

    Loads by place (x_mm) press over the width that the table states, and as lines without one.
    """
    from fringeforce.base.errors import InputError
    from fringeforce.calibration.bench_loads import BenchLoads
    from fringeforce.io.bench_loads import load_bench_loads, load_frame_times
    from fringeforce.io.frames import save_frames
    from fringeforce.models.strain_limit import strain_words

    if seed < 0:
        raise InputError(f"--seed {seed}: must be a whole number, 0 or more.")
    writable(output, "frames", model, forces)
    sensor, solved = sensor_and_model(model)
    loads = load_bench_loads(forces, sensor)
    if not isinstance(loads, BenchLoads):
        raise InputError(f"{forces} has times and no frames; give a column frame to simulate.")
    applied = loads.on_tactels(sensor.tactels.total) if loads.named else None
    touch = loads.presses() if applied is None else applied
    times = None if fps is None else load_frame_times(forces, len(touch), fps)
    warm = temperatures(temperature, times)
    state = {} if warm is None else {"temperature": warm}
    if times is not None:
        state["times"] = times
    found = solved()
    frames = found.expose(touch, rng=seed, **state)
    save_frames(output, frames, found.pixel_positions, applied, times)
    print(f"{output}: {counted_frames(frames.shape)}")
    if words := strain_words(found.sensor, touch):
        print(f"  {words}")


def read(
    model: ModelOrDesign,
    frames: Frames,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="<file>", help="CSV of forces to write.")
    ],
    plot: Annotated[bool, typer.Option("--plot", help="Draw the forces beside the CSV.")] = False,
    friction: Friction = None,
    tolerance: Tolerance = None,
    mask: Mask = None,
    region: RegionFile = None,
    fps: Annotated[
        float | None,
        typer.Option(
            metavar="<Hz>",
            help="Frames per second of a sensor that relaxes, if they have no times.",
        ),
    ] = None,
    temperature: Temperature = None,
) -> None:
    """Read forces from frames, with deviations and verdicts.

    Ends with status 1, and draws nothing, if none of the frames can be used.
    """
    import numpy as np

    from fringeforce.io.bench_loads import load_frame_times
    from fringeforce.io.frames import load_applied
    from fringeforce.io.tables import save_contacts, save_readings
    from fringeforce.models.creep import creeps
    from fringeforce.plotting.readings import draw_readings
    from fringeforce.reading.frame_reader import check_friction
    from fringeforce.reading.reader import Reader
    from fringeforce.reading.temperature import checked_scales

    writable(output, "tables", model, frames)
    sensor, solved = sensor_and_model(model, stated_tolerances(tolerance))
    images, times = frames_and_times(frames, sensor, region)
    _check_shape(frames, images.shape, sensor.frame_shape)
    if fps is not None:
        times = load_frame_times(frames, len(images), fps)
    masked = stated_mask(mask, sensor)
    warm = temperatures(temperature, times)
    each = None if warm is None else np.broadcast_to(warm, len(images))
    check_friction(sensor, friction)
    checked_scales(sensor, warm, len(images))
    if times is None and sensor.dimensions == 1 and creeps(sensor.transducer):
        times = load_frame_times(frames, len(images))
    reader = Reader(solved(), friction)
    readings: Any = []
    with compiling(), progress_bar() as advance:
        for reading in reader.stream(images, masked, times, each):
            readings.append(reading)
            advance("Reading", len(readings), len(images))
    if getattr(sensor, "skin", None) is not None:
        statuses = save_contacts(output, readings, sensor.components)
    else:
        statuses = save_readings(output, readings, sensor.components)
    verdicts = ", ".join(f"{count} {name}" for name, count in statuses.items())
    print(f"{output}: {counted(len(readings), 'frames')}, {verdicts}")
    for status, reading in {reading.status: reading for reading in readings}.items():
        if status.name != "OK":
            print(f"  {reason(reading)}")
    for detail in dict.fromkeys(one.detail for one in readings if one.ok and one.detail):
        print(f"  {detail}")
    for finding in _findings(readings):
        print(f"  {finding}")
    if not any(reading.status.usable for reading in readings):
        print("None of the frames can be used.")
        raise typer.Exit(1)
    if plot:
        applied = load_applied(frames) if region is None else None
        draw = partial(draw_readings, sensor, readings, applied=applied)
        draw_beside(output, "the forces drawn", draw)


def reason(reading: Reading) -> str:
    """Why a frame has its verdict, and what to do."""
    words = f"{reading.detail} {reading.status.advice}".strip()
    return f"{reading.status.name}: {words}"


def _check_shape(path: Path, shape: tuple[int, ...], wanted: tuple[int, ...]) -> None:
    """Refuse frames that are not what the model's camera takes, before every one is refused."""
    if shape[1:] == wanted:
        return
    from fringeforce.base.errors import InputError

    given, own = (" x ".join(map(str, sizes)) for sizes in (shape, wanted))
    if len(wanted) == 1 and len(shape) == 2:
        raise InputError(
            f"{path}: {given} looks like a picture, or like {shape[0]} lines of {shape[1]} pixels; "
            f"the model's camera has {own}. Of pictures, run fringeforce extract; for "
            f"lines, state pixels = {shape[1]} in the design and calibrate or characterize anew."
        )
    frame = " x ".join(map(str, shape[1:]))
    remedy = (
        "Rows run along x: transpose the images."
        if shape[1:] == wanted[::-1]
        else "Give frames of that camera, or state this one in the design and characterize anew."
    )
    raise InputError(f"{path}: frames of {frame} pixels; the model's camera takes {own}. {remedy}")


def _findings(readings: Sequence[Reading]) -> list[str]:
    """What seems wrong with the sensor, each departure once, in refused frames evenly spread."""
    from fringeforce.reading.reading import Status

    refused = [reading for reading in readings if reading.status is Status.MODEL_MISMATCH]
    step = max(len(refused) / DIAGNOSED, 1.0)
    some = [refused[int(place * step)] for place in range(min(len(refused), DIAGNOSED))]
    told: dict[str, str] = {}
    with progress_bar() as advance:
        for done, reading in enumerate(some, 1):
            for finding in reading.findings:
                # sizes differ from frame to frame
                told.setdefault(re.sub(r"-?\d[\d.e-]*", "", finding), finding)
            advance("Diagnosing", done, len(some))
    return list(told.values())
