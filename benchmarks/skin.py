"""What a skin makes of cylinders that press on it anywhere.

    python benchmarks/skin.py [frames] [seed]

One to three rigid cylinders at a time, 1 to 10 mm in radius, under 0.3 to 5 N each, use up to 0.9
of their friction and lie at least 2.5 mm apart, anywhere on the paper's strip with roller edges.
Their pressure and shear come from contact mechanics on its layers, with stick and slip, and the
light of these from the exact Fourier series; the reader has finite elements, and knows nothing of
cylinders.  The pixels have a uniform noise of 5 grey levels.

OK, AMBIGUOUS, refused: frames.  wrong OK: read as OK, but a total lies more than six stated
deviations off.  inside: share of what is stated that lies within its 95 % interval.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from typing import Any

import numpy as np

import fringeforce as ff
from fringeforce.models.presses import tractions

FRAMES, SEED = 1000, 0
RADII, FORCES = (1e-3, 10e-3), (0.3, 5.0)
FRICTION, USED = 0.6, 0.9
OUTERMOST, APART = 5.5e-3, 2.5e-3
MOST = 3
FAR, INTERVAL = 6.0, 1.96
"""Stated standard deviations."""


def drawn(generator: np.random.Generator, most: int = MOST) -> list[ff.Press]:
    """One to so many cylinders."""
    count = int(generator.integers(1, most + 1))
    while True:
        places = np.sort(generator.uniform(-OUTERMOST, OUTERMOST, count))
        if (np.diff(places) > APART).all():
            break
    return [
        ff.Press(
            x=float(x),
            normal=(force := float(np.exp(generator.uniform(*np.log(FORCES))))),
            tangential=float(generator.uniform(-USED, USED)) * FRICTION * force,
            radius=float(np.exp(generator.uniform(*np.log(RADII)))),
            friction=FRICTION,
        )
        for x in places
    ]


def main(frames: int = FRAMES, seed: int = SEED) -> None:
    """Read frames of cylinders, and print how well."""
    drawing = ff.load_sensor("skin").replace(**{"transducer.edges": "roller"})
    reader = ff.Reader(model := ff.characterize(drawing))
    reader.prepare()
    found, seconds, verdicts, single = list[Any](), list[float](), Counter[str](), list[Any]()
    for number in range(frames):
        generator = np.random.default_rng([seed, number])
        presses = drawn(generator)
        frame = model.expose(presses, rng=generator)
        begin = time.perf_counter()
        reading = reader.search(frame)
        seconds.append(time.perf_counter() - begin)
        verdicts[reading.status.name] += 1
        if not reading.ok or reading.total is None:
            continue
        # shear moves the centre of pressure beside the axis of a cylinder
        parts = [tractions(drawing, press) for press in presses]
        places = np.concatenate([part.places for part in parts])
        force = np.concatenate([part.forces for part in parts])
        place = force[:, 0] @ places / force[:, 0].sum()
        total = reading.total
        error = np.array([*total.force, total.centre[0]]) - [*force.sum(axis=0), place]
        found.append((error, error / total.std[[0, 1, 5]]))
        if len(reading.contacts) == len(presses):
            felt = sorted(reading.contacts, key=lambda one: one.centre[0])
            for one, press in zip(felt, presses, strict=True):
                off = one.force - [press.normal, press.tangential]
                single.append((off[0], off[0] / one.std[0], off[1] / one.std[1]))
        if sys.stderr.isatty():
            print(f"\r{number + 1} of {frames}", end="", file=sys.stderr)
    errors, deviations = (np.array(part) for part in zip(*found, strict=True))
    wrong = (np.abs(deviations) > FAR).any(axis=1)
    print(f"frames {frames}, " + ", ".join(f"{k} {n}" for k, n in sorted(verdicts.items())))
    print(f"wrong OK {wrong.sum()}; contacts counted right {_counted(single, found)}")
    names = ("total N [N]", "total T [N]", "centre [mm]")
    print(f"{'':14s}{'median error':>14s}{'95 %':>10s}{'inside':>9s}{'rms of deviations':>20s}")
    for name, error, own in zip(names, (errors * [1, 1, 1e3]).T, deviations.T, strict=True):
        off = np.abs(error)
        print(
            f"{name:14s}{np.median(off):14.4f}{np.quantile(off, 0.95):10.4f}"
            f"{np.mean(np.abs(own) < INTERVAL):9.1%}{np.sqrt(np.mean(own**2)):20.2f}"
        )
    each = np.abs(np.array(single))
    print(
        f"single contacts: N off by {np.median(each[:, 0]):.4f} N in the median, "
        f"{np.quantile(each[:, 0], 0.99):.3f} N in 99 of 100; inside 95 %: N "
        f"{np.mean(each[:, 1] < INTERVAL):.1%}, T {np.mean(each[:, 2] < INTERVAL):.1%}"
    )
    print(
        f"cold read {np.median(seconds) * 1e3:.0f} ms in the median, "
        f"{np.quantile(seconds, 0.9) * 1e3:.0f} ms in nine of ten"
    )


def _counted(single: list[Any], found: list[Any]) -> str:
    return f"in frames with {len(single)} contacts of {len(found)} frames"


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
