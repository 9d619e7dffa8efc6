"""How often readings that state a probability are right: the reliability of `Reading.probability`.

    python benchmarks/reliability.py [frames] [seed]

Frames come from the exact Fourier series of the paper's strip with roller edges and not from the
reader's matrix.  A fifth each has

- strong: up to 1 to 8 N on all or on some of the tactels,
- faint: touches whose phase stays below 0.2 to 2 rad,
- few pixels: strong loads on a camera of 512 pixels with a uniform noise of 10 grey levels,
- all tolerances: up to 2 N on every tactel, contacts of 0.4 +- 0.2 mm at 0.1 mm rms beside the
  tactels, light 3 % off, visibility 0.97 +- 0.02, a smooth residual of 0.05 rad rms, a blur of
  4 +- 2 pixels: all new in every frame, and stated in the drawing,
- some of all: the same on some of the tactels, down to 0.2 N.

A reading is right if its error lies within what its covariance allows by chance once in ten
thousand: an explanation of the frame that is not the true one is off by far more.  stated, right:
mean of the probabilities that readings state, and share of them that are right.  near: the
other way round, how often as many or fewer were right if every reading were right with the
probability that it states (Poisson's binomial, in its normal approximation).

The second table has the kinds of frames: shares that are OK and AMBIGUOUS, the rest being refused;
of the OK ones how many are wrong; how many forces lie inside their 95 % intervals; mean squared
Mahalanobis distance over its dimension; and root mean square errors [N].  The last two columns are
root mean square errors of what the same estimator reaches in the same frames from the truth.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from departures import smooth
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.special import chdtrc, ndtr

import fringeforce as ff
from fringeforce.mechanics import fourier
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant
from fringeforce.reading.strip_reader import StripFrameReader

Array = NDArray[np.float64]

FRAMES, SEED = 20000, 0
TERMS = 400
"""Harmonics; ten digits for this cover."""
RARE = 1e-4
"""Chance below which an error is none of the right explanation."""
INTERVAL = 1.96
"""Standard deviations of a 95 % interval."""
BINS = (0.0, 0.5, 0.7, 0.9, 0.97, 0.99, 0.999, 0.9999, 1.0)
"""Stated probabilities that are counted together."""
STEEPEST = 30.0
"""Largest angle of a force [degrees]."""
PLACE, WIDTH, WIDTH_STD = 0.1e-3, 0.4e-3, 0.2e-3
LAMP, VISIBILITY, VISIBILITY_STD = 0.03, 0.97, 0.02
RESIDUAL, LENGTH = 0.05, 5e-3
BLUR, BLUR_STD = 4.0, 2.0
"""Pixels."""


class ExactStrip:
    """Light of contacts anywhere on a strip with roller edges, by the exact series.

    Parameters
    ----------
    sensor : Sensor
        The strip.
    """

    def __init__(self, sensor: ff.Sensor) -> None:
        strip, self.sensor = sensor.transducer, sensor
        self.half = strip.length / 2
        self.alpha = np.arange(1, TERMS + 1, dtype=np.float64) * np.pi / strip.length
        waves, mean = fourier.harmonic_stress(strip, self.alpha)
        constant = stress_optic_constant(strip.photoelastic, sensor.polariscope.wavelength)
        self.waves = phase_lead(waves * 2 / (strip.length * strip.width), constant)
        self.mean = float(phase_lead(np.array(mean), constant))
        self.cosines = np.cos(np.outer(self.alpha, sensor.pixel_positions + self.half))

    def phase(self, forces: Array, centres: Array, widths: Array) -> Array:
        """Phase lead at the pixels under uniform contacts, shape (n_pixels,) [rad]."""
        turn = np.outer(centres + self.half, self.alpha)
        patch = np.sinc(np.outer(widths, self.alpha) / (2 * np.pi))
        normal = forces[:, 0] @ (patch * np.cos(turn)) * self.waves[:, 0]
        tangential = forces[:, 1] @ (patch * np.sin(turn)) * self.waves[:, 1]
        return (normal + tangential) @ self.cosines + self.mean * forces[:, 0].sum()


@dataclass
class Kind:
    """What readings of one kind of frames gave."""

    verdicts: Counter[str] = field(default_factory=Counter)
    squares: list[float] = field(default_factory=list)
    inside: list[float] = field(default_factory=list)
    errors: list[Array] = field(default_factory=list)
    best: list[Array] = field(default_factory=list)
    wrong: int = 0

    def row(self) -> str:
        """Cells of the table."""
        whole = sum(self.verdicts.values())
        good = (self.verdicts["OK"] + self.verdicts["NO_CONTACT"]) / whole
        cells = [f"{whole:>6}", f"{good:>6.1%}", f"{self.verdicts['AMBIGUOUS'] / whole:>9.1%}"]
        cells += [f"{self.wrong:>5}", f"{np.mean(self.inside):>7.1%}"]
        cells += [f"{np.mean(self.squares):>8.3f}"]
        for errors in (self.errors, self.best):
            if errors:
                cells += [f"{v:>7.4f}" for v in np.sqrt(np.square(errors).mean(axis=(0, 1)))]
        return "  ".join(cells)


def drawn_forces(rng: np.random.Generator, largest: float, all_of_them: bool) -> Array:
    """Forces on all tactels or on some, shape (11, 2) [N]."""
    size = largest * rng.uniform(0, 1, 11)
    if not all_of_them:
        some = rng.permutation(11) < rng.integers(1, 11)
        size = np.where(some, np.maximum(size, 0.2), 0.0)
    return ff.polar(size, rng.uniform(-STEEPEST, STEEPEST, 11))


class Bench:
    """Frames of every kind, and their readers."""

    def __init__(self) -> None:
        self.drawing = ff.load_sensor("saad").replace(**{"transducer.edges": "roller"})
        coarse = self.drawing.replace(
            **{
                "camera.pixels": 512,
                "camera.amplitude": 230.0,
                "camera.offset": 12.0,
                "camera.noise": 10.0,
            }
        )
        uncertain = self.drawing.replace(
            **{
                "tactels.placement": f"0 +/- {PLACE * 1e3} mm",
                "tactels.contact_width": f"{WIDTH * 1e3} +/- {WIDTH_STD * 1e3} mm",
                "polariscope.visibility": f"{VISIBILITY} +/- {VISIBILITY_STD}",
                "polariscope.residual": f"0 +/- {RESIDUAL} rad",
                "polariscope.residual_length": f"{LENGTH * 1e3} mm",
                "camera.amplitude": f"{self.drawing.camera.amplitude} +/- {LAMP * 100} %",
                "camera.blur": f"{BLUR * 25e3 / 2048} um +/- {BLUR_STD * 25e3 / 2048} um",
            }
        )
        self.plain, self.rough = ExactStrip(self.drawing), ExactStrip(coarse)
        readers = [ff.Reader(ff.characterize(one)) for one in (self.drawing, coarse, uncertain)]
        strong, few, whole = readers
        self.readers = {
            "strong": strong,
            "faint": strong,
            "few pixels": few,
            "all tolerances": whole,
            "some of all": whole,
        }

    def frame(self, kind: str, rng: np.random.Generator) -> tuple[NDArray[np.uint8], Array]:
        """Grey levels of one frame and its forces."""
        if kind == "all tolerances":
            return self.uncertain(drawn_forces(rng, 2.0, True), rng)
        if kind == "some of all":
            return self.uncertain(drawn_forces(rng, rng.uniform(0.2, 2.0), False), rng)
        exact = self.rough if kind == "few pixels" else self.plain
        largest = rng.uniform(1, 4 if kind == "few pixels" else 8)
        forces = drawn_forces(rng, largest, rng.random() < 0.5)
        places = self.drawing.tactels.positions
        phase = exact.phase(forces, places, np.zeros(11))
        if kind == "faint":
            share = rng.uniform(0.2, 2.0) / np.abs(phase).max()
            phase, forces = share * phase, share * forces
        return self.exposed(exact.sensor, (1 - np.cos(phase)) / 2, rng), forces

    def uncertain(self, forces: Array, rng: np.random.Generator) -> tuple[NDArray[np.uint8], Array]:
        """A frame with everything new that the drawing leaves uncertain."""
        centres = self.drawing.tactels.positions + PLACE * rng.standard_normal(11)
        widths = np.abs(WIDTH + WIDTH_STD * rng.standard_normal(11))
        phase = self.plain.phase(forces, centres, widths)
        phase = phase + RESIDUAL * smooth(self.drawing.pixel_positions, rng, LENGTH)
        visibility = min(VISIBILITY + VISIBILITY_STD * rng.standard_normal(), 1.0)
        light = (1 - visibility * np.cos(phase)) / 2
        light = gaussian_filter1d(
            light, abs(BLUR + BLUR_STD * rng.standard_normal()), mode="reflect"
        )
        light = light * (1 + LAMP * rng.standard_normal())
        return self.exposed(self.drawing, light, rng), forces

    def exposed(
        self, sensor: ff.Sensor, light: Array, rng: np.random.Generator
    ) -> NDArray[np.uint8]:
        """Grey levels of a light between 0 and 1."""
        camera = sensor.camera
        level = camera.amplitude * light + camera.offset
        level += rng.uniform(-camera.noise, camera.noise, level.shape)
        return np.clip(np.rint(level), 0, camera.full_scale).astype(np.uint8)


def from_the_truth(reader: ff.Reader, frame: NDArray[np.uint8], forces: Array) -> Array:
    """What the estimator makes of a frame if it starts from the forces that act, shape (n, 2)."""
    single = reader._single
    assert isinstance(single, StripFrameReader)
    posterior = single.own_posterior(frame.astype(float))
    start = np.zeros(posterior.model.at.size)
    start[: forces.size] = forces.ravel()
    return posterior.settled(start).unknowns[: forces.size].reshape(forces.shape)


def near(stated: Array, right: NDArray[np.bool_]) -> float:
    """Chance of as few right readings if probabilities are as stated."""
    spread = np.sqrt((stated * (1 - stated)).sum() + 1e-12)
    return float(ndtr((right.sum() + 0.5 - stated.sum()) / spread))


def main() -> None:
    """Print both tables."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else FRAMES
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else SEED
    bench = Bench()
    kinds, found = {kind: Kind() for kind in bench.readers}, list[tuple[float, bool]]()
    for number in range(frames):
        kind = list(kinds)[number % len(kinds)]
        reader, own = bench.readers[kind], kinds[kind]
        rng = np.random.default_rng([seed, number])
        frame, forces = bench.frame(kind, rng)
        reading = reader.search(frame)
        own.verdicts[reading.status.name] += 1
        if reading.status is ff.Status.MODEL_MISMATCH or not np.isfinite(reading.forces).all():
            continue
        off = (reading.forces - forces).ravel()
        square = float(off @ np.linalg.solve(reading.covariance, off))
        right = bool(chdtrc(len(off), square) > RARE)
        found.append((reading.probability, right))
        if reading.ok:
            own.wrong += not right
            if not right:
                print(f"{kind} {[seed, number]}: {square / len(off):.1f}", file=sys.stderr)
            own.squares.append(square / len(off))
            own.inside.append(float((np.abs(off) < INTERVAL * reading.std.ravel()).mean()))
            own.errors.append(off.reshape(forces.shape))
            if "all" in kind:
                own.best.append(from_the_truth(reader, frame, forces) - forces)
    stated, right = np.array([p for p, _ in found]), np.array([is_right for _, is_right in found])
    print(f"{'probability':<18}{'frames':>7}{'stated':>9}{'right':>9}{'near':>7}")
    for low, high in pairwise(BINS):
        those = (stated >= low) & ((stated < high) | (high == 1.0))
        if those.any():
            print(
                f"{f'{low:g} to {high:g}':<18}{those.sum():>7}{stated[those].mean():>9.4f}"
                f"{right[those].mean():>9.4f}{near(stated[those], right[those]):>7.2f}"
            )
    print()
    print(
        f"{'frames':<15}{'number':>6}{'OK':>8}{'AMBIGUOUS':>11}{'wrong':>7}{'inside':>9}"
        f"{'distance':>10}{'normal':>9}{'shear':>9}{'best':>9}{'best':>9}"
    )
    for kind, own in kinds.items():
        print(f"{kind:<15}{own.row()}")


if __name__ == "__main__":
    main()
