"""Frames in a row: from the loads of one to those of the next, in compiled loops.

What lasts from frame to frame stands still here, and only what is new in every frame, the loads f,
is fitted by Gauss and Newton's steps

    f <- f - C (J' r + Lambda f),     C = (J' J + Lambda)^-1,

with residuals r and derivatives J of a point near by, and with an inverse C that is some frames old
(the chord method: Kelley, Iterative Methods for Linear and Nonlinear Equations, 1995, section 5.4).
How far C has aged shows in how much smaller the second step is than the first.  Where the next step
would be too small to count, it is taken without another look at the frame, and the point stays
where it is: a frame of a sensor at rest costs one comparison with grey levels that are known.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import apart, copied, sums, sums_entry
from fringeforce.estimation.followed_point import Reference, Standing, compare, lay_out, stand
from fringeforce.estimation.frame_exposure import fill_columns, fill_node_phase, lens
from fringeforce.estimation.phase_stretches import emerged, motion
from fringeforce.estimation.pixel_columns import Pixels, in_columns, in_line, smear
from fringeforce.estimation.vector_loops import add_products, factorise, invert

Array = NDArray[np.float64]

EVALUATIONS = 6
"""Most evaluations of one frame; slow motion takes one."""
AGED = 0.04
"""Ratio of the second step to the first, in deviations, from which the inverse is computed anew."""
RENEWALS = 4
"""Most times that it is computed anew within one frame."""
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


@apart
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
    copied(phase, reference.fixed)


@apart
def _renew_gain(model, pixels, reference, standing):
    """Compute the inverse for the loads anew, where the loops stand."""
    at, size, one = model.at, len(standing.pull), np.float32(1)
    rows, near_by, columns = pixels.shares.shape
    nodes, f = len(standing.nodes), pixels.first
    band, total = np.zeros((4, nodes), np.float32), np.zeros(columns, np.float32)
    weight, deviation = standing.back[:size], lens(model, standing.unknowns)[1]
    for c in range(len(model.bias)):
        span = slice(c * size, (c + 1) * size)
        steep, used, sine = standing.steep[span], pixels.used[span], standing.sine[span]
        if deviation > 0:
            count = len(pixels.place)
            line, out = standing.line[:count], standing.lead[:count]
            in_line(pixels, sine, line)
            smear(line, reference.kernel, standing.padded, out)
            in_columns(pixels, out, weight)
            for p in range(size):
                tiny = np.float32(1e-6) if sine[p] >= 0 else np.float32(-1e-6)
                share = weight[p] / (sine[p] + tiny) if abs(sine[p]) > abs(weight[p]) else one
                own = steep[p] * share
                weight[p] = own * own * used[p]
        else:
            for p in range(size):
                weight[p] = steep[p] * steep[p] * used[p]
        for k in range(near_by):
            for step in range(near_by - k):
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


@apart
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
    copied(standing.nodes, reference.anchor)
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


@apart
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


@apart
def _covariance_here(reference, unknowns):
    """Covariance of the loads of a frame, shape (2n, 2n).

    What an error of the influence matrix makes of the loads grows with these.
    """
    errors, few = reference.errors, len(reference.covariance)
    several = len(errors.turning)
    if several == 0:
        return reference.covariance
    turned = np.zeros((several, few))
    for d in range(several):
        for k in range(few):
            row = errors.turning[d, k]
            for j in range(few):
                turned[d, k] += row[j] * (unknowns[j] - errors.loads[j])
    found = reference.covariance.copy()
    for d in range(several):
        for k in range(few):
            own = errors.with_loads[d, k]
            for e in range(several):
                own += 0.5 * errors.between[d, e] * turned[e, k]
            for j in range(few):
                found[k, j] += own * turned[d, j]
                found[j, k] += own * turned[d, j]
    return found


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
    return _follow_frames(
        model, pixels, reference, standing, frames, unknowns, loads, std, cov, squares
    )


@apart
def _follow_frames(model, pixels, reference, standing, frames, unknowns, loads, std, cov, squares):
    """As `follow_frames`."""
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
        lay_out(pixels, standing, frames[i], nothing)
        turn, ratio, last, way = 0, state[0], 0.0, np.float32(0)
        first, renewals, everything = True, 0, lasting == 0
        state[3] = 0.0
        # one call each of what looks at every pixel, so that it is compiled into this loop
        while True:
            if not evaluated:
                shown, moved = stand(model, pixels, reference, standing)
                evaluated = True
            if first:
                copied(standing.nodes, before)
            first = False
            squared, known, broken, grouped = compare(
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
                if renewals == RENEWALS:
                    return i, STALE
                moved = _renew_here(model, pixels, reference, standing, moved)
                turn, ratio, renewals = 0, state[0], renewals + 1
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
            if emerged(nodes, reference.stretches, hidden, reference.columns, reference.known):
                return i, EMERGED
        # by the last step the loss falls by its squared length
        squared, number = squared - length, used + known
        if squared > reference.squares * number or broken > reference.broken:
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
        covariance = _covariance_here(reference, unknowns)
        for k in range(count):
            loads[i, k], std[i, k] = unknowns[k], np.sqrt(covariance[k, k])
        if len(cov):
            for a in range(m):
                for b in range(m):
                    cov[i, a, b] = covariance[a, b]
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
