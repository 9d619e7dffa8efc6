"""The house rules, kept by machines."""

import re
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import grimp
import number_table
import pytest

ROOT = Path(__file__).parents[1]
BIN = Path(sys.executable).parent
SOURCES = sorted(
    path
    for folder in ("src", "tests", "benchmarks", "examples", "docs/extensions")
    for path in (ROOT / folder).rglob("*.py")
)
TEXTS = [
    *SOURCES,
    *(ROOT / "designs").glob("*.toml"),
    *(ROOT / "docs").rglob("*.md"),
    *(path for path in ROOT.iterdir() if path.is_file() and path.name != ".git"),
]


@pytest.mark.parametrize(
    "command",
    [
        ["ruff", "check"],
        ["ruff", "format", "--check"],
        ["lint-imports"],
        ["codespell"],
        pytest.param(
            # threads wait for each other's types, and work while they wait
            ["pyrefly", "check", "--threads", "1", "--python-interpreter-path", sys.executable],
            marks=pytest.mark.slow,
        ),
    ],
    ids=lambda command: command[0],
)
def test_the_tools_of_the_house_find_nothing(command: list[str]) -> None:
    run = subprocess.run(
        [BIN / command[0], *command[1:]], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stdout + run.stderr


def test_no_two_files_import_each_other_in_a_circle() -> None:
    graph = grimp.build_graph("fringeforce", exclude_type_checking_imports=True)
    files = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    TopologicalSorter(files).prepare()  # CycleError names the files of a circle


def test_no_text_names_a_machine_or_a_package_index() -> None:
    foreign = re.compile(
        r"(?<![\w.])/(?:home|work|root|Users)/\w|https?://[^\s\"']*(?:pypi|pythonhosted|npmjs)"
    )
    mine = Path(__file__)
    found = {
        str(path.relative_to(ROOT)): match[0]
        for path in TEXTS
        if path != mine
        for match in [foreign.search(path.read_text(encoding="utf-8"))]
        if match
    }
    assert not found


@pytest.mark.parametrize("statement", ["import fringeforce", "from fringeforce.cli import app"])
def test_importing_the_package_or_its_commands_loads_no_numerical_library(statement: str) -> None:
    code = (
        f"import sys; {statement}; "
        "print([name for name in ('numpy', 'scipy', 'pydantic', 'pint', 'numba') "
        "if name in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_every_public_name_exists_and_says_what_it_is() -> None:
    import fringeforce

    assert all(getattr(fringeforce, name).__doc__ for name in fringeforce.__all__)


@pytest.mark.parametrize("room", number_table.ROOMS)
def test_every_number_that_steers_readings_says_what_it_is(room: str) -> None:
    found = number_table.numbers(room)
    assert len(found) > 10
    assert not [one for one in found if not one.said.endswith(".")]


def test_numbers_that_decide_are_among_all_numbers() -> None:
    named = sum(map(len, number_table.DECIDING.values()))
    assert number_table.deciding().count("\n") == 2 + named
