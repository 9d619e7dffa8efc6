"""Frames of a strip with tolerances in a row: a filter whose hot loop moves the loads alone.

What lasts from frame to frame - places and widths of touched contacts, residual fields, design
values, visibility, blur, static light - is estimated now and then, with all unknowns, from one
frame and what earlier ones told (an extended information filter).  In between it stands still, and
only what is new in every frame, the loads f, is fitted by Gauss and Newton's steps

    f <- f - C (J' r + Lambda f),     C = (J' J + Lambda)^-1,

with residuals r and derivatives J of the very point, but with the inverse C of the last
linearisation (the chord method: Kelley, Iterative Methods for Linear and Nonlinear Equations, 1995,
section 5.4).  How far C has aged shows in how much smaller the second step is than the first.  What
stands still has errors, and the covariance of the loads includes them (Schmidt's consider filter:
Advances in Control Systems 3, 293, 1966): it is the loads' block of the joint posterior covariance.

Why it stands still: one frame leaves forces, places and widths uncertain together along curved
valleys.  Information of hundreds of frames, each linearised at another point of its valley, adds up
to more than all of them have told (Julier and Uhlmann, Proc. ICRA, 4238, 2001), and stated
deviations become a third of the true ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve
from scipy.special import chdtri, pdtrik

from fringeforce.estimation.compiling import sums, sums_entry
from fringeforce.estimation.frame_exposure import (
    encoded,
    lens,
    node_columns,
    node_phase,
    point_spread,
    power_of,
)
from fringeforce.estimation.frame_fit import (
    PLAIN,
    Linearised,
    Prior,
    banded,
    by_gamma_of,
    climb,
    linearise,
    pixel_loss,
    shared_information,
)
from fringeforce.estimation.frame_model import (
    FrameModel,
)
from fringeforce.estimation.posterior import Top, products
from fringeforce.estimation.residual_test import FALSE_ALARM
from fringeforce.estimation.vector_loops import add_products, combine, waves

Array = NDArray[np.float64]
Single = NDArray[np.float32]

FORGOTTEN = 0.2
"""Share of the variance of what lasts that is new in every linearisation: errors of earlier ones
are forgotten within five."""
RELEASED = 2.0
"""Deviations of its forces below which a contact counts as released, and its place and width as
those of another touch."""
STEPS = 6
"""Most evaluations of one frame; slow motion takes one or two."""
REACHED = 0.1
"""Squared Mahalanobis distance to the top, what lasts being known, below which it is reached: over
all loads together a third of the deviation that noise leaves to one."""
AGED = 0.15
"""Ratio of the second step to the first, in deviations, from which a linearisation is renewed."""
SMOOTH = 0.2
"""Share of a frame in the running mean of that ratio's square."""
LOOKED = 8
"""Frames after which the ratio is looked at in any case."""
DIVERGED = 0.7
"""Ratio from which a linearisation does not lead to the top."""
OLDEST = 4096
"""Frames after which a linearisation is renewed in any case."""
FAR_STEPS = 20
"""Most steps of a climb with all unknowns."""

DONE, AGEING, STALE, ALARM, FAINT = range(5)
"""Why the loop ended: no frame is left; the linearisation has aged, after a frame that was read; it
does not lead to the top of the next one; noise does not explain the next one; its phase is so small
that loads are hardly told from others."""


class Pixels(NamedTuple):
    """What the loop needs of the pixels, in single precision.

    Attributes
    ----------
    amplitude, offset, used : ndarray, shape (P,)
        As of `FrameModel`; `used` is 1 where a pixel counts, 0 where not.
    weights : ndarray, shape (4, pixels of a channel)
        What the nodes count between which a pixel lies.
    first, runs : ndarray of int
        As of `FrameModel`, of one channel.
    starts : ndarray of int, shape (runs,)
        Where each run begins, or what is left of it if it is the last pixels' and too short.
    shares : ndarray, shape (longest run, 4, runs)
        Weights of the pixels of each run in turn, zero beyond its end.
    bright, dark : ndarray, shape (modes of light, m)
        As `brightness` and `darkness`.
    even : bool
        Whether these are the same everywhere.
    """

    amplitude: Single
    offset: Single
    used: Single
    weights: Single
    first: NDArray[np.int32]
    runs: NDArray[np.int32]
    starts: NDArray[np.uint32]
    shares: Single
    bright: Single
    dark: Single
    even: bool


