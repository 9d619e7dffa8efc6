"""Pictures in files: PNG, JPEG, TIFF, arrays, videos, and folders of them, one after another."""

from __future__ import annotations

import os
import re
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.errors import FileFormatError
from fringeforce.base.optional_libraries import extra
from fringeforce.base.storage import load_array

STILLS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
VIDEOS = (".mp4", ".avi", ".mkv", ".mov", ".webm")
ARRAYS = (".npy", ".tif", ".tiff")
ENDINGS = (*STILLS, ".npy", *VIDEOS)
AHEAD = 2
"""Files that are decoded at a time, the one that is asked for and the next: while lines are taken
from one picture another is decoded, which needs no interpreter."""
Picture = NDArray[Any]


def is_pictures(path: str | os.PathLike[str]) -> bool:
    """Whether a path is a folder, or a file whose ending is one of pictures or videos."""
    return Path(path).is_dir() or Path(path).suffix.lower() in ENDINGS


def load_pictures(
    paths: Iterable[str | os.PathLike[str]],
) -> Iterator[tuple[Picture, float | None]]:
    """Read pictures one after another, so that a long video needs no more memory than a short one.

    Parameters
    ----------
    paths : iterable of path
        PNG, JPEG, BMP, TIFF (of several pages, too), .npy of shape (rows, columns),
        (k, rows, columns) or either with three colours last, videos, and folders, whose files
        count in the order of the numbers in their names.

    Yields
    ------
    picture : ndarray, shape (rows, columns) or (rows, columns, 3)
        Grey levels as stored, unsigned; 16 bits may hold fewer.
    time : float or None
        When a video shows it, since its start [s].

    Raises
    ------
    FileFormatError
        If a file is missing, damaged or of a kind that is not read.
    """
    files = [file for path in paths for file in _files(Path(path))]
    stills = (file for file in files if file.suffix.lower() not in VIDEOS)
    with ThreadPoolExecutor(AHEAD) as threads:
        begun = deque[Future[Iterable[Picture]]]()
        for file in files:
            if file.suffix.lower() in VIDEOS:
                yield from _video(file)
                continue
            begun.extend(threads.submit(_still, one) for one in islice(stills, AHEAD - len(begun)))
            for picture in begun.popleft().result():
                yield _checked(file, picture), None


def _files(path: Path) -> list[Path]:
    if not path.exists():
        raise FileFormatError(
            f"There is no file {path}; give the path of pictures, or of a folder of them."
        )
    if not path.is_dir():
        if path.suffix.lower() not in ENDINGS:
            raise FileFormatError(
                f"{path}: pictures are read from {', '.join(ENDINGS)} and folders of them."
            )
        return [path]
    found = [file for file in path.iterdir() if file.suffix.lower() in ENDINGS]
    if not found:
        raise FileFormatError(f"{path} holds no pictures ({', '.join(ENDINGS)}).")
    return sorted(found, key=_natural)


def _natural(path: Path) -> list[tuple[int, str]]:
    """Order of names in which 10 comes behind 9."""
    parts = re.split(r"(\d+)", path.name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]


def _still(path: Path) -> Iterable[Picture]:
    """The pictures of one file."""
    ending = path.suffix.lower()
    try:
        if ending in ARRAYS:
            stack = load_array(path)
        else:
            from PIL import Image, ImageOps

            with Image.open(path) as stored:
                ImageOps.exif_transpose(stored, in_place=True)  # as viewers show it
                exact = stored.mode in ("L", "RGB", "I;16", "I")
                stack = np.asarray(stored if exact else stored.convert("RGB"))
                # Pillow opens PNG of 16 bits with 32
                stack = stack.astype(np.uint16) if stack.dtype == np.int32 else stack
    except FileFormatError:
        raise
    except Exception as error:  # decoders raise errors of any kind on damaged files
        raise FileFormatError(
            f"{path} cannot be read as pictures: {error}. Give pictures that a viewer opens."
        ) from None
    if stack.ndim > 2 and stack.shape[-1] == 4:  # the fourth plane is how opaque a pixel is
        stack = stack[..., :3]
    colour = stack.ndim > 2 and stack.shape[-1] == 3
    return [stack] if stack.ndim == 2 + colour else stack


def _checked(path: Path, picture: Picture) -> Picture:
    if picture.ndim not in (2, 3) or (picture.ndim == 3 and picture.shape[2] != 3):
        raise FileFormatError(
            f"{path} holds arrays of shape {picture.shape}; pictures have rows, columns and, if "
            "they are in colour, three planes last."
        )
    if picture.dtype not in (np.uint8, np.uint16):
        raise FileFormatError(
            f"{path} holds {picture.dtype}; pictures are unsigned whole numbers of 8 or 16 bits."
        )
    return picture


def decoded(frame: Any) -> Picture:
    """The picture of a frame of PyAV: grey with 8 or 16 bits, or three colours of 8."""
    grey = frame.format.name.startswith("gray")
    deep = frame.format.components[0].bits > 8
    return frame.to_ndarray(format=("gray16le" if deep else "gray") if grey else "rgb24")


def _video(path: Path) -> Iterator[tuple[Picture, float | None]]:
    """Pictures of a video and when they are shown, decoded by FFmpeg."""
    av = extra("av", "pictures")
    codec = "is unknown"
    try:
        with av.open(str(path)) as container:
            if not container.streams.video:
                raise FileFormatError(f"{path} holds no video.")
            stream = container.streams.video[0]
            if stream.codec_context is None:
                raise ValueError("there is no decoder for it")
            codec = f"is {stream.codec_context.name}"
            for frame in container.decode(stream):
                yield np.rot90(decoded(frame), frame.rotation // 90), frame.time
    except (av.error.FFmpegError, ValueError) as error:
        what = getattr(error, "strerror", None) or error
        raise FileFormatError(
            f"{path} cannot be decoded; its codec {codec}: {what}. Codecs that can be decoded come "
            "with pip install '.[pictures]', which brings FFmpeg; record H.264, MJPEG or FFV1, or "
            "save pictures."
        ) from None
