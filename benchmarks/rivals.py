"""Reading forces compared with simpler methods: success, efficiency, time, on the same frames.

The paper's design with free edges, loads as in reading.py.  Every way gives one answer for a frame,
and one answer only counts: recovered means that every force lies within 6 of the Cramer-Rao bound's
standard deviations of the truth, the common sign included, which all rivals choose so that the
normal forces sum to a push.  Least squares take the noise-free response, its analytic derivative
and MINPACK; the random starts are drawn as the loads are, largest load and all, which no user
would know.  The paper does not say how its own noisy recovery works, so its noise-free one
(equations 12 and 14) gets a smoothed frame, with each of several smoothing windows, of which the
one whose forces explain the frame best wins; noise leaves it far more critical points to weigh than
it is made for, which its time shows.  The last rival hands its forces to least squares of the
intensities.

The ratio to the bound is of root mean squares over all forces of a method's own recovered frames,
where one frame that hardly shows some force, and so has a wide bound, can outweigh all others.
The worst error is the median over all frames of the largest error of any force in a frame.  Times
are of one thread, in the order of the table for each frame; ratios are within this one run.  Run
with a number of frames per range of loads.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.estimation.bounds import cramer_rao_bound
from fringeforce.estimation.estimate import least_squares as least_squares_of_phase
from fringeforce.estimation.phase.noise_free import recover_phase
from fringeforce.reading.strip_reader import StripFrameReader
from reading import random_loads

Array = np.ndarray

LARGEST = (0.5, 1.0, 4.0, 12.0)
FLAT = 0.01
"""Normal force of every tactel at the flat start; at none at all the intensity has no slope [N]."""
STARTS = 20
EVALUATIONS = 100
"""Of the intensities in one descent; those seen to end at the truth took 25 at most."""
WINDOWS = (21, 61, 181)
"""Of the smoothing [pixels]."""


@dataclass(frozen=True, eq=False)
class Scene:
    """One frame, and what every method may know."""

    reader: StripFrameReader
    frame: Array
    largest: float
    rng: np.random.Generator

    def residuals(self, loads: Array) -> Array:
        """What loads leave of the frame, in units of the noise."""
        response = self.reader.model.response
        level = response.level(self.reader.influence @ loads)
        return (level - self.frame) / np.sqrt(response.variance)

    def slope(self, loads: Array) -> Array:
        """Derivative of the residuals by the loads."""
        response = self.reader.model.response
        slope = response.slope(self.reader.influence @ loads) / np.sqrt(response.variance)
        return self.reader.influence * slope[:, None]

    def cost(self, loads: Array) -> float:
        """Sum of the squared residuals."""
        return float(np.sum(self.residuals(loads) ** 2))

    def descended(self, start: Array) -> Array:
        """Least squares of the intensities from a start."""
        slope: Any = self.slope  # scipy's inferred type knows of names only
        found = least_squares(self.residuals, start, jac=slope, method="lm", max_nfev=EVALUATIONS)
        return found.x

    def best(self, answers: list[Array]) -> Array:
        """Loads that explain the frame best; not a number where there are none."""
        unknown = np.full(self.reader.influence.shape[1], np.nan)
        return min(answers, key=self.cost, default=unknown)


def ours(scene: Scene) -> Array:
    return scene.reader.read(scene.frame).forces.ravel()


def flat_start(scene: Scene) -> Array:
    n = scene.reader.influence.shape[1] // 2
    return pushing(scene.descended(np.tile([FLAT, 0.0], n)))


def random_starts(scene: Scene) -> Array:
    n = scene.reader.influence.shape[1] // 2
    starts = [random_loads(scene.rng, n, scene.largest).ravel() for _ in range(STARTS)]
    return pushing(scene.best([scene.descended(start) for start in starts]))


def fringe_by_fringe(scene: Scene) -> Array:
    response = scene.reader.model.response
    answers = []
    for window in WINDOWS:
        smooth: Any = savgol_filter(scene.frame, window, polyorder=3)
        intensity = np.clip((smooth - response.offset) / response.amplitude, 0, 1)
        try:
            phase = recover_phase(intensity)
        except InputError:
            continue
        answers.append(least_squares_of_phase(phase, scene.reader.influence))
    return pushing(scene.best(answers))


def fringe_by_fringe_descended(scene: Scene) -> Array:
    start = fringe_by_fringe(scene)
    return pushing(scene.descended(start)) if np.isfinite(start).all() else start


def pushing(loads: Array) -> Array:
    """The loads or their negative, which has the same intensity: whichever pushes."""
    return -loads if loads[::2].sum() < 0 else loads


METHODS: dict[str, Callable[[Scene], Array]] = {
    "Reader": ours,
    "least squares, flat start": flat_start,
    f"least squares, best of {STARTS} random starts": random_starts,
    "smoothing, (12), (14)": fringe_by_fringe,
    "smoothing, (12), (14), least squares": fringe_by_fringe_descended,
}


@dataclass
class Tally:
    """What one method made of the frames of one range of loads."""

    frames: int = 0
    recovered: int = 0
    squared_error: float = 0.0
    bound: float = 0.0
    worst: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    def judge(self, answer: Array, truth: Array, bound: Array) -> None:
        """Count one answer."""
        error = np.abs(answer - truth)
        self.frames += 1
        self.worst.append(float(error.max()) if np.isfinite(error).all() else np.inf)
        if not (error < 6 * bound).all():
            return
        self.recovered += 1
        known = np.isfinite(bound)
        self.squared_error += float((error[known] ** 2).sum())
        self.bound += float((bound[known] ** 2).sum())


def run(largest: float, frames: int, seed: int) -> dict[str, Tally]:
    rng, own = np.random.default_rng(seed), np.random.default_rng([seed, 1])
    model = ff.characterize(ff.load_sensor("saad"))
    reader = StripFrameReader(model)
    n = model.sensor.tactels.count
    warm_up = model.expose(ff.polar(min(largest, 1.0), 10, n=n), rng=0).astype(float)
    for method in METHODS.values():
        method(Scene(reader, warm_up, largest, np.random.default_rng(0)))
    tallies = {name: Tally() for name in METHODS}
    for _ in range(frames):
        forces = random_loads(rng, n, largest)
        truth = forces.ravel()
        scene = Scene(reader, model.expose(forces, rng=rng).astype(float), largest, own)
        bound = cramer_rao_bound(reader.influence @ truth, reader.influence, reader.model.response)
        for name, method in METHODS.items():
            start = time.perf_counter()
            answer = method(scene)
            tallies[name].seconds.append(time.perf_counter() - start)
            tallies[name].judge(answer, truth, bound)
    return tallies


def row(name: str, tally: Tally, reference: Tally) -> list[str]:
    efficiency = np.sqrt(tally.squared_error / tally.bound) if tally.bound else np.nan
    median = np.median(tally.seconds)
    return [
        name,
        f"{tally.recovered / tally.frames:.0%}",
        f"{efficiency:.3f}" if tally.recovered else "-",
        f"{np.median(tally.worst):.2g}",
        f"{1e3 * median:.1f}",
        f"{median / np.median(reference.seconds):.3g}",
    ]


def main(frames: int) -> None:
    table = Table(title=f"{frames} frames a range, one thread")
    for column in ("method", "recovered", "rms / bound", "worst error, N", "ms", "time / ours"):
        table.add_column(column, justify="left" if column == "method" else "right")
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # for the processes to come
    with ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")) as pool:
        results = pool.map(run, LARGEST, [frames] * len(LARGEST), range(len(LARGEST)))
        for largest, tallies in zip(LARGEST, results, strict=True):
            table.add_section()
            table.add_row(f"[bold]up to {largest:g} N[/bold]")
            for name, tally in tallies.items():
                table.add_row(*row(name, tally, tallies["Reader"]))
    Console(width=120).print(table)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 30)
