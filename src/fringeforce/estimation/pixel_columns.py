"""Pixels in columns of those that lie between the same nodes, so that loops run over whole rows.

A column has a row for each step between nodes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import apart, sums
from fringeforce.estimation.frame_model import FrameModel

Single = NDArray[np.float32]


class Pixels(NamedTuple):
    """What the loops need of the pixels, in single precision; T rows, R columns, C channels.

    Attributes
    ----------
    order : ndarray of int, shape (C T R,)
        The pixel at each place, any one where there is none.
    place : ndarray of int, shape (P / C,)
        The place of each pixel of one channel.
    used : ndarray, shape (C T R,)
        1 where a pixel counts, 0 where not.
    amplitude, offset : ndarray, shape (C T R,)
        As of `FrameModel`.
    shares : ndarray, shape (T, 4, R)
        What the nodes count between which a pixel lies; zero where there is none.
    first : int
        First node of the first column.
    even_out : ndarray, shape (C, R)
        One over the root of the number of used pixels of each column; zero if there is none.
    bright, dark : ndarray, shape (modes of light, C m)
        As `brightness` and `darkness`.
    even : bool
        Whether these are the same all over each channel.
    """

    order: NDArray[np.int32]
    place: NDArray[np.int32]
    used: Single
    amplitude: Single
    offset: Single
    shares: Single
    first: int
    even_out: Single
    bright: Single
    dark: Single
    even: bool


def pixels_of(model: FrameModel, used: NDArray[np.bool_]) -> Pixels:
    """What the loops need of the pixels, of which some are used, shape (P,)."""
    channels = len(model.bias)
    count = len(model.amplitude) // channels
    first = model.first[:count]
    column = first - first[0]
    row = np.arange(count) - np.searchsorted(first, first)
    shape = int(row.max()) + 1, int(column.max()) + 1
    place = (row * shape[1] + column).astype(np.int32)
    size = shape[0] * shape[1]
    order, known = np.zeros(channels * size, np.int32), np.zeros(channels * size, bool)
    for c in range(channels):
        order[c * size + place], known[c * size + place] = c * count + np.arange(count), True
    shares = np.zeros((shape[0], 4, shape[1]), np.float32)
    shares[row, :, column] = model.weights[:count]
    own = known & used[order]
    light = np.concatenate([model.brightness, model.darkness]).reshape(
        -1, channels, len(model.fixed)
    )
    number = own.reshape(channels, *shape).sum(axis=1)
    return Pixels(
        order,
        place,
        own.astype(np.float32),
        np.where(known, model.amplitude[order], 0.0).astype(np.float32),
        np.where(known, model.offset[order], 0.0).astype(np.float32),
        shares,
        int(first[0]),
        (np.where(number > 0, 1 / np.sqrt(np.maximum(number, 1)), 0)).astype(np.float32),
        model.brightness.astype(np.float32),
        model.darkness.astype(np.float32),
        not len(light) or bool(np.ptp(light, axis=2).max() < 1e-9),
    )


@apart
def interpolate(pixels, nodes, out):
    """Values at the pixels of one channel, from those at the nodes."""
    rows, _, columns = pixels.shares.shape
    f = pixels.first
    a, b, c, d = (
        nodes[f : f + columns],
        nodes[f + 1 : f + 1 + columns],
        nodes[f + 2 : f + 2 + columns],
        nodes[f + 3 : f + 3 + columns],
    )
    for t in range(rows):
        w, line = pixels.shares[t], out[t * columns : (t + 1) * columns]
        w0, w1, w2, w3 = w[0], w[1], w[2], w[3]
        for r in range(columns):
            line[r] = (w0[r] * a[r] + w1[r] * b[r]) + (w2[r] * c[r] + w3[r] * d[r])


@apart
def gather(pixels, values, out):
    """Add what the nodes get of the pixels: the transpose of `interpolate`."""
    rows, _, columns = pixels.shares.shape
    total = np.zeros((4, columns), np.float32)
    a, b, c, d = total[0], total[1], total[2], total[3]
    for t in range(rows):
        w, line = pixels.shares[t], values[t * columns : (t + 1) * columns]
        w0, w1, w2, w3 = w[0], w[1], w[2], w[3]
        for r in range(columns):
            value = line[r]
            a[r] += w0[r] * value
            b[r] += w1[r] * value
            c[r] += w2[r] * value
            d[r] += w3[r] * value
    for k in range(4):
        line, own = out[pixels.first + k : pixels.first + k + columns], total[k]
        for r in range(columns):
            line[r] += own[r]


@sums
def in_line(pixels, values, out):
    """Values of one channel, pixel after pixel."""
    for p in range(len(pixels.place)):
        out[p] = values[pixels.place[p]]


@sums
def in_columns(pixels, line, out):
    """The same in columns; any number where there is no pixel."""
    for k in range(len(out)):
        out[k] = line[pixels.order[k]]


@apart
def _padded_sum(padded, kernel, size, out):
    """Sums of a padded line times a symmetric kernel, four steps at a time."""
    reach = len(kernel) - 1
    middle = kernel[0]
    for p in range(size):
        out[p] = middle * padded[reach + p]
    step = 1
    while step + 3 <= reach:
        a, b, c, d = kernel[step], kernel[step + 1], kernel[step + 2], kernel[step + 3]
        left = padded[reach - step - 3 : reach - step - 3 + size + 3]
        right = padded[reach + step : reach + step + size + 3]
        for p in range(size):
            out[p] += (a * (left[p + 3] + right[p]) + b * (left[p + 2] + right[p + 1])) + (
                c * (left[p + 1] + right[p + 2]) + d * (left[p] + right[p + 3])
            )
        step += 4
    for last in range(step, reach + 1):
        a = kernel[last]
        left, right = padded[reach - last : reach - last + size], padded[reach + last :]
        for p in range(size):
            out[p] += a * (left[p] + right[p])


@apart
def smear(line, kernel, padded, out):
    """A line behind a symmetric kernel; what lies beyond its ends is as the ends are."""
    size, reach = len(line), len(kernel) - 1
    for p in range(size):
        padded[reach + p] = line[p]
    for k in range(reach):
        padded[k] = line[0]
        padded[reach + size + k] = line[size - 1]
    _padded_sum(padded, kernel, size, out)


@apart
def smear_back(line, kernel, padded, out):
    """The transpose of `smear`."""
    size, reach = len(line), len(kernel) - 1
    for k in range(reach):
        padded[k] = 0
        padded[reach + size + k] = 0
    for p in range(size):
        padded[reach + p] = line[p]
    _padded_sum(padded, kernel, size, out)
    # what went beyond the ends belongs to them
    for k in range(1, reach + 1):
        for step in range(k, reach + 1):
            out[0] += kernel[step] * line[step - k]
            out[size - 1] += kernel[step] * line[size - 1 - step + k]
