"""The command that opens the explorer."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from fringeforce.cameras.camera import Camera, Settings
    from fringeforce.explorer.live import Source
    from fringeforce.model import SensorModel


def explore(
    target: Annotated[
        str, typer.Argument(help="Design file, shipped design, or model file.")
    ] = "saad",
    port: Annotated[int, typer.Option(help="Port to listen on; 0 takes a free one.")] = 0,
    bind: Annotated[
        str, typer.Option(help="Address to listen on; others than this machine only if changed.")
    ] = "127.0.0.1",
    camera: Annotated[
        str | None,
        typer.Option(help="Watch a running sensor: sim, file:PATH, aravis:ID or pylon:SERIAL."),
    ] = None,
    line_rate: Annotated[float | None, typer.Option(help="Lines per second of the camera.")] = None,
    exposure: Annotated[float | None, typer.Option(help="Exposure of a line in seconds.")] = None,
    block: Annotated[int, typer.Option(help="Lines that the camera delivers at once.")] = 16,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
) -> None:
    """See and feel a sensor in the browser: push on it, watch its fringes, read its forces."""
    import pickle
    import webbrowser

    from fringeforce.cli.arguments import is_model
    from fringeforce.design import Sensor, load_sensor, shipped_designs, shipped_pads
    from fringeforce.errors import InputError
    from fringeforce.explorer.security import new_token
    from fringeforce.explorer.server import serve
    from fringeforce.explorer.session import Start

    name = target.removeprefix("pads/")
    known = name in shipped_designs() or name in shipped_pads()
    if not known and is_model(target):
        from fringeforce.files import load_model

        model = load_model(target)
        start = Start(model.sensor, pickle.dumps(model))
    else:
        start = Start(load_sensor(name if known else target))

    source = None
    if camera is not None:
        if not isinstance(start.sensor, Sensor):
            raise InputError("A camera can be watched for strips only; leave out --camera.")
        from fringeforce.cameras.camera import Settings

        source = _source(camera, Settings(line_rate, exposure, block))

    def ready(address: str) -> None:
        print(f"Open {address} in a browser; end with Ctrl+C.", flush=True)
        if browser:
            webbrowser.open(address)

    serve(start, new_token(), bind, port, ready, source)


def _source(name: str, settings: Settings) -> Source:
    """The camera of a name; a recording without times is played slowly enough to be watched."""
    from fringeforce.cameras.choice import open_camera
    from fringeforce.cameras.simulator import LINE_RATE
    from fringeforce.explorer.live import Source

    def opened(model: SensorModel) -> Camera:
        camera = open_camera(name, model, settings)
        return (
            open_camera(name, model, replace(settings, line_rate=LINE_RATE))
            if camera.patient
            else camera
        )

    return Source(opened, recorded=name.startswith("file:"))
