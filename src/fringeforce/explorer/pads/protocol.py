"""What the page of a pad may ask."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from fringeforce.explorer.protocol import (
    AboutDesign,
    DesignRequest,
    File,
    Force,
    LiveRequest,
    Request,
    Seed,
)

MOST = 12
"""Fingers at a time."""
Place = Annotated[float, Field(ge=-1, le=1, allow_inf_nan=False)]


class Finger(BaseModel):
    """A fingertip on the pad.

    Attributes
    ----------
    x, y : float
        Centre of its contact [m].
    radius : float
        Radius of the round patch that touches [m].
    normal : float
        How hard it presses [N].
    shear_x, shear_y : float
        What it drags with [N].
    twist : float
        Moment about the normal, positive from x to y [N m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    x: Place
    y: Place
    radius: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)]
    normal: Annotated[float, Field(ge=0, le=1000, allow_inf_nan=False)]
    shear_x: Force = 0.0
    shear_y: Force = 0.0
    twist: Force = 0.0


class PressedRequest(AboutDesign):
    """About a design that is pressed, a skin with this friction."""

    contacts: Annotated[list[Finger], Field(max_length=MOST)]
    friction: Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)] = 0.6
    seed: Seed = 0


class PressRequest(PressedRequest):
    """Forces of the tactels and what is seen; coarse while something moves."""

    type: Literal["press"]
    view: Annotated[str, Field(max_length=40)] = "white"
    fine: bool = True


class SlicesRequest(PressedRequest):
    """Retardance of every slice."""

    type: Literal["slices"]


class PadReadRequest(PressedRequest):
    """Expose one noisy frame and read it."""

    type: Literal["read"]


class PadDownloadRequest(PressedRequest):
    """A file of the design, the model, the forces or the reading."""

    type: Literal["download"]
    kind: File


_Pressed = PressRequest | SlicesRequest | PadReadRequest | PadDownloadRequest
_Wish = DesignRequest | LiveRequest | _Pressed
PAD: TypeAdapter[Request] = TypeAdapter(Annotated[_Wish, Field(discriminator="type")])