class Reference(NamedTuple):
    """A linearisation, and what is known before a frame.

    Attributes
    ----------
    columns : ndarray, shape (R, m)
        Change of the phase at the nodes with every unknown; rows of zeros up to a multiple of four.
    fixed : ndarray, shape (m,)
        Phase without loads [rad].
    kernel : ndarray, shape (k,)
        One half of the point spread, from its middle; empty if there is none.
    fresh, lasting : ndarray of int, shapes (a,) and (b,)
        Unknowns that are new in every frame, loads first, and the others.
    gain : ndarray, shape (a, a)
        The inverse C, if what lasts is known.
    precision, mean : ndarray, shape (a,)
        What is known of what is new before a frame.
    through : ndarray, shape (a, b)
        Change of what lasts' score with that of what is new.
    score : ndarray, shape (b, b)
        What the loss would fall by a step of what lasts is a quadratic form of its score.
    squares : float
        Sum of squared residuals that noise exceeds at the false-alarm rate, over their number.
    drawn : float
        The same of that fall of the loss.
    broken : float
        The same of the number of broken pixels.
    faint : float
        Phase that a frame must reach [rad].
    """

    columns: Single
    fixed: Single
    kernel: Single
    fresh: NDArray[np.int64]
    lasting: NDArray[np.int64]
    gain: Array
    precision: Array
    mean: Array
    through: Array
    score: Array
    squares: float
    drawn: float
    broken: float
    faint: float


def pixels_of(model: FrameModel, used: NDArray[np.bool_]) -> Pixels:
    """What the loop needs of the pixels, of which some are used, shape (P,)."""
    pixels = len(model.amplitude) // len(model.bias)
    first = model.first[:pixels]
    runs = np.concatenate([[0], np.flatnonzero(np.diff(first)) + 1, [pixels]]).astype(np.int32)
    alone = len(model.starts) // len(model.bias)
    light = np.concatenate([model.brightness, model.darkness])
    return Pixels(
        model.amplitude.astype(np.float32),
        model.offset.astype(np.float32),
        used.astype(np.float32),
        np.ascontiguousarray(model.weights[:pixels].T, dtype=np.float32),
        first.astype(np.int32),
        runs,
        model.starts[:alone],
        np.ascontiguousarray(model.shares[:, :, :alone], dtype=np.float32),
        model.brightness.astype(np.float32),
        model.darkness.astype(np.float32),
        not len(light) or bool(np.ptp(light, axis=1).max() < 1e-9),
    )


@sums
def _interpolated(pixels, nodes, out):
    w0, w1, w2, w3 = pixels.weights[0], pixels.weights[1], pixels.weights[2], pixels.weights[3]
    for r in range(len(pixels.runs) - 1):
        begin, end = pixels.runs[r], pixels.runs[r + 1]
        i = pixels.first[begin]
        a, b, c, d = nodes[i], nodes[i + 1], nodes[i + 2], nodes[i + 3]
        for p in range(begin, end):
            out[p] = w0[p] * a + w1[p] * b + (w2[p] * c + w3[p] * d)


