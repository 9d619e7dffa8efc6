"""What a person decides about a sensor: validated, immutable, in SI units and radians."""

from __future__ import annotations

import os
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator, model_validator

from fringeforce.design_optics import Polariscope
from fringeforce.design_text import toml_text, toml_values
from fringeforce.errors import DesignError
from fringeforce.fields import Count, Finite, Length, Places, Pressure
from fringeforce.validation import suggestion, validated


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", protected_namespaces=())


class Layer(_Part):
    """One layer of the strip, isotropic and linear elastic."""

    thickness: Length = Field(description="height of the layer along z [m]")
    youngs_modulus: Pressure = Field(description="Young's modulus E [Pa]")
    poissons_ratio: Finite = Field(gt=-1, lt=0.5, description="Poisson's ratio nu")


class PhotoelasticLayer(Layer):
    """The clear layer whose stress makes it birefringent."""

    strain_optic_coefficient: Finite = Field(
        gt=0, description="K_s: change of the difference of refractive indices per strain"
    )


class Transducer(_Part):
    """The strip: a compliant cover on a photoelastic layer that is bonded to a rigid base."""

    length: Length = Field(description="full length c along x [m]")
    width: Length = Field(description="width t along y [m]")
    edges: Literal["free", "roller"] = Field(
        description='lateral edges: "free" (Case 1) or "roller", u = 0 without friction (Case 2)'
    )
    plane: Literal["stress", "strain"] = Field(
        default="stress", description='"stress" for narrow strips, "strain" for wide ones'
    )
    compliant: Layer
    photoelastic: PhotoelasticLayer


class Tactels(_Part):
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


class Camera(_Part):
    """The line camera of equation (13): grey = round(amplitude I + noise + offset)."""

    pixels: Count = Field(description="pixels along the strip")
    bits: Count = Field(le=16, description="bits B of the converter, 1 to 16")
    amplitude: Finite = Field(gt=0, description="A, grey levels between dark and bright")
    offset: Finite = Field(ge=0, description="I_o, grey levels of darkness")
    noise: Finite = Field(
        ge=0, description="half width (uniform) or standard deviation (gaussian), grey levels"
    )
    noise_model: Literal["uniform", "gaussian"] = Field("uniform", description="its distribution")

    @model_validator(mode="after")
    def _within_converter(self) -> Camera:
        noise = self.noise if self.noise_model == "uniform" else 0.0
        brightest = self.amplitude + self.offset + noise
        if brightest > self.full_scale:
            raise ValueError(
                f"amplitude + offset + noise = {brightest:g} exceeds the converter's "
                f"2^{self.bits} - 1 = {self.full_scale}; lower the amplitude by "
                f"{brightest - self.full_scale:g} or take more bits"
            )
        if self.offset < noise:
            raise ValueError(
                f"offset = {self.offset:g} is below the noise of {noise:g}, so dark pixels would "
                f"fall below zero; raise the offset to {noise:g}"
            )
        return self

    @property
    def full_scale(self) -> int:
        """Largest grey level, 2^B - 1."""
        return 2**self.bits - 1


class Sensor(_Part):
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

    @cached_property
    def pixel_positions(self) -> NDArray[np.float64]:
        """Centres of the pixels along x, shape (pixels,) [m]."""
        n = self.camera.pixels
        return ((np.arange(n) + 0.5) / n - 0.5) * self.transducer.length

    def replace(self, **changes: Any) -> Sensor:
        """A variant of this sensor.

        Parameters
        ----------
        **changes
            Dotted paths, ``replace(**{"transducer.edges": "roller"})``, or nested values,
            ``replace(transducer={"edges": "roller"})``.  Quantities are SI floats or text.

        Raises
        ------
        DesignError
            If a path does not exist or the variant is not a valid sensor.
        """
        values = self.model_dump(by_alias=True, exclude_none=True)
        for path, value in changes.items():
            *parents, key = path.split(".")
            branch = values
            for parent in parents:
                if not isinstance(branch.get(parent), dict):
                    known = [name for name, part in branch.items() if isinstance(part, dict)]
                    text = f"{path}: there is no part {parent!r} of a design; "
                    raise DesignError(text + suggestion(parent, known))
                branch = branch[parent]
            branch[key] = _merged(branch.get(key), value)
        return validated(Sensor, values, "The changed design", from_file=False)

    def to_toml(self) -> str:
        """The text of a design file that reads back to an equal sensor."""
        return toml_text(self)


def _merged(old: Any, new: Any) -> Any:
    if isinstance(new, BaseModel):
        new = new.model_dump(by_alias=True, exclude_none=True)
    if isinstance(old, dict) and isinstance(new, dict):
        return old | {key: _merged(old.get(key), value) for key, value in new.items()}
    return new


def parse_sensor(text: str, source: str = "The design") -> Sensor:
    """Read the text of a design file; the inverse of `Sensor.to_toml`.

    Parameters
    ----------
    text : str
        TOML.
    source : str
        Names the text in error messages.

    Raises
    ------
    DesignError
        With all problems of the text.
    """
    return validated(Sensor, toml_values(text, source), source, from_file=True)


def load_sensor(name_or_path: str | os.PathLike[str]) -> Sensor:
    """Read a design by its name, if the package ships it, or from a file.

    Parameters
    ----------
    name_or_path : str or path
        A shipped design such as "saad", or the path of a TOML file.

    Raises
    ------
    DesignError
        If there is no such design, or it has problems; all of them are in the message.

    Examples
    --------
    >>> ff.load_sensor("saad").tactels.count
    11
    """
    shipped = shipped_designs()
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


def shipped_designs() -> dict[str, Path]:
    """Designs that the package ships, by name."""
    here = Path(__file__).parent
    # beside the modules in an installed package, at the top of a source tree
    folder = next(f for f in (here / "designs", here.parents[1] / "designs") if f.is_dir())
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


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
