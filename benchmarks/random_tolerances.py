"""Readings of sensors built from random designs with random tolerances.

    python benchmarks/random_tolerances.py [frames] [seed]

Strips are those of `random_designs.py`.  One to five values of each, chosen at random, have a
tolerance as wide as a workshop might state; of each design one sensor is built, which is not as
drawn, and exposed, with contacts by the surface's elements and not by the reader's moments.  Loads
are those of `random_designs.py`, less where the blur would wash fringes out.

OK, AMBIGUOUS, refused: shares of the verdicts, of which OK holds those without contact.  inside:
forces of OK readings within their 95 % intervals.  far: OK readings with a force more than six
deviations off.  distance: median over OK readings of Mahalanobis' squared distance over its
dimension.  ms: of a cold read, median and nine of ten.  Rows are all frames, and those of designs
in which a value has a tolerance.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from random_designs import EACH, random_design, random_loads

import fringeforce as ff

Array = NDArray[np.float64]

FRAMES, SEED = 1000, 0
MOST = 5
"""Values with a tolerance."""
WASHED = 1.0
"""Phase over a deviation of the point spread up to which fringes are seen well [rad]."""
INTERVAL, FAR = 1.96, 6.0
"""Standard deviations."""


def random_tolerances(sensor: ff.Sensor, rng: np.random.Generator) -> dict[str, str | float]:
    """Tolerances of a few values of a design, by their paths."""
    strip, pitch = sensor.transducer, sensor.tactels.pitch
    pixel = strip.length / sensor.camera.pixels
    width, blur = rng.uniform(0.2, 0.7) * pitch, rng.uniform(1, 4) * pixel

    def relative(value: float, low: float, high: float, unit: str = "") -> str:
        return f"{value:.12g} {unit} +/- {rng.uniform(low, high):.3g} %"

    def about(value: float, std: float, unit: str) -> str:
        return f"{value:.12g} {unit} +/- {std:.3g} {unit}"

    clear = strip.photoelastic
    stated = {
        "tactels.placement": about(0, rng.uniform(0.03, 0.12) * pitch * 1e3, "mm"),
        "tactels.contact_width": about(width * 1e3, rng.uniform(0.1, 0.5) * width * 1e3, "mm"),
        "polariscope.visibility": about(rng.uniform(0.85, 0.97), rng.uniform(0.01, 0.03), ""),
        "polariscope.residual": about(0, rng.uniform(0.02, 0.2), "rad"),
        "camera.amplitude": relative(200, 0.5, 6),
        "camera.blur": about(blur * 1e6, rng.uniform(0.2, 0.5) * blur * 1e6, "um"),
        "camera.shift": about(0, rng.uniform(0.01, 0.1), "mm"),
        "camera.scale": relative(1, 0.1, 0.5),
        "camera.gamma": about(1, rng.uniform(0.01, 0.1), ""),
        "camera.unevenness": f"{rng.uniform(1, 5):.3g} %",
        "camera.drift": f"{rng.uniform(0.5, 3):.3g} %",
        "transducer.compliant.thickness": relative(strip.compliant.thickness * 1e3, 1, 5, "mm"),
        "transducer.compliant.youngs_modulus": relative(
            strip.compliant.youngs_modulus / 1e6, 2, 8, "MPa"
        ),
        "transducer.photoelastic.thickness": relative(clear.thickness * 1e3, 1, 4, "mm"),
        "transducer.photoelastic.strain_optic_coefficient": relative(
            clear.strain_optic_coefficient, 1, 4
        ),
        "transducer.influence_error": f"{rng.uniform(0.3, 2):.3g} %",
    }
    chosen = rng.choice(list(stated), rng.integers(1, MOST + 1), replace=False)
    return {"camera.amplitude": 200.0, **{str(path): stated[path] for path in chosen}}


@dataclass(frozen=True)
class Read:
    """One frame: what is uncertain, the verdict, and how far off it is."""

    paths: tuple[str, ...]
    status: ff.Status
    inside: float
    farthest: float
    distance: float
    seconds: float


def measure(seed: list[int]) -> list[Read]:
    """Frames of one sensor of a random design."""
    rng, found = np.random.default_rng(seed), []
    sensor = random_design(rng)
    stated = random_tolerances(sensor, rng)
    drawing = sensor.replace(**stated)
    model = ff.characterize(drawing)
    reader, built = ff.Reader(model), model.as_built(rng)
    influence = model.pixel_influence.reshape(drawing.camera.pixels, -1)
    blur = built.model.sensor.camera.blur or 0.0
    pixels = max(blur / drawing.transducer.length * drawing.camera.pixels, 1e-9)
    reader.prepare()
    for _ in range(EACH):
        forces = random_loads(influence, rng)
        steepest = np.abs(np.diff(influence @ forces.ravel())).max()
        forces = forces * min(1.0, WASHED / pixels / max(steepest, 1e-12))
        frame = built.expose(forces, rng)
        begun = perf_counter()
        reading = reader.search(frame)
        took, off = perf_counter() - begun, (reading.forces - forces).ravel()
        scaled = np.abs(off) / reading.std.ravel()
        paths = tuple(path for path, value in stated.items() if isinstance(value, str))
        square = float(off @ np.linalg.solve(reading.covariance, off)) / len(off)
        one = Read(
            paths, reading.status, (scaled < INTERVAL).mean(), scaled.max(), square, took
        )  # fmt: skip
        found.append(one)
        if one.farthest > FAR or reading.status is ff.Status.MODEL_MISMATCH:
            names = ", ".join(path.split(".", 1)[1] for path in stated)
            print(seed, reading.status.name, f"{one.farthest:.1f}", names, file=sys.stderr)
    return found


def row(name: str, reads: list[Read]) -> str:
    """Cells of the table."""
    good = [r for r in reads if r.status in (ff.Status.OK, ff.Status.NO_CONTACT)]
    unsure = sum(r.status is ff.Status.AMBIGUOUS for r in reads)
    shares = np.array([len(good), unsure, len(reads) - len(good) - unsure]) / len(reads)
    times = np.percentile([1e3 * r.seconds for r in reads], [50, 90])
    inside = np.mean([r.inside for r in good]) if good else np.nan
    distance = np.median([r.distance for r in good]) if good else np.nan
    return (
        f"{name:<50}{len(reads):>7}{shares[0]:>8.1%}{shares[1]:>11.1%}{shares[2]:>9.1%}"
        f"{inside:>8.1%}{sum(r.farthest > FAR for r in good):>5}{distance:>10.2f}"
        f"{times[0]:>7.0f}{times[1]:>7.0f}"
    )


def main() -> None:
    """Print the table."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else FRAMES
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else SEED
    reads = [one for number in range(-(-frames // EACH)) for one in measure([seed, number])]
    print(
        f"{'tolerances':<50}{'frames':>7}{'OK':>8}{'AMBIGUOUS':>11}{'refused':>9}"
        f"{'inside':>8}{'far':>5}{'distance':>10}{'ms':>7}{'ms':>7}"
    )
    print(row("all", reads))
    paths = sorted({path for one in reads for path in one.paths})
    for path in paths:
        print(row(path, [one for one in reads if path in one.paths]))


if __name__ == "__main__":
    main()
