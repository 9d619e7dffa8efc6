"""The command line: every command is one library call with a file on either side."""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
import warnings
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer

from fringeforce.cli.benchmark import benchmark
from fringeforce.cli.calibration import calibrate, check, creep, plan, update
from fringeforce.cli.datasets import dataset
from fringeforce.cli.designs import characterize, materials, new, show
from fringeforce.cli.explorer import explore
from fringeforce.cli.frames import read, simulate
from fringeforce.cli.help import Command
from fringeforce.cli.live import live
from fringeforce.cli.mistakes import USAGE_ERROR, tell
from fringeforce.cli.paper import reproduce
from fringeforce.cli.pictures import extract
from fringeforce.cli.studies import optimise, study, sweep

__all__ = ["app", "main"]

# all matrices here are small: threads of the linear algebra only get in each other's way
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

app = typer.Typer(
    name="fringeforce",
    help="Turn the drawing of a photoelastic tactile sensor into a force instrument.",
    epilog="Begin with `fringeforce explore`, which opens a sensor in the browser; "
    "`fringeforce COMMAND -h` says what a command takes.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
)

SIGNALLED = 128
"""Status of a command that a signal has ended, less its number, as of shells."""
INTERRUPTED = SIGNALLED + signal.SIGINT
"""Of one that Ctrl-C has ended."""
POLITE = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Signals by which others ask a command to end, which it does as at Ctrl-C."""
AGAIN_AFTER = 0.02
"""Seconds after which an interrupt that was lost, or would do harm, comes again: what it came in
takes microseconds."""
UNPICKLING = str(Path("numba", "core", "serialize.py"))
"""Where Numba finds the classes of results."""
NAMED_TUPLE = ("_cls",)
"""First variable of what makes a named tuple."""
COMMANDS = (
    *(new, materials, characterize, show, simulate, extract, read, live),
    *(plan, calibrate, check, update, creep, study, sweep, optimise, dataset, explore, reproduce),
)
for command in COMMANDS:
    app.command(cls=Command)(command)
app.add_typer(benchmark)


def main() -> None:
    """Run the command line; bad input ends with status 2 and what to do, Ctrl-C with 130."""
    from fringeforce.base.errors import FringeforceError, LargeStrainWarning
    from fringeforce.base.garbage import seldom_collected

    seldom_collected()
    warnings.simplefilter("ignore", LargeStrainWarning)  # `simulate` says so itself
    sys.unraisablehook = _interrupt_again
    came = [signal.SIGINT]

    def end(number: int, frame: FrameType | None) -> None:
        came[:] = [signal.Signals(number)]
        signal.raise_signal(signal.SIGINT)

    for number in POLITE:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, end)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _raise_interrupt)
    try:
        sys.exit(app(prog_name="fringeforce", standalone_mode=False))
    except USAGE_ERROR as error:
        tell(error)
        sys.exit(2)
    except FringeforceError as error:
        said = str(error)
        said = said if said.count("\n") > 1 else " ".join(said.split())  # a list keeps its lines
        print(f"fringeforce: {said}", file=sys.stderr)
        sys.exit(2)
    except (KeyboardInterrupt, SystemExit, SystemError) as error:
        if not _interrupted(error):
            raise
        # another one has nothing left to end: it would only break off the end of Python
        for number in (signal.SIGINT, *POLITE):
            signal.signal(number, signal.SIG_IGN)
        print(f"fringeforce: interrupted by {came[0].name}.", file=sys.stderr)
        sys.exit(SIGNALLED + came[0])


def _raise_interrupt(number: int, frame: FrameType | None) -> None:
    """Raise at Ctrl-C; a moment later where a compiled loop hands over its results.

    Numba asks Python there for the classes of named tuples and calls them, and does not look
    whether that failed: the process would crash.
    """
    below = frame
    while below is not None:
        code = below.f_code
        if code.co_filename.endswith(UNPICKLING) or code.co_varnames[:1] == NAMED_TUPLE:
            threading.Timer(AGAIN_AFTER, _interrupt).start()
            return
        below = below.f_back
    signal.default_int_handler(number, frame)


def _interrupt_again(lost: sys.UnraisableHookArgs) -> None:
    """Let Ctrl-C come again that came in a callback, such as of an import, which raises nothing."""
    if issubclass(lost.exc_type, KeyboardInterrupt):
        threading.Timer(AGAIN_AFTER, _interrupt).start()
    else:
        sys.__unraisablehook__(lost)


def _interrupt() -> None:
    """Press Ctrl-C, from another thread: what the main one waits for ends."""
    main_thread = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main_thread is not None:
        signal.pthread_kill(main_thread, signal.SIGINT)
    else:
        _thread.interrupt_main()


def _interrupted(error: BaseException) -> bool:
    """Whether Ctrl-C ended a command, which compiled loops say in a cause and Typer in a status."""
    causes = error, error.__cause__
    return getattr(error, "code", None) == INTERRUPTED or any(
        isinstance(cause, KeyboardInterrupt) for cause in causes
    )


@app.callback(invoke_without_command=True)
def _version(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if version:
        import fringeforce

        print(fringeforce.__version__)
