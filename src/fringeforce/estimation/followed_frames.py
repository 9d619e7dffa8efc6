"""Frames in a row: from the loads of one to those of the next, in compiled loops.

What lasts from frame to frame stands still here, and only what is new in every frame, the loads f,
is fitted by Gauss and Newton's steps

    f <- f - C (J' r + Lambda f),     C = (J' J + Lambda)^-1,

with residuals r and derivatives J of a point near by, and with an inverse C that is some frames old
(the chord method: Kelley, Iterative Methods for Linear and Nonlinear Equations, 1995, section 5.4).
How far C has aged shows in how much smaller the second step is than the first.  Where the next step
would be too small to count, it is taken without another look at the frame, and the point stays
where it is: a frame of a sensor at rest costs one comparison with grey levels that are known.

Pixels are laid out in columns of those that lie between the same nodes, one column for each step
between nodes, so that all loops run over whole rows.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import part, sums, sums_entry
from fringeforce.estimation.frame_exposure import (
    by_gamma_of,
    encoded,
    fill_columns,
    fill_node_phase,
    lens,
    power_of,
)
from fringeforce.estimation.frame_loss import SOUND, pixel_loss
from fringeforce.estimation.frame_model import FrameModel
from fringeforce.estimation.phase_stretches import Hidden, Stretches, emerged, motion
from fringeforce.estimation.vector_loops import add_products, combine, factorise, invert, waves

Array = NDArray[np.float64]
Single = NDArray[np.float32]

EVALUATIONS = 6
"""Most evaluations of one frame; slow motion takes one."""
AGED = 0.04
"""Ratio of the second step to the first, in deviations, from which the inverse is computed anew."""
RENEWED = 0.1
"""Change of the phase, root mean square, from which it is computed anew in any case [rad]."""
AVERAGING = 0.2
"""Share of a frame in the running mean of that ratio's square."""
LOOKED = 8
"""Frames after which the ratio is looked at in any case."""
DIVERGED = 0.7
"""Ratio from which an inverse does not lead to the top."""
LOAD_GROWTH = 2.0
"""Factor by which normal forces may grow or shrink, root mean square, until what is known of them
before a frame is drawn up anew."""

JUMP = 0.5
"""Change of the phase from frame to frame beyond which a mirror image may be nearer [rad]."""

DONE, AGEING, STALE, ALARM, EMERGED, FAINT, GROWN = range(7)
"""Why the loop ended: no frame is left; the linearisation has aged, after a frame that was read; it
does not lead to the top of the next one; noise does not explain the next one; in it a stretch of
the phase came out of what noise hides; its phase is so small that loads are hardly told from
others; loads have grown or shrunk, after a frame that was read."""


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


