"""Commands, run by the entry point of the installed program but in the process of the tests.

A new interpreter imports for two seconds; that the program itself starts, ends, and imports what it
needs is what tests of the wheel, of interrupts and `started` are for.
"""

import io
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple
from unittest.mock import patch

from fringeforce.cli import main


class Said(NamedTuple):
    """How a command ended, and what it said."""

    returncode: int
    stdout: str
    stderr: str


def run(*arguments: str, cwd: Path) -> Said:
    """Run a command in a folder; an exception that the program would show as such comes through."""
    out, err, status = io.StringIO(), io.StringIO(), 0
    words = patch.object(sys, "argv", ["fringeforce", *arguments])
    with chdir(cwd), words, redirect_stdout(out), redirect_stderr(err):
        try:
            main()
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else int(end.code is not None)
    return Said(status, out.getvalue(), err.getvalue())


def started(*arguments: str, cwd: Path) -> Said:
    """Run the installed program in a process of its own."""
    command = [str(Path(sys.executable).parent / "fringeforce"), *arguments]
    ended = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    return Said(ended.returncode, ended.stdout, ended.stderr)
