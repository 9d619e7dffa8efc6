"""Reading a planar pad: success, efficiency, total force, time, and what the model leaves out.

Contacts: 1 to 5 patches at random, half of them points (one tactel, 0.2 to 4 N), half fingertips
(Hertz's pressure on a disc of 2.5 to 5 mm radius, 2 to 15 N), each with shear of 0 to 0.5 of the
normal force in any direction.  Wrong means status OK with some force off by more than 8 deviations.
Run with a number of contacts; 200 take some ten minutes on a busy machine.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Iterator

import numpy as np
from rich.console import Console
from rich.table import Table

import fringeforce as ff
from fringeforce.acquisition.cameras.camera import Settings
from fringeforce.acquisition.cameras.simulator import SimulatedCamera
from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.contacts.resultant import touch
from fringeforce.design.pad import Pad
from fringeforce.mechanics.solid.block import Patches
from fringeforce.mechanics.solid.fourier import stress_influence
from fringeforce.models.pad import PadModel, characterize_pad
from fringeforce.models.pad_slices import block_of
from fringeforce.optics.integrated import equivalent_retarder
from fringeforce.optics.photoelasticity import stress_optic_constant
from fringeforce.reading.reading import Status

Array = np.ndarray
Rows = Iterator[tuple[str, str]]


def contacts(rng: np.random.Generator, pad: Pad) -> Array:
    """Forces of 1 to 5 random contacts, shape (n, 3) [N]."""
    places, forces = pad.tactels.places, np.zeros((pad.tactels.total, 3))
    for _ in range(rng.integers(1, 6)):
        centre = places[rng.integers(len(places))]
        if rng.random() < 0.5:
            share, size = (places == centre).all(axis=1).astype(float), rng.uniform(0.2, 4)
        else:
            moved = centre + rng.uniform(-0.5, 0.5, 2) * pad.tactels.pitch
            share, size = fingertip(pad, moved, rng.uniform(2.5e-3, 5e-3)), rng.uniform(2, 15)
        angle, ratio = rng.uniform(0, 2 * np.pi), rng.uniform(0, 0.5)
        forces += share[:, None] * size * [1, ratio * np.cos(angle), ratio * np.sin(angle)]
    return forces


def fingertip(pad: Pad, centre: Array, radius: float) -> Array:
    """Share of Hertz's pressure on a disc that falls on each tactel; it adds up to one."""
    inside = (np.arange(9) - 4) / 9 * pad.tactels.pitch
    x, y = (
        pad.tactels.places[:, axis, None, None] + shift - centre[axis]
        for axis, shift in enumerate((inside[:, None], inside))
    )
    pressure = np.sqrt(np.clip(1 - (x**2 + y**2) / radius**2, 0, None)).mean(axis=(1, 2))
    return pressure / pressure.sum()


def cold(model: PadModel, reader: ff.Reader, count: int) -> Rows:
    rng, statuses = np.random.default_rng(2026), Counter()
    seconds, busy, errors, bounds, totals, sure, within, wrong = [], [], [], [], [], [], 0, 0
    for _ in range(count):
        forces = contacts(rng, model.sensor)
        frame = model.expose(forces, rng)
        begun, used = time.perf_counter(), time.process_time()
        reading = reader.search(frame)
        seconds.append(time.perf_counter() - begun)
        busy.append(time.process_time() - used)
        statuses[reading.status.value] += 1
        apart = np.abs(reading.forces - forces) / reading.std
        within += bool(apart.max() < 6)
        wrong += bool(reading.status is Status.OK and apart.max() > 8)
        if reading.status is Status.OK:
            errors.append(reading.forces - forces)
            # the bound is what the true forces would say, which is what readings state
            bounds.append(reader.bound(forces))
            total = touch(model.sensor, reading).total
            off = np.abs(total.force - forces.sum(axis=0))
            totals.append(off / forces[:, 0].sum())
            sure.append(off / np.sqrt(np.diag(total.force_covariance)))
    rms = np.sqrt(np.mean(np.square(errors), axis=(0, 1)) / np.mean(np.square(bounds), axis=(0, 1)))
    share = 100 * np.array(totals)
    yield "contacts read cold", f"{count}"
    yield "statuses", ", ".join(f"{name} {number}" for name, number in statuses.items())
    yield "all 363 forces within 6 deviations", f"{within} of {count}"
    yield "confidently wrong", f"{wrong}"
    yield "rms error over Cramer-Rao bound: N, T_x, T_y", ", ".join(f"{r:.3f}" for r in rms)
    names = "N", "T_x", "T_y"
    for name, column in zip(names, share.T, strict=True):
        yield (
            f"total {name} off, share of total N: median, 95 %, largest",
            f"{np.median(column):.2f} %, {np.quantile(column, 0.95):.2f} %, {column.max():.2f} %",
        )
    normal, bars = share[:, 0], np.array(sure)[:, 0]
    yield (
        "total N off in its own deviations: root mean square, largest",
        f"{np.sqrt(np.mean(bars**2)):.2f}, {bars.max():.2f}",
    )
    yield (
        "total N off by 1 % or less; else by 3 of its deviations or less; else",
        f"{(normal <= 1).sum()}, {((normal > 1) & (bars <= 3)).sum()}, "
        f"{((normal > 1) & (bars > 3)).sum()}",
    )
    for what, values in (("seconds", seconds), ("seconds of processor", busy)):
        yield (
            f"{what} per reading: median, 95 %, largest",
            ", ".join(f"{value:.2f}" for value in np.quantile(values, [0.5, 0.95, 1])),
        )


