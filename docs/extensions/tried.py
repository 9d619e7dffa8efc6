"""The directive `tried`: what the block above it printed, or a picture that it wrote.

The blocks of a page that uses it are run as the page is read, in one namespace and one new folder,
so that what is shown is what happens.  `-D run_pages=0` builds a site without running any.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

EXAMPLES = Path(__file__).parents[2] / "examples"
WIDTH = 88
"""Columns of a terminal that commands print to."""
LINES = 24
"""Lines of what was printed that are shown, unless a page asks for other ones."""


@dataclass(frozen=True)
class Block:
    """A fenced block: its language or directive, the file that it is, its text, where it begins."""

    language: str
    caption: str
    text: str
    line: int


def blocks(text: str) -> Iterator[Block]:
    """The fenced blocks of a page in their order."""
    fence, head, held, start = "", "", list[str](), 0
    for number, line in enumerate(text.splitlines(), 1):
        mark = re.match(r"(`{3,}|~{3,})(.*)", line)
        if not fence and mark:
            fence, head, held, start = mark[1], mark[2].strip(), [], number
        elif fence and line.strip() == fence:
            yield _block(head, held, start)
            fence = ""
        elif fence:
            held.append(line)
    if fence:
        raise ValueError(f"the block that begins in line {start} does not end")


def _block(head: str, held: list[str], start: int) -> Block:
    language, caption = head.removeprefix("{code-block}").strip(), ""
    if head.startswith("{code-block}"):
        while held and (held[0].startswith(":") or not held[0]):
            caption = held.pop(0).partition(":caption:")[2].strip() or caption
    return Block(language, caption, "\n".join(held) + "\n", start)


@dataclass
class Run:
    """A page that is run block by block, as far as it has been asked for."""

    text: str
    folder: Path
    names: dict[str, object] = field(default_factory=lambda: {"__name__": "page"})
    place: Path | None = None
    done: int = 0
    printed: str = ""

    def until(self, line: int) -> str:
        """Run all blocks above a line; what the last of them printed."""
        for block in blocks(self.text):
            if self.done < block.line < line:
                self._run(block)
                self.done = block.line
        return self.printed

    def here(self) -> Path:
        """Where the last block has led to."""
        return self.place or self.folder

    def _run(self, block: Block) -> None:
        if block.caption:
            (self.here() / block.caption).write_text(block.text, encoding="utf-8")
        if block.language == "sh":
            last = self.folder / ".place"  # where a `cd` has led to
            shell = ["bash", "-e", "-c", f"{block.text}pwd > '{last}'"]
            path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
            told = {**os.environ, "PATH": path, "COLUMNS": str(WIDTH), "TERM": "dumb"}
            run = subprocess.run(
                shell, cwd=self.here(), env=told, capture_output=True, text=True, check=False
            )
            if run.returncode:
                raise ValueError(f"{block.text.strip()!r} ended with {run.stdout}{run.stderr}")
            self.printed = run.stdout
            self.place = Path(last.read_text(encoding="utf-8").strip())
        elif block.language == "python":
            with contextlib.chdir(self.here()), contextlib.redirect_stdout(io.StringIO()) as said:
                exec(compile(block.text, "page", "exec"), self.names)
            self.printed = said.getvalue()


class Tried(SphinxDirective):
    """Show what happened: `:picture:` names a file that was written, `:lines:` how many lines."""

    has_content = True
    option_spec = {
        "picture": directives.unchanged,
        "alt": directives.unchanged,
        "lines": directives.positive_int,
    }

    def run(self) -> list[nodes.Node]:
        """Text of the last block, or a picture; its content becomes the words below a picture."""
        if not self.config.run_pages:
            return []
        page: Run | None = self.env.temp_data.get("tried")
        if page is None:
            folder = Path(tempfile.mkdtemp(prefix="page-"))
            self.env.app.connect("build-finished", lambda *_: shutil.rmtree(folder, True))
            text = Path(self.env.doc2path(self.env.docname)).read_text(encoding="utf-8")
            if "examples" in text:
                shutil.copytree(EXAMPLES, folder / "examples")
            page = self.env.temp_data["tried"] = Run(text, folder)
        try:
            printed = page.until(self.lineno)
        except Exception as wrong:
            raise self.error(f"A block above does not work: {wrong}") from wrong
        name = self.options.get("picture")
        return self._picture(page.here() / name) if name else self._text(printed)

    def _text(self, printed: str) -> list[nodes.Node]:
        lines = printed.rstrip().splitlines()
        if not lines:
            raise self.error("The block above prints nothing.")
        count = self.options.get("lines", LINES)
        text = "\n".join([*lines[:count], *(["..."] if len(lines) > count else [])])
        return [nodes.literal_block(text, text, language="none", classes=["printed"])]

    def _picture(self, made: Path) -> list[nodes.Node]:
        if not made.exists():
            raise self.error(f"No block above writes {made.name}.")
        source = Path(self.env.srcdir)
        kept = source / "generated" / "pages" / f"{Path(self.env.docname).name}-{made.name}"
        kept.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(made, kept)
        page = (source / self.env.docname).parent
        alt = self.options.get("alt", "")
        return [nodes.image(uri=os.path.relpath(kept, page), alt=alt)]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive and its switch."""
    app.add_config_value("run_pages", True, "env", types=(bool, str, int))
    app.add_directive("tried", Tried)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
