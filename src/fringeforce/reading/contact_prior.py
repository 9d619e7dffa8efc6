"""What is known of a strip's contacts before a frame: how hard they push, and that they are dry."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Mask
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.frame_model import FrameModel

Array = NDArray[np.float64]

SHEAR_RATIO = 0.6
"""Tangential force over normal force of a contact, standard deviation: a dry contact's friction."""
LOADS = 2.0
"""Standard deviation of normal forces over the mean that the pace of the fringes tells, so that one
contact may carry all of it; tangential ones are smaller by the friction of dry contacts."""
ABSENT = 1e-6
"""Standard deviation of a force that moves no phase, which is known to be none, over the push."""
YIELDING = 0.1
"""Share of that mean by which a contact may pull, or slip, at one standard deviation."""
FRICTION = 2.0
"""Largest tangential over normal force, if none is stated.  Without any, shear where hardly
anything presses stands for contacts beside their tactels, or for a mirror image of the light; dry
soft skins slide at about this much, and `YIELDING` leaves room for stickier ones."""
UNSEEN = 0.8
"""Share of the deviation of its normal force before a frame that is left after it, from which no
light shows a contact: two thirds at most is left of those that the camera sees, however dense."""
UNSEEN_PUSH = 10.0
"""How many times as hard as others a contact may push that no light shows: the pace of the fringes
tells nothing of it."""


def contact_prior(model: FrameModel, push: float, friction: float) -> Prior:
    """What is known of the unknowns where contacts push with about this force [N].

    Parameters
    ----------
    model : FrameModel
        What makes frames.
    push : float
        Mean normal force [N].
    friction : float
        Largest tangential over normal force; negative if any.
    """
    at = model.at
    precision = np.ones(at.size)
    precision[: at.loads : 2] = 1 / (LOADS * push) ** 2
    precision[1 : at.loads : 2] = 1 / (SHEAR_RATIO * LOADS * push) ** 2
    absent = ~model.moments.any(axis=(2, 3)).ravel()
    precision[: at.loads][absent] = 1 / (ABSENT * push) ** 2
    return Prior(np.zeros(at.size), precision, friction, YIELDING * push)


def unseen(prior: Prior, covariance: Array) -> Mask:
    """Contacts that no light of a frame shows, shape (n,): masked, or beyond what a camera sees.

    Parameters
    ----------
    prior : Prior
        As of `contact_prior`.
    covariance : ndarray, shape (2n, 2n)
        Of the loads after the frame [N^2].
    """
    before = 1 / prior.precision[: len(covariance) : 2]
    absent = before < before.max() / 2
    return (np.diag(covariance)[::2] > UNSEEN**2 * before) & ~absent


def unseen_words(contacts: Mask) -> str:
    """What is said of a reading whose light does not show some tactels, shape (n,)."""
    if contacts.all():
        return "No light shows what acts on any tactel."
    edges = np.flatnonzero(np.diff(contacts, prepend=False, append=False)).reshape(-1, 2)
    numbers = [f"{a + 1}" if b == a + 1 else f"{a + 1} to {b}" for a, b in edges]
    tactels = "tactel" if contacts.sum() == 1 else "tactels"
    return f"No light shows what acts on {tactels} {', '.join(numbers)}; the others are read."


def widened(prior: Prior, contacts: Mask) -> Prior:
    """The prior, with some contacts, shape (n,), that may push `UNSEEN_PUSH` times as hard."""
    loads = 2 * len(contacts)
    precision = prior.precision.copy()
    precision[:loads] /= np.where(np.repeat(contacts, 2), UNSEEN_PUSH**2, 1.0)
    return prior._replace(precision=precision)


def push_of(prior: Prior) -> float:
    """The push of such a prior [N]."""
    return prior.yielding / YIELDING


def slipping(prior: Prior, loads: Array) -> float:
    """What loads, shape (2n,) [N], that lie outside the friction cone add to the loss."""
    force = loads.reshape(-1, 2)
    beyond = prior.friction * force[:, :1] + force[:, 1:] * (-1.0, 1.0)
    return float(np.square(np.minimum(beyond, 0) / prior.yielding).sum())