class Reference(NamedTuple):
    """A linearisation, and what is known before a frame; a unknowns are new, b last.

    Attributes
    ----------
    columns : ndarray, shape (R, m)
        Change of the phase at the nodes with every unknown; rows of zeros up to a multiple of four.
    fixed : ndarray, shape (m,)
        Phase without loads [rad].
    anchor : ndarray, shape (m,)
        Phase at the nodes where everything was linearised; the loops move it if nothing lasts, when
        they renew the inverse [rad].
    kernel : ndarray, shape (k,)
        One half of the point spread, from its middle; empty if there is none.
    shares, turning : ndarray, shape (C, C + 1)
        Shares of every channel's light in the fringes of each and in their derivative, and what is
        added; shape (0, 1) without cross-talk.
    leaks : ndarray, shape (k, C, C + 1)
        Change of the fringes with each unknown of cross-talk, as shares of the fringes as seen.
    fresh, lasting : ndarray of int, shapes (a,) and (b,)
        Unknowns that are new in every frame, loads first, and the others.
    information : ndarray, shape (a, a)
        Of what is new, prior included; the loops renew that of the loads.
    gain : ndarray, shape (a, a)
        Its inverse C.
    covariance : ndarray, shape (2n, 2n)
        Of the loads of a frame; the loops renew it if nothing lasts [N^2].
    stretches : Stretches
        On which sides of multiples of pi the phase is known to be.
    precision, mean : ndarray, shape (a,)
        What is known of what is new before a frame.
    through : ndarray, shape (a, b)
        Change of what lasts' score with that of what is new.
    score : ndarray, shape (b, b)
        What the loss would fall by a step of what lasts is a quadratic form of its score.
    squares, sums : float
        Sum of squared residuals that noise exceeds at the false-alarm rate, over their number, and
        sum of the squares of their sums over columns.
    drawn : float
        The same of that fall of the loss.
    broken : float
        The same of the number of broken pixels.
    faint : float
        Phase that a frame must reach [rad].
    hidden : Hidden
        What noise hides of a phase beside multiples of pi.
    reached : float
        Squared Mahalanobis distance to the top, what lasts being known, below which it is reached.
    longest : float
        Squared length of the last step, in deviations, up to which it leads to the top.
    far : float
        Change of the phase, root mean square, at which everything is linearised anew [rad].
    size : float
        Normal forces, root mean square, for which the prior was drawn up [N].
    """

    columns: Single
    fixed: Single
    anchor: Single
    kernel: Single
    shares: Single
    turning: Single
    leaks: Single
    fresh: NDArray[np.int64]
    lasting: NDArray[np.int64]
    information: Array
    gain: Array
    covariance: Array
    stretches: Stretches
    precision: Array
    mean: Array
    through: Array
    score: Array
    squares: float
    sums: float
    drawn: float
    broken: float
    faint: float
    hidden: Hidden
    reached: float
    longest: float
    far: float
    size: float


class Standing(NamedTuple):
    """Where the loops stand, and room for what they compute; K = T R places of each channel.

    Attributes
    ----------
    unknowns : ndarray, shape (size,)
        The point at which the rest was evaluated.
    state : ndarray, shape (4,)
        Running mean of the squared ratio of steps; frames since it was looked at; whether that mean
        begins anew; whether the point was evaluated.
    nodes : ndarray, shape (m,)
        Phase at the nodes [rad].
    level, steep, sine, seen, bend, relative : ndarray, shape (C K,)
        Grey level; its derivative by the phase in units of the noise, without a point spread; minus
        the derivative of the fringes by the phase; fringes behind the point spread; slope of the
        response; light relative to the nominal one.
    grey, pull : ndarray, shapes (C K,) and (K,)
        Of the frame, and residuals.
    lead, swing, line, back, padded : ndarray
        Intermediate results.
    pulls : ndarray, shape (m,)
        Of the residuals, at the nodes.
    coefficients, products : ndarray, shape (rows,)
        Loads, and products of columns and pulls.
    gradient : ndarray, shape (size,)
        Of half the loss, without what is known before.
    """

    unknowns: Array
    state: Array
    nodes: Single
    level: Single
    steep: Single
    sine: Single
    seen: Single
    bend: Single
    relative: Single
    grey: Single
    pull: Single
    lead: Single
    swing: Single
    line: Single
    back: Single
    padded: Single
    pulls: Single
    coefficients: Single
    products: Array
    gradient: Array


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


def standing_at(unknowns: Array, pixels: Pixels, reference: Reference) -> Standing:
    """Room for the loops, at a point that is still to be evaluated."""
    rows, nodes = reference.columns.shape
    whole, own = len(pixels.order), pixels.shares.shape[0] * pixels.shares.shape[2]
    longest = max(own, len(pixels.place), nodes)
    state = np.array([AGED**2 / 2, LOOKED, 1.0, 0.0])
    # grey levels and what they are made of, residuals, intermediate results, and the rest
    sizes = [nodes, *[whole] * 7, own, *[longest] * 4, longest + 2 * len(reference.kernel)]
    room: list[Any] = [np.zeros(size, np.float32) for size in (*sizes, nodes, rows)]
    room += [np.zeros(rows), np.zeros(len(unknowns))]
    return Standing(unknowns.copy(), state, *room)


@sums
def _interpolated(pixels, nodes, out):
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