@sums
def _gathered(pixels, values, out):
    """Add what the nodes get of the pixels: the transpose of `_interpolated`."""
    runs = len(pixels.starts)
    sums = np.zeros((4, runs), np.float32)
    a, b, c, d = sums[0], sums[1], sums[2], sums[3]
    # all runs at a time, for each is too short for vector units
    for t in range(len(pixels.shares)):
        w0, w1, w2, w3 = (
            pixels.shares[t, 0],
            pixels.shares[t, 1],
            pixels.shares[t, 2],
            pixels.shares[t, 3],
        )
        line = values[t:]
        for r in range(runs):
            value = line[pixels.starts[r]]
            a[r] += w0[r] * value
            b[r] += w1[r] * value
            c[r] += w2[r] * value
            d[r] += w3[r] * value
    begin = pixels.first[0]
    for k in range(4):
        line, own = out[begin + k : begin + k + runs], sums[k]
        for r in range(runs):
            line[r] += own[r]


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
    if bias != 0:
        for p in range(len(lead)):
            lead[p] = ratio * lead[p]
            s, c = waves(lead[p] + bias)
            swing[p], sine[p] = one - two * s * s, two * s * c
    else:
        for p in range(len(lead)):
            lead[p] = ratio * lead[p]
            s, c = waves(lead[p])
            swing[p], sine[p] = one - two * s * s, two * s * c
    if spread > 0:
        for p in range(len(lead)):
            share = np.exp(np.float32(-0.5) * (spread * lead[p]) ** 2)
            swing[p] *= share
            sine[p] = share * sine[p] + spread * spread * lead[p] * swing[p]


@sums
def _rests(level, frame, inverse, used, limits, pull):
    """Residuals in units of the noise, sum of their squares, how many are far off or clipped."""
    total, far, (limit, floor, ceiling) = np.float32(0), 0, limits
    for p in range(len(level)):
        rest = (level[p] - frame[p]) * inverse * used[p]
        pull[p] = rest
        total += rest * rest
    for p in range(len(level)):
        odd = (pull[p] * pull[p] >= limit) | (frame[p] <= floor) | (frame[p] >= ceiling)
        far += 1 if odd else 0
    return total, far


@sums
def _lit(pixels, modes, c, count, work):
    """Fill in brightness and darkness that vary along the strip, of one channel."""
    nodes, lines = work
    for kind in range(2):
        nodes[:] = kind == 0
        table = pixels.bright if kind == 0 else pixels.dark
        for s in range(len(modes)):
            e = np.float32(modes[s])
            for i in range(len(nodes)):
                nodes[i] += e * table[s, i]
        _interpolated(pixels, nodes, lines[kind, c * count : (c + 1) * count])


