"""The documentation builds without a warning, and its pages need nobody else."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from pydantic import BaseModel

from fringeforce.design.strip import Sensor
from snippets import ROOT, blocks, pages

pytestmark = pytest.mark.slow
PARTS = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "LICENSE", "CITATION.cff", "Makefile")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built from a copy of its sources.

    Blocks of pages and the gallery's scripts are not run here: tests of their own run each, and
    building the site would run them again.  Pages of the modules' sources, which Sphinx alone
    writes, are left out.
    """
    copy = tmp_path_factory.mktemp("sources")
    made = shutil.ignore_patterns("generated", "_site", "__pycache__", "*.h5")
    for folder in ("docs", "examples"):
        shutil.copytree(ROOT / folder, copy / folder, ignore=made)
    for name in PARTS:
        shutil.copy(ROOT / name, copy)
    command = [sys.executable, "-m", "sphinx", "-b", "html", "-q", "-W", "--keep-going"]
    command += ["-D", "run_pages=0", "-D", "autodoc_preserve_defaults=0", "-t", "without_sources"]
    if (copy / "examples" / "gallery").is_dir():
        command += ["-D", "plot_gallery=0"]
    run = subprocess.run(
        [*command, copy / "docs", copy / "site"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    return copy / "site"


def test_every_page_and_every_public_name_is_there(site: Path) -> None:
    import fringeforce

    for page in (ROOT / "docs").rglob("*.md"):
        name = page.relative_to(ROOT / "docs").with_suffix(".html")
        if name.parts[0] not in ("generated", "_site"):
            assert (site / name).exists(), name
    for name in fringeforce.__all__:
        page = (site / "generated" / "api" / f"{name}.html").read_text(encoding="utf-8")
        assert f'id="fringeforce.{name}"' in page


def test_no_page_loads_anything_from_another_host(site: Path) -> None:
    loading = re.compile(
        r"""<(?:script|img|iframe|source|video|audio|embed|object)\b[^>]*?(?:src|data|srcset)=["']?(?:https?:)?//"""
        r"""|<link\b[^>]*?rel=["']?(?:stylesheet|preload|icon|preconnect|dns-prefetch)[^>]*?(?:https?:)?//"""
        r"""|url\(["']?(?:https?:)?//|@import ["'](?:https?:)?//"""
    )
    found = {
        path.relative_to(site).as_posix(): match[0][:120]
        for path in [*site.rglob("*.html"), *site.rglob("*.css"), *site.rglob("*.svg")]
        for match in [loading.search(path.read_text(encoding="utf-8"))]
        if match
    }
    assert not found


def test_formulas_are_drawn_by_the_browser(site: Path) -> None:
    page = (site / "theory" / "index.html").read_text(encoding="utf-8")
    assert page.count("<math") > 20
    assert "\\frac" not in page


def test_the_design_reference_has_every_field(site: Path) -> None:
    page = (site / "reference" / "design-file.html").read_text(encoding="utf-8")

    def fields(model: type[BaseModel]) -> list[str]:
        parts = [
            getattr(info.annotation, "model_fields", None) for info in model.model_fields.values()
        ]
        below = [
            name
            for info, part in zip(model.model_fields.values(), parts, strict=True)
            if part and isinstance(info.annotation, type)
            for name in fields(info.annotation)
        ]
        own = [info.alias or name for name, info in model.model_fields.items()]
        return [name for name, part in zip(own, parts, strict=True) if not part] + below

    assert {name for name in fields(Sensor) if f">{name}<" not in page} <= {
        "channels",
        "optical_creep",
        "plates",
        "relaxation",
        "skin",
    }
    assert "polariscope.channels" in page
    assert "polariscope.plates" in page
    assert "transducer.relaxation" in page
    assert "[skin]" in page


def test_every_recorded_figure_is_that_of_a_benchmark() -> None:
    shown = [
        block.language.removeprefix("{measured}").strip()
        for page in pages()
        for block in blocks(page)
        if block.language.startswith("{measured}")
    ]
    scripts = {path.stem for path in (ROOT / "benchmarks").glob("*.py")} - {
        "record",
        "single_press",
    }
    assert scripts <= set(shown), "a benchmark that no page shows"
    assert set(shown) <= scripts | {"mutation", "coverage", "reliability"}
    for record in (ROOT / "docs" / "measured").glob("*.txt"):
        assert record.stem in shown
        assert re.search(r"\b20\d\d-\d\d-\d\d\b", record.read_text(encoding="utf-8"))
