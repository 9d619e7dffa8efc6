"""Study files of data sets: which pad, how many images, and what contacts and optics vary over."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from fringeforce.base.errors import DesignError, InputError
from fringeforce.contacts.random import ContactRanges
from fringeforce.contacts.random_presses import PressRanges
from fringeforce.design.fields import Count, Finite, Place, Range, Share
from fringeforce.design.files import load_sensor
from fringeforce.design.pad import Pad
from fringeforce.design.parts import Part
from fringeforce.design.shipped import shipped_pads
from fringeforce.design.strip import Sensor
from fringeforce.studies.study_file import design_of, read_table

GOLDEN = (5**0.5 - 1) / 2
NAMES = ("train", "validation", "test")
Positive = Annotated[Finite, Field(ge=0)]


class Split(Part):
    """In which shares images are meant to train, to validate and to test a learner."""

    train: Positive = 0.8
    validation: Positive = 0.1
    test: Positive = 0.1

    def part(self, number: int) -> int:
        """Part that an image belongs to, by its number alone: 0, 1 or 2, in the order above.

        Multiples of the golden ratio spread the parts evenly over any run of numbers, so that a
        data set may grow and no image changes sides.
        """
        shares = self.train, self.validation, self.test
        place = (number + 0.5) * GOLDEN % 1 * sum(shares)
        return int(place >= shares[0]) + int(place >= shares[0] + shares[1])


class OpticsRanges(Part):
    """How optics differ from image to image; what is not given is as in the design."""

    light: Range[Positive] = Field(default=(1.0, 1.0), description="light over that of the design")
    gradient: Range[Positive] = Field(
        default=(0.0, 0.0), description="change of light from the middle to a corner, of the mean"
    )
    vignetting: Range[Share] = Field(
        default=(0.0, 0.0), description="loss of light in the corners, growing with the square"
    )
    noise: Range[Positive] | None = Field(
        default=None, description="as `camera.noise` of the design [grey levels]"
    )
    blur: Range[Annotated[Place, Field(ge=0)]] | None = Field(
        default=None, description="as `camera.blur` of the design [m]"
    )
    wavelength_error: Range[Place] = Field(
        default=(0.0, 0.0), description="true wavelength less that of the design [m]"
    )
    extinction_ratio: Range[Share] | None = Field(
        default=None, description="as `plates.extinction_ratio` of the design"
    )
    shift: Range[Finite] = Field(
        default=(0.0, 0.0), description="of the camera, along x and along y [pixels]"
    )
    dead_pixels: Range[Annotated[int, Field(ge=0)]] = Field(
        default=(0, 0), description="pixels that are always dark or always full"
    )


class DatasetStudy(Part):
    """A data set."""

    design: str = Field(description="shipped pad or skin, or a design file beside the study")
    number: Count = Field(description="number of images")
    seed: Annotated[int, Field(ge=0)] = 0
    format: Literal["hdf5", "png"] = Field(
        default="hdf5", description="a file for each shard, or a folder of pictures and tables"
    )
    shard: Count = Field(default=256, description="images that are computed and written together")
    split: Split = Split()
    contacts: ContactRanges = ContactRanges()
    optics: OpticsRanges = OpticsRanges()
    presses: PressRanges = Field(default=PressRanges(), description="of a skin, for contacts")

    def canonical(self, sensor: Pad | Sensor) -> str:
        """A text that two studies share if and only if the same number is the same image."""
        left_out = {"number", *_OTHERS[sensor.kind]}
        values = {"study": self.model_dump(exclude=left_out), "design": sensor.model_dump()}
        return json.dumps(values)


_OTHERS = {"pad": {"presses"}, "strip": {"contacts", "optics"}}
"""Tables that are of the other kind of sensor."""


def load_dataset_study(path: str | os.PathLike[str]) -> tuple[DatasetStudy, Pad | Sensor]:
    """Read the study file of a data set and the pad or skin that it is about.

    Raises
    ------
    InputError
        If a file is missing or has problems; all of them are in the message.
    """
    place = Path(path)
    study = read_table(DatasetStudy, place)
    if not study.split.train + study.split.validation + study.split.test > 0:
        raise InputError(f"{place}: the shares of split sum up to nothing; raise one of them.")
    sensor: Pad | Sensor = load_sensor(design_of(study.design, place))
    if sensor.dimensions == 1 and sensor.skin is None:
        raise DesignError(
            f"{study.design!r} is a strip with tactels, and data sets are of planar pads and of "
            f"skins; take {', '.join(map(repr, shipped_pads()))}, 'skin', or a design with  kind = "
            '"pad"  or a table [skin].'
        )
    wrong = sorted(_OTHERS[sensor.kind] & study.model_fields_set)
    if wrong:
        remedy = (
            "[contacts] says what presses on a pad"
            if sensor.kind == "pad"
            else "[presses] says what touches a skin, and tolerances of its design what varies"
        )
        raise InputError(f"{place}: {' and '.join(wrong)} do not fit {study.design!r}; {remedy}.")
    return study, sensor
