"""Readings of strips of random but sensible designs, cold and followed, against their covariance.

    python benchmarks/random_designs.py [frames] [seed]

Frames come from the exact Fourier series of strips with roller edges and not from the reader's own
matrix.  Every design has 3 to 32 tactels, 512 to 4,096 pixels and a uniform noise of 1 to 5 grey
levels; pitch, thicknesses and moduli lie around those of the shipped designs.  Half of the frames
have loads on all tactels, the others on some; magnitudes are uniform up to 1 to 4 N, less where
neighbouring pixels would be more than 0.6 rad apart.  Every frame is read cold; and for every four
frames one motion of 64 frames, a sway of some per cent, is followed, of which every sixteenth
counts.

OK, AMBIGUOUS, refused: shares of the verdicts, of which OK holds those without contact.  beyond:
shares of the OK readings whose error is farther off than their covariance allows by chance.
squared distance: mean square of Mahalanobis' distance over its dimension; one if the covariance is
right.  eigenvalues: of the stated covariance against the exact Cramer-Rao bound, summed over all
pixels of the exact series at the true loads: the 1 % and 99 % points over readings of the smallest
and of the largest.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.special import chdtrc

import fringeforce as ff
from fringeforce.mechanics import fourier
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

Array = NDArray[np.float64]

FRAMES, SEED = 1000, 0
EACH = 4
"""Frames of one design, of either kind."""
APART, SWAY = 16, 0.05
"""Frames of a motion from one that counts to the next; relative size of the motion."""
TERMS = 1600
"""Harmonics; ten digits for a cover of a hundredth of the length."""
STEEPEST, PACE = 20.0, 0.6
"""Largest angle of a force [degrees]; largest phase between neighbouring pixels [rad]."""
RARE, NEVER = 1e-3, 1e-9
"""Chances of errors that are counted."""


def random_design(rng: np.random.Generator) -> ff.Sensor:
    """A strip that somebody might build."""
    count = int(rng.integers(3, 33))
    pitch = rng.uniform(0.5e-3, 1.25e-3)
    cover = min(rng.uniform(0.25e-3, 0.8e-3), pitch)  # a thicker one blurs neighbours into one
    clear = rng.uniform(1.5e-3, 4e-3)
    length = count * pitch + 2 * (cover + clear) * rng.uniform(0.6, 1.2)
    noise = rng.uniform(1, 5)
    return ff.load_sensor("saad").replace(
        **{
            "transducer.edges": "roller",
            "transducer.length": length,
            "transducer.compliant.thickness": cover,
            "transducer.compliant.youngs_modulus": np.exp(rng.uniform(*np.log([3e6, 30e6]))),
            "transducer.photoelastic.thickness": clear,
            "transducer.photoelastic.youngs_modulus": rng.uniform(80e6, 160e6),
            "tactels.count": count,
            "tactels.pitch": pitch,
            "camera.pixels": int(np.exp(rng.uniform(*np.log([512, 4096])))),
            "camera.noise": noise,
        }
    )


def exact_influence(sensor: ff.Sensor) -> Array:
    """Influence matrix at the pixels by the exact series, shape (n_pixels, 2n) [rad/N]."""
    strip = sensor.transducer
    stress = fourier.integrated_stress(
        strip, sensor.tactels.positions, sensor.pixel_positions, TERMS
    )
    constant = stress_optic_constant(strip.photoelastic, sensor.polariscope.wavelength)
    return phase_lead(stress, constant).reshape(len(stress), -1)


def random_loads(influence: Array, rng: np.random.Generator) -> Array:
    """Loads on all or on some tactels that the camera can resolve, shape (n, 2) [N]."""
    count = influence.shape[1] // 2
    size = rng.uniform(1, 4) * rng.uniform(0, 1, count)
    if rng.random() < 0.5:
        size *= rng.random(count) < 0.5
    forces = ff.polar(size, rng.uniform(-STEEPEST, STEEPEST, count))
    pace = np.abs(np.diff(influence @ forces.ravel())).max()
    return forces * min(1.0, PACE / max(pace, 1e-12))


def motion(forces: Array, rng: np.random.Generator) -> Array:
    """A sway around forces, shape (frames, n, 2) [N]."""
    turns = np.arange(EACH * APART)[:, None, None] / (EACH * APART) + rng.random(forces.shape)
    return forces * (1 + SWAY * np.sin(2 * np.pi * turns))


def exposed(
    sensor: ff.Sensor, influence: Array, forces: Array, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Frames of the exact series, shape (k, n_pixels), uint8."""
    camera = sensor.camera
    phase = forces.reshape(len(forces), -1) @ influence.T
    level = camera.amplitude * np.sin(phase / 2) ** 2 + camera.offset
    level += rng.uniform(-camera.noise, camera.noise, level.shape)
    return np.clip(np.rint(level), 0, camera.full_scale).astype(np.uint8)