@sums
def _evaluate(model, pixels, reference, frame, unknowns, whole, work, gradient):
    """Gradient of half the loss of a frame; sum of squares, their number, nodes of large phase.

    Where it is not `whole`, that of the loads and the light only.
    """
    coefficients, pulled, nodes, lead, sine, swing, seen, level, pull, back, lines, padded = work
    at, channels, loads = model.at, len(model.bias), len(coefficients)
    count = len(lead)
    contrast64, deviation, by_blur = lens(model, unknowns)
    contrast = np.float32(contrast64)
    for k in range(at.loads):
        coefficients[k] = unknowns[k]
    combine(reference.columns[:loads], coefficients, reference.fixed, nodes)
    shown, faint = 0, np.float32(reference.faint)
    for i in range(len(nodes)):
        shown += 1 if abs(nodes[i]) >= faint else 0
    modes = unknowns[at.modes : at.visibility]
    bright, dark = np.float32(1), np.float32(0)
    if pixels.even:
        for s in range(len(modes)):
            bright += np.float32(modes[s] * model.brightness[s, 0])
            dark += np.float32(modes[s] * model.darkness[s, 0])
    kernel = reference.kernel
    pulls = np.zeros(len(nodes), np.float32)
    gradient[:] = 0.0
    squares = counted = 0.0
    half = np.float32(0.5)
    inverse = np.float32(1 / np.sqrt(model.variance))
    by_visibility = by_width = by_power = 0.0
    gamma = power_of(model, unknowns)
    bent = gamma != 1.0 or model.srgb or at.size > at.gamma
    limits = np.float32(PLAIN * PLAIN), np.float32(model.floor), np.float32(model.ceiling)
    light = np.zeros((2, len(nodes)), np.float32)
    by_bright = by_dark = np.float32(0)
    for c in range(channels):
        span = slice(c * count, (c + 1) * count)
        ratio, bias = np.float32(model.dispersion[c]), np.float32(model.bias[c])
        spread = np.float32(model.spread[c])
        amplitude, offset = pixels.amplitude[span], pixels.offset[span]
        greys, used = frame[span], pixels.used[span]
        _interpolated(pixels, nodes, lead)
        _swinging(ratio, bias, spread, lead, sine, swing)
        if deviation > 0:
            _smeared(swing, kernel, padded, seen)
        else:
            seen[:] = swing
        if pixels.even:
            for p in range(count):
                level[p] = (offset[p] + dark) + amplitude[p] * bright * half * (
                    np.float32(1) - contrast * seen[p]
                )
        else:
            _lit(pixels, modes, c, count, (back[: len(nodes)], lines))
            relative, darker = lines[0, span], lines[1, span]
            for p in range(count):
                level[p] = (offset[p] + darker[p]) + amplitude[p] * relative[p] * half * (
                    np.float32(1) - contrast * seen[p]
                )
        if bent:
            for p in range(count):
                grey, slope = encoded(model, gamma, np.float64(level[p]))
                level[p], back[p] = grey, slope
        total, far = _rests(level, greys, inverse, used, limits, pull)
        known = 0.0 + used.sum()
        if far > 0:
            sigma, (limit, floor, ceiling) = np.sqrt(model.variance), limits
            for p in range(count):
                odd = (pull[p] * pull[p] >= limit) | (greys[p] <= floor) | (greys[p] >= ceiling)
                if not odd or used[p] == 0:
                    continue
                total -= pull[p] * pull[p]
                known -= 1.0
                _, force, weight = pixel_loss(
                    model, np.float64(greys[p]), np.float64(level[p]), sigma
                )
                pull[p] = force
                if weight > 0:
                    total += np.float32(force * force / weight)
                    known += weight
        squares += total
        counted += known
        if bent:
            for p in range(count):
                if at.size > at.gamma:
                    by_power += pull[p] * by_gamma_of(model, unknowns, np.float64(level[p]))
                pull[p] *= back[p]
        # from here on, what a change of the light at a pixel does to half the loss
        vis, blurring = np.float32(0), np.float32(0)
        if pixels.even:
            for p in range(count):
                force = pull[p] * inverse
                strong = force * amplitude[p]
                by_dark += force
                by_bright += strong * (np.float32(1) - contrast * seen[p])
                vis += strong * seen[p]
                pull[p] = strong * bright
        else:
            relative = lines[0, span]
            for p in range(count):
                force = pull[p] * inverse
                strong = force * amplitude[p]
                level[p] = force
                back[p] = strong * half * (np.float32(1) - contrast * seen[p])
                vis += strong * relative[p] * seen[p]
                pull[p] = strong * relative[p]
            _gathered(pixels, back, light[0])
            _gathered(pixels, level, light[1])
        if at.blur > at.visibility:
            factor = bright if pixels.even else np.float32(1)
            by_visibility -= 0.5 * model.visibility_std * vis * factor
        if deviation > 0:
            if at.gamma > at.blur:
                for p in range(1, count - 1):
                    blurring += pull[p] * (seen[p - 1] + seen[p + 1] - np.float32(2) * seen[p])
                blurring += pull[0] * (seen[1] - seen[0])
                blurring += pull[count - 1] * (seen[count - 2] - seen[count - 1])
                by_width -= 0.5 * contrast * deviation * by_blur * blurring
            _smeared_back(pull, kernel, padded, back)
        else:
            for p in range(count):
                back[p] = pull[p]
        factor = half * contrast * ratio
        for p in range(count):
            back[p] *= sine[p] * factor
        _gathered(pixels, back, pulls)
    pulled[:] = 0.0
    add_products(reference.columns if whole else reference.columns[:loads], pulls, pulled)
    for k in range(len(gradient)):
        gradient[k] = pulled[k]
    for s in range(len(modes)):
        if pixels.even:
            gradient[at.modes + s] += 0.5 * by_bright * model.brightness[s, 0]
            gradient[at.modes + s] += by_dark * model.darkness[s, 0]
        else:
            for i in range(len(nodes)):
                gradient[at.modes + s] += light[0, i] * pixels.bright[s, i]
                gradient[at.modes + s] += light[1, i] * pixels.dark[s, i]
    if at.blur > at.visibility:
        gradient[at.visibility] = by_visibility
    if at.gamma > at.blur:
        gradient[at.blur] = by_width
    if at.size > at.gamma:
        gradient[at.gamma] = by_power * model.gamma_std / np.sqrt(model.variance)
    return squares, counted, shown


