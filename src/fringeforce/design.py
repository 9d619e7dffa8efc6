"""What a person decides about a sensor: validated, immutable, in SI units and radians."""

from __future__ import annotations

import os
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationInfo, field_validator, model_validator

from fringeforce.design_optics import Camera, Polariscope
from fringeforce.design_parts import Design, Layer, Part, PhotoelasticLayer
from fringeforce.design_text import toml_values
from fringeforce.errors import DesignError
from fringeforce.fields import Count, Length, Places
from fringeforce.validation import suggestion, validated


class Transducer(Part):
    """The strip: a compliant cover on a photoelastic layer that is bonded to a rigid base."""

    length: Length = Field(description="full length c along x [m]")
    width: Length = Field(description="width t along y [m]")
    edges: Literal["free", "roller"] = Field(
        description='lateral edges: "free" (Case 1) or "roller", u = 0 without friction (Case 2)'
    )
    plane: Literal["stress", "strain", "3d"] = Field(
        default="stress",
        description='"stress" for narrow strips, "strain" for wide ones, "3d" for any width',
    )
    compliant: Layer
    photoelastic: PhotoelasticLayer


class Tactels(Part):
    """Where forces act: line loads, evenly spaced and centred on the strip, or placed singly."""

    count: Count = Field(description="number of tactels")
    pitch: Length = Field(description="distance between neighbours, of the drawing [m]")
    # the key of a design is `positions`; the attribute of that name always has a place for each
    placed: Places | None = Field(
        default=None,
        alias="positions",
        description="single places along x, ascending [m]; without them the pitch says where",
        json_schema_extra={"unit": "meter"},
    )

    @model_validator(mode="after")
    def _ascending(self) -> Tactels:
        if self.placed is None:
            return self
        if len(self.placed) != self.count:
            raise ValueError(
                f"{len(self.placed)} positions do not fit count = {self.count}; give one for every "
                "tactel, or none and the pitch alone"
            )
        if (np.diff(self.placed) <= 0).any():
            number = int(np.flatnonzero(np.diff(self.placed) <= 0)[0]) + 1
            raise ValueError(
                f"positions must ascend: tactel {number + 1} at {self.placed[number] * 1e3:g} mm "
                f"does not lie right of tactel {number} at {self.placed[number - 1] * 1e3:g} mm; "
                "sort them"
            )
        return self

    @property
    def positions(self) -> NDArray[np.float64]:
        """Places of the tactels along x, shape (count,) [m]."""
        if self.placed is not None:
            return np.array(self.placed)
        return (np.arange(self.count, dtype=np.float64) - (self.count - 1) / 2) * self.pitch


class Sensor(Design):
    """A complete sensor, from strip to camera.

    Numbers are SI floats; `Sensor(...)` and `replace` also take text with a unit.

    Examples
    --------
    >>> ff.load_sensor("saad").replace(**{"transducer.width": "3 mm"}).transducer.width
    0.003
    """

    name: str = Field(description="what to call the sensor")
    transducer: Transducer
    tactels: Tactels
    polariscope: Polariscope
    camera: Camera

    @field_validator("tactels", mode="after")
    @classmethod
    def _on_the_strip(cls, tactels: Tactels, info: ValidationInfo) -> Tactels:
        transducer = info.data.get("transducer")
        if transducer is not None:
            outermost, half = np.abs(tactels.positions).max(), transducer.length / 2
            if outermost >= half:
                single = tactels.placed is not None
                kind = "" if single else f" at a pitch of {tactels.pitch * 1e3:g} mm"
                remedy = "positions nearer to it" if single else "a smaller pitch"
                raise ValueError(
                    f"the outermost of {tactels.count} tactels{kind} sits {outermost * 1e3:g} mm "
                    f"from the centre, beyond the strip's end at {half * 1e3:g} mm; take fewer "
                    f"tactels, {remedy} or a longer strip"
                )
        return tactels

    @field_validator("camera", mode="after")
    @classmethod
    def _line_on_the_strip(cls, camera: Camera, info: ValidationInfo) -> Camera:
        transducer = info.data.get("transducer")
        if transducer is not None:
            camera.check_line(transducer.width, transducer.plane)
        return camera

    @cached_property
    def pixel_positions(self) -> NDArray[np.float64]:
        """Centres of the pixels along x, shape (pixels,) [m]."""
        n = self.camera.pixels
        return ((np.arange(n) + 0.5) / n - 0.5) * self.transducer.length


