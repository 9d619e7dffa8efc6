"""A camera by its name, as a person writes it on the command line."""

from __future__ import annotations

from fringeforce.cameras.camera import Camera, Settings
from fringeforce.errors import InputError
from fringeforce.model import SensorModel


def open_camera(name: str, model: SensorModel, settings: Settings | None = None) -> Camera:
    """A camera for a sensor, not yet connected.

    Parameters
    ----------
    name : str
        "sim" for a simulated touch; "file:PATH" for frames; "aravis:ID" for a GenICam camera,
        "pylon:SERIAL" for a Basler one, each without ID for the first one found.
    model : SensorModel
        The sensor that it looks at; its design says the pixels and bits of a line.
    settings : Settings, optional
        Line rate, exposure, block.

    Raises
    ------
    InputError
        If there is no such kind of camera, or it needs something that is not installed.

    Examples
    --------
    >>> model = ff.characterize(ff.load_sensor("saad"))
    >>> with ff.open_camera("sim", model) as camera:
    ...     next(iter(camera)).lines.shape
    (64, 2048)
    """
    kind, _, rest = name.partition(":")
    seen = model.sensor.camera
    if name == "sim":
        from fringeforce.cameras.simulator import SimulatedCamera

        return SimulatedCamera(model, settings)
    if kind == "file" and rest:
        from fringeforce.cameras.replay import ReplayCamera

        return ReplayCamera(rest, settings)
    if kind == "aravis":
        from fringeforce.cameras.aravis import AravisCamera

        return AravisCamera(rest, seen.pixels, seen.bits, settings)
    if kind == "pylon":
        from fringeforce.cameras.pylon import PylonCamera

        return PylonCamera(rest, seen.pixels, seen.bits, settings)
    raise InputError(f"There is no camera {name!r}; use sim, file:PATH, aravis:ID or pylon:SERIAL.")