def dense(model: PadModel, reader: ff.Reader, count: int) -> Rows:
    """The same contacts, scaled to a largest retardance, evenly from 4 to 20 rad."""
    rng, edges = np.random.default_rng(77), [4, 8, 12, 16, 20]
    found = np.zeros((len(edges) - 1, 2), dtype=int)
    for wanted in np.linspace(4, 20, count, endpoint=False):
        forces = contacts(rng, model.sensor)
        forces *= wanted / np.hypot(*model.retardance(forces)).max()
        reading = reader.search(model.expose(forces, rng))
        right = (np.abs(reading.forces - forces) < 6 * reading.std).all()
        found[np.searchsorted(edges, wanted, side="right") - 1] += right, 1
    for low, high, (right, tried) in zip(edges, edges[1:], found, strict=False):
        yield f"read cold, largest retardance {low} to {high} rad", f"{right} of {tried}"


def tracked(model: PadModel, reader: ff.Reader, count: int = 60) -> Rows:
    rng = np.random.default_rng(1)
    pad = model.sensor
    # a fingertip of 8 N that wanders over the pad, twice around in ten seconds at 30 frames/s
    truth = []
    for k in range(count):
        angle = 4 * np.pi * k / 300
        share = fingertip(pad, 4e-3 * np.array([np.cos(angle), np.sin(angle)]), 4e-3)
        truth.append(share[:, None] * 8 * [1, -0.2 * np.sin(angle), 0.2 * np.cos(angle)])
    frames = [model.expose(forces, rng) for forces in truth]
    reader.reset()
    stream = reader.stream(frames)
    next(stream)
    begun, busy = time.perf_counter(), time.process_time()
    readings = list(stream)
    rate = (count - 1) / (time.perf_counter() - begun)
    busy = (count - 1) / (time.process_time() - busy)
    apart = [reading.forces - forces for reading, forces in zip(readings, truth[1:], strict=True)]
    bounds = [reader.bound(forces) for forces in truth[1::10]]
    rms = np.sqrt(np.mean(np.square(apart)) / np.mean(np.square(bounds)))
    followed = sum(reading.tracked for reading in readings)
    yield "tracked: frames per second, per second of processor", f"{rate:.1f}, {busy:.1f}"
    yield "tracked: followed without a search", f"{followed} of {count - 1}"
    yield "tracked: rms error over Cramer-Rao bound", f"{rms:.3f}"


class Errors(Sink):
    """How far live readings are from a simulated touch, in their deviations."""

    name = "errors"

    def __init__(self, camera: SimulatedCamera) -> None:
        self._camera = camera
        self.right = self.wrong = 0

    def write(self, readings: Readings) -> None:
        """Count what is right."""
        truth = self._camera.true_forces(readings.first + np.arange(len(readings)))
        worst = (np.abs(readings.forces - truth) / readings.std).max(axis=(1, 2))
        sure = np.array([status is Status.OK for status in readings.status])
        self.right += int((worst < 6).sum())
        self.wrong += int((sure & (worst > 8)).sum())

    def close(self) -> None:
        """Nothing to finish."""


