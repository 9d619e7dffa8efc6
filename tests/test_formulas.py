"""Formulas of the documentation look as TeX sets them."""

import re

import pytest
from mathml import typeset

SPACE = '<mspace width="0.1667em"/>'


def _plain(tex: str) -> str:
    markup = re.sub(r"\s*\n\s*", "", typeset(tex)).replace(" />", "/>")
    return re.sub(r"^<math[^>]*>|</math>$", "", markup)


@pytest.mark.parametrize(
    ("tex", "markup"),
    [
        (r"a \cos x", f"<mi>a</mi>{SPACE}<mi>cos</mi>{SPACE}<mi>x</mi>"),
        (r"\log (x)", '<mi>log</mi><mo stretchy="false">(</mo><mi>x</mi>'),
        (r"+ \sin^2 x", f"<mo>+</mo><msup><mi>sin</mi><mn>2</mn></msup>{SPACE}<mi>x</mi>"),
        (r"a \, \mathrm{diag} \, H", f"<mi>a</mi>{SPACE}<mi>diag</mi>{SPACE}<mi>H</mi>"),
    ],
)
def test_names_of_functions_stand_apart(tex: str, markup: str) -> None:
    assert _plain(tex).startswith(markup)


def test_an_index_stands_beside_a_letter_with_an_accent() -> None:
    accent = '<mover accent="true"><mi>y</mi><mo stretchy="false">\u02c6</mo></mover>'
    assert _plain(r"\hat y_i") == f"<msub>{accent}<mi>i</mi></msub>"


def test_limits_of_a_sum_stay_above_and_below_it() -> None:
    assert _plain(r"\sum_i^n x").startswith("<munderover>")
