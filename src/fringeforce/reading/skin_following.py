"""Frames of a skin as they come: contacts are followed, or searched anew."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Mask
from fringeforce.estimation.binning import seen_means
from fringeforce.estimation.followed_frames import JUMP
from fringeforce.estimation.phase_stretches import motion
from fringeforce.estimation.posterior import sharp
from fringeforce.estimation.residual_test import FALSE_VERDICT, square_limit
from fringeforce.models.creep import Crept
from fringeforce.models.skin import FIRST_SHAPE, PLACE, WIDTH
from fringeforce.reading.departure_test import Retests
from fringeforce.reading.frame_reader import FOLLOWING_STEPS
from fringeforce.reading.posterior_search import phase_information
from fringeforce.reading.reading import Reading, Status
from fringeforce.reading.skin_creep import SkinFrames
from fringeforce.reading.skin_fit import Explanation, Seen, renewed
from fringeforce.reading.skin_reader import FAINT_FORCE, SkinReader, goes_on
from fringeforce.reading.skin_result import SkinResult

LINEAR_MOVE = np.array([0.1, 0.3])
"""Change of place and half width, in half widths, up to which a linearisation holds at most: what
is left out is of second order, and less for widths, whose own effect is of second order."""
GROWN = 1.3
"""Factor by which a force may grow or shrink at most until deviations are found anew."""
SHEARED = 0.05
"""Change of a tangential force over the normal one up to which a linearisation holds at most:
shapes of the shear, whose effect is in proportion to it, are uncertain by as much as the shear."""
TURNED = 0.05
"""Change of the phase by modes of the influence matrix, over its largest, up to which a
linearisation holds at most: what is left out is that times the move of a contact."""
LINEAR_ERROR = 0.3
"""Deviations that a linearisation may miss forces, places and widths by at the end of its reach: as
much as adds a tenth to their squares."""
FIRST_REACH = 0.25
"""Share of the largest reach of a linearisation until it is known what one misses."""
LONGER = 2.0
"""Factor by which the reach of a linearisation becomes longer at most, from one to the next."""
OUTDATED = 0.05
"""Relative change of a variance of the forces, in any direction, from which it is found anew."""
CREPT = 0.1
"""Change of what is uncertain of creep, over itself, up to which deviations hold at most: they are
then as far off."""
WAVES_INTERVAL = 64
"""Frames after which smooth waves of what is left are looked for."""


class SkinFollower(SkinFrames):
    """Reads the frames of one skin in the order in which they were taken.

    Parameters
    ----------
    single : SkinReader
        What searches.
    """

    def __init__(self, single: SkinReader) -> None:
        self._single = single
        super().__init__(single)

    def reset(self) -> None:
        """Forget the last reading: the next frame is searched."""
        self._last: Explanation | None = None
        self._used = np.empty(0, bool)
        self._like: SkinResult | None = None
        self._probability, self._age, self._silent, self._size = 0.0, 0, False, 1
        self._strain = self._broken = 0.0
        self._uncertain: Array | None = None
        self._reach = FIRST_REACH
        self._retests = Retests()
        self._then: Crept | None = None

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the phase at the nodes."""
        return (len(self._single.skin.uncertain.frame.fixed),)

    def caused(self, reading: Reading) -> Array:
        """Phase at the nodes that the contacts of a reading cause, shape (m,) [rad]."""
        return self._single.skin.phase_of_lines(reading.forces)

    def shows(self, crept: Crept) -> bool:
        """Whether noise does not hide what creep adds to a frame without contacts.

        The light of a phase beside a multiple of pi is half of what its slope there lets expect.
        """
        known = phase_information(self._single.skin.uncertain.frame, crept.left)
        return float(known @ np.square(crept.left)) / 4 > square_limit(1, FALSE_VERDICT)

    def read(self, levels: NDArray[Any], used: Mask) -> Reading:
        """Read the next frame, which was checked, shape (P,)."""
        found = self._follow(levels, used)
        if found is not None and self._departs(levels, used, found):
            self._last = None
            return self._single.alone(levels, used)
        if found is not None:
            if self._outdated(found):
                self._like = SkinResult(self._single.skin, found)
            status = Status.NO_CONTACT if self._silent else None
            return self._single.stated(
                found, self._probability, status, tracked=True, like=self._like
            )
        known = None if self._silent else self._last
        before = None if known is None else (known, self._probability)
        reading, last = self._single.followed(levels, used, before, self.crept)
        self._silent = reading.status is Status.NO_CONTACT
        if last is not None and not self._silent:
            last = renewed(self._seen(last.posterior.frame, last), last)
        self._last, self._used, self._age, self._then = last, used, 0, self.crept
        if last is not None:
            self._probability, self._broken = reading.probability, last.top.broken
            self._begin(last)
            if not reading.tracked:
                self._reach = FIRST_REACH
                self._retests.begin(float(last.phase @ last.phase))
        return reading

    def _departs(self, levels: NDArray[Any], used: Mask, found: Explanation) -> bool:
        """Whether a frame that follows shows a departure beside the contacts found in it."""
        single = self._single
        if self._silent or self._probability < single.confidence:
            return False
        if not self._retests.due(1, lambda: found.phase):
            return False
        frame = np.where(used, levels.astype(float), np.nan)
        return bool(single.departing(renewed(Seen(single.skin, frame, found.push), found)))

    def _seen(self, frame: Array, one: Explanation) -> Seen:
        """A frame, shape (P,), in bins that tell as much as pixels about an explanation."""
        skin = self._single.skin
        self._size = sharp(skin.uncertain.frame, one.phase)
        return Seen(skin.in_bins(self._size), self._means(frame), one.push, self.crept)

    def _means(self, frame: Array) -> Array:
        if self._size == 1:
            return frame
        return seen_means(frame, self._size, len(self._single.skin.uncertain.frame.bias))

    def _begin(self, one: Explanation) -> SkinResult:
        self._like = SkinResult(self._single.skin, one)
        self._strain = self._single.strain_size(one)
        self._uncertain = None if self.crept is None else self.crept.modes
        return self._like

    def _crept_on(self, last: Explanation) -> Explanation:
        """The last explanation, with what creep adds to the next frame."""
        if self._then is None or (now := self.crept) is None:
            return last
        model = self._single.skin.crept_on(last.posterior.model, self._then, now)
        self._then = now
        return replace(last, posterior=replace(last.posterior, model=model))

    def _follow(self, levels: NDArray[Any], used: Mask) -> Explanation | None:
        """The last explanation moved on to a frame, if that explains it."""
        last = self._last
        if last is None or (used is not self._used and not np.array_equal(used, self._used)):
            return None
        last = self._last = self._crept_on(last)
        if self._silent:
            return self._single.still_silent(levels, used, last)
        frame = levels.astype(float)
        if not self._single.complete(used):
            frame[~used] = np.nan
        posterior = replace(last.posterior, frame=self._means(frame))
        top = posterior.climbed(last.top.unknowns, heats=(), steps=(0, FOLLOWING_STEPS))
        if top.chance < FALSE_VERDICT:
            return None
        self._age += 1
        contacts = self._single.skin.contacts(posterior.model, top.unknowns)
        found = Explanation(posterior, top, contacts, last.centre)
        if found.spoilt(self._broken) or motion(found.phase, last.phase) > JUMP:
            return None
        if self._age >= WAVES_INTERVAL:
            if found.chance < FALSE_VERDICT:
                return None
            self._age = 0
        if self._moved(found):
            fallen = found.contacts.forces[:, 0] < found.centre.forces[:, 0] / GROWN
            seen, linear = self._seen(frame, found), found
            found = renewed(seen, found)
            # the linearisation that a large step was judged by does not hold at its end
            if found.chance < FALSE_VERDICT or found.spoilt(self._broken):
                return None
            if not goes_on(found, last):
                return None
            like = self._begin(found)
            self._adapt(SkinResult(self._single.skin, linear).values, like)
            if (
                fallen.any()
                and (found.contacts.forces[:, 0] <= FAINT_FORCE * like.deviations).any()
            ):
                found = self._single.without_faint(seen, found, like.deviations)
                if found is None:
                    self._last = None
                    return None
                self._begin(found)
        self._last = found
        return found

    def _adapt(self, values: Array, anew: SkinResult) -> None:
        """Set the reach of linearisations by what the last one missed, of second order in it.

        Parameters
        ----------
        values : ndarray, shape (k, 2 + GEOMETRY)
            Forces and geometry of the contacts by the last linearisation, at its end.
        anew : SkinResult
            Of the same frame, linearised there.
        """
        std = np.sqrt(np.diag(anew.joint)).reshape(values.shape)
        known = slice(0, FIRST_SHAPE + 2)
        missed = (np.abs(values - anew.values) / std)[:, known].max()
        longer = np.sqrt(LINEAR_ERROR / max(missed, LINEAR_ERROR / LONGER**2))
        self._reach = float(min(self._reach * longer, 1.0))

    def _moved(self, found: Explanation) -> bool:
        """Whether contacts are no longer where they were linearised, or much stronger or weaker.

        Or whether creep has grown or faded since.
        """
        here, there, reach = found.contacts.geometry, found.centre.geometry, self._reach
        far = np.abs(here - there)[:, [PLACE, WIDTH]] > reach * LINEAR_MOVE * there[:, WIDTH, None]
        now, before = found.contacts.forces, found.centre.forces
        size = np.abs(now[:, 0] / np.where(before[:, 0] == 0, 1e-12, before[:, 0]))
        sheared = np.abs(now[:, 1] - before[:, 1]) > reach * SHEARED * np.abs(before[:, 0])
        grown = np.abs(np.log(np.maximum(size, 1e-12))) > reach * np.log(GROWN)
        changed = far.any(axis=1) | grown | sheared
        # what large strain adds grows with the square of the forces, of which this leaves the last
        beyond = np.abs(now - before).max() / max(np.abs(before).max(), 1e-12)
        if changed.any() or beyond**2 * self._strain > 1 or self._turned(found) > reach * TURNED:
            return True
        if self._uncertain is None or self.crept is None:
            return False
        other = np.linalg.norm(self.crept.modes - self._uncertain)
        return bool(other > CREPT * np.linalg.norm(self._uncertain))

    def _outdated(self, found: Explanation) -> bool:
        """Whether forces changed so much that their deviations did.

        What is uncertain of the influence matrix makes them uncertain by shares of themselves.
        """
        if self._silent or self._like is None or not len(found.posterior.model.influence):
            return False
        covariance = self._like.force_covariance
        before = self._like.values[:, :2].ravel()
        change = found.contacts.forces.ravel() - before
        relative = before @ covariance @ before / max(float(before @ before), 1e-12) ** 2
        return bool(relative * (change @ np.linalg.solve(covariance, change)) > OUTDATED)

    def _turned(self, found: Explanation) -> float:
        """Change of the phase by modes of the influence matrix since the linearisation.

        Over the largest phase that contacts cause.
        """
        model, forces = found.posterior.model, found.contacts.forces
        if not len(model.influence):
            return 0.0
        modes = found.top.unknowns[model.at.modes :][: len(model.influence)]
        unit = np.tensordot(modes - model.origin, model.influence[:, 0], 1)
        largest = np.abs(np.tensordot(forces, model.moments[:, :, 0], 2)).max()
        return float(np.abs(np.tensordot(forces, unit, 2)).max() / max(largest, 1e-12))
