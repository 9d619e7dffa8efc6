"""HDF5 files that are being recorded, or whose recorder was killed, as if they had been closed.

The library refuses a file that is marked as open for writing unless it may wait for a writer, and
of a damaged file it waits for ever: after each of a hundred tries twice as long as before.  So the
mark is taken off what it reads.  The mark, the end of the file and a checksum stand in the first 48
bytes, the superblock of version 3; see "HDF5 File Format Specification", section II.A.
"""

from __future__ import annotations

import io
import os
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from typing_extensions import Buffer

SIGNATURE = b"\x89HDF\r\n\x1a\n\x03\x08\x08"
"""What the superblock begins with: version 3, addresses and lengths of 8 bytes."""
MARK, END, CHECKSUM, LENGTH = 11, 28, 44, 48
"""Where the mark, the end of the file and the checksum of what is before it stand, and its end."""
ROOM = 1 << 40
"""Bytes by which it may grow while it is read; what lies beyond its end has no right checksum."""
WORD = 0xFFFFFFFF


class UnclosedFile(io.FileIO):
    """The content of a file, its superblock as that of a longer file that was closed.

    Raises
    ------
    OSError
        If it does not begin with such a superblock, or this one is damaged.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        super().__init__(os.fspath(path), "rb")
        start = bytearray(self.read(LENGTH))
        if (
            len(start) < LENGTH
            or not start.startswith(SIGNATURE)
            or _checksum(start) != _said(start)
        ):
            self.close()
            raise OSError("its superblock is damaged, or of another kind")
        start[MARK] = 0
        self._end = os.fstat(self.fileno()).st_size + ROOM
        start[END : END + 8] = self._end.to_bytes(8, "little")
        self._start = bytes(start[:CHECKSUM]) + _checksum(start).to_bytes(4, "little")

    def seek(self, offset: int, whence: int = os.SEEK_SET, /) -> int:
        """Go to a place; the end is where the library may look, for the file grows."""
        if whence == os.SEEK_END:
            return super().seek(self._end + offset)
        return super().seek(offset, whence)

    def readinto(self, buffer: Buffer, /) -> int:
        """Read on into a buffer.

        Behind the last byte that was written all have the value 255, which the library takes for
        no part of its descriptions: for sizes of zero it searches without end.
        """
        at, view = self.tell(), memoryview(buffer).cast("B")
        count = super().readinto(view) or 0
        view[count:] = b"\xff" * (len(view) - count)
        own = self._start[at : at + count]
        view[: len(own)] = own
        return len(view)


def _said(block: Any) -> int:
    return int.from_bytes(block[CHECKSUM:LENGTH], "little")


def _checksum(block: Any) -> int:
    """Bob Jenkins' lookup3 (2006, public domain) of the 44 bytes before the checksum."""
    words = [int.from_bytes(block[k : k + 4], "little") for k in range(0, CHECKSUM, 4)]
    a = b = c = (0xDEADBEEF + CHECKSUM) & WORD
    for k in range(0, 9, 3):
        a, b, c = _mixed(
            *((x + y) & WORD for x, y in zip((a, b, c), words[k : k + 3], strict=True))
        )
    a, b = (a + words[9]) & WORD, (b + words[10]) & WORD
    for turn in (14, 11, 25, 16, 4, 14, 24):
        a, b, c = b, ((c ^ b) - _turned(b, turn)) & WORD, a
    return b


def _turned(word: int, by: int) -> int:
    return (word << by | word >> (32 - by)) & WORD


def _mixed(a: int, b: int, c: int) -> tuple[int, int, int]:
    for turn in (4, 6, 8, 16, 19, 4):
        a = (a - c) & WORD ^ _turned(c, turn)
        c = (c + b) & WORD
        a, b, c = b, c, a
    return a, b, c
