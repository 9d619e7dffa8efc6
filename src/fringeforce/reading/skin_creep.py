"""Creep of earlier loads on a skin, which is known before a frame is read.

A frame shows the contacts of its own time, and what lags behind those before:

    p = Psi f + sum_k c_k p_k,    dp_k / dt = r_k (Psi f - p_k),

the lags of `models.creep`, of phases at the nodes in the place of forces: contacts have moved, and
no few of them cause what they left.  Loads are linear from one frame to the next, so that the
lags are a phase that is known, and a share of the load of the frame itself.  Contacts are found in
what the known phase leaves, with the terms that are uncertain as modes of it, and their forces are
less by that share.
"""

from __future__ import annotations

import numpy as np

from fringeforce.base.errors import InputError
from fringeforce.estimation.residual_test import FALSE_VERDICT, square_limit
from fringeforce.models.skin import Crept, SkinModel
from fringeforce.reading.creep import FADING, UncertainCreep
from fringeforce.reading.posterior_search import phase_information
from fringeforce.reading.reading import Reading, Status


class SkinCreep:
    """What earlier loads add to the frames of a skin that relaxes.

    Parameters
    ----------
    uncertain : UncertainCreep
        Of the strip.
    skin : SkinModel
        What contacts do.
    """

    def __init__(self, uncertain: UncertainCreep, skin: SkinModel) -> None:
        self._ways, self._skin = uncertain.ways(), skin
        self.reset()

    def reset(self) -> None:
        """Forget all earlier loads."""
        nothing = np.zeros(len(self._skin.uncertain.frame.fixed))
        self._time: float | None = None
        self._lags = [np.zeros((len(way.rates), len(nothing))) for way in self._ways]
        self._phases = [nothing] * len(self._ways)
        self._shown = nothing
        self.expect(0.0)

    def expect(self, time: float, scale: float = 1.0) -> None:
        """Find what creep adds to the next frame, `now`.

        Parameters
        ----------
        time : float
            Of the frame [s].
        scale : float
            Of its phases, over those at the temperature of the design.

        Raises
        ------
        InputError
            If the time lies before that of the last frame.
        """
        interval = time - (time if self._time is None else self._time)
        if not interval >= 0:
            raise InputError(
                f"A frame at {time:g} s follows one at {self._time:g} s; times must not descend."
            )
        self._next, self._scale = time, scale
        self._weights = [way.weights(interval) for way in self._ways]
        self._left = [
            kept[:, None] * lags + np.multiply.outer(own, phase)
            for (kept, own, _), lags, phase in zip(
                self._weights, self._lags, self._phases, strict=True
            )
        ]
        pairs = zip(self._ways, self._weights, strict=True)
        self._shares = [1 / (1 + float(way.amounts @ new)) for way, (_, _, new) in pairs]
        self._known = [way.amounts @ left for way, left in zip(self._ways, self._left, strict=True)]
        drawn, share = self._known[0], self._shares[0]
        modes = [
            known - drawn + (share / own - 1) * self._shown
            for known, own in zip(self._known[1:], self._shares[1:], strict=True)
        ]
        missed = self._ways[0].ripple * drawn
        self.now = Crept(scale * drawn, scale * np.array([*modes, missed]))

    def reading(self, found: Reading) -> Reading:
        """A reading of the frame that was expected, without creep, if it is explained."""
        if not found.status.usable:
            return found
        touched, nothing = found.status is not Status.NO_CONTACT, np.zeros_like(self._shown)
        self._shown = nothing
        if touched:
            self._shown = self._skin.phase_of_lines(found.forces) / self._scale
        self._time, whole = self._next, self._known[0] + self._shown
        for k, (_, _, new) in enumerate(self._weights):
            phase = self._shares[k] * (whole - self._known[k]) if touched else nothing
            self._lags[k] = self._left[k] + np.multiply.outer(new, phase)
            self._phases[k] = phase
        if touched:
            return found.scaled(self._shares[0])
        return found.saying(FADING) if self._shows() else found

    def _shows(self) -> bool:
        """Whether noise does not hide what creep adds.

        The light of a phase beside a multiple of pi is half of what its slope there lets expect.
        """
        known = phase_information(self._skin.uncertain.frame, self.now.phase)
        square = float(known @ np.square(self.now.phase)) / 4
        return square > square_limit(1, FALSE_VERDICT)
