"""Study files: which designs to try, over what, and what is wanted of them."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AllowInfNan, BaseModel, Field, model_validator

from fringeforce.base.errors import InputError
from fringeforce.design.fields import Count, Finite, Length
from fringeforce.design.files import load_strip
from fringeforce.design.parts import Part
from fringeforce.design.shipped import shipped_designs, shipped_pads
from fringeforce.design.strip import Sensor
from fringeforce.design.text import toml_values
from fringeforce.design.validation import validated
from fringeforce.studies.performance import MESH_ORDER

Number = Annotated[float, AllowInfNan(False)]
Objective = Literal["worst_uncertainty", "mean_uncertainty", "largest_load", "thickness", "volume"]
Table = TypeVar("Table", bound=BaseModel)
LARGER_IS_BETTER = ("largest_load",)


class Parameter(Part):
    """A design value that is varied: between two values, or over choices."""

    path: str = Field(description='dotted path in a design, such as "transducer.length"')
    lowest: str | int | Number | None = Field(default=None, description="smallest value")
    highest: str | int | Number | None = Field(default=None, description="largest value")
    scale: Literal["linear", "log"] = "linear"
    choices: list[str | int | Number] | None = Field(default=None, description="values to try")
    points: Count = Field(default=5, description="values of a grid between lowest and highest")

    @model_validator(mode="after")
    def _range_or_choices(self) -> Parameter:
        bounded = self.lowest is not None and self.highest is not None
        if bounded == bool(self.choices):
            raise ValueError(
                f"{self.path!r} needs either lowest and highest or a list of choices, and not both"
            )
        return self


class DesignSampling(Part):
    """How designs of a sweep are chosen."""

    method: Literal["grid", "latin-hypercube", "sobol"] = "latin-hypercube"
    designs: Count = Field(default=100, description="number of designs; a grid has its points")


class DesignSearch(Part):
    """How a best design is sought."""

    objective: Objective = Field(description="what is to be as small, or as large, as possible")
    budget: Count = Field(default=500, description="designs that may be characterised")
    verify: Count = Field(default=1000, description="noisy frames that the best design must read")


class Constraints(Part):
    """What no design may exceed; a design without them is free."""

    strain: Finite | None = Field(default=None, gt=0, description="at the working load")
    fringes_per_pixel: Finite | None = Field(default=None, gt=0, description="at the working load")
    thickness: Length | None = Field(default=None, description="of both layers [m]")

    def limits(self) -> dict[str, float]:
        """Largest value of each quantity that is limited."""
        return self.model_dump(exclude_none=True)


class StudyFile(Part):
    """A sweep or an optimisation."""

    design: str = Field(description="shipped design, or a file beside the study, to start from")
    working_load: Finite = Field(gt=0, description="largest normal force on a tactel to read [N]")
    seed: Annotated[int, Field(ge=0)] = 0
    mesh_order: Count = Field(default=MESH_ORDER, ge=2, le=12, description="of the elements")
    parameters: list[Parameter] = Field(min_length=1, description="design values to vary")
    sampling: DesignSampling = DesignSampling()
    search: DesignSearch | None = None
    constraints: Constraints = Constraints()

    def canonical(self, sensor: Sensor) -> str:
        """A text that two studies share if and only if they ask the same of the same design."""
        return json.dumps({"study": self.model_dump(), "design": sensor.model_dump()})


def same_study(one: str, other: str) -> bool:
    """Whether two canonical texts ask the same; a key without a value is one that is missing.

    So a study of an earlier version stays the same study when a design may state one thing more.
    """

    def stated(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        return {key: value for key, value in pairs if value is not None}

    try:
        texts = [json.loads(text, object_pairs_hook=stated) for text in (one, other)]
    except ValueError:
        return False
    return texts[0] == texts[1]


def load_study(path: str | os.PathLike[str]) -> tuple[StudyFile, Sensor]:
    """Read a study file and the design that it starts from.

    Raises
    ------
    InputError
        If a file is missing or has problems; all of them are in the message.
    """
    study = read_table(StudyFile, Path(path))
    return study, load_strip(design_of(study.design, Path(path)))


def design_of(name: str, study: Path) -> str | Path:
    """The design that a study file names: a shipped one, or a file beside the study."""
    shipped = name in {**shipped_designs(), **shipped_pads()}
    return name if shipped else study.parent / name


def read_table(model: type[Table], path: Path) -> Table:
    """Read a study of some kind; InputError if it is missing or has problems."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise InputError(
            f"There is no study {str(path)!r} to read ({reason}); give a TOML file such as those "
            "in examples/studies and examples/dataset."
        ) from None
    values = toml_values(text, str(path))
    if "transducer" in values:
        raise InputError(
            f"{path} is a design, and a study is needed here: a TOML file that names it, "
            f'design = "{path.name}", such as those in examples/studies and examples/dataset.'
        )
    return validated(model, values, str(path), from_file=True)
