"""Many calls on many cores or machines, through the one interface of concurrent.futures."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from itertools import islice
from types import FrameType
from typing import Any, TypeVar

from fringeforce.base.child_process import end_with_parent
from fringeforce.base.errors import InputError, LargeStrainWarning
from fringeforce.base.optional_libraries import extra
from fringeforce.base.progress import Progress, counted

Result = TypeVar("Result")
Arguments = tuple[Any, ...]

AHEAD = 128
"""Calls that are handed over before the first one is back."""
HEARD_WITHIN = 0.1
"""Seconds within which Ctrl-C ends the wait for a result: at once, to who presses it."""
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


class Inline(Executor):
    """Runs every call at once in this process."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Call and hand over the finished result."""
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


class Processes(ProcessPoolExecutor):
    """Processes that Ctrl-C does not reach: who asked for their results ends them."""

    interrupted = False
    """Whether Ctrl-C came since they began."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Call in a process, which inherits that SIGINT is blocked where it is started now."""
        if not hasattr(signal, "pthread_sigmask"):
            return super().submit(fn, *args, **kwargs)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return super().submit(fn, *args, **kwargs)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin() -> None:
    """Begin a process: studies ask on purpose what large loads do."""
    warnings.simplefilter("ignore", LargeStrainWarning)
    end_with_parent()


@contextmanager
def executor(scheduler: str | None = None, workers: int | None = None) -> Iterator[Executor]:
    """Where calls run: processes of this machine, or the workers of a Dask cluster.

    Parameters
    ----------
    scheduler : str, optional
        Address of a Dask scheduler, such as "tcp://10.0.0.1:8786"; processes if not given.
    workers : int, optional
        Number of processes; one for each core if not given, and none for 0: this process alone.

    Raises
    ------
    InputError
        If the scheduler cannot be reached or the package for it is not installed, or processes
        are fewer than none.
    """
    if workers is not None and workers < 0:
        raise InputError(f"workers = {workers}: must be 1 or more, or 0 for this process alone.")
    if workers is not None and workers > AHEAD:
        raise InputError(
            f"workers = {workers}: at most {AHEAD} calls are handed over at a time; give as many "
            "workers or fewer, or leave it out for one on each core."
        )
    if scheduler is not None:
        with _cluster(scheduler) as pool:
            yield pool
    elif workers == 0:
        yield Inline()
    else:
        spawn, others = multiprocessing.get_context("spawn"), multiprocessing.active_children()
        with (
            _one_thread_each(),
            Processes(workers, mp_context=spawn, initializer=_begin) as pool,
            _held_interrupts(pool),
        ):
            try:
                yield pool
            except BaseException:
                # nobody waits for calls that run or were handed over
                for process in set(multiprocessing.active_children()) - set(others):
                    process.terminate()
                pool.shutdown(cancel_futures=True)
                raise


@contextmanager
def _cluster(address: str) -> Iterator[Executor]:
    distributed: Any = extra("distributed", "cluster")
    try:
        client = distributed.Client(address, timeout=10)
    except (OSError, ValueError) as error:
        raise InputError(f"No scheduler answers at {address!r}: {error}.") from None
    with client, client.get_executor() as pool:
        yield pool


@contextmanager
def _held_interrupts(pool: Processes) -> Iterator[None]:
    """Ctrl-C is noted while the pool is at work, and raised where its results are waited for.

    Raised at once it may be lost, where Python runs a callback of a weak reference, and a second
    one may break off the ending of the processes; either would leave the pool waiting for them.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def note(number: int, frame: FrameType | None) -> None:
        pool.interrupted = True

    before = signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """New processes run linear algebra on one thread: as many processes as cores are enough."""
    before = {name: os.environ[name] for name in ONE_THREAD if name in os.environ}
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name in ONE_THREAD:
            del os.environ[name]
        os.environ.update(before)


def completed(
    pool: Executor, function: Callable[..., Result], tasks: Iterable[tuple[int, Arguments]]
) -> Iterator[tuple[int, Result]]:
    """Results of numbered calls as they come, in any order.

    Parameters
    ----------
    pool : Executor
        Where the calls run.
    function : callable
        What is called; it and its arguments must travel to other processes.
    tasks : iterable of (int, tuple)
        Numbers of the calls, and their arguments.

    Yields
    ------
    (int, result)
        The number of a call and what came of it.
    """
    remaining = iter(tasks)
    running: dict[Future[Result], int] = {}
    while True:
        for number, task in islice(remaining, AHEAD - len(running)):
            future = pool.submit(function, *task)
            running[future] = number
            if future.done():
                break  # what is finished is handed over before the next begins
        if not running:
            return
        finished, _ = wait(running, timeout=HEARD_WITHIN, return_when=FIRST_COMPLETED)
        if isinstance(pool, Processes) and pool.interrupted:
            raise KeyboardInterrupt
        for future in finished:
            yield running.pop(future), future.result()


def gathered(
    pool: Executor,
    function: Callable[..., Result],
    tasks: Sequence[Arguments],
    words: str = "",
    progress: Progress | None = None,
) -> list[Result]:
    """Results of all calls, in their order.

    Parameters
    ----------
    pool, function
        As in `completed`.
    tasks : sequence of tuple
        What to call the function with.
    words : str
        What the calls are, for the progress.
    progress : callable, optional
        Told the words, the calls done and their count.
    """
    results = completed(pool, function, enumerate(tasks))
    found = dict(counted(results, progress, words, len(tasks)))
    return [found[number] for number in range(len(tasks))]
