"""The reproduction holds what it promises, and nothing from elsewhere."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import fringeforce as ff
from fringeforce.optics.colour import light_colour
from fringeforce.reproduction.example import PaperExample, rectangle_rule
from fringeforce.reproduction.figures import FIGURES
from fringeforce.reproduction.report import reproduce

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("report")]  # made once


@pytest.fixture(scope="module")
def page(sensor: ff.Sensor, tmp_path_factory: pytest.TempPathFactory) -> Path:
    seen = []
    page = reproduce(sensor, tmp_path_factory.mktemp("demo"), lambda *step: seen.append(step))
    assert len(seen) == len(FIGURES)
    return page


def test_every_figure_is_a_picture_with_ink_on_it(page: Path) -> None:
    for name, *_ in FIGURES:
        pixels = np.asarray(Image.open(page.parent / f"{name}.png").convert("L"))
        assert pixels.std() > 5


def test_the_page_needs_nothing_but_itself(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert not re.findall(r"(?:src|href)=[\"'](?!data:|#)", text)
    assert text.count("data:image/png;base64,") == len(FIGURES)


def test_the_page_escapes_a_name(sensor: ff.Sensor, tmp_path: Path) -> None:
    page = reproduce(sensor.replace(name="<script>alert(1)</script>"), tmp_path)
    assert "<script>alert" not in page.read_text(encoding="utf-8")


def test_equation_3_is_a_coarse_quadrature(sensor: ff.Sensor) -> None:
    exact, rule = rectangle_rule(PaperExample(sensor))
    error = np.abs(rule - exact).max() / np.abs(exact).max()
    assert 0.03 < error < 0.2


@pytest.mark.parametrize(("nm", "channel"), [(632.8, 0), (532.0, 1), (450.0, 2)])
def test_light_has_its_colour(nm: float, channel: int) -> None:
    assert light_colour(nm * 1e-9).argmax() == channel