def parse_sensor(text: str, source: str = "The design") -> Any:
    """Read the text of a design file; the inverse of `Sensor.to_toml` and `Pad.to_toml`.

    Parameters
    ----------
    text : str
        TOML; ``kind = "pad"`` makes it a pad, otherwise it is a strip.
    source : str
        Names the text in error messages.

    Returns
    -------
    Sensor or fringeforce.pads.design.Pad

    Raises
    ------
    DesignError
        With all problems of the text.
    """
    values = toml_values(text, source)
    kind = values.get("kind", "strip")
    if kind == "pad":
        from fringeforce.pads.design import Pad

        return validated(Pad, values, source, from_file=True)
    if kind != "strip":
        raise DesignError(f'{source}: kind = {kind!r} is no kind of sensor; take "strip" or "pad".')
    strip = {key: value for key, value in values.items() if key != "kind"}
    return validated(Sensor, strip, source, from_file=True)


def load_sensor(name_or_path: str | os.PathLike[str]) -> Any:
    """Read a design by its name, if the package ships it, or from a file.

    Parameters
    ----------
    name_or_path : str or path
        A shipped design such as "saad" or "pad", or the path of a TOML file.

    Returns
    -------
    Sensor or fringeforce.pads.design.Pad

    Raises
    ------
    DesignError
        If there is no such design, or it has problems; all of them are in the message.

    Examples
    --------
    >>> ff.load_sensor("saad").tactels.count
    11
    """
    shipped = {**shipped_designs(), **shipped_pads()}
    path = shipped.get(str(name_or_path), Path(name_or_path))
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise DesignError(f"{path} is not a design file: it is not UTF-8 text.") from None
    except OSError as error:
        hint = suggestion(str(name_or_path), list(shipped))
        raise DesignError(
            f"There is no design {str(name_or_path)!r} to read ({error.strerror}). "
            f"Give the path of a TOML file or a shipped name: {hint}"
        ) from None
    return parse_sensor(text, source=str(name_or_path))


def load_strip(name_or_path: str | os.PathLike[str]) -> Sensor:
    """Read the design of a strip, as `load_sensor`; DesignError if it is a pad's."""
    sensor = load_sensor(name_or_path)
    if not isinstance(sensor, Sensor):
        raise DesignError(
            f"{str(name_or_path)!r} is a planar pad, and this works on strips only; give the "
            f"design of a strip, such as {', '.join(map(repr, shipped_designs()))}."
        )
    return sensor


def shipped_designs() -> dict[str, Path]:
    """Designs of strips that the package ships, by name."""
    return _shipped("*.toml")


def shipped_pads() -> dict[str, Path]:
    """Designs of planar pads that the package ships, by name."""
    return _shipped("pads/*.toml")


def _shipped(pattern: str) -> dict[str, Path]:
    here = Path(__file__).parent
    # beside the modules in an installed package, at the top of a source tree
    folder = next(f for f in (here / "designs", here.parents[1] / "designs") if f.is_dir())
    return {path.stem: path for path in sorted(folder.glob(pattern))}


def new_design(path: str | os.PathLike[str], like: str = "saad", overwrite: bool = False) -> None:
    """Write a commented design file to start from.

    Parameters
    ----------
    path : path
        Where to write.
    like : str
        The shipped design to copy, comments and all.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    DesignError
        If there is no such design, the file exists, or it cannot be written.
    """
    shipped = shipped_designs()
    if like not in shipped:
        raise DesignError(f"There is no shipped design {like!r}; {suggestion(like, list(shipped))}")
    try:
        with open(path, "w" if overwrite else "x", encoding="utf-8") as file:
            file.write(shipped[like].read_text(encoding="utf-8"))
    except FileExistsError:
        raise DesignError(f"{path} exists already and is kept; overwrite it on purpose.") from None
    except OSError as error:
        raise DesignError(f"{path} cannot be written: {error.strerror}.") from None
