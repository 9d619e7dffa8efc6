"""The command that opens the explorer."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from fringeforce.cli.arguments import SHIPPED, Exposure, Rate, RegionFile, is_model

if TYPE_CHECKING:
    from fringeforce.acquisition.cameras.camera import Camera, Settings
    from fringeforce.explorer.live import Source
    from fringeforce.models.pad import PadModel
    from fringeforce.models.strip import SensorModel
    from fringeforce.pictures.region import Region

BLOCK = 16
"""Lines that come at once, if not told otherwise: who watches wants them soon."""


def explore(
    target: Annotated[
        str, typer.Argument(help=f"Design file, model file, or one of {SHIPPED}.")
    ] = "saad",
    port: Annotated[
        int, typer.Option(metavar="<number>", help="Port to listen on; 0 takes a free one.")
    ] = 0,
    bind: Annotated[
        str,
        typer.Option(
            metavar="<address>",
            help="Address to listen on; 0.0.0.0 lets other machines see the page.",
        ),
    ] = "127.0.0.1",
    camera: Annotated[
        str | None,
        typer.Option(
            metavar="<camera>",
            help="Watch a running sensor: sim, file:PATH, webcam:0, aravis:ID or pylon:SERIAL.",
        ),
    ] = None,
    line_rate: Rate = None,
    exposure: Exposure = None,
    region: RegionFile = None,
    block: Annotated[
        int | None,
        typer.Option(
            metavar="<count>",
            help="How many the camera delivers at once; 16 lines or one image if not given.",
        ),
    ] = None,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
) -> None:
    """Open a sensor in the browser: push on it, watch its fringes.

    With a camera it shows a running sensor.
    """
    import pickle
    import webbrowser

    from fringeforce.acquisition.cameras.choice import check_camera
    from fringeforce.base.errors import InputError
    from fringeforce.design.files import load_sensor
    from fringeforce.design.materials import by_strain
    from fringeforce.design.shipped import shipped_designs, shipped_pads
    from fringeforce.explorer.limits import check, check_skin
    from fringeforce.explorer.security import new_token
    from fringeforce.explorer.server import serve
    from fringeforce.explorer.session import FirstDesign

    if camera is not None:
        check_camera(camera)
    else:
        given = {
            "--line-rate": line_rate,
            "--exposure": exposure,
            "--region": region,
            "--block": block,
        }
        if idle := [option for option, value in given.items() if value is not None]:
            raise InputError(f"{idle[0]} is for a running sensor; say which with --camera.")
    name = target.removeprefix("pads/")
    known = name in shipped_designs() or name in shipped_pads()
    if not known and is_model(target):
        from fringeforce.models.files import load_model

        model = load_model(target)
        start = FirstDesign(model.sensor, pickle.dumps(model))
    else:
        start = FirstDesign(by_strain(load_sensor(name if known else target)))

    if start.sensor.dimensions == 1:  # here, where it is one sentence, and not in the server
        (check if start.sensor.skin is None else check_skin)(start.sensor)
    source = None
    if camera is not None:
        from fringeforce.acquisition.cameras.camera import Settings
        from fringeforce.pictures.region import Region

        seen = None if region is None else Region.load(region)
        lines = BLOCK if start.sensor.dimensions == 1 and seen is None else None
        settings = Settings(line_rate, exposure, lines if block is None else block)
        source = _source(camera, settings, seen)

    def ready(address: str) -> None:
        print(f"Open {address} in a browser; end with Ctrl+C.", flush=True)
        if browser:
            webbrowser.open(address)

    serve(start, new_token(), bind, port, ready, source)


def _source(name: str, settings: Settings, region: Region | None) -> Source:
    """The camera of a name; a recording without times is played slowly enough to be watched."""
    from fringeforce.acquisition.cameras.choice import open_camera
    from fringeforce.acquisition.cameras.simulator import IMAGE_RATE, LINE_RATE
    from fringeforce.explorer.live import Source

    def opened(model: SensorModel | PadModel) -> Camera:
        camera = open_camera(name, model, settings, region)
        if not camera.patient:
            return camera
        rate = IMAGE_RATE if model.sensor.dimensions > 1 else LINE_RATE
        return open_camera(name, model, replace(settings, line_rate=rate), region)

    return Source(opened, recorded=name.startswith("file:"))
