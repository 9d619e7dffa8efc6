"""What designs of strips and pads have in common: layers, the converter, and how they change."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    SerializerFunctionWrapHandler,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_serializer,
    model_validator,
)
from pydantic_core import ErrorDetails, InitErrorDetails

from fringeforce.base.errors import DesignError
from fringeforce.design.fields import (
    UNSTATED,
    Coefficients,
    Count,
    Finite,
    Length,
    Percent,
    Pressure,
    StrainOptic,
    StressOptic,
    Temperature,
    TemperatureCoefficient,
    Time,
)
from fringeforce.design.light_sources import named
from fringeforce.design.materials import EFFECT, as_values
from fringeforce.design.strain_energy import LAWS, MODULUS, are_pressures, checked_ratios
from fringeforce.design.text import left_out, toml_text
from fringeforce.design.tolerances import Tolerances, excess, number_at, problem_at, take, without
from fringeforce.design.validation import suggestion, validated


class Part(BaseModel):
    """A table of a design or of a study: frozen, and no keys that it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", protected_namespaces=())

    @model_serializer(mode="wrap")
    def _stated(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Values without those that say only that a sensor is ideal, as in files."""
        fields = type(self).model_fields
        return {
            key: value
            for key, value in handler(self).items()
            if key not in self.derived
            and (key not in fields or not left_out(getattr(self, key), fields[key]))
        }

    def __eq__(self, other: object) -> bool:
        """Whether all values are the same; what was computed from them does not count."""
        if type(self) is not type(other):
            return NotImplemented
        return all(getattr(self, key) == getattr(other, key) for key in type(self).model_fields)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with other values, not validated; what was computed from the old ones is not kept.

        Parameters
        ----------
        update : mapping, optional
            Values by field.
        deep : bool
            Whether to copy what the values hold as well.
        """
        fields = type(self).model_fields
        copied = super().model_copy(update=update, deep=deep)
        for name in copied.__dict__.keys() - fields.keys():
            del copied.__dict__[name]
        return copied

    @property
    def derived(self) -> frozenset[str]:
        """Tables that follow from others, and are not stated."""
        return frozenset()

    @classmethod
    def in_full(cls, values: Any) -> Any:
        """Values as written, with what may be written in short as it stands for."""
        return values


class RelaxationTerm(Part):
    """A Prony term: what of a modulus is lost, or what an effect gains, and how fast."""

    share: Percent = Field(
        gt=0, lt=1, description='share of the instantaneous value, such as "6 %"'
    )
    time: Time = Field(description="time in which 1 - 1 / e of it has gone or come [s]")

    @classmethod
    def in_full(cls, values: Any) -> Any:
        """A pair such as ["6 %", "0.4 s"] as a table."""
        if not isinstance(values, list | tuple) or len(values) != 2:
            return values
        if any(isinstance(one, Mapping | list | tuple | Part) for one in values):
            return values
        return dict(zip(cls.model_fields, values, strict=True))


def _terms(value: Any) -> Any:
    """Pairs as tables."""
    if not isinstance(value, list | tuple):
        raise ValueError(
            "is no list of pairs of share and time; write it as in "
            '[["6 %", "0.4 s"], ["4 %", "15 s"]]'
        )
    return tuple(RelaxationTerm.in_full(one) for one in value)


def _some_is_left(terms: tuple[RelaxationTerm, ...]) -> tuple[RelaxationTerm, ...]:
    lost = sum(term.share for term in terms)
    if lost >= 1:
        raise ValueError(f"shares sum to {lost:.0%}; less than 100 % of a modulus can be lost")
    return terms


Terms = Annotated[tuple[RelaxationTerm, ...], BeforeValidator(_terms)]
"""Pairs of share and time, or tables of them."""
Relaxation = Annotated[Terms, AfterValidator(_some_is_left)]
"""Terms of a modulus."""


class Layer(Part):
    """One layer, isotropic and elastic."""

    thickness: Length = Field(description="height of the layer along z [m]")
    youngs_modulus: Pressure = Field(description="Young's modulus E [Pa]")
    poissons_ratio: Finite = Field(gt=-1, lt=0.5, description="Poisson's ratio nu")
    mooney_rivlin: Coefficients = Field(
        default=(),
        description="C10 and C01 of Mooney and Rivlin's strain energy, in the place of "
        'youngs_modulus, ["0.12 MPa", "0.03 MPa"], or as ratios beside it, [0.8, 0.2], whose sum '
        'is 1; without them a layer is neo-Hookean.  They count with strain = "finite"; small '
        "strain takes the modulus that they say",
        json_schema_extra={"ideal": True},
    )
    yeoh: Coefficients = Field(
        default=(),
        description="C10, C20 and C30 of Yeoh's strain energy, as mooney_rivlin: "
        '["0.11 MPa", "-0.01 MPa", "2 kPa"], or ratios to C10, [1, -0.09, 0.02]',
        json_schema_extra={"ideal": True},
    )
    material: str | None = Field(
        default=None,
        description="name in the table of materials, for what the layer itself does not state",
    )
    relaxation: Relaxation = Field(
        default=(),
        description="of this layer alone, in the place of that of the transducer: Prony terms of "
        'its modulus, [["6 %", "0.4 s"]]',
        json_schema_extra={"ideal": True},
    )

    @field_validator(*LAWS)
    @classmethod
    def _are_ratios(cls, ratios: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        return checked_ratios(str(info.field_name), ratios)

    @model_validator(mode="after")
    def _one_law(self) -> Self:
        if self.mooney_rivlin and self.yeoh:
            raise ValueError("has coefficients of two strain energies; state mooney_rivlin or yeoh")
        return self

    @property
    def coefficients(self) -> dict[str, float]:
        """Coefficients of the strain energy by name, C10 alone of a neo-Hookean layer [Pa]."""
        half = self.youngs_modulus / (4 * (1 + self.poissons_ratio))
        law = next((law for law in LAWS if getattr(self, law)), None)
        if law is None:
            return {"C10": half}
        return {
            name: half * ratio for name, ratio in zip(LAWS[law], getattr(self, law), strict=True)
        }


THICKEST = 10.0
"""Largest thickness of a layer, in the longest side of the sensor: beyond it a unit is wrong."""


def check_thickness(longest: float, compliant: Layer, photoelastic: Layer) -> None:
    """Refuse a layer so thick beside the longest side [m] that nothing would pass through it."""
    for name, layer in (("compliant", compliant), ("photoelastic", photoelastic)):
        if layer.thickness > THICKEST * longest:
            raise ValueError(
                f"{name}.thickness = {layer.thickness * 1e3:.4g} mm is more than "
                f"{THICKEST:g} times the longest side, {longest * 1e3:.4g} mm; are both units "
                "right?"
            )


class PhotoelasticLayer(Layer):
    """The clear layer whose stress makes it birefringent."""

    strain_optic_coefficient: StrainOptic = Field(
        default=UNSTATED,
        description="K_s: change of the difference of refractive indices per strain",
    )
    stress_optic_coefficient: StressOptic = Field(
        default=UNSTATED,
        description="C in the place of K_s: the same per stress, such as "
        '"72 TPa^-1"; or give fringe_value = "7 N/mm", at the wavelength of the polariscope',
        json_schema_extra={"unit": "1/pascal"},
    )
    temperature_coefficient: TemperatureCoefficient = Field(
        default=UNSTATED,
        description="relative change of the stress-optic effect with temperature, such as "
        '"-0.2 +/- 0.05 %/K"; without it readings take no temperature',
        json_schema_extra={"unit": "1/kelvin"},
    )
    reference_temperature: Temperature = Field(
        default=293.15,
        description='temperature that the design is of, such as "20 degC"',
        json_schema_extra={"ideal": True, "unit": "kelvin"},
    )
    optical_creep: Terms = Field(
        default=(),
        description="what the photoelastic effect gains under a lasting stress, beside what the "
        'relaxation does: [["2 %", "30 s"]]',
        json_schema_extra={"ideal": True},
    )

    @model_validator(mode="after")
    def _one_effect(self) -> Self:
        if (self.strain_optic_coefficient is None) == (self.stress_optic_coefficient is None):
            stated = "two are stated" if self.strain_optic_coefficient else "none is stated"
            raise ValueError(
                "has one of strain_optic_coefficient (K_s), stress_optic_coefficient, such as "
                f'"72 TPa^-1", and fringe_value, such as "7 N/mm"; {stated}'
            )
        return self

    @property
    def effect(self) -> str:
        """Key that states how strong the photoelastic effect is."""
        by_strain = self.stress_optic_coefficient is None
        return "strain_optic_coefficient" if by_strain else "stress_optic_coefficient"

    @property
    def stress_optic(self) -> float:
        """C, retardance per stress difference and length of path [1/Pa].

        (1 + nu_2) K_s / E_2 where the strain-optic coefficient is stated, equation (2).
        """
        if self.stress_optic_coefficient is not None:
            return self.stress_optic_coefficient
        return (1 + self.poissons_ratio) / self.youngs_modulus * self.strain_optic_coefficient


class Converter(Part):
    """From light to grey levels, equation (13): grey = round(amplitude I + noise + offset)."""

    bits: Count = Field(le=16, description="bits B of the converter, 1 to 16")
    amplitude: Finite = Field(gt=0, description="A, grey levels between dark and bright")
    offset: Finite = Field(ge=0, description="I_o, grey levels of darkness")
    noise: Finite = Field(
        ge=0, description="half width (uniform) or standard deviation (gaussian), grey levels"
    )
    noise_model: Literal["uniform", "gaussian"] = Field("uniform", description="its distribution")
    drift: Percent = Field(
        default=0.0,
        description='relative standard deviation of the light from frame to frame, such as "1 %"',
        json_schema_extra={"ideal": True},
    )
    response: str = Field(
        default="linear",
        description='grey level over light: "linear", "sRGB" (IEC 61966-2-1), or a gamma such as '
        '"0.45", the power of the light as a share of the full scale; noise is added behind it',
        json_schema_extra={"ideal": True},
    )

    gamma: Finite = Field(
        default=1.0,
        gt=0,
        description="power of the grey level as a share of the full scale, behind the response",
        json_schema_extra={"ideal": True},
    )

    clipped: bool = Field(
        default=False,
        description="whether the brightest fringes may exceed the converter; of their pixels "
        "readings know only that they are bright",
        json_schema_extra={"ideal": True},
    )

    @field_validator("response")
    @classmethod
    def _known_response(cls, response: str) -> str:
        if response in ("linear", "sRGB"):
            return response
        try:
            gamma = float(response)
        except ValueError:
            gamma = 0.0
        if not 0 < gamma < np.inf:
            raise ValueError(
                'is no response of a camera; take "linear", "sRGB" or a gamma above zero such as '
                '"0.45"'
            )
        return response

    @model_validator(mode="after")
    def _within_converter(self) -> Self:
        self.check_light(self.amplitude, self.offset, self.noise)
        return self

    def check_light(self, amplitude: float, offset: float, noise: float) -> None:
        """Refuse light that the converter cannot take.

        Parameters
        ----------
        amplitude, offset, noise : float
            Of one channel, grey levels.

        Raises
        ------
        ValueError
            Saying what to do.
        """
        noise = noise if self.noise_model == "uniform" else 0.0
        brightest = amplitude + offset + noise
        if brightest > self.full_scale and not self.clipped:
            raise ValueError(
                f"amplitude + offset + noise = {brightest:g} exceeds the converter's "
                f"2^{self.bits} - 1 = {self.full_scale}; lower the amplitude by "
                f"{brightest - self.full_scale:g}, take more bits, or state clipped = true if the "
                "camera is overexposed"
            )
        if offset < noise:
            raise ValueError(
                f"offset = {offset:g} is below the noise of {noise:g}, so dark pixels would "
                f"fall below zero; raise the offset to {noise:g}"
            )

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
    rivals: ClassVar[Mapping[str, str]] = {}
    """Tables of which one takes the place of the other."""

    @property
    def dimensions(self) -> int:
        """Dimensions of the loaded surface and of a picture: 1 of a strip, 2 of a pad."""
        return len(self.components) - 1

    @property
    def calibration_refusal(self) -> str:
        """Why frames of known loads are not compared with this design; empty if they are."""
        return ""

    tolerances: Tolerances = Field(
        default=Tolerances(),
        description="one standard deviation of each value that has a tolerance, by dotted path; in "
        "a file they stand behind the values",
        json_schema_extra={"ideal": True},
    )

    @model_validator(mode="wrap")
    @classmethod
    def _with_tolerances(
        cls, values: Any, handler: ModelWrapValidatorHandler[Self], info: ValidationInfo
    ) -> Self:
        if not isinstance(values, Mapping):
            return handler(values)
        if "tolerances" in values and info.context and info.context["units_required"]:
            raise ValueError(
                "has a table of tolerances; write each behind its value, as in "
                'thickness = "0.50 +/- 0.02 mm"'
            )
        if not isinstance(values.get("tolerances", {}), Mapping):
            raise ValueError("has tolerances that are no mapping from dotted paths to numbers")
        whole, unread = as_values(values)
        plain, found, problems = take(cls, whole)
        problems = unread + problems
        stated = {**values.get("tolerances", {}), **found}
        plain["tolerances"] = {path: std for path, std in stated.items() if std != 0}
        design = None
        try:
            design = handler(plain)
        except ValidationError as error:
            places = {problem.get("loc") for problem in problems}
            problems += [_again(e) for e in error.errors() if e["loc"] not in places]
        if design is not None:
            problems += [
                problem
                for path, std in design.tolerances.items()
                if path not in found and (problem := _stated_problem(design, path, std))
            ]
        if problems:
            raise ValidationError.from_exception_data(cls.__name__, problems)
        assert design is not None
        return design

    def replace(self, **changes: Any) -> Self:
        """A variant of this design.

        Parameters
        ----------
        **changes
            Dotted paths, ``replace(**{"transducer.length": "30 mm"})``, or nested values,
            ``replace(transducer={"length": "30 mm"})``.  Quantities are SI floats or text, with a
            tolerance or without.  A value keeps the tolerance that it had unless the text states
            another, "30 +/- 0 mm" for none; ``tolerances={path: std}`` adds to what there is.

        Raises
        ------
        DesignError
            If a path does not exist or the variant is not a valid design.
        """
        values = self.model_dump(by_alias=True, exclude_none=True)
        # a bandwidth that is stated counts before that of a light source
        for path, value in sorted(changes.items(), key=lambda one: one[0].endswith(".bandwidth")):
            if path != "tolerances":
                values["tolerances"] = without(values.get("tolerances", {}), path, value)
            *parents, key = path.split(".")
            branch: Any = values
            for parent in parents:
                branch = _part(branch, parent, path)
            if isinstance(branch, list):
                branch[_index(branch, key, path)] = value
                continue
            for rival in _rivals(key, value):
                branch.pop(rival, None)
                if rival != key:
                    lost = path.removesuffix(key) + rival
                    values["tolerances"] = without(values.get("tolerances", {}), lost, None)
            if key == "wavelength" and named(value):
                branch.pop("bandwidth", None)
            branch[key] = _merged(branch.get(key), value)
        stated = {path.split(".")[0] for path in changes}
        for table in stated & self.rivals.keys():
            if self.rivals[table] not in stated:
                values.pop(self.rivals[table], None)
        return validated(type(self), values, "The changed design", from_file=False)

    def to_toml(self) -> str:
        """The text of a design file that reads back to an equal design."""
        return toml_text(self)


def _part(branch: Any, name: str, path: str) -> Any:
    """A table below another or below a list, by its name or number, or a list, now changeable."""
    key: Any = _index(branch, name, path) if isinstance(branch, list) else name
    found = branch[key] if isinstance(branch, list) else branch.get(name)
    if isinstance(found, tuple):
        found = branch[key] = list(found)
    if isinstance(found, dict | list):
        return found
    if isinstance(branch, list):
        raise DesignError(f"{path}: {name} of the list is a number and has no parts.")
    known = [own for own, part in branch.items() if isinstance(part, dict | list | tuple)]
    raise DesignError(f"{path}: there is no part {name!r} of a design; {suggestion(name, known)}")


def _index(branch: list[Any], name: str, path: str) -> int:
    """Number of an element of a list."""
    if name.isdigit() and int(name) < len(branch):
        return int(name)
    raise DesignError(f"{path}: there is no {name!r} in a list of {len(branch)}, counted from 0.")


def _rivals(key: str, value: Any) -> tuple[str, ...]:
    """Keys of a table whose values a new value takes the place of, its own among them."""
    if key in EFFECT:
        return EFFECT
    if key not in LAWS:
        return ()
    return (*LAWS, MODULUS) if are_pressures(value) else tuple(LAWS)


def _again(error: ErrorDetails) -> InitErrorDetails:
    """A problem that pydantic found, to be raised together with others."""
    kind: Any = error["type"]
    return {"type": kind, "loc": error["loc"], "input": error["input"], "ctx": error.get("ctx", {})}


def _stated_problem(design: Design, path: str, std: float) -> InitErrorDetails | None:
    """What is wrong with a tolerance that is not written behind its value."""
    found, place = number_at(design, path), ("tolerances", path)
    if LAWS.keys() & path.split("."):
        return problem_at(
            place, std, f"is of a ratio of coefficients, which takes none; give {MODULUS} one"
        )
    if found is None:
        return problem_at(
            place, std, "belongs to no number of the design; give the dotted path of one"
        )
    if not 0 <= std < np.inf:
        return problem_at(
            place, std, "is no standard deviation; it must be finite and not negative"
        )
    wrong = excess(found[0], std, found[1])
    key = tuple(int(k) if k.isdigit() else k for k in path.split("."))
    return None if wrong is None else problem_at(key, found[0], wrong)


def _merged(old: Any, new: Any) -> Any:
    if isinstance(new, BaseModel):
        new = new.model_dump(by_alias=True, exclude_none=True)
    if isinstance(old, dict) and isinstance(new, dict):
        if named(new.get("wavelength")):
            old = {key: value for key, value in old.items() if key != "bandwidth"}
        return old | {key: _merged(old.get(key), value) for key, value in new.items()}
    return new
