"""Mean and covariance of the loads of uncertain contacts, from samples about one phase.

Loads, places and widths whose influence makes the same phase are a bent valley of the posterior: a
faint contact that is wider than it seems to be may carry many times its load, and its neighbours
the less.  Given places and widths z, everything else is linear in the phase, and the frame is taken
as linear in the phase about the best one, so that all but z is integrated out in closed form:

    -2 log p(z | frame) = |Psi(z)' f - t|^2 + f' P f + cone(f) + log det H(z) + (z - m)' Q (z - m),

with the loads f(z) at which the first three terms are smallest, H half their second derivative
there, the influence Psi(z) and the contacts' phase t in coordinates in which the noise is of unit
variance, and the prior precision P.  The cone is quadratic on each of its sides, so that its
integral is Laplace's approximation on the side of f(z).  Fields of phase, light and camera are in
the noise: their Schur complement is taken once.

Places are those at which the camera sees the contacts, for a camera that is shifted and contacts
that are all beside their tactels look alike.  So the shift is linear as well, and known where the
places are: integrated out, it leaves their prior with the mean m and the precision Q, and the phase
t with a small share of them.

Hamiltonian Monte Carlo walks along z (Neal, Handbook of Markov Chain Monte Carlo, 2011, chapter 5),
from draws of Laplace's approximation. The valley has long tails, and a covariance that fits its
middle misses them: the walk samples the density to the power of 1 / T, which a normal
distribution answers with T times its covariance, and T times less is stated. Mean and covariance
of the loads are those of their conditional distributions together (Rao-Blackwell; Gelfand and
Smith, J. Am. Stat. Assoc. 85, 398, 1990), and the covariance of few samples is shrunk (Ledoit and
Wolf, J. Multivar. Anal. 88, 365, 2004) towards Laplace's approximation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, eigh
from scipy.special import chdtri

from fringeforce.estimation.compiling import copied, sums, sums_entry
from fringeforce.estimation.frame_exposure import dot, patch_moments
from fringeforce.estimation.frame_information import fill_combinations, fill_dots, fill_products
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.frame_model import (
    LEAST_PROFILE,
    FrameModel,
    as_seen,
    turned_moments,
)
from fringeforce.estimation.hypotheses import NEGLIGIBLE_LOSS
from fringeforce.estimation.linearised_frame import Linearised, banded, pulled_phase

Array = NDArray[np.float64]

TYPICAL = 0.35
"""Size of a place or half width in units of the reach at which moments count by their power."""
NEGLIGIBLE_MOMENT = 0.003
"""Phase, in standard deviations of the noise, below which a moment does not count."""
ACTIVE = 4
"""Newton steps in which the contacts that pull are found."""
DRAWS = 48
"""Draws from Laplace's approximation that tell how good it is."""
CHAINS, WARM, TRAJECTORIES = 4, 4, 28
"""Walks, the trajectories of each that only find the step, and those that count."""
LENGTH = 1.2
"""Mean length of a trajectory, in standard deviations."""
DEPENDENT = 4.0
"""Neighbouring samples that tell as much of a mean as one that is independent of others."""
TAILED = 2.0
"""The same of a covariance over that: the variance of squares is (k - 1) over that of the square of
a variance, and loads have a kurtosis k of some 5 in their skew directions, normal ones 3."""
RARE = 1e-4
"""Chance to which the covariance is to hold: walks are as hot as what is that rare is farther."""
SEED = 20140115
"""Seed of the random numbers, which are the same for every frame: readings can be repeated."""
WALK_STEP, RELUCTANCE = 0.3, 0.2
"""First step of the walk, in standard deviations, and how little surplus acceptance changes it: the
step suits most walks, and few trajectories tell no better one."""
WANTED = 0.75
"""Share of trajectories that are to be accepted (Betancourt et al., arXiv:1411.6669)."""
TRAJECTORY_STEPS = 20
"""Most steps of a trajectory."""


class Contacts(NamedTuple):
    """The posterior of places and widths about one phase; n tactels, K moments, r coordinates.

    Attributes
    ----------
    profiles : ndarray, shape (n, 2, K, r)
        Influence of the moments of each contact.
    largest : ndarray, shape (n, 2, K)
        Sizes of these under a load of its standard deviation before the frame.
    target : ndarray, shape (r,)
        Phase of the contacts that the frame shows.
    mean, known : ndarray, shapes (k,) and (k, k)
        Of the places and widths before the frame, and the information about them.
    follows : ndarray, shape (k, r), or (0, r)
        What the target follows of them from the mean; nothing if it has no rows.
    precision : ndarray, shape (2n,)
        Of the loads before the frame.
    friction, stiff : float
        Largest |tangential| / normal force (negative if any), and penalty of pulling [1/N^2].
    place, width, width_std, narrow, profile : float
        As of `FrameModel`, in units of the reach; deviations are zero for what is known.
    """

    profiles: Array
    largest: Array
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


