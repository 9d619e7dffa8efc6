"""The command line: every command is one library call with a file on either side."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

# all matrices here are small: threads of the linear algebra only get in each other's way
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

app = typer.Typer(
    name="fringeforce",
    help="Turn the drawing of a photoelastic tactile sensor into a force instrument.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
)

Design = Annotated[str, typer.Argument(help="Design file, or the name of a shipped design.")]
Model = Annotated[Path, typer.Argument(help="Model file that `characterize` wrote.")]


def main() -> None:
    """Run the command line; bad input ends with status 2 and what to do about it."""
    from fringeforce.errors import FringeforceError

    try:
        app()
    except FringeforceError as error:
        print(f"fringeforce: {error}", file=sys.stderr)
        sys.exit(2)


@app.callback(invoke_without_command=True)
def _version(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if version:
        import fringeforce

        print(fringeforce.__version__)


@app.command()
def new(
    path: Annotated[Path, typer.Argument(help="Design file to write.")] = Path("sensor.toml"),
    like: Annotated[str, typer.Option(help="Shipped design to start from.")] = "saad",
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Write a commented design file to start from."""
    from fringeforce.design import new_design

    new_design(path, like, overwrite=force)
    print(f"{path}: edit it, then run  fringeforce characterize {path} -o model.h5")


@app.command()
def characterize(
    design: Design,
    output: Annotated[Path, typer.Option("-o", "--output", help="Model file to write.")],
    mesh: Annotated[
        str, typer.Option(help="'default', or 'paper' for the 201 x 25 linear nodes of the paper.")
    ] = "default",
) -> None:
    """Reduce a design to its influence matrix, with finite elements."""
    from fringeforce.design import load_sensor
    from fringeforce.model import characterize, named_mesh

    sensor = load_sensor(design)
    model = characterize(sensor, named_mesh(mesh, sensor))
    model.save(output)
    print(
        f"{output}: {sensor.name}; {len(model.x)} stations, {model.provenance['unknowns']} unknowns"
    )


@app.command()
def show(
    model: Annotated[str, typer.Argument(help="Model file, design file or shipped design.")],
) -> None:
    """Summarise a sensor: sizes, sensitivity, conditioning, fringe density, strain."""
    from fringeforce.design import load_sensor
    from fringeforce.files import load_model
    from fringeforce.model import characterize
    from fringeforce.summary import summary

    found = load_model(model) if _is_hdf5(model) else characterize(load_sensor(model))
    facts = summary(found)
    width = max(len(name) for name, _ in facts)
    print(found.sensor.name)
    for name, value in facts:
        print(f"  {name:<{width}}  {value}")


