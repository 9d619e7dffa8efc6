"""Mean and covariance of the loads of uncertain contacts, by expectation propagation.

Loads, places and widths whose influence makes the same phase are a bent valley of the posterior: a
faint contact that is wider than it seems to be may carry many times its load, and its neighbours
the less.  Given places and widths all else is normal, and each contact has only these two; but
together they are too many to be summed over.

Expectation propagation (Minka, Proc. 17th Conf. Uncertainty in Artificial Intelligence, 2001, 362)
takes one contact after the other as it is, by a sum over places and widths with the loads
integrated out, and the others as normal distributions of the phase that they make.  Each has the
mean and the covariance that the contact has among the others.

The valley has long tails, and a covariance that fits its middle misses them.  So the density is
taken to the power of 1 / T, which a normal distribution answers with T times its covariance, and T
times less is stated.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.special import chdtri

from fringeforce.estimation.contact_marginals import Marginals, among_others
from fringeforce.estimation.uncertain_contacts import Contacts, moments_of, places_and_widths

Array = NDArray[np.float64]
Places = NDArray[np.int64]

LIKELY = 2.0
"""Deviations of places and widths before the frame whose phases are told apart."""
UNTOLD = 0.3
"""Phase, in standard deviations of the noise, below which a likely contact's phase is left out."""
RARE = 1e-4
"""Chance to which the covariance is to hold: the density is as flat as what is that rare is far."""
POINTS, REACH = 13, 4.5
"""Places, and widths, over which a contact is summed, and how many deviations they reach."""
SWEEPS, CALMED = 8, 3
"""Sweeps over the contacts, and those after which each takes half a step: the last changes of some
would alternate."""
SETTLED = 0.05
"""Change of all loads, in standard deviations, after which there are no more sweeps: a thousandth
of the variance."""
FLAT = 1e-5
"""Share of a variance that a contact tells at least: what tells nothing has no covariance."""
VAGUE = 10.0
"""Variance of places in the first normal distributions: the others tell where they are."""
ROUNDING = 1e-10
"""Share of the variances that is added to them, and below which there is none."""


