"""Pictures in files come back as they were written, in their order."""

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image

from fringeforce.base.errors import FileFormatError, InputError
from fringeforce.pictures.extraction import bits_of
from fringeforce.pictures.files import load_pictures

GREY = np.arange(60, dtype=np.uint8).reshape(6, 10) * 4
DEEP = np.arange(60, dtype=np.uint16).reshape(6, 10) * 68
COLOUR = np.stack([GREY, GREY // 2, GREY // 4], axis=-1)


def read(*paths: Path) -> list[np.ndarray]:
    return [picture for picture, _ in load_pictures(paths)]


def png_of_16_bits(levels: np.ndarray) -> bytes:
    """As the specification says (ISO/IEC 15948): signature, header, rows behind a zero, end."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    rows, columns = levels.shape
    data = b"".join(b"\0" + row.astype(">u2").tobytes() for row in levels)
    header = struct.pack(">IIBBBBB", columns, rows, 16, 0, 0, 0, 0)
    parts = chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(data)), chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def test_lossless_files_hold_what_was_written(tmp_path: Path) -> None:
    Image.fromarray(GREY).save(tmp_path / "grey.png")
    Image.fromarray(COLOUR).save(tmp_path / "colour.png")
    tifffile.imwrite(tmp_path / "deep.tif", DEEP)
    np.save(tmp_path / "colour.npy", COLOUR)
    (tmp_path / "deep.png").write_bytes(png_of_16_bits(DEEP))
    wanted = {"grey.png": GREY, "colour.png": COLOUR, "deep.tif": DEEP}
    wanted |= {"colour.npy": COLOUR, "deep.png": DEEP}
    for name, picture in wanted.items():
        (found,) = read(tmp_path / name)
        assert found.dtype == picture.dtype
        np.testing.assert_array_equal(found, picture)


def test_files_of_several_pictures_give_each(tmp_path: Path) -> None:
    stack = np.array([GREY, GREY + 1])
    tifffile.imwrite(tmp_path / "a.tiff", stack, photometric="minisblack")
    np.save(tmp_path / "b.npy", np.array([COLOUR, COLOUR + 1]))
    np.testing.assert_array_equal(read(tmp_path / "a.tiff"), stack)
    np.testing.assert_array_equal(read(tmp_path / "b.npy"), [COLOUR, COLOUR + 1])


def test_folders_are_read_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    for number in (10, 9, 100):
        Image.fromarray(np.full((3, 4), number, np.uint8)).save(tmp_path / f"shot{number}.png")
    (tmp_path / "notes.txt").write_text("none")
    assert [picture[0, 0] for picture in read(tmp_path)] == [9, 10, 100]


def test_what_is_no_picture_is_refused(tmp_path: Path) -> None:
    (tmp_path / "broken.png").write_bytes(b"\x89PNG\r\n")
    np.save(tmp_path / "real.npy", np.zeros((3, 4)))
    (tmp_path / "broken.mp4").write_bytes(b"no video at all")
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.txt").write_text("none")
    for name, said in {
        "none.png": "no file",
        "broken.png": "cannot be read",
        "broken.mp4": "cannot be decoded",
        "real.npy": "float64",
        "empty": "no pictures",
        "text.txt": "pictures are read from",
    }.items():
        with pytest.raises(FileFormatError, match=said):
            read(tmp_path / name)


def test_bits_of_deep_pictures_must_be_known() -> None:
    assert bits_of([GREY], None, 12) == 8
    assert bits_of([DEEP], None, 12) == 12
    assert bits_of([DEEP], 10, 12) == 10
    with pytest.raises(InputError, match="--bits"):
        bits_of([DEEP], None, 8)
