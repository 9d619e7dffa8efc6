"""Run benchmarks and keep what they print, with when and on what, where the documentation shows it.

    python benchmarks/record.py characterize "rivals 30" ...

Each argument is a script of this folder and what it is given; without any, all run as they are.
The tables go to docs/measured/NAME.txt and are printed as well.  Loads of other programs are not
known to the record, so it says how busy the machine was before each run.
"""

from __future__ import annotations

import os
import platform
import shlex
import subprocess
import sys
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

HERE = Path(__file__).parent
MEASURED = HERE.parent / "docs" / "measured"
LIBRARIES = ("fringeforce", "numpy", "scipy", "numba", "scikit-fem", "ngsolve")
WIDTH = 116


def all_scripts() -> list[str]:
    """Every benchmark by its name."""
    return sorted(path.stem for path in HERE.glob("*.py") if path != Path(__file__))


def processor() -> str:
    """What the processor calls itself."""
    info = Path("/proc/cpuinfo")
    names = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    found = (line.partition(":")[2].strip() for line in names if line.startswith("model name"))
    return next(found, platform.processor() or platform.machine())


def heading(command: str) -> str:
    """Date, machine and versions, in lines."""
    found = []
    for name in LIBRARIES:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    lines = [
        f"benchmarks/{command}",
        f"{datetime.now(UTC):%Y-%m-%d}; {processor()}, {os.cpu_count()} cores, load before {load}",
        f"Python {platform.python_version()}; {', '.join(found)}",
    ]
    return "\n".join(lines)


def record(command: str) -> None:
    """Run one benchmark; nothing is kept of one that fails."""
    name, *arguments = shlex.split(command)
    script = HERE / f"{name}.py"
    if name not in all_scripts():
        sys.exit(f"There is no benchmark {name!r}; there are {', '.join(all_scripts())}.")
    head = heading(" ".join([script.name, *arguments]))
    environment = {**os.environ, "COLUMNS": str(WIDTH), "OPENBLAS_NUM_THREADS": "1"}
    run = subprocess.run(
        [sys.executable, script, *arguments],
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
        check=False,
    )
    if run.returncode:
        sys.exit(f"{script.name} ended with status {run.returncode}; nothing was recorded.")
    table = "\n".join(line.rstrip() for line in run.stdout.strip("\n").splitlines())
    MEASURED.mkdir(parents=True, exist_ok=True)
    text = f"{head}\n\n{table}\n"
    (MEASURED / f"{name}.txt").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    for each in sys.argv[1:] or all_scripts():
        record(each)
