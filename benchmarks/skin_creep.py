"""Contacts on a skin that creeps by 11 %: pressed, held, slid, released, and pressed elsewhere.

    python benchmarks/skin_creep.py [sensors] [seed]

The layers lose 6 % of their modulus in 0.4 s and 4 % in 15 s; frames come ten times a second.  Each
sensor is drawn from a tolerance of 20 % of each share, its fingers are cylinders of 2 to 6 mm
radius of up to 2.5 N, whose pressures come from contact mechanics, and its creep is integrated
exactly between frames.  Readings: the same touches on a skin that does not creep; without
compensation; with the drawing; with the sensor's own terms, as a calibration finds them; and with
the drawing if the sensor has a third term that nobody knows, of 2 % and 100 s.

OK: share of touched frames.  rms: error of the total normal force of these, over that without
creep.  inside: of total normal and tangential force and centre of pressure within their 95 %
intervals.  far: OK frames with one of these beyond six deviations.  contact: of frames in which
nothing touches after a release, those that are OK, as if something touched.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

import fringeforce as ff
from fringeforce.models.presses import tractions

Array = NDArray[np.float64]

TERMS = [(0.06, 0.4), (0.04, 15.0)]
UNKNOWN = (0.02, 100.0)
TOLERANCE = 0.2
TIMES = np.arange(0.0, 150.0, 0.1)
CORNERS = [0, 1, 2, 42, 45, 46, 75, 75.5, 100, 101, 150]
"""Times at which forces change their pace [s]."""
FIRST = [0, 0, 1, 1, 1, 0, 0, 0, 0, 0, 0]
SECOND = [0, 0, 0, 0, 0, 0, 0, 0.6, 0.6, 0, 0]
"""Shares of the largest force of two fingers."""
SLIDE = 0.5e-3
"""Way of the first finger from 42 to 45 s, 5 covers at most [m]."""


def design(terms: Sequence[object]) -> ff.Sensor:
    """The paper's strip as a skin, with layers that relax."""
    return ff.load_sensor("skin").replace(**{"transducer.relaxation": terms})


def touches(rng: np.random.Generator) -> list[list[ff.Press]]:
    """What touches in every frame."""
    places = rng.permutation([-3e-3, 0.0, 3e-3])[:2] + rng.uniform(-1e-3, 1e-3, 2)
    radii, most = rng.uniform(2e-3, 6e-3, 2), rng.uniform(1.0, 2.5, 2)
    ratio, way = rng.uniform(-0.4, 0.4, 2), rng.uniform(-5, 5) * SLIDE
    moved = np.interp(TIMES, [0, 42, 45, 150], [0, 0, way, way])
    found = []
    for t, share in zip(range(len(TIMES)), TIMES, strict=True):
        pushes = [np.interp(share, CORNERS, part) for part in (FIRST, SECOND)]
        found.append(
            [
                ff.Press(
                    x=float(places[k] + (moved[t] if k == 0 else 0.0)),
                    normal=float(push * most[k]),
                    tangential=float(push * most[k] * ratio[k]),
                    radius=float(radii[k]),
                )
                for k, push in enumerate(pushes)
                if push > 0
            ]
        )
    return found


def totals(pressed: list[list[ff.Press]]) -> Array:
    """Normal and tangential force and centre of pressure of every frame; no numbers of nothing.

    Shear moves the centre of pressure beside the axis of a cylinder.
    """
    sensor, found = design([]), np.full((len(pressed), 3), np.nan)
    for row, presses in zip(found, pressed, strict=True):
        parts = [tractions(sensor, press) for press in presses]
        if parts:
            forces = np.concatenate([part.forces for part in parts])
            places = np.concatenate([part.places for part in parts])
            row[:2] = forces.sum(axis=0)
            row[2] = forces[:, 0] @ places / row[0]
    return found


@dataclass
class Figures:
    """What one kind of reading made of all sensors."""

    ok: list[bool] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    pulls: list[Array] = field(default_factory=list)
    contact: int = 0
    free: int = 0
    seconds: float = 0.0

    def add(self, batch: ff.Batch, acting: Array, seconds: float) -> None:
        """Count the readings of one sensor."""
        assert batch.resultants is not None
        self.seconds += seconds
        for status, felt, true in zip(batch.status, batch.resultants, acting, strict=True):
            good = status is ff.Status.OK
            if not np.isfinite(true).all():
                self.free += 1
                self.contact += int(good)
                continue
            self.ok.append(good)
            if not good:
                continue
            total = felt[0]
            off = np.array([*total.force, total.place[0]]) - true
            self.errors.append(float(off[0]))
            self.pulls.append(off / [*total.force_std, total.place_std[0]])

    def row(self, least: float) -> str:
        """Cells of the table."""
        pulls = np.abs(np.array(self.pulls))
        return (
            f"{np.mean(self.ok):7.1%} {np.sqrt(np.mean(np.square(self.errors))) / least:7.2f}"
            f" {np.mean(pulls < 1.96):8.1%} {int((pulls > 6).any(axis=1).sum()):5d}"
            f" {self.contact:5d} of {self.free:5d} {self.seconds:8.1f}"
        )


def main() -> None:
    """Print the table."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 6
    rng = np.random.default_rng(int(sys.argv[2]) if len(sys.argv) > 2 else 0)
    stated = [{"share": f"{share} +/- 20 %", "time": lag} for share, lag in TERMS]
    still, drawn = (ff.characterize(design(terms)) for terms in ([], stated))
    figures = {
        name: Figures() for name in ("no creep", "without", "drawing", "own terms", "third term")
    }

    def read(name: str, model: ff.SensorModel, frames: NDArray[np.unsignedinteger]) -> None:
        reader, began = ff.Reader(model), time.process_time()
        times = TIMES if reader.needs_times else None
        batch = reader.read_batch(frames, covariance=False, workers=1, times=times)
        figures[name].add(batch, acting, time.process_time() - began)

    for _ in range(count):
        own = [(share * (1 + TOLERANCE * rng.standard_normal()), lag) for share, lag in TERMS]
        sensor, more = (ff.characterize(design(terms)) for terms in (own, [*own, UNKNOWN]))
        pressed, seeds = touches(rng), rng.integers(2**32, size=3)
        acting = totals(pressed)
        frames = sensor.expose(pressed, rng=seeds[1], times=TIMES)
        read("no creep", still, still.expose(pressed, rng=seeds[0]))
        read("without", still, frames)
        read("drawing", drawn, frames)
        read("own terms", sensor, frames)
        read("third term", drawn, more.expose(pressed, rng=seeds[2], times=TIMES))
    least = float(np.sqrt(np.mean(np.square(figures["no creep"].errors))))
    print(f"{count} skins, {len(TIMES)} frames each; without creep {1e3 * least:.1f} mN rms\n")
    print(f"{'reading':12s}{'OK':>7}{'rms':>8}{'inside':>9}{'far':>6}{'contact':>15}{'seconds':>9}")
    for name, one in figures.items():
        print(f"{name:12s}{one.row(least)}")


if __name__ == "__main__":
    main()
