"""The command that opens the explorer."""

from __future__ import annotations

from typing import Annotated

import typer


def explore(
    target: Annotated[
        str, typer.Argument(help="Design file, shipped design, or model file.")
    ] = "saad",
    port: Annotated[int, typer.Option(help="Port to listen on; 0 takes a free one.")] = 0,
    bind: Annotated[
        str, typer.Option(help="Address to listen on; others than this machine only if changed.")
    ] = "127.0.0.1",
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
) -> None:
    """See and feel a sensor in the browser: push on it, watch its fringes, read its forces."""
    import pickle
    import webbrowser

    from fringeforce.cli.arguments import is_model
    from fringeforce.design import load_sensor, shipped_designs
    from fringeforce.explorer.security import new_token
    from fringeforce.explorer.server import serve
    from fringeforce.explorer.session import Start

    if target not in shipped_designs() and is_model(target):
        from fringeforce.files import load_model

        model = load_model(target)
        start = Start(model.sensor, pickle.dumps(model))
    else:
        start = Start(load_sensor(target))

    def ready(address: str) -> None:
        print(f"Open {address} in a browser; end with Ctrl+C.", flush=True)
        if browser:
            webbrowser.open(address)

    serve(start, new_token(), bind, port, ready)
