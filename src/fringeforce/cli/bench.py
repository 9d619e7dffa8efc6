"""Commands for frames with known loads: calibrate, check."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fringeforce.cli.arguments import Design, Model
from fringeforce.cli.progress import progress_bar

Loads = Annotated[Path, typer.Argument(help="CSV of known loads: frame, tactel, normal_N, ...")]


def calibrate(
    design: Design,
    frames: Annotated[Path, typer.Option(help="Frames: .h5, .npy, .png or .tiff, a row each.")],
    loads: Annotated[Path, typer.Option(help="CSV of known loads: frame, tactel, normal_N, ...")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Model file to write.")],
    parameter: Annotated[
        list[str] | None, typer.Option(help="Design value to estimate, a dotted path; repeatable.")
    ] = None,
    dark: Annotated[Path | None, typer.Option(help="Frames with the light off.")] = None,
    unloaded: Annotated[
        Path | None, typer.Option(help="Frames without load, polarisers crossed.")
    ] = None,
    bright: Annotated[
        Path | None, typer.Option(help="Frames without load, the analyser turned by 90 degrees.")
    ] = None,
    columns: Annotated[
        bool, typer.Option("--columns", help="Also correct the matrix where no value can.")
    ] = False,
    plot: Annotated[
        bool, typer.Option(help="Draw what the model leaves of the frames, beside the model.")
    ] = True,
) -> None:
    """Make the model agree with the sensor on the bench, from frames with known loads."""
    from fringeforce.calibration.calibrate import PARAMETERS
    from fringeforce.calibration.calibrate import calibrate as calibrated
    from fringeforce.calibration.light.references import References
    from fringeforce.calibration.planning.plan import next_presses
    from fringeforce.design.files import load_strip
    from fringeforce.io.frames import load_frames
    from fringeforce.io.tables import load_forces
    from fringeforce.plotting.figures import draw_residuals
    from fringeforce.studies.summary import calibration_summary

    sensor = load_strip(design)
    images, forces = load_frames(frames), load_forces(loads, sensor.tactels.count)
    given = (None if path is None else load_frames(path) for path in (dark, unloaded, bright))
    references = References(*given)
    with progress_bar("Calibrating") as advance:
        model = calibrated(
            sensor, images, forces, parameter or PARAMETERS, advance, references, columns
        )
    model.save(output)
    print(f"{output}: calibrated on {len(images)} frames")
    print("\n".join([*calibration_summary(model), next_presses(model, forces)]))
    if plot:
        picture = output.with_suffix(".png")
        draw_residuals(model, images, forces, picture)
        print(f"{picture}: what the model leaves of the frames, in units of the noise")


def check(
    model: Model,
    frames: Annotated[Path, typer.Argument(help="Frames that the model has not seen.")],
    loads: Loads,
) -> None:
    """Compare readings with known loads; ends with status 1 if a frame contradicts them."""
    from fringeforce.calibration.verification import verify
    from fringeforce.io.frames import load_frames
    from fringeforce.io.tables import load_forces
    from fringeforce.models.files import load_strip_model

    sensor_model = load_strip_model(model)
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
