"""What workers would otherwise do one beside the other: compile the loops, and look at types.

`python tests/prepared.py strips` compiles what reads strips, into the cache that all share; another
one waits for the first, and finds all done.  `types` runs pyright and keeps what it says in a file,
where the test of that name finds it.
"""

import fcntl
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
TYPES = "FRINGEFORCE_TESTS_TYPES"
"""Variable with the name of the file, for workers, if pyright has been started."""


class Said(NamedTuple):
    """How a program ended, and what it said."""

    returncode: int
    output: str


def begin(*words: str | Path) -> subprocess.Popen[bytes]:
    """One of the commands below, in a process of its own."""
    return subprocess.Popen([sys.executable, __file__, *words])


def types() -> Said:
    """What pyright says of the whole tree: of the run that goes on already, or of one now."""
    name = os.environ.get(TYPES)
    if name is None:
        return _types()
    while not Path(name).exists():
        time.sleep(0.1)
    return Said(**json.loads(Path(name).read_text(encoding="utf-8")))


def _types() -> Said:
    run = subprocess.run(
        [Path(sys.executable).parent / "pyright", "--pythonpath", sys.executable],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    return Said(run.returncode, run.stdout + run.stderr)


def _keep_types(name: str) -> None:
    part = Path(name + ".part")
    part.write_text(json.dumps(_types()._asdict()), encoding="utf-8")
    part.replace(name)


def _strips() -> None:
    import fringeforce as ff

    with open(__file__, "rb") as alone:
        fcntl.flock(alone, fcntl.LOCK_EX)
        model = ff.characterize(ff.load_sensor("saad"))
        reader = ff.Reader(model)
        for _ in range(2):  # a search, and a step from its solution
            reader.read(model.expose(ff.polar(1.0, angle=10, n=11)))


def _pads() -> None:
    import numpy as np

    import fringeforce as ff
    from fringeforce.models.pad import characterize_pad

    few = {"tactels.count": [5, 4], "tactels.pitch": "3 mm", "camera.pixels": [96, 80]}
    model = characterize_pad(ff.load_sensor("pad").replace(**few), samples=48, slices=6)
    forces = np.zeros((20, 3))
    forces[7] = 1.0, 0.1, 0.0
    reader = ff.Reader(model)
    for _ in range(2):
        reader.read(model.expose(forces))


if __name__ == "__main__":
    {"strips": _strips, "pads": _pads, "types": _keep_types}[sys.argv[1]](*sys.argv[2:])
