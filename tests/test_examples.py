"""The examples do what they say, and their files are what their makers make."""

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import h5py
import numpy as np
import pytest

from snippets import ROOT, run, run_page

pytestmark = pytest.mark.slow

BENCH = ROOT / "examples" / "bench"
COMMAND = re.compile(r"^fringeforce .*$", re.MULTILINE)


@pytest.fixture(scope="module")
def maker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("bench_maker", BENCH / "make.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_bench_is_what_its_maker_makes(maker: ModuleType, tmp_path: Path) -> None:
    maker.make(tmp_path)
    for name in ("calibration", "check"):
        assert (tmp_path / f"{name}.csv").read_text() == (BENCH / f"{name}.csv").read_text()
        with h5py.File(tmp_path / f"{name}.h5") as made, h5py.File(BENCH / f"{name}.h5") as shipped:
            frames = (np.asarray(file["grey"], dtype=int) for file in (made, shipped))
            # the last digit of the matrix may turn a rounding
            assert np.abs(np.subtract(*frames)).max() <= 1


def test_the_commands_of_the_bench_find_what_is_wrong_with_it(
    maker: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The tutorial has the commands of the bench's page, which draw the readings too."""
    monkeypatch.chdir(tmp_path)
    tutorial = ROOT / "docs" / "tutorials" / "calibrate.md"
    said = run_page(tutorial, tmp_path)
    assert f"Frame {maker.WRONG}, recorded as" in said
    assert "passed" in said
    *shared, reading = COMMAND.findall((BENCH / "README.md").read_text())
    assert reading.endswith(" --plot")
    assert {*shared, reading.removesuffix(" --plot")} <= set(COMMAND.findall(tutorial.read_text()))
    run(reading)  # where the tutorial has ended
    assert Path("readings.png").stat().st_size > 5_000
