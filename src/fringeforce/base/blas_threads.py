"""One thread for BLAS while small matrices are worked on.

The threads of a BLAS spin until all have done their share, which takes longer than the share where
other programs hold the cores; matrices of some dozens of rows gain nothing from them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from threading import Lock

from threadpoolctl import ThreadpoolController

_limiting = Lock()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Run what is inside, or the function that is decorated, with one thread of BLAS.

    The number of threads belongs to the process.  Who enters first lowers it and puts it back, in
    some tens of microseconds; who enters meanwhile, from this or another thread, leaves it alone.
    """
    if not _limiting.acquire(blocking=False):
        yield
        return
    try:
        with _loaded().limit(limits=1):
            yield
    finally:
        _limiting.release()


@cache
def _loaded() -> ThreadpoolController:
    """Every BLAS that is loaded; looking for them takes a hundredth of a second."""
    return ThreadpoolController().select(user_api="blas")
