"""Commands that make a model agree with a bench: plan, calibrate, check, update."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fringeforce.base.errors import InputError
from fringeforce.base.words import counted
from fringeforce.cli.arguments import (
    Design,
    Model,
    RegionFile,
    draw_beside,
    frames_and_times,
    is_model,
    quantity,
    writable,
)
from fringeforce.cli.progress import progress_bar

Parameters = Annotated[
    list[str] | None,
    typer.Option(
        metavar="<name>",
        help="Estimate this value of the design, such as "
        "transducer.photoelastic.stress_optic_coefficient, and no others; give it again for more. "
        "Without it, all that loads can tell are estimated.",
    ),
]
LOADS = "CSV of known loads with the columns frame, tactel or x_mm, normal_N, tangential_N."
BESIDE_TACTELS = {
    "pad": "presses lie beside the tactels: read as contacts anywhere",
    "strip": "presses lie beside the tactels, whose forces do not explain them: check with presses "
    "on tactels, or calibrate a design with a skin, which reads contacts anywhere",
}
Loads = Annotated[Path, typer.Argument(help=LOADS)]
Output = Annotated[
    Path, typer.Option("-o", "--output", metavar="<file>", help="Model file to write (HDF5).")
]


def plan(
    source: Annotated[
        str, typer.Argument(help="Design file, shipped design, or a calibrated model to improve.")
    ],
    presses: Annotated[
        int, typer.Option(metavar="<count>", help="Number of calibration loads, a frame each.")
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="<file>", help="CSV of loads to write.")
    ],
    largest: Annotated[
        str,
        typer.Option(
            metavar="<force>", help="Largest force of one calibration load, such as '500 mN'."
        ),
    ] = "3 N",
    friction: Annotated[
        float | None,
        typer.Option(
            metavar="<ratio>",
            help="Coefficient of friction, such as 0.8: contacts slip beyond |T| = friction N; "
            "without it T can act alone.",
        ),
    ] = None,
    density: Annotated[
        float,
        typer.Option(metavar="<number>", help="Largest density of fringes, in fringes per pixel."),
    ] = 0.2,
    together: Annotated[
        int,
        typer.Option(metavar="<count>", help="Tactels that can be pressed at a time, 1 or 2."),
    ] = 1,
    parameter: Parameters = None,
    plot: Annotated[bool, typer.Option("--plot", help="Draw the gain beside the CSV.")] = False,
) -> None:
    """Propose the loads that teach a calibration most.

    They are on tactels, or by position. A text file beside the table says the same in words, a line
    for each load.
    """
    from fringeforce.base.storage import whole_file
    from fringeforce.calibration.planning.candidates import Limits
    from fringeforce.calibration.planning.plan import plan_presses
    from fringeforce.design.files import load_sensor
    from fringeforce.io.bench_loads import save_bench_loads
    from fringeforce.models.files import load_model
    from fringeforce.plotting.figures import draw_plan
    from fringeforce.studies.summary import plan_summary

    writable(output, "tables", source)
    if is_model(source):
        known = load_model(Path(source))
        sensor = known.sensor
    else:
        known = sensor = load_sensor(source)
    limits = Limits(_newtons(largest), friction, density, together)
    with progress_bar("Planning") as advance:
        found = plan_presses(known, presses, parameter, limits, progress=advance)
    save_bench_loads(output, found.presses)
    print(f"{output}: {counted(presses, 'calibration loads')}, the most worthwhile first")
    instructions = output.with_suffix(".txt")
    words = [f"frame {frame}: {said}" for frame, said in enumerate(found.words)]
    with whole_file(instructions) as path:
        path.write_text("\n".join([*words, ""]), encoding="utf-8")
    print(f"{instructions}: the same in words, such as {words[0]!r}")
    print("\n".join(plan_summary(found, sensor)))
    if plot:
        draw_beside(output, "the gain drawn", lambda path: draw_plan(found.ratio, path))


def calibrate(
    design: Design,
    frames: Annotated[
        Path,
        typer.Option(metavar="<file>", help="Frames: .h5, .npy, .png or .tiff, a row each."),
    ],
    loads: Annotated[Path, typer.Option(metavar="<file>", help=LOADS)],
    output: Output,
    parameter: Parameters = None,
    dark: Annotated[
        Path | None,
        typer.Option(metavar="<file>", help="Frames with the light off; strips only."),
    ] = None,
    unloaded: Annotated[
        Path | None,
        typer.Option(metavar="<file>", help="Frames without load, polarisers crossed."),
    ] = None,
    bright: Annotated[
        Path | None,
        typer.Option(
            metavar="<file>",
            help="Frames without load, the analyser turned by 90 degrees; strips only.",
        ),
    ] = None,
    fps: Annotated[
        float | None,
        typer.Option(
            metavar="<Hz>",
            help="Frames per second, for loads by time, if the frames have no times.",
        ),
    ] = None,
    aside: Annotated[
        int,
        typer.Option(
            metavar="<number>",
            help="Check the model by loaded frames that it was not fitted to: 5 sets every fifth "
            "aside, 0 none.",
        ),
    ] = 5,
    columns: Annotated[
        bool,
        typer.Option(
            "--columns",
            help="Also fit corrections to the columns that no design value explains; strips only.",
        ),
    ] = False,
    cell_gain: Annotated[
        float,
        typer.Option(
            metavar="<share>",
            help="Standard deviation of the load cell's gain, such as 0.01 for 1 %.",
        ),
    ] = 0.0,
    cell_zero: Annotated[
        str | None,
        typer.Option(
            metavar="<force>",
            help="Standard deviation of the load cell's zero, such as '20 mN'; none if not given.",
        ),
    ] = None,
    plot: Annotated[
        bool, typer.Option(help="Draw what the model leaves of the frames, beside the model.")
    ] = True,
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="<file>",
            help="HTML page to write: verdict, residuals, fields, contacts and values.",
        ),
    ] = None,
    region: RegionFile = None,
) -> None:
    """Fit a model to frames of your sensor under known loads.

    Ends with status 1 if the model must not be used.

    Loads are a table of tactels, of presses by position (x_mm, of a pad x_mm and y_mm), or a log by
    time (time_s).
    """
    from fringeforce.calibration.calibrate import calibrate as calibrated
    from fringeforce.calibration.light.references import References
    from fringeforce.calibration.load_log import LoadLog
    from fringeforce.calibration.planning.plan import next_presses
    from fringeforce.design.files import load_sensor
    from fringeforce.io.bench_loads import load_bench_loads, load_frame_times
    from fringeforce.plotting.calibration_report import calibration_report
    from fringeforce.plotting.figures import draw_residuals
    from fringeforce.studies.summary import calibration_summary

    writable(output, "models", design, frames, loads)
    writable(report, "files", design, frames, loads)
    zero = 0.0 if cell_zero is None else quantity("--cell-zero", cell_zero, "newton")
    sensor = load_sensor(design)
    images, times = frames_and_times(frames, sensor, region)
    known = load_bench_loads(loads, sensor, len(images))
    by_time = isinstance(known, LoadLog)
    if not by_time:
        times = None
    elif times is None or fps is not None:
        times = load_frame_times(frames, len(images), fps)
    forces = None if by_time or known.tactels is None else known.on_tactels(sensor.tactels.total)
    given_loads = known
    if columns:
        if forces is None:
            raise InputError("--columns corrects the columns of tactels; give loads of tactels.")
        given_loads = forces
    given = (
        None if path is None else frames_and_times(path, sensor, region)[0]
        for path in (dark, unloaded, bright)
    )
    references = References(*given)
    with progress_bar("Calibrating") as advance:
        model = calibrated(
            sensor,
            images,
            given_loads,
            parameter,
            advance,
            references,
            columns,
            times=times,
            aside=aside,
            load_cell=(cell_gain, zero),
        )
    model.save(output)
    print(f"{output}: calibrated on {counted(len(images), 'frames')}")
    print("\n".join(calibration_summary(model)))
    if forces is not None:
        print(next_presses(model, forces))
    if plot:
        draw_beside(
            output,
            "what the model leaves of the frames, in units of the noise",
            lambda path: draw_residuals(model, path),
        )
    if report is not None:
        calibration_report(model, report)
        print(f"{report}: the calibration in pictures")
    if model.calibration is not None and not model.calibration.usable:
        raise typer.Exit(1)


def check(
    model: Model,
    frames: Annotated[Path, typer.Argument(help="Frames that the model has not seen.")],
    loads: Loads,
    fps: Annotated[
        float | None,
        typer.Option(
            metavar="<Hz>",
            help="Frames per second, for loads by time, if the frames have no times.",
        ),
    ] = None,
) -> None:
    """Compare readings with known loads.

    Ends with status 1 if a frame contradicts them.

    Loads are a table of tactels, of presses by position (x_mm, of a pad x_mm and y_mm), or a log by
    time (time_s). Of the last two the whole force and its centre are compared, not the forces of
    tactels; a pad reads presses beside its tactels as contacts anywhere.
    """
    from fringeforce.calibration.load_log import LoadLog
    from fringeforce.calibration.verification import verify
    from fringeforce.io.bench_loads import load_bench_loads, load_frame_times
    from fringeforce.io.frames import load_frames
    from fringeforce.models.files import load_model

    sensor_model = load_model(model)
    images = load_frames(frames, sensor_model.sensor.dimensions)
    known = load_bench_loads(loads, sensor_model.sensor, len(images))
    by_time = isinstance(known, LoadLog)
    times = load_frame_times(frames, len(images), fps) if by_time else None
    found = verify(sensor_model, images, known, times=times)
    print("frames: " + ", ".join(f"{count} {name}" for name, count in found.statuses.items()))
    if found.beside:
        print(BESIDE_TACTELS[sensor_model.sensor.kind])
    print(f"error {found.error:.3g} N rms, stated {found.stated:.3g} N")
    if found.places is not None:
        off, stated = (1e3 * value for value in found.places)
        each = " along each axis" if sensor_model.sensor.dimensions > 1 else ""
        print(f"centre of pressure off by {off:.3g} mm rms{each}, stated {stated:.3g} mm")
    print(f"95 % intervals hold {1e2 * found.coverage:.1f} % of the forces")
    if found.wrong:
        print("readings contradict the loads of frames " + ", ".join(map(str, found.wrong)))
    print("passed" if found.passed else "failed")
    if not found.passed:
        raise typer.Exit(1)


def update(
    model: Model,
    frames: Annotated[Path, typer.Argument(help="Frames, under loads that nobody need know.")],
    output: Output,
    loads: Annotated[
        Path | None,
        typer.Option(
            metavar="<file>",
            help="CSV of the loads, if they are known: of tactels, by position or by time.",
        ),
    ] = None,
    fps: Annotated[
        float | None,
        typer.Option(
            metavar="<Hz>",
            help="Frames per second, for loads by time, if the frames have no times.",
        ),
    ] = None,
    unloaded: Annotated[
        bool, typer.Option("--unloaded", help="Nothing touches the sensor in any of the frames.")
    ] = False,
    light: Annotated[
        float,
        typer.Option(
            metavar="<share>", help="How far the light may have changed, as a share of it."
        ),
    ] = 0.05,
    residual: Annotated[
        str,
        typer.Option(
            metavar="<angle>", help="How far the retardance without load may have changed."
        ),
    ] = "0.1 rad",
    shift: Annotated[
        str, typer.Option(metavar="<length>", help="How far the camera may have moved.")
    ] = "0.1 mm",
    scale: Annotated[
        float,
        typer.Option(
            metavar="<share>",
            help="How far its magnification may have changed, as a share of it.",
        ),
    ] = 0.001,
    crosstalk: Annotated[
        float,
        typer.Option(
            metavar="<share>",
            help="How far the cross-talk of channels may have changed, as a share of the light.",
        ),
    ] = 0.01,
) -> None:
    """Find drift since the calibration, in frames of any loads.

    It finds how light, residual retardance and the place of the camera changed; of several channels
    the light of each, and cross-talk.

    Ends with status 1 if no drift explains the frames.

    Nobody need know the loads. If you know them, --loads takes them as `calibrate` does: a table of
    tactels, of presses by position (x_mm, of a pad also y_mm), or a log by time (time_s). They also
    tell the scale of an influence matrix that the design gives.

    --light, --residual, --shift, --scale and --crosstalk each state a standard deviation.
    """
    from fringeforce.calibration.drift import update as updated
    from fringeforce.calibration.drift_report import Drift
    from fringeforce.calibration.load_log import LoadLog
    from fringeforce.io.bench_loads import load_bench_loads, load_frame_times
    from fringeforce.io.frames import load_frames
    from fringeforce.models.files import load_model

    writable(output, "models", frames, loads)
    drift = Drift(
        light=light,
        residual=quantity("--residual", residual, "radian"),
        shift=quantity("--shift", shift, "meter"),
        scale=scale,
        crosstalk=crosstalk,
    )
    calibrated = load_model(model)
    images = load_frames(frames, calibrated.sensor.dimensions)
    known = times = None
    if loads is not None:
        known = load_bench_loads(loads, calibrated.sensor, len(images))
        if isinstance(known, LoadLog):
            times = load_frame_times(frames, len(images), fps)
    with progress_bar("Updating") as advance:
        found = updated(
            calibrated,
            images,
            loads=known,
            unloaded=unloaded,
            drift=drift,
            progress=advance,
            times=times,
        )
    found.save(output)
    print(f"{output}: {model} brought up to date with {counted(len(images), 'frames')}")
    assert found.calibration is not None
    print("\n".join(found.calibration.findings))
    if not found.calibration.usable:
        raise typer.Exit(1)


def creep(
    model: Model,
    frames: Annotated[Path, typer.Argument(help="Frames of loads that are pressed and held.")],
    loads: Loads,
    output: Output,
    fps: Annotated[
        float | None,
        typer.Option(metavar="<Hz>", help="Frames per second, if the frames have no times."),
    ] = None,
) -> None:
    """Find how the layers relax, from loads held and released.

    Loads are a table by frame, linear from one frame to the next, or a log by time, whose constant
    delay is found.
    """
    from fringeforce.calibration.relaxation import find_relaxation
    from fringeforce.io.bench_loads import load_bench_loads, load_frame_times
    from fringeforce.io.frames import load_frames
    from fringeforce.models.files import load_model

    writable(output, "models", frames, loads)
    elastic, images = load_model(model), load_frames(frames)
    known = load_bench_loads(loads, elastic.sensor, len(images))
    times = load_frame_times(frames, len(images), fps)
    found = find_relaxation(elastic, images, known, times)
    found.save(output)
    terms, stds = found.sensor.transducer.relaxation, found.sensor.tolerances
    found_terms = counted(len(terms), "terms") if terms else "no terms"
    print(f"{output}: {found_terms} of relaxation from {counted(len(images), 'frames')}")
    for number, term in enumerate(terms):
        share, time = (stds[f"transducer.relaxation.{number}.{key}"] for key in ("share", "time"))
        print(
            f"  {1e2 * term.share:.2f} +/- {1e2 * share:.2f} % of the modulus in "
            f"{term.time:.3g} +/- {time:.2g} s"
        )


def _newtons(text: str) -> float:
    return quantity("--largest", text, "newton")
