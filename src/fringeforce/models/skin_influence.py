"""What contacts anywhere do to the phase, in compiled loops.

The influence of line loads is a spline over their place, so that tractions on a contact's half
width are sums over the few knots beneath it.
"""

from __future__ import annotations

import numpy as np

from fringeforce.estimation.compiling import sums, sums_entry
from fringeforce.models.splines import DEGREE

PRESSURE, SHEAR = (2, 3, 4), (1, 2, 3, 4)
"""Degrees of the shapes that are uncertain."""
PLACE, WIDTH, FIRST_SHAPE = 0, 1, 2
"""Where place, half width and shapes begin among the unknowns of a contact beside its forces."""
SECOND = FIRST_SHAPE + PRESSURE.index(2)
"""Where the coefficient of degree 2 of the pressure is among them, which changes its spread."""
GEOMETRY = FIRST_SHAPE + len(PRESSURE) + len(SHEAR)
"""Unknowns of a contact beside its forces: place, half width, shapes."""


@sums
def _fill_basis(knots, span, x, values, slopes):
    """B-splines of `DEGREE` that are not zero between a knot and the next, and their derivatives.

    Cox and de Boor's recursion (de Boor, A Practical Guide to Splines, 1978, chapter X).
    """
    values[0] = 1.0
    for degree in range(1, DEGREE + 1):
        carried = 0.0
        for i in range(degree):
            first, last = knots[span + 1 + i - degree], knots[span + 1 + i]
            part = values[i] / (last - first)
            if degree == DEGREE:
                slopes[i] = (0.0 if i == 0 else slopes[i]) - DEGREE * part
                slopes[i + 1] = DEGREE * part
            values[i] = carried + (last - x) * part
            carried = (x - first) * part
        values[degree] = carried


@sums
def _fill_shares(knots, t, weights, geometry, shares):
    """Fill in what a contact is of splines over its place, and return the first and last knot.

    Parameters
    ----------
    knots, t, weights : ndarray
        As of `fill_contacts`.
    geometry : ndarray, shape (GEOMETRY,)
        Of the contact.
    shares : ndarray, shape (2, 1 + GEOMETRY, n)
        Of unit forces, and the change with the geometry.
    """
    values, slopes = np.empty(DEGREE + 1), np.empty(DEGREE + 1)
    normal, count = len(PRESSURE), shares.shape[2]
    place, half = geometry[PLACE], geometry[WIDTH]
    shares[:] = 0.0
    low, high = count, 0
    for q in range(len(t)):
        x, span = place + half * t[q], DEGREE
        while span + 1 < count and x >= knots[span + 1]:
            span += 1
        _fill_basis(knots, span, x, values, slopes)
        low, high = min(low, span - DEGREE), max(high, span + 1)
        for c in range(2):
            begin, end = (0, normal) if c == 0 else (normal, GEOMETRY - FIRST_SHAPE)
            profile = weights[q, 0]
            for s in range(begin, end):
                profile += geometry[FIRST_SHAPE + s] * weights[q, 1 + s]
            for i in range(DEGREE + 1):
                at = span - DEGREE + i
                shares[c, 0, at] += profile * values[i]
                shares[c, 1 + PLACE, at] += profile * slopes[i]
                shares[c, 1 + WIDTH, at] += profile * t[q] * slopes[i]
                for s in range(begin, end):
                    shares[c, 1 + FIRST_SHAPE + s, at] += weights[q, 1 + s] * values[i]
    return low, high


@sums_entry
def fill_shares(knots, t, weights, geometry, shares, ends):
    """Fill in what contacts are of splines over their place.

    Parameters
    ----------
    knots, t, weights, geometry : ndarray
        As of `fill_contacts`.
    shares : ndarray, shape (k, 2, 1 + GEOMETRY, n)
        Of unit forces, and the change with the geometry.
    ends : ndarray of int, shape (k, 2)
        First coefficient that counts, and the one after the last.
    """
    for k in range(len(geometry)):
        ends[k, 0], ends[k, 1] = _fill_shares(knots, t, weights, geometry[k], shares[k])


@sums_entry
def fill_contacts(knots, lines, t, weights, forces, geometry, moments, fields):
    """Fill in what contacts do to the phase at the nodes.

    Parameters
    ----------
    knots, lines : ndarray, shapes (n + DEGREE + 1,) and (n, 2, m)
        Of the spline of the influence of line loads over their place [m], [rad/N].
    t, weights : ndarray, shapes (Q,) and (Q, 1 + shapes)
        Places within half widths, and weights of the shapes there.
    forces, geometry : ndarray, shapes (k, 2) and (k, GEOMETRY)
        Of the contacts.
    moments, fields : ndarray, shapes (k, 2, 1, m) and (k, GEOMETRY, m)
        Phase under unit forces, and its change with the geometry under these.
    """
    normal, shares = len(PRESSURE), np.empty((2, 1 + GEOMETRY, len(lines)))
    moments[:], fields[:] = 0.0, 0.0
    for k in range(len(forces)):
        low, high = _fill_shares(knots, t, weights, geometry[k], shares)
        for c in range(2):
            begin, end = (0, normal) if c == 0 else (normal, GEOMETRY - FIRST_SHAPE)
            for at in range(low, high):
                line, own = lines[at, c], moments[k, c, 0]
                share = shares[c, 0, at]
                for i in range(len(line)):
                    own[i] += share * line[i]
                for g in range(GEOMETRY):
                    if g >= FIRST_SHAPE and not begin <= g - FIRST_SHAPE < end:
                        continue
                    share, own = forces[k, c] * shares[c, 1 + g, at], fields[k, g]
                    for i in range(len(line)):
                        own[i] += share * line[i]