@sums
def _gathered(pixels, values, out):
    """Add what the nodes get of the pixels: the transpose of `_interpolated`."""
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
def _in_line(pixels, values, out):
    """Values of one channel, pixel after pixel."""
    for p in range(len(pixels.place)):
        out[p] = values[pixels.place[p]]


@sums
def _in_columns(pixels, line, out):
    """The same in columns; any number where there is no pixel."""
    for k in range(len(out)):
        out[k] = line[pixels.order[k]]


@sums
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


@sums
def _smeared(line, kernel, padded, out):
    """A line behind a symmetric kernel; what lies beyond its ends is as the ends are."""
    size, reach = len(line), len(kernel) - 1
    for p in range(size):
        padded[reach + p] = line[p]
    for k in range(reach):
        padded[k] = line[0]
        padded[reach + size + k] = line[size - 1]
    _padded_sum(padded, kernel, size, out)


@sums
def _smeared_back(line, kernel, padded, out):
    """The transpose of `_smeared`."""
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


@sums
def _swinging(ratio, bias, spread, lead, sine, swing):
    """Cosine of the phase of a channel, and minus its derivative by the lead; `lead` is scaled."""
    two, one = np.float32(2), np.float32(1)
    for p in range(len(lead)):
        lead[p] = ratio * lead[p]
        s, c = waves(lead[p] + bias)
        swing[p], sine[p] = one - two * s * s, two * s * c
    if spread > 0:
        for p in range(len(lead)):
            share = np.exp(np.float32(-0.5) * (spread * lead[p]) ** 2)
            swing[p] *= share
            sine[p] = share * sine[p] + spread * spread * lead[p] * swing[p]


@sums
def _mix(shares, values):
    """Mix what belongs to the channels, shape (C K,), by the shares of each."""
    own, size = values.copy(), len(values) // len(shares)
    for c in range(len(shares)):
        out = values[c * size : (c + 1) * size]
        out[:] = shares[c, len(shares)]
        for d in range(len(shares)):
            share, line = shares[c, d], own[d * size : (d + 1) * size]
            for p in range(size):
                out[p] += share * line[p]


@sums
def _lit(pixels, modes, c, own, own_dark, work):
    """Fill in light of one channel that varies along the strip."""
    for kind in range(2):
        work[:] = kind == 0
        table = pixels.bright if kind == 0 else pixels.dark
        nodes = slice(c * len(work), (c + 1) * len(work))
        for s in range(len(modes)):
            e, row = np.float32(modes[s]), table[s, nodes]
            for i in range(len(work)):
                work[i] += e * row[i]
        _interpolated(pixels, work, own if kind == 0 else own_dark)


