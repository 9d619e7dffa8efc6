"""Messages between page and server: a JSON header and blocks of numbers, in one binary frame.

A frame is the header's length (uint32, little endian), the header (UTF-8 JSON padded with spaces),
and the blocks one after another, each starting at a multiple of eight bytes so that the page can
look at them in place.  The header's ``blocks`` say what they are: ``[name, dtype, shape, offset]``
with the offset counted from the end of the header.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from fringeforce.base.errors import InputError

MAX_REQUEST = 65536
"""Largest message that the server accepts [bytes]; 64 tactels need a tenth of it."""
_PAD = 8
_DTYPES = {"f4": "<f4", "u1": "<u1", "u2": "<u2", "i4": "<i4"}

Pair = Annotated[list[int], Field(min_length=2, max_length=2)]
Term = dict[Literal["share", "time"], Annotated[str, Field(max_length=60)] | float]
Terms = Annotated[list[Term], Field(max_length=8)]
Value = Annotated[str, Field(max_length=200)] | int | float | bool | Pair | Terms
Slot = Literal["main", "free", "roller", "camera"]
File = Literal["design", "model", "forces", "reading"]
Seed = Annotated[int, Field(ge=0, lt=2**32)]
Force = Annotated[float, Field(ge=-1000, le=1000, allow_inf_nan=False)]
Forces = Annotated[
    list[Annotated[list[Force], Field(min_length=2, max_length=2)]], Field(max_length=64)
]


class Request(BaseModel):
    """What every question of a page has."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    type: Any
    id: Annotated[int, Field(ge=0)]

    @property
    def topic(self) -> str:
        """What it is about; of requests about the same, only the last is answered."""
        return self.type


class AboutDesign(Request):
    """About a design that was asked for before, by that wish's number."""

    design: int


class DesignRequest(Request):
    """Characterise a design: one that the server knows by name, with changes by dotted path."""

    type: Literal["design"]
    slot: Slot = "main"
    start: Annotated[str, Field(max_length=200)] = ""
    changes: Annotated[
        dict[Annotated[str, Field(max_length=100)], Value], Field(max_length=40)
    ] = {}

    @property
    def topic(self) -> str:
        """A design replaces the one before it in its slot."""
        return self.slot


class InsideRequest(AboutDesign):
    """Figures of a design, and what is inside it."""

    type: Literal["inside"]
    slot: Slot = "main"

    @property
    def topic(self) -> str:
        """The slot of the design: each has one answer."""
        return f"{self.type} {self.slot}"


class LoadedRequest(AboutDesign):
    """About a strip under forces [N]."""

    forces: Forces
    seed: Seed = 0


class ReadRequest(LoadedRequest):
    """Expose one noisy camera line and read it."""

    type: Literal["read"]


class StrainRequest(LoadedRequest):
    """Compare the light of small and of finite strain."""

    type: Literal["strain"]


class CreepRequest(LoadedRequest):
    """Press, hold for so long and release; as the terms of the design ask for if it is 0 s."""

    type: Literal["creep"]
    held: Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)] = 0.0


class DownloadRequest(LoadedRequest):
    """A file of the design, the model, the forces or the reading."""

    type: Literal["download"]
    kind: File


class LiveRequest(Request):
    """What is new of the camera, which is started if need be."""

    type: Literal["live"]
    friction: Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)] = 0.5
    again: bool = False


_Loaded = ReadRequest | StrainRequest | CreepRequest | DownloadRequest
_Wish = DesignRequest | InsideRequest | LiveRequest | _Loaded
STRIP: TypeAdapter[Request] = TypeAdapter(Annotated[_Wish, Field(discriminator="type")])
"""What the page of a strip may ask."""


def encoded(header: Mapping[str, Any], blocks: Mapping[str, NDArray[Any]] | None = None) -> bytes:
    """One binary frame.

    Parameters
    ----------
    header : mapping
        JSON values.
    blocks : mapping of str to ndarray, optional
        Numbers; floats travel as float32, unsigned integers as they are.
    """
    arrays = {name: _portable(values) for name, values in (blocks or {}).items()}
    entries, body = [], bytearray()
    for name, (dtype, values) in arrays.items():
        entries.append([name, dtype, list(values.shape), len(body)])
        body += values.tobytes()
        body += bytes(-len(body) % _PAD)
    text = json.dumps({**header, "blocks": entries}, allow_nan=False).encode()
    text = text.ljust(len(text) + -(len(text) + 4) % _PAD)
    return len(text).to_bytes(4, "little") + text + bytes(body)


def decoded(frame: bytes) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Header and blocks of a frame.

    Raises
    ------
    InputError
        If it is no such frame.
    """
    try:
        length = int.from_bytes(frame[:4], "little")
        header = json.loads(frame[4 : 4 + length])
        blocks = {
            name: np.frombuffer(
                frame, _DTYPES[dtype], int(np.prod(shape)), 4 + length + start
            ).reshape(shape)
            for name, dtype, shape, start in header.get("blocks", [])
        }
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise InputError("This is no message of the explorer's page.") from None
    return header, blocks


def request(frame: bytes, understood: TypeAdapter[Request] = STRIP) -> Request:
    """What the page asks for.

    Parameters
    ----------
    frame : bytes
        As it came.
    understood : TypeAdapter
        What this page may ask.

    Raises
    ------
    InputError
        If it is nothing that it may ask; the message says why.
    """
    header, _ = decoded(frame)
    header.pop("blocks", None)
    try:
        return understood.validate_python(header)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"][1:])) or "the message"
        raise InputError(f"The server cannot use {place}: {first['msg']}.") from None


def _portable(values: NDArray[Any]) -> tuple[str, NDArray[Any]]:
    array = np.asarray(values)
    if array.dtype in (np.uint8, np.uint16):
        dtype = f"u{array.itemsize}"
    else:
        dtype = "i4" if array.dtype.kind in "ib" else "f4"
    return dtype, np.ascontiguousarray(array, _DTYPES[dtype])
