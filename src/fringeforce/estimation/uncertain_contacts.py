"""Uncertain contacts of one frame of a strip about the best phase: what is known, and what is seen.

The light is taken as linear in the phase about the best one,

    -2 log p(frame | contacts) = |sum_j Psi_j(z_j)' f_j - t|^2,

with the influence Psi_j of a contact at its place and of its width z_j, its loads f_j, and the
contacts' phase t in coordinates in which the noise is of unit variance.  Fields of phase, light and
camera are in the noise: their Schur complement is taken once.

Places are those at which the camera sees the contacts, for a camera that is shifted and contacts
that are all beside their tactels look alike.  So the shift is linear as well, and known where the
places are: integrated out, it leaves their prior with the mean m and the precision Q, and the phase
t with a small share of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, eigh

from fringeforce.estimation.compiling import sums, sums_entry
from fringeforce.estimation.frame_exposure import patch_moments, positive_in_loops
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.frame_model import LEAST_PROFILE, FrameModel, as_seen, turned_moments
from fringeforce.estimation.linearised_frame import (
    Linearised,
    banded,
    pulled_phase,
    shared_information,
)

Array = NDArray[np.float64]

TYPICAL = 0.35
"""Size of a place or half width in units of the reach at which moments count by their power."""


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

    @property
    def held(self) -> list[int]:
        """Which of place and width, 0 and 1, are uncertain."""
        return [k for k, uncertain in enumerate((self.placed, self.wider)) if uncertain]

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
def moments_at(contacts, z, w, mean, by_place, by_width):
    """Moments of a contact of a place and a width, and their derivatives by both."""
    shift, wide, slope = 0.0, contacts.width, 0.0
    if contacts.place > 0:
        shift = contacts.place * z
    if contacts.width_std > 0:
        wide, slope = positive_in_loops(wide + contacts.width_std * w, contacts.narrow)
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
        moments_at(contacts, z[j, 0], z[j, 1], found[0, j], found[1, j], found[2, j])
    return found


def places_and_widths(contacts: Contacts, z: Array) -> Array:
    """Values of all contacts in two columns, those of what is known being zero, shape (n, 2)."""
    found, held = np.zeros((len(contacts.profiles), 2)), contacts.held
    found[:, held] = z.reshape(len(held), -1).T
    return found


def influence(contacts: Contacts, z: Array) -> Array:
    """Influence of all contacts at places and widths, shape (2n, r)."""
    moments = moments_of(contacts, places_and_widths(contacts, z))[0]
    return np.einsum("nk,nckr->ncr", moments, contacts.profiles).reshape(-1, len(contacts.target))
