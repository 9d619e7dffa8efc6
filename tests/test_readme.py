"""What the README shows is what happens."""

import os
import re
import shlex
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fringeforce.cli import app

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def _blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


@pytest.fixture
def workplace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_python_lines_run(workplace: Path) -> None:
    for block in _blocks("python"):
        exec(compile(block, "README.md", "exec"), {})
    assert (workplace / "model.h5").exists()


def test_the_commands_run(workplace: Path) -> None:
    (workplace / "forces.csv").write_text("frame,tactel,normal_N,tangential_N\n0,6,1.0,0.1\n")
    shutil.copytree(ROOT / "examples", workplace / "examples")
    lines = [line for block in _blocks("sh") for line in block.splitlines()]
    commands = [words for line in lines if (words := shlex.split(line, comments=True))]
    for program, *arguments in commands:
        if program == "cd":
            os.chdir(workplace / arguments[0])
        elif program == "fringeforce":
            result = CliRunner().invoke(app, arguments, catch_exceptions=False)
            assert result.exit_code == 0, (arguments, result.output)
    assert (workplace / "demo" / "report.html").stat().st_size > 100_000


def test_the_two_commands_are_targets_of_the_makefile() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in re.findall(r"^make (\w+)", README, flags=re.MULTILINE):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE)
    assert os.access(ROOT / ".ci" / "run", os.X_OK)


def test_every_link_leads_somewhere() -> None:
    links = re.findall(r"\]\((?!https?:)([^)#]+)\)", README)
    assert links
    assert all((ROOT / link).exists() for link in links)
