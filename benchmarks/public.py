"""Scores on the public benchmark: our reader, a learned one, least squares from a flat start.

Frames are made with a seed that is new each time.  The learned reader is scikit-learn's multilayer
perceptron, trained on 15,000 other frames of the track of the strip as drawn; it needs
scikit-learn, and is left out without it.  Run with a number of hidden frames of each track, and one
of frames to learn from.
"""

from __future__ import annotations

import csv
import sys
import tempfile
import time
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.optimize import least_squares

import fringeforce as ff
from fringeforce.io.tables import save_contacts, save_readings
from fringeforce.scoring.making import make_benchmark
from fringeforce.scoring.scores import Score, score
from fringeforce.scoring.tracks import TRACKS, model_of

WIDE = 4
"""Pixels that the network sees as one."""
LAYERS = (512, 512, 256)
EVALUATIONS = 60


def _write(path: Path, forces: np.ndarray) -> None:
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["frame", "tactel", "normal_N", "tangential_N"])
        for frame, rows in enumerate(forces):
            writer.writerows([frame, k, *row] for k, row in enumerate(rows, 1))


def ours(folder: Path, answers: Path) -> dict[str, float]:
    """Read every track as `fringeforce read` does; times per frame [ms]."""
    taken = {}
    for name, track in TRACKS.items():
        model = ff.characterize(ff.load_sensor(folder / name / "design.toml"))
        frames = np.load(folder / name / "hidden.npy")
        times = None if track.rate is None else np.arange(len(frames)) / track.rate
        reader = ff.Reader(model)
        reader.prepare()
        start = time.perf_counter()
        readings = list(reader.stream(frames, times=times))
        taken[name] = 1e3 * (time.perf_counter() - start) / len(frames)
        save = save_readings if track.number == "tactel" else save_contacts
        save(answers / f"{name}.csv", readings)
    return taken


def learned(folder: Path, answers: Path, count: int) -> dict[str, float]:
    """Train a network on frames of the first track, and read it."""
    network = import_module("sklearn.neural_network")
    track, model = TRACKS["drawn"], model_of(TRACKS["drawn"])
    scene = track.take(model, np.random.default_rng(), count)

    def seen(frames: np.ndarray) -> np.ndarray:
        light = frames.reshape(len(frames), -1, WIDE).mean(axis=2)
        return (light - 100) / 60

    reader = network.MLPRegressor(
        hidden_layer_sizes=LAYERS,
        batch_size=256,
        max_iter=60,
        early_stopping=True,
        n_iter_no_change=8,
    )
    reader.fit(seen(scene.frames), scene.truth.reshape(count, -1))
    hidden = np.load(folder / "drawn" / "hidden.npy")
    start = time.perf_counter()
    forces = reader.predict(seen(hidden)).reshape(len(hidden), -1, 2)
    taken = 1e3 * (time.perf_counter() - start) / len(hidden)
    _write(answers / "drawn.csv", forces)
    return {"drawn": taken}


def descended(frame: np.ndarray, model: ff.SensorModel) -> np.ndarray:
    """Least squares of one frame's grey levels, from a hundredth of a newton on every tactel."""
    response, influence = model.response, model.frame_influence
    begin = np.tile([0.01, 0.0], model.sensor.tactels.count)

    def changes(forces: np.ndarray) -> np.ndarray:
        return response.slope(influence @ forces)[:, None] * influence

    slope: Any = changes  # scipy's inferred type knows of names only
    found = least_squares(
        lambda forces: response.level(influence @ forces) - frame,
        begin,
        jac=slope,
        method="lm",
        max_nfev=EVALUATIONS,
    ).x
    return np.copysign(1, found[::2].sum()) * found.reshape(-1, 2)


def plain(folder: Path, answers: Path) -> dict[str, float]:
    """Least squares of the grey levels, on all tracks of tactels."""
    taken = {}
    for name in ("drawn", "built", "soft", "held"):
        model = ff.characterize(ff.load_sensor(folder / name / "design.toml"))
        frames = np.load(folder / name / "hidden.npy").astype(float)
        start = time.perf_counter()
        forces = np.array([descended(frame, model) for frame in frames])
        taken[name] = 1e3 * (time.perf_counter() - start) / len(frames)
        _write(answers / f"{name}.csv", forces)
    return taken


def _row(reader: str, one: Score, taken: float) -> list[str]:
    shares = [one.answered, one.inside, one.wrong]
    answered, inside, wrong = ("-" if v != v else f"{100 * v:.1f} %" for v in shares)
    return [
        one.track,
        reader,
        str(one.frames),
        answered,
        f"{one.rms:.3g}",
        f"{one.worst:.3g}",
        inside,
        wrong,
        f"{taken:.1f}",
    ]


def main(count: int = 100, examples: int = 15_000) -> None:
    """Make frames, read them and print the scores."""
    table = Table(
        *("track", "reader", "frames", "answered", "rms [N]", "worst [N]"),
        *("inside 95 %", "wrong", "ms a frame"),
        title="Hidden frames of the public benchmark",
    )
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "frames"
        make_benchmark(folder, count)
        rows = []
        readers = {
            "fringeforce": ours,
            "least squares": plain,
            "network": lambda f, a: learned(f, a, examples),
        }
        for reader, read in readers.items():
            answers = Path(place) / reader.replace(" ", "-")
            answers.mkdir()
            try:
                taken = read(folder, answers)
            except ModuleNotFoundError:
                continue
            rows += [_row(reader, one, taken[one.track]) for one in score(folder, answers)]
        for row in sorted(rows, key=lambda row: list(TRACKS).index(row[0])):
            table.add_row(*row)
    Console(width=110).print(table)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