@part
def _stand(model, pixels, reference, standing):
    """Evaluate the point, into `standing`.

    Returns
    -------
    shown : int
        How many nodes have a large phase.
    moved : float
        Mean square of the phase's change from the anchor [rad^2].
    """
    at, unknowns, nodes = model.at, standing.unknowns, standing.nodes
    contrast64, deviation, _ = lens(model, unknowns)
    contrast, half, one = np.float32(contrast64), np.float32(0.5), np.float32(1)
    loads = len(standing.coefficients)
    for k in range(at.loads):
        standing.coefficients[k] = unknowns[k]
    loads = (at.loads + 3) // 4 * 4
    combine(reference.columns[:loads], standing.coefficients, reference.fixed, nodes)
    shown, moved, faint = 0, np.float32(0), np.float32(reference.faint)
    for i in range(len(nodes)):
        shown += 1 if abs(nodes[i]) >= faint else 0
        way = nodes[i] - reference.anchor[i]
        moved += way * way
    modes = unknowns[at.modes : at.visibility]
    inverse = np.float32(1 / np.sqrt(model.variance))
    gamma = power_of(model, unknowns)
    bent = gamma != 1.0 or model.srgb or at.crosstalk > at.gamma
    size = len(standing.pull)
    lead = standing.lead[:size]
    for c in range(len(model.bias)):
        span = slice(c * size, (c + 1) * size)
        ratio, bias = np.float32(model.dispersion[c]), np.float32(model.bias[c])
        _interpolated(pixels, nodes, lead)
        _swinging(
            ratio, bias, np.float32(model.spread[c]), lead, standing.sine[span], standing.seen[span]
        )
    if len(reference.shares) > 0:
        _mix(reference.shares, standing.seen)
        _mix(reference.turning, standing.sine)
    for c in range(len(model.bias)):
        span, ratio = slice(c * size, (c + 1) * size), np.float32(model.dispersion[c])
        amplitude, offset = pixels.amplitude[span], pixels.offset[span]
        level, steep, sine = standing.level[span], standing.steep[span], standing.sine[span]
        seen, relative = standing.seen[span], standing.relative[span]
        if deviation > 0:
            line, out = standing.line[: len(pixels.place)], standing.back[: len(pixels.place)]
            _in_line(pixels, seen, line)
            _smeared(line, reference.kernel, standing.padded, out)
            _in_columns(pixels, out, seen)
        if pixels.even:
            bright, dark, first = one, np.float32(0), c * len(nodes)
            for s in range(len(modes)):
                bright += np.float32(modes[s] * model.brightness[s, first])
                dark += np.float32(modes[s] * model.darkness[s, first])
            for p in range(size):
                strong = amplitude[p] * bright
                relative[p] = strong
                level[p] = (offset[p] + dark) + strong * half * (one - contrast * seen[p])
        else:
            _lit(pixels, modes, c, relative, level, standing.pulls)
            for p in range(size):
                strong = amplitude[p] * relative[p]
                relative[p] = strong
                level[p] = (offset[p] + level[p]) + strong * half * (one - contrast * seen[p])
        factor = inverse * half * contrast * ratio
        for p in range(size):
            steep[p] = factor * relative[p] * sine[p]
        if bent:
            bend = standing.bend[span]
            for p in range(size):
                grey, slope = encoded(model, gamma, np.float64(level[p]))
                level[p], bend[p] = grey, slope
                steep[p] *= bend[p]
    return shown, moved / np.float32(len(nodes))


@sums
def _rests(level, grey, used, inverse, limits, pull):
    """Residuals in units of the noise, sum of their squares, how many are far off or clipped."""
    total, far, (limit, floor, ceiling) = np.float32(0), np.int32(0), limits
    for p in range(len(pull)):
        rest = (level[p] - grey[p]) * inverse * used[p]
        pull[p] = rest
        total += rest * rest
    for p in range(len(pull)):
        odd = (pull[p] * pull[p] >= limit) | (grey[p] <= floor) | (grey[p] >= ceiling)
        far += np.int32(odd)
    return total, far


@sums
def _summed(pull, scale, rows):
    """Sum of the squared sums over the columns of one channel."""
    total, columns = np.float32(0), len(scale)
    line = np.zeros(columns, np.float32)
    for t in range(rows):
        row = pull[t * columns : (t + 1) * columns]
        for r in range(columns):
            line[r] += row[r]
    for r in range(columns):
        value = line[r] * scale[r]
        total += value * value
    return total


