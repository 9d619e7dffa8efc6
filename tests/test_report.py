"""The reproduction holds what it promises, and nothing from elsewhere."""

import html
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from docutils.utils.math.latex2mathml import tex2mathml
from PIL import Image

import commands
import fringeforce as ff
from fringeforce.cli import paper
from fringeforce.optics.colour import light_colour
from fringeforce.reproduction.example import PaperExample, rectangle_rule
from fringeforce.reproduction.figures import EQUATIONS, FIGURES

pytestmark = pytest.mark.slow


NAME = "<script>alert(1)</script>"


@pytest.fixture(scope="module")
def page(sensor: ff.Sensor, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the paper's sensor, which somebody has named to do harm, by its command."""
    seen, folder = list[tuple[str, int, int]](), tmp_path_factory.mktemp("demo")
    (folder / "named.toml").write_text(sensor.replace(name=NAME).to_toml(), encoding="utf-8")

    @contextmanager
    def bar(title: str, width: int) -> Iterator[Callable[[str, int, int], None]]:
        yield lambda title, done, expected: seen.append((title, done, expected))

    with patch.object(paper, "progress_bar", bar):
        said = commands.run("reproduce", "named.toml", "--out", "made", cwd=folder)
    assert said == (0, "Open made/report.html in a browser.\n", "")
    titles, done, expected = zip(*seen, strict=True)
    assert list(done) == list(range(expected[0] + 1))
    assert set(expected) == {done[-1]}
    assert {title for _, _, _, title, _ in FIGURES} < set(titles)
    return folder / "made" / "report.html"


def test_every_figure_is_a_picture_with_ink_on_it(page: Path) -> None:
    for name, *_ in FIGURES:
        pixels = np.asarray(Image.open(page.parent / f"{name}.png").convert("L"))
        assert pixels.std() > 5


def test_the_page_needs_nothing_but_itself(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert not re.findall(r"(?:src|href)=[\"'](?!data:|#)", text)
    assert text.count("data:image/png;base64,") == len(FIGURES)


def test_equations_are_those_of_the_theory_page_typeset(page: Path) -> None:
    theory = (Path(__file__).parents[1] / "docs/theory/index.md").read_text(encoding="utf-8")
    shown = re.sub(r"\s", "", page.read_text(encoding="utf-8"))
    numbers = {number for numbers in EQUATIONS.values() for number in numbers}
    for formula in re.findall(r"\$\$(.*?)\$\$", theory, re.DOTALL):
        number = re.search(r"[ .]*\\qquad\\qquad \((\d+)\)\s*$", formula)
        if number and number[1] in numbers:
            typeset = tex2mathml(formula[: number.start()].strip(" ,"), as_block=True)
            assert re.sub(r"\s", "", typeset) in shown
            numbers.remove(number[1])
    assert not numbers


def test_no_symbol_is_left_as_it_is_typed(page: Path) -> None:
    text = page.read_text(encoding="utf-8").partition("<h2>The design</h2>")[0]
    text = re.sub(
        r"<style>.*?</style>|<math.*?</math>|<img[^>]*>|<[^>]*>", "", text, flags=re.DOTALL
    )
    assert not re.findall(r"\b(?:sigma|tau|I|n)_\w+|\bpi\b|2\^B|&[gl]t;=", text)


def test_a_sentence_says_why_an_angle_of_the_paper_is_not_reached(page: Path) -> None:
    rows = re.findall(r"<tr><td>(.*?)</tr>", page.read_text(encoding="utf-8"), re.DOTALL)
    angles = next(row for row in rows if "angles within 7 %" in row)
    median = re.search(r"([\d.]+)% in the median frame", angles)
    assert median
    assert (float(median[1]) > 7) == ("differs" in angles)
    magnitudes = next(row for row in rows if "magnitudes are within 6 %" in row)
    assert "differs" not in magnitudes


def test_the_page_escapes_a_name(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert html.escape(NAME) in text
    assert "<script>alert" not in text


def test_equation_3_is_a_coarse_quadrature(sensor: ff.Sensor) -> None:
    exact, rule = rectangle_rule(PaperExample(sensor))
    error = np.abs(rule - exact).max() / np.abs(exact).max()
    assert 0.03 < error < 0.2


@pytest.mark.parametrize(("nm", "channel"), [(632.8, 0), (532.0, 1), (450.0, 2)])
def test_light_has_its_colour(nm: float, channel: int) -> None:
    assert light_colour(nm * 1e-9).argmax() == channel
