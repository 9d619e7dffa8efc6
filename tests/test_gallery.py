"""Every script of the gallery runs, draws, and what it states holds."""

import ast
import runpy
from collections.abc import Iterator
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest

pytestmark = pytest.mark.slow

GALLERY = Path(__file__).parents[1] / "examples" / "gallery"
SCRIPTS = sorted(GALLERY.glob("*.py"))


@pytest.fixture
def quiet_figures(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(plt, "show", lambda: None)
    with mpl.rc_context():
        plt.switch_backend("agg")
        yield
        plt.close("all")


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_runs_draws_and_its_statements_hold(
    script: Path, quiet_figures: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runpy.run_path(str(script))
    assert capsys.readouterr().out
    numbers = plt.get_fignums()
    assert numbers
    for number in numbers:
        picture = tmp_path / f"{number}.png"
        plt.figure(number).savefig(picture)
        drawn = plt.imread(picture)
        assert drawn.min() < drawn.max()


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_has_a_title_cells_and_statements_that_can_be_wrong(script: Path) -> None:
    text = script.read_text(encoding="utf-8")
    tree = ast.parse(text)
    title, underline, *_ = (ast.get_docstring(tree) or "").splitlines()
    assert set(underline) == {"="}
    assert len(underline) == len(title)
    assert text.count("\n# %%\n") >= 2
    statements = [node.test for node in ast.walk(tree) if isinstance(node, ast.Assert)]
    assert sum(not isinstance(one, ast.Constant) for one in statements) >= 2


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_runs_where_no_file_is_known_as_in_the_documentation(script: Path) -> None:
    names = [node.id for node in ast.walk(ast.parse(script.read_text(encoding="utf-8")))
             if isinstance(node, ast.Name)]  # fmt: skip
    assert "__file__" not in names
