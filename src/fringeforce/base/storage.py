"""Files whole or not at all, and refused if they are not what is meant: HDF5, arrays, pictures."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import FileFormatError, FringeforceError
from fringeforce.base.unclosed_files import UnclosedFile

if TYPE_CHECKING:
    PathLike = str | os.PathLike[str]

FORMAT_VERSION = 2
"""Since version 2 the axes of forces end in (tactel, component), of strips too."""
HDF5 = (".h5", ".hdf5", ".nc")
"""Endings of these files."""
FORCE_AXES = ("tactel", "component")
"""Last dimensions of forces and of what belongs to them."""
CALLED = {
    "model": "a model",
    "pad": "a model of a pad",
    "frames": "frames",
    "images": "images of a pad",
    "dataset": "images of a data set",
    "readings": "readings",
    "study": "results of a study",
}
"""What files of each kind hold, in words."""
LIBRARIES = ("fringeforce", "numpy", "scipy", "scikit-fem")
SEAL, UNFINISHED = b"\nfringeforce-sha256:", b"\nfringeforce-layout:"
"""What stands after the end of an HDF5 file, where HDF5 reads nothing, before the digest: of the
whole, or, while values are written in place, of all but them, which have checksums of their own."""
DIGEST_BYTES = hashlib.sha256().digest_size
UNREADABLE = (
    OSError,
    LookupError,
    ValueError,
    RuntimeError,
    TypeError,
    AssertionError,
    MemoryError,
)
"""What h5py and NumPy raise on files that are damaged."""


@contextmanager
def writing(path: PathLike) -> Iterator[None]:
    """Say what cannot be written and why, where the system has refused.

    Raises
    ------
    FileFormatError
        In place of the system's own error.
    """
    try:
        yield
    except FringeforceError:
        raise
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else error
        raise FileFormatError(f"{path} cannot be written: {reason}.") from None


@contextmanager
def whole_file(path: PathLike, *, keep: bool = False) -> Iterator[Path]:
    """Where to write a file, or a new folder, that takes its name only once it is complete.

    With `keep` a file of that name that another process has made meanwhile stays instead.

    Raises
    ------
    FileFormatError
        If there is no such folder, or the file cannot be written.
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise FileFormatError(f"{target} cannot be written: there is no folder {target.parent}.")
    hidden = f".{target.name}."
    with writing(target), tempfile.TemporaryDirectory(dir=target.parent, prefix=hidden) as folder:
        unfinished = Path(folder) / target.name
        yield unfinished
        if not keep:
            os.replace(unfinished, target)
            return
        with suppress(FileExistsError):
            try:
                os.link(unfinished, target)
            except PermissionError:  # a file system without hard links
                os.replace(unfinished, target)


@contextmanager
def new_file(
    path: PathLike, kind: str, *, sealed: bool = True, keep: bool = False
) -> Iterator[h5py.File]:
    """An HDF5 file that takes its name only once it is complete; `keep` as of `whole_file`.

    Its checksum follows it unless `sealed` is false: a file that will be written to has none, but
    the library's own of all that describes its arrays.
    """
    own: dict[str, Any] = {} if sealed else {"libver": "v108"}  # which has no mark of who writes
    with whole_file(path, keep=keep) as place:
        # in memory first: HDF5 does not recover from a disk that is full
        with h5py.File(
            place, "w", track_order=True, driver="core", backing_store=False, **own
        ) as file:
            stamp(file, kind)
            yield file
            file.flush()
            image = file.id.get_file_image()
        with place.open("wb") as end:
            end.write(image)
            if sealed:
                end.write(SEAL + hashlib.sha256(image).digest())


def seal(path: PathLike, opened: h5py.File | None = None) -> None:
    """Write a checksum behind a file: of the whole, or, while it is open, of all but its arrays.

    These need a checksum of each chunk then, and places that stay where they are.
    """
    place = Path(path)
    unseal(place)
    if opened is not None:
        opened.flush()  # which also cuts off what stood behind the end when it was opened
    digest = _digest(place, place.stat().st_size, [] if opened is None else _chunks(opened))
    with place.open("ab") as file:
        file.write((SEAL if opened is None else UNFINISHED) + digest)


def unseal(path: PathLike) -> None:
    """Take the checksum off a file that will be written to, if it has one."""
    if _sealed(Path(path))[1]:
        os.truncate(path, _content(Path(path)))


def _content(place: Path) -> int:
    """Bytes before the checksum of a file that has one."""
    return max(place.stat().st_size - len(SEAL) - DIGEST_BYTES, 0)


