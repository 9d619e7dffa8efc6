"""What a live run compiles or loads, it compiles or loads before its camera starts."""

import subprocess
import sys

import numba
import pytest

from fringeforce.cli.progress import compiling

TOUCH = """
import gc, sys
import numpy as np
from numba.core.dispatcher import Dispatcher
import fringeforce as ff
from fringeforce.acquisition.cameras.camera import Block


def loops():
    found = (loop for loop in gc.get_objects() if isinstance(loop, Dispatcher))
    own = (loop for loop in found if loop.py_func.__module__.startswith("fringeforce."))
    return {(one.py_func.__module__, one.py_func.__name__): len(one.overloads) for one in own}


class Camera:
    name, patient = "a camera that waits for nobody", False

    def __init__(self, frames):
        self.frames = frames

    def __enter__(self):
        self.ready = loops()
        return self

    def __exit__(self, *_):
        pass

    def __iter__(self):
        for first in range(len(self.frames)):
            yield Block(self.frames[[first]], np.zeros(1), 0, first)

    def close(self):
        pass


model = ff.characterize(ff.load_sensor(sys.argv[1]))
if sys.argv[2:]:
    model = model.with_tolerances(**{sys.argv[2]: sys.argv[3]})
load = np.zeros((model.sensor.tactels.total, 2))
load[4] = 1.0, 0.1


def touched(share):
    return [ff.Press(x=1e-3, normal=share, tangential=0.1 * share, width=1e-3)] if share else []


# untouched, touched, moved, hardly touched, let go, pressed hard, pressed beyond all fringes
shares = 0, 0, 1, 1.01, 0.02, 0, 8, 300
if model.sensor.skin is None:
    frames = model.expose([share * load for share in shares], rng=1)
else:  # by contacts, and by a line, which is none
    lines = model.expose([share * load for share in (1, 300)], rng=1)
    frames = np.concatenate([model.expose([touched(share) for share in shares[:-1]], rng=1), lines])
camera = Camera(frames)
statistics = ff.live(ff.Reader(model), camera, [ff.open_sink("csv:touch.csv", model)], queue=64)
late = sorted(name for name, k in loops().items() if k != camera.ready.get(name, 0))
print(statistics.lines, statistics.dropped_queue, statistics.statuses, late)
assert len(camera.ready) > 50
assert (statistics.lines, statistics.dropped_queue, late) == (len(frames), 0, [])
departs = {"MODEL_MISMATCH"} if model.sensor.skin else set()
assert statistics.statuses.keys() == {"NO_CONTACT", "OK", "FRINGES_TOO_DENSE"} | departs
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "design", [("saad",), ("saad", "polariscope.residual", "0 +/- 0.1 rad"), ("skin",)]
)
def test_no_loop_is_compiled_while_the_camera_runs(
    tmp_path_factory: pytest.TempPathFactory, design: tuple[str, ...]
) -> None:
    # in a process of its own: this one may have compiled anything
    run = subprocess.run(
        [sys.executable, "-c", TOUCH, *design],
        cwd=tmp_path_factory.mktemp("live"), capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout + run.stderr


def test_compilation_is_told_once_and_only_where_it_happens(
    capsys: pytest.CaptureFixture[str],
) -> None:
    squared = numba.njit(lambda x: x * x)
    cubed = numba.njit(lambda x: x * x * x)
    with compiling():
        assert squared(2.0) == 4.0
        assert cubed(2.0) == 8.0
    assert capsys.readouterr().err.count("Compiling") == 1
    with compiling():
        assert squared(3.0) == 9.0
    assert capsys.readouterr().err == ""
