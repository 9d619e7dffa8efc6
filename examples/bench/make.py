"""How the frames of this folder came about: a simulated bench, and a sensor that is not as drawn.

The sensor differs from the shipped design `saad` in its materials and its cover, the camera looks
elsewhere than designed, the lamp lights the strip unevenly, ten pixels are dead, and the press of
one frame was written down on the wrong tactel.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import fringeforce as ff
from fringeforce.io.frames import save_frames
from fringeforce.io.tables import save_forces
from fringeforce.models.imaging import Imaging

WRONG = 17


def sensor_on_the_bench() -> ff.SensorModel:
    """The sensor as it is, which nobody knows."""
    drawing = ff.load_sensor("saad")
    strip = drawing.transducer
    optic = strip.photoelastic.strain_optic_coefficient
    real = drawing.replace(
        **{
            "transducer.photoelastic.strain_optic_coefficient": 1.08 * optic,
            "transducer.compliant.youngs_modulus": 0.8 * strip.compliant.youngs_modulus,
            "transducer.compliant.thickness": 1.1 * strip.compliant.thickness,
        }
    )
    along = np.linspace(-0.5, 0.5, drawing.camera.pixels)
    camera = Imaging.known(
        positions=0.4e-3 + 1.01 * drawing.pixel_positions,
        amplitude=150 * (1 + 0.3 * np.cos(4.5 * along + 0.6)),
        offset=8 + 3 * np.sin(3 * along),
    )
    return replace(ff.characterize(real), imaging=camera)


def single_presses(tactels: int) -> np.ndarray:
    """Every tactel pressed with 3 N and 1.8 N, and dragged with half of that, one at a time."""
    unit = np.zeros((2, tactels, tactels, 2))
    for kind, size in enumerate((3.0, 1.5)):
        unit[kind, :, :, kind] = size * np.eye(tactels)
    unit = unit.reshape(-1, tactels, 2)
    return np.concatenate([unit, 0.6 * unit])


def combined_presses(rng: np.random.Generator, count: int, tactels: int) -> np.ndarray:
    """Loads on some seven tactels in ten, up to 2 N and 20 degrees."""
    size = rng.uniform(0, 2, (count, tactels)) * (rng.random((count, tactels)) < 0.7)
    angle = np.radians(rng.uniform(-20, 20, (count, tactels)))
    return np.stack([size * np.cos(angle), size * np.sin(angle)], axis=2)


def make(folder: Path) -> None:
    """Write the frames and the loads that go with them."""
    rng = np.random.default_rng(11)
    real = sensor_on_the_bench()
    tactels, pixels = real.sensor.tactels.count, real.sensor.camera.pixels
    dead = rng.choice(pixels, 10, replace=False)
    singles = single_presses(tactels)
    sets = {
        "calibration": np.concatenate([singles, combined_presses(rng, 20, tactels)]),
        "check": combined_presses(rng, 20, tactels),
    }
    for name, forces in sets.items():
        frames = real.expose(forces.round(3), rng)
        frames[:, dead] = 0
        save_frames(folder / f"{name}.h5", frames, real.sensor.pixel_positions)
        written = forces.round(3)
        if name == "calibration":
            written[WRONG] = np.roll(written[WRONG], 1, axis=0)
        save_forces(folder / f"{name}.csv", written)


if __name__ == "__main__":
    make(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
