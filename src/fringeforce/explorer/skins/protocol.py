"""What the page of a skin may ask."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from fringeforce.explorer.protocol import AboutDesign, DesignRequest, Force, Request, Seed

MOST = 6
"""Fingers at a time: as many as are looked for."""


class Finger(BaseModel):
    """A rigid round fingertip across the strip.

    Attributes
    ----------
    x : float
        Place along the strip [m].
    radius : float
        Of the fingertip [m].
    normal, tangential : float
        How hard it presses, and drags towards +x [N].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    x: Annotated[float, Field(ge=-1, le=1, allow_inf_nan=False)]
    radius: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)]
    normal: Annotated[float, Field(ge=0, le=1000, allow_inf_nan=False)]
    tangential: Force = 0.0


class SkinRequest(AboutDesign):
    """About a skin that is pressed."""

    contacts: Annotated[list[Finger], Field(max_length=MOST)]
    seed: Seed = 0


class SkinReadRequest(SkinRequest):
    """Expose one noisy camera line, read it, and tell what is true."""

    type: Literal["read"]


class SkinStrainRequest(SkinRequest):
    """Compare the light of small and of finite strain."""

    type: Literal["strain"]


class SkinDownloadRequest(SkinRequest):
    """A file of the design, the model or the reading."""

    type: Literal["download"]
    kind: Literal["design", "model", "reading"]


_Wish = DesignRequest | SkinReadRequest | SkinStrainRequest | SkinDownloadRequest
SKIN: TypeAdapter[Request] = TypeAdapter(Annotated[_Wish, Field(discriminator="type")])
