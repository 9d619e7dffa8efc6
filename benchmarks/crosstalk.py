"""Colour cameras whose channels see light of each other: readings beside what a design states.

    python benchmarks/crosstalk.py [frames] [seed]

Frames come from the exact Fourier series of the paper's strip with roller edges, with up to 2 N at
up to 30 degrees on every tactel, under a red, a green and a blue light at once.  The shares of the
light of other channels in one are those of the first column, each pair of channels its own, anew in
every frame; the design of the reader states the second.  named: of refused frames, how many have a
finding of cross-talk.  inside: forces inside their 95 % intervals.  distance: mean squared
Mahalanobis distance over its dimension.  The last two columns are root mean square errors [N].
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from reliability import ExactStrip, drawn_forces

import fringeforce as ff

Array = NDArray[np.float64]

FRAMES, SEED, REFUSED = 1000, 0, 100
"""Frames of a row, and of one whose frames are refused, each of which is diagnosed."""
WAVELENGTHS = 635.0, 525.0, 470.0
"""Of the lights [nm]."""
ROWS = (
    (0.0, 0.0, "none"),
    (0.05, 0.0, "none"),
    (0.05, 0.0, "5 %"),
    (0.05, 0.02, "5 +/- 2 %"),
    (0.05, 0.05, "5 +/- 5 %"),
)
"""Mean and deviation of each share, and what the design states."""


@dataclass
class Row:
    """What readings of one row gave."""

    verdicts: list[ff.Status] = field(default_factory=list)
    named: int = 0
    inside: list[float] = field(default_factory=list)
    squares: list[float] = field(default_factory=list)
    errors: list[Array] = field(default_factory=list)

    def cells(self) -> str:
        """Behind the first two columns."""
        count = len(self.verdicts)
        good = sum(one is ff.Status.OK for one in self.verdicts)
        refused = sum(one is ff.Status.MODEL_MISMATCH for one in self.verdicts)
        cells = [
            f"{count:>6}",
            f"{good / count:>6.1%}",
            f"{(count - good - refused) / count:>9.1%}",
        ]
        cells.append(f"{self.named / refused:>6.0%}" if refused else f"{'-':>6}")
        if not good:
            return "  ".join([*cells, f"{'-':>6}", f"{'-':>8}", f"{'-':>7}", f"{'-':>7}"])
        cells += [f"{np.mean(self.inside):>6.1%}", f"{np.mean(self.squares):>8.3f}"]
        cells += [f"{v:>7.4f}" for v in np.sqrt(np.square(self.errors).mean(axis=(0, 1)))]
        return "  ".join(cells)


def frame(
    exact: ExactStrip, forces: Array, share: Array, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Grey levels under three lights of which channels share some, shape (3, n_pixels)."""
    sensor = exact.sensor
    camera, places = sensor.camera, sensor.tactels.positions
    phase = exact.phase(forces, places, np.zeros(len(places)))
    ratio = sensor.polariscope.wavelength / (1e-9 * np.array(WAVELENGTHS))
    own = (1 - np.cos(ratio[:, None] * phase)) / 2
    others = share * (1 - np.eye(len(ratio)))
    light = (others + np.diag(1 - others.sum(axis=1))) @ own
    level = camera.offset + camera.amplitude * light
    level += rng.uniform(-camera.noise, camera.noise, level.shape)
    return np.clip(np.rint(level), 0, camera.full_scale).astype(np.uint8)


def main() -> None:
    """Print the table."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else FRAMES
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else SEED
    channels = [{"wavelength": f"{wave} nm"} for wave in WAVELENGTHS]
    changes = {"transducer.edges": "roller", "polariscope.channels": channels}
    drawing = ff.load_sensor("saad").replace(**changes)
    exact = ExactStrip(drawing)
    print(
        f"{'true share':<12}{'stated':<12}{'frames':>6}{'OK':>8}{'AMBIGUOUS':>11}{'named':>8}"
        f"{'inside':>8}{'distance':>10}{'normal':>9}{'shear':>9}"
    )
    for mean, std, stated in ROWS:
        own, values = Row(), {} if stated == "none" else {"polariscope.crosstalk": stated}
        reader = ff.Reader(ff.characterize(drawing.replace(**values)))
        for number in range(min(count, REFUSED) if mean and not values else count):
            rng = np.random.default_rng([seed, number])
            forces = drawn_forces(rng, 2.0, True)
            share = np.abs(mean + std * rng.standard_normal((3, 3)))
            reading = reader.search(frame(exact, forces, share, rng))
            own.verdicts.append(reading.status)
            if reading.status is ff.Status.MODEL_MISMATCH:
                own.named += "cross-talk" in " ".join(reading.findings)
            if reading.ok:
                off = (reading.forces - forces).ravel()
                square = float(off @ np.linalg.solve(reading.covariance, off))
                own.squares.append(square / len(off))
                own.inside.append(float((np.abs(off) < 1.96 * reading.std.ravel()).mean()))
                own.errors.append(off.reshape(forces.shape))
        true = f"{mean * 100:g} +- {std * 100:g} %" if std else f"{mean * 100:g} %"
        print(f"{true:<12}{stated:<12}{own.cells()}", flush=True)


if __name__ == "__main__":
    main()
