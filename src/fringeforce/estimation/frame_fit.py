"""The loss of a frame, its derivatives, and the climb to its smallest value, in compiled loops.

The loss is twice the negative logarithm of the posterior of all unknowns of a `FrameModel`.  What
acts through smooth profiles is summed at the nodes, so that a step costs little more than a frame.
"""

from __future__ import annotations

from math import erfc
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import sums, sums_entry
from fringeforce.estimation.frame_exposure import (
    blurred,
    dot,
    fill_columns,
    fill_exposure,
    half_waves,
    kernel_of,
    lens,
    power_of,
    workspace,
)
from fringeforce.estimation.frame_model import FrameModel

Array = NDArray[np.float64]

BASES = 6
"""Ways in which an unknown changes a pixel: phase, amplitude, offset, visibility, blur, gamma."""
UNDAMPED = 0.1
"""Damping below which a step is nearly that of Gauss and Newton."""
PLAIN = 2.5
"""Standard deviations within which a pixel counts as sound; it is broken once in a thousand."""


class Prior(NamedTuple):
    """What is known of the unknowns before a frame: normal, and contacts push.

    Attributes
    ----------
    mean, precision : ndarray, shape (size,)
        Of the unknowns.
    friction : float
        Largest |tangential| / normal force; negative if any.
    yielding : float
        Force by which a contact may miss the friction cone at one standard deviation [N].
    joint : ndarray, shape (size, size)
        Precision of unknowns together, beside that of each; empty if none is known together.
    """

    mean: Array
    precision: Array
    friction: float
    yielding: float
    joint: Array = np.empty((0, 0))


