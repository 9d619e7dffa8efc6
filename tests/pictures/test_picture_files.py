"""Pictures in files come back as they were written, in their order."""

import struct
import zlib
from pathlib import Path
from typing import Any

import av
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
    for name, levels in {"lzw": GREY, "deep_lzw": DEEP}.items():
        Image.fromarray(levels).save(tmp_path / f"{name}.tif", compression="tiff_lzw")
    (tmp_path / "deep.png").write_bytes(png_of_16_bits(DEEP))
    wanted = {"grey.png": GREY, "colour.png": COLOUR, "deep.tif": DEEP}
    wanted |= {"lzw.tif": GREY, "deep_lzw.tif": DEEP}
    wanted |= {"colour.npy": COLOUR, "deep.png": DEEP}
    for name, picture in wanted.items():
        (found,) = read(tmp_path / name)
        assert found.dtype == picture.dtype
        np.testing.assert_array_equal(found, picture)


def test_files_of_several_pictures_give_each(tmp_path: Path) -> None:
    stack = np.array([GREY, GREY + 1])
    first, second = map(Image.fromarray, stack)
    first.save(tmp_path / "c.tif", save_all=True, append_images=[second], compression="tiff_lzw")
    tifffile.imwrite(tmp_path / "a.tiff", stack, photometric="minisblack")
    np.save(tmp_path / "b.npy", np.array([COLOUR, COLOUR + 1]))
    for name in ("a.tiff", "c.tif"):
        np.testing.assert_array_equal(read(tmp_path / name), stack)
    np.testing.assert_array_equal(read(tmp_path / "b.npy"), [COLOUR, COLOUR + 1])


def test_folders_are_read_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    for number in (10, 9, 100):
        Image.fromarray(np.full((3, 4), number, np.uint8)).save(tmp_path / f"shot{number}.png")
    (tmp_path / "notes.txt").write_text("none")
    assert [picture[0, 0] for picture in read(tmp_path)] == [9, 10, 100]


def film(path: Path, codec: str, form: str, turned: int = 0) -> None:
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream(codec, rate=25)
        stream.height, stream.width = 40, 60
        stream.pix_fmt = form
        if turned:
            stream.set_display_rotation(turned)
        picture = np.zeros((40, 60, 3), np.uint8)
        picture[:10, :10] = 250
        container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, "rgb24")))
        container.mux(stream.encode())


def test_pictures_are_turned_as_viewers_turn_them(tmp_path: Path) -> None:
    corner = np.zeros((40, 60), np.uint8)
    corner[:10, :10] = 250
    exif = Image.Exif()
    exif[0x0112] = 6  # Exif 2.32, 4.6.4: row 0 is the right-hand side, column 0 the top
    Image.fromarray(corner).save(tmp_path / "phone.jpg", exif=exif)
    film(tmp_path / "phone.mp4", "libx264", "yuv420p", turned=-90)
    for name in ("phone.jpg", "phone.mp4"):
        (picture,) = read(tmp_path / name)
        assert picture.shape[:2] == (60, 40)
        assert picture[:8, -8:].mean() > 200
        assert picture[:8, :8].mean() < 50


def test_a_video_without_a_decoder_is_refused_with_what_to_install(tmp_path: Path) -> None:
    film(tmp_path / "good.avi", "mjpeg", "yuvj420p")
    (tmp_path / "odd.avi").write_bytes(
        (tmp_path / "good.avi").read_bytes().replace(b"MJPG", b"ZZ12")
    )
    with pytest.raises(FileFormatError, match=r"no decoder.*pip install '\.\[pictures\]'"):
        read(tmp_path / "odd.avi")


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
