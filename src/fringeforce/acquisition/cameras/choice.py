"""A camera by its name, as a person writes it on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fringeforce.acquisition.cameras.area import AreaCamera
from fringeforce.acquisition.cameras.camera import Camera, Settings
from fringeforce.base.errors import InputError
from fringeforce.models.pad import PadModel
from fringeforce.models.strip import SensorModel
from fringeforce.pictures.extraction import extract_frames
from fringeforce.pictures.region import Region

CAMERAS = "sim, file:PATH, webcam:NUMBER, aravis:ID or pylon:SERIAL"
WEBCAMS = ("webcam", "opencv")
DEVICES = (*WEBCAMS, "aravis", "pylon")


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
        "sim" for a simulated touch; "file:PATH" for frames; "webcam:0", or its alias "opencv:0",
        for /dev/video0, and "webcam:PATH" for other devices; "aravis:ID" for a GenICam camera,
        "pylon:SERIAL" for a Basler one, each without ID for the first one found.
    model : SensorModel or PadModel
        The sensor that it looks at; its design says the pixels and bits of a line, or of an image.
    settings : Settings, optional
        Rate, exposure, block.
    region : Region, optional
        Where the sensor is in pictures, which webcams need; PATH is then of pictures, a video, or
        a folder of them, and a GenICam camera delivers whole pictures.

    Raises
    ------
    InputError
        If there is no such kind of camera, it needs something that is not installed, it takes one
        picture where the sensor's frames are several, or the region of a webcam is missing.

    Examples
    --------
    >>> model = ff.characterize(ff.load_sensor("saad"))
    >>> with ff.open_camera("sim", model) as camera:
    ...     next(iter(camera)).lines.shape
    (64, 2048)
    """
    check_camera(name)
    kind, _, rest = name.partition(":")
    sensor = model.sensor
    if kind == "file":
        from fringeforce.acquisition.cameras.replay import ReplayCamera

        if region is not None:
            taken = extract_frames([rest], sensor, region)
            return ReplayCamera(rest, settings, dimensions=sensor.dimensions, found=taken)
        return ReplayCamera(rest, settings, dimensions=sensor.dimensions)
    if kind in DEVICES and region is not None:
        pictures = _device(kind, rest, region.size, region.bits, settings, region.mosaic)
        return AreaCamera(pictures, sensor, region)
    if region is not None:
        raise InputError(f"A region is for pictures of cameras and files, and not for {name!r}.")
    if name == "sim":
        from fringeforce.acquisition.cameras.simulator import SimulatedCamera

        return SimulatedCamera(model, settings)
    frame = "a line" if sensor.dimensions == 1 else "an image"
    size = " x ".join(map(str, sensor.frame_shape[-sensor.dimensions :]))
    if kind in WEBCAMS:
        raise InputError(
            f"{name} sends pictures, and a frame of this sensor is {frame} of "
            f"{size} pixels; find the sensor in a picture with  fringeforce extract --region FILE  "
            "and give --region FILE here."
        )
    if len(sensor.polariscope.pictures) > 1:
        raise InputError(
            f"{name} takes one picture at a time, and a frame of this sensor is "
            f"{len(sensor.polariscope.pictures)}; play recorded frames with file:PATH, give the "
            "--region of a mosaic, or design a sensor that needs one picture."
        )
    return _device(kind, rest, sensor.camera.pixels, sensor.camera.bits, settings)


def check_camera(name: str) -> None:
    """Refuse the name of a camera that cannot be one, before there is a model.

    Parameters
    ----------
    name : str
        As of `open_camera`.

    Raises
    ------
    InputError
        If there is no such kind of camera, or no file of frames.
    """
    kind, _, rest = name.partition(":")
    if name != "sim" and kind not in DEVICES and not (kind == "file" and rest):
        raise InputError(f"There is no camera {name!r}; use {CAMERAS}.")
    if kind == "file" and not Path(rest).exists():
        raise InputError(f"There is no file {rest} of frames to play; give the path of one.")


def _device(
    kind: str,
    identity: str,
    pixels: Any,
    bits: int,
    settings: Settings | None,
    mosaic: str = "",
) -> Camera:
    """A camera that delivers lines, or pictures where `pixels` are columns and rows."""
    if kind in WEBCAMS:
        from fringeforce.acquisition.cameras.webcam import WebcamCamera

        return WebcamCamera(identity, pixels, settings)
    if kind == "aravis":
        from fringeforce.acquisition.cameras.aravis import AravisCamera

        return AravisCamera(identity, pixels, bits, settings, mosaic=mosaic)
    from fringeforce.acquisition.cameras.pylon import PylonCamera

    return PylonCamera(identity, pixels, bits, settings, mosaic)