@app.command()
def simulate(
    model: Model,
    forces: Annotated[Path, typer.Argument(help="CSV of loads: frame, tactel, normal_N, ...")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Frames file to write (HDF5).")],
    seed: Annotated[int, typer.Option(help="Seed of the camera's noise.")] = 0,
) -> None:
    """Expose frames as the sensor's camera would deliver them."""
    from fringeforce.files import load_model, save_frames
    from fringeforce.tables import load_forces

    sensor_model = load_model(model)
    loads = load_forces(forces, sensor_model.sensor.tactels.count)
    frames = sensor_model.expose(loads, rng=seed)
    save_frames(output, frames, sensor_model.pixel_positions, loads)
    print(f"{output}: {len(frames)} frames of {frames.shape[1]} pixels")


@app.command()
def read(
    model: Model,
    frames: Annotated[Path, typer.Argument(help="Frames: .h5, .npy, .png or .tiff, a row each.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="CSV of forces to write.")],
    plot: Annotated[bool, typer.Option("--plot", help="Draw the forces beside the CSV.")] = False,
    friction: Annotated[
        float | None, typer.Option(help="Limit forces to N >= 0 and |T| <= friction N.")
    ] = None,
    model_error: Annotated[
        float, typer.Option(help="Relative error of shape of an uncalibrated model, such as 0.03.")
    ] = 0.0,
) -> None:
    """Read forces from frames, with their deviations and a verdict for each."""
    from rich.progress import track

    from fringeforce.files import load_frames, load_model
    from fringeforce.reader import Reader
    from fringeforce.report import draw_readings
    from fringeforce.tables import save_readings

    reader = Reader(load_model(model), friction, model_error)
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


Loads = Annotated[Path, typer.Argument(help="CSV of known loads: frame, tactel, normal_N, ...")]


@app.command()
def calibrate(
    design: Design,
    frames: Annotated[Path, typer.Option(help="Frames: .h5, .npy, .png or .tiff, a row each.")],
    loads: Annotated[Path, typer.Option(help="CSV of known loads: frame, tactel, normal_N, ...")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Model file to write.")],
    parameter: Annotated[
        list[str] | None, typer.Option(help="Design value to estimate, a dotted path; repeatable.")
    ] = None,
) -> None:
    """Make the model agree with the sensor on the bench, from frames with known loads."""
    from rich.console import Console
    from rich.progress import Progress

    from fringeforce.calibration import PARAMETERS
    from fringeforce.calibration import calibrate as calibrated
    from fringeforce.design import load_sensor
    from fringeforce.files import load_frames
    from fringeforce.summary import calibration_summary
    from fringeforce.tables import load_forces

    sensor = load_sensor(design)
    images, forces = load_frames(frames), load_forces(loads, sensor.tactels.count)
    with Progress(console=Console(stderr=True), disable=not sys.stderr.isatty()) as progress:
        task = progress.add_task("Calibrating")

        def advance(title: str, done: int, expected: int) -> None:
            progress.update(task, description=title, completed=done, total=expected)

        model = calibrated(sensor, images, forces, parameter or PARAMETERS, advance)
    model.save(output)
    print(f"{output}: calibrated on {len(images)} frames")
    print("\n".join(calibration_summary(model)))


@app.command()
def check(
    model: Model,
    frames: Annotated[Path, typer.Argument(help="Frames that the model has not seen.")],
    loads: Loads,
) -> None:
    """Compare readings with known loads; ends with status 1 if a frame contradicts them."""
    from fringeforce.files import load_frames, load_model
    from fringeforce.tables import load_forces
    from fringeforce.verification import verify

    sensor_model = load_model(model)
    forces = load_forces(loads, sensor_model.sensor.tactels.count)
    found = verify(sensor_model, load_frames(frames), forces)
    print("frames: " + ", ".join(f"{count} {name}" for name, count in found.statuses.items()))
    print(f"error {found.error:.3g} N rms, stated {found.stated:.3g} N")
    print(f"95 % intervals hold {found.coverage:.1%} of the forces")
    if found.wrong:
        print("readings contradict the loads of frames " + ", ".join(map(str, found.wrong)))
    print("passed" if found.passed else "failed")
    if not found.passed:
        raise typer.Exit(1)


@app.command()
def reproduce(
    design: Design = "saad",
    out: Annotated[
        Path, typer.Option("--out", help="Folder for the pictures and the page.")
    ] = Path("demo"),
) -> None:
    """Reproduce the paper's figures and statements as one page."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    from fringeforce.design import load_sensor
    from fringeforce.report import reproduce

    sensor = load_sensor(design)
    columns = TextColumn("{task.description:<52}"), BarColumn(), MofNCompleteColumn()
    with Progress(*columns) as progress:
        task = progress.add_task("Characterising")

        def advance(title: str, number: int, count: int) -> None:
            progress.update(task, description=title, completed=number, total=count)

        page = reproduce(sensor, out, advance)
    print(f"Open {page} in a browser.")


def _is_hdf5(path: str) -> bool:
    from h5py import is_hdf5

    return Path(path).suffix.lower() in (".h5", ".hdf5", ".nc") or is_hdf5(path)
