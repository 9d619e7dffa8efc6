"""The loss of a frame about a point, in compiled loops: gradient, Hessian and what they consist of.

What acts through smooth profiles is summed at the nodes, so that a linearisation costs little more
than a frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import apart, copied, sums, sums_entry
from fringeforce.estimation.frame_exposure import (
    blurred,
    by_gamma_of,
    dot,
    fill_columns,
    fill_exposure,
    fill_slopes,
    kernel_of,
    lens,
    mix,
    workspace,
)
from fringeforce.estimation.frame_information import fill_products
from fringeforce.estimation.frame_loss import add_cone, pixel_loss
from fringeforce.estimation.frame_model import FrameModel

Array = NDArray[np.float64]

BASES = 6
"""Ways in which an unknown changes a pixel: phase, amplitude, offset, visibility, blur, gamma; each
unknown of cross-talk has a way of its own behind them."""


class Linearised(NamedTuple):
    """The loss about one point, of a model with k unknowns of cross-talk.

    Attributes
    ----------
    hessian : ndarray, shape (size, size)
        Half the second derivative (Gauss-Newton), prior included; the cone is not.
    gradient : ndarray, shape (size,)
        Half the first derivative.
    cone : ndarray, shape (size, size)
        What the cone adds to the Hessian.
    columns : ndarray, shape (size, m)
        Change of the phase at the nodes with every unknown, behind the point spread.
    weights : ndarray, shape (BASES + k, BASES + k, C m)
        Sums over the pixels around a node of products of the bases, in units of the noise, of all
        channels in turn; that of two phases is in `band`.
    pulls : ndarray, shape (BASES + k, C m)
        The same of the bases and the residuals.
    band : ndarray, shape (4, m)
        The same of two phases at nodes that are so many steps apart, the first of which is given:
        what lies between the nodes is cubic.
    """

    hessian: Array
    gradient: Array
    cone: Array
    columns: Array
    weights: Array
    pulls: Array
    band: Array


@apart
def _spread_columns(columns, deviation):
    """Blur columns at the nodes, by a heat equation in steps that leave no wave larger.

    A blurred product of fringes and a column is that of both blurred, to the first order in how far
    the column bends.
    """
    share = deviation * deviation / 2
    passes = int(np.ceil(share / 0.25))
    share /= passes
    before = np.empty(columns.shape[1])
    for k in range(len(columns)):
        line = columns[k]
        for _ in range(passes):
            copied(line, before)
            left, here, right = before[:-2], before[1:-1], before[2:]
            for i in range(len(left)):
                line[i + 1] = here[i] + share * (left[i] + right[i] - 2 * here[i])


@apart
def _blurred_back(line, kernel, out):
    """The transpose of `blurred`: what lies beyond the ends is added to the ends."""
    size, reach = len(line), len(kernel) - 1
    padded = np.zeros(size + 2 * reach)
    for p in range(size):
        padded[reach + p] = kernel[0] * line[p]
    for step in range(1, reach + 1):
        factor = kernel[step]
        for p in range(size):
            padded[reach + p - step] += factor * line[p]
        for p in range(size):
            padded[reach + p + step] += factor * line[p]
    copied(padded[reach : reach + size], out)
    out[0] += padded[:reach].sum()
    out[size - 1] += padded[reach + size :].sum()


@sums
def _side_by_side(model, values, out):
    """Pixels of every run under each other, shape (longest run, runs); not used beyond its end."""
    runs = len(model.starts)
    for t in range(len(out)):
        line, row = values[t:], out[t]
        for r in range(runs):
            row[r] = line[model.starts[r]]


@apart
def _pulled(model, basis, pull, out):
    """Sums of a basis times the residuals, at the nodes between which each pixel lies."""
    runs, channels, m = len(model.starts) // len(model.bias), len(model.bias), len(model.fixed)
    total = np.zeros(len(model.starts))
    for k in range(model.shares.shape[1]):
        total[:] = 0.0
        for t in range(len(basis)):
            own, other, share = basis[t], pull[t], model.shares[t, k]
            for r in range(len(total)):
                total[r] += share[r] * (own[r] * other[r])
        for c in range(channels):
            i = c * m + model.first[0] + k
            for r in range(runs):
                out[i + r] += total[c * runs + r]


@apart
def _lumped(model, basis, other, out):
    """Sums of the products of two bases, at the two nodes beside each pixel."""
    runs, channels, m = len(model.starts) // len(model.bias), len(model.bias), len(model.fixed)
    left, right = np.zeros(len(model.starts)), np.zeros(len(model.starts))
    for t in range(len(basis)):
        one, two, share, rest = basis[t], other[t], model.halves[t, 0], model.halves[t, 1]
        for r in range(len(left)):
            value = one[r] * two[r]
            left[r] += share[r] * value
            right[r] += rest[r] * value
    for c in range(channels):
        i = c * m + model.first[0] + 1
        for r in range(runs):
            out[i + r] += left[c * runs + r]
            out[i + 1 + r] += right[c * runs + r]


@apart
def _banded(model, basis, other, band):
    """Sums of the products of two bases, at the pairs of nodes between which each pixel lies."""
    runs, channels = len(model.starts) // len(model.bias), len(model.bias)
    total, near_by = np.zeros(len(model.starts)), model.shares.shape[1]
    for k in range(near_by):  # four, which the compiler must not know: it would write them out
        for step in range(near_by - k):
            total[:] = 0.0
            for t in range(len(basis)):
                one, two = basis[t], other[t]
                near, far = model.shares[t, k], model.shares[t, k + step]
                for r in range(len(total)):
                    total[r] += near[r] * far[r] * (one[r] * two[r])
            for c in range(channels):
                i = model.first[0] + k
                for r in range(runs):
                    band[step, i + r] += total[c * runs + r]


@apart
def fill_linearised(model, prior, frame, unknowns, work, sigma, heat, out):
    """Fill in `out`, of the frame that `work` holds."""
    _, phase, swing, seen, level, slope, bright = work
    at = model.at
    channels, pixels = len(model.bias), len(phase) // len(model.bias)
    contrast, deviation, by_blur = lens(model, unknowns)
    gamma, kinds = at.crosstalk > at.gamma, len(out.pulls)
    hessian, gradient, cone, columns = out.hessian, out.gradient, out.cone, out.columns
    weights, pulls, band = out.weights, out.pulls, out.band
    fill_columns(model, unknowns, columns)
    weights[:], pulls[:], band[:] = 0.0, 0.0, 0.0
    slopes, smeared = np.empty(len(phase)), np.empty(pixels)
    fill_slopes(model, unknowns, work, slopes)
    pulled, sharp = np.empty(pixels), np.zeros(len(phase))
    bases, weight = np.zeros((kinds, len(phase))), np.zeros(len(phase))
    pull = np.zeros(len(phase))
    for c in range(channels):
        begin = c * pixels
        turned = slopes[begin : begin + pixels]
        if deviation > 0:
            blurred(turned, kernel_of(deviation), smeared)
        else:
            copied(turned, smeared)
        for k in range(pixels):
            p = begin + k
            if not np.isfinite(frame[p]):
                continue
            _, pull[p], weight[p] = pixel_loss(model, frame[p], level[p], sigma[p])
            amplitude, own = model.amplitude[p] * bright[p], slope[p] / sigma[p]
            bases[0, p] = own * amplitude * contrast / 2 * smeared[k]
            bases[1, p] = own * model.amplitude[p] * (1 - contrast * seen[p]) / 2
            bases[2, p] = own
            bases[3, p] = -own * amplitude * model.visibility_std * seen[p] / 2
            curve = seen[begin + max(k - 1, 0)] + seen[begin + min(k + 1, pixels - 1)]
            curve -= 2 * seen[p]
            bases[4, p] = -own * amplitude * contrast / 2 * deviation * by_blur * curve
            if gamma:
                bases[5, p] = model.gamma_std * by_gamma_of(model, unknowns, level[p])
                bases[5, p] /= sigma[p]
        for x in range(len(model.leaks)):
            mix(model.leaks[x, c], swing, pulled)
            if deviation > 0:
                blurred(pulled, kernel_of(deviation), smeared)
            else:
                copied(pulled, smeared)
            for k in range(pixels):
                p = begin + k
                if weight[p] > 0:
                    light = slope[p] / sigma[p] * model.amplitude[p] * bright[p]
                    bases[BASES + x, p] = -light * contrast / 2 * smeared[k]
        # the gradient by the phase is exact: the point spread acts on the residuals
        for k in range(pixels):
            p = begin + k
            pulled[k] = (
                slope[p] / sigma[p] * model.amplitude[p] * bright[p] * contrast / 2 * pull[p]
            )
        if deviation > 0:
            _blurred_back(pulled, kernel_of(deviation), smeared)
        else:
            copied(pulled, smeared)
        for k in range(pixels):
            sharp[begin + k] = turned[k] * smeared[k]
    modes, shape = at.visibility - at.modes, (len(model.shares), len(model.starts))
    known = (True, modes > 0, modes > 0, at.blur > at.visibility, at.gamma > at.blur, gamma)
    beside, weighed = np.empty((kinds, *shape)), np.empty(shape)
    pulling, heavy = np.empty(shape), np.empty(shape)
    _side_by_side(model, pull, pulling)
    _side_by_side(model, weight, heavy)
    _side_by_side(model, sharp, weighed)
    _pulled(model, weighed, np.ones(shape), pulls[0])
    for u in range(kinds):
        if u < BASES and not known[u]:
            continue
        _side_by_side(model, bases[u], beside[u])
        if u > 0:
            _pulled(model, beside[u], pulling, pulls[u])
        for t in range(len(weighed)):
            for r in range(len(model.starts)):
                weighed[t, r] = heavy[t, r] * beside[u, t, r]
        if u == 0:
            _banded(model, weighed, beside[u], band)
        else:
            _pulled(model, weighed, beside[0], weights[u, 0])
        for v in range(1, u + 1):
            if v >= BASES or known[v]:
                _lumped(model, weighed, beside[v], weights[u, v])
    for u in range(kinds):
        for v in range(u):
            copied(weights[u, v], weights[v, u])
    pulled = of_all_channels(pulls[0], len(model.fixed))
    for x in range(at.visibility):
        gradient[x] = dot(columns[x], pulled)
    if deviation > 0:
        _spread_columns(columns, deviation * (len(model.fixed) - 1) / pixels)
    _assemble(model, prior, unknowns, heat, hessian, gradient, cone, columns, weights, pulls, band)


@apart
def of_all_channels(values, m):
    """Sums over the channels of what is at the nodes of all in turn, shape (m,)."""
    total = values[:m].copy()
    for i in range(m, len(values)):
        total[i % m] += values[i]
    return total


@apart
def _weigh(band, rows, out):
    """Information at the nodes times changes of phase there, into `out`, shape (k, m)."""
    m, reach = rows.shape[1], len(band) - 1
    # behind margins of zeros every node has as many neighbours
    line, behind = np.zeros(m + 2 * reach), np.zeros(band.shape)
    for step in range(1, reach + 1):
        copied(band[step, : m - step], behind[step, step:])
    middle, a, b, c = band[0], band[1], band[2], band[3]
    p, q, r = behind[1], behind[2], behind[3]
    for x in range(len(rows)):
        own = out[x]
        copied(rows[x], line[reach : reach + m])
        far, left, near, here = line[:m], line[1 : 1 + m], line[2 : 2 + m], line[3 : 3 + m]
        next_, right, last = line[4 : 4 + m], line[5 : 5 + m], line[6 : 6 + m]
        for i in range(m):
            own[i] = (middle[i] * here[i] + a[i] * next_[i] + p[i] * near[i]) + (
                (b[i] * right[i] + q[i] * left[i]) + (c[i] * last[i] + r[i] * far[i])
            )


@sums
def _rows(model):
    """The unknown of each way to change a pixel that has one alone; -1 where there is none."""
    at, rows = model.at, np.full(BASES + len(model.leaks), -1)
    if at.blur > at.visibility:
        rows[3] = at.visibility
    if at.gamma > at.blur:
        rows[4] = at.blur
    if at.crosstalk > at.gamma:
        rows[5] = at.gamma
    for k in range(len(model.leaks)):
        rows[BASES + k] = at.crosstalk + k
    return rows


@apart
def _assemble(model, prior, unknowns, heat, hessian, gradient, cone, columns, weights, pulls, band):
    """Hessian and gradient from the sums at the nodes."""
    at, m, count = model.at, columns.shape[1], len(model.bias) * columns.shape[1]
    first, modes = at.visibility, at.visibility - at.modes
    weighed = np.empty((first, m))
    hessian[:] = 0.0
    _weigh(band, columns[:first], weighed)
    fill_products(weighed, columns, first, hessian)
    every = np.empty(count)
    for s in range(modes):
        row = at.modes + s
        bright, dark = model.brightness[s], model.darkness[s]
        for i in range(count):
            every[i] = weights[0, 1, i] * bright[i] + weights[0, 2, i] * dark[i]
        mixed = of_all_channels(every, m)
        for x in range(first):
            product = dot(columns[x], mixed)
            if x == row:
                hessian[x, x] += 2 * product
            elif x < row:
                hessian[row, x] += product
            else:
                hessian[x, row] += product
        for t in range(s + 1):
            total = 0.0
            other, darker = model.brightness[t], model.darkness[t]
            for i in range(count):
                total += bright[i] * (weights[1, 1, i] * other[i] + weights[1, 2, i] * darker[i])
                total += dark[i] * (weights[1, 2, i] * other[i] + weights[2, 2, i] * darker[i])
            hessian[row, at.modes + t] += total
        gradient[row] += dot(bright, pulls[1]) + dot(dark, pulls[2])
    rows = _rows(model)
    for u in range(3, len(pulls)):
        row = rows[u]
        if row < 0:
            continue
        mixed = of_all_channels(weights[0, u], m)
        for x in range(first):
            hessian[row, x] = dot(columns[x], mixed)
        for s in range(modes):
            hessian[row, at.modes + s] += dot(model.brightness[s], weights[1, u])
            hessian[row, at.modes + s] += dot(model.darkness[s], weights[2, u])
        for v in range(3, u + 1):
            if rows[v] >= 0:
                hessian[row, rows[v]] = weights[v, u].sum()
        gradient[row] = pulls[u].sum()
    for x in range(len(prior.joint)):
        for z in range(at.size):
            hessian[x, z] += prior.joint[x, z]
            gradient[x] += prior.joint[x, z] * (unknowns[z] - prior.mean[z])
    for x in range(at.size):
        hessian[x, x] += prior.precision[x]
        gradient[x] += prior.precision[x] * (unknowns[x] - prior.mean[x])
        for z in range(x):
            hessian[z, x] = hessian[x, z]
    add_cone(prior, at.loads, unknowns, heat, cone, gradient)


@sums
def empty_linearised(model):
    """Room for what `fill_linearised` fills in."""
    size, nodes, kinds = model.at.size, len(model.fixed), BASES + len(model.leaks)
    every = len(model.bias) * nodes
    return Linearised(
        np.zeros((size, size)),
        np.zeros(size),
        np.zeros((size, size)),
        np.zeros((size, nodes)),
        np.zeros((kinds, kinds, every)),
        np.zeros((kinds, every)),
        np.zeros((4, nodes)),
    )


@sums_entry
def spread_profiles(model, unknowns, profiles):
    """Profiles at the nodes as the point spread leaves them of the phase, shape (k, m).

    Parameters
    ----------
    model, unknowns
        As of `linearise`.
    profiles : ndarray, shape (k, m)
        Changes of the phase at the nodes [rad].
    """
    found, deviation = profiles.copy(), lens(model, unknowns)[1]
    if deviation > 0:
        pixels = len(model.amplitude) // len(model.bias)
        _spread_columns(found, deviation * (len(model.fixed) - 1) / pixels)
    return found


@sums_entry
def linearise(model, prior, frame, unknowns):
    """The loss about a point.

    Parameters
    ----------
    model : FrameModel
        What makes a frame.
    prior : Prior
        What is known before.
    frame : ndarray, shape (P,)
        Grey levels; not finite where a pixel is not used.
    unknowns : ndarray, shape (size,)
        The point.

    Returns
    -------
    Linearised
        Of the loss at full likelihood.
    """
    return _linearise(model, prior, frame, unknowns)


@apart
def _linearise(model, prior, frame, unknowns):
    """As `linearise`."""
    work, out = workspace(model), empty_linearised(model)
    fill_exposure(model, unknowns, work)
    fill_linearised(model, prior, frame, unknowns, work, np.sqrt(model.variance), 1.0, out)
    return out


@sums_entry
def weighed_waves(band, waves):
    """Information at the nodes times changes of phase there, shape (k, m).

    Parameters
    ----------
    band : ndarray, shape (4, m)
        Of a `Linearised`.
    waves : ndarray, shape (k, m)
        The changes [rad].
    """
    found = np.empty(waves.shape)
    _weigh(band, waves, found)
    return found


@sums_entry
def rows_of(model):
    """As `_rows`, for Python."""
    return _rows(model)


def banded(about: Linearised, waves: Array) -> Array:
    """Information at the nodes times changes of phase there, shape (k, m)."""
    return weighed_waves(about.band, np.ascontiguousarray(waves))


def pulled_phase(about: Linearised) -> Array:
    """What the residuals of all channels pull the phase at the nodes by, shape (m,)."""
    return over_channels(about.pulls[0], about.columns.shape[1])


def over_channels(values: Array, nodes: int) -> Array:
    """Sums over the channels of what is at the nodes of all in turn, shape (..., m)."""
    channels = values.shape[-1] // nodes
    return values.reshape(*values.shape[:-1], channels, nodes).sum(axis=-2)


def _singles(model: FrameModel) -> list[tuple[int, int]]:
    """Ways to change a pixel that have an unknown of their own, and where it stands."""
    return [(u, int(row)) for u, row in enumerate(rows_of(model)) if row >= 0]


def shared_information(
    model: FrameModel, about: Linearised, waves: Array, weighed: Array | None = None
) -> Array:
    """Information that unknowns share with changes of phase at the nodes, shape (size, k).

    `weighed` is what `banded` makes of the waves, if it is at hand.
    """
    at, weights, nodes = model.at, about.weights, waves.shape[1]
    found = about.columns @ (banded(about, waves) if weighed is None else weighed).T
    bright, dark = weights[0, 1] * model.brightness, weights[0, 2] * model.darkness
    found[at.modes : at.visibility] += over_channels(bright + dark, nodes) @ waves.T
    for u, row in _singles(model):
        found[row] = waves @ over_channels(weights[0, u], nodes)
    return found


def light_information(model: FrameModel, about: Linearised, bright: Array, dark: Array) -> Array:
    """Information that unknowns share with changes of the light at the nodes, shape (size, k).

    Parameters
    ----------
    model, about
        Of a frame, with modes of its own.
    bright, dark : ndarray, shape (k, C m)
        Changes of the amplitude, relative to it, and of the offset, grey levels.
    """
    at, weights = model.at, about.weights
    by_phase, by_bright, by_dark = (weights[u, 1] * bright + weights[u, 2] * dark for u in range(3))
    found = np.zeros((at.size, len(bright)))
    phases = over_channels(by_phase, about.columns.shape[1])
    found[: at.visibility] = about.columns[: at.visibility] @ phases.T
    modes = slice(at.modes, at.visibility)
    found[modes] += model.brightness @ by_bright.T + model.darkness @ by_dark.T
    for u, row in _singles(model):
        found[row] = bright @ weights[1, u] + dark @ weights[2, u]
    return found
