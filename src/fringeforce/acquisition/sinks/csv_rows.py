"""Rows of numbers as text, in compiled loops: a fast camera's readings are millions of cells."""

from __future__ import annotations

from math import floor, isinf, isnan, log10
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

DIGITS = 6
"""Significant digits of a number."""
CELL = 24
"""Bytes that hold any cell and what follows it."""
_COMMA, _MINUS, _PLUS, _POINT, _ZERO, _E = (ord(sign) for sign in ",-+.0e")
_NAN, _INF = (np.frombuffer(word, np.uint8) for word in (b"nan", b"inf"))
_RETURN, _FEED = 13, 10
_TENS = 10.0 ** np.arange(-300, 309)


def rows(first: int, timestamps: Any, numbers: Any, words: NDArray[np.bytes_]) -> bytes:
    r"""Rows of a table: line, tactel from one, time to a microsecond, numbers as by %.6g, a word.

    Parameters
    ----------
    first : int
        Running number of the first line.
    timestamps : ndarray, shape (k,)
        Times, the same for all tactels of a line [s].
    numbers : ndarray, shape (k, n, c)
        Cells of every tactel of every line.
    words : ndarray of bytes, shape (k,)
        The last cell of every line.
    """
    k, n, columns = numbers.shape
    letters = np.ascontiguousarray(words).view(np.uint8).reshape(k, -1)
    text = np.empty(k * n * ((columns + 3) * CELL + letters.shape[1] + 2), dtype=np.uint8)
    times, cells = np.array(timestamps, float), np.ascontiguousarray(numbers, float)
    return text[: _rows(first, times, cells, letters, text)].tobytes()


def prepare() -> None:
    """Compile the loops, or load them, which may take longer than a sink has to finish."""
    rows(0, np.zeros(1), np.zeros((1, 1, 1)), np.array([b"OK"]))


@njit(cache=True, nogil=True)
def _rows(first, timestamps, numbers, letters, text) -> int:
    end = 0
    for i in range(numbers.shape[0]):
        for j in range(numbers.shape[1]):
            end = _separate(text, _whole(text, end, first + i))
            end = _separate(text, _whole(text, end, j + 1))
            end = _separate(text, _moment(text, end, timestamps[i]))
            for value in numbers[i, j]:
                end = _separate(text, _number(text, end, value))
            for letter in letters[i]:
                if letter:
                    text[end] = letter
                    end += 1
            text[end], text[end + 1] = _RETURN, _FEED
            end += 2
    return end


@njit(cache=True)
def _separate(text, end) -> int:
    text[end] = _COMMA
    return end + 1


@njit(cache=True)
def _digits(text, end, value, count) -> int:
    """So many digits of a whole number."""
    for place in range(end + count - 1, end - 1, -1):
        text[place] = _ZERO + value % 10
        value //= 10
    return end + count


@njit(cache=True)
def _whole(text, end, value) -> int:
    if value < 0:
        text[end], end, value = _MINUS, end + 1, -value
    count, rest = 1, value // 10
    while rest:
        count, rest = count + 1, rest // 10
    return _digits(text, end, value, count)


@njit(cache=True)
def _moment(text, end, value) -> int:
    """A time with six decimals."""
    seconds = floor(value)
    micro = np.int64(np.rint((value - seconds) * 1e6))
    end = _whole(text, end, np.int64(seconds) + micro // 1000000)
    text[end] = _POINT
    return _digits(text, end + 1, micro % 1000000, 6)


@njit(cache=True)
def _number(text, end, value) -> int:
    """A number as by %.6g."""
    if np.signbit(value) and not isnan(value):
        text[end], end, value = _MINUS, end + 1, -value
    if isnan(value) or isinf(value):
        for letter in _NAN if isnan(value) else _INF:
            text[end] = letter
            end += 1
        return end
    if value < _TENS[0]:
        text[end] = _ZERO
        return end + 1
    power = np.int64(floor(log10(value)))
    scaled = _scaled(value, power)
    if scaled < 10 ** (DIGITS - 1):
        power -= 1
        scaled = _scaled(value, power)
    elif scaled >= 10**DIGITS:
        power, scaled = power + 1, 10 ** (DIGITS - 1)
    shown = DIGITS
    while shown > 1 and scaled % 10 == 0:
        scaled, shown = scaled // 10, shown - 1
    if -4 <= power < DIGITS:
        return _plain(text, end, scaled, shown, power)
    end = _plain(text, end, scaled, shown, 0)
    text[end], text[end + 1] = _E, _MINUS if power < 0 else _PLUS
    return _digits(text, end + 2, abs(power), 3 if abs(power) > 99 else 2)


@njit(cache=True)
def _scaled(value, power) -> int:
    """The digits of a number as a whole one; divided where the power of ten is exact that way."""
    shift = DIGITS - 1 - power
    if shift < 0:
        return int(np.rint(value / _TENS[300 - shift]))
    return int(np.rint(value * _TENS[300 + min(shift, 308)]))


@njit(cache=True)
def _plain(text, end, scaled, shown, power) -> int:
    """Digits with a point behind the one that stands for ten to the power of none."""
    if power < 0:
        text[end], text[end + 1] = _ZERO, _POINT
        end = _digits(text, end + 2, 0, -power - 1)
        return _digits(text, end, scaled, shown)
    if shown <= power + 1:
        for _ in range(power + 1 - shown):
            scaled *= 10
        return _digits(text, end, scaled, power + 1)
    behind = shown - power - 1
    unit = 10**behind
    end = _digits(text, end, scaled // unit, power + 1)
    text[end] = _POINT
    return _digits(text, end + 1, scaled % unit, behind)