@part
def _compare(model, pixels, reference, standing, whole):
    """Fill in the gradient of half the loss; sums of squares, their number, and of squared sums.

    Where it is not `whole`, that of the loads only, and of the light that drifts.
    """
    at, unknowns, gradient = model.at, standing.unknowns, standing.gradient
    contrast64, deviation, by_blur = lens(model, unknowns)
    contrast, half, one = np.float32(contrast64), np.float32(0.5), np.float32(1)
    size = len(standing.pull)
    gamma = power_of(model, unknowns)
    bent = gamma != 1.0 or model.srgb or at.crosstalk > at.gamma
    lights = at.size > at.modes and (whole or len(reference.fresh) > at.loads)
    inverse, sigma = np.float32(1 / np.sqrt(model.variance)), np.sqrt(model.variance)
    limits = np.float32(SOUND * SOUND), np.float32(model.floor), np.float32(model.ceiling)
    pulls, pull, back = standing.pulls, standing.pull, standing.back[:size]
    gradient[:] = 0.0
    pulls[:] = np.float32(0)
    squares = counted = grouped = 0.0
    by_visibility = by_width = by_power = 0.0
    for c in range(len(model.bias)):
        span = slice(c * size, (c + 1) * size)
        level, grey, used = standing.level[span], standing.grey[span], pixels.used[span]
        relative, seen, bend = standing.relative[span], standing.seen[span], standing.bend[span]
        total, far = _rests(level, grey, used, inverse, limits, pull)
        known = 0.0
        if far > 0:
            limit, floor, ceiling = limits
            for p in range(size):
                odd = (pull[p] * pull[p] >= limit) | (grey[p] <= floor) | (grey[p] >= ceiling)
                if not odd or used[p] == 0:
                    continue
                total -= pull[p] * pull[p]
                known -= 1.0
                _, force, weight = pixel_loss(
                    model, np.float64(grey[p]), np.float64(level[p]), sigma
                )
                pull[p] = force
                if weight > 0:
                    total += np.float32(force * force / weight)
                    known += weight
        squares += total
        counted += known
        grouped += _summed(pull, pixels.even_out[c], len(pixels.shares))
        if bent:
            for p in range(size):
                if at.crosstalk > at.gamma:
                    by_power += pull[p] * by_gamma_of(model, unknowns, np.float64(level[p]))
        if lights:
            _light_pulled(model, pixels, reference, standing, c)
            vis = np.float32(0)
            for p in range(size):
                strong = pull[p] * (bend[p] if bent else one) * inverse * relative[p]
                vis += strong * seen[p]
            by_visibility -= 0.5 * model.visibility_std * vis
            for k in range(len(reference.leaks)):
                leak, leaked = reference.leaks[k, c], np.float32(0)
                for p in range(size):
                    strong = pull[p] * (bend[p] if bent else one) * inverse * relative[p]
                    change = leak[len(leak) - 1]
                    for d in range(len(leak) - 1):
                        change += leak[d] * standing.seen[d * size + p]
                    leaked += strong * change
                gradient[at.crosstalk + k] -= half * contrast * leaked
        if deviation > 0:
            count = len(pixels.place)
            line, out = standing.line[:count], standing.lead[:count]
            for p in range(size):
                back[p] = pull[p] * (bend[p] if bent else one) * inverse * relative[p]
            _in_line(pixels, back, line)
            if whole and at.gamma > at.blur:
                fringes, blurring = standing.swing[:count], np.float32(0)
                _in_line(pixels, seen, fringes)
                for p in range(1, count - 1):
                    curve = fringes[p - 1] + fringes[p + 1] - np.float32(2) * fringes[p]
                    blurring += line[p] * curve
                blurring += line[0] * (fringes[1] - fringes[0])
                blurring += line[count - 1] * (fringes[count - 2] - fringes[count - 1])
                by_width -= 0.5 * contrast * deviation * by_blur * blurring
            _smeared_back(line, reference.kernel, standing.padded, out)
            _in_columns(pixels, out, back)
            factor, sine = half * contrast * np.float32(model.dispersion[c]), standing.sine[span]
            for p in range(size):
                back[p] *= sine[p] * factor
        else:
            steep = standing.steep[span]
            for p in range(size):
                back[p] = pull[p] * steep[p]
        _gathered(pixels, back, pulls)
    products = standing.products
    products[:] = 0.0
    rows = len(products) if whole else (at.loads + 3) // 4 * 4
    add_products(reference.columns[:rows], pulls, products)
    for k in range(len(gradient)):
        gradient[k] += products[k]
    if at.blur > at.visibility:
        gradient[at.visibility] = by_visibility
    if at.gamma > at.blur:
        gradient[at.blur] = by_width
    if at.crosstalk > at.gamma:
        gradient[at.gamma] = by_power * model.gamma_std / np.sqrt(model.variance)
    return squares, counted, grouped


