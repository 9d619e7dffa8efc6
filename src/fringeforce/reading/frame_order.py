"""Frames that fit in another order of channels or pixels, or with another camera response."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import permutations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Index, Mask
from fringeforce.reading.frame_reader import FrameReader
from fringeforce.reading.reading import Status

FITS = "The frame fits if {how}; give frames as the design has them, or change the design."
ENCODED = (
    'The frame fits if the camera\'s response is {response}; set response = "{response}" under '
    "[camera]."
)
Orders = Iterable[tuple[str, Index]]
"""Ways in which frames may come, in words, each with the numbers of the pixels that it shows."""


def fitting_order(
    single: FrameReader, levels: NDArray[Any], used: Mask, orders: Orders
) -> tuple[str, ...]:
    """What is said of a frame that loads explain in another order of its channels or pixels.

    Parameters
    ----------
    single : FrameReader
        What reads single frames.
    levels : ndarray, shape (P,)
        Grey levels that no loads explain.
    used : ndarray of bool, shape (P,)
        Pixels that count.
    orders : iterable
        Those that are tried.

    Returns
    -------
    tuple of str
        A sentence, or nothing.
    """
    for how, order in orders:
        own = order.ravel()
        if single.search(levels[own], used[own]).status is Status.OK:
            return (FITS.format(how=how),)
    return ()


def encoding_otherwise(single: FrameReader) -> FrameReader:
    """What reads frames of a camera that encodes light in the way that the design does not say.

    Scientific cameras are linear; webcams, phones and their pictures are sRGB.
    """
    sensor = single.model.sensor
    other = "linear" if sensor.camera.response == "sRGB" else "sRGB"
    model = replace(single.model, sensor=sensor.replace(**{"camera.response": other}))
    return replace(single, model=model)


def fitting_response(other: FrameReader, levels: NDArray[Any], used: Mask) -> tuple[str, ...]:
    """What is said of a frame that loads explain if the camera encodes light otherwise.

    Parameters
    ----------
    other : FrameReader
        As of `encoding_otherwise`.
    levels, used
        As of `fitting_order`.

    Returns
    -------
    tuple of str
        A sentence, or nothing.
    """
    if other.search(levels, used).status is not Status.OK:
        return ()
    return (ENCODED.format(response=other.model.sensor.camera.response),)


def turned(single: FrameReader) -> Orders:
    """Other ways in which the camera may look at the sensor."""
    return single.turned(_pixels(single))


def with_other_channels(single: FrameReader) -> Iterator[tuple[str, Index]]:
    """Frames with their channels in other orders."""
    pixels = _pixels(single)
    for order in permutations(range(len(pixels))):
        if sorted(order) != list(order):
            numbers = ", ".join(str(k + 1) for k in order)
            yield f"its channels are taken in the order {numbers}", pixels[list(order)]


def _pixels(single: FrameReader) -> Index:
    """Numbers of the pixels of a frame, a row or an image for each channel."""
    shape = single.model.frame_shape
    return np.arange(np.prod(shape)).reshape(-1, *shape[-single.model.sensor.dimensions :])
