"""The command from camera pictures to frames: extract."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fringeforce.cli.arguments import Design, counted_frames, writable

if TYPE_CHECKING:
    from fringeforce.pictures.region import Region

Pictures = Annotated[
    list[Path],
    typer.Argument(help="Pictures, videos, arrays of pictures (.npy), or folders of them."),
]


def extract(
    design: Design,
    pictures: Pictures,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", "--out", metavar="<file>", help="Frames file to write (HDF5)."
        ),
    ] = None,
    region: Annotated[
        Path | None,
        typer.Option(
            metavar="<file>",
            help="File of where the sensor is in the pictures (TOML): read if it is there, "
            "otherwise written.",
        ),
    ] = None,
    corners: Annotated[
        str | None,
        typer.Option(
            metavar="<points>",
            help='Corners of strip or pad, clockwise from small x: "column,row column,row ..."; '
            "found if not given.",
        ),
    ] = None,
    outline: Annotated[
        Path | None,
        typer.Option(
            metavar="<file>", help="Picture in which the whole strip is bright, to find it in."
        ),
    ] = None,
    preview: Annotated[
        Path | None,
        typer.Option(metavar="<file>", help="Picture to write of what was found (PNG)."),
    ] = None,
    bits: Annotated[
        int | None,
        typer.Option(
            metavar="<count>",
            help="Bits of the camera, such as 12, where pictures are stored with 16.",
        ),
    ] = None,
    mosaic: Annotated[
        str,
        typer.Option(
            metavar="<pattern>",
            help='Pixels of raw mosaics: "RGGB", or biases in degrees such as "180,90,270,0"; '
            "none if not given.",
        ),
    ] = "",
    margin: Annotated[
        float,
        typer.Option(
            metavar="<share>", help="Share of the strip's width to leave out on either side."
        ),
    ] = 0.15,
    distortion: Annotated[
        str | None,
        typer.Option(
            metavar="<share>",
            help='Distortion of the lens at the corners of the picture, such as "-2 %" of a '
            "barrel; as the edges of the strip tell if not given.",
        ),
    ] = None,
    response: Annotated[
        str | None,
        typer.Option(
            metavar="<curve>",
            help="Response of the camera: linear, sRGB or a power such as 0.45; the design's if "
            "not given.",
        ),
    ] = None,
    camera: Annotated[
        bool, typer.Option("--camera", help="Print the design's [camera] for these pictures.")
    ] = False,
    own: Annotated[
        Path | None,
        typer.Option(
            "--design",
            metavar="<file>",
            help="Design to write (.toml): with the camera that --camera prints.",
        ),
    ] = None,
) -> None:
    """Take lines of a strip or images of a pad from pictures.

    `read` and `calibrate` take what it writes.
    """
    from fringeforce.base.errors import InputError
    from fringeforce.base.storage import whole_file
    from fringeforce.design.files import load_sensor
    from fringeforce.io.frames import save_frames
    from fringeforce.pictures.camera import line_camera
    from fringeforce.pictures.extraction import bits_of, extract_frames, first_pictures
    from fringeforce.pictures.finding import find_region
    from fringeforce.pictures.region import Region
    from fringeforce.pictures.sampling import Sampler, channels_of
    from fringeforce.plotting.pictures import draw_region

    if output is None and not camera and preview is None and own is None:
        raise InputError("Say what to write: --output frames.h5, --preview FILE, or --camera.")
    writable(output, "frames", design, *pictures)
    writable(own, "designs", *pictures)
    writable(preview, "pictures", design, *pictures)
    sensor, first = load_sensor(design), first_pictures(pictures)
    if response is not None:
        sensor = sensor.replace(**{"camera.response": response})
    if sensor.dimensions > 1:
        new = region is None or not region.exists()
        if camera or own is not None or preview is not None or (new and corners is None):
            raise InputError(
                "Of a pad, give --corners or a --region, and --output: its camera is described in "
                "the design, and nothing is found or drawn."
            )
    if not first:
        raise InputError("There are no pictures to take lines from.")
    if region is not None and region.exists():
        if corners is not None or mosaic or bits is not None or distortion is not None:
            raise InputError(
                f"{region} states corners, bits, mosaic and distortion; change them there, or give "
                "--region the name of a new file."
            )
        found = Region.load(region)
    else:
        levels = bits_of(first, bits, sensor.camera.bits)
        size = (first[0].shape[1], first[0].shape[0])
        bent = None if distortion is None else _share(distortion)
        if corners is None:
            seen = first if outline is None else first_pictures([outline])
            aspect = sensor.transducer.length / sensor.transducer.width
            found = find_region(seen, levels, margin, mosaic, aspect, bent)
        else:
            found = Region(_corners(corners), size, levels, margin, mosaic, bent or 0.0)
        if region is not None:
            found.save(region)
            print(f"{region}: where the sensor is in the pictures")
    print(_described(found))
    if camera or own is not None:
        channels = channels_of(sensor.polariscope, found, first[0].ndim == 3)
        length, curve = sensor.transducer.length, sensor.camera.response
        seen_by = line_camera(first, found, length, channels, response=curve)
        if camera:
            print(seen_by.to_toml())
        if own is not None:
            sensor = seen_by.put_into(sensor)
            with whole_file(own) as unfinished:
                unfinished.write_text(sensor.to_toml(), encoding="utf-8")
            print(f"{own}: the design with the camera of these pictures")
        if (
            {"R", "G", "B"} >= set(channels)
            and len(channels) > 1
            and not sensor.polariscope.crosstalk
        ):
            print(
                "Colours of a camera see some light of each other: state it in [polariscope], as "
                'in crosstalk = "5 +/- 5 %".'
            )
    if preview is not None:
        channels = channels_of(sensor.polariscope, found, first[0].ndim == 3)
        pixels = min(sensor.camera.pixels, found.resolution)
        draw_region(Sampler(found, pixels, channels), first[0], preview)
        print(f"{preview}: what was found, drawn")
    if output is not None:
        frames, times = extract_frames(pictures, sensor, found)
        save_frames(output, frames, sensor.pixel_positions, times=times)
        print(f"{output}: {counted_frames(frames.shape)}")


def _corners(text: str) -> Any:
    from fringeforce.base.errors import InputError

    try:
        return [tuple(float(number) for number in pair.split(",")) for pair in text.split()]
    except ValueError:
        raise InputError(
            f'--corners "{text}" is not four pairs; write "10,20 209,20 209,59 10,59".'
        ) from None


def _share(text: str) -> float:
    from fringeforce.base.errors import InputError
    from fringeforce.design.fields import percent

    try:
        return float(percent(text))
    except ValueError as error:
        raise InputError(f'--distortion "{text}" {error}.') from None


def _described(region: Region) -> str:
    bent = f" The lens distorts the corners by {100 * region.distortion:.2f} %."
    return (
        f"The sensor is {region.length:.0f} pixels long and {region.width:.0f} wide, tilted by "
        f"{region.tilt:.2f} degrees.{bent if region.distortion else ''}"
    )
