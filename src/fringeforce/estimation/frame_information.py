"""Information of the sound pixels of a frame about its unknowns, an exact sum over all of them."""

from __future__ import annotations

import numpy as np

from fringeforce.estimation.compiling import apart, sums, sums_entry
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
from fringeforce.estimation.frame_loss import pixel_loss


@apart
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
def fill_combinations(factors, rows, out):
    """Factors times rows, into `out`; rows beyond the factors do not count."""
    for x in range(len(out)):
        own = out[x]
        own[:] = 0.0
        for k in range(factors.shape[1]):
            factor, row = factors[x, k], rows[k]
            for i in range(len(own)):
                own[i] += factor * row[i]


@sums
def fill_dots(rows, line, count, out):
    """Products of the first rows with a line, four at a time, into `out`."""
    k = 0
    while k + 3 < count:
        p, q, r, s = rows[k], rows[k + 1], rows[k + 2], rows[k + 3]
        a = b = c = d = 0.0
        for i in range(len(line)):
            a += p[i] * line[i]
            b += q[i] * line[i]
            c += r[i] * line[i]
            d += s[i] * line[i]
        out[k], out[k + 1], out[k + 2], out[k + 3] = a, b, c, d
        k += 4
    for x in range(k, count):
        out[x] = dot(rows[x], line)


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
    return _information(model, frame, unknowns, more)


@apart
def _information(model, frame, unknowns, more):
    """As `information`."""
    work, at, sigma = workspace(model), model.at, np.sqrt(model.variance)
    nodes, phase, swing, seen, level, slope, bright = work
    fill_exposure(model, unknowns, work)
    contrast, deviation, by_blur = lens(model, unknowns)
    columns = np.zeros((at.size, len(nodes)))
    fill_columns(model, unknowns, columns)
    channels, pixels = len(model.bias), len(phase) // len(model.bias)
    total = at.size + len(more)
    slopes, rows = np.empty(len(phase)), np.zeros((total, len(phase)))
    fill_slopes(model, unknowns, work, slopes)
    weight, kernel = np.zeros(len(phase)), np.ones(1)
    if deviation > 0:
        kernel = kernel_of(deviation)
    for c in range(channels):
        begin = c * pixels
        lines = slice(begin, begin + pixels)
        turned, own = slopes[lines], np.empty(pixels)
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
                rows[x, p] *= model.amplitude[p] * bright[p] * contrast / 2
        for x in range(len(model.leaks)):
            row = rows[at.crosstalk + x, lines]
            mix(model.leaks[x, c], swing, own)
            blurred(own, kernel, row)
            for k in range(pixels):
                row[k] *= -model.amplitude[begin + k] * bright[begin + k] * contrast / 2
        for k in range(pixels):
            p = begin + k
            light = model.amplitude[p] * (1 - contrast * seen[p]) / 2
            for s in range(len(model.brightness)):
                for t in range(4):
                    i = c * len(nodes) + model.first[p] + t
                    profile = light * model.brightness[s, i] + model.darkness[s, i]
                    rows[at.modes + s, p] += model.weights[p, t] * profile
            amplitude = model.amplitude[p] * bright[p]
            if at.blur > at.visibility:
                rows[at.visibility, p] = -amplitude * model.visibility_std * seen[p] / 2
            if at.gamma > at.blur:
                curve = seen[begin + max(k - 1, 0)] + seen[begin + min(k + 1, pixels - 1)]
                curve -= 2 * seen[p]
                rows[at.blur, p] = -amplitude * contrast / 2 * deviation * by_blur * curve
            if at.crosstalk > at.gamma:
                by_gamma = by_gamma_of(model, unknowns, level[p])
                rows[at.gamma, p] = model.gamma_std * by_gamma / slope[p]
            if np.isfinite(frame[p]):
                weight[p] = pixel_loss(model, frame[p], level[p], sigma[p])[2]
    found, weighed = np.empty((total, total)), np.empty((total, len(phase)))
    for p in range(len(phase)):
        weight[p] *= (slope[p] / sigma[p]) ** 2
    for x in range(total):
        for p in range(len(phase)):
            weighed[x, p] = rows[x, p] * weight[p]
    fill_products(weighed, rows, total, found)
    for x in range(total):
        for z in range(x):
            found[z, x] = found[x, z]
    return found
