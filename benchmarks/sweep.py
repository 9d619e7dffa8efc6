"""A thousand designs: a plain loop in this process, then pools of one and two processes.

The loop evaluates a part of the designs and is scaled up.  Ratios are of one run on one machine;
processor time tells what remains when other programs share the cores.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.table import Table

from fringeforce.studies.evaluation import evaluate
from fringeforce.studies.execution import Inline, executor
from fringeforce.studies.sampling import designs
from fringeforce.studies.study_file import load_study
from fringeforce.studies.sweep import prepared, run_sweep

STUDY = Path(__file__).parents[1] / "examples" / "studies" / "thin-or-soft.toml"
LOOP = 60


def processor_seconds() -> float:
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def main(count: int) -> None:
    study, sensor = load_study(STUDY)
    sampling = study.sampling.model_copy(update={"designs": count})
    study = study.model_copy(update={"sampling": sampling})
    axes, setting, seed = prepared(study, sensor)
    candidates = designs(sampling, axes, seed)[:LOOP]
    loop = 0.0
    for order in (7, study.mesh_order):
        one = replace(setting, mesh_order=order)
        evaluate(one, candidates[0])
        start = time.perf_counter()
        for changes in candidates:
            evaluate(one, changes)
        each = (time.perf_counter() - start) / len(candidates)
        print(f"plain loop, elements of order {order}: {each * 1e3:.0f} ms a design")
        loop = each * count
    table = Table(title=f"{count} designs")
    for column in ("how", "wall", "against the loop", "processor", "designs a second"):
        table.add_column(column, justify="left" if column == "how" else "right")
    table.add_row("plain loop, no file", f"{loop:.0f} s", "1.00", "", f"{count / loop:.1f}")
    for workers in (1, 2):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "results.h5"
            before, start = processor_seconds(), time.perf_counter()
            with executor(workers=workers) as pool:
                run_sweep(study, sensor, path, pool)
            wall = time.perf_counter() - start
            used = processor_seconds() - before
            start = time.perf_counter()
            run_sweep(study, sensor, path, Inline())
            again = time.perf_counter() - start
        table.add_row(
            f"processes: {workers}", f"{wall:.0f} s", f"{wall / loop:.2f}", f"{used:.0f} s",
            f"{count / wall:.1f}",
        )  # fmt: skip
        print(f"the same again, all known: {again:.2f} s")
    Console(width=100).print(table)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
