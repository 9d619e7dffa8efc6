"""Mean and covariance of the loads of uncertain contacts, by expectation propagation.

Loads, places and widths whose influence makes the same phase are a bent valley of the posterior: a
faint contact that is wider than it seems to be may carry many times its load, and its neighbours
the less.  About the best phase of a frame the light is taken as linear in the phase,

    -2 log p(frame | contacts) = |sum_j Psi_j(z_j)' f_j - t|^2,

with the influence Psi_j of a contact at its place and of its width z_j, its loads f_j, and the
contacts' phase t in coordinates in which the noise is of unit variance.  Fields of phase, light and
camera are in the noise: their Schur complement is taken once.  Given z all else is normal, and each
contact has only two values z; but together they are too many to be summed over.

Expectation propagation (Minka, Proc. 17th Conf. Uncertainty in Artificial Intelligence, 2001, 362)
takes one contact after the other as it is, by a sum over places and widths with the loads
integrated out, and the others as normal distributions of the phase that they make.  Each has the
mean and the covariance that the contact has among the others.  The friction cone is quadratic on
each of its sides, so that its integral is Laplace's approximation on the side of the best loads.

Places are those at which the camera sees the contacts, for a camera that is shifted and contacts
that are all beside their tactels look alike.  So the shift is linear as well, and known where the
places are: integrated out, it leaves their prior with the mean m and the precision Q, and the phase
t with a small share of them.

The valley has long tails, and a covariance that fits its middle misses them.  So the density is
taken to the power of 1 / T, which a normal distribution answers with T times its covariance, and T
times less is stated.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, eigh
from scipy.special import chdtri

from fringeforce.estimation.compiling import sums, sums_entry
from fringeforce.estimation.frame_exposure import patch_moments
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.frame_model import (
    LEAST_PROFILE,
    FrameModel,
    as_seen,
    turned_moments,
)
from fringeforce.estimation.linearised_frame import (
    Linearised,
    banded,
    pulled_phase,
    shared_information,
)

Array = NDArray[np.float64]
Places = NDArray[np.int64]

TYPICAL = 0.35
"""Size of a place or half width in units of the reach at which moments count by their power."""
LIKELY = 2.0
"""Deviations of places and widths before the frame whose phases are told apart."""
UNTOLD = 0.3
"""Phase, in standard deviations of the noise, below which a likely contact's phase is left out."""
ACTIVE = 4
"""Newton steps in which the sides of the cone are found."""
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


class Contacts(NamedTuple):
    """The posterior of contacts about one phase; n tactels, K moments, r coordinates.

    Attributes
    ----------
    profiles : ndarray, shape (n, 2, K, r)
        Influence of the moments of each contact.
    target : ndarray, shape (r,)
        Phase of the contacts that the frame shows.
    mean, known : ndarray, shapes (k,) and (k, k)
        Of the places, then the widths, those of them that are uncertain, before the frame, and the
        information about them.
    follows : ndarray, shape (k, r), or (0, r)
        What the target follows of them from the mean; nothing if it has no rows.
    precision : ndarray, shape (n, 2)
        Of the loads before the frame.
    friction, stiff : float
        Largest |tangential| / normal force (negative if any), and penalty of pulling [1/N^2].
    place, width, width_std, narrow, profile : float
        As of `FrameModel`, in units of the reach; deviations are zero for what is known.
    """

    profiles: Array
    target: Array
    mean: Array
    known: Array
    follows: Array
    precision: Array
    friction: float
    stiff: float
    place: float
    width: float
    width_std: float
    narrow: float
    profile: float

    @property
    def placed(self) -> bool:
        """Whether places are uncertain."""
        return self.place > 0

    @property
    def wider(self) -> bool:
        """Whether widths are uncertain."""
        return self.width_std > 0

    def flattened(self, heat: float) -> Contacts:
        """With all that is known to the power of 1 / heat."""
        root = np.sqrt(heat)
        return self._replace(
            profiles=self.profiles / root,
            target=self.target / root,
            known=self.known / heat,
            follows=self.follows / root,
            precision=self.precision / heat,
            stiff=self.stiff / heat,
        )


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


def profile_basis(model: FrameModel) -> Array:
    """Orthogonal profiles of the size of all contacts' influence, which they hold, shape (m, r)."""
    order, nodes = model.moments.shape[2:]
    scaled = model.moments * TYPICAL ** np.arange(order)[:, None]
    _, size, rows = np.linalg.svd(scaled.reshape(-1, nodes), full_matrices=False)
    kept = size > LEAST_PROFILE * size[0]
    return np.ascontiguousarray((rows[kept] * size[kept, None]).T)