def profile_basis(model: FrameModel) -> Array:
    """Orthogonal profiles of the size of all contacts' influence, which they hold, shape (m, r)."""
    order, nodes = model.moments.shape[2:]
    scaled = model.moments * TYPICAL ** np.arange(order)[:, None]
    _, size, rows = np.linalg.svd(scaled.reshape(-1, nodes), full_matrices=False)
    kept = size > LEAST_PROFILE * size[0]
    return np.ascontiguousarray((rows[kept] * size[kept, None]).T)


def contacts_about(
    model: FrameModel, prior: Prior, unknowns: Array, about: Linearised, cross: Array, basis: Array
) -> Contacts:
    """The posterior of places and widths about a top.

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
    cross : ndarray, shape (size, m)
        Information that unknowns share with the phase at each node.
    basis : ndarray, shape (m, r)
        As of `profile_basis`.

    Returns
    -------
    Contacts
    """
    at = model.at
    beside, contacts = slice(at.fields, at.size), slice(at.place, at.fields)
    back = 2 * np.eye(at.size) - as_seen(model)  # from places as seen
    hessian, gradient = back.T @ about.hessian @ back, back.T @ about.gradient
    shared = back[:, beside].T @ cross @ basis
    factor = cho_factor(hessian[beside, beside], check_finite=False)
    solved = cho_solve(factor, shared, check_finite=False)
    known = basis.T @ banded(about, basis.T).T - shared.T @ solved
    pull = basis.T @ pulled_phase(about) - solved.T @ gradient[beside]
    values, vectors = eigh(known, check_finite=False)
    kept = values > prior.precision[0]  # of which the frame tells more than was known
    root = np.sqrt(values[kept])
    moments, _ = turned_moments(model, unknowns[at.modes : at.modes + len(model.influence)])
    z = unknowns[contacts]
    profiles = moments @ (basis / (basis**2).sum(axis=0) @ (vectors[:, kept] * root))
    found = Contacts(
        np.ascontiguousarray(profiles),
        np.linalg.norm(profiles, axis=3) / np.sqrt(prior.precision[0]),
        np.zeros(len(root)),
        prior.mean[contacts],
        np.diag(prior.precision[contacts]),
        np.empty((0, len(root))),
        prior.precision[: at.loads].copy(),
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
def _influence(contacts, z, moments, used, out):
    """Influence of all contacts, moments with their derivatives by place and width.

    `used` is how many moments of each component count.
    """
    tactels = len(contacts.profiles)
    order = contacts.profiles.shape[2]
    placed, wider = contacts.place > 0, contacts.width_std > 0
    for j in range(tactels):
        shift, wide, slope = 0.0, contacts.width, 0.0
        if placed:
            shift = contacts.place * z[j]
        if wider:
            value = wide + contacts.width_std * z[len(z) - tactels + j]
            root = np.sqrt(value * value + contacts.narrow * contacts.narrow)
            wide, slope = (value + root) / 2, 0.5 * (1 + value / root)
        half = wide / 2
        patch_moments(shift, half, contacts.profile, moments[0, j], moments[1, j], moments[2, j])
        used[j] = 1
        for k in range(order):
            moments[1, j, k] *= contacts.place
            moments[2, j, k] *= slope / 2 * contacts.width_std
            most = max(abs(moments[0, j, k]), abs(moments[1, j, k]), abs(moments[2, j, k]))
            for c in range(2):
                if most * contacts.largest[j, c, k] > NEGLIGIBLE_MOMENT:
                    used[j, c] = k + 1
        for c in range(2):
            count = used[j, c]
            fill_combinations(
                moments[:1, j, :count], contacts.profiles[j, c], out[2 * j + c : 2 * j + c + 1]
            )


@sums_entry
def influence(contacts, z):
    """Influence of all contacts at places and widths, shape (2n, r)."""
    tactels, _, order, rank = contacts.profiles.shape
    out, used = np.empty((2 * tactels, rank)), np.empty((tactels, 2), np.int64)
    _influence(contacts, z, np.empty((3, tactels, order)), used, out)
    return out


@sums
def _cone(contacts, loads, sides):
    """Penalty of the cone, and the sides of it that loads miss, into `sides`."""
    penalty = 0.0
    for j in range(len(loads) // 2):
        a, b = loads[2 * j], loads[2 * j + 1]
        for c in range(2):
            miss = contacts.friction * a + (2 * c - 1) * b
            if contacts.friction < 0:
                miss = a if c == 0 else 0.0
            sides[2 * j + c] = 1.0 if miss < 0 else 0.0
            penalty += contacts.stiff * min(miss, 0.0) ** 2
    return penalty


@sums
def _stiffen(contacts, sides, hessian):
    """Add what the cone adds on some of its sides to half the second derivative."""
    for j in range(len(sides) // 2):
        a, b = 2 * j, 2 * j + 1
        for c in range(2):
            stiff, slope = contacts.stiff * sides[2 * j + c], contacts.friction
            if slope < 0:
                hessian[a, a] += stiff
                continue
            hessian[a, a] += stiff * slope * slope
            hessian[b, b] += stiff
            hessian[b, a] += stiff * (2 * c - 1) * slope


@sums
def _factorise(hessian, lower):
    size = len(hessian)
    for i in range(size):
        for j in range(i + 1):
            total = hessian[i, j]
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            if i == j:
                lower[i, i] = np.sqrt(max(total, 1e-300))
            else:
                lower[i, j] = total / lower[j, j]


@sums
def _substitute(lower, right, out):
    size = len(right)
    for i in range(size):
        total = right[i]
        for k in range(i):
            total -= lower[i, k] * out[k]
        out[i] = total / lower[i, i]
    for i in range(size - 1, -1, -1):
        out[i] /= lower[i, i]
        for k in range(i):
            out[k] -= lower[i, k] * out[i]


@sums
def _inverse(lower, out):
    """Inverse of the matrix whose factor is given, by sums of rows."""
    size = len(lower)
    root = np.zeros((size, size))
    out[:] = 0.0
    for i in range(size):
        own = root[i]
        for k in range(i):
            factor, other = lower[i, k], root[k]
            for j in range(k + 1):
                own[j] -= factor * other[j]
        own[i] = 1.0
        for j in range(i + 1):
            own[j] /= lower[i, i]
        for k in range(i + 1):
            factor, row = own[k], out[k]
            for j in range(k + 1):
                row[j] += factor * own[j]
    for i in range(size):
        for j in range(i):
            out[j, i] = out[i, j]


@sums
def _density(contacts, z, sides, loads, inverse, gradient):
    """Negative logarithm of the density of places and widths, its gradient, and the loads given.

    `sides` of the cone are those to begin with, and those found.
    """
    tactels, _, order, rank = contacts.profiles.shape
    size = 2 * tactels
    moments, shown = np.empty((3, tactels, order)), np.empty((size, rank))
    used = np.empty((tactels, 2), np.int64)
    _influence(contacts, z, moments, used, shown)
    bare, hessian, lower = np.empty((size, size)), np.empty((size, size)), np.empty((size, size))
    right, target = np.empty(size), contacts.target.copy()
    off, own = z - contacts.mean, np.empty(len(z))
    for x in range(len(contacts.follows)):
        for i in range(rank):
            target[i] += off[x] * contacts.follows[x, i]
    # loops rather than BLAS, whose sums depend on where arrays lie: readings can be repeated
    fill_products(shown, shown, size, bare)
    for x in range(size):
        bare[x, x] += contacts.precision[x]
        right[x] = dot(shown[x], target)
    # the cone is quadratic on each of its sides: Newton's steps end when the sides stay the same
    before, penalty = np.empty(size), 0.0
    for _ in range(ACTIVE):
        copied(sides, before)
        for x in range(size):
            copied(bare[x], hessian[x])
        _stiffen(contacts, sides, hessian)
        _factorise(hessian, lower)
        _substitute(lower, right, loads)
        penalty = _cone(contacts, loads, sides)
        same = True
        for x in range(size):
            same = same and sides[x] == before[x]
        if same:
            break
    _inverse(lower, inverse)
    value = penalty
    for x in range(size):
        value += contacts.precision[x] * loads[x] ** 2 + 2 * np.log(lower[x, x])
    for x in range(len(z)):
        own[x] = dot(contacts.known[x], off)
        value += off[x] * own[x]
        gradient[x] = own[x]
    placed, wider = contacts.place > 0, contacts.width_std > 0
    left, pull, along = -target, np.empty(rank), np.empty(order)
    for x in range(size):
        for i in range(rank):
            left[i] += loads[x] * shown[x, i]
    value += dot(left, left)
    for x in range(len(contacts.follows)):
        gradient[x] -= dot(contacts.follows[x], left)
    for x in range(size):
        j, c = x // 2, x % 2
        for i in range(rank):
            pull[i] = loads[x] * left[i]
        for y in range(0, size - 1, 2):
            a, b = inverse[x, y], inverse[x, y + 1]
            one, two = shown[y], shown[y + 1]
            for i in range(rank):
                pull[i] += a * one[i] + b * two[i]
        fill_dots(contacts.profiles[j, c], pull, used[j, c], along)
        for k in range(1, used[j, c]):
            if placed:
                gradient[j] += along[k] * moments[1, j, k]
            if wider:
                gradient[len(z) - tactels + j] += along[k] * moments[2, j, k]
    return 0.5 * value


@sums_entry
def density(contacts, z):
    """Negative logarithm of the density of places and widths, its gradient, and loads given.

    Parameters
    ----------
    contacts : Contacts
        As of `contacts_about`.
    z : ndarray, shape (k,)
        Places of the contacts, then their widths, those of them that are uncertain.

    Returns
    -------
    value : float
        Less a constant.
    gradient : ndarray, shape (k,)
        Of that.
    loads : ndarray, shape (2n,)
        Likeliest ones [N].
    covariance : ndarray, shape (2n, 2n)
        Of the loads [N^2].
    """
    size = 2 * len(contacts.profiles)
    loads, inverse, gradient = np.empty(size), np.empty((size, size)), np.empty(len(z))
    value = _density(contacts, z, np.zeros(size), loads, inverse, gradient)
    return value, gradient, loads, inverse


@sums_entry
def walk(contacts, start, scale, normals, uniforms, warm, length, heat):
    """Hamiltonian Monte Carlo along places and widths.

    The step is found in the first trajectories by dual averaging (Hoffman and Gelman, J. Mach.
    Learn. Res. 15, 1593, 2014, section 3.2).  It varies, and one in ten is short, so that a walk
    leaves a sharp bend.

    Parameters
    ----------
    contacts : Contacts
        What is walked through.
    start : ndarray, shape (k,)
        Places and widths.
    scale : ndarray, shape (k, k)
        A lower triangular root of their covariance, about.
    normals, uniforms : ndarray, shapes (w + S, k) and (w + S, 3)
        Random numbers.
    warm : int
        How many of the first trajectories, w, find the step and are dropped.
    length : float
        Of a trajectory, in standard deviations.
    heat : float
        The density is sampled to the power of one over that.

    Returns
    -------
    contacts : ndarray, shape (S, k)
        Places and widths.
    loads : ndarray, shape (S, 2n)
        Mean of the loads given these [N].
    covariance : ndarray, shape (2n, 2n)
        Mean of the covariances of the loads given these [N^2].
    energy : ndarray, shape (S,)
        Negative logarithm of the density, less a constant.
    """
    reach = np.sqrt(heat)  # by which a hot walk goes farther, and is turned back less
    size, count, most = len(start), len(normals), 2 * len(contacts.profiles)
    loads, inverse = np.empty(most), np.empty((most, most))
    own, within = np.empty(most), np.empty((most, most))
    here, trial, gradient, slope = start.copy(), start.copy(), np.empty(size), np.empty(size)
    sides = np.zeros(most)
    energy = _density(contacts, here, sides, own, within, gradient)
    kept, given = np.empty((count - warm, size)), np.empty((count - warm, most))
    energies, covariance = np.empty(count - warm), np.zeros((most, most))
    averaged, surplus = np.log(WALK_STEP), 0.0
    log_step, momentum = np.log(WALK_STEP), np.empty(size)
    for t in range(count):
        step = np.exp(log_step) if t < warm else np.exp(averaged)
        step *= 0.2 if uniforms[t, 2] < 0.1 else 0.6 + 0.6 * uniforms[t, 2]
        steps = int(min(max(np.ceil(length * (0.5 + uniforms[t, 1]) / step), 1), TRAJECTORY_STEPS))
        copied(normals[t], momentum)
        before = energy / heat + 0.5 * (momentum * momentum).sum()
        copied(here, trial)
        copied(gradient, slope)
        reached = energy
        for _ in range(steps):
            for x in range(size):
                total = 0.0
                for y in range(x, size):
                    total += scale[y, x] * slope[y]
                momentum[x] -= 0.5 * step / reach * total
            for x in range(size):
                total = 0.0
                for y in range(x + 1):
                    total += scale[x, y] * momentum[y]
                trial[x] += step * reach * total
            reached = _density(contacts, trial, sides, loads, inverse, slope)
            for x in range(size):
                total = 0.0
                for y in range(x, size):
                    total += scale[y, x] * slope[y]
                momentum[x] -= 0.5 * step / reach * total
            if not reached / heat < before + 1000:
                break
        chance = np.exp(min(before - reached / heat - 0.5 * (momentum * momentum).sum(), 0.0))
        if not chance >= 0:
            chance = 0.0
        if uniforms[t, 0] < chance:
            copied(trial, here)
            copied(slope, gradient)
            copied(loads, own)
            for x in range(most):
                copied(inverse[x], within[x])
            energy = reached
        if t < warm:
            surplus += (WANTED - chance - surplus) / (t + 1 + 10)
            log_step = np.log(WALK_STEP) - np.sqrt(t + 1) / RELUCTANCE * surplus
            weight = (t + 1) ** -0.75
            averaged = weight * log_step + (1 - weight) * averaged
        else:
            copied(here, kept[t - warm])
            copied(own, given[t - warm])
            energies[t - warm] = energy
            covariance += within / (count - warm)
    return kept, given, covariance, energies


def gaussian_share(contacts: Contacts, top: Array, scale: Array) -> float:
    """How good a normal distribution of places and widths is: effective share of draws from it.

    The effective size of an importance sample over its size (Kong, Liu and Wong, J. Am. Stat.
    Assoc. 89, 278, 1994).

    Parameters
    ----------
    contacts : Contacts
        As of `contacts_about`.
    top : ndarray, shape (k,)
        Places and widths at the maximum.
    scale : ndarray, shape (k, k)
        A lower triangular root of their covariance.
    """
    draws = np.random.default_rng(SEED).standard_normal((DRAWS, len(top)))
    logs = np.square(draws).sum(axis=1) / 2
    logs -= [density(contacts, z)[0] for z in top + draws @ scale.T]
    weights = np.exp(logs - logs.max())
    return float(weights.sum() ** 2 / np.square(weights).sum() / DRAWS)


def sampled_loads(
    contacts: Contacts, tops: list[Array], scale: Array, laplace: Array
) -> tuple[Array, Array]:
    """Mean and covariance of the loads from samples of places and widths.

    Parameters
    ----------
    contacts : Contacts
        As of `contacts_about`.
    tops : list of ndarray, shape (k,)
        Places and widths from which the walks start in turn.
    scale : ndarray, shape (k, k)
        A lower triangular root of the covariance of places and widths.
    laplace : ndarray, shape (2n, 2n)
        Covariance of the loads by Laplace's approximation [N^2].

    Returns
    -------
    mean : ndarray, shape (2n,)
        Of the loads [N].
    covariance : ndarray, shape (2n, 2n)
        Of them [N^2].
    """
    random, walks = np.random.default_rng(SEED), []
    heat = float(chdtri(len(laplace), RARE)) / len(laplace)
    for chain in range(CHAINS):
        start, *normals = random.standard_normal((1 + WARM + TRAJECTORIES, len(scale)))
        uniforms = random.random((WARM + TRAJECTORIES, 3))
        start = tops[chain % len(tops)] + scale @ start
        walks.append(walk(contacts, start, scale, np.array(normals), uniforms, WARM, LENGTH, heat))
    energies = np.array([own.mean() for *_, own in walks])
    # half a loss is an energy; the others are in valleys of no weight
    most = energies.min() + heat * NEGLIGIBLE_LOSS / 2
    walks = [own for own, energy in zip(walks, energies, strict=True) if energy <= most]
    loads = np.concatenate([given for _, given, _, _ in walks])
    within = np.mean([own for _, _, own, _ in walks], axis=0)
    independent = len(loads) / DEPENDENT
    # few samples leave some directions too narrow: Laplace's counts as many as there are loads
    known, told = len(laplace), independent / TAILED
    covariance = told * (within + np.cov(loads.T) / heat) + known * laplace
    covariance *= (1 + 1 / independent) / (told + known)
    return loads.mean(axis=0), covariance