def _chunks(file: h5py.File) -> list[tuple[int, int]]:
    """Where the values of a file begin and end, in its order."""
    found = [
        one.id.get_chunk_info(number)
        for one in (dataset(file, name) for name in file)
        for number in range(one.id.get_num_chunks())
    ]
    return sorted((chunk.byte_offset, chunk.byte_offset + chunk.size) for chunk in found)


def _digest(path: Path, size: int, without: Sequence[tuple[int, int]]) -> bytes:
    """SHA-256 of the first bytes of a file, but for some stretches."""
    found = hashlib.sha256()
    starts, ends = [0, *(end for _, end in without)], [*(start for start, _ in without), size]
    with path.open("rb") as file:
        for start, end in zip(starts, ends, strict=True):
            file.seek(start)
            while start < end and (block := file.read(min(end - start, 1 << 20))):
                found.update(block)
                start += len(block)
    return found.digest()


def _verify(path: PathLike) -> None:
    """Raise FileFormatError if a file differs from its checksum; older files have none."""
    place = Path(path)
    if place.exists() and not place.is_file():
        raise FileFormatError(f"{path} is no regular file; give the path of an HDF5 file.")
    kind, digest = _sealed(place)
    values: list[tuple[int, int]] = []
    if kind == UNFINISHED:
        with h5py.File(place, "r") as file:
            values = _chunks(file)
    if kind and digest != _digest(place, _content(place), values):
        raise FileFormatError(
            f"{path} is damaged: its content does not match its checksum; restore it from a copy "
            "or make it again (a model: characterize or calibrate again)."
        )


def _sealed(place: Path) -> tuple[bytes, bytes]:
    """The kind of checksum that a file says it has, and the checksum; empty if it says nothing."""
    with place.open("rb") as file:
        file.seek(_content(place))
        end = file.read()
    kind = end[: len(SEAL)]
    return (kind, end[len(SEAL) :]) if kind in (SEAL, UNFINISHED) else (b"", b"")


def stamp(file: h5py.File, kind: str) -> None:
    """Write what a file is, when it was made and by which versions."""
    file.attrs["format"] = f"fringeforce-{kind}"
    file.attrs["format_version"] = FORMAT_VERSION
    file.attrs["created"] = datetime.now(UTC).isoformat(timespec="seconds")
    file.attrs["versions"] = json.dumps({name: version(name) for name in LIBRARIES})


@contextmanager
def existing_file(path: PathLike, kind: str, *others: str) -> Iterator[h5py.File]:
    """An HDF5 file of one of some kinds, opened to read; FileFormatError for any other."""
    try:
        _verify(path)
        with _opened(path) as file:
            found = str(file.attrs.get("format", "")).removeprefix("fringeforce-")
            if found not in (kind, *others):
                own = CALLED.get(found, "what fringeforce did not write")
                raise FileFormatError(
                    f"{path} holds {own}, and {CALLED[kind]} must be in this file; give another, "
                    "or look whether two are swapped."
                )
            newest = int(file.attrs.get("format_version", 0))
            if newest > FORMAT_VERSION:
                raise FileFormatError(
                    f"{path} has format version {newest}; this fringeforce reads up to "
                    f"{FORMAT_VERSION}. Update fringeforce."
                )
            yield file
    except FringeforceError:
        raise
    except FileNotFoundError:
        raise FileFormatError(f"There is no file {path}; give the path of one.") from None
    except UNREADABLE as error:
        raise FileFormatError(
            f"{path} is not a complete HDF5 file with {CALLED[kind]} ({error}). It may be "
            "truncated or of another kind; write it again."
        ) from None


@contextmanager
def _opened(path: PathLike) -> Iterator[h5py.File]:
    """The file for reading, even if it is being recorded or its recorder was killed."""
    with ExitStack() as stack:
        try:
            file = h5py.File(path, "r")
        except FileNotFoundError:
            raise
        except OSError:
            file = h5py.File(stack.enter_context(UnclosedFile(path)), "r")
        yield stack.enter_context(file)


def write(
    file: h5py.File,
    name: str,
    values: Any,
    dimensions: tuple[str, ...],
    unit: str | None,
    meaning: str,
) -> None:
    """Write an array with its unit, its meaning and the names of its dimensions."""
    data = np.asarray(values, dtype=h5py.string_dtype() if isinstance(values[0], str) else None)
    compress: Mapping[str, Any] = {"compression": "gzip"} if data.nbytes > 65536 else {}
    describe(file.create_dataset(name, data=data, **compress), dimensions, unit, meaning)


def describe(
    dataset: h5py.Dataset, dimensions: tuple[str, ...], unit: str | None, meaning: str
) -> None:
    """Write the names of an array's dimensions, its unit if it has one, and its meaning."""
    dataset.attrs["long_name"] = meaning
    if unit:
        dataset.attrs["units"] = unit
    if dataset.name == f"/{dimensions[0]}":
        dataset.make_scale(dimensions[0])
        return
    for axis, dimension in enumerate(dimensions):
        dataset.dims[axis].attach_scale(dataset.file[dimension])


