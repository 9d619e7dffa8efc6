"""Code blocks of the pages that people read, and how to run them."""

import os
import re
import shlex
import shutil
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tried import Block
from tried import blocks as blocks_of
from typer.main import get_command
from typer.testing import CliRunner

from fringeforce.cli import app

ROOT = Path(__file__).parents[1]
MADE = ("generated", "_site", "measured")
ELSEWHERE = ("apt-get", "cd", "ffmpeg", "git", "pip", "source", ".venv/bin/pre-commit")
"""Programs that change the machine, which a test does not run."""
POOLED = ("optimise", "sweep")
"""Commands that start a process for each core, which imports for longer than the few designs of a
page take; here none is started, for tests of sweeps are about those."""


def pages() -> list[Path]:
    """Every page with something to try."""
    docs = (
        page
        for page in (ROOT / "docs").rglob("*.md")
        if not set(page.relative_to(ROOT / "docs").parts) & set(MADE)
    )
    examples = (ROOT / "examples").rglob("README.md")
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(docs), *sorted(examples)]


def blocks(page: Path) -> list[Block]:
    """The fenced blocks of a page in their order."""
    return list(blocks_of(page.read_text(encoding="utf-8")))


def run_page(page: Path, folder: Path) -> str:
    """Run a page's blocks in one namespace and one folder, the current one; what commands say."""
    if "examples" in page.read_text(encoding="utf-8"):
        shutil.copytree(ROOT / "examples", folder / "examples", dirs_exist_ok=True)
        shorten(folder / "examples" / "studies" / "thin-or-soft.toml")
    if page.parent.parent.name == "examples":
        # an example's page speaks of the files beside it
        shutil.copytree(page.parent, folder, dirs_exist_ok=True)
    names: dict[str, Any] = {"__name__": "page"}
    said = ""
    for block in blocks(page):
        if block.caption:
            text = block.text.replace("verify = 100\n", "verify = 10\n")  # noisy frames to read
            Path(block.caption).write_text(text, encoding="utf-8")
        if block.language == "python":
            code = "\n" * block.line + block.text
            exec(compile(code, str(page), "exec"), names)
        elif block.language == "sh":
            said += run(block.text)
        elif block.language == "console":
            understand(block.text)
        elif block.language == "toml":
            tomllib.loads(block.text)
        else:
            assert block.language == "text" or block.language.startswith("{"), (
                f"{page}, line {block.line}: a block of {block.language!r} is never tried"
            )
    return said


def commands(text: str) -> Iterator[list[str]]:
    """Commands of a block, comments left out."""
    for line in text.replace("\\\n", " ").splitlines():
        if words := shlex.split(line.removeprefix("$ "), comments=True):
            yield words


def run(text: str) -> str:
    """Run the commands of a block where the one before it ended, as in a terminal."""
    said = ""
    for words in commands(text):
        program, *arguments = words
        if program == "cd":
            os.chdir(arguments[0])
        elif program == "fringeforce":
            if arguments[0] in POOLED:
                arguments += ["--workers", "0"]
            result = CliRunner().invoke(app, arguments, catch_exceptions=False)
            assert result.exit_code == 0, (arguments, result.output)
            said += result.output
        else:
            _known(words)
    return said


def understand(text: str) -> None:
    """Commands that need hardware or never end: they and their options exist."""
    for words in commands(text):
        if words[0] != "fringeforce":
            _known(words)
            continue
        group: Any = get_command(app)
        assert words[1] in group.commands, words
        group.commands[words[1]].make_context(words[1], words[2:])


def _known(words: list[str]) -> None:
    if words[0] == "make":
        makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
        assert re.search(rf"^{words[1]}:", makefile, flags=re.MULTILINE), words
    elif words[0] == "python":
        assert (ROOT / words[1]).exists(), words
    else:
        assert words[0] in ELSEWHERE, words


def shorten(study: Path) -> None:
    """The same study with fewer designs and frames."""
    text = study.read_text(encoding="utf-8")
    for long, short in {"designs = 1000": 4, "budget = 640": 64, "verify = 1000": 5}.items():
        assert long in text
        text = text.replace(long, f"{long.split(' =')[0]} = {short}")
    study.write_text(text, encoding="utf-8")
