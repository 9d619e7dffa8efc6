"""What workers would otherwise do one beside the other: compile the loops.

`python tests/prepared.py strips` compiles what reads strips, into the cache that all share; another
one waits for the first, and finds all done.  `others` compiles what reads pads, writes tables,
follows frames and calibrates, in about the same time.
"""

import fcntl
import gc
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any


def begin(what: str) -> subprocess.Popen[bytes]:
    """One of the commands below, in a process of its own."""
    return subprocess.Popen([sys.executable, __file__, what])


@contextmanager
def _alone(module: ModuleType) -> Iterator[None]:
    """Let nobody else compile the loops of a module meanwhile, but wait for them."""
    assert module.__file__ is not None
    with open(module.__file__, "rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _strips() -> None:
    import fringeforce as ff
    from fringeforce.estimation import followed_frames, linearised_frame

    strip = ff.load_sensor("saad")
    forces, touch = ff.polar(1.0, angle=10, n=11), [ff.Press(x=1e-3, normal=1.0, width=1e-3)]
    with open(__file__, "rb") as alone:
        fcntl.flock(alone, fcntl.LOCK_EX)
        model = ff.characterize(strip)
        with _alone(linearised_frame):  # first, for the other process goes on from it
            _known(model, forces)
        reader = ff.Reader(model)
        reader.read(model.expose(forces))
        skin = ff.characterize(ff.load_sensor("skin"))
        ff.Reader(skin).read(skin.expose(touch))
        with _alone(followed_frames):  # the other process has probably compiled them
            reader.read(model.expose(forces))


def _others() -> None:
    import numpy as np

    import fringeforce as ff
    from fringeforce.acquisition.sinks import csv_rows
    from fringeforce.estimation import followed_frames, linearised_frame
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
    strip, all_pressed = ff.load_sensor("saad"), ff.polar(1.0, angle=10, n=11)
    model = ff.characterize(strip)
    with _alone(linearised_frame):
        _known(model, all_pressed)
    small = strip.replace(**{"camera.pixels": 256})
    presses = 2.0 * np.eye(22)[:8].reshape(8, 11, 2)
    coefficient = "transducer.photoelastic.strain_optic_coefficient"
    ff.calibrate(small, ff.characterize(small).expose(presses), presses, [coefficient])
    with _alone(followed_frames):
        _followed(model, all_pressed)
    uneven = {"tactels.placement": "0 +/- 0.05 mm", "tactels.contact_width": "0.4 +/- 0.1 mm"}
    model = ff.characterize(strip.replace(**uneven))
    ff.Reader(model).read(model.expose(all_pressed))


def _known(model: Any, forces: Any) -> tuple[Any, Any, Any]:
    """The reader of single frames of a strip, the posterior of one, and its top: loads as known."""
    import numpy as np

    from fringeforce.estimation.posterior import Top
    from fringeforce.reading.strip_reader import StripFrameReader

    reader = StripFrameReader(model)
    posterior = reader.posterior(model.expose(forces).ravel().astype(float), 1.0)
    top = Top(np.zeros(posterior.model.at.size), 0.0, 0.0, 0.0)
    top.unknowns[: forces.size] = forces.ravel()
    posterior.linearised(top)
    return reader, posterior, top


def _followed(model: Any, forces: Any) -> None:
    """A step from known loads, without the search that the other process compiles."""
    import numpy as np

    from fringeforce.estimation.information_filter import InformationFilter
    from fringeforce.reading.strip_following import Followed

    reader, posterior, top = _known(model, forces)
    used = np.ones(len(posterior.frame), dtype=bool)
    begun = InformationFilter(
        posterior.model, posterior.prior, reader.uncertain.lasting, used, 0.0, reader.mirrored,
        top.unknowns.copy(),
    )  # fmt: skip
    about = posterior.linearised(top)
    begun.begin(about, np.linalg.inv(about.hessian + about.cone))
    room, frames = Followed.of(1, forces.size, True), posterior.frame[None].astype(np.float32)
    begun.follow(frames, room.loads, room.std, room.covariances, room.squares)


if __name__ == "__main__":
    # what a compiler makes lasts: looking through it again and again took a seventh of the time
    gc.set_threshold(100_000, 50, 100)
    {"strips": _strips, "others": _others}[sys.argv[1]]()