class _Sites:
    """Normal distributions that stand for the contacts.

    The frame sees the sum of what `waves`, shape (n, R, q), make of each contact's x, with noise of
    unit variance: its phase, and, where places are uncertain, what is known before of these.
    """

    def __init__(self, contacts: Contacts, z: Array, loads: Array) -> None:
        self.contacts, self.target = contacts, contacts.target
        tactels, rank = len(contacts.profiles), len(contacts.target)
        basis, self.parts = _own_coordinates(contacts)
        size = basis.shape[2] + contacts.placed
        self.waves = np.zeros((tactels, rank + tactels * contacts.placed, size))
        self.waves[:, :rank, : basis.shape[2]] = basis
        if contacts.placed:
            mean, known = contacts.mean[:tactels], contacts.known[:tactels, :tactels]
            root = np.linalg.cholesky(known)
            self.waves[:, rank:, -1] = root
            if len(contacts.follows):
                self.waves[:, :rank, -1] = -contacts.follows[:tactels]
                self.target = self.target - mean @ contacts.follows[:tactels]
            self.target = np.concatenate([self.target, mean @ root])
        self.seen = np.ascontiguousarray(
            np.swapaxes(self.waves, 1, 2).reshape(-1, len(self.target))
        )
        self.mean, self.covariance = self._about(z, loads.reshape(-1, 2))

    def _about(self, z: Array, loads: Array) -> tuple[Array, Array]:
        """Means and covariances of x if it is linear in loads, places and widths about the top."""
        contacts, tactels = self.contacts, len(loads)
        values, phase = places_and_widths(contacts, z), self.parts.shape[3]
        mean, by_place, by_width = np.einsum(
            "snk,nckp->sncp", moments_of(contacts, values), self.parts
        )
        found, size = np.zeros((tactels, self.waves.shape[2])), self.waves.shape[2]
        spread = np.zeros((tactels, size, size))
        spread[:, :phase, :phase] = np.einsum("ncp,nc,ncq->npq", mean, 1 / contacts.precision, mean)
        if contacts.wider:
            change = np.einsum("ncp,nc->np", by_width, loads)
            spread[:, :phase, :phase] += (
                change[:, :, None]
                * change[:, None]
                / np.diag(contacts.known)[-tactels:, None, None]
            )
            found[:, :phase] += change * (contacts.mean[-tactels:] - values[:, 1])[:, None]
        if contacts.placed:
            change = np.ones((tactels, size))
            change[:, :phase] = np.einsum("ncp,nc->np", by_place, loads)
            spread += VAGUE * change[:, :, None] * change[:, None]
            found[:, -1] += values[:, 0]
        return found, spread

    def factor(self) -> tuple[tuple[Array, bool], Array]:
        """Factor of the covariance of what the frame sees, and what the means leave of that."""
        left = self.target - self.mean.ravel() @ self.seen
        own = self.covariance @ np.swapaxes(self.waves, 1, 2)
        known = self.seen.T @ own.reshape(self.seen.shape)
        known.flat[:: len(known) + 1] += 1
        return cho_factor(known, check_finite=False), left

    def others(self, which: Places) -> tuple[Array, Array]:
        """What the other contacts leave the frame to tell of some: `known` and `right`."""
        factor, left = self.factor()
        waves, own = self.waves[which], self.covariance[which]
        count, rows, size = waves.shape
        flat = np.swapaxes(waves, 1, 2).reshape(-1, rows)
        solved = cho_solve(factor, flat.T, check_finite=False).T
        told = solved.reshape(count, size, rows) @ waves
        without = np.linalg.inv(np.eye(size) - told @ own)
        right = (solved @ left).reshape(count, size) + _products(told, self.mean[which])
        known = without @ told
        known = np.ascontiguousarray(known + np.swapaxes(known, 1, 2)) / 2
        return known, _products(without, right)

    def renew(self, which: Places, met: Marginals, known: Array, right: Array) -> None:
        """Let some contacts have the moments that they have among the others.

        A direction of x of which a contact tells nothing, or less than that, gets `FLAT`.
        """
        size = met.covariance.shape[1]
        total = np.trace(met.covariance, axis1=1, axis2=2)[:, None, None]
        root = np.linalg.cholesky(met.covariance + ROUNDING * total * np.eye(size))
        share, turned = np.linalg.eigh(np.swapaxes(root, 1, 2) @ known @ root)
        turned, alone = root @ turned, 1 - np.minimum(share, 1 - FLAT)
        own = (turned / alone[:, None]) @ np.swapaxes(turned, 1, 2)
        pull = _products(known, met.mean) - right
        self.covariance[which] = own
        self.mean[which] = met.mean + _products(own, pull)

    def loads(self, met: Marginals) -> tuple[Array, Array]:
        """Mean and covariance of all loads, which follow x as far as it tells them."""
        count = 2 * len(met.loads)
        size, turned = np.linalg.eigh(met.covariance)
        size[size < ROUNDING * size[:, -1:]] = np.inf
        follows = met.shared @ (turned / size[:, None]) @ np.swapaxes(turned, 1, 2)
        factor, left = self.factor()
        own = follows @ self.covariance
        rows = np.einsum("nfp,nrp->nfr", own, self.waves).reshape(count, -1)
        mean = met.loads + np.einsum("nfp,np->nf", follows, self.mean - met.mean)
        blocks = met.spread + own @ np.swapaxes(follows, 1, 2)
        blocks -= follows @ np.swapaxes(met.shared, 1, 2)
        covariance = -rows @ cho_solve(factor, rows.T, check_finite=False)
        both = covariance.reshape(len(blocks), 2, len(blocks), 2)
        each = np.arange(len(blocks))
        both[each, :, each] += blocks
        return mean.ravel() + rows @ cho_solve(factor, left, check_finite=False), covariance


def _products(matrices: Array, lines: Array) -> Array:
    """Products of matrices (k, p, q) and a line for each, shape (k, q)."""
    return (matrices @ lines[:, :, None])[:, :, 0]


