"""Readings to write: smooth numbers, with one bad frame among them."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.acquisition.sinks.sink import Readings

START = 1_700_000_000.0


def make_readings(first: int, count: int, tactels: int = 11, pixels: int = 2048) -> Readings:
    """Every number of the line can be told from its values; line 3 is a bad frame."""
    numbers = np.arange(first, first + count)
    forces = np.multiply.outer(numbers / 1024, np.arange(1.0, 2 * tactels + 1)).reshape(
        -1, tactels, 2
    )
    std = np.full_like(forces, 0.125)
    chi2 = np.ones(count)
    bad = numbers == 3
    forces[bad], std[bad], chi2[bad] = np.nan, np.nan, np.nan
    return Readings(
        first=first,
        timestamps=START + numbers / 1024,
        forces=forces,
        std=std,
        chi2=chi2,
        status=tuple(ff.Status.BAD_FRAME if one else ff.Status.OK for one in bad),
        lines=np.repeat(numbers[:, None] % 251, pixels, axis=1).astype(np.uint8),
    )


@pytest.fixture
def blocks() -> list[Readings]:
    """20 lines in 5 blocks."""
    return [make_readings(first, 4) for first in range(0, 20, 4)]


@pytest.fixture
def whole() -> Readings:
    """The same lines in one piece."""
    return make_readings(0, 20)
