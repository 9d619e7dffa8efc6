"""Time to take a line from pictures of usual sizes, and to find a strip in them."""

from __future__ import annotations

import time

import numpy as np
from rich.console import Console
from rich.table import Table

import fringeforce as ff

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
    Console().print(table)


if __name__ == "__main__":
    main()
