"""A touch that is pressed, held, slid, released and repeated on a strip that creeps by 11 %.

    python benchmarks/creep.py [sensors] [seed]

The layers lose 6 % of their modulus in 0.4 s and 4 % in 15 s; frames come ten times a second.  Each
sensor is drawn from a tolerance of 20 % of each share, and its creep integrated exactly between
frames.  Readings: without compensation; with the drawing; with the sensor's own terms, as a
calibration finds them; and with the drawing if the sensor has a third term that nobody knows, of
2 % and 100 s.

rms: error of the forces of touched frames over that of the same frames without creep.  most: the
largest of these ratios over stretches of two seconds.  inside: of these forces within their 95 %
intervals.  left: mean of the total normal force in the 20 s after
the release over that before [per cent].  contact: frames of those 200 that are OK, as if something
touched.

Behind it hysteresis of five cycles of loading and unloading, 10 s each: largest width of the loop
over the largest load, without and with compensation.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import fringeforce as ff

TERMS = [(0.06, 0.4), (0.04, 15.0)]
UNKNOWN = (0.02, 100.0)
TOLERANCE = 0.2
TIMES = np.arange(0.0, 200.0, 0.1)
STRETCH = np.arange(len(TIMES)) // 20
"""Number of the stretch of each frame."""
CORNERS = [0, 2, 3, 63, 66, 67, 100, 101, 110, 112, 200]
"""Times at which forces change their pace [s]."""
NORMAL = [0, 0, 1, 1, 1, 0, 0, 0.8, 0.8, 0, 0]
SLID = [0, 0, 0.1, 0.1, 0.4, 0, 0, 0.1, 0.1, 0, 0]
"""Shares of the largest force, on the middle tactel [N]."""
LEFT = (TIMES > 67.5) & (TIMES < 87.5)
BEFORE = (TIMES > 57.5) & (TIMES < 63)
SHAPE = np.exp(-np.square((np.arange(11) - 5) / 1.5))
"""Of the touch over the tactels."""


def design(terms: Sequence[object]) -> ff.Sensor:
    """The paper's strip with layers that relax."""
    return ff.load_sensor("saad").replace(**{"transducer.relaxation": terms})


@dataclass
class Figures:
    """What one kind of reading made of all sensors."""

    squares: list[NDArray]
    inside: list[float]
    left: list[float]
    contact: int = 0

    @property
    def rms(self) -> NDArray:
        """Errors of all touched frames, then of those of each stretch [N]; none where few are."""
        sums, counts = np.sum(self.squares, axis=0)
        counts = np.where(counts > 0, counts, np.nan)
        return np.sqrt(np.append(np.nansum(sums) / np.nansum(counts), sums / counts))

    def add(self, batch: ff.Batch, forces: NDArray) -> None:
        """Count the readings of one sensor."""
        good = np.array([status is ff.Status.OK for status in batch.status])
        touched = good & forces.any(axis=(1, 2))
        error = (batch.forces - forces)[touched]
        squares = np.square(error).mean(axis=(1, 2))
        rows, size = STRETCH[touched], STRETCH[-1] + 1
        self.squares.append(
            np.array([np.bincount(rows, squares, size), np.bincount(rows, minlength=size)])
        )
        self.inside.append(float(np.mean(np.abs(error) < 1.96 * batch.std[touched])))
        total = np.nan_to_num(batch.forces[..., 0]).sum(axis=1)
        self.left.append(float(total[LEFT].mean() / total[BEFORE].mean()))
        self.contact += int(good[LEFT].sum())


def main() -> None:
    """Print both tables."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    rng = np.random.default_rng(seed)
    forces = np.zeros((len(TIMES), 11, 2))
    forces[..., 0] = np.interp(TIMES, CORNERS, NORMAL)[:, None] * SHAPE
    forces[..., 1] = np.interp(TIMES, CORNERS, SLID)[:, None] * SHAPE
    still = ff.Reader(ff.characterize(design([])))
    stated = [{"share": f"{share} +/- 20 %", "time": time} for share, time in TERMS]
    drawn = ff.Reader(ff.characterize(design(stated)))
    figures = {
        name: Figures([], [], [])
        for name in ("no creep", "without", "drawing", "own terms", "third term")
    }
    for _ in range(count):
        own = [(share * (1 + TOLERANCE * rng.standard_normal()), time) for share, time in TERMS]
        sensor, more = (ff.characterize(design(terms)) for terms in (own, [*own, UNKNOWN]))
        seeds = rng.integers(2**32, size=3)
        plain = still.model.expose(forces, rng=seeds[0])
        frames = sensor.expose(forces, rng=seeds[1], times=TIMES)
        figures["no creep"].add(still.read_batch(plain), forces)
        figures["without"].add(still.read_batch(frames), forces)
        figures["drawing"].add(drawn.read_batch(frames, times=TIMES), forces)
        figures["own terms"].add(ff.Reader(sensor).read_batch(frames, times=TIMES), forces)
        longer = more.expose(forces, rng=seeds[2], times=TIMES)
        figures["third term"].add(drawn.read_batch(longer, times=TIMES), forces)
    least = figures["no creep"].rms
    print(f"{count} sensors, {len(TIMES)} frames each; without creep {1e3 * least[0]:.1f} mN rms\n")
    print(f"{'reading':12s}    rms   most   inside     left  contact")
    for name, one in figures.items():
        ratio = one.rms / least
        print(
            f"{name:12s} {ratio[0]:6.2f} {np.nanmax(ratio[1:]):6.2f}  {np.mean(one.inside):6.1%}  "
            f"{np.mean(one.left):6.2%}  {one.contact / count:7.1f}"
        )
    times = np.arange(0.0, 50.0, 0.1)
    cycle = np.abs((times / 5.0 + 1) % 2 - 1)
    loads = np.zeros((len(times), 11, 2))
    loads[..., 0] = cycle[:, None] * SHAPE
    model = ff.characterize(design(TERMS))
    frames = model.expose(loads, rng=seed, times=times)
    total = loads[..., 0].sum(axis=1)
    print("\nhysteresis of five cycles: ", end="")
    for name, batch in (
        ("without", still.read_batch(frames)),
        ("with", ff.Reader(model).read_batch(frames, times=times)),
    ):
        found = batch.forces[..., 0].sum(axis=1)
        rising = np.gradient(total) > 0
        usable = np.isfinite(found)
        steps = np.linspace(0.2, 0.9, 8) * total.max()
        width = [
            np.mean(found[usable & ~rising & near]) - np.mean(found[usable & rising & near])
            for near in (np.abs(total - step) < 0.05 * total.max() for step in steps)
        ]
        print(f"{name} {np.max(np.abs(width)) / total.max():.2%}  ", end="")
    print()


if __name__ == "__main__":
    main()
