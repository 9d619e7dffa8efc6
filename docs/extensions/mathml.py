"""Formulas as MathML, which browsers draw themselves: no script, no font, no other host."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from html.entities import html5
from itertools import pairwise
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx

NAMESPACE = "http://www.w3.org/1998/Math/MathML"
ROWS = ("math", "mrow", "msqrt", "mtd", "mstyle")
"""Elements whose children stand side by side."""
ACCENTS = "\u02c6\u02c9\u02dc\u02d9\u20d7^~.¯¨→"
"""Hat, bar, tilde, dot and arrow, each in every way that docutils writes it."""
FUNCTION = "\u2061"
"""The character that docutils writes behind the name of a function."""


def typeset(tex: str, **options: bool) -> str:
    """MathML of a formula, with what docutils leaves out.

    Names of functions stand apart from their neighbours, as in TeX, bars do not stand apart from
    what they enclose, and the index of a letter with an accent stands beside the letter.
    """
    markup = re.sub(r"&(?!(?:amp|lt|gt|quot);)(\w+;)", _character, tex2mathml(tex, **options))
    ET.register_namespace("", NAMESPACE)
    root = ET.fromstring(markup)
    for parent in list(root.iter()):
        _set_indices(parent)
        if parent.tag.partition("}")[2] in ROWS:
            _set_functions(parent)
        elif parent.text == "|":
            parent.attrib |= {"lspace": "0", "rspace": "0"}
    return ET.tostring(root, encoding="unicode")


def _character(name: re.Match[str]) -> str:
    return html5[name[1]]


def _set_indices(element: ET.Element) -> None:
    if element.tag != f"{{{NAMESPACE}}}munderover":
        return
    letter, index, accent = element
    if (accent.text or "") not in ACCENTS:
        return
    element.tag = f"{{{NAMESPACE}}}msub"
    for child in (letter, index, accent):
        element.remove(child)
    over = ET.SubElement(element, f"{{{NAMESPACE}}}mover", accent="true")
    over.extend([letter, accent])
    element.append(index)


def _set_functions(parent: ET.Element) -> None:
    held = [child for child in parent if child.text != FUNCTION]
    if len(held) == len(parent) and not any(_is_function(child) for child in held):
        return
    set_apart = held[:1]
    for left, right in pairwise(held):
        beside_left = _is_function(left) and not _is_bracket(right)
        if beside_left or (_is_function(right) and not _is_operator(left)):
            set_apart.append(ET.Element(f"{{{NAMESPACE}}}mspace", width="0.1667em"))
        set_apart.append(right)
    parent[:] = set_apart


def _is_function(element: ET.Element) -> bool:
    """Whether it is a name such as cos, or one with an exponent."""
    if element.tag in (f"{{{NAMESPACE}}}msup", f"{{{NAMESPACE}}}msub"):
        return _is_function(element[0])
    return element.tag == f"{{{NAMESPACE}}}mi" and len((element.text or "").strip()) > 1


def _is_bracket(element: ET.Element) -> bool:
    if len(element):
        return _is_bracket(element[0])
    return _is_operator(element)


def _is_operator(element: ET.Element) -> bool:
    return element.tag in (f"{{{NAMESPACE}}}mo", f"{{{NAMESPACE}}}mspace")


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(typeset(node.astext()))
    raise nodes.SkipNode


def _display(translator: Any, node: nodes.math_block) -> None:
    formula = typeset(node.astext().strip(), as_block=True)
    translator.body.append(f'<div class="math-display">{formula}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer under the name "mathml"."""
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