class Linearised(NamedTuple):
    """The loss about one point.

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
    weights : ndarray, shape (BASES, BASES, m)
        Sums over the pixels around a node of products of the bases, in units of the noise; that of
        two phases is in `band`.
    pulls : ndarray, shape (BASES, m)
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


@sums
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
            before[:] = line
            left, here, right = before[:-2], before[1:-1], before[2:]
            for i in range(len(left)):
                line[i + 1] = here[i] + share * (left[i] + right[i] - 2 * here[i])


@sums
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
    out[:] = padded[reach : reach + size]
    out[0] += padded[:reach].sum()
    out[size - 1] += padded[reach + size :].sum()


@sums
def by_gamma_of(model, unknowns, level):
    """Derivative of a grey level by the power of the response."""
    share = max(level / model.full_scale, 1e-6)
    return level * np.log(share) / power_of(model, unknowns)


@sums
def _log_normal_cdf(x):
    if x > -10:
        return np.log(0.5 * erfc(-x / np.sqrt(2.0)))
    # the asymptotic series, to 1e-4 there
    return -0.5 * x * x - np.log(-x) - 0.5 * np.log(2 * np.pi) + np.log1p(-1 / (x * x))


@sums
def pixel_loss(model, frame, level, sigma):
    """Loss of one pixel, half its derivative by the level and half its second one, in sigmas.

    Most pixels are Gaussian about their level, and a share of them shows anything: the loss is that
    of the mixture.  A clipped pixel has the likelihood that noise carries it past the limit (Tobin,
    Econometrica 26, 24-36, 1958).
    """
    side = limit = 0.0
    if frame <= model.floor:
        side, limit = -1.0, model.floor + 0.5
    elif frame >= model.ceiling:
        side, limit = 1.0, model.ceiling - 0.5
    if side != 0.0:
        beyond = side * (level - limit) / sigma
        log_chance = _log_normal_cdf(beyond)
        hazard = np.exp(-0.5 * beyond * beyond - log_chance) / np.sqrt(2 * np.pi)
        return -2 * log_chance, -side * hazard, hazard * (hazard + beyond)
    left = (level - frame) / sigma
    if abs(left) < PLAIN:
        return left * left, left, 1.0
    good = (1 - model.broken) * np.exp(-0.5 * left * left)
    bad = model.broken * np.sqrt(2 * np.pi) * sigma / model.full_scale
    share = good / (good + bad)
    return -2 * np.log(good + bad), share * left, share


@sums
def prior_loss(prior, loads, unknowns, heat):
    """What the prior adds to the loss."""
    total = 0.0
    for k in range(len(unknowns)):
        total += prior.precision[k] * (unknowns[k] - prior.mean[k]) ** 2
    for k in range(len(prior.joint)):
        part = 0.0
        for x in range(len(unknowns)):
            part += prior.joint[k, x] * (unknowns[x] - prior.mean[x])
        total += (unknowns[k] - prior.mean[k]) * part
    for j in range(loads // 2):
        normal, tangential = unknowns[2 * j], unknowns[2 * j + 1]
        if prior.friction < 0:
            total += (min(normal, 0.0) / prior.yielding) ** 2 / heat
        else:
            for side in (-1.0, 1.0):
                miss = min(prior.friction * normal + side * tangential, 0.0)
                total += (miss / prior.yielding) ** 2 / heat
    return total


@sums
def frame_loss(model, prior, frame, unknowns, level, sigma, heat):
    """Twice the negative logarithm of the posterior, less a constant."""
    total = prior_loss(prior, model.at.loads, unknowns, heat)
    for p in range(len(frame)):
        if np.isfinite(frame[p]):
            total += pixel_loss(model, frame[p], level[p], sigma)[0]
    return total


@sums
def weighed_squares(model, frame, level):
    """Weighted sum of squared residuals in units of the noise, and the sum of the weights."""
    sigma = np.sqrt(model.variance)
    square = count = 0.0
    for p in range(len(frame)):
        if np.isfinite(frame[p]):
            _, pull, weight = pixel_loss(model, frame[p], level[p], sigma)
            if weight > 0:
                square += pull * pull / weight
                count += weight
    return square, count


@sums
def _side_by_side(model, values, out):
    """Pixels of every run under each other, shape (longest run, runs); not used beyond its end."""
    runs = len(model.starts)
    for t in range(len(out)):
        line, row = values[t:], out[t]
        for r in range(runs):
            row[r] = line[model.starts[r]]


@sums
def _pulled(model, basis, pull, out):
    """Sums of a basis times the residuals, at the nodes between which each pixel lies."""
    runs, channels = len(model.starts) // len(model.bias), len(model.bias)
    total = np.zeros(len(model.starts))
    for k in range(4):
        total[:] = 0.0
        for t in range(len(basis)):
            own, other, share = basis[t], pull[t], model.shares[t, k]
            for r in range(len(total)):
                total[r] += share[r] * (own[r] * other[r])
        for c in range(channels):
            i = model.first[0] + k
            for r in range(runs):
                out[i + r] += total[c * runs + r]


@sums
def _lumped(model, basis, other, out):
    """Sums of the products of two bases, at the two nodes beside each pixel."""
    runs, channels = len(model.starts) // len(model.bias), len(model.bias)
    left, right = np.zeros(len(model.starts)), np.zeros(len(model.starts))
    for t in range(len(basis)):
        one, two, share, rest = basis[t], other[t], model.halves[t, 0], model.halves[t, 1]
        for r in range(len(left)):
            value = one[r] * two[r]
            left[r] += share[r] * value
            right[r] += rest[r] * value
    for c in range(channels):
        i = model.first[0] + 1
        for r in range(runs):
            out[i + r] += left[c * runs + r]
            out[i + 1 + r] += right[c * runs + r]


@sums
def _banded(model, basis, other, band):
    """Sums of the products of two bases, at the pairs of nodes between which each pixel lies."""
    runs, channels = len(model.starts) // len(model.bias), len(model.bias)
    total = np.zeros(len(model.starts))
    for k in range(4):
        for step in range(4 - k):
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


@sums
def fill_linearised(model, prior, frame, unknowns, work, sigma, heat, out):
    """Fill in `out`, of the frame that `work` holds."""
    _, phase, swing, seen, level, slope, bright = work
    at = model.at
    channels, pixels = len(model.bias), len(phase) // len(model.bias)
    contrast, deviation, by_blur = lens(model, unknowns)
    gamma = at.size > at.gamma
    hessian, gradient, cone, columns, weights, pulls, band = out
    fill_columns(model, unknowns, columns)
    weights[:], pulls[:], band[:] = 0.0, 0.0, 0.0
    turned, smeared = np.empty(pixels), np.empty(pixels)
    pulled, sharp = np.empty(pixels), np.zeros(len(phase))
    bases, weight = np.zeros((BASES, len(phase))), np.zeros(len(phase))
    pull = np.zeros(len(phase))
    for c in range(channels):
        ratio, bias, spread, begin = model.dispersion[c], model.bias[c], model.spread[c], c * pixels
        for k in range(pixels):
            sine, cosine = half_waves(phase[begin + k] + bias)
            turned[k] = 2 * sine * cosine
        if spread > 0:
            for k in range(pixels):
                lead = phase[begin + k]
                share = np.exp(-0.5 * (spread * lead) ** 2)
                turned[k] = share * turned[k] + spread * spread * lead * swing[begin + k]
        if deviation > 0:
            blurred(turned, kernel_of(deviation), smeared)
        else:
            smeared[:] = turned
        for k in range(pixels):
            p = begin + k
            if not np.isfinite(frame[p]):
                continue
            _, pull[p], weight[p] = pixel_loss(model, frame[p], level[p], sigma)
            amplitude, own = model.amplitude[p] * bright[p], slope[p] / sigma
            bases[0, p] = own * amplitude * contrast / 2 * smeared[k] * ratio
            bases[1, p] = own * model.amplitude[p] * (1 - contrast * seen[p]) / 2
            bases[2, p] = own
            bases[3, p] = -own * amplitude * model.visibility_std * seen[p] / 2
            curve = seen[begin + max(k - 1, 0)] + seen[begin + min(k + 1, pixels - 1)]
            curve -= 2 * seen[p]
            bases[4, p] = -own * amplitude * contrast / 2 * deviation * by_blur * curve
            if gamma:
                bases[5, p] = model.gamma_std * by_gamma_of(model, unknowns, level[p]) / sigma
        # the gradient by the phase is exact: the point spread acts on the residuals
        for k in range(pixels):
            p = begin + k
            pulled[k] = slope[p] / sigma * model.amplitude[p] * bright[p] * contrast / 2 * pull[p]
        if deviation > 0:
            _blurred_back(pulled, kernel_of(deviation), smeared)
        else:
            smeared[:] = pulled
        for k in range(pixels):
            sharp[begin + k] = ratio * turned[k] * smeared[k]
    modes, shape = at.visibility - at.modes, (len(model.shares), len(model.starts))
    known = (True, modes > 0, modes > 0, at.blur > at.visibility, at.gamma > at.blur, gamma)
    beside, weighed = np.empty((BASES, *shape)), np.empty(shape)
    pulling, heavy = np.empty(shape), np.empty(shape)
    _side_by_side(model, pull, pulling)
    _side_by_side(model, weight, heavy)
    _side_by_side(model, sharp, weighed)
    _pulled(model, weighed, np.ones(shape), pulls[0])
    for u in range(BASES):
        if not known[u]:
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
            if known[v]:
                _lumped(model, weighed, beside[v], weights[u, v])
    for u in range(BASES):
        for v in range(u):
            weights[v, u] = weights[u, v]
    for x in range(at.visibility):
        gradient[x] = dot(columns[x], pulls[0])
    if deviation > 0:
        _spread_columns(columns, deviation * (len(model.fixed) - 1) / pixels)
    _assemble(model, prior, unknowns, heat, hessian, gradient, cone, columns, weights, pulls, band)


@sums
def fill_products(rows, columns, count, out):
    """Products of the first rows with the first columns, in the lower triangle, eight at a time."""
    for x in range(0, count - 1, 2):
        a, b = rows[x], rows[x + 1]
        z = 0
        while z + 3 < count and z <= x + 1:
            p, q, r, s = columns[z], columns[z + 1], columns[z + 2], columns[z + 3]
            ap = aq = ar = at = bp = bq = br = bt = 0.0
            for i in range(len(a)):
                ap += a[i] * p[i]
                aq += a[i] * q[i]
                ar += a[i] * r[i]
                at += a[i] * s[i]
                bp += b[i] * p[i]
                bq += b[i] * q[i]
                br += b[i] * r[i]
                bt += b[i] * s[i]
            out[x, z], out[x, z + 1], out[x, z + 2], out[x, z + 3] = ap, aq, ar, at
            out[x + 1, z], out[x + 1, z + 1], out[x + 1, z + 2], out[x + 1, z + 3] = bp, bq, br, bt
            z += 4
        for k in range(z, x + 2):
            out[x, k], out[x + 1, k] = dot(a, columns[k]), dot(b, columns[k])
    if count % 2 == 1:
        for k in range(count):
            out[count - 1, k] = dot(rows[count - 1], columns[k])


@sums
def add_cone(prior, loads, unknowns, heat, cone, gradient):
    """Fill in what the cone adds to the Hessian, and add to the gradient."""
    cone[:] = 0.0
    stiff = 1 / (prior.yielding**2 * heat)
    for j in range(loads // 2):
        a, b = 2 * j, 2 * j + 1
        if prior.friction < 0:
            if unknowns[a] < 0:
                cone[a, a] += stiff
                gradient[a] += stiff * unknowns[a]
            continue
        for side in (-1.0, 1.0):
            miss = prior.friction * unknowns[a] + side * unknowns[b]
            if miss < 0:
                gradient[a] += stiff * prior.friction * miss
                gradient[b] += stiff * side * miss
                cone[a, a] += stiff * prior.friction**2
                cone[b, b] += stiff
                cone[b, a] += stiff * side * prior.friction
                cone[a, b] += stiff * side * prior.friction


@sums
def _weigh(band, rows, out):
    """Information at the nodes times changes of phase there, into `out`, shape (k, m)."""
    m, reach = rows.shape[1], len(band) - 1
    # behind margins of zeros every node has as many neighbours
    line, behind = np.zeros(m + 2 * reach), np.zeros(band.shape)
    for step in range(1, reach + 1):
        behind[step, step:] = band[step, : m - step]
    middle, a, b, c = band[0], band[1], band[2], band[3]
    p, q, r = behind[1], behind[2], behind[3]
    for x in range(len(rows)):
        own = out[x]
        line[reach : reach + m] = rows[x]
        far, left, near, here = line[:m], line[1 : 1 + m], line[2 : 2 + m], line[3 : 3 + m]
        next_, right, last = line[4 : 4 + m], line[5 : 5 + m], line[6 : 6 + m]
        for i in range(m):
            own[i] = (middle[i] * here[i] + a[i] * next_[i] + p[i] * near[i]) + (
                (b[i] * right[i] + q[i] * left[i]) + (c[i] * last[i] + r[i] * far[i])
            )


@sums
def _assemble(model, prior, unknowns, heat, hessian, gradient, cone, columns, weights, pulls, band):
    """Hessian and gradient from the sums at the nodes."""
    at, m = model.at, columns.shape[1]
    first, modes = at.visibility, at.visibility - at.modes
    weighed = np.empty((first, m))
    hessian[:] = 0.0
    _weigh(band, columns[:first], weighed)
    fill_products(weighed, columns, first, hessian)
    mixed = np.empty(m)
    for s in range(modes):
        row = at.modes + s
        bright, dark = model.brightness[s], model.darkness[s]
        for i in range(m):
            mixed[i] = weights[0, 1, i] * bright[i] + weights[0, 2, i] * dark[i]
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
            for i in range(m):
                total += bright[i] * (weights[1, 1, i] * other[i] + weights[1, 2, i] * darker[i])
                total += dark[i] * (weights[1, 2, i] * other[i] + weights[2, 2, i] * darker[i])
            hessian[row, at.modes + t] += total
        gradient[row] += dot(bright, pulls[1]) + dot(dark, pulls[2])
    begins = (at.visibility, at.blur, at.gamma, at.size)
    for u in range(3, BASES):
        row = begins[u - 3]
        if begins[u - 2] == row:
            continue
        for x in range(first):
            hessian[row, x] = dot(columns[x], weights[0, u])
        for s in range(modes):
            hessian[row, at.modes + s] += dot(model.brightness[s], weights[1, u])
            hessian[row, at.modes + s] += dot(model.darkness[s], weights[2, u])
        for v in range(3, u + 1):
            if begins[v - 2] > begins[v - 3]:
                hessian[row, begins[v - 3]] = weights[v, u].sum()
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
def factorised(hessian, cone, damping, lower):
    """Root of H + cone + damping diag, into `lower`; False where it is not positive definite."""
    for i in range(len(lower)):
        for j in range(i + 1):
            total = hessian[i, j] + cone[i, j]
            if i == j:
                total *= 1 + damping
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            if i == j:
                if not total > 0:
                    return False
                lower[i, i] = np.sqrt(total)
            else:
                lower[i, j] = total / lower[j, j]
    return True


@sums
def substituted(lower, gradient, step):
    """Solve for the step to where the gradient vanishes, from the root of the Hessian."""
    size = len(step)
    for i in range(size):
        total = -gradient[i]
        for k in range(i):
            total -= lower[i, k] * step[k]
        step[i] = total / lower[i, i]
    for i in range(size - 1, -1, -1):
        step[i] /= lower[i, i]
        for k in range(i):
            step[k] -= lower[i, k] * step[i]


@sums
def _solve(hessian, cone, damping, gradient, lower, step):
    """Solve (H + cone + damping diag) step = -gradient; False where it is not positive definite."""
    if not factorised(hessian, cone, damping, lower):
        return False
    substituted(lower, gradient, step)
    return True


@sums
def empty_linearised(model):
    """Room for what `fill_linearised` fills in."""
    size, nodes = model.at.size, len(model.fixed)
    return Linearised(
        np.zeros((size, size)),
        np.zeros(size),
        np.zeros((size, size)),
        np.zeros((size, nodes)),
        np.zeros((BASES, BASES, nodes)),
        np.zeros((BASES, nodes)),
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
    work, out = workspace(model), empty_linearised(model)
    fill_exposure(model, unknowns, work)
    fill_linearised(model, prior, frame, unknowns, work, np.sqrt(model.variance), 1.0, out)
    return out


@sums_entry
def loss_at(model, prior, frame, unknowns):
    """The loss at a point, and its parts; parameters as of `linearise`.

    Returns
    -------
    loss : float
        Twice the negative logarithm of the posterior, less a constant.
    square, count : float
        Weighted sum of squared residuals in units of the noise, and sum of the weights.
    """
    work = workspace(model)
    fill_exposure(model, unknowns, work)
    loss = frame_loss(model, prior, frame, unknowns, work[4], np.sqrt(model.variance), 1.0)
    square, count = weighed_squares(model, frame, work[4])
    return loss, square, count


@sums_entry
def information(model, frame, unknowns, more):
    """Information of the sound pixels about the unknowns: an exact sum over all of them.

    Parameters
    ----------
    model, frame, unknowns
        As of `linearise`.
    more : ndarray, shape (k, m)
        Change of the phase at the nodes with further unknowns, which stand behind the others.

    Returns
    -------
    ndarray, shape (size + k, size + k)
        Half the second derivative of the loss without the prior (Gauss-Newton).
    """
    work, at, sigma = workspace(model), model.at, np.sqrt(model.variance)
    nodes, phase, swing, seen, level, slope, bright = work
    fill_exposure(model, unknowns, work)
    contrast, deviation, by_blur = lens(model, unknowns)
    columns = np.zeros((at.size, len(nodes)))
    fill_columns(model, unknowns, columns)
    channels, pixels = len(model.bias), len(phase) // len(model.bias)
    total = at.size + len(more)
    turned, rows = np.empty(pixels), np.zeros((total, len(phase)))
    weight, kernel = np.zeros(len(phase)), np.ones(1)
    if deviation > 0:
        kernel = kernel_of(deviation)
    for c in range(channels):
        begin = c * pixels
        lines = slice(begin, begin + pixels)
        for k in range(pixels):
            lead = phase[begin + k]
            turned[k] = np.sin(lead + model.bias[c])
            if model.spread[c] > 0:
                share = np.exp(-0.5 * (model.spread[c] * lead) ** 2)
                curve = model.spread[c] ** 2 * lead * swing[begin + k]
                turned[k] = share * turned[k] + curve
        own = np.empty(pixels)
        for x in range(total):
            if at.visibility <= x < at.size:
                continue
            row = columns[x] if x < at.size else more[x - at.size]
            for k in range(pixels):
                p = begin + k
                i, w = model.first[p], model.weights[p]
                own[k] = w[0] * row[i] + w[1] * row[i + 1]
                own[k] += w[2] * row[i + 2] + w[3] * row[i + 3]
                own[k] *= turned[k]
            blurred(own, kernel, rows[x, lines])
            for k in range(pixels):
                p = begin + k
                rows[x, p] *= model.dispersion[c] * model.amplitude[p] * bright[p] * contrast / 2
        for k in range(pixels):
            p = begin + k
            light = model.amplitude[p] * (1 - contrast * seen[p]) / 2
            for s in range(len(model.brightness)):
                for t in range(4):
                    profile = light * model.brightness[s, model.first[p] + t]
                    profile += model.darkness[s, model.first[p] + t]
                    rows[at.modes + s, p] += model.weights[p, t] * profile
            amplitude = model.amplitude[p] * bright[p]
            if at.blur > at.visibility:
                rows[at.visibility, p] = -amplitude * model.visibility_std * seen[p] / 2
            if at.gamma > at.blur:
                curve = seen[begin + max(k - 1, 0)] + seen[begin + min(k + 1, pixels - 1)]
                curve -= 2 * seen[p]
                rows[at.blur, p] = -amplitude * contrast / 2 * deviation * by_blur * curve
            if at.size > at.gamma:
                by_gamma = by_gamma_of(model, unknowns, level[p])
                rows[at.gamma, p] = model.gamma_std * by_gamma / slope[p]
            if np.isfinite(frame[p]):
                weight[p] = pixel_loss(model, frame[p], level[p], sigma)[2]
    found, weighed = np.empty((total, total)), np.empty((total, len(phase)))
    for p in range(len(phase)):
        weight[p] *= (slope[p] / sigma) ** 2
    for x in range(total):
        for p in range(len(phase)):
            weighed[x, p] = rows[x, p] * weight[p]
    fill_products(weighed, rows, total, found)
    for x in range(total):
        for z in range(x):
            found[z, x] = found[x, z]
    return found


def climb(
    model: FrameModel,
    prior: Prior,
    frame: Array,
    start: Array,
    heat: float,
    steps: int,
    tolerance: float,
    bound: float = np.inf,
) -> tuple[Array, float, float, float]:
    """Maximise the posterior from a start, by Levenberg and Marquardt's damped Gauss-Newton steps.

    Each step solves (H + damping diag H) step = -gradient and is taken if the loss falls
    (Marquardt, J. SIAM 11, 431, 1963).

    Parameters
    ----------
    model, prior, frame
        As of `linearise`.
    start : ndarray, shape (size,)
        Where to start.
    heat : float
        Factor on the variance of the noise and of the cone: above 1 the loss has fewer valleys.
    steps : int
        Most steps.
    tolerance : float
        Fall of the loss below which it is at its smallest.
    bound : float
        Loss above which a top is of no use: a climb ends where twice the fall that its linearised
        problem has left does not lead below.

    Returns
    -------
    unknowns : ndarray, shape (size,)
        The last point.
    loss : float
        Twice the negative logarithm of the posterior there, less a constant.
    square : float
        Weighted sum of squared residuals in units of the noise.
    count : float
        Sum of the weights of the pixels, their number if none is clipped or broken.
    """
    return _climb(model, prior, frame, start, heat, steps, tolerance, bound)


@sums_entry
def _climb(model, prior, frame, start, heat, steps, tolerance, bound):
    """As `climb`; an argument that may be left out would have the loop compiled twice."""
    sigma = np.sqrt(model.variance * heat)
    here, there, out = workspace(model), workspace(model), empty_linearised(model)
    lower, step = np.zeros_like(out.hessian), np.empty(len(start))
    unknowns, damping = start.copy(), 1e-2
    fill_exposure(model, unknowns, here)
    loss = frame_loss(model, prior, frame, unknowns, here[4], sigma, heat)
    for _ in range(steps):
        fill_linearised(model, prior, frame, unknowns, here, sigma, heat, out)
        better, reached, trial = False, loss, unknowns
        while damping < 1e6:
            if _solve(out.hessian, out.cone, damping, out.gradient, lower, step):
                trial = unknowns + step
                fill_exposure(model, trial, there)
                reached = frame_loss(model, prior, frame, trial, there[4], sigma, heat)
                if reached <= loss:
                    better = True
                    break
            damping *= 6
        if not better:
            break
        fall = -dot(step, out.gradient)
        gain, loss, unknowns = loss - reached, reached, trial
        here, there = there, here
        # a short step of a large damping falls little, far from any top
        if (gain < tolerance and damping < UNDAMPED) or loss - 2 * max(fall, gain) > bound:
            break
        damping = max(damping / 8, 1e-8)
    square, count = weighed_squares(model, frame, here[4])
    return unknowns, loss, square, count


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


def banded(about: Linearised, waves: Array) -> Array:
    """Information at the nodes times changes of phase there, shape (k, m)."""
    return weighed_waves(about.band, np.ascontiguousarray(waves))


def shared_information(
    model: FrameModel, about: Linearised, waves: Array, weighed: Array | None = None
) -> Array:
    """Information that unknowns share with changes of phase at the nodes, shape (size, k).

    `weighed` is what `banded` makes of the waves, if it is at hand.
    """
    at, weights = model.at, about.weights
    found = about.columns @ (banded(about, waves) if weighed is None else weighed).T
    found[at.modes : at.visibility] += model.brightness @ (weights[0, 1] * waves).T
    found[at.modes : at.visibility] += model.darkness @ (weights[0, 2] * waves).T
    if at.blur > at.visibility:
        found[at.visibility] = waves @ weights[0, 3]
    if at.gamma > at.blur:
        found[at.blur] = waves @ weights[0, 4]
    if at.size > at.gamma:
        found[at.gamma] = waves @ weights[0, 5]
    return found


def light_information(model: FrameModel, about: Linearised, bright: Array, dark: Array) -> Array:
    """Information that unknowns share with changes of the light at the nodes, shape (size, k).

    Parameters
    ----------
    model, about
        Of a frame, with modes of its own.
    bright, dark : ndarray, shape (k, m)
        Changes of the amplitude, relative to it, and of the offset, grey levels.
    """
    at, weights = model.at, about.weights
    by_phase, by_bright, by_dark = (weights[u, 1] * bright + weights[u, 2] * dark for u in range(3))
    found = np.zeros((at.size, len(bright)))
    found[: at.visibility] = about.columns[: at.visibility] @ by_phase.T
    modes = slice(at.modes, at.visibility)
    found[modes] += model.brightness @ by_bright.T + model.darkness @ by_dark.T
    for u, begin, end in zip((3, 4, 5), at[5:8], at[6:9], strict=True):
        if end > begin:
            found[begin] = bright @ weights[1, u] + dark @ weights[2, u]
    return found
