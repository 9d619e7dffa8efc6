"""The benchmark in a folder: frames with truth to work on, and frames whose truth is kept apart."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.base.storage import whole_file
from fringeforce.scoring.tracks import TRACKS, Track, model_of

PathLike = str | os.PathLike[str]
TRUTH = "truth"
PUBLIC, HIDDEN = "public", "hidden"
COUNT = 100
MOST = 100_000
"""Frames of a track that are made at once."""


def make_benchmark(
    folder: PathLike,
    count: int = COUNT,
    seed: int | None = None,
    tracks: tuple[str, ...] = (),
    progress: Progress | None = None,
) -> tuple[str, ...]:
    """Make frames of every track: as many with their truth as without.

    Parameters
    ----------
    folder : path
        Path of a new folder.  Each track has a folder in it with `design.toml`, `public.npy` and
        `public.csv`, and `hidden.npy`; the truth of these is in the folder `truth`.
    count : int
        Public frames of each track, and hidden ones.
    seed : int, optional
        Of all frames; if not given, nobody can make the hidden ones again.
    tracks : tuple of str
        Which tracks; all if none is named.
    progress : callable, optional
        Told words, the tracks done and their number.

    Returns
    -------
    tuple of str
        Names of the tracks.

    Raises
    ------
    InputError
        If the folder exists, a track is unknown, or the count is none.

    Examples
    --------
    >>> from fringeforce.scoring.making import make_benchmark
    >>> make_benchmark("frames-to-read", count=2, seed=1, tracks=("drawn",))
    ('drawn',)
    """
    target, report = Path(folder), progress or (lambda title, done, total: None)
    names = tracks or tuple(TRACKS)
    if unknown := [name for name in names if name not in TRACKS]:
        raise InputError(f"There is no track {unknown[0]!r}; choose from {', '.join(TRACKS)}.")
    if len(set(names)) < len(names):
        raise InputError(f"Tracks {', '.join(names)} name one twice; name each once.")
    if seed is not None and seed < 0:
        raise InputError(f"seed = {seed}: must be a whole number, 0 or more.")
    if not 1 <= count <= MOST:
        raise InputError(f"count = {count} frames: give 1 to {MOST:,}.")
    if target.exists():
        raise InputError(f"{target} exists; name a new folder for the benchmark.")
    with whole_file(target) as whole:
        (whole / TRUTH).mkdir(parents=True)
        for done, name in enumerate(names):
            report(f"Frames of {name}", done, len(names))
            track, place = TRACKS[name], whole / name
            place.mkdir()
            model = model_of(track)
            (place / "design.toml").write_text(model.sensor.to_toml(), encoding="utf-8")
            for part, number in ((PUBLIC, 0), (HIDDEN, 1)):
                key = None if seed is None else [seed, number, list(TRACKS).index(name)]
                scene = track.take(model, np.random.default_rng(key), count)
                np.save(place / f"{part}.npy", scene.frames)
                truth = place / f"{part}.csv" if part == PUBLIC else whole / TRUTH / f"{name}.csv"
                _write_truth(truth, track, scene.truth)
    report("Done", len(names), len(names))
    return names


def _write_truth(path: Path, track: Track, truth: Array) -> None:
    """Values of every tactel of every frame, or of all contacts together, number 0."""
    first = 1 if track.number == "tactel" else 0
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["frame", track.number, *track.columns])
        for frame, rows in enumerate(truth):
            for number, values in enumerate(rows, first):
                writer.writerow([frame, number, *(f"{value:.6g}" for value in values)])