def bound(sensor: ff.Sensor, influence: Array, forces: Array) -> Array:
    """Exact information of one frame at its loads, shape (2n, 2n) [1/N^2]."""
    camera = sensor.camera
    slope = camera.amplitude / 2 * np.sin(influence @ forces.ravel())
    pulled = influence * slope[:, None]
    return pulled.T @ pulled / (camera.noise**2 / 3 + 1 / 12)


@dataclass
class Tally:
    """What readings of one kind gave."""

    verdicts: Counter[str] = field(default_factory=Counter)
    chances: list[float] = field(default_factory=list)
    squares: list[float] = field(default_factory=list)
    ranges: list[tuple[float, float]] = field(default_factory=list)

    def add(self, status: ff.Status, error: Array, covariance: Array, information: Array) -> str:
        """Take in one reading; says what is wrong with it."""
        self.verdicts[status.name] += 1
        if status is not ff.Status.OK:
            return status.name
        square, size = float(error @ np.linalg.solve(covariance, error)), len(error)
        self.chances.append(float(chdtrc(size, square)))
        self.squares.append(square / size)
        # where the bound is infinite in some direction the curvature of the levels limits it
        values = np.linalg.eigvalsh(information)
        if values[0] > 1e-10 * values[-1]:
            found = eigh(covariance, np.linalg.inv(information), eigvals_only=True)
            self.ranges.append((float(found[0]), float(found[-1])))
        return f"chance {self.chances[-1]:.1e}" if self.chances[-1] < RARE else ""

    def rows(self) -> list[str]:
        """Cells of the table."""
        whole, chances = max(sum(self.verdicts.values()), 1), np.array(self.chances)
        good = (self.verdicts["OK"] + self.verdicts["NO_CONTACT"]) / whole
        ambiguous = self.verdicts["AMBIGUOUS"] / whole
        low, high = np.percentile(np.array(self.ranges), [1, 99], axis=0)
        return [
            f"{whole}",
            f"{good:.1%}",
            f"{ambiguous:.1%}",
            f"{abs(1 - good - ambiguous):.1%}",
            f"{np.mean(chances < RARE):.2%}",
            f"{np.mean(chances < NEVER):.2%}",
            f"{np.mean(self.squares):.3f}",
            f"{low[0]:.2f} .. {high[0]:.2f}",
            f"{low[1]:.2f} .. {high[1]:.2f}",
        ]


def measure(cold: Tally, followed: Tally, seed: list[int], covariance: bool = True) -> list[str]:
    """Take in the frames of one random design; returns what is wrong, in words."""
    rng = np.random.default_rng(seed)
    sensor = random_design(rng)
    influence = exact_influence(sensor)
    reader = ff.Reader(ff.characterize(sensor))
    size, wrong = influence.shape[1], []
    name = f"{seed} {size // 2} tactels {sensor.camera.pixels} px {sensor.camera.noise:.1f} levels"
    forces = np.array([random_loads(influence, rng) for _ in range(EACH)])
    for load, frame in zip(forces, exposed(sensor, influence, forces, rng), strict=True):
        found = reader.search(frame)
        error, information = (found.forces - load).ravel(), bound(sensor, influence, load)
        fault = cold.add(found.status, error, found.covariance, information)
        wrong += [f"{name}, cold: {fault}"] if fault else []
    way = motion(forces[0], rng)
    reader.reset()
    batch = reader.read_on(exposed(sensor, influence, way, rng), covariance=covariance)
    for i in range(APART - 1, len(way), APART):
        error, information = (batch.forces[i] - way[i]).ravel(), bound(sensor, influence, way[i])
        matrix = np.asarray(batch.covariance[i]) if batch.covariance is not None else np.eye(size)
        fault = followed.add(batch.status[i], error, matrix, information)
        wrong += [f"{name}, followed: {fault}"] if fault else []
    return wrong


def main() -> None:
    """Print the table."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else FRAMES
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else SEED
    cold, followed = Tally(), Tally()
    for number in range(-(-frames // EACH)):
        for line in measure(cold, followed, [seed, number]):
            print(line, file=sys.stderr, flush=True)
    heads = ("frames", "OK", "AMBIGUOUS", "refused", f"beyond {RARE:g}", f"beyond {NEVER:g}")
    heads = (*heads, "squared distance", "smallest eigenvalue", "largest")
    print(f"{'':<9}" + "  ".join(heads))
    for label, tally in (("cold", cold), ("followed", followed)):
        cells = zip(heads, tally.rows(), strict=True)
        print(f"{label:<9}" + "  ".join(f"{cell:>{len(head)}}" for head, cell in cells))


if __name__ == "__main__":
    main()
