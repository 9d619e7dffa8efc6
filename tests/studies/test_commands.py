"""The commands of studies are the library's calls, with files on either side."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from fringeforce.cli import app
from fringeforce.design.files import load_sensor
from fringeforce.studies.result_store import read_results

pytestmark = pytest.mark.slow


def run(*arguments: object) -> str:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output
    return result.output


def test_a_study_leaves_a_figure_a_table_and_its_words(study_path: Path, tmp_path: Path) -> None:
    shown = run("study", "resolution", study_path.parent / "small.toml", "--out", tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "resolution.csv", "resolution.png", "resolution.txt",
    ]  # fmt: skip
    assert (tmp_path / "resolution.txt").read_text(encoding="utf-8").split("\n")[0] in shown


def test_a_sweep_goes_on_when_it_is_given_again(study_path: Path, tmp_path: Path) -> None:
    arguments = "sweep", study_path, "-o", tmp_path / "r.h5", "--workers", 0
    first = run(*arguments)
    held = read_results(tmp_path / "r.h5")
    assert run(*arguments) == first
    assert (read_results(tmp_path / "r.h5")["state"] == held["state"]).all()


def test_an_optimum_is_a_design_file(study_path: Path, tmp_path: Path) -> None:
    shown = run("optimise", study_path, "-o", tmp_path / "s.h5", "--workers", 0)
    found = load_sensor(tmp_path / "s.toml")
    assert "noisy frames" in shown
    strip = found.transducer
    assert strip.compliant.thickness + strip.photoelastic.thickness <= 3.5e-3 * (1 + 1e-9)