@sums
def _light_pulled(model, pixels, reference, standing, c):
    """Add the gradient of half the loss by modes of light, of one channel."""
    at, unknowns, gradient, pull = model.at, standing.unknowns, standing.gradient, standing.pull
    modes, size = at.visibility - at.modes, len(standing.pull)
    if modes == 0:
        return
    span = slice(c * size, (c + 1) * size)
    contrast, half, one = np.float32(lens(model, unknowns)[0]), np.float32(0.5), np.float32(1)
    inverse = np.float32(1 / np.sqrt(model.variance))
    gamma = power_of(model, unknowns)
    bent = gamma != 1.0 or model.srgb or at.crosstalk > at.gamma
    amplitude, seen, bend = pixels.amplitude[span], standing.seen[span], standing.bend[span]
    if pixels.even:
        by_bright, by_dark = np.float32(0), np.float32(0)
        for p in range(size):
            force = pull[p] * (bend[p] if bent else one) * inverse
            by_dark += force
            by_bright += force * amplitude[p] * (one - contrast * seen[p])
        first = c * len(standing.nodes)
        for s in range(modes):
            gradient[at.modes + s] += 0.5 * by_bright * model.brightness[s, first]
            gradient[at.modes + s] += by_dark * model.darkness[s, first]
        return
    back, lead = standing.back[:size], standing.lead[:size]
    light = np.zeros((2, len(standing.nodes)), np.float32)
    for p in range(size):
        force = pull[p] * (bend[p] if bent else one) * inverse
        lead[p] = force
        back[p] = force * amplitude[p] * half * (one - contrast * seen[p])
    _gathered(pixels, back, light[0])
    _gathered(pixels, lead, light[1])
    nodes = slice(c * len(standing.nodes), (c + 1) * len(standing.nodes))
    for s in range(modes):
        bright, dark = pixels.bright[s, nodes], pixels.dark[s, nodes]
        for i in range(len(standing.nodes)):
            gradient[at.modes + s] += light[0, i] * bright[i]
            gradient[at.modes + s] += light[1, i] * dark[i]


@sums
def _load(pixels, standing, frame, nothing):
    """Lay a frame out; what is not used may be no number."""
    grey = standing.grey
    for k in range(len(grey)):
        value = frame[pixels.order[k]]
        grey[k] = value if pixels.used[k] > 0 else nothing


@sums
def _relinearise(model, reference, unknowns):
    """Take the change of the phase with the loads anew, where it is not linear in them."""
    nodes, loads = len(reference.fixed), model.at.loads
    columns, phase = np.empty((model.at.size, nodes)), np.empty(nodes)
    fill_columns(model, unknowns, columns)
    fill_node_phase(model, unknowns, phase)
    for k in range(loads):
        for i in range(nodes):
            phase[i] -= unknowns[k] * columns[k, i]
            reference.columns[k, i] = columns[k, i]
    reference.fixed[:] = phase