def _own_coordinates(contacts: Contacts) -> tuple[Array, Array]:
    """Orthogonal phases of likely contacts, shape (n, r, p), and the profiles in them (n, 2, K, p).

    As many for each contact as one of them needs.
    """
    steps = np.linspace(-1.5 * LIKELY, 1.5 * LIKELY, 9)
    z = np.stack(np.meshgrid(steps * contacts.placed, steps * contacts.wider), -1).reshape(-1, 2)
    weights = np.exp(-np.square(z).sum(axis=1) / (4 * LIKELY**2))
    rows = moments_of(contacts, z)[0] * (weights / np.linalg.norm(weights))[:, None]
    rows = np.linalg.qr(rows, mode="r")
    rows = np.einsum("sk,nckr,nc->ncsr", rows, contacts.profiles, contacts.precision**-0.5)
    rows = rows.reshape(len(rows), -1, rows.shape[3])
    size, turned = np.linalg.eigh(rows @ np.swapaxes(rows, 1, 2))
    count = max(int((size > UNTOLD**2).sum(axis=1).max()), 2)
    size, turned = np.maximum(size[:, -count:], ROUNDING), turned[:, :, -count:]
    basis = np.swapaxes(rows, 1, 2) @ (turned / np.sqrt(size)[:, None])
    parts = contacts.profiles @ basis[:, None]
    return basis, np.ascontiguousarray(parts)


def propagated_loads(
    contacts: Contacts, z: Array, covariance: Array, loads: Array, heat: float | None = None
) -> tuple[Array, Array]:
    """Mean and covariance of the loads with places and widths integrated out.

    Parameters
    ----------
    contacts : Contacts
        As of `contacts_about`.
    z : ndarray, shape (k,)
        Places and widths of the top.
    covariance : ndarray, shape (k, k)
        Of these by Laplace's approximation.
    loads : ndarray, shape (2n,)
        Of the top [N].
    heat : float, optional
        T of the power 1 / T to which the density is taken; if not given, the square of the distance
        that is as rare as `RARE`, over its mean.

    Returns
    -------
    mean : ndarray, shape (2n,)
        Of the loads [N].
    covariance : ndarray, shape (2n, 2n)
        Of them [N^2].

    Raises
    ------
    numpy.linalg.LinAlgError
        If a covariance is none, or denies the likeliest loads: the sweeps ran astray.
    """
    count, size = len(contacts.profiles), len(loads)
    heat = heat or float(chdtri(size, RARE)) / size
    sites = _Sites(contacts.flattened(heat), z, loads)
    scatter, held = np.zeros((count, 2, 2)), contacts.held
    each = covariance.reshape(len(held), count, len(held), count)
    scatter[np.ix_(range(count), held, held)] = heat * np.einsum("ajbj->jab", each)
    steps, known = np.linspace(-REACH, REACH, POINTS), np.zeros(1)
    along, across = steps if contacts.placed else known, steps if contacts.wider else known
    centre, met = places_and_widths(contacts, z), None
    for sweep in range(SWEEPS):
        before, met = met, _swept(sites, met, centre, scatter, along, across, sweep >= CALMED)
        centre, scatter = met.centre, met.scatter
        if before is not None:
            change = np.square(met.loads - before.loads) / np.diagonal(met.spread, 0, 1, 2)
            if change.max() < SETTLED**2:
                break
    assert met is not None
    mean, covariance = sites.loads(met)
    np.linalg.cholesky(covariance)
    covariance /= heat
    off = mean - loads
    if not off @ np.linalg.solve(covariance, off) < chdtri(size, RARE):
        raise np.linalg.LinAlgError("The likeliest loads are unlikely.")
    return mean, covariance


def _swept(
    sites: _Sites,
    before: Marginals | None,
    centre: Array,
    scatter: Array,
    along: Array,
    across: Array,
    calmed: bool,
) -> Marginals:
    """One sweep: every other contact at once, then those between them."""
    contacts, count = sites.contacts, len(centre)
    both = list[Marginals]()
    for first in range(min(2, count)):
        which = np.arange(first, count, 2)
        known, right = sites.others(which)
        roots = np.linalg.cholesky(scatter[which] + ROUNDING * np.eye(2))
        found = among_others(
            contacts, sites.parts, which, known, right, centre[which], roots, along, across
        )
        if calmed and before is not None:
            found = Marginals(*((a + b[which]) / 2 for a, b in zip(found, before, strict=True)))
        sites.renew(which, found, known, right)
        both.append(found)
    merged = Marginals(*(np.empty((count, *one.shape[1:])) for one in both[0]))
    for first, found in enumerate(both):
        for whole, own in zip(merged, found, strict=True):
            whole[first::2] = own
    return merged
