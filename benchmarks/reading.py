"""Reading forces from single noisy frames: success, efficiency, coverage, false OKs, time.

Loads: every tactel loaded with probability 0.7, magnitude uniform in [0, Nmax], angle uniform in
+-20 degrees.  Recovered means that every force (of the reading, or of an alternative that an
AMBIGUOUS reading holds) lies within 6 standard deviations of the truth; false OK means status OK
with some force off by more than 8.  Run with a number of frames per row; 1000 take from minutes to
an hour.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
from rich.console import Console
from rich.table import Table

import fringeforce as ff
from fringeforce.estimation.bounds import cramer_rao_bound
from fringeforce.reading.strip_reader import StripFrameReader

Array = np.ndarray
Loads = Callable[[np.random.Generator, int, float], Array]


def random_loads(rng: np.random.Generator, n: int, largest: float) -> Array:
    magnitude = rng.uniform(0, largest, n) * (rng.random(n) < 0.7)
    return ff.polar(magnitude, rng.uniform(-20, 20, n))


def single(rng: np.random.Generator, n: int, largest: float) -> Array:
    forces = np.zeros((n, 2))
    forces[[rng.integers(n)]] = ff.polar(rng.uniform(0.05, largest), rng.uniform(-20, 20), n=1)
    return forces


def uniform(rng: np.random.Generator, n: int, largest: float) -> Array:
    return ff.polar(rng.uniform(0.05, largest), 0.0, n=n)


def shear(rng: np.random.Generator, n: int, largest: float) -> Array:
    return np.tile([0.0, rng.uniform(0.05, largest)], (n, 1))


def nothing(rng: np.random.Generator, n: int, largest: float) -> Array:
    return np.zeros((n, 2))


def ends(rng: np.random.Generator, n: int, largest: float) -> Array:
    forces = np.zeros((n, 2))
    forces[[0, -1]] = ff.polar(rng.uniform(0.05, largest, 2), rng.uniform(-20, 20, 2))
    return forces


@dataclass(frozen=True)
class Trial:
    """One row of the table."""

    label: str
    design: str = "saad"
    changes: dict[str, object] = field(default_factory=dict)
    largest: float = 4.0
    loads: Loads = random_loads
    noise: float = 1.0
    model_discrepancy: float = 0.0
    dead: int = 0
    offset: float = 0.0


CASES: dict[str, dict[str, object]] = {"free": {}, "roller": {"transducer.edges": "roller"}}


def trials() -> Iterator[Trial]:
    for edges, changes in CASES.items():
        for largest in (1, 2, 4, 8, 12, 16):
            yield Trial(f"{edges}, up to {largest} N", changes=changes, largest=largest)
        for largest in (1, 2, 4, 8):
            yield Trial(
                f"{edges}, up to {largest} N, noise x3", changes=changes, largest=largest, noise=3.0
            )
        for loads in (single, uniform, shear, nothing, ends):
            yield Trial(f"{edges}, {loads.__name__}", changes=changes, loads=loads)
    for count in (5, 16, 24, 32):
        pitch = 12.5e-3 / count if count > 16 else 1e-3
        yield Trial(f"{count} tactels", changes={"tactels.count": count, "tactels.pitch": pitch})
    for design in ("soft-sixteen", "fine-thirty-two", "thick-cover", "wide-pad"):
        yield Trial(design, design=design, largest=2.0)
    for largest in (1, 4, 12):
        yield Trial(f"psi 3 % wrong, up to {largest} N", largest=largest, model_discrepancy=0.03)
        yield Trial(f"20 dead pixels, up to {largest} N", largest=largest, dead=20)
        yield Trial(f"offset +10, up to {largest} N", largest=largest, offset=10)
        yield Trial(f"offset -10, up to {largest} N", largest=largest, offset=-10)


@dataclass
class Tally:
    """What the frames of one trial gave."""

    frames: int = 0
    recovered: int = 0
    false_ok: int = 0
    inside: int = 0
    forces: int = 0
    squared_error: float = 0.0
    bound: float = 0.0
    statuses: Counter[str] = field(default_factory=Counter)
    seconds: list[float] = field(default_factory=list)


def sensor_of(trial: Trial) -> ff.Sensor:
    sensor = ff.load_sensor(trial.design).replace(**trial.changes)
    if trial.noise == 1:
        return sensor
    camera = sensor.camera
    noise = camera.noise * trial.noise
    loud = camera.model_copy(
        update={"noise": noise, "offset": noise, "amplitude": camera.full_scale - 2 * noise}
    )
    return sensor.replace(camera=loud)


def misshapen(model: ff.SensorModel, error: float, rng: np.random.Generator) -> ff.SensorModel:
    """The model with every column's shape off by a smooth random factor of the given size.

    The factor has waves of 3 to 12 pitches and leaves the column's size as it is, because a
    column's scale is the force's, which no frame can reveal.
    """
    x = model.x / model.sensor.tactels.pitch
    turns = 2 * np.pi / np.array([12.0, 6.0, 3.0])[:, None] * x
    waves = rng.normal(size=(2, 3, *model.psi.shape[1:]))
    factor = np.einsum("kx,knc->xnc", np.cos(turns), waves[0])
    factor += np.einsum("kx,knc->xnc", np.sin(turns), waves[1])
    weight = np.gradient(model.x)[:, None, None] * model.psi**2
    factor -= (factor * weight).sum(axis=0) / weight.sum(axis=0)
    size = np.sqrt((factor**2 * weight).sum(axis=0) / weight.sum(axis=0))
    return replace(model, psi=model.psi * (1 + error * factor / size))


def spoilt(trial: Trial, frame: Array, full: int, rng: np.random.Generator) -> Array:
    frame = np.clip(frame.astype(float) + trial.offset, 0, full)
    if trial.dead:
        where = rng.choice(len(frame), trial.dead, replace=False)
        frame[where] = rng.choice([0, full], trial.dead)
    return frame


def run(trial: Trial, frames: int, seed: int) -> Tally:
    rng = np.random.default_rng(seed)
    model = ff.characterize(sensor_of(trial))
    reader = StripFrameReader(model)
    sensor = model.sensor
    reader.read(model.expose(ff.polar(1.0, 10, n=sensor.tactels.count), rng=0))
    tally = Tally()
    for _ in range(frames):
        true = misshapen(model, trial.model_discrepancy, rng) if trial.model_discrepancy else model
        forces = trial.loads(rng, sensor.tactels.count, trial.largest)
        frame = spoilt(trial, true.expose(forces, rng=rng), sensor.camera.full_scale, rng)
        start = time.perf_counter()
        reading = reader.read(frame)
        tally.seconds.append(time.perf_counter() - start)
        judge(tally, reading, forces, reader)
    return tally


def judge(tally: Tally, reading: ff.Reading, forces: Array, reader: StripFrameReader) -> None:
    tally.frames += 1
    tally.statuses[reading.status.name] += 1
    explanations = np.concatenate([reading.forces[None], reading.alternatives])
    off = np.abs(explanations - forces) / reading.std
    tally.recovered += bool(off.max(axis=(1, 2)).min() < 6)
    if reading.status is not ff.Status.OK:
        return
    tally.false_ok += bool(off[0].max() > 8)
    tally.inside += int((off[0] < 1.96).sum())
    tally.forces += off[0].size
    bound = cramer_rao_bound(
        reader.influence @ forces.ravel(), reader.influence, reader.model.response
    )
    known = np.isfinite(bound)
    tally.squared_error += float(((reading.forces - forces).ravel()[known] ** 2).sum())
    tally.bound += float((bound[known] ** 2).sum())


def row(trial: Trial, tally: Tally) -> list[str]:
    times = 1e3 * np.array(tally.seconds)
    efficiency = np.sqrt(tally.squared_error / tally.bound) if tally.bound else np.nan
    others = ", ".join(f"{k} {v}" for k, v in tally.statuses.items() if k != "OK")
    return [
        trial.label,
        f"{tally.recovered / tally.frames:.2%}",
        f"{efficiency:.3f}",
        f"{tally.inside / max(tally.forces, 1):.1%}",
        f"{tally.false_ok}",
        f"{np.median(times):.1f}",
        f"{np.percentile(times, 99):.1f}",
        others,
    ]


def main(frames: int) -> None:
    table = Table(title=f"{frames} frames a row, one thread")
    for column in ("loads", "recovered", "rms / bound", "95 % holds", "false OK", "ms", "99 %"):
        table.add_column(column, justify="left" if column == "loads" else "right")
    table.add_column("verdicts other than OK")
    todo = list(trials())
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # for the processes to come
    with ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")) as pool:
        results = pool.map(run, todo, [frames] * len(todo), range(len(todo)))
        for trial, tally in zip(todo, results, strict=True):
            cells = row(trial, tally)
            table.add_row(*cells)
            print(" | ".join(cells), file=sys.stderr, flush=True)
    Console(width=140).print(table)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
