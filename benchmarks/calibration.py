"""What a calibration is worth: the drawing, the paper's procedure, design values, and columns too.

Two benches of 64 frames each.  On both the sensor differs from its drawing in K_s (+8 %), E_1
(-20 %) and its cover's thickness (+10 %), the camera is shifted by 0.4 mm and scaled by 1 %, the
light varies by 30 % and ten pixels are dead.  On the second one every column of the matrix also has
a smooth random error of 3 % that no design value expresses.  Held-out frames: every tactel loaded
with probability 0.7, up to 2 N within 20 degrees.  Run with a number of held-out frames.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from rich.console import Console
from rich.table import Table
from single_press import single_press_matrix

import fringeforce as ff
from fringeforce.estimation.bounds import cramer_rao_bound
from fringeforce.models.imaging import Imaging
from fringeforce.reading.strip_reader import StripFrameReader
from reading import misshapen, random_loads

Array = np.ndarray
FRAMES, LARGEST, ERROR = 64, 2.0, 0.03
WEAK, STRONG = np.array([0.4, 0.2]), np.array([3.0, 1.5])
SMOOTHED = 41
"""Pixels, half a tactel's pitch, whose mean the paper's procedure may take [pixels]."""


@dataclass(frozen=True)
class Bench:
    """A sensor on a bench, dead pixels included."""

    drawing: ff.Sensor
    true: ff.SensorModel
    dead: Array
    stuck: Array

    def frames(self, forces: Array, rng: np.random.Generator) -> Array:
        """What its camera delivers."""
        frames = self.true.expose(forces, rng=rng)
        frames[..., self.dead] = self.stuck
        return frames


def bench(error: float) -> Bench:
    rng = np.random.default_rng(3)
    drawing = ff.load_sensor("saad")
    beam = drawing.transducer
    made = drawing.replace(
        **{
            "transducer.photoelastic.strain_optic_coefficient": 1.08
            * beam.photoelastic.strain_optic_coefficient,
            "transducer.compliant.youngs_modulus": 0.8 * beam.compliant.youngs_modulus,
            "transducer.compliant.thickness": 1.1 * beam.compliant.thickness,
        }
    )
    along = np.linspace(-0.5, 0.5, drawing.camera.pixels)
    imaging = Imaging.known(
        positions=0.4e-3 + 1.01 * drawing.pixel_positions,
        amplitude=150 * (1 + 0.3 * np.cos(4.5 * along + 0.6)),
        offset=8 + 3 * np.sin(3 * along),
    )
    model = ff.characterize(made)
    true = replace(misshapen(model, error, rng) if error else model, imaging=imaging)
    dead = rng.choice(drawing.camera.pixels, 10, replace=False)
    return Bench(drawing, true, dead, rng.choice([0, 90, 255], 10))


def single(n: int, sizes: Array, count: int) -> Array:
    """The first so many of all single presses in turn."""
    unit = np.eye(2 * n).reshape(2 * n, n, 2) * sizes
    return np.concatenate([unit] * (count // (2 * n) + 1))[:count]


def random_frames(rng: np.random.Generator, n: int, count: int) -> Array:
    loads = [random_loads(rng, n, LARGEST) for _ in range(4 * count)]
    return np.array([load for load in loads if load.any()][:count])


def mixed(rng: np.random.Generator, n: int) -> Array:
    """Every single press at two sizes, and loads on many tactels."""
    singles = [single(n, scale * STRONG, 2 * n) for scale in (1, 0.6)]
    return np.concatenate([*singles, random_frames(rng, n, FRAMES - 4 * n)])


def usable(bench: Bench) -> Array:
    found = np.abs(bench.true.pixel_positions) < bench.drawing.transducer.length / 2
    found[bench.dead] = False
    return found


def rows(bench: Bench, seed: int) -> dict[str, Callable[[], ff.SensorModel]]:
    """Every way to a model, each from frames of its own kind, as many for each."""
    rng, n = np.random.default_rng(seed), bench.drawing.tactels.count
    weak, strong = single(n, WEAK, FRAMES), mixed(rng, n)
    pressed, frames = bench.frames(weak, rng), bench.frames(strong, rng)
    assert bench.true.imaging is not None
    imaging = replace(bench.true.imaging, usable=usable(bench))
    quiet = replace(
        bench.true, sensor=bench.drawing.replace(**{"camera.noise": 0.01, "camera.bits": 16})
    )
    return {
        "drawing only": lambda: ff.characterize(bench.drawing),
        "the paper's procedure": lambda: single_press_matrix(bench.drawing, pressed, weak),
        "  light known": lambda: single_press_matrix(bench.drawing, pressed, weak, imaging=imaging),
        f"  light known, mean of {SMOOTHED} pixels": lambda: single_press_matrix(
            bench.drawing, pressed, weak, SMOOTHED, imaging
        ),
        "  light known, rounding alone": lambda: single_press_matrix(
            bench.drawing, quiet.expose(weak, rng=1), weak, imaging=imaging
        ),
        "design values": lambda: ff.calibrate(bench.drawing, frames, strong),
        "design values and columns": lambda: ff.calibrate(
            bench.drawing, frames, strong, columns=True
        ),
    }


def judged(model: ff.SensorModel, bench: Bench, loads: Array, frames: Array) -> list[str]:
    known, seen = StripFrameReader(bench.true), usable(bench)
    influence, response = known.influence[seen], bench.true.response.at(seen)
    readings = [ff.Reader(model).search(frame) for frame in frames]
    off = np.array([reading.forces - load for reading, load in zip(readings, loads, strict=True)])
    std = np.array([reading.std for reading in readings])
    bounds = [cramer_rao_bound(influence @ load.ravel(), influence, response) for load in loads]
    truth, found = bench.true.pixel_influence[seen], model.pixel_influence[seen]
    statuses = Counter(reading.status.name for reading in readings)
    return [
        f"{np.sqrt(((found - truth) ** 2).mean() / (truth**2).mean()):.2%}",
        f"{np.sqrt(np.mean(off**2) / np.mean(np.square(bounds))):.2f}",
        f"{np.median(np.abs(off)) / (0.6745 * np.median(bounds)):.2f}",
        f"{np.mean(np.abs(off) < 1.96 * std):.1%}",
        ", ".join(f"{name} {count}" for name, count in statuses.items()),
    ]


def noise_alone(bench: Bench) -> str:
    """What noise does to the arcsine where a weak press turns the phase by nothing, in rad/N."""
    rng, camera = np.random.default_rng(9), bench.drawing.camera
    presses = round(FRAMES / (2 * bench.drawing.tactels.count))
    noise = rng.uniform(-camera.noise, camera.noise, (presses, 100_000)).mean(axis=0)
    phase = 2 * np.arcsin(np.sqrt(np.clip(noise / 150, 0, 1)))
    strength = np.sqrt((bench.true.psi**2).mean(axis=(0, 1)))
    return (
        f"Why the paper's procedure errs: where nothing shows, noise of +-{camera.noise:g} levels "
        f"alone reads {phase.mean():.3f} rad, that is {phase.mean() / 0.4:.2f} rad/N for a normal "
        f"and {phase.mean() / 0.2:.2f} for a tangential press; columns are "
        f"{strength[0]:.2f} and {strength[1]:.2f} rad/N rms. The rows below it tell what known "
        "light, means over pixels and a camera without noise would leave."
    )


def main(count: int) -> None:
    console = Console(width=150)
    for error in (0.0, ERROR):
        place = bench(error)
        rng = np.random.default_rng(77)
        loads = random_frames(rng, place.drawing.tactels.count, count)
        frames = place.frames(loads, rng)
        label = f"matrix {error:.0%} off the design" if error else "matrix as some design"
        table = Table(title=f"{FRAMES} frames of calibration, {label}; {count} frames held out")
        table.add_column("model from")
        for column in ("psi off", "rms/bound", "median/bound", "95 % holds"):
            table.add_column(column, justify="right")
        table.add_column("verdicts")
        table.add_column("s", justify="right")
        for name, make in rows(place, 5).items():
            start = time.perf_counter()
            model = make()
            seconds = time.perf_counter() - start
            table.add_row(name, *judged(model, place, loads, frames), f"{seconds:.1f}")
        console.print(table)
    console.print(noise_alone(bench(0.0)))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
