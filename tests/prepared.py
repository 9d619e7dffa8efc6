"""What workers would otherwise do one beside the other: compile the loops.

`python tests/prepared.py strips` compiles what reads strips, into the cache that all share; another
one waits for the first, and finds all done.  `others` compiles what reads pads, writes tables and
calibrates, in half that time.
"""

import fcntl
import subprocess
import sys


def begin(what: str) -> subprocess.Popen[bytes]:
    """One of the commands below, in a process of its own."""
    return subprocess.Popen([sys.executable, __file__, what])


def _strips() -> None:
    import fringeforce as ff

    strip = ff.load_sensor("saad")
    uneven = {"tactels.placement": "0 +/- 0.05 mm", "tactels.contact_width": "0.4 +/- 0.1 mm"}
    forces, touch = ff.polar(1.0, angle=10, n=11), [ff.Press(x=1e-3, normal=1.0, width=1e-3)]
    with open(__file__, "rb") as alone:
        fcntl.flock(alone, fcntl.LOCK_EX)
        model = ff.characterize(strip)
        reader = ff.Reader(model)
        for _ in range(2):  # a search, and a step from its solution
            reader.read(model.expose(forces))
        for design, load in ((strip.replace(**uneven), forces), (ff.load_sensor("skin"), touch)):
            model = ff.characterize(design)
            ff.Reader(model).read(model.expose(load))


def _others() -> None:
    import numpy as np

    import fringeforce as ff
    from fringeforce.acquisition.sinks import csv_rows
    from fringeforce.models.pad import characterize_pad

    few = {"tactels.count": [5, 4], "tactels.pitch": "3 mm", "camera.pixels": [96, 80]}
    pad = characterize_pad(ff.load_sensor("pad").replace(**few), samples=48, slices=6)
    forces = np.zeros((20, 3))
    forces[7] = 1.0, 0.1, 0.0
    tip = ff.characterize(ff.load_sensor("fingertip"))
    ball = [ff.Press(x=0.8e-3, y=-0.5e-3, normal=0.5, radius=5e-3)]
    for model, load in ((pad, forces), (tip, ball)):
        reader = ff.Reader(model)
        for _ in range(2):
            reader.read(model.expose(load))
    csv_rows.prepare()
    # last, for most of what this needs the other process has kept by now
    strip = ff.load_sensor("saad").replace(**{"camera.pixels": 256})
    presses = 2.0 * np.eye(22)[:8].reshape(8, 11, 2)
    coefficient = "transducer.photoelastic.strain_optic_coefficient"
    ff.calibrate(strip, ff.characterize(strip).expose(presses), presses, [coefficient])


if __name__ == "__main__":
    {"strips": _strips, "others": _others}[sys.argv[1]]()
