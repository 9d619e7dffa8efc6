"""A camera by its name, as a person writes it on the command line."""

from __future__ import annotations

from fringeforce.acquisition.cameras.camera import Camera, Settings
from fringeforce.acquisition.cameras.sampled import SampledCamera
from fringeforce.base.errors import InputError
from fringeforce.models.pad import PadModel
from fringeforce.models.strip import SensorModel
from fringeforce.pictures.extraction import extract_frames
from fringeforce.pictures.region import Region

WEBCAMS = "webcam", "opencv"
"""Names of video devices; the second one is what OpenCV's users look for."""


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
        "sim" for a simulated touch; "file:PATH" for frames; "webcam:NUMBER" (or "opencv:NUMBER")
        for a video device; "aravis:ID" for a GenICam camera, "pylon:SERIAL" for a Basler one, each
        without ID for the first one found.
    model : SensorModel or PadModel
        The sensor that it looks at; its design says the pixels and bits of a line, or of an image.
    settings : Settings, optional
        Rate, exposure, block.
    region : Region, optional
        Where the strip is in pictures; PATH is then of pictures, a video, or a folder of them, and
        cameras deliver pictures of the region's size and bits.

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
    if region is not None:
        return _sampled(name, model, settings, region)
    seen, pictures = model.sensor.camera, len(model.sensor.polariscope.pictures)
    if name == "sim":
        from fringeforce.acquisition.cameras.simulator import SimulatedCamera

        return SimulatedCamera(model, settings)
    if kind == "file" and rest:
        from fringeforce.acquisition.cameras.replay import ReplayCamera

        return ReplayCamera(rest, settings, dimensions=model.sensor.dimensions)
    if kind in ("aravis", "pylon", *WEBCAMS) and pictures > 1:
        raise InputError(
            f"{name} takes one picture at a time, and a frame of this sensor is {pictures}; play "
            "recorded frames with file:PATH, or design a sensor that needs one picture."
        )
    if kind in WEBCAMS:
        what = "lines" if model.sensor.dimensions == 1 else "images of a pad"
        raise InputError(
            f"{name} delivers pictures, and this sensor's frames are {what}; find a strip in one "
            "of its pictures with  fringeforce extract  and give the --region that it writes."
        )
    return _pictures(name, seen.pixels, seen.bits, settings)


def _sampled(
    name: str, model: SensorModel | PadModel, settings: Settings | None, region: Region
) -> Camera:
    """A camera whose pictures show a strip in a region."""
    kind, _, rest = name.partition(":")
    if kind == "file" and rest:
        from fringeforce.acquisition.cameras.replay import ReplayCamera

        return ReplayCamera(rest, settings, found=extract_frames([rest], model.sensor, region))
    if name == "sim" or isinstance(model, PadModel):
        raise InputError(
            f"A region is of a strip in pictures; {name} delivers what the sensor shows, whole."
        )
    return SampledCamera(_pictures(name, region.size, region.bits, settings), model.sensor, region)


def _pictures(
    name: str, pixels: int | tuple[int, int], bits: int, settings: Settings | None
) -> Camera:
    """A real camera that delivers lines of so many pixels, or images of columns and rows."""
    kind, _, rest = name.partition(":")
    if kind in WEBCAMS and not isinstance(pixels, int):
        from fringeforce.acquisition.cameras.webcam import Webcam

        return Webcam(rest, pixels, settings)
    if kind == "aravis":
        from fringeforce.acquisition.cameras.aravis import AravisCamera

        return AravisCamera(rest, pixels, bits, settings)
    if kind == "pylon":
        from fringeforce.acquisition.cameras.pylon import PylonCamera

        return PylonCamera(rest, pixels, bits, settings)
    raise InputError(
        f"There is no camera {name!r}; use sim, file:PATH, webcam:NUMBER, aravis:ID or "
        "pylon:SERIAL."
    )
