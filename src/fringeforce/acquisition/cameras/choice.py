"""A camera by its name, as a person writes it on the command line."""

from __future__ import annotations

from fringeforce.acquisition.cameras.camera import Camera, Settings
from fringeforce.base.errors import InputError
from fringeforce.models.pad import PadModel
from fringeforce.models.strip import SensorModel
from fringeforce.pictures.extraction import extract_frames
from fringeforce.pictures.region import Region


def open_camera(
    name: str,
    model: SensorModel | PadModel,
    settings: Settings | None = None,
    region: Region | None = None,
) -> Camera:
    """A camera for a sensor, not yet connected.

    Parameters
    ----------
    name : str
        "sim" for a simulated touch; "file:PATH" for frames; "aravis:ID" for a GenICam camera,
        "pylon:SERIAL" for a Basler one, each without ID for the first one found.
    model : SensorModel or PadModel
        The sensor that it looks at; its design says the pixels and bits of a line, or of an image.
    settings : Settings, optional
        Rate, exposure, block.
    region : Region, optional
        Where the strip is in pictures; PATH is then of pictures, a video, or a folder of them.

    Raises
    ------
    InputError
        If there is no such kind of camera, it needs something that is not installed, or it takes
        one picture where the sensor's frames are several.

    Examples
    --------
    >>> model = ff.characterize(ff.load_sensor("saad"))
    >>> with ff.open_camera("sim", model) as camera:
    ...     next(iter(camera)).lines.shape
    (64, 2048)
    """
    kind, _, rest = name.partition(":")
    if region is not None and kind != "file":
        raise InputError(f"A region is for pictures in files, file:PATH, and not for {name}.")
    seen, pictures = model.sensor.camera, len(model.sensor.polariscope.pictures)
    if name == "sim":
        from fringeforce.acquisition.cameras.simulator import SimulatedCamera

        return SimulatedCamera(model, settings)
    if kind == "file" and rest:
        from fringeforce.acquisition.cameras.replay import ReplayCamera

        if region is not None:
            taken = extract_frames([rest], model.sensor, region)
            return ReplayCamera(rest, settings, found=taken)
        return ReplayCamera(rest, settings, dimensions=model.sensor.dimensions)
    if kind in ("aravis", "pylon") and pictures > 1:
        raise InputError(
            f"{name} takes one picture at a time, and a frame of this sensor is {pictures}; play "
            "recorded frames with file:PATH, or design a sensor that needs one picture."
        )
    if kind == "aravis":
        from fringeforce.acquisition.cameras.aravis import AravisCamera

        return AravisCamera(rest, seen.pixels, seen.bits, settings)
    if kind == "pylon":
        from fringeforce.acquisition.cameras.pylon import PylonCamera

        return PylonCamera(rest, seen.pixels, seen.bits, settings)
    raise InputError(f"There is no camera {name!r}; use sim, file:PATH, aravis:ID or pylon:SERIAL.")