@sums
def _workspace(model, reference):
    channels, nodes = len(model.bias), len(model.fixed)
    pixels = len(model.amplitude) // channels
    return (
        np.zeros((model.at.loads + 3) // 4 * 4, np.float32),
        np.zeros(len(reference.columns)),
        np.zeros(nodes, np.float32),
        np.zeros(pixels, np.float32),
        np.zeros(pixels, np.float32),
        np.zeros(pixels, np.float32),
        np.zeros(pixels, np.float32),
        np.zeros(pixels, np.float32),
        np.zeros(pixels, np.float32),
        np.zeros(max(pixels, nodes), np.float32),
        np.zeros((2, pixels * channels), np.float32),
        np.zeros(pixels + 2 * len(reference.kernel), np.float32),
    )


@sums_entry
def loss_gradient(model, pixels, reference, frame, unknowns):
    """Gradient of half the loss of one frame, without what is known before.

    Parameters
    ----------
    model, pixels, reference
        Of the strip; what lasts must be that of the reference.
    frame : ndarray of float32, shape (P,)
        Grey levels; any number where a pixel is not used.
    unknowns : ndarray, shape (size,)
        The point.

    Returns
    -------
    gradient : ndarray, shape (size,)
    squares, count : float
        Weighted sum of squared residuals in units of the noise, and the sum of the weights.
    """
    gradient = np.empty(len(unknowns))
    work = _workspace(model, reference)
    squares, count, _ = _evaluate(model, pixels, reference, frame, unknowns, True, work, gradient)
    return gradient, squares, count


@sums_entry
def follow_frames(model, pixels, reference, frames, unknowns, ageing, loads, squares):
    """Read frames until one is not explained, or the linearisation has aged.

    Parameters
    ----------
    model, pixels, reference
        Of the strip.
    frames : ndarray of float32, shape (k, P)
        Grey levels.
    unknowns : ndarray, shape (size,)
        Of the frame before; those of the last frame that was read afterwards.
    ageing : ndarray, shape (2,)
        Running mean of the squared ratio of steps, and frames since it was looked at.
    loads : ndarray, shape (k, 2n)
        Filled [N].
    squares : ndarray, shape (k, 2)
        Filled: squared residuals and their number.

    Returns
    -------
    done : int
        Frames that were read.
    why : int
        DONE, AGEING, STALE, ALARM or FAINT.
    """
    fresh, lasting = reference.fresh, reference.lasting
    many, others = len(fresh), len(lasting)
    gradient, x, own = np.empty(len(unknowns)), unknowns.copy(), np.empty(many)
    score = np.empty(others)
    work = _workspace(model, reference)
    used = 0.0
    for p in range(len(pixels.used)):
        used += pixels.used[p]
    for i in range(len(frames)):
        for k in range(len(x)):
            x[k] = unknowns[k]
        last, reached = 0.0, False
        total = count = 0.0
        for turn in range(STEPS):
            total, count, shown = _evaluate(
                model, pixels, reference, frames[i], x, True, work, gradient
            )
            if shown == 0:
                return i, FAINT
            length = 0.0
            for a in range(many):
                k = fresh[a]
                own[a] = gradient[k] + reference.precision[a] * (x[k] - reference.mean[a])
            for a in range(many):
                row, part = reference.gain[a], 0.0
                for b in range(many):
                    part += row[b] * own[b]
                x[fresh[a]] -= part
                length += part * own[a]
            ratio = ageing[0]
            if turn > 0:
                ratio = length / max(last, 1e-12)
                if turn == 1 and last > many:
                    ageing[0] += SMOOTH * (ratio - ageing[0])
                    ageing[1] = 0.0
                if ratio > DIVERGED * DIVERGED and length > REACHED:
                    return i, STALE
            # what is left after a step is to it as it is to the one before
            reached = length * ratio < REACHED and (turn > 0 or ageing[1] < LOOKED)
            last = length
            if reached:
                break
        if not reached:
            return i, STALE
        # by the last step the loss falls by its squared length
        if total - last > reference.squares * count or used - count > reference.broken:
            return i, ALARM
        for b in range(others):
            score[b] = gradient[lasting[b]]
        for a in range(many):
            row = reference.through[a]
            for b in range(others):
                score[b] -= own[a] * row[b]
        fall = 0.0
        for b in range(others):
            row, part = reference.score[b], 0.0
            for c in range(others):
                part += row[c] * score[c]
            fall += part * score[b]
        if fall > reference.drawn:
            return i, ALARM
        ageing[1] += 1
        for k in range(len(x)):
            unknowns[k] = x[k]
        for k in range(loads.shape[1]):
            loads[i, k] = x[k]
        squares[i, 0], squares[i, 1] = total, count
        if ageing[0] > AGED * AGED:
            return i + 1, AGEING
    return len(frames), DONE


@dataclass
class InformationFilter:
    """What is known of the unknowns of a strip from frame to frame.

    Attributes
    ----------
    model : FrameModel
        What makes frames.
    prior : Prior
        What is known of a frame alone.
    lasts : ndarray of bool, shape (size,)
        Unknowns that last while contacts are touched: all but loads and light that drifts.
    used : ndarray of bool, shape (P,)
        Pixels that count.
    faint : float
        Phase that frames must reach [rad].
    unknowns : ndarray, shape (size,)
        Of the last frame.
    """

    model: FrameModel
    prior: Prior
    lasts: NDArray[np.bool_]
    used: NDArray[np.bool_]
    faint: float
    unknowns: Array

    def __post_init__(self) -> None:
        self._pixels, self._ageing, self._age = pixels_of(self.model, self.used), np.zeros(2), 0
        count = int(self.used.sum())
        self._squares = float(chdtri(count, FALSE_ALARM)) / count
        self._broken = float(pdtrik(1 - FALSE_ALARM, self.model.broken * count))
        self._fresh, self._lasting = np.flatnonzero(~self.lasts), np.flatnonzero(self.lasts)
        self._reference: Reference | None = None
        self._spread = np.empty((0, 0))

    def begin(self, about: Linearised, spread: Array) -> None:
        """Begin after a frame that was read alone.

        Parameters
        ----------
        about : Linearised
            Its loss about its top.
        spread : ndarray, shape (size, size)
            Covariance of its unknowns.
        """
        self._refer(about.hessian - np.diag(self.prior.precision), spread)

    def follow(self, frames: Single, loads: Array, squares: Array) -> tuple[int, int]:
        """Read frames; see `follow_frames`."""
        rest = OLDEST - self._age
        done, why = follow_frames(
            self.model, self._pixels, self._reference, frames[:rest], self.unknowns,
            self._ageing, loads, squares,
        )  # fmt: skip
        self._age += done
        return done, AGEING if why == DONE and self._age >= OLDEST else why

    @property
    def covariance(self) -> Array:
        """Of the loads of a frame, shape (2n, 2n) [N^2]."""
        loads = self.model.at.loads
        return self._spread[:loads, :loads]

    def renew(self, frame: Array) -> Top | None:
        """Estimate everything from a frame, shape (P,), and what is known before it.

        Returns
        -------
        Top or None
            None if noise does not explain the frame.
        """
        mean, known = self._before()
        precision = np.diag(self.prior.precision)
        whole = np.ix_(self._lasting, self._lasting)
        precision[whole] = np.linalg.inv(known)
        prior = Prior(mean, 0 * mean, self.prior.friction, self.prior.yielding, precision)
        start = self.unknowns.copy()
        top = Top(*climb(self.model, prior, frame, start, 1.0, FAR_STEPS, REACHED / 10, np.inf))
        about = Linearised(*linearise(self.model, prior, frame, top.unknowns))
        off = (top.unknowns - mean)[self._lasting]
        spread = _inverse(about.hessian)
        told = np.eye(len(off)) - precision[whole] @ spread[whole]
        misfit = top.square > self._squares * top.count
        misfit = misfit or np.isfinite(frame).sum() - top.count > self._broken
        if misfit or off @ precision[whole] @ off > _limit(told):
            return None
        self.unknowns[:] = top.unknowns
        data = about.hessian - precision
        if self.model.at.fields > self.model.at.place:
            lost = self._second_order(about, np.sqrt(np.diag(self._spread)))
            spread = _inverse(about.hessian - lost)
        self._refer(data, spread)
        return top

    def _before(self) -> tuple[Array, Array]:
        """Mean of all unknowns before the next frame, and covariance of what lasts."""
        at, loads = self.model.at, self.model.at.loads
        mean, known = np.sqrt(1 - FORGOTTEN) * self.unknowns, (1 - FORGOTTEN) * self._spread
        known[np.diag_indices(len(known))] += FORGOTTEN
        deviation = np.sqrt(np.diag(self._spread))[:loads]
        size = np.abs(self.unknowns[:loads] / deviation).reshape(-1, 2).max(axis=1)
        gone = np.zeros(at.size, bool)
        for begin, end in ((at.place, at.width), (at.width, at.fields)):
            if end > begin:
                gone[begin:end] = size < RELEASED
        known[gone], known[:, gone] = 0.0, 0.0
        known[gone, gone] = 1.0
        mean[gone] = 0.0
        mean[self._fresh] = self.prior.mean[self._fresh]
        return mean, known[np.ix_(self._lasting, self._lasting)]

    def _refer(self, data: Array, spread: Array) -> None:
        """Take a linearisation: information of the frame, and covariance of its unknowns."""
        fresh, lasting = self._fresh, self._lasting
        gain = _inverse(data[np.ix_(fresh, fresh)] + np.diag(self.prior.precision[fresh]))
        mixed = data[np.ix_(fresh, lasting)]
        through = gain @ mixed
        information = data[np.ix_(lasting, lasting)] - mixed.T @ through
        known = spread[np.ix_(lasting, lasting)]
        inner = np.eye(len(lasting)) + information @ known
        score = known @ np.linalg.inv(inner)
        rest = self.unknowns.copy()
        rest[: self.model.at.loads] = 0.0
        self._spread, self._age = spread, 0
        self._ageing[:] = AGED**2 / 2, LOOKED
        columns = node_columns(self.model, self.unknowns)
        columns = np.pad(columns, ((0, -len(rest) % 4), (0, 0)))
        self._reference = Reference(
            columns=columns.astype(np.float32),
            fixed=node_phase(self.model, rest).astype(np.float32),
            kernel=point_spread(self.model, rest).astype(np.float32),
            fresh=fresh,
            lasting=lasting,
            gain=gain,
            precision=self.prior.precision[fresh],
            mean=self.prior.mean[fresh],
            through=np.ascontiguousarray(through),
            score=(score + score.T) / 2,
            squares=self._squares,
            drawn=_limit(information @ known),
            broken=self._broken,
            faint=self.faint,
        )

    def _second_order(self, about: Linearised, deviation: Array) -> Array:
        """Information lost to products of errors of force and place or width; see `Posterior`."""
        directions, force, partner = products(self.model, self.unknowns)
        variance = deviation**2
        known = 1 / np.maximum(variance[force] * variance[partner], 1e-30)
        cross = shared_information(self.model, about, directions)
        information = directions @ banded(about, directions).T
        information[np.diag_indices(len(known))] += known
        return cross @ solve(information, cross.T, assume_a="pos", check_finite=False)


def _inverse(matrix: Array) -> Array:
    inverse = np.linalg.inv(matrix)
    return (inverse + inverse.T) / 2


def _limit(shares: Array) -> float:
    """Limit of a quadratic form that is a sum of chi-squares, weighted with a matrix's eigenvalues.

    The chi-square of equal mean and variance (Satterthwaite, Biometrics Bull. 2, 110, 1946).
    """
    mean, square = float(np.trace(shares)), float(np.sum(shares * shares.T))
    if not mean > 0:
        return np.inf
    return square / mean * float(chdtri(mean**2 / square, FALSE_ALARM))
