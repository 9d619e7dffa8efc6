"""Frames between page and server."""

import json

import numpy as np
import pytest

from fringeforce.base.errors import InputError
from fringeforce.explorer.protocol import DesignRequest, ReadRequest, decoded, encoded, request


def message(**header: object) -> bytes:
    return encoded(header)


def test_blocks_come_back_as_they_went_and_lie_where_typed_arrays_can_look_at_them() -> None:
    rng = np.random.default_rng(0)
    blocks = {
        "psi": rng.normal(size=(3, 5)).astype(np.float32),
        "frame": rng.integers(0, 255, 7, dtype=np.uint8),
        "deep": rng.integers(0, 65535, 3, dtype=np.uint16),
        "nothing": np.empty((0, 2, 4), np.float32),
    }
    frame = encoded({"type": "test", "text": "µ"}, blocks)
    header, found = decoded(frame)
    assert header["text"] == "µ"
    length = int.from_bytes(frame[:4], "little")
    for name, _, _, offset in header["blocks"]:
        assert (4 + length + offset) % 8 == 0
        assert found[name].dtype == blocks[name].dtype
        np.testing.assert_array_equal(found[name], blocks[name])


def test_a_message_is_never_json_that_a_browser_cannot_parse() -> None:
    with pytest.raises(ValueError, match="JSON"):
        encoded({"value": float("nan")})


@pytest.mark.parametrize(
    "frame",
    [
        b"",
        b"\x05\x00",
        b"\xff\xff\xff\xffjunk",
        (2).to_bytes(4, "little") + b"[]",
        (4).to_bytes(4, "little") + b"null",
        (10**5).to_bytes(4, "little") + b"[" * 10**5,
        encoded({"type": "read"})[:-3],
        (25).to_bytes(4, "little") + json.dumps({"blocks": [["a", "f4"]]}).encode(),
    ],
    ids=range(8),
)
def test_noise_is_refused_and_never_crashes(frame: bytes) -> None:
    with pytest.raises(InputError):
        request(frame)


@pytest.mark.parametrize(
    ("header", "place"),
    [
        ({"type": "shutdown", "id": 1}, "message"),
        ({"type": "read", "id": -1, "design": 1, "forces": [[1.0, 0.0]]}, "id"),
        ({"type": "read", "id": 1, "design": 1, "forces": [[1.0]]}, "forces.0"),
        ({"type": "read", "id": 1, "design": 1, "forces": [[1e9, 0.0]]}, "forces.0.0"),
        ({"type": "read", "id": 1, "design": 1, "forces": [[0.0] * 2] * 65}, "forces"),
        ({"type": "design", "id": 1, "slot": "other"}, "slot"),
        ({"type": "design", "id": 1, "changes": {"a": "b" * 300}}, "changes.a"),
        ({"type": "design", "id": 1, "changes": {str(i): 1 for i in range(50)}}, "changes"),
        ({"type": "design", "id": 1, "path": "/etc"}, "path"),
        ({"type": "download", "id": 1, "kind": "../x", "design": 1, "forces": []}, "kind"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_a_page_may_not_ask_is_refused_by_its_place(
    header: dict[str, object], place: str
) -> None:
    with pytest.raises(InputError, match=place.replace(".", r"\.")):
        request(message(**header))


def test_what_a_page_may_ask_is_understood() -> None:
    design = request(message(type="design", id=3, changes={"camera.bits": 10}))
    assert isinstance(design, DesignRequest)
    assert design.changes == {"camera.bits": 10}
    read = request(message(type="read", id=4, design=3, forces=[[1, 0.5], [0, 0]], seed=7))
    assert isinstance(read, ReadRequest)
    assert read.forces == [[1.0, 0.5], [0.0, 0.0]]
