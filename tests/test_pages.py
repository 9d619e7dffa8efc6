"""What README, documentation and examples show is what happens."""

import os
import re
from pathlib import Path

import pytest

from snippets import ROOT, blocks, pages, run_page, understand

pytestmark = pytest.mark.slow

ELSEWHERE = ("examples/bench/README.md", "docs/tutorials/calibrate.md")
"""Pages of the same commands; tests/test_examples.py runs them once and looks at what they say."""


@pytest.fixture
def workplace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _named(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


TRIED = [page for page in pages() if any(blocks(page)) and _named(page) not in ELSEWHERE]


@pytest.mark.parametrize("page", TRIED, ids=_named)
def test_what_a_page_shows_happens(page: Path, workplace: Path) -> None:
    if page.name == "README.md":
        load = "frame,tactel,normal_N,tangential_N\n0,6,1.0,0.1\n"
        (workplace / "forces.csv").write_text(load, encoding="utf-8")
    run_page(page, workplace)


@pytest.mark.parametrize(
    "line", ["$ fringeforce fly saad", "$ fringeforce live m.h5 --wings", "$ make coffee"]
)
def test_a_command_that_does_not_exist_is_noticed(line: str) -> None:
    with pytest.raises(Exception, match=r"fly|wings|coffee"):
        understand(line)


@pytest.mark.parametrize(
    "page", [page for page in pages() if "docs" not in page.parts[-3:]], ids=_named
)
def test_every_link_outside_the_site_leads_somewhere(page: Path) -> None:
    links = re.findall(r"\]\((?!https?:)([^)#]+)\)", page.read_text(encoding="utf-8"))
    assert all((page.parent / link).exists() for link in links)


def test_the_test_command_is_what_a_change_must_pass() -> None:
    assert os.access(ROOT / ".ci" / "run", os.X_OK)
    assert "make test" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")
