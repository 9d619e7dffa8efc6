"""Damaged files and wrong arrays: each is refused with a clear error or taken rightly.

    python benchmarks/robustness.py [--tries 100] [--seed 0] [--only WORD]

Taken rightly means with the result of the good input that it is equal to, or, where it is equal to
none, with values that are finite and in their ranges.  A failure is any other error, an input that
takes longer than its limit, a message that nobody can read, a wrong result, or what has to be
refused and is taken.  The first failures are named below the table.
"""

from __future__ import annotations

import argparse
import logging
import tempfile
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from damage.arrays import arrays
from damage.counting import LIMIT, Case, Count
from damage.designs import designs
from damage.files import (
    calibration_files,
    frame_files,
    model_files,
    picture_files,
    recordings,
    shards,
    sweep_files,
)
from damage.interrupts import interrupts
from damage.machines import machines
from damage.running import running
from damage.server import servers
from damage.tables import study_files, table_files
from rich.console import Console
from rich.table import Table

import fringeforce as ff

LIMITS = {
    "full disks, kills, nothing writable": 400,
    "arrays to read, expose, calibrate": 100,
    "pickles, forks and threads": 200,
}
"""Seconds for inputs that take longer than others, on a machine that is busy."""


def main() -> None:
    """Try everything and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tries", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="a word of the kinds to try")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    logging.disable()  # of tifffile, on every tag that is wrong
    model = ff.characterize(ff.load_sensor("saad"))
    tries, rng = options.tries, np.random.default_rng(options.seed)
    table = Table("input", "tried", "clear errors", "taken rightly", "failures")
    failures: list[str] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        kinds: dict[str, Callable[[], Iterator[Case]]] = {
            "design files, lines changed": lambda: designs(folder, rng, tries),
            "study files, lines changed": lambda: study_files(folder, rng, tries),
            "tables of loads": lambda: table_files(model.sensor, folder, rng, tries),
            "model files, bits and ends": lambda: model_files(model, folder, rng, tries),
            "calibrations, bits and ends": lambda: calibration_files(model, folder, rng, tries),
            "recordings, bits and ends": lambda: recordings(model, folder, rng, tries),
            "results of sweeps, bits and ends": lambda: sweep_files(folder, rng, tries),
            "frame files, bits and ends": lambda: frame_files(model, folder, rng, tries),
            "photographs, videos, regions": lambda: picture_files(folder, rng, tries),
            "data sets, resumed": lambda: shards(folder, rng, tries // 5),
            "commands, interrupted": lambda: interrupts(model, folder, max(tries // 20, 1)),
            "explorer, forged and endless": servers,
            "full disks, kills, nothing writable": lambda: machines(model, folder),
            "arrays to read, expose, calibrate": lambda: arrays(model),
            "pickles, forks and threads": running,
        }
        for kind, cases in kinds.items():
            if options.only not in kind:
                continue
            count = Count()
            for case in cases():
                count.add(*case, limit=LIMITS.get(kind, LIMIT))
            failed = len(count.failures)
            table.add_row(kind, *map(str, (count.tried, count.refused, count.taken, failed)))
            failures += count.failures
    console = Console()
    console.print(table)
    for failure in failures[:20]:
        console.print(failure, markup=False, highlight=False)


if __name__ == "__main__":
    main()