def write_frames(
    file: h5py.File, images: NDArray[Any], places: Mapping[str, tuple[ArrayLike, str]]
) -> None:
    """Write grey levels with the numbers of their frames and channels and the places of pixels.

    Parameters
    ----------
    file : h5py.File
        To write to.
    images : ndarray, shape (k, ...) or (k, channels, ...)
        Grey levels.
    places : mapping
        For each dimension of a picture, in their order, places [m] and what they are.
    """
    write(file, "frame", np.arange(len(images)), ("frame",), None, "number of the frame")
    for name, (values, meaning) in places.items():
        write(file, name, np.asarray(values, dtype=float), (name,), "m", meaning)
    axes = ("frame", *places)
    if images.ndim > len(axes):
        channels = np.arange(1, images.shape[1] + 1)
        write(file, "channel", channels, ("channel",), None, "number of the channel")
        axes = ("frame", "channel", *places)
    write(file, "grey", images, axes, None, "grey levels")


def write_forces(file: h5py.File, forces: ArrayLike, components: tuple[str, ...]) -> None:
    """Write the forces behind frames that were written, and the names of their dimensions.

    Parameters
    ----------
    file : h5py.File
        To write to.
    forces : array_like, shape (k, n, components)
        Forces [N].
    components : tuple of str
        Names of the components.
    """
    loads = np.asarray(forces, dtype=float)
    tactels = np.arange(1, loads.shape[1] + 1)
    write(file, "component", components, ("component",), None, "direction of the force")
    write(file, "tactel", tactels, ("tactel",), None, "number of the tactel")
    write(file, "forces", loads, ("frame", *FORCE_AXES), "N", "applied forces")


def dataset(file: h5py.File, name: str) -> h5py.Dataset:
    """The dataset of a name."""
    found = file[name]
    assert isinstance(found, h5py.Dataset)
    return found


def read(file: h5py.File, name: str) -> NDArray[Any]:
    """Read an array."""
    return dataset(file, name)[()]


def read_by_tactel(file: h5py.File, name: str) -> NDArray[Any]:
    """Read an array of a strip, shape (..., n, 2); version 1 wrote it as (..., 2, n)."""
    values = read(file, name)
    if int(file.attrs.get("format_version", 0)) > 1:
        return values
    return np.ascontiguousarray(np.swapaxes(values, -1, -2))


def text(file: h5py.File, name: str) -> str:
    """Read a text."""
    return str(file.attrs[name])


def format_of(path: PathLike) -> str:
    """What an HDF5 file says it is; empty if it cannot be read or says nothing."""
    if not Path(path).is_file():
        return ""
    try:
        with _opened(path) as file:
            return str(file.attrs.get("format", ""))
    except UNREADABLE:
        return ""


def load_array(path: PathLike) -> NDArray[Any]:
    """Grey levels of a .npy file or of a PNG or TIFF picture, as stored."""
    ending = Path(path).suffix.lower()
    if not Path(path).exists():
        raise FileFormatError(f"There is no file {path}; give the path of frames or pictures.")
    loaders = {".npy": _load_npy, ".png": _load_png, ".tif": _load_tiff, ".tiff": _load_tiff}
    if ending not in loaders:
        given = "a folder" if Path(path).is_dir() else repr(ending)
        raise FileFormatError(
            f"{path}: frames are read from .h5, .npy, .png and .tiff files, not from {given}. Of "
            "photographs and videos, find the sensor with  fringeforce extract --region FILE  and "
            "give the same --region FILE to read them."
        )
    if not Path(path).is_file():
        raise FileFormatError(f"{path} is no regular file; give the path of a file of frames.")
    try:
        return loaders[ending](path)
    except Exception as error:  # decoders raise errors of any kind on damaged files
        raise FileFormatError(f"{path} cannot be read as {ending}: {error}.") from None


def _load_npy(path: PathLike) -> NDArray[Any]:
    return np.load(path, allow_pickle=False)


def _load_png(path: PathLike) -> NDArray[Any]:
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image)


def _load_tiff(path: PathLike) -> NDArray[Any]:
    import tifffile

    try:
        return tifffile.imread(path)
    except (ValueError, NotImplementedError) as error:
        if "imagecodecs" not in str(error):
            raise
    from PIL import Image, ImageSequence

    with Image.open(path) as image:  # Pillow decodes LZW and others that tifffile does not
        pages = [np.array(page) for page in ImageSequence.Iterator(image)]
    return np.array(pages) if len(pages) > 1 else pages[0]
