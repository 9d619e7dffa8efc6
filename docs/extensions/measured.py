"""The directive `measured`: figures as a benchmark recorded them, or how to record them."""

from __future__ import annotations

from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class Measured(SphinxDirective):
    """Show `measured/NAME.txt`, which `benchmarks/record.py NAME` writes."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Its text, word by word."""
        name = self.arguments[0]
        path = Path(self.env.srcdir) / "measured" / f"{name}.txt"
        self.env.note_dependency(str(path))
        if not path.exists():
            words = nodes.emphasis("", f"Not recorded for this version ({name}).")
            return [nodes.paragraph("", "", words)]
        text = path.read_text(encoding="utf-8").rstrip()
        return [nodes.literal_block(text, text, language="none", classes=["measured"])]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("measured", Measured)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
