"""Frames of a strip under large strain, read by the linear model and by that of large strain.

    python benchmarks/large_strain.py [frames] [seed] [dead|follower]

Frames are solved with hyperelastic layers, each load by Newton steps, on elements of order 6, those
beside ends of contacts several times finer than the reader's, which have order 4; light runs along
the camera's lines through the deformed section.  The reader of large strain takes the second order
of the phase, and solves its elements at the loads that it finds where that is not enough.  Every
tactel of the paper's strip carries up to the stated force on a patch, at up to 17 degrees from the
normal.  Frames under which the surface folds are left out.

peak: largest phase.  off: largest error of the phase over that, of the linear model and of second
order.  OK: frames read as OK.  wrong: of these, a force lies more than six stated deviations off.
inside: forces of all frames within their 95 % intervals.  rms: error of the forces over the
Cramer-Rao bound of the second-order model.  worst: largest error of a force.  ms: processor time of
a cold reading, with all solutions that it takes.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from numpy.typing import NDArray

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.mechanics.finite_strain import FiniteStrip, finite_strip
from fringeforce.mechanics.second_order import STEEP
from fringeforce.models.finite_strain import phase_of

PATCHES = ("0.2 mm", "0.5 mm", "0.8 mm")
ORDER, SHARES = 6, {"dead": 1 / 4, "follower": 1 / 32}
"""Elements of the frames, and the largest ones beside ends of contacts over their width: order 7
and 1/16 change the phase of dead loads by 0.002 % of its peak."""
LARGEST = (0.5, 1.0, 2.0, 4.0)
"""Forces on a tactel [N]."""
SLOPE = 0.3
"""Largest tangential over normal force."""
FAR, INTERVAL = 6.0, 1.96
"""Stated standard deviations."""


def read(reader: ff.Reader, frames: NDArray, forces: NDArray, bound: NDArray) -> str:
    """One reader's figures."""
    reader.prepare()
    reader.search(frames[0])
    begun = time.process_time()
    readings = [reader.search(frame) for frame in frames]
    taken = (time.process_time() - begun) / len(frames)
    error = np.array([one.forces for one in readings]) - forces
    off = np.abs(error) / np.array([one.std for one in readings])
    good = np.array([one.status is ff.Status.OK for one in readings])
    wrong = int((good & (off.max(axis=(1, 2)) > FAR)).sum())
    ratio = np.sqrt(np.mean(np.square(error / bound)))
    return (
        f"{good.sum():3d} {wrong:5d} {np.mean(off < INTERVAL):7.1%} {ratio:6.2f} "
        f"{np.abs(error).max():7.3f} {1e3 * taken:6.1f}"
    )


def main() -> None:
    """Print the table."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    loads = sys.argv[3] if len(sys.argv) > 3 else "dead"
    head = "  OK wrong  inside    rms   worst     ms"
    said = "" if loads == "dead" else f", {loads} loads"
    print(f"{count} frames each{said}\n\n{'patch':7s}  N  reader   peak     off  {head}")
    for patch in PATCHES:
        design = ff.load_sensor("saad").replace(**{"tactels.contact_width": patch})
        drawn = ff.characterize(design)
        finite = ff.characterize(
            design.replace(**{"transducer.strain": "finite", "transducer.loads": loads})
        )
        strip = _strip(finite.sensor)
        readers = {"linear": ff.Reader(drawn), "finite": ff.Reader(finite)}
        for largest in LARGEST:
            rng = np.random.default_rng(seed)
            forces = rng.uniform(0, largest, (count, design.tactels.count, 2))
            forces[..., 1] *= rng.uniform(-SLOPE, SLOPE, forces.shape[:2])
            solved = [(force, _phase(finite, strip, force)) for force in forces]
            stable = [(force, phase) for force, phase in solved if phase is not None]
            if len(stable) < count:
                print(f"{patch:7s} {largest:3g} the surface folds in {count - len(stable)} frames")
            if not stable:
                continue
            forces, phases = map(np.stack, zip(*stable, strict=True))
            frames = np.stack([_shot(drawn, phase, rng) for phase in phases])
            peak = np.abs(phases).max()
            bound = np.stack([readers["finite"].bound(force) for force in forces])
            for name, reader in readers.items():
                known = np.stack([reader._single.phase(force) for force in forces])
                off = np.abs(known - phases).max() / peak
                figures = read(reader, frames, forces, bound)
                print(
                    f"{patch:7s} {largest:3g} {name:7s} {peak:6.1f} {off:7.2%}   {figures}",
                    flush=True,
                )


def _strip(sensor: ff.Sensor) -> FiniteStrip:
    """Elements of the frames."""
    tactels = sensor.tactels
    widths, share = np.full(tactels.count, tactels.contact_width), SHARES[sensor.transducer.loads]
    return finite_strip(
        sensor.transducer, tactels.positions, widths, order=ORDER, share=share, growth=STEEP
    )


def _phase(model: ff.SensorModel, strip: FiniteStrip, forces: NDArray) -> NDArray | None:
    """Phase under forces, or None where the surface folds under them."""
    try:
        return phase_of(model.sensor, strip, model.pixel_positions, strip.solved(forces))
    except InputError:
        return None


def _shot(model: ff.SensorModel, phase: NDArray, rng: np.random.Generator) -> NDArray:
    camera = model.sensor.camera
    level = camera.offset + camera.amplitude * (1 - np.cos(phase)) / 2
    noisy = level + rng.uniform(-camera.noise, camera.noise, level.shape)
    return np.clip(np.rint(noisy), 0, camera.full_scale).astype(np.uint8)


if __name__ == "__main__":
    main()
