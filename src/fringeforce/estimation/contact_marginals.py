"""Moments of single contacts among others, by sums over their places and widths in compiled loops.

Given place and width the loads of a contact are normal, and integrated out.  The friction cone is
quadratic on each of its sides, so that its integral is Laplace's approximation on the side of the
best loads.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import sums, sums_entry
from fringeforce.estimation.uncertain_contacts import moments_at

Array = NDArray[np.float64]

ACTIVE = 4
"""Newton steps in which the sides of the cone are found."""
LIGHT = 1e-10
"""Share of the density below which a place and width does not count."""


class Marginals(NamedTuple):
    """Moments of k contacts, each as it is among the others; x is its phase, and uncertain place.

    Attributes
    ----------
    mean, covariance : ndarray, shapes (k, q) and (k, q, q)
        Of x.
    loads, spread : ndarray, shapes (k, 2) and (k, 2, 2)
        Mean [N] and covariance [N^2] of the loads.
    shared : ndarray, shape (k, 2, q)
        Covariance of the loads and x.
    centre, scatter : ndarray, shapes (k, 2) and (k, 2, 2)
        Mean and covariance of place and width.
    """

    mean: Array
    covariance: Array
    loads: Array
    spread: Array
    shared: Array
    centre: Array
    scatter: Array


@sums
def _loads_given(contacts, known, right):
    """Loads at which f' K f / 2 - r f and the cone are smallest, K of (normal, both, tangential).

    Their covariance, and the logarithm of the integral over them, less a constant.
    """
    slope, stiff = contacts.friction, contacts.stiff
    below = above = False
    a = b = x = y = z = missed = other = 0.0
    for _ in range(ACTIVE):
        x, y, z = known
        sides = (1.0 if below else 0.0) + (1.0 if above else 0.0)
        if slope < 0:
            x += stiff * sides
        else:
            x += stiff * slope * slope * sides
            y += stiff * slope * ((1.0 if above else 0.0) - (1.0 if below else 0.0))
            z += stiff * sides
        bound = x * z - y * y
        a, b = (z * right[0] - y * right[1]) / bound, (x * right[1] - y * right[0]) / bound
        missed, other = min(slope * a - b, 0.0), min(slope * a + b, 0.0)
        if slope < 0:
            missed, other = min(a, 0.0), 0.0
        if below == (missed < 0) and above == (other < 0):
            break
        below, above = missed < 0, other < 0
    bound = x * z - y * y
    value = a * right[0] + b * right[1] - 0.5 * stiff * (missed * missed + other * other)
    value -= 0.5 * (known[0] * a * a + 2 * known[1] * a * b + known[2] * b * b)
    return a, b, z / bound, -y / bound, x / bound, value - 0.5 * np.log(bound)


@sums
def _summed(logs, loads, spreads, shown, z, placed, out, k):
    """Moments of contact k of `out` from what each place and width gives."""
    rank = shown.shape[2]
    mean, covariance, force, spread = out.mean[k], out.covariance[k], out.loads[k], out.spread[k]
    shared, centre, scatter = out.shared[k], out.centre[k], out.scatter[k]
    x, most, total = np.empty(len(mean)), logs.max(), 0.0
    for g in range(len(logs)):
        logs[g] = np.exp(logs[g] - most)
        total += logs[g]
    for again in range(2):
        for g in range(len(logs)):
            weight = logs[g] / total
            if weight < LIGHT:
                continue
            a, b, one, two = loads[g, 0], loads[g, 1], shown[g, 0], shown[g, 1]
            for i in range(rank):
                x[i] = a * one[i] + b * two[i]
            if placed:
                x[rank] = z[g, 0]
            if not again:
                for i in range(len(mean)):
                    mean[i] += weight * x[i]
                force[0] += weight * a
                force[1] += weight * b
                centre[0] += weight * z[g, 0]
                centre[1] += weight * z[g, 1]
                continue
            a, b, along, across = (
                a - force[0],
                b - force[1],
                z[g, 0] - centre[0],
                z[g, 1] - centre[1],
            )
            p, q, r = spreads[g, 0], spreads[g, 1], spreads[g, 2]
            spread[0, 0] += weight * (a * a + p)
            spread[1, 0] += weight * (a * b + q)
            spread[1, 1] += weight * (b * b + r)
            scatter[0, 0] += weight * along * along
            scatter[1, 0] += weight * along * across
            scatter[1, 1] += weight * across * across
            for i in range(len(mean)):
                x[i] -= mean[i]
                own, row = weight * x[i], covariance[i]
                shared[0, i] += a * own
                shared[1, i] += b * own
                for j in range(i + 1):
                    row[j] += own * x[j]
            for i in range(rank):
                left, right, row = (
                    weight * (p * one[i] + q * two[i]),
                    weight * (q * one[i] + r * two[i]),
                    covariance[i],
                )
                shared[0, i] += left
                shared[1, i] += right
                for j in range(i + 1):
                    row[j] += left * one[j] + right * two[j]
    spread[0, 1], scatter[0, 1] = spread[1, 0], scatter[1, 0]
    for i in range(len(mean)):
        for j in range(i):
            covariance[j, i] = covariance[i, j]


@sums_entry
def among_others(contacts, parts, which, known, right, centre, roots, along, across):
    """Moments of some contacts by sums over their places and widths.

    Parameters
    ----------
    contacts : Contacts
        All that is known before the frame.
    parts : ndarray, shape (n, 2, K, p)
        Their profiles in coordinates of their own phase.
    which : ndarray of int, shape (k,)
        Those contacts.
    known, right : ndarray, shapes (k, q, q) and (k, q)
        What the others leave the frame to tell of x: -x' K x / 2 + r x.
    centre, roots : ndarray, shapes (k, 2) and (k, 2, 2)
        About where place and width are summed over, and roots of their covariance.
    along, across : ndarray, shapes (a,) and (b,)
        Where, in deviations.

    Returns
    -------
    Marginals
    """
    order, rank, count = parts.shape[2], parts.shape[3], len(along) * len(across)
    tactels, size = len(parts), known.shape[1]
    placed = contacts.place > 0
    mean, one, two = np.empty(order), np.empty(order), np.empty(order)
    shown, z, logs = np.empty((count, 2, rank)), np.empty((count, 2)), np.empty(count)
    loads, spreads = np.empty((count, 2)), np.empty((count, 3))
    out = Marginals(
        np.zeros((len(which), size)),
        np.zeros((len(which), size, size)),
        np.zeros((len(which), 2)),
        np.zeros((len(which), 2, 2)),
        np.zeros((len(which), 2, size)),
        np.zeros((len(which), 2)),
        np.zeros((len(which), 2, 2)),
    )
    for k in range(len(which)):
        j, told, pull, root = which[k], known[k], right[k], roots[k]
        last = len(contacts.mean) - tactels + j
        for g in range(count):
            u, v = along[g // len(across)], across[g % len(across)]
            z[g, 0] = centre[k, 0] + root[0, 0] * u
            z[g, 1] = centre[k, 1] + root[1, 0] * u + root[1, 1] * v
            moments_at(contacts, z[g, 0], z[g, 1], mean, one, two)
            for c in range(2):
                own = shown[g, c]
                own[:] = 0.0
                for m in range(order):
                    factor, row = mean[m], parts[j, c, m]
                    for i in range(rank):
                        own[i] += factor * row[i]
            normal, tangential = shown[g, 0], shown[g, 1]
            aa, ab, bb, a, b = contacts.precision[j, 0], 0.0, contacts.precision[j, 1], 0.0, 0.0
            for i in range(rank):
                row, left, other = told[i], 0.0, 0.0
                for m in range(rank):
                    left += row[m] * normal[m]
                    other += row[m] * tangential[m]
                aa += normal[i] * left
                ab += tangential[i] * left
                bb += tangential[i] * other
                rest = pull[i] - row[rank] * z[g, 0] if placed else pull[i]
                a += normal[i] * rest
                b += tangential[i] * rest
            found = _loads_given(contacts, (aa, ab, bb), (a, b))
            loads[g, 0], loads[g, 1] = found[0], found[1]
            spreads[g, 0], spreads[g, 1], spreads[g, 2] = found[2], found[3], found[4]
            logs[g] = found[5]
            if placed:
                logs[g] += (pull[rank] - 0.5 * told[rank, rank] * z[g, 0]) * z[g, 0]
            if contacts.width_std > 0:
                apart = z[g, 1] - contacts.mean[last]
                logs[g] -= 0.5 * contacts.known[last, last] * apart * apart
        _summed(logs, loads, spreads, shown, z, placed, out, k)
    return out
