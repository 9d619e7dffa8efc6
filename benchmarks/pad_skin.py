"""What the skin of a pad makes of bodies that press on it anywhere.

    python benchmarks/pad_skin.py [frames] [followed] [seed]

Spheres of 3 to 10 mm, flat round punches of 1.5 to 5 mm, edges (rounded with 0.5 to 2 mm, 2 to 6 mm
long, at any angle), and two or three spheres at least 5 mm apart, in turn, press with 0.5 to 8 N on
the shipped pad, anywhere, and use up to 0.9 of a friction of 0.6.  Pressure and shear come from
contact mechanics on the layers, on grids of 97 x 97 places; the light of these from the exact
series through 64 slices.  The reader knows of ellipses with smooth pressures and of 32 slices, and
nothing of bodies.  The pixels have a uniform noise of 5 grey levels.

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
from fringeforce.contacts.elastic_contact import body_forces
from fringeforce.contacts.press import Tractions
from fringeforce.design.pad import Pad
from fringeforce.models import pad_presses
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_presses import grid_of, press_slices, surface_of
from fringeforce.optics import camera

FRAMES, FOLLOWED, SEED = 200, 40, 0
KINDS = ("sphere", "punch", "edge", "two", "three")
FORCES, RADII = (0.5, 8.0), (3e-3, 10e-3)
PUNCHES, EDGES, LENGTHS = (0.75e-3, 2.5e-3), (0.5e-3, 2e-3), (2e-3, 6e-3)
FRICTION, USED = 0.6, 0.9
OUTERMOST, APART = 7e-3, 5e-3
HALF = 48
SLICES = 64
FAR, INTERVAL = 6.0, 1.96
"""Stated standard deviations."""


def body(pad: Pad, kind: str, place: np.ndarray, generator: np.random.Generator) -> Tractions:
    """Tractions of one body."""

    def between(ends: tuple[float, float]) -> float:
        return float(np.exp(generator.uniform(*np.log(ends))))

    normal, turn = between(FORCES), generator.uniform(0, 2 * np.pi)
    size = generator.uniform(0, USED) * FRICTION * normal
    shear = (float(size * np.cos(turn)), float(size * np.sin(turn)))
    if kind == "punch":
        radius = between(PUNCHES)
        surface = surface_of(pad, radius / (HALF - 6), HALF)
        x, y = grid_of(surface)
        gap = np.where(np.hypot(x, y) < radius, 0.0, np.inf)
    elif kind == "edge":
        radius, length, angle = between(EDGES), between(LENGTHS), generator.uniform(0, np.pi)
        surface = surface_of(pad, length / 2 / (HALF - 6), HALF)
        x, y = grid_of(surface)
        along = x * np.cos(angle) + y * np.sin(angle)
        across = y * np.cos(angle) - x * np.sin(angle)
        gap = np.where(np.abs(along) < length / 2, across**2 / (2 * radius), np.inf)
    else:
        radius = between(RADII)
        # Hertz on the cover alone, which touches more
        cover = pad.transducer.compliant
        modulus = cover.youngs_modulus / (1 - cover.poissons_ratio**2)
        half = np.cbrt(3 * normal * radius / (4 * modulus))
        surface = surface_of(pad, half / (HALF - 2), HALF)
        x, y = grid_of(surface)
        gap = (x**2 + y**2) / (2 * radius)
    forces = body_forces(surface, gap, normal, shear, FRICTION)
    touched = forces[..., 0] > 0
    places = np.column_stack([x[touched], y[touched]]) + place
    return Tractions(places, forces[touched])


def drawn(pad: Pad, kind: str, generator: np.random.Generator) -> list[Tractions]:
    """The bodies of one frame."""
    count = {"two": 2, "three": 3}.get(kind, 1)
    while True:
        places = generator.uniform(-OUTERMOST, OUTERMOST, (count, 2))
        apart = np.linalg.norm(places[:, None] - places, axis=2) + np.eye(count)
        if (apart[~np.eye(count, dtype=bool)] > APART).all():
            return [body(pad, kind, place, generator) for place in places]


def exposed(model: PadModel, loads: list[Tractions], generator: np.random.Generator) -> np.ndarray:
    """A frame of tractions."""
    slices = press_slices(model.sensor, loads, *model.pixel_positions)
    light = model.seen(slices).reshape(model.frame_shape)
    return camera.expose(model.sensor.camera, light, generator, frame_axes=2)


def main(frames: int = FRAMES, followed: int = FOLLOWED, seed: int = SEED) -> None:
    """Read frames of bodies, and print how well."""
    pad_presses.SLICES = SLICES
    model = ff.characterize(ff.load_sensor("pad-skin"))
    assert isinstance(model, PadModel)
    reader = ff.Reader(model)
    reader.prepare()
    found, seconds, verdicts = list[Any](), list[float](), Counter[str]()
    counted, asked, kinds = 0, 0, Counter[str]()
    for number in range(frames):
        generator, kind = np.random.default_rng([seed, number]), KINDS[number % len(KINDS)]
        loads = drawn(model.sensor, kind, generator)
        frame = exposed(model, loads, generator)
        begin = time.process_time()
        reading = reader.search(frame)
        seconds.append(time.process_time() - begin)
        verdicts[reading.status.name] += 1
        if not reading.ok or reading.total is None:
            kinds[kind] += 1
            continue
        places = np.concatenate([part.places for part in loads])
        force = np.concatenate([part.forces for part in loads])
        centre = force[:, 0] @ places / force[:, 0].sum()
        total = reading.total
        error = np.concatenate([total.force - force.sum(axis=0), total.centre - centre])
        found.append((error, error / total.std[[0, 1, 2, 6, 7]], force[:, 0].sum(), kind))
        if kind != "edge":
            asked += 1
            counted += len(reading.contacts) == len(loads)
        if sys.stderr.isatty():
            print(f"\r{number + 1} of {frames}", end="", file=sys.stderr)
    errors, deviations, normal = (np.array(part) for part in list(zip(*found, strict=True))[:3])
    wrong = (np.abs(deviations) > FAR).any(axis=1)
    print(f"frames {frames}, " + ", ".join(f"{k} {n}" for k, n in sorted(verdicts.items())))
    print("not OK by kind: " + (", ".join(f"{k} {n}" for k, n in sorted(kinds.items())) or "none"))
    print(f"wrong OK {wrong.sum()}; contacts counted right in {counted} of {asked} without edges")
    print(f"{'':14s}{'median error':>14s}{'95 %':>10s}{'inside':>9s}{'rms of deviations':>20s}")
    rows = (
        ("total N [%]", 100 * errors[:, :1] / normal[:, None], deviations[:, :1]),
        ("total T [% N]", 100 * errors[:, 1:3] / normal[:, None], deviations[:, 1:3]),
        ("centre [um]", 1e6 * errors[:, 3:], deviations[:, 3:]),
    )
    for name, error, own in rows:
        off = np.linalg.norm(error, axis=1)
        print(
            f"{name:14s}{np.median(off):14.3f}{np.quantile(off, 0.95):10.3f}"
            f"{np.mean(np.abs(own) < INTERVAL):9.1%}{np.sqrt(np.mean(own**2)):20.2f}"
        )
    print(
        f"cold read {np.median(seconds):.2f} s of one core in the median, "
        f"{np.quantile(seconds, 0.9):.2f} s in nine of ten"
    )
    _follow(model, reader, followed, seed)


def _follow(model: PadModel, reader: ff.Reader, frames: int, seed: int) -> None:
    """Print how fast a sphere that moves is followed."""
    generator, images = np.random.default_rng([seed, FRAMES]), []
    for t in np.linspace(0, 1, frames):
        ball = ff.Press(
            x=-1e-3 + 1e-3 * t,
            y=0.5e-3 * np.sin(6 * t),
            normal=2 + 2 * t,
            tangential=(0.4 * np.sin(4 * t), 0.3),
            radius=6e-3,
        )
        images.append(model.expose([ball], rng=generator))
    reader.reset()
    reader.read(images[0])
    begin, tracked = time.process_time(), 0
    for image in images[1:]:
        tracked += reader.read(image).tracked
    rate = (frames - 1) / (time.process_time() - begin)
    print(f"followed: {tracked} of {frames - 1} images, {rate:.1f} a second of one core")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
