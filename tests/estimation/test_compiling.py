"""Functions that are compiled apart do what Python does, in every process that loads them."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

CALLEE = """
from typing import NamedTuple

import numpy as np

from fringeforce.estimation.compiling import apart


class Inner(NamedTuple):
    bright: bool
    row: np.ndarray


class Outer(NamedTuple):
    scale: float
    inner: Inner
    count: int


@apart
def weighted(outer, shift, line):
    total = 0.0
    for k in range(outer.count):
        total += outer.scale * outer.inner.row[k] * line[k]
        line[k] += shift
    if not outer.inner.bright:
        return -total
    return total {change}
"""

CALLER = """
import json

import numpy as np

from callee import Inner, Outer, weighted
from fringeforce.estimation.compiling import entry, inner


@entry
def once(outer, line):
    return weighted(outer, 0.5, line)


@inner
def between(outer, line):
    return weighted(outer, 1.0, line) + 3.0


@entry
def twice(outer, line):
    return between(outer, line) - weighted(outer, 0.0, line)


def plainly(bright):
    '''The same sums by NumPy.'''
    row, line = np.arange(1.0, 5.0), np.array([2.0, 0.5, -1.0, 4.0])
    sign = 1 if bright else -1
    one = sign * 0.25 * row[:3] @ line[:3]
    other = sign * 0.25 * row[:3] @ (line[:3] + 1)
    return one, one + 3.0 - other


if __name__ == "__main__":
    found = []
    for bright in (True, False):
        outer = Outer(0.25, Inner(bright, np.arange(1.0, 5.0)), 3)
        line = np.array([2.0, 0.5, -1.0, 4.0])
        single = once(outer, line.copy())
        double = twice(outer, line.copy())
        once(outer, line)
        found.append([single, double, line.tolist(), *plainly(bright), bright])
    hits = [sum(f.stats.cache_hits.values()) for f in (once, twice, weighted.loop)]
    print(json.dumps([found, hits]))
"""


def printed(folder: Path, program: str = "caller.py") -> str:
    """What a program prints in a process of its own."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache")}
    done = subprocess.run(
        [sys.executable, program],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def run(folder: Path) -> tuple[list, list[int]]:
    """What the caller finds in a process of its own, and how many functions come from the cache."""
    found, hits = json.loads(printed(folder))
    return found, hits


LATER = """
import numpy as np

from callee import Inner, Outer
from caller import between
from fringeforce.estimation.compiling import entry


@entry
def later(outer, line):
    return between(outer, line)


if __name__ == "__main__":
    outer = Outer(0.25, Inner(True, np.arange(1.0, 5.0)), 3)
    line = np.array([2.0, 0.5, -1.0, 4.0])
    print(later(outer, line), sum(later.stats.cache_hits.values()))
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two modules, of which one calls what the other has compiled apart."""
    (tmp_path / "callee.py").write_text(CALLEE.format(change=""))
    (tmp_path / "caller.py").write_text(CALLER)
    return tmp_path


def check(found: list) -> None:
    """Against NumPy, and what was written into the caller's array."""
    for single, double, line, exact, exact_double, _ in found:
        assert single == pytest.approx(exact, rel=1e-12)
        assert double == pytest.approx(exact_double, rel=1e-12)
        assert line == [2.5, 1.0, -0.5, 4.0]


def test_callers_get_what_numpy_gets_compiled_and_from_the_cache(folder: Path):
    """Records inside records, truth values, arrays that change, callers of callers."""
    found, hits = run(folder)
    check(found)
    assert hits == [0, 0, 0]
    found, hits = run(folder)
    check(found)
    assert all(hits), "nothing came from the cache, so that loading it was not tried"


def test_a_caller_of_what_came_from_the_cache_can_come_from_it_as_well(folder: Path):
    """What it calls was compiled by another process, and jumps to what this one never called."""
    run(folder)
    (folder / "later.py").write_text(LATER)
    first, again = (printed(folder, "later.py").split() for _ in range(2))
    row, line = np.arange(1.0, 5.0), np.array([2.0, 0.5, -1.0, 4.0])
    assert float(first[0]) == float(again[0]) == pytest.approx(0.25 * row[:3] @ line[:3] + 3.0)
    assert first[1] == "0"
    assert again[1] == "1"


def test_a_caller_from_the_cache_jumps_to_what_its_callee_has_become(folder: Path):
    """Its own code stays, and the function that it jumps to is the one of the source."""
    run(folder)
    (folder / "callee.py").write_text(CALLEE.format(change="* 10.0  # longer than before"))
    found, hits = run(folder)
    assert hits[0]
    assert hits[1]
    assert not hits[2]
    for single, _, _, exact, _, bright in found:
        assert single == pytest.approx(10 * exact if bright else exact, rel=1e-12)


SHARED = """
from fringeforce.estimation.compiling import apart, inner, part


@part
def taken_in():
    return {value}


@inner
def taken_in_too():
    return {value}


@apart
def {name}():
    return {value}
"""
USER = """
from fringeforce.estimation.compiling import entry
from own.shared import {name}, taken_in, taken_in_too


@entry
def total():
    return taken_in() + 10.0 * taken_in_too() + 100.0 * {name}()
"""
PROGRAM = "from own.user import total; print(total(), sum(total.stats.cache_hits.values()))"


def test_what_other_modules_of_a_package_gave_a_function_is_compiled_anew_when_they_change(
    tmp_path: Path,
) -> None:
    """As when a checkout is brought up to date; what is called by its name may have another."""
    package = tmp_path / "own"
    package.mkdir()
    (package / "__init__.py").touch()
    (tmp_path / "program.py").write_text(PROGRAM)
    (package / "user.py").write_text(USER.format(name="there"))
    for value, name, wanted in ((1.0, "there", "111.0 0"), (2.0, "there", "222.0 0")):
        (package / "shared.py").write_text(SHARED.format(value=value, name=name))
        assert printed(tmp_path, "program.py").strip() == wanted
    assert printed(tmp_path, "program.py").strip() == "222.0 1"
    (package / "shared.py").write_text(SHARED.format(value=3.0, name="elsewhere"))
    (package / "user.py").write_text(USER.format(name="elsewhere"))
    assert printed(tmp_path, "program.py").strip() == "333.0 0"
