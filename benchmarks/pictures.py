"""Time to take lines and images from pictures of usual sizes, to find a strip, and to read live."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import fringeforce as ff
from fringeforce.acquisition.cameras.area import AreaCamera
from fringeforce.acquisition.cameras.camera import Settings
from fringeforce.acquisition.cameras.replay import ReplayCamera
from fringeforce.pictures.imaging import ImageSampler

SIZES = {"VGA": (640, 480), "5 megapixels": (2448, 2048), "12 megapixels": (4096, 3000)}
REPEATS = 20


def seconds(work, repeats: int = REPEATS) -> float:
    """Median time of one call."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def main() -> None:
    table = Table("picture", "bits", "pixels", "find [ms]", "prepare [ms]", "line [ms]")
    rng = np.random.default_rng(0)
    for name, (columns, rows) in SIZES.items():
        half = np.array([[-0.45, -0.036], [0.45, -0.036], [0.45, 0.036], [-0.45, 0.036]]) * columns
        turn = np.radians(4.0)
        axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        corners = half @ axes + np.array([columns, rows]) / 2
        for bits, dtype in ((8, np.uint8), (12, np.uint16)):
            region = ff.Region(
                tuple((float(c), float(r)) for c, r in corners), (columns, rows), bits
            )
            row, column = np.mgrid[:rows, :columns]
            along, across = np.moveaxis(region.places(np.stack([column, row], -1)), -1, 0)
            inside = (abs(along - 0.5) < 0.5) & (abs(across - 0.5) < 0.5)
            light = np.where(inside, 0.6, 0.05) + rng.normal(0, 0.01, inside.shape)
            picture = (light * (2**bits - 1)).clip(0).astype(dtype)
            pixels = int(region.length)
            start = time.perf_counter()
            sampler = ff.Sampler(region, pixels)
            sampler.line(picture)
            prepared = time.perf_counter() - start
            found = seconds(lambda shot=picture, b=bits: ff.find_region([shot], b), 3)
            line = seconds(lambda shot=picture, take=sampler: take.line(shot))
            ms = (f"{1e3 * value:.3g}" for value in (found, prepared, line))
            table.add_row(f"{name}, {columns} x {rows}", str(bits), str(pixels), *ms)
    Console().print(table, images(), live())


def images() -> Table:
    """Images of a pad that nearly fills a picture."""
    table = Table("picture of a pad", "camera", "image", "prepare [ms]", "image [ms]")
    for name, (columns, rows) in SIZES.items():
        side, left = 0.9 * rows, (columns - 0.9 * rows) / 2
        corners = [
            (left, 20.0),
            (left + side, 25.0),
            (left + side - 6, 15 + side),
            (left + 4, side),
        ]
        region = ff.Region(corners, (columns, rows))
        picture = np.random.default_rng(0).integers(0, 256, (rows, columns), dtype=np.uint8)
        for camera in ("ordinary", "polarisation"):
            sampler = ImageSampler(region, (256, 256), analysers=camera == "polarisation")
            start = time.perf_counter()
            sampler.line(picture)
            prepared = time.perf_counter() - start
            taken = seconds(lambda shot=picture, take=sampler: take.line(shot))
            ms = (f"{1e3 * value:.3g}" for value in (prepared, taken))
            table.add_row(f"{name}, {columns} x {rows}", camera, "256 x 256", *ms)
    return table


def live() -> Table:
    """Pictures of a webcam's size and rate, to lines and to readings, one by one."""
    columns, rows, rate, count = 640, 480, 30.0, 150
    table = Table("live", "pictures/s sent", "read", "dropped", "latency, median [ms]")
    region = ff.Region([(20, 200), (619, 204), (619, 244), (20, 240)], (columns, rows))
    sensor = ff.load_sensor("saad").replace(**{"camera.pixels": 560})
    model = ff.characterize(sensor)
    lines = model.expose(ff.polar(np.full((count, 11), 0.4), angle=5), rng=0)
    row, column = np.mgrid[:rows, :columns]
    along, across = np.moveaxis(region.places(np.stack([column, row], -1)), -1, 0)
    inside = (abs(along - 0.5) < 0.5) & (abs(across - 0.5) < 0.5)
    place = (np.arange(560) + 0.5) / 560
    shots = [np.where(inside, np.interp(along, place, line), 5) for line in lines]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shots.npy"
        np.save(path, np.rint(shots).astype(np.uint8))
        recorded = np.load(path)
        times = np.arange(count) / rate
        camera = ReplayCamera(path, Settings(block=1), dimensions=2, found=(recorded, times))
        reader = ff.Reader(model)
        reader.prepare()
        done = ff.live(reader, AreaCamera(camera, sensor, region))
    dropped = done.dropped_camera + done.dropped_queue
    table.add_row(
        f"{columns} x {rows}",
        f"{rate:g}",
        str(done.lines),
        str(dropped),
        f"{1e3 * done.latency[50]:.3g}",
    )
    return table


if __name__ == "__main__":
    main()
