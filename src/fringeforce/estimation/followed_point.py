"""A point from which frames are followed: its grey levels, and what residuals pull it by.

All is in single precision, and of pixels in columns (`pixel_columns`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import apart, sums
from fringeforce.estimation.frame_exposure import by_gamma_of, encoded, lens, power_of
from fringeforce.estimation.frame_loss import SOUND, pixel_loss
from fringeforce.estimation.phase_stretches import Hidden, Stretches
from fringeforce.estimation.pixel_columns import (
    Single,
    gather,
    in_columns,
    in_line,
    interpolate,
    smear,
    smear_back,
)
from fringeforce.estimation.vector_loops import add_products, combine, waves

Array = NDArray[np.float64]


class MatrixErrors(NamedTuple):
    """What errors of the influence matrix make of loads, which grows with these; d are uncertain.

    Attributes
    ----------
    loads : ndarray, shape (2n,)
        Loads where everything was linearised [N].
    turning : ndarray, shape (d, 2n, 2n)
        Change of the loads with each of these unknowns, per change of each load.
    with_loads, between : ndarray, shapes (d, 2n) and (d, d)
        Covariance of these unknowns with the loads and with each other.
    """

    loads: Array
    turning: Array
    with_loads: Array
    between: Array


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
    errors : MatrixErrors
        What changes it as loads change.
    stretches : Stretches
        On which sides of multiples of pi the phase is known to be.
    known : ndarray, shape (R,)
        Precision of what is known of every unknown whatever the loads are; zero of these.
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
    errors: MatrixErrors
    stretches: Stretches
    known: Array
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


@apart
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


@apart
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


@apart
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
        interpolate(pixels, work, own if kind == 0 else own_dark)


@sums
def noise_of(model, channel):
    """Standard deviation of the noise of a channel, grey levels."""
    return np.sqrt(model.variance[channel * (len(model.variance) // len(model.bias))])


@apart
def stand(model, pixels, reference, standing):
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
    gamma = power_of(model, unknowns)
    bent = gamma != 1.0 or model.srgb or at.crosstalk > at.gamma
    size = len(standing.pull)
    lead = standing.lead[:size]
    for c in range(len(model.bias)):
        span = slice(c * size, (c + 1) * size)
        ratio, bias = np.float32(model.dispersion[c]), np.float32(model.bias[c])
        interpolate(pixels, nodes, lead)
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
            in_line(pixels, seen, line)
            smear(line, reference.kernel, standing.padded, out)
            in_columns(pixels, out, seen)
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
        factor = np.float32(1 / noise_of(model, c)) * half * contrast * ratio
        for p in range(size):
            steep[p] = factor * relative[p] * sine[p]
        if bent:
            bend = standing.bend[span]
            for p in range(size):
                grey, slope = encoded(model, gamma, np.float64(level[p]))
                level[p], bend[p] = grey, slope
                steep[p] *= bend[p]
    return shown, moved / np.float32(len(nodes))


@apart
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


@apart
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


@apart
def compare(model, pixels, reference, standing, whole):
    """Fill in the gradient of half the loss; squares, count, broken pixels and squares of sums.

    The count is what pixels that say less lack of all of them.  Where it is not `whole`, that of
    the loads only, and of the light that drifts.
    """
    at, unknowns, gradient = model.at, standing.unknowns, standing.gradient
    contrast64, deviation, by_blur = lens(model, unknowns)
    contrast, half, one = np.float32(contrast64), np.float32(0.5), np.float32(1)
    size = len(standing.pull)
    gamma = power_of(model, unknowns)
    bent = gamma != 1.0 or model.srgb or at.crosstalk > at.gamma
    lights = at.size > at.modes and (whole or len(reference.fresh) > at.loads)
    limits = np.float32(SOUND * SOUND), np.float32(model.floor), np.float32(model.ceiling)
    pulls, pull, back = standing.pulls, standing.pull, standing.back[:size]
    gradient[:] = 0.0
    pulls[:] = np.float32(0)
    squares = counted = broken = grouped = 0.0
    by_visibility = by_width = by_power = 0.0
    for c in range(len(model.bias)):
        span = slice(c * size, (c + 1) * size)
        level, grey, used = standing.level[span], standing.grey[span], pixels.used[span]
        relative, seen, bend = standing.relative[span], standing.seen[span], standing.bend[span]
        sigma = noise_of(model, c)
        inverse = np.float32(1 / sigma)
        total, far = _rests(level, grey, used, inverse, limits, pull)
        known = 0.0
        if far > 0:
            limit, floor, ceiling = limits
            for p in range(size):
                clipped = (grey[p] <= floor) | (grey[p] >= ceiling)
                if not (pull[p] * pull[p] >= limit or clipped) or used[p] == 0:
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
                if not clipped:
                    broken += 1 - weight
        squares += total
        counted += known
        grouped += _summed(pull, pixels.even_out[c], len(pixels.shares))
        if bent:
            for p in range(size):
                if at.crosstalk > at.gamma:
                    by_power += pull[p] * by_gamma_of(model, unknowns, np.float64(level[p])) / sigma
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
            in_line(pixels, back, line)
            if whole and at.gamma > at.blur:
                fringes, blurring = standing.swing[:count], np.float32(0)
                in_line(pixels, seen, fringes)
                for p in range(1, count - 1):
                    curve = fringes[p - 1] + fringes[p + 1] - np.float32(2) * fringes[p]
                    blurring += line[p] * curve
                blurring += line[0] * (fringes[1] - fringes[0])
                blurring += line[count - 1] * (fringes[count - 2] - fringes[count - 1])
                by_width -= 0.5 * contrast * deviation * by_blur * blurring
            smear_back(line, reference.kernel, standing.padded, out)
            in_columns(pixels, out, back)
            factor, sine = half * contrast * np.float32(model.dispersion[c]), standing.sine[span]
            for p in range(size):
                back[p] *= sine[p] * factor
        else:
            steep = standing.steep[span]
            for p in range(size):
                back[p] = pull[p] * steep[p]
        gather(pixels, back, pulls)
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
        gradient[at.gamma] = by_power * model.gamma_std
    return squares, counted, broken, grouped


@apart
def _light_pulled(model, pixels, reference, standing, c):
    """Add the gradient of half the loss by modes of light, of one channel."""
    at, unknowns, gradient, pull = model.at, standing.unknowns, standing.gradient, standing.pull
    modes, size = at.visibility - at.modes, len(standing.pull)
    if modes == 0:
        return
    span = slice(c * size, (c + 1) * size)
    contrast, half, one = np.float32(lens(model, unknowns)[0]), np.float32(0.5), np.float32(1)
    inverse = np.float32(1 / noise_of(model, c))
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
    gather(pixels, back, light[0])
    gather(pixels, lead, light[1])
    nodes = slice(c * len(standing.nodes), (c + 1) * len(standing.nodes))
    for s in range(modes):
        bright, dark = pixels.bright[s, nodes], pixels.dark[s, nodes]
        for i in range(len(standing.nodes)):
            gradient[at.modes + s] += light[0, i] * bright[i]
            gradient[at.modes + s] += light[1, i] * dark[i]


@sums
def lay_out(pixels, standing, frame, nothing):
    """Lay a frame out; what is not used may be no number."""
    grey = standing.grey
    for k in range(len(grey)):
        value = frame[pixels.order[k]]
        grey[k] = value if pixels.used[k] > 0 else nothing