@sums
def _renew_gain(model, pixels, reference, standing):
    """Compute the inverse for the loads anew, where the loops stand."""
    at, size, one = model.at, len(standing.pull), np.float32(1)
    rows, _, columns = pixels.shares.shape
    nodes, f = len(standing.nodes), pixels.first
    band, total = np.zeros((4, nodes), np.float32), np.zeros(columns, np.float32)
    weight, deviation = standing.back[:size], lens(model, standing.unknowns)[1]
    for c in range(len(model.bias)):
        span = slice(c * size, (c + 1) * size)
        steep, used, sine = standing.steep[span], pixels.used[span], standing.sine[span]
        if deviation > 0:
            count = len(pixels.place)
            line, out = standing.line[:count], standing.lead[:count]
            _in_line(pixels, sine, line)
            _smeared(line, reference.kernel, standing.padded, out)
            _in_columns(pixels, out, weight)
            for p in range(size):
                tiny = np.float32(1e-6) if sine[p] >= 0 else np.float32(-1e-6)
                share = weight[p] / (sine[p] + tiny) if abs(sine[p]) > abs(weight[p]) else one
                own = steep[p] * share
                weight[p] = own * own * used[p]
        else:
            for p in range(size):
                weight[p] = steep[p] * steep[p] * used[p]
        for k in range(4):
            for step in range(4 - k):
                total[:] = np.float32(0)
                for t in range(rows):
                    near, away = pixels.shares[t, k], pixels.shares[t, k + step]
                    own = weight[t * columns : (t + 1) * columns]
                    for r in range(columns):
                        total[r] += near[r] * away[r] * own[r]
                line = band[step, f + k : f + k + columns]
                for r in range(columns):
                    line[r] += total[r]
    loads, few = (at.loads + 3) // 4 * 4, at.loads
    products, own = np.zeros(loads), np.empty(nodes, np.float32)
    for x in range(few):
        column = reference.columns[x]
        for i in range(nodes):
            own[i] = band[0, i] * column[i]
        for step in range(1, 4):
            line, ahead, later = band[step], column[step:], own[step:]
            for i in range(nodes - step):
                own[i] += line[i] * ahead[i]
            for i in range(nodes - step):
                later[i] += line[i] * column[i]
        products[:] = 0.0
        add_products(reference.columns[: x // 4 * 4 + 4], own, products)
        for z in range(x + 1):
            reference.information[x, z] = reference.information[z, x] = products[z]
        reference.information[x, x] += reference.precision[x]
    many = len(reference.fresh)
    factor = reference.information.copy()
    factorise(factor, many, 1e-12)
    invert(factor, reference.gain)
    if len(reference.lasting) == 0:
        for x in range(few):
            for z in range(few):
                reference.covariance[x, z] = reference.gain[x, z]


@sums
def _renew_here(model, pixels, reference, standing, moved):
    """Compute the inverse anew; where nothing lasts, all is linearised where the loops stand.

    Returns how far the phase is from where everything was linearised, squared.
    """
    state, alone = standing.state, len(reference.lasting) == 0
    if alone and len(model.curvature) > 0:
        _relinearise(model, reference, standing.unknowns)
    _renew_gain(model, pixels, reference, standing)
    state[0], state[1], state[2] = AGED * AGED / 2, LOOKED, 1.0
    if not alone:
        return moved
    reference.anchor[:] = standing.nodes
    return 0.0


@sums
def _step(reference, standing, step, own):
    """Fill in the step and the score of what is new; returns the step's squared length."""
    many, length = len(reference.fresh), 0.0
    for a in range(many):
        k = reference.fresh[a]
        off = standing.unknowns[k] - reference.mean[a]
        own[a] = standing.gradient[k] + reference.precision[a] * off
    for a in range(many):
        row, part = reference.gain[a], 0.0
        for b in range(many):
            part += row[b] * own[b]
        step[a] = part
        length += part * own[a]
    return length


@sums
def _fall(reference, standing, own, score):
    """What the loss would fall by a step of what lasts."""
    others, fall = len(reference.lasting), 0.0
    for b in range(others):
        score[b] = standing.gradient[reference.lasting[b]]
    for a in range(len(own)):
        row = reference.through[a]
        for b in range(others):
            score[b] -= own[a] * row[b]
    for b in range(others):
        row, part = reference.score[b], 0.0
        for c in range(others):
            part += row[c] * score[c]
        fall += part * score[b]
    return fall


@sums_entry
def follow_frames(model, pixels, reference, standing, frames, unknowns, loads, std, cov, squares):
    """Read frames until one is not explained, or what was linearised has aged.

    Parameters
    ----------
    model, pixels, reference, standing
        Of the strip.
    frames : ndarray of float32, shape (k, P)
        Grey levels; any number where a pixel is not used.
    unknowns : ndarray, shape (size,)
        Those of the last frame that was read, filled.
    loads, std : ndarray, shape (k, 2n)
        Filled with loads and their standard deviations [N].
    cov : ndarray, shape (k or 0, 2n, 2n)
        Filled with their covariances [N^2]; where nothing lasts, with those of the very frames.
    squares : ndarray, shape (k, 2)
        Filled: squared residuals and their number.

    Returns
    -------
    done : int
        Frames that were read.
    why : int
        DONE, AGEING, STALE, ALARM, EMERGED, FAINT or GROWN.
    """
    many, lasting, state, x = (
        len(reference.fresh), len(reference.lasting), standing.state, standing.unknowns,
    )  # fmt: skip
    own, step, score = np.empty(many), np.empty(many), np.empty(lasting)
    count, m = loads.shape[1], len(reference.covariance)
    reached = reference.reached
    whole = len(cov) > 0 and lasting == 0 and np.isfinite(reached)
    used, nothing = float(pixels.used.sum()), np.float32(model.full_scale / 2)
    before = np.empty_like(standing.nodes)
    shown, moved, evaluated = 1, 0.0, state[3] > 0
    if not evaluated:
        for k in range(len(x)):
            x[k] = unknowns[k]
    for i in range(len(frames)):
        _load(pixels, standing, frames[i], nothing)
        turn, ratio, last, way = 0, state[0], 0.0, np.float32(0)
        first, renewed, everything = True, False, lasting == 0
        state[3] = 0.0
        # one call each of what looks at every pixel, so that it is compiled into this loop
        while True:
            if not evaluated:
                shown, moved = _stand(model, pixels, reference, standing)
                evaluated = True
            if first:
                before[:] = standing.nodes
            first = False
            squared, known, grouped = _compare(
                model, pixels, reference, standing, everything or turn > 0
            )
            length = _step(reference, standing, step, own)
            if turn > 0:
                ratio = length / max(last, 1e-12)
                if turn == 1 and last > many:
                    state[0] += (1.0 if state[2] > 0 else AVERAGING) * (ratio - state[0])
                    state[1], state[2] = 0.0, 0.0
                way = np.float32(0)
                for k in range(len(before)):
                    way = max(way, abs(standing.nodes[k] - before[k]))
            if shown == 0:
                return i, FAINT
            if length * ratio < reached and (turn > 0 or (state[1] < LOOKED and not whole)):
                if everything or turn > 0:
                    break
                everything = True
                continue
            if turn == EVALUATIONS or (
                turn > 0 and ratio > DIVERGED * DIVERGED and length > reached
            ):
                if renewed or lasting > 0:
                    return i, STALE
                moved = _renew_here(model, pixels, reference, standing, moved)
                turn, ratio, renewed = 0, state[0], True
                continue
            for a in range(many):
                x[reference.fresh[a]] -= step[a]
            evaluated, last, turn = False, length, turn + 1
        if length > reference.longest or way > JUMP:
            return i, ALARM
        if way > 0:
            hidden, nodes = reference.hidden, standing.nodes
            if way > hidden.difference and motion(nodes, before) > hidden.difference:
                return i, ALARM
            if emerged(nodes, reference.stretches, hidden, reference.columns):
                return i, EMERGED
        # by the last step the loss falls by its squared length
        squared, number = squared - length, used + known
        if squared > reference.squares * number or -known > reference.broken:
            return i, ALARM
        fall = _fall(reference, standing, own, score)
        if fall > reference.drawn or grouped - length > reference.sums:
            return i, ALARM
        state[1], state[3] = state[1] + 1, 1.0
        for k in range(len(x)):
            unknowns[k] = x[k]
        for a in range(many):
            unknowns[reference.fresh[a]] -= step[a]
        if whole:
            _renew_gain(model, pixels, reference, standing)
        for k in range(count):
            loads[i, k], std[i, k] = unknowns[k], np.sqrt(reference.covariance[k, k])
        if len(cov):
            for a in range(m):
                for b in range(m):
                    cov[i, a, b] = reference.covariance[a, b]
        squares[i, 0], squares[i, 1] = squared, number
        if state[0] > AGED * AGED or (lasting == 0 and moved > RENEWED * RENEWED):
            size = 0.0
            for k in range(0, count, 2):
                size += unknowns[k] * unknowns[k]
            size = np.sqrt(2 * size / count)
            if not reference.size / LOAD_GROWTH < size < reference.size * LOAD_GROWTH:
                return i + 1, GROWN
            moved = _renew_here(model, pixels, reference, standing, moved)
        if moved > reference.far * reference.far:
            return i + 1, AGEING
    return len(frames), DONE
