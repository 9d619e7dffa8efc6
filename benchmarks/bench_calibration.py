"""Calibration on a bench where everything departs from the drawing, and readings after it.

    python benchmarks/bench_calibration.py [held-out frames] [seed] [part of a departure's name]

Frames come from the exact Fourier series of the paper's strip with roller edges, under tractions of
their own, and not from the reader's matrix; light and camera have their own formulas.  64 presses,
one at a time, go through all tactels; then every tactel of the held-out frames carries up to 2 N,
with new places, widths and light.

OK: held-out frames that are read as OK.  best: the same of a reader with the true sensor.  far: of
the frames read as OK, a force lies more than six stated standard deviations off.  inside: forces
within their 95 % intervals.  ratio: error over that of the same reader with the true sensor.  chi2:
of the calibration, which takes s seconds.  off: the largest deviation of a calibrated value from
the truth, in its stated standard deviations, and of which; behind it the frames and pixels that
were left out.

The last line tells whether a frame can be read at all: of the frames that the reader with the true
sensor finds ambiguous, in how many its first explanation is the right one, and in how many its
probabilities say so.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

import fringeforce as ff
from fringeforce.mechanics import fourier
from fringeforce.models.imaging import Imaging

Array = NDArray[np.float64]

PRESSES, HELD_OUT, SEED = 64, 200, 0
TERMS = 400
"""Harmonics; ten digits for this cover."""
LARGEST, STEEPEST = 2.0, 30.0
"""Force on a tactel [N] and its angle from the normal [degrees]."""
HARDEST = 3.0
"""Force of a press of the calibration [N]."""
FAR, INTERVAL = 6.0, 1.96
"""Stated standard deviations."""
QUADRATURE = 12
"""Gauss points over a contact."""
CAUSES = {
    "transducer.compliant.thickness": 1.1,
    "transducer.compliant.youngs_modulus": 0.8,
    "transducer.photoelastic.strain_optic_coefficient": 1.08,
}
"""What the layers are, over the drawing."""
TOLERANCES = {
    "tactels.placement": "0 +/- 0.1 mm",
    "tactels.contact_width": "0.5 +/- 0.2 mm",
}
"""What the drawing states of contacts."""


@dataclass(frozen=True)
class Bench:
    """A sensor, its light and its camera, and how carefully it is pressed.

    Attributes
    ----------
    layers : mapping
        Values of the layers, over those of the drawing.
    shift, scale : float
        Of the camera along the strip [m], relative.
    uneven : float
        Standard deviation of the smooth unevenness of the light, relative.
    visibility : (float, float)
        Of the fringes at the left and the right end.
    residual : float
        Standard deviation of a smooth phase lead without load [rad].
    blur : float
        Standard deviation of the point spread [pixels].
    gamma : float
        Power of the grey level as a share of the full scale.
    scatter : float
        Standard deviation of the places of contacts beside those that are written down [m].
    widths : (float, float)
        Least and largest width of contacts [m].
    weighed : float
        Relative standard deviation of the forces of the calibration.
    lamp : float
        Relative standard deviation of the light from frame to frame.
    wrong, dead : int
        Presses that are written down wrongly, and pixels that do not follow the light.
    """

    layers: tuple[tuple[str, float], ...] = ()
    shift: float = 0.0
    scale: float = 0.0
    uneven: float = 0.0
    visibility: tuple[float, float] = (1.0, 1.0)
    residual: float = 0.0
    blur: float = 0.0
    gamma: float = 1.0
    scatter: float = 0.0
    widths: tuple[float, float] = (0.5e-3, 0.5e-3)
    weighed: float = 0.0
    lamp: float = 0.0
    wrong: int = 0
    dead: int = 0


ALL = Bench(
    layers=tuple(CAUSES.items()),
    shift=0.4e-3,
    scale=0.01,
    uneven=0.05,
    visibility=(0.97, 0.90),
    residual=0.3,
    blur=6.0,
    gamma=1.1,
    scatter=0.1e-3,
    widths=(0.2e-3, 0.8e-3),
    weighed=0.01,
    lamp=0.02,
    wrong=2,
    dead=10,
)
BENCHES = {
    "none": Bench(),
    "layers not as drawn": Bench(layers=ALL.layers),
    "camera shifted and scaled": Bench(shift=ALL.shift, scale=ALL.scale),
    "uneven light": Bench(uneven=ALL.uneven),
    "visibility 0.97 to 0.90": Bench(visibility=ALL.visibility),
    "residual 0.3 rad": Bench(residual=ALL.residual),
    "blur of 6 px": Bench(blur=ALL.blur),
    "gamma 1.1": Bench(gamma=ALL.gamma),
    "presses 0.1 mm rms beside": Bench(scatter=ALL.scatter),
    "contacts 0.2 to 0.8 mm wide": Bench(widths=ALL.widths),
    "forces 1 % rms wrong": Bench(weighed=ALL.weighed),
    "lamp 2 % rms": Bench(lamp=ALL.lamp),
    "two wrong presses, ten dead pixels": Bench(wrong=2, dead=10),
    "all at once": ALL,
}


class BuiltBench:
    """One sensor of a bench, with its fields drawn."""

    def __init__(self, bench: Bench, drawing: ff.Sensor, rng: np.random.Generator) -> None:
        self.bench, self.drawing, self.rng = bench, drawing, rng
        values = {path: _value(drawing, path) * factor for path, factor in bench.layers}
        self.made = drawing.replace(**values)
        seen, half = drawing.pixel_positions, drawing.transducer.length / 2
        self.x = np.clip(bench.shift + (1 + bench.scale) * seen, -half, half)
        self.along = (np.arange(len(seen)) + 0.5) / len(seen)
        self.light = 1 + bench.uneven * _smooth(self.along, rng, 0.3)
        self.residual = bench.residual * _smooth(self.along, rng, 0.2)
        left, right = bench.visibility
        self.visibility = left + (right - left) * self.along
        self.dead = rng.choice(len(seen), bench.dead, replace=False)
        self.dead_levels = rng.integers(0, 256, bench.dead)

    def known(self) -> ff.SensorModel:
        """A model of this very sensor, its light, its lens and its residual."""
        bench, camera, strip = self.bench, self.drawing.camera, self.drawing.transducer
        bright = camera.amplitude * self.light
        imaging = Imaging.known(
            positions=bench.shift + (1 + bench.scale) * self.drawing.pixel_positions,
            amplitude=bright * self.visibility,
            offset=camera.offset + bright * (1 - self.visibility) / 2,
        )
        usable = np.abs(imaging.positions) < strip.length / 2 * 0.998
        usable[self.dead] = False
        lens = {"camera.gamma": bench.gamma}
        if bench.blur:
            lens["camera.blur"] = bench.blur * strip.length / camera.pixels
        return replace(
            ff.characterize(self.made.replace(**lens)),
            imaging=replace(
                imaging, residual=self.residual, usable=usable, drift=(bench.lamp, 0.0)
            ),
        )

    def exposed(self, forces: Array) -> NDArray[np.uint8]:
        """Frames under forces (F, n, 2) of contacts near the tactels, shape (F, P)."""
        bench, camera = self.bench, self.drawing.camera
        frames = np.empty((len(forces), camera.pixels), dtype=np.uint8)
        for frame, load in zip(frames, forces, strict=True):
            touched = np.flatnonzero(load.any(axis=1))
            places = self.drawing.tactels.positions[touched]
            places = places + self.rng.normal(0, 1, len(places)) * bench.scatter
            widths = self.rng.uniform(*bench.widths, len(places))
            phase = self._phase(places, widths, load[touched]) + self.residual
            light = (1 - self.visibility * np.cos(phase)) / 2
            if bench.blur:
                light = gaussian_filter1d(light, bench.blur, mode="nearest")
            gain = self.light * (1 + bench.lamp * self.rng.standard_normal())
            level = camera.amplitude * gain * light + camera.offset
            level = camera.full_scale * (level / camera.full_scale) ** bench.gamma
            noisy = level + self.rng.uniform(-camera.noise, camera.noise, len(level))
            noisy[self.dead] = self.dead_levels
            frame[:] = np.clip(np.rint(noisy), 0, camera.full_scale)
        return frames

    def _phase(self, places: Array, widths: Array, forces: Array) -> Array:
        """Phase lead of patches under uniform tractions, shape (P,) [rad]."""
        nodes, weights = np.polynomial.legendre.leggauss(QUADRATURE)
        lines = (places[:, None] + widths[:, None] / 2 * nodes).ravel()
        shares = (forces[:, None] * (weights / 2)[:, None]).reshape(-1, 2)
        stress = fourier.integrated_stress(self.made.transducer, lines, self.x, TERMS)
        clear = self.made.transducer.photoelastic
        constant = (1 + clear.poissons_ratio) / clear.youngs_modulus * 2 * np.pi
        constant *= 2 * clear.strain_optic_coefficient / self.made.polariscope.wavelength
        return constant * np.einsum("mct,ct->m", stress, shares)


def presses(bench: BuiltBench) -> tuple[NDArray[np.uint8], Array]:
    """Frames of single presses, and the forces that are written down for them."""
    rng, tactels = bench.rng, bench.drawing.tactels.count
    forces = np.zeros((PRESSES, tactels, 2))
    size, angle = rng.uniform(0.3, HARDEST, PRESSES), rng.uniform(-STEEPEST, STEEPEST, PRESSES)
    forces[np.arange(PRESSES), np.arange(PRESSES) % tactels] = ff.polar(size, angle)
    frames = bench.exposed(forces)
    written = forces * (1 + bench.bench.weighed * rng.standard_normal(forces.shape))
    for row in rng.choice(PRESSES, bench.bench.wrong, replace=False):
        written[row] = np.roll(written[row], rng.choice([-3, 3]), axis=0)
    return frames, written


def loads(frames: int, tactels: int, rng: np.random.Generator) -> Array:
    """Presses on every tactel, shape (frames, n, 2) [N]."""
    size = rng.uniform(0, LARGEST, (frames, tactels))
    return ff.polar(size, rng.uniform(-STEEPEST, STEEPEST, (frames, tactels)))


def _smooth(along: Array, rng: np.random.Generator, length: float) -> Array:
    """A Gaussian process of unit variance, by the eigenvectors of its covariance."""
    some = np.linspace(0, 1, 101)
    values, vectors = np.linalg.eigh(np.exp(-(((some[:, None] - some) / length) ** 2) / 2))
    drawn = vectors @ (np.sqrt(np.maximum(values, 0)) * rng.standard_normal(len(some)))
    return np.interp(along, some, drawn)


def _value(sensor: ff.Sensor, path: str) -> float:
    value: Any = sensor
    for part in path.split("."):
        value = getattr(value, part)
    return float(value)


def drawing() -> ff.Sensor:
    """The paper's strip with roller edges, for which series are exact."""
    return ff.load_sensor("saad").replace(**{"transducer.edges": "roller", **TOLERANCES})


