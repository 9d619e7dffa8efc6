"""What workers would otherwise do one beside the other: compile the loops.

`python tests/prepared.py strips` compiles what reads strips, into the cache that all share; another
one waits for the first, and finds all done.
"""

import fcntl
import subprocess
import sys


def begin(what: str) -> subprocess.Popen[bytes]:
    """One of the commands below, in a process of its own."""
    return subprocess.Popen([sys.executable, __file__, what])


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
    {"strips": _strips, "pads": _pads}[sys.argv[1]]()
