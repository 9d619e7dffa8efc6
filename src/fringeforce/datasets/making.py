"""A data set in a folder: made on any executor, and resumed where it was stopped."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

from fringeforce.base.errors import FileFormatError, InputError
from fringeforce.base.progress import Progress
from fringeforce.base.storage import existing_file, read, writing
from fringeforce.datasets.shard import IMAGES, STUDY, SUMS, Files, Shard, digest, packed
from fringeforce.datasets.study_file import NAMES, DatasetStudy, load_dataset_study
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.io.frames import DATASET
from fringeforce.studies.execution import completed, executor
from fringeforce.studies.study_file import same_study

DESCRIPTION, UNFINISHED = "dataset.json", ".part-"


@dataclass(frozen=True)
class Dataset:
    """What is in a folder.

    Attributes
    ----------
    folder : Path
        Path of the data set.
    shards : tuple of Path
        Files or folders, in the order of their images.
    parts : dict of str to int
        Number of images to train, to validate and to test.
    made : int
        Images that were made now; others were there.
    size : int
        Size of all files [bytes].
    """

    folder: Path
    shards: tuple[Path, ...]
    parts: dict[str, int]
    made: int
    size: int


def make_dataset(
    study: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Dataset:
    """Make simulated images of a pad or skin with what made them, or what is missing of them.

    Parameters
    ----------
    study : path
        Path of the study file.
    folder : path
        Path of the data set; made, or resumed if it exists.
    scheduler : str, optional
        Address of a Dask scheduler; processes of this machine if not given.
    workers : int, optional
        Number of processes; one for each core if not given, and 0 for this process alone.
    progress : callable, optional
        Called with words, images there are and their number.

    Raises
    ------
    InputError
        If the study has problems, or the folder holds another data set.
    FileFormatError
        If the folder cannot be written.

    Examples
    --------
    >>> ff.make_dataset("touches.toml", "touches")
    Traceback (most recent call last):
    fringeforce.base.errors.InputError: There is no study 'touches.toml' to read (...); give ...
    """
    plan, sensor = load_dataset_study(study)
    with executor(scheduler, workers) as pool:
        return run_dataset(plan, sensor, Path(folder), pool, progress)


def run_dataset(
    study: DatasetStudy,
    sensor: Pad | Sensor,
    folder: Path,
    pool: Executor,
    progress: Progress | None = None,
) -> Dataset:
    """Make a data set from a study that has been read, on an executor that runs."""
    shards = shards_of(study, sensor)
    with writing(folder):
        _claim(study, sensor, folder)
    missing = [shard for shard in shards if _images_of(shard, folder / shard.name) < shard.count]
    made, known = 0, study.number - sum(shard.count for shard in missing)
    if progress:
        progress("images", known, study.number)
    for number, files in completed(pool, packed, enumerate(zip(missing, strict=True))):
        with writing(folder):
            _keep(folder, missing[number].name, files)
        made += missing[number].count
        if progress:
            progress("images", known + made, study.number)
    parts = [study.split.part(number) for number in range(study.number)]
    counts = {name: parts.count(part) for part, name in enumerate(NAMES)}
    paths = tuple(folder / shard.name for shard in shards)
    size = sum(file.stat().st_size for path in paths for file in _files(path))
    return Dataset(folder, paths, counts, made, size)


def shards_of(study: DatasetStudy, sensor: Pad | Sensor) -> list[Shard]:
    """All shards of a study, in the order of their images."""
    starts = range(0, study.number, study.shard)
    return [Shard(study, sensor, first, min(study.shard, study.number - first)) for first in starts]


def _claim(study: DatasetStudy, sensor: Pad | Sensor, folder: Path) -> None:
    """Make the folder, or make sure that it holds this data set."""
    canonical, path = study.canonical(sensor), folder / DESCRIPTION
    folder.mkdir(parents=True, exist_ok=True)
    if path.exists():
        if not same_study(path.read_text(encoding="utf-8"), canonical):
            raise InputError(
                f"{folder} holds the data set of another study, or of this one before a change of "
                "more than its number of images; write to another folder, or remove that one."
            )
    elif any(folder.glob("shard-*")):
        raise InputError(f"{folder} holds shards without {DESCRIPTION}; write to another folder.")
    else:
        _keep(folder, DESCRIPTION, {DESCRIPTION: canonical.encode()})


def _images_of(shard: Shard, path: Path) -> int:
    """How many images of a shard are there; raises if they are damaged or of another data set."""
    if not path.exists():
        return 0
    stated, numbers = _in_folder(path) if path.is_dir() else _in_file(path)
    same = not stated or same_study(stated, shard.canonical)  # earlier versions stated nothing
    if not same or numbers != list(shard.numbers)[: len(numbers)]:
        raise InputError(
            f"{path} holds other images than {shard.first} to {shard.first + shard.count - 1} of "
            "this study; remove it, and it is made again."
        )
    return len(numbers)


def _in_file(path: Path) -> tuple[str, list[int]]:
    """Study and numbers of images of a shard in a file."""
    with existing_file(path, DATASET) as file:
        return str(file.attrs.get("study", "")), read(file, "number").tolist()


def _in_folder(path: Path) -> tuple[str, list[int]]:
    """Study and numbers of images of a shard in a folder."""
    try:
        files = {file.name: file.read_bytes() for file in path.iterdir()}
        sums = files.pop(SUMS, b"").decode()
        stated = files.get(STUDY, b"").decode()
        sound = {name: digest(content) for name, content in files.items()}
        listed = dict(line.split("  ", 1)[::-1] for line in sums.splitlines())
        if (sums or stated) and sound != listed:
            wrong = sorted(name for name, _ in sound.items() ^ listed.items())
            raise ValueError(f"{wrong[0]} differs from {SUMS}")
        rows = files[IMAGES].decode().splitlines()[1:]
        return stated, sorted({int(row.partition(",")[0]) for row in rows})
    except (OSError, ValueError, KeyError) as error:
        raise FileFormatError(
            f"{path} is damaged ({error}); remove it, and it is made again."
        ) from None


def _keep(folder: Path, name: str, files: Files) -> None:
    """Write a file, or a folder of files, that takes its name only once it is complete."""
    shutil.rmtree(folder / (UNFINISHED + name), ignore_errors=True)  # of a run that was killed
    unfinished = folder / (UNFINISHED + name)
    try:
        for path, content in files.items():
            place = folder / (UNFINISHED + path)
            place.parent.mkdir(exist_ok=True)
            with place.open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
        if (folder / name).is_dir():  # fewer images than there are to be now
            shutil.rmtree(folder / name)
        os.replace(unfinished, folder / name)
    except BaseException:  # a full disk, or Ctrl-C
        if unfinished.is_dir():
            shutil.rmtree(unfinished, ignore_errors=True)
        unfinished.unlink(missing_ok=True)
        raise


def _files(path: Path) -> Iterator[Path]:
    return path.iterdir() if path.is_dir() else iter([path])