def live(model: PadModel, reader: ff.Reader, rate: float, seconds: float = 20) -> Rows:
    """A simulated finger, as `fringeforce live` reads it."""
    camera = SimulatedCamera(model, Settings(rate))
    errors = Errors(camera)
    reader.reset()
    reader.prepare()
    used = time.process_time()
    found = ff.live(reader, camera, [errors], seconds=seconds)
    used = time.process_time() - used
    head, times = f"live, {rate:g} images per second", found.latency
    yield f"{head}: read per second", f"{found.lines / found.seconds:.1f}"
    yield f"{head}: of processor for each", f"{1e3 * used / found.lines:.0f} ms"
    late = ", ".join(f"{1e3 * times[q]:.0f} ms" for q in (50, 95, 99))
    yield f"{head}: latency, median, 95 %, 99 %", late
    told = ", ".join(f"{name} {count}" for name, count in found.statuses.items())
    yield f"{head}: dropped, statuses", f"{found.dropped_queue + found.dropped_camera}; {told}"
    yield (
        f"{head}: within 6 deviations; confidently wrong",
        (f"{errors.right} of {found.lines}; {errors.wrong}"),
    )


def accuracy(model: PadModel) -> Rows:
    """What compression leaves out, and how good one slice would be."""
    pad, rng = model.sensor, np.random.default_rng(3)
    forces = contacts(rng, pad)
    pressed = np.flatnonzero(np.abs(forces).sum(axis=1))
    x, y = pad.pixel_positions
    constant = stress_optic_constant(pad.transducer.photoelastic, pad.polariscope.wavelength)
    patches = Patches(pad.tactels.places[pressed], pad.tactels.side)
    found = {}
    for slices in (8, 32):
        solid = stress_influence(block_of(pad), patches, x[::4], y[::4], slices)
        found[slices] = constant * np.stack(
            [
                np.einsum("xysnc,nc,s->syx", stress, forces[pressed], solid.weights)
                for stress in (solid.difference, 2 * solid.shear)
            ],
            axis=1,
        )
    shown = model.slices(forces)[:, :, ::4, ::4].astype(float)
    peak = 2 * np.hypot(*found[32].sum(axis=0)).max()
    error = 2 * np.abs(shown.sum(axis=0) - found[8].sum(axis=0)).max()
    yield "retardance of a random load, largest", f"{peak:.2f} rad"
    yield "error of modes and splines, largest", f"{error:.4f} rad"
    light = {key: optics(stack) for key, stack in found.items()}
    yield (
        "8 slices beside 32, largest error of sin(retardance)",
        (f"{np.abs(light[8] - light[32]).max():.4f}"),
    )
    for scale in (0.125, 0.25, 0.5, 1.0):
        whole = 2 * scale * found[32].sum(axis=0)
        size = np.hypot(*whole)
        single = np.sin(size) * whole / size
        apart = np.abs(single - optics(scale * found[32])).max()
        yield f"one slice, at {scale * peak:.2f} rad", f"{apart:.4f}"


def optics(slices: Array) -> Array:
    from fringeforce.optics.integrated import double_pass

    retarder = equivalent_retarder(double_pass(slices))
    size = np.hypot(*retarder)
    return np.sin(size) * retarder / np.where(size > 0, size, 1)


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    begun = time.perf_counter()
    pad = ff.load_sensor("pad")
    model = characterize_pad(pad)
    ready = time.perf_counter()
    reader = ff.Reader(model)
    for seed in range(2):  # compiles, and computes what belongs to the model
        reader.search(model.expose(contacts(np.random.default_rng(seed), pad), seed))
    table = Table("", "", title="Planar pad, 121 tactels, 256 x 256 pixels, 8 bits, one shot")
    table.add_row("seconds to characterise", f"{ready - begun:.1f}")
    table.add_row("seconds to get ready to read", f"{time.perf_counter() - ready:.1f}")
    for rows in (
        accuracy(model),
        tracked(model, reader),
        live(model, reader, 10),
        live(model, reader, 20),
        cold(model, reader, count),
        dense(model, reader, max(count // 2, 4)),
    ):
        for row in rows:
            table.add_row(*row)
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
