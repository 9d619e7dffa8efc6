"""Checksums of the rows of recordings, each of which is written once with its row.

A checksum of a block of rows, as HDF5's Fletcher-32 is, has to be written again with each row that
joins the block: a recorder that is killed between the two leaves a block that cannot be read, with
rows in it that were acknowledged.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Sequence
from math import prod
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from fringeforce.base.errors import FileFormatError
from fringeforce.base.storage import dataset, read

CHECKSUMS = ("numbers_crc32", "grey_crc32")
"""Names of the checksums of rows in a recording: of all numbers of a frame, and of its picture."""
COVERED = "columns"
"""Attribute of checksums: names of the columns whose bytes they are of, in this order."""


def rows_crc32(columns: Sequence[NDArray[Any]]) -> NDArray[np.uint32]:
    """CRC-32 of each row of some columns: of the bytes of the first, of the next and so on.

    Parameters
    ----------
    columns : sequence of ndarray, shapes (k, ...)
        Values as they are stored.

    Returns
    -------
    ndarray, shape (k,)
        CRC-32 as of zlib, gzip and PNG (ISO 3309).
    """
    count = len(columns[0])
    sizes = (prod(one.shape[1:]) for one in columns)  # there may be no rows
    parts = [
        np.ascontiguousarray(one).reshape(count, size).view(np.uint8)
        for one, size in zip(columns, sizes, strict=True)
    ]
    rows = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)
    return np.fromiter((zlib.crc32(row.data) for row in rows), np.uint32, count)


def read_rows(file: h5py.File, name: str, path: str | os.PathLike[str]) -> NDArray[Any]:
    """A column of frames: its rows that were completed, by their checksums if they have any.

    The running number of a frame is written after all else of it, so that the rows behind the last
    number are those that a killed recorder had not acknowledged.

    Raises
    ------
    FileFormatError
        If a row differs from its checksum.
    """
    count = dataset(file, "frame").shape[0]
    for checksum in CHECKSUMS:
        covered = str(dataset(file, checksum).attrs[COVERED]).split() if checksum in file else []
        if name in covered:
            columns = {one: dataset(file, one)[:count] for one in covered}
            wrong = rows_crc32(list(columns.values())) != dataset(file, checksum)[:count]
            if wrong.any():
                raise FileFormatError(
                    f"{os.fspath(path)} is damaged: {np.count_nonzero(wrong)} of {count} frames "
                    f"differ from their checksums, first number {np.argmax(wrong)} (from 0); "
                    "restore it from a copy."
                )
            return columns[name]
    return read(file, name)[:count]
