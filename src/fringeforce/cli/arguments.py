"""Arguments that several commands share."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from fringeforce.base.errors import InputError
from fringeforce.base.words import counted
from fringeforce.cli.progress import progress_bar
from fringeforce.design.shipped import shipped_designs, shipped_pads

SHIPPED = ", ".join([*shipped_designs(), *shipped_pads()])
Design = Annotated[
    str,
    typer.Argument(
        help="Design file, or a shipped design such as saad (`fringeforce new -h` lists all)."
    ),
]
Model = Annotated[Path, typer.Argument(help="Model file that `characterize` or `calibrate` wrote.")]
ModelOrDesign = Annotated[
    str,
    typer.Argument(
        help="Model file, or a design (a file or the name of a shipped one), which is solved first."
    ),
]
Frames = Annotated[
    Path,
    typer.Argument(
        help="File of frames (.h5, .npy, .png, .tiff): each row is a frame of a strip, each image "
        "one of a pad."
    ),
]
RegionFile = Annotated[
    Path | None,
    typer.Option(
        "--region",
        metavar="<file>",
        help="Where strip or pad is in pictures (`fringeforce extract --region`); frames may be "
        "pictures, videos and folders of them.",
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(metavar="<address>", help="Dask scheduler to use, such as tcp://127.0.0.1:8786."),
]
Friction = Annotated[
    float | None,
    typer.Option(
        metavar="<ratio>",
        help="Coefficient of friction, such as 0.8: limits forces to N >= 0, |T| <= friction N; "
        "no limit if not given.",
    ),
]
Tolerance = Annotated[
    list[str] | None,
    typer.Option(
        metavar="<value>",
        help="Design value to allow for, such as 'camera.shift = 0 +/- 0.05 mm'; give it again "
        "for more.",
    ),
]
Mask = Annotated[
    list[str] | None,
    typer.Option(
        metavar="<place|file>",
        help="Pixels to leave out, as under dirt or glare: a stretch of a strip such as '-0.4 to "
        "0.3 mm', or a picture or .npy file of a frame's size that is not zero there; give it "
        "again for more.",
    ),
]
Temperature = Annotated[
    str | None,
    typer.Option(
        metavar="<degC|file>",
        help="Temperature of the clear layer in degrees Celsius, such as 25; or a CSV log of it "
        "with the columns time_s, temperature_degC, whose times are those of the frames.",
    ),
]
Rate = Annotated[
    float | None,
    typer.Option(
        "--line-rate",
        "--frame-rate",
        metavar="<Hz>",
        help="Lines of a strip, or images of a pad, per second; the camera's own if not given.",
    ),
]
Exposure = Annotated[
    float | None,
    typer.Option(
        metavar="<seconds>",
        help="Exposure of a line or image, such as 0.001; the camera's own if not given.",
    ),
]
Workers = Annotated[
    int | None,
    typer.Option(
        metavar="<count>",
        help="Processes, 0 for none besides this one; one for each core if not given.",
    ),
]


OTHERS = {".csv", ".npy", ".png", ".tif", ".tiff", ".jpg", ".jpeg", ".bmp", ".mp4", ".avi"}
"""Endings of tables, arrays and pictures, which are neither models nor designs."""
PICTURES = ".png", ".jpg", ".jpeg", ".pdf", ".svg", ".tif", ".tiff"
"""Endings of pictures that are drawn."""
ZERO_CELSIUS = 273.15
"""Zero of the Celsius scale [K]."""
HOTTEST = 200.0
"""Above it no clear elastomer lasts; kelvin taken for degrees Celsius are [degC]."""


def stated_tolerances(stated: Sequence[str] | None) -> dict[str, str]:
    """Tolerances of a command line, as text by dotted path; InputError for what is none."""
    values = {}
    for text in stated or ():
        path, sign, value = text.partition("=")
        if not sign:
            raise InputError(
                f"--tolerance {text!r} has no '='; write it as in 'camera.shift = 0 +/- 0.05 mm'."
            )
        values[path.strip()] = value.strip().strip('"')
    return values


def stated_mask(stated: Sequence[str] | None, sensor: Any) -> Any:
    """Pixels to leave out of all frames, shape of a frame, or None; InputError for what is none."""
    if not stated:
        return None
    import numpy as np

    from fringeforce.base.storage import load_array

    mask = np.zeros(sensor.frame_shape, dtype=bool)
    for text in stated:
        if stretch := re.fullmatch(r"\s*(\S+)\s+to\s+(\S+)\s*([A-Za-z]+)\s*", text):
            if sensor.dimensions > 1:
                raise InputError(f"--mask {text!r} is a stretch of a strip; of a pad, give a file.")
            first, last = (
                quantity("--mask", f"{end} {stretch[3]}", "meter") for end in stretch.groups()[:2]
            )
            at = sensor.pixel_positions
            where = (at >= first) & (at <= last)
            if not where.any():
                raise InputError(
                    f"--mask {text!r} holds no pixel; the camera sees from {1e3 * at[0]:.3g} to "
                    f"{1e3 * at[-1]:.3g} mm. The smaller place comes first."
                )
        else:
            where = load_array(text) != 0
            if where.shape != mask.shape[-where.ndim :]:
                own, given = (" x ".join(map(str, one.shape)) for one in (mask, where))
                raise InputError(
                    f"--mask {text}: {given} pixels; a frame of this sensor has {own}. Give a file "
                    "of that size, or a stretch such as '-0.4 to 0.3 mm'."
                )
        mask |= where
    return mask


def frames_and_times(path: Path, sensor: Any, region: Path | None) -> tuple[Any, Any]:
    """Frames of a file, or of pictures with the strip in a region; times [s] or None."""
    from fringeforce.io.frames import load_frames, load_times
    from fringeforce.pictures.extraction import extract_frames
    from fringeforce.pictures.region import Region

    if region is None:
        return load_frames(path, sensor.dimensions), load_times(path)
    return extract_frames([path], sensor, Region.load(region))


def counted_frames(shape: tuple[int, ...]) -> str:
    """A number of frames and their pixels in words."""
    return f"{counted(shape[0], 'frames')} of {' x '.join(map(str, shape[1:]))} pixels"


def temperatures(stated: str | None, times: Any = None) -> Any:
    """Temperatures [K]: one, or one for each time from a log; none if none is stated."""
    import numpy as np

    from fringeforce.io.tables import load_temperatures

    if stated is None:
        return None
    try:
        one = float(stated.removesuffix("degC"))
    except ValueError:
        pass
    else:
        return in_kelvin(one, "--temperature")
    log = Path(stated)
    if not log.is_file():
        raise InputError(
            f"--temperature {stated!r} is neither a number of degrees Celsius, such as 25, nor a "
            "file; give one of them."
        )
    if times is None:
        raise InputError(f"{log} is a log by time, and the frames have no times; give --fps.")
    when, warm = load_temperatures(log)
    outside = (np.min(times) < when[0]) or (np.max(times) > when[-1])
    if outside:
        raise InputError(
            f"{log} covers {when[0]:g} s to {when[-1]:g} s, and the frames {np.min(times):g} s to "
            f"{np.max(times):g} s; give a log of all of them."
        )
    return in_kelvin(np.interp(times, when, warm), str(log))


def in_kelvin(celsius: Any, source: str) -> Any:
    """Temperatures in degrees Celsius as kelvin; InputError for ones that are kelvin already."""
    import numpy as np

    hottest = float(np.max(celsius))
    if hottest > HOTTEST:
        raise InputError(
            f"{source}: {hottest:g} is above {HOTTEST:g} degrees Celsius; give degrees Celsius, "
            f"such as {hottest - ZERO_CELSIUS:.4g} for {hottest:g} K."
        )
    return celsius + ZERO_CELSIUS


def is_model(path: str) -> bool:
    """Whether a path means a model file, and not a design."""
    from h5py import is_hdf5

    from fringeforce.base.storage import HDF5

    return Path(path).suffix.lower() in HDF5 or is_hdf5(path)


def sensor_and_model(
    path: str, tolerances: Mapping[str, str] | None = None
) -> tuple[Any, Callable[[], Any]]:
    """The sensor of a model file or of a design, at once, and what gives its model.

    A design is solved when its model is asked for, which takes seconds: what else is given can be
    looked at before.

    Parameters
    ----------
    path : str
        Model file, design file, or name of a shipped design.
    tolerances : mapping, optional
        As of `stated_tolerances`: what readings allow for besides.

    Raises
    ------
    FringeforceError
        If it is neither, or a tolerance is none of this sensor.
    """
    from fringeforce.design.files import load_sensor
    from fringeforce.models.characterization import characterize
    from fringeforce.models.files import load_model

    allowed = tolerances or {}
    if is_model(path):
        model = load_model(path)
        model = model.with_tolerances(**allowed) if allowed else model
        return model.sensor, lambda: model
    if Path(path).suffix.lower() in OTHERS:
        raise InputError(
            f"{path} is neither a model file (.h5) nor a design (.toml); give one of them as the "
            "first argument, and what it is used on as the next."
        )
    sensor = load_sensor(path)
    if allowed:
        sensor.replace(**allowed)  # refuses what is no tolerance of it

    def solved() -> Any:
        with progress_bar() as advance:
            found = characterize(sensor, progress=advance)
        return found.with_tolerances(**allowed) if allowed else found

    return sensor, solved


def model_of(path: str) -> Any:
    """The model in a file, or that of a design by finite elements."""
    return sensor_and_model(path)[1]()


def writable(output: Path | None, kind: str, *inputs: Path | str | None) -> None:
    """Refuse, before anything takes long, an output that could not be written or read again.

    Parameters
    ----------
    output : Path or None
        File to write, if any.
    kind : str
        What it will hold: "frames", "models", "results", "tables", "designs" or "pictures"; of
        "files" any ending is taken.
    *inputs : Path, str or None
        Files that the command reads, which it must not replace.

    Raises
    ------
    InputError
        If its name ends as another kind of file does, it is a folder, there is no folder for it,
        or it is one of the inputs.
    """
    if output is None:
        return
    from fringeforce.base.storage import HDF5

    endings = {
        **dict.fromkeys(("frames", "models", "results"), HDF5),
        "tables": (".csv",),
        "designs": (".toml",),
        "pictures": PICTURES,
    }
    allowed, suffix = endings.get(kind, ()), output.suffix.lower()
    foreign = {*OTHERS, *HDF5, ".toml"} - set(allowed) if allowed else set()
    if output.is_dir():
        raise InputError(f"{output} cannot be written: it is a folder; give the name of a file.")
    # frames are recognised by their ending alone, and it says what picture to write
    if suffix in foreign or (kind in ("frames", "pictures") and suffix not in allowed):
        raise InputError(
            f"{output}: this command writes {kind} there, whose names end in "
            f"{' or '.join(allowed)}, and not in {suffix!r}; give it another name."
        )
    if not output.parent.is_dir():
        raise InputError(
            f"{output} cannot be written: there is no folder {output.parent}; make it, or give "
            "another path."
        )
    read = [Path(given) for given in inputs if given is not None]
    if output.exists() and any(given.exists() and output.samefile(given) for given in read):
        raise InputError(
            f"{output} is read by this command and would be replaced; give the output another name."
        )


def usable_folder(folder: Path) -> None:
    """Refuse, before anything takes long, a folder for results that is a file; InputError."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} cannot be written to: it is a file; give the name of a folder.")


def draw_beside(output: Path, words: str, draw: Callable[[Path], object]) -> None:
    """Draw a picture beside a file that was written, and say what it shows."""
    picture = output.with_suffix(".png")
    draw(picture)
    print(f"{picture}: {words}")


def quantity(option: str, text: str, unit: str) -> float:
    """A number of an option in SI units, from text with a unit.

    Raises
    ------
    InputError
        If it is none.
    """
    from fringeforce.design.units import parse_quantity

    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        raise InputError(f"{option} {text!r} {error}.") from None