def nearest(reading: ff.Reading, truth: Array) -> int:
    """Which explanation of an ambiguous frame is nearest to the true forces; the first is 0."""
    off = np.concatenate([reading.forces[None], reading.alternatives]) - truth
    off = off.reshape(len(off), -1)
    return int(np.argmin(np.sum(off * np.linalg.solve(reading.covariance, off.T).T, axis=1)))


def row(
    name: str, bench: Bench, held_out: int, seed: list[int], doubts: list[tuple[float, bool]]
) -> str:
    """One line of the table; probability and truth of the best reader's ambiguous frames."""
    sensor, rng = drawing(), np.random.default_rng(seed)
    made = BuiltBench(bench, sensor, rng)
    frames, written = presses(made)
    begin = time.perf_counter()
    model = ff.calibrate(sensor, frames, written)
    took = time.perf_counter() - begin
    forces = loads(held_out, sensor.tactels.count, rng)
    seen = made.exposed(forces)
    reader, best = ff.Reader(model), ff.Reader(made.known())
    errors, inside, least, ok, best_ok = [], [], [], 0, 0
    for frame, truth in zip(seen, forces, strict=True):
        reading, with_truth = reader.search(frame), best.search(frame)
        ok += reading.status is ff.Status.OK
        best_ok += with_truth.status is ff.Status.OK
        if with_truth.status is ff.Status.AMBIGUOUS:
            doubts.append((with_truth.probability, nearest(with_truth, truth) == 0))
        if reading.status is ff.Status.OK and with_truth.status is ff.Status.OK:
            errors.append(reading.forces - truth)
            least.append(with_truth.forces - truth)
            inside.append(np.abs(errors[-1]) / reading.std)
    found = model.calibration
    assert found is not None
    truths = {path: _value(made.made, path) for path in CAUSES}
    truths |= {"camera shift": bench.shift, "camera scale": 1 + bench.scale}
    off = {
        each: (value - truths[each]) / std
        for each, value, std in zip(found.names, found.values, found.std, strict=True)
        if each in truths
    }
    worst = max(off, key=lambda each: abs(off[each]))
    rms = np.sqrt(np.mean(np.square(errors), axis=(0, 1))) if errors else [np.nan, np.nan]
    ratio = np.sqrt(np.mean(np.square(errors)) / np.mean(np.square(least))) if errors else np.nan
    scaled = np.array(inside) if inside else np.full((1, 1, 2), np.nan)
    far = (scaled > FAR).any(axis=(1, 2)).mean()
    return (
        f"{name:<36} {ok / held_out:>5.0%} {best_ok / held_out:>5.0%} {far:>5.1%} "
        f"{(scaled < INTERVAL).mean():>7.1%} "
        f"{rms[0]:>7.3f} {rms[1]:>7.3f} {ratio:>6.2f} {found.chi2:>6.3f} {took:>6.1f} "
        f"{off[worst]:>+6.1f} {worst}  {len(found.outliers)} {len(found.dead)}"
    )


def main() -> None:
    """Print the table."""
    held_out = int(sys.argv[1]) if len(sys.argv) > 1 else HELD_OUT
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else SEED
    wanted = sys.argv[3] if len(sys.argv) > 3 else ""
    print(
        f"{'departure':<36}    OK  best   far  inside   N rms   T rms  ratio   chi2      s    off"
    )
    doubts: list[tuple[float, bool]] = []
    for number, (name, bench) in enumerate(BENCHES.items()):
        if wanted in name:
            print(row(name, bench, held_out, [seed, number], doubts), flush=True)
    said, right = np.sum(doubts, axis=0) if doubts else (0, 0)
    print(f"best, ambiguous: {len(doubts)}; first is right: {right:g}, said {said:.1f}")


if __name__ == "__main__":
    main()
