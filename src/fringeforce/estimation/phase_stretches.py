"""Stretches of a phase between multiples of pi, of which light hardly tells the mirror image.

Light of a phase p and of its mirror image about a multiple of pi, 2 k pi - p, is the same.  Along a
stretch whose light noise does not hide, the phase cannot come to the other side from one frame to
the next; from where noise hides it, it can come out on either.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import apart, part, sums, sums_entry
from fringeforce.estimation.frame_model import FrameModel
from fringeforce.estimation.hypotheses import CONFIDENCE, NEGLIGIBLE_LOSS
from fringeforce.estimation.residual_test import square_limit
from fringeforce.estimation.vector_loops import add_products, factorise


class Hidden(NamedTuple):
    """What noise hides of a phase beside multiples of pi.

    Attributes
    ----------
    difference : float
        Of two phases about a multiple; infinite if light tells them apart [rad].
    light : float
        Squared half difference of a bright and a dark fringe over the variance of the noise, summed
        over the pixels of a node.
    least, once : float
        Squared light of a stretch over the noise, in the mean of frames and in a single one, from
        which its mirror image is another reading.
    """

    difference: float
    light: float
    least: float
    once: float

    @classmethod
    def beside(cls, model: FrameModel, smooth: float) -> Hidden:
        """Of a model whose phase is smooth over so many pixels.

        The light A V p^2 / 4 of a phase p beside a multiple of pi, over these pixels, is as large
        as its noise at half the difference.  Its slope is A V p / 2, and the mirror image is 2 p
        away: in deviations that is four times the light.  Loads that differ by less than one
        deviation each, root mean square, are one reading; in one frame among others, those that
        noise and light together take no farther off than noise does once in a thousand.  Where
        fields of phase are uncertain, deviations are larger; there the light must be so strong that
        the phase is not that of the multiple itself.
        """
        light = float(np.mean(model.amplitude / np.sqrt(model.variance))) * model.visibility
        pixels = len(model.amplitude) / len(model.fixed)
        loads, uncertain = model.at.loads, model.at.modes > model.at.fields
        least = NEGLIGIBLE_LOSS if uncertain else loads / 16
        once = (square_limit(loads, 1 - CONFIDENCE) - loads) / 16
        return cls(
            float(4 * np.sqrt(1 / (light * np.sqrt(max(smooth, 1.0))))),
            pixels * light**2 / 4,
            least,
            max(least, once),
        )

    def along(self, nodes: int) -> float:
        """Least difference that light tells of phases about a multiple along so many nodes [rad].

        From there on they are two readings, though noise may hide them from pixel to pixel.
        """
        return float(2 * (4 * self.least / (nodes * self.light)) ** 0.25)


class Stretches(NamedTuple):
    """On which sides of multiples of pi a phase is known to be at m nodes.

    Attributes
    ----------
    sides : ndarray of int, shape (m,)
        Between which multiples it is, floor(p / pi); `OPEN` where noise hides it.
    mean : ndarray, shape (m,)
        Running mean of the phase [rad].
    square : ndarray, shape (m,)
        Running mean of its squared distance to the multiple that is next [rad^2].
    frames : ndarray, shape (1,)
        Frames of these means.
    alone : ndarray of int, shape (m,)
        Sides whose mirror images explain nothing, as was tried; `OPEN` where none was.
    tried : ndarray, shape (m,)
        The phase when they were tried [rad].
    """

    sides: NDArray[np.int64]
    mean: NDArray[np.float64]
    square: NDArray[np.float64]
    frames: NDArray[np.float64]
    alone: NDArray[np.int64]
    tried: NDArray[np.float64]


LONGEST = 4.0
"""Most frames of these means."""
DARK, DARK_ONCE = 0.7, 0.25
"""Light of a phase over its noise up to which it may cross a multiple: for the mean of many frames,
and for one.  Noise alone leaves a mean of 0.40 and a deviation of 0.58 / sqrt(n)."""
UNKNOWN = 1e-6
"""Precision of what nothing tells, of loads [1/N^2]."""
OPEN = -(2**31)
"""Side of a phase that noise hides."""
NOTHING = Hidden(np.inf, 0.0, np.inf, np.inf)
"""Where light tells a phase from its mirror images."""


@part
def _order(phase):
    return int(np.floor(phase / np.pi))


@part
def _off(phase):
    """What is left of a phase to the next multiple of pi."""
    return phase - np.pi * np.floor(phase / np.pi + 0.5)


@sums
def _light(square, hidden):
    """Squared light of a node over the noise, beside that of the multiple of pi that is next.

    1 - cos p is p^2 / 2 - p^4 / 24 to three per cent.
    """
    share = square * (0.5 - square / 24)
    return hidden.light * share * share


@sums
def _open_stretch(nodes, stretches, begin, hidden):
    """End of a stretch of open nodes of one order, and whether its mirror image is another reading.

    The stretch begins at a node; it is empty if that is not open.
    """
    end, light, once, order = begin, 0.0, 0.0, _order(nodes[begin])
    while end < len(nodes) and stretches.sides[end] == OPEN and _order(nodes[end]) == order:
        light += _light(stretches.square[end], hidden)
        once += _light(_off(nodes[end]) ** 2, hidden)
        end += 1
    return end, light > hidden.least or once > hidden.once


@apart
def _close(nodes, stretches, hidden):
    """Take open stretches whose mirror images are other readings to be on their sides."""
    begin = 0
    while begin < len(nodes):
        end, another = _open_stretch(nodes, stretches, begin, hidden)
        if another:
            stretches.sides[begin:end] = _order(nodes[begin])
        begin = max(end, begin + 1)


@sums_entry
def stretches_of(nodes, hidden):
    """On which sides of multiples of pi a phase is as one frame tells it.

    Parameters
    ----------
    nodes : ndarray, shape (m,)
        The phase [rad].
    hidden : Hidden
        What noise hides of it.

    Returns
    -------
    Stretches
    """
    sides, square = np.full(len(nodes), OPEN, np.int64), np.empty(len(nodes))
    for k in range(len(nodes)):
        square[k] = _off(nodes[k]) ** 2
    alone = np.full(len(nodes), OPEN, np.int64)
    stretches = Stretches(sides, nodes.copy(), square, np.ones(1), alone, nodes.copy())
    _close(nodes, stretches, hidden)
    return stretches


@sums_entry
def motion(nodes, before):
    """How far a phase moved where its light changes with it, |sin| > 1/2 [rad].

    Beside multiples of pi noise moves it as well.

    Parameters
    ----------
    nodes, before : ndarray, shape (m,)
        The phase, now and before [rad].

    Returns
    -------
    float
    """
    way = 0.0
    for k in range(len(nodes)):
        sine = np.sin(nodes[k])
        if sine * sine > 0.25:
            way = max(way, abs(nodes[k] - before[k]))
    return way


@apart
def _still(nodes, before, hidden):
    """Whether a phase moved by a quarter of what noise hides at most."""
    way = 0.0
    for k in range(len(nodes)):
        way = max(way, abs(nodes[k] - before[k]))
    return 4 * way < hidden.difference or 4 * motion(nodes, before) < hidden.difference


@sums_entry
def crossed(nodes, sides, square, hidden):
    """Whether light tells a phase from what is known of it: that it is on the other side.

    Parameters
    ----------
    nodes : ndarray, shape (m,)
        The phase [rad].
    sides : ndarray of int, shape (m,)
        Between which multiples of pi it is known to be, as of `Stretches`.
    square : ndarray, shape (m,)
        Squared distance to the next multiple where that is known [rad^2]; light tells a stretch if
        it does so of both sides.
    hidden : Hidden
        What noise hides of it.

    Returns
    -------
    bool
    """
    light = 0.0
    for k in range(len(nodes)):
        if sides[k] != OPEN and sides[k] != _order(nodes[k]):
            light += _light(min(square[k], _off(nodes[k]) ** 2), hidden)
    return light > hidden.least


@apart
def _renewed(nodes, stretches, hidden):
    """Take a phase into what is known of its sides; they are open where it may have crossed.

    The means are over frames in which it hardly moved: what crosses a multiple is hidden for
    longer.
    """
    sides, mean, square, frames = (
        stretches.sides,
        stretches.mean,
        stretches.square,
        stretches.frames,
    )
    frames[0] = min(frames[0] + 1, LONGEST) if _still(nodes, mean, hidden) else 1.0
    dark = DARK + (DARK_ONCE - DARK) / frames[0]
    for k in range(len(nodes)):
        mean[k] += (nodes[k] - mean[k]) / frames[0]
        square[k] += (_off(nodes[k]) ** 2 - square[k]) / frames[0]
        if sides[k] != OPEN and sides[k] != _order(nodes[k]):
            sides[k], square[k] = OPEN, _off(nodes[k]) ** 2
        if square[k] < DARK_ONCE * (hidden.difference / 2) ** 2:
            sides[k] = OPEN
    begin = 0
    while begin < len(nodes):
        end, light = begin + 1, _light(square[begin], hidden)
        while end < len(nodes) and sides[end] == sides[begin]:
            light += _light(square[end], hidden)
            end += 1
        if light < dark**2:
            sides[begin:end] = OPEN
        begin = end


@apart
def _may_cross(nodes, stretches, begin, end, hidden, columns, precision):
    """Whether bright light, and what is known before it, leave both sides to a stretch.

    Only light that changes with the phase, |sin| > 1/2, tells of the unknowns to first order.  The
    mirror image of where the stretch is farthest from its multiple is so many deviations away.
    Where it explained nothing a short way before, it does not now.
    """
    size, peak = len(columns), begin
    for k in range(begin, end):
        if abs(_off(nodes[k])) > abs(_off(nodes[peak])):
            peak = k
    if stretches.alone[peak] == _order(nodes[peak]) and _still(nodes, stretches.tried, hidden):
        return False
    light, own = np.zeros(len(nodes)), np.empty(len(nodes))
    for k in range(len(nodes)):
        sine = np.sin(nodes[k])
        if sine * sine > 0.25 and not begin <= k < end:
            light[k] = hidden.light * sine * sine
    known, halves = np.zeros((size, size)), np.zeros(size)
    for a in range(size):
        column, rows = columns[a], a // 4 * 4 + 4
        for k in range(len(nodes)):
            own[k] = light[k] * column[k]
        known[a, a] = precision[a]
        add_products(columns[:rows], own, known[a])
    factorise(known, size, UNKNOWN)
    variance = 0.0
    for a in range(size):
        rest = np.float64(columns[a, peak])
        for b in range(a):
            rest -= known[a, b] * halves[b]
        halves[a] = rest / known[a, a]
        variance += halves[a] * halves[a]
    return 4 * _off(nodes[peak]) ** 2 < NEGLIGIBLE_LOSS * variance


@sums_entry
def emerged(nodes, stretches, hidden, columns, precision):
    """Whether a stretch of a phase came out of what noise hides on a side that it may have missed.

    Then its mirror image is another reading, and neither bright light nor what is known before it
    excludes it.  A stretch of which they do is known to be on its side.

    Parameters
    ----------
    nodes : ndarray, shape (m,)
        The phase [rad].
    stretches : Stretches
        On which sides it is known to be; brought up to date.
    hidden : Hidden
        What noise hides of the phase.
    columns : ndarray, shape (R, m)
        Change of the phase with every unknown; rows of zeros up to a multiple of four.
    precision : ndarray, shape (R,)
        Of what is known of every unknown whatever the loads are.

    Returns
    -------
    bool
    """
    if not np.isfinite(hidden.difference):
        return False
    if crossed(nodes, stretches.sides, stretches.square, hidden):
        return True  # a step of a fit did, which the phase cannot from one frame to the next
    _renewed(nodes, stretches, hidden)
    begin = 0
    while begin < len(nodes):
        end, another = _open_stretch(nodes, stretches, begin, hidden)
        if another:
            if _may_cross(nodes, stretches, begin, end, hidden, columns, precision):
                return True
            stretches.sides[begin:end] = _order(nodes[begin])
        begin = max(end, begin + 1)
    return False


def undecided_nodes(nodes: NDArray[np.floating], sides: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Where a phase at nodes (m,) is not on the side (m,) on which it is known to be."""
    return sides != sides_of(nodes)


def sides_of(nodes: NDArray[np.floating]) -> NDArray[np.int64]:
    """Between which multiples of pi a phase at nodes (m,) is, whether light tells it or not."""
    return np.floor(nodes / np.pi).astype(np.int64)


@sums_entry
def close(nodes, stretches, hidden, far):
    """Take a phase to be on its sides where these were open, as no mirror image has weight.

    Parameters
    ----------
    nodes : ndarray, shape (m,)
        The phase [rad].
    stretches : Stretches
        On which sides it is known to be; brought up to date.
    hidden : Hidden
        What noise hides of the phase.
    far : bool
        Whether mirror images will have none while the phase hardly moves.
    """
    if far:
        if not _still(nodes, stretches.tried, hidden):
            stretches.alone[:] = OPEN
            for k in range(len(nodes)):
                stretches.tried[k] = nodes[k]
        for k in range(len(nodes)):
            if stretches.sides[k] == OPEN:
                stretches.alone[k] = _order(nodes[k])
    _close(nodes, stretches, hidden)
