"""The directive `measured`: the figures of what a benchmark recorded, and its table below them."""

from __future__ import annotations

import os
from pathlib import Path

import measured_figures
import records
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

SUMMARY = "The table, and how it was made"


class Measured(SphinxDirective):
    """Show `measured/NAME.txt`, which `benchmarks/record.py NAME` writes.

    What is inside explains the names of rows and columns, below the figures.  It is left out if
    there is no record.
    """

    required_arguments = 1
    has_content = True

    def run(self) -> list[nodes.Node]:
        """Its figures if it has some, the names, and the record word by word, folded."""
        name = self.arguments[0]
        path = Path(self.env.srcdir) / "measured" / f"{name}.txt"
        self.env.note_dependency(str(path))
        if not path.exists():
            words = nodes.emphasis("", f"Not recorded for this version ({name}).")
            return [nodes.paragraph("", "", words)]
        names = nodes.container("", *self.parse_content_to_nodes(), classes=["measured-names"])
        text = path.read_text(encoding="utf-8").rstrip()
        return [
            *self._figures(path),
            names,
            nodes.raw("", f'<details class="measured"><summary>{SUMMARY}</summary>', format="html"),
            nodes.literal_block(text, text, language="none"),
            nodes.raw("", "</details>", format="html"),
        ]

    def _figures(self, path: Path) -> list[nodes.Node]:
        source = Path(self.env.srcdir)
        try:
            drawn = measured_figures.save(path, source / "generated" / "measured")
        except ValueError as wrong:
            logging.getLogger(__name__).warning(str(wrong), location=self.get_location())
            return []
        page = (source / self.env.docname).parent
        what = f"What {records.heading(path)[0]} measured; the table below has the numbers"
        return [nodes.image(uri=os.path.relpath(svg, page), alt=what) for svg in drawn]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("measured", Measured)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
