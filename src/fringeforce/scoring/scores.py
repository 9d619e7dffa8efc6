"""Scores of readings: how far off, how honest about it, and what was refused."""

from __future__ import annotations

import csv
import io
import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import FileFormatError, InputError
from fringeforce.base.measured import INTERVAL
from fringeforce.scoring.making import TRUTH
from fringeforce.scoring.tracks import TRACKS, Track

PathLike = str | os.PathLike[str]
WRONG = 6.0
"""Standard deviations off that 2 in 1e9 values reach by chance: a reading beyond is wrong."""


@dataclass(frozen=True)
class Score:
    """How well the hidden frames of a track were read.

    Attributes
    ----------
    track : str
        Its name.
    frames : int
        Hidden frames.
    answered : float
        Share of them that have a reading that its reader stands by: status OK or NO_CONTACT, or no
        status at all.
    rms : float
        Root mean square error of all forces of these [N].
    worst : float
        Median over these frames of the largest error of a force [N].
    inside : float
        Share of values inside their 95 % intervals; not a number without deviations.
    wrong : float
        Share of these frames with a value more than six deviations off; not a number without
        deviations.
    """

    track: str
    frames: int
    answered: float
    rms: float
    worst: float
    inside: float
    wrong: float


def score(folder: PathLike, answers: PathLike) -> tuple[Score, ...]:
    """Compare readings of hidden frames with their truth.

    Parameters
    ----------
    folder : path
        What `make_benchmark` made, with its folder `truth`.
    answers : path
        Folder with a CSV for each track that was read, `drawn.csv` and so on, with columns as
        those of the public truth, and if there are any `normal_std_N`, `tangential_std_N` (of a
        skin `x_std_mm`), and `status`.  `fringeforce read` writes such files.

    Returns
    -------
    tuple of Score
        Of the tracks that have answers.

    Raises
    ------
    InputError
        If there are no answers.
    FileFormatError
        If an answer cannot be read; the message names file and line.

    Examples
    --------
    >>> from pathlib import Path
    >>> from fringeforce.scoring.making import make_benchmark
    >>> from fringeforce.scoring.scores import score
    >>> _ = make_benchmark("to-score", count=2, seed=1, tracks=("drawn",))
    >>> perfect = Path("answers")
    >>> perfect.mkdir()
    >>> _ = (perfect / "drawn.csv").write_text(Path("to-score/truth/drawn.csv").read_text())
    >>> found, = score("to-score", perfect)
    >>> found.answered, found.rms
    (1.0, 0.0)
    """
    place, given = Path(folder), Path(answers)
    if not (place / TRUTH).is_dir():
        raise InputError(f"{place} has no folder {TRUTH}; only who made the frames can score.")
    known = [name for name in TRACKS if (place / TRUTH / f"{name}.csv").exists()]
    read = [name for name in known if (given / f"{name}.csv").exists()]
    if not read:
        raise InputError(
            f"{given} holds no answers; name them after the tracks: "
            f"{', '.join(f'{name}.csv' for name in known)}."
        )
    return tuple(_score(name, place / TRUTH, given) for name in read)


def _score(name: str, truth: Path, answers: Path) -> Score:
    track, answer = TRACKS[name], answers / f"{name}.csv"
    true, _, _ = _values(truth / answer.name, track)
    frames, numbers, _ = true.shape
    found, std, stands = _values(answer, track, (frames, numbers))
    forces = [i for i, column in enumerate(track.columns) if column.endswith("_N")]
    error = (found - true)[stands]
    missing = ~np.isfinite(error)  # not a number where no row says
    if missing.any():
        frame = int(np.flatnonzero(stands)[np.argwhere(missing)[0][0]])
        raise FileFormatError(
            f"{answer} stands by frame {frame} and lacks a number of it; give every "
            f"{track.number}, or a status other than OK."
        )
    spread = std[stands]
    stated = np.isfinite(spread).all() and len(error) > 0
    size = np.abs(error) / spread if stated else np.full(error.shape, np.nan)
    return Score(
        name,
        frames,
        float(stands.mean()),
        float(np.sqrt(np.square(error[..., forces]).mean())) if len(error) else math.nan,
        float(np.median(np.abs(error[..., forces]).max(axis=(1, 2)))) if len(error) else math.nan,
        float((size <= INTERVAL).mean()) if stated else math.nan,
        float((size > WRONG).any(axis=(1, 2)).mean()) if stated else math.nan,
    )


def _values(
    path: Path, track: Track, shape: tuple[int, int] | None = None
) -> tuple[Array, Array, Mask]:
    """Values and deviations, (F, n, c), and which frames are stood by."""
    first = 1 if track.number == "tactel" else 0
    rows: list[tuple[int, int, list[float], list[float], bool]] = []
    deviations = ["{}_std_{}".format(*name.split("_")) for name in track.columns]
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise FileFormatError(f"{path} cannot be read as CSV: {error}.") from None
    with io.StringIO(text, newline="") as file:
        table = csv.DictReader(file)
        needed = ("frame", track.number, *track.columns)
        if lacking := [name for name in needed if name not in (table.fieldnames or ())]:
            raise FileFormatError(f"{path} has no column {lacking[0]!r}; give {', '.join(needed)}.")
        for line, row in enumerate(table, 2):
            try:
                frame, number = int(row["frame"]), int(row[track.number]) - first
                value = [float(row[name]) for name in track.columns]
                spread = [float(row.get(name) or math.nan) for name in deviations]
            except (TypeError, ValueError) as error:
                raise FileFormatError(f"{path}, line {line}: {error}.") from None
            if any(std < 0 for std in spread):
                raise FileFormatError(f"{path}, line {line}: a standard deviation is negative.")
            if number and first == 0:
                continue  # single contacts
            rows.append((frame, number, value, spread, _stands(row.get("status"))))
    frames, numbers = shape or (
        max((row[0] for row in rows), default=-1) + 1,
        max((row[1] for row in rows), default=-1) + 1,
    )
    found = np.full((2, frames, numbers, len(track.columns)), np.nan)
    stands = np.zeros(frames, dtype=bool)
    for frame, number, value, spread, good in rows:
        if not (0 <= frame < frames and 0 <= number < numbers):
            raise FileFormatError(
                f"{path} names frame {frame}, {track.number} {number + first}; there are frames 0 "
                f"to {frames - 1} with {numbers} of these."
            )
        found[0, frame, number], found[1, frame, number] = value, spread
        stands[frame] = good
    return found[0], found[1], stands


def _stands(status: str | None) -> bool:
    return status in (None, "", "OK", "NO_CONTACT")
