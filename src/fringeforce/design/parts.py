"""What designs of strips and pads have in common: layers, the converter, and how they change."""

from __future__ import annotations

from typing import Any, ClassVar, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from fringeforce.base.errors import DesignError
from fringeforce.design.fields import Count, Finite, Length, Pressure
from fringeforce.design.text import toml_text
from fringeforce.design.validation import suggestion, validated


class Part(BaseModel):
    """A table of a design or of a study: frozen, and no keys that it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", protected_namespaces=())


class Layer(Part):
    """One layer, isotropic and linear elastic."""

    thickness: Length = Field(description="height of the layer along z [m]")
    youngs_modulus: Pressure = Field(description="Young's modulus E [Pa]")
    poissons_ratio: Finite = Field(gt=-1, lt=0.5, description="Poisson's ratio nu")


class PhotoelasticLayer(Layer):
    """The clear layer whose stress makes it birefringent."""

    strain_optic_coefficient: Finite = Field(
        gt=0, description="K_s: change of the difference of refractive indices per strain"
    )


class Converter(Part):
    """From light to grey levels, equation (13): grey = round(amplitude I + noise + offset)."""

    bits: Count = Field(le=16, description="bits B of the converter, 1 to 16")
    amplitude: Finite = Field(gt=0, description="A, grey levels between dark and bright")
    offset: Finite = Field(ge=0, description="I_o, grey levels of darkness")
    noise: Finite = Field(
        ge=0, description="half width (uniform) or standard deviation (gaussian), grey levels"
    )
    noise_model: Literal["uniform", "gaussian"] = Field("uniform", description="its distribution")

    @model_validator(mode="after")
    def _within_converter(self) -> Self:
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


class Design(Part):
    """What all designs can do.

    Every kind of sensor states its `kind` and the `components` of the force on a tactel, the normal
    one first.
    """

    components: ClassVar[tuple[str, ...]]

    @property
    def dimensions(self) -> int:
        """Of the loaded surface and of a picture: 1 of a strip, 2 of a pad."""
        return len(self.components) - 1

    def replace(self, **changes: Any) -> Self:
        """A variant of this design.

        Parameters
        ----------
        **changes
            Dotted paths, ``replace(**{"transducer.length": "30 mm"})``, or nested values,
            ``replace(transducer={"length": "30 mm"})``.  Quantities are SI floats or text.

        Raises
        ------
        DesignError
            If a path does not exist or the variant is not a valid design.
        """
        values = self.model_dump(by_alias=True, exclude_none=True)
        for path, value in changes.items():
            *parents, key = path.split(".")
            branch = values
            for parent in parents:
                if not isinstance(branch.get(parent), dict):
                    known = [name for name, part in branch.items() if isinstance(part, dict)]
                    hint = suggestion(parent, known)
                    raise DesignError(f"{path}: there is no part {parent!r} of a design; {hint}")
                branch = branch[parent]
            branch[key] = _merged(branch.get(key), value)
        return validated(type(self), values, "The changed design", from_file=False)

    def to_toml(self) -> str:
        """The text of a design file that reads back to an equal design."""
        return toml_text(self)


def _merged(old: Any, new: Any) -> Any:
    if isinstance(new, BaseModel):
        new = new.model_dump(by_alias=True, exclude_none=True)
    if isinstance(old, dict) and isinstance(new, dict):
        return old | {key: _merged(old.get(key), value) for key, value in new.items()}
    return new