def contacts_about(
    model: FrameModel, prior: Prior, unknowns: Array, about: Linearised, basis: Array
) -> Contacts:
    """The posterior of contacts about a top.

    The frame's information about the phase is projected on the profiles, and rotated so that its
    eigenvalues are one; coordinates that loads of their prior size do not move are left out.

    Parameters
    ----------
    model, prior
        Of the frame.
    unknowns : ndarray, shape (size,)
        The top.
    about : Linearised
        The loss about it.
    basis : ndarray, shape (m, r)
        As of `profile_basis`.

    Returns
    -------
    Contacts
    """
    at, waves = model.at, np.ascontiguousarray(basis.T)
    beside, contacts = slice(at.fields, at.size), slice(at.place, at.fields)
    back = 2 * np.eye(at.size) - as_seen(model)  # from places as seen
    hessian, gradient = back.T @ about.hessian @ back, back.T @ about.gradient
    weighed = banded(about, waves)
    shared = back[:, beside].T @ shared_information(model, about, waves, weighed)
    factor = cho_factor(hessian[beside, beside], check_finite=False)
    solved = cho_solve(factor, shared, check_finite=False)
    known = waves @ weighed.T - shared.T @ solved
    pull = waves @ pulled_phase(about) - solved.T @ gradient[beside]
    values, vectors = eigh(known, check_finite=False)
    kept = values > prior.precision[0]  # of which the frame tells more than was known
    root = np.sqrt(values[kept])
    moments, _ = turned_moments(model, unknowns[at.modes : at.modes + len(model.influence)])
    z = unknowns[contacts]
    found = Contacts(
        moments @ (basis / (basis**2).sum(axis=0) @ (vectors[:, kept] * root)),
        np.zeros(len(root)),
        prior.mean[contacts],
        np.diag(prior.precision[contacts]),
        np.empty((0, len(root))),
        prior.precision[: at.loads].reshape(-1, 2).copy(),
        prior.friction,
        1 / prior.yielding**2,
        model.place / model.reach if at.width > at.place else 0.0,
        model.width / model.reach,
        model.width_std / model.reach if at.fields > at.width else 0.0,
        model.narrow / model.reach,
        model.profile,
    )
    pulled = (vectors[:, kept].T @ pull) / root
    target = unknowns[: at.loads] @ influence(found, z) - pulled
    if not len(model.moving):
        return found._replace(target=target)
    # what is linear shares with the places what both knew before the frame, and follows them
    alike = np.diag(prior.precision)[contacts] @ back[:, beside]
    follows = cho_solve(factor, alike.T, check_finite=False)
    turned = (follows.T @ shared) @ (vectors[:, kept] / root)
    known = found.known - alike @ follows - turned @ turned.T
    pull = found.known @ (z - found.mean) - follows.T @ gradient[beside] + turned @ pulled
    mean = z - np.linalg.solve(known, pull)
    target += (mean - z) @ turned
    return found._replace(target=target, mean=mean, known=known, follows=turned)


@sums
def _moments(contacts, z, w, mean, by_place, by_width):
    """Moments of a contact of a place and a width, and their derivatives by both."""
    shift, wide, slope = 0.0, contacts.width, 0.0
    if contacts.place > 0:
        shift = contacts.place * z
    if contacts.width_std > 0:
        value = wide + contacts.width_std * w
        root = np.sqrt(value * value + contacts.narrow * contacts.narrow)
        wide, slope = (value + root) / 2, 0.5 * (1 + value / root)
    patch_moments(shift, wide / 2, contacts.profile, mean, by_place, by_width)
    for k in range(len(mean)):
        by_place[k] *= contacts.place
        by_width[k] *= slope / 2 * contacts.width_std


@sums_entry
def moments_of(contacts, z):
    """Moments of contacts.

    Parameters
    ----------
    contacts : Contacts
        All that is known of them.
    z : ndarray, shape (k, 2)
        Place and width of each, in standard deviations.

    Returns
    -------
    ndarray, shape (3, k, K)
        The moments, and their derivatives by place and by width.
    """
    found = np.empty((3, len(z), contacts.profiles.shape[2]))
    for j in range(len(z)):
        _moments(contacts, z[j, 0], z[j, 1], found[0, j], found[1, j], found[2, j])
    return found


def places_and_widths(contacts: Contacts, z: Array) -> Array:
    """Values of all contacts in two columns, those of what is known being zero, shape (n, 2)."""
    found, count = np.zeros((len(contacts.profiles), 2)), len(contacts.profiles)
    if contacts.placed:
        found[:, 0] = z[:count]
    if contacts.wider:
        found[:, 1] = z[-count:]
    return found


def influence(contacts: Contacts, z: Array) -> Array:
    """Influence of all contacts at places and widths, shape (2n, r)."""
    moments = moments_of(contacts, places_and_widths(contacts, z))[0]
    return np.einsum("nk,nckr->ncr", moments, contacts.profiles).reshape(-1, len(contacts.target))


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
            if weight < ROUNDING:
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
            _moments(contacts, z[g, 0], z[g, 1], mean, one, two)
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
        seen = np.einsum("nrp,npq,nsq->rs", self.waves, self.covariance, self.waves, optimize=True)
        left = self.target - np.einsum("nrp,np->r", self.waves, self.mean)
        return cho_factor(seen + np.eye(len(seen)), check_finite=False), left

    def others(self, which: Places) -> tuple[Array, Array]:
        """What the other contacts leave the frame to tell of some: `known` and `right`."""
        factor, left = self.factor()
        waves, own = self.waves[which], self.covariance[which]
        count, rows, size = waves.shape
        flat = np.moveaxis(waves, 1, 0).reshape(rows, -1)
        solved = cho_solve(factor, flat, check_finite=False).reshape(rows, count, size)
        solved = np.moveaxis(solved, 1, 0)
        told = np.swapaxes(waves, 1, 2) @ solved
        without = np.linalg.inv(np.eye(size) - told @ own)
        right = np.einsum("nrp,r->np", solved, left)
        right += np.einsum("npq,nq->np", told, self.mean[which])
        known = without @ told
        known = np.ascontiguousarray(known + np.swapaxes(known, 1, 2)) / 2
        return known, np.einsum("npq,nq->np", without, right)

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
        pull = np.einsum("npq,nq->np", known, met.mean) - right
        self.covariance[which] = own
        self.mean[which] = met.mean + np.einsum("npq,nq->np", own, pull)

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
    each = np.arange(count)
    own = [each] * contacts.placed + [each + len(z) - count] * contacts.wider
    scatter, columns = np.zeros((count, 2, 2)), [0] * contacts.placed + [1] * contacts.wider
    for a, one in zip(columns, own, strict=True):
        for b, other in zip(columns, own, strict=True):
            scatter[:, a, b] = heat * covariance[one, other]
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
