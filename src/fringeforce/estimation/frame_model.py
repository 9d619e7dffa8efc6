"""One frame of a strip from loads and everything else that is uncertain, in compiled loops.

The grey levels of a strip are

    y = B + A (1 - V K sum_d M_d cos(c_d p + b_d)) / 2,
    p = sum_j f_j . Psi_j(place_j + sum_d s_dj e_d, width_j) + f' H f + rho,

with the amplitude A, offset B, visibility V and point spread K of the camera, the shares M that the
light of the channels d has in the grey levels of one, and the phase lead p of the loads f and of
the residual retardance rho; H is what large strain adds.  What is uncertain are standardised
unknowns e ~ N(0, 1) beside the loads: place and width of each contact, smooth fields of phase,
modes of light and influence matrix, visibility, blur, gamma and cross-talk.  A camera that is
shifted sees all contacts moved by s_d, beside what the strip's ends change.  What acts through
profiles that are smooth along the strip is kept on nodes, and only the fringes are taken at every
pixel.

A contact enters through the moments of its traction: the influence of a line load is a polynomial
in its place, whose k-th coefficient is multiplied by the k-th moment of the traction about the
tactel.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import beta, comb

Array = NDArray[np.float64]

EVEN, HERTZ = 1.0, 1.5
"""Profiles of tractions (1 - u^2)^(profile - 1) over the width, u from -1 to 1."""
LEAST_PROFILE = 1e-4
"""Share of the largest singular value, of what likely contacts do to the phase, at which profiles
and mixtures of moments are left out."""


class Layout(NamedTuple):
    """Where the unknowns stand: loads first, then those that follow; `size` is their number.

    Groups that a design does not have begin where the next one does.
    """

    loads: int
    place: int
    width: int
    fields: int
    modes: int
    visibility: int
    blur: int
    gamma: int
    crosstalk: int
    size: int


class FrameModel(NamedTuple):
    """What makes a frame; n tactels, K moments, m nodes, P pixels of C channels in turn.

    Attributes
    ----------
    moments : ndarray, shape (n, 2, K, m)
        Phase lead per force and moment of its traction [rad/N].
    profiles : ndarray, shape (n, 2, k, m)
        The same of fewer mixtures of the moments, which are all that likely contacts need.
    mixing : ndarray, shape (k, K)
        The mixtures from the moments.
    reach : float
        Unit of length of the moments [m].
    place : float
        Standard deviation of the places of contacts [m].
    width, width_std, narrow : float
        Width of contacts, its deviation, and the width below which it is kept positive [m].
    profile : float
        Of their tractions, EVEN or HERTZ.
    moving : ndarray, shape (d, n), or (0, n)
        How far a deviation of each of the first modes moves each contact in what the camera sees
        [m]; without rows where none does.
    origin : ndarray, shape (d,), or (0,)
        Values of these modes at which the contacts are seen at their tactels.
    drawn : ndarray, shape (K,), or (0,)
        Moments of the traction of a contact as drawn, for the next.
    scaling : ndarray, shape (d,), or (0,)
        Relative change, by a deviation of each of these modes from its origin, of what contacts add
        to the phase that are not as drawn.
    fields : ndarray, shape (r, m)
        Modes of the phase lead that no load causes [rad].
    fixed : ndarray, shape (m,)
        Phase lead without load [rad].
    influence : ndarray, shape (d, q, n, 2, m)
        What powers 1 to q of the first d modes change in the influence matrix, beside that they
        move the contacts [rad/N].
    curvature : ndarray, shape (2n, 2n, m)
        Second order H of the phase lead in the loads, symmetric [rad/N^2]; shape (0, 0, m) where
        strain is small.
    brightness, darkness : ndarray, shape (s, C m)
        What s >= d modes change in the amplitude, relative to it, and in the offset, grey levels,
        of all channels in turn.
    amplitude, offset : ndarray, shape (P,)
        Of a fringe of full visibility, grey levels.
    dispersion, bias, spread : ndarray, shape (C,)
        Phase of each channel over that of the strip, phase added [rad], spread of wave numbers.
    visibility, visibility_std : float
        Of the fringes.
    blur, blur_std : float
        Standard deviation of the point spread [pixels]; none where both are zero.
    gamma, gamma_std : float
        Power of the grey level as a share of the full scale, and its deviation.
    crosstalk : ndarray, shape (C, C + 1)
        Share that the light of every channel has in the fringes of each, a row for each, and last
        what is added to them; shape (0, 1) if every channel sees its own light alone and is known
        to.
    leaks : ndarray, shape (k, C, C + 1)
        Change of these with each of their unknowns.
    srgb : bool
        Whether the response is that of sRGB before that power.
    variance : ndarray, shape (P,)
        Of the noise, the same all along a channel, squared grey levels.
    floor, ceiling, full_scale : float
        Grey levels at which pixels are clipped, and the largest one.
    broken : float
        Share of pixels that show anything at all.
    first, weights : ndarray, shapes (P,) and (P, 4)
        Nodes between which a pixel lies, and what they count.
    starts : ndarray of int, shape (C runs,)
        Where the pixels of each run, which have the same nodes, begin, or what is left of a short
        one at the end.
    shares : ndarray, shape (longest run, 4, C runs)
        `weights` of the pixels of each run in turn, zero beyond its end.
    halves : ndarray, shape (longest run, 2, C runs)
        The two left and the two right ones of these together.
    at : Layout
        Where the unknowns stand.
    """

    moments: Array
    profiles: Array
    mixing: Array
    reach: float
    place: float
    width: float
    width_std: float
    narrow: float
    profile: float
    moving: Array
    origin: Array
    drawn: Array
    scaling: Array
    fields: Array
    fixed: Array
    influence: Array
    curvature: Array
    brightness: Array
    darkness: Array
    amplitude: Array
    offset: Array
    dispersion: Array
    bias: Array
    spread: Array
    visibility: float
    visibility_std: float
    blur: float
    blur_std: float
    gamma: float
    gamma_std: float
    crosstalk: Array
    leaks: Array
    srgb: bool
    variance: Array
    floor: float
    ceiling: float
    full_scale: float
    broken: float
    first: NDArray[np.int64]
    weights: Array
    starts: NDArray[np.uint32]
    shares: Array
    halves: Array
    at: Layout


def side_by_side(
    first: NDArray[np.int64], weights: Array
) -> tuple[NDArray[np.uint32], Array, Array]:
    """`starts`, `shares` and `halves` of one channel of a `FrameModel`, from its pixels."""
    runs = np.concatenate([[0], np.flatnonzero(np.diff(first)) + 1, [len(first)]])
    longest = int(np.diff(runs).max())
    starts = np.minimum(runs[:-1], len(first) - longest)
    shares = np.zeros((longest, 4, len(starts)))
    for t in range(longest):
        own = (starts + t >= runs[:-1]) & (starts + t < runs[1:])
        shares[t][:, own] = weights[starts[own] + t].T
    halves = np.stack([shares[:, :2].sum(axis=1), shares[:, 2:].sum(axis=1)], axis=1)
    return starts.astype(np.uint32), shares, halves


def pixels_at(first: NDArray[np.int64], weights: Array, channels: int) -> dict[str, Any]:
    """Where the pixels of a `FrameModel` look, from the nodes and weights of one channel."""
    starts, shares, halves = side_by_side(first, weights)
    pixels = len(first)
    return {
        "first": np.tile(first, channels),
        "weights": np.tile(weights, (channels, 1)),
        "starts": np.concatenate([starts + c * pixels for c in range(channels)]).astype(np.uint32),
        "shares": np.ascontiguousarray(np.tile(shares, channels)),
        "halves": np.ascontiguousarray(np.tile(halves, channels)),
    }


def node_weights(along: Array, count: int) -> tuple[NDArray[np.int64], Array]:
    """First node and weights of cubic B-splines at places between evenly spaced nodes.

    Parameters
    ----------
    along : ndarray, shape (P,)
        Places, in steps from the first node.
    count : int
        Number of nodes.
    """
    first = np.clip(along.astype(np.int64) - 1, 0, count - 4)
    t = along - first - 1
    weights = np.stack(
        [
            (1 - t) ** 3 / 6,
            2 / 3 - t**2 + t**3 / 2,
            2 / 3 - (1 - t) ** 2 + (1 - t) ** 3 / 2,
            t**3 / 6,
        ],
        axis=1,
    )
    return first, weights


def contacts_scatter(place: float, moving: Array) -> float:
    """Standard deviation of where contacts are seen beside their tactels, the largest [m].

    Parameters
    ----------
    place : float
        Of their places [m].
    moving : ndarray, shape (d, n)
        As of `FrameModel`.
    """
    return float(np.sqrt(place**2 + np.square(moving).sum(axis=0).max(initial=0.0)))


def as_seen(model: FrameModel) -> Array:
    """From unknowns to those whose places are where the camera sees the contacts, (size, size).

    Places of the frame's layout; a matrix of ones without contacts of uncertain places.
    """
    at, turned = model.at, np.eye(model.at.size)
    if at.width > at.place and len(model.moving):
        turned[at.place : at.width, at.modes : at.modes + len(model.moving)] = (
            model.moving.T / model.place
        )
    return turned


def moments_about(moments: Array, apart: Array) -> Array:
    """Influence of the moments of tractions about other places, by the binomial theorem.

    Parameters
    ----------
    moments : ndarray, shape (n, 2, K, m)
        About the tactels.
    apart : ndarray, shape (n,)
        How far the places are from them, in units of the reach.
    """
    order = moments.shape[2]
    if not np.any(apart):
        return moments
    i, k = np.arange(order)[:, None], np.arange(order)
    powers = np.asarray(apart)[:, None, None] ** np.maximum(k - i, 0)
    return np.ascontiguousarray(
        np.einsum("nik,ntkm->ntim", np.where(k >= i, comb(k, i), 0.0) * powers, moments)
    )


def influence_as_drawn(model: FrameModel) -> Array:
    """Influence of contacts as drawn at the origin of the modes, shape (n, 2, m) [rad/N]."""
    return np.asarray(np.einsum("k,ntkm->ntm", model.drawn, model.moments))


def turned_moments(model: FrameModel, modes: Array) -> tuple[Array, Array]:
    """Influence of the moments of contacts at their tactels, and its slopes, under some modes.

    Parameters
    ----------
    model : FrameModel
        Of the strip.
    modes : ndarray, shape (d,)
        Of the influence matrix.

    Returns
    -------
    moments : ndarray, shape (n, 2, K, m)
        About where the tactels are seen [rad/N].
    slopes : ndarray, shape (d, n, 2, K, m)
        Of these by the modes.
    """
    moments, power = model.moments, np.arange(1, 1 + model.influence.shape[1])
    slopes = np.zeros((len(model.influence), *moments.shape))
    e, scale = modes[:, None], 1.0
    as_drawn = influence_as_drawn(model) if len(model.scaling) else 0.0
    if len(model.moving):
        moments = moments_about(moments, (modes - model.origin) @ model.moving / model.reach)
        raised = moments[:, :, 1:] * np.arange(1, moments.shape[2])[:, None]
        slopes[:, :, :, :-1] = np.einsum("dn,ntkm->dntkm", model.moving / model.reach, raised)
    if len(model.scaling):
        scale += model.scaling @ (modes - model.origin)
        beside = moments.copy()
        beside[:, :, 0] -= as_drawn
        moments = moments + (scale - 1) * beside
        slopes = scale * slopes + model.scaling[:, None, None, None, None] * beside
    if len(model.influence):
        moments = moments.copy()
        moments[:, :, 0] += np.einsum("dq,dqncm->ncm", e**power, model.influence)
        slopes[:, :, :, 0] += np.einsum("dq,dqncm->dncm", power * e ** (power - 1), model.influence)
    return moments, slopes


def moment_table(order: int, profile: float) -> Array:
    """Coefficients of the moments of a traction, shape (order, order // 2 + 1).

    Mean of t^k about d over the half width h: sum_i C(k, 2i) U_i d^(k - 2i) h^(2i), where U_i is
    the moment 2i of the weight (1 - u^2)^(p - 1), B(i + 1/2, p) / B(1/2, p) with the beta function.
    """
    table = np.zeros((order, order // 2 + 1))
    for k in range(order):
        i = np.arange(k // 2 + 1)
        table[k, : len(i)] = comb(k, 2 * i) * beta(i + 0.5, profile) / beta(0.5, profile)
    return table
