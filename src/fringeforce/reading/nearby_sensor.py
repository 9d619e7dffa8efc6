"""About which values a reading takes exactly what several of them change together.

What single values of the design, the camera and contacts change in the influence of a strip is a
series in each of them about a centre, and there what they change together is exact.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.models.design_modes import RATIO
from fringeforce.models.uncertainty import Uncertainty

PRODUCTS = 1e-3
"""Products of what values of the design, the camera and contacts change in the influence, over its
peak, from which a reading takes them exactly: of ten radians the noise of a pixel."""


def off(uncertain: Uncertainty) -> Array:
    """Modes of the influence matrix for which products are exact, shape (d,)."""
    modes = uncertain.modes[: len(uncertain.frame.influence)]
    return np.array([uncertain.centre.get(mode.name, 0.0) for mode in modes])


def centre_near(
    uncertain: Uncertainty, beside: bool, unknowns: Array, near: Callable[[], Array]
) -> Mapping[str, float] | None:
    """A centre near what was found, as of `Uncertainty.centre`; none where products are small.

    A product counts where both values are off, and where one is off and the other one may be:
    without it a frame seems to tell of the other one what loads can make up for.  Of what was
    calibrated the values are nearly known, and large strain has a centre of its own.  Centres lie
    on a grid, so that frames of one sensor share them.

    Parameters
    ----------
    uncertain : Uncertainty
        About the centre of the reading.
    beside : bool
        Whether contacts may lie beside their tactels, or be wider.
    unknowns : ndarray, shape (size,)
        The best explanation.
    near : callable
        Its standard deviations, shape (size,).
    """
    frame = uncertain.frame
    if uncertain.matrix.calibrated or len(frame.curvature) or not len(frame.influence):
        return None
    turning = slice(frame.at.modes, frame.at.modes + len(frame.influence))
    modes = unknowns[turning]
    contacts = _contacts_turn(uncertain) if beside else 0.0
    far = np.abs(modes - off(uncertain))
    turns, by_contacts = uncertain.turns, contacts * uncertain.turns_contacts
    sizes, others = far * turns, (far / 2 + near()[turning]) * turns  # each pair is counted twice
    products = sizes.sum() * others.sum() - sizes @ others
    if products + (far * by_contacts).sum() < PRODUCTS:
        return None
    whole = turns * (turns.sum() - turns) + by_contacts
    step = np.minimum(2 * PRODUCTS / np.maximum(whole, PRODUCTS), 1.0)
    return {
        mode.name: float(e)
        for mode, e in zip(uncertain.modes, step * np.rint(modes / step), strict=False)
        if e and mode.name != RATIO
    }


def _contacts_turn(uncertain: Uncertainty) -> float:
    """What uncertain places and widths change in the influence, over its peak."""
    frame, at = uncertain.frame, uncertain.frame.at
    sizes = np.abs(frame.moments).max(axis=(0, 1, 3))
    place = frame.place / frame.reach * (at.width > at.place)
    width = frame.width * frame.width_std / (6 * frame.reach**2) * (at.fields > at.width)
    return float((place * sizes[1] + width * sizes[2]) / sizes[0])
