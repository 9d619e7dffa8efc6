"""What drifted on a bench, as far as its frames tell it, one Gauss-Newton step after the other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.bench_search import SETTLED
from fringeforce.calibration.drift_report import ROUNDS
from fringeforce.calibration.drift_rows import DriftRows, as_modes, usable_pixels
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.posterior import HELD, Posterior, Top
from fringeforce.estimation.residual_test import square_limit
from fringeforce.models.strip import SensorModel
from fringeforce.reading.contact_prior import push_of
from fringeforce.reading.reading import Status
from fringeforce.reading.strip_reader import StripFrameReader

STRENGTHS = np.linspace(-3, 3, 25)
"""Strengths of the effect that are tried for a frame of known loads, in standard deviations."""
ATTEMPTS = 8
"""Starts of the search of a frame that is not explained."""
SEARCHES = 2
"""Rounds in which the loads of frames are searched: with a drift of their own, and with that which
all share; then they follow it."""


class DriftState:
    """What frames, each with loads of its own, say of the drift so far.

    Parameters
    ----------
    model : SensorModel
        With tolerances of all that may drift.
    levels : ndarray, shape (F, C P)
        Grey levels.
    loads : ndarray, shape (F, 2n), optional
        Forces, if they are known [N]; otherwise they are found.
    shared : ndarray, shape (S,), optional
        The drift from which to begin, none if not given.
    """

    def __init__(
        self,
        model: SensorModel,
        levels: Array,
        loads: Array | None,
        shared: Array | None = None,
    ) -> None:
        self.origin, self.levels, self.loads = model, levels, loads
        self.rows = DriftRows.about(model)
        self.shared = np.zeros(len(self.rows.where)) if shared is None else shared
        self.explained = np.zeros(len(levels), dtype=bool)
        self.readable = np.zeros(len(levels), dtype=bool)
        count = len(self.shared)
        self.found = self.rows.average(np.zeros((count, count)), np.zeros(count))
        self.loss, self.near = np.inf, shared is not None
        self.best = np.inf, self.shared
        self.searches, self.read = SEARCHES, dict[int, tuple[Prior, Array]]()
        self.silent = np.zeros(len(levels), dtype=bool)

    @property
    def model(self) -> SensorModel:
        """The sensor as found so far."""
        return self.rows.moved(self.origin, self.shared)

    def improve(self) -> bool:
        """Move the model to where all frames agree; whether that was little.

        At first every frame is read with a drift of its own, then all with the one found so far:
        from a drift d, gradient g with its prior and Schur complement K of a frame, its likelihood
        has the gradient g - (1 + K) d where the model is.
        """
        model = self.model
        reader, smooth = self.rows.reader_of(model), StripFrameReader(model)
        rows = self.rows.anew(reader)
        signs = rows.signs_beside(self.rows)
        self.shared, self.found = signs * self.shared, self.found.turned(signs)
        self.best = self.best[0], signs * self.best[1]
        self.rows = rows
        unity = np.eye(len(self.shared))
        information, slope = np.zeros_like(unity), np.zeros_like(self.shared)
        self.loss = rows.loss(self.shared)
        for number, frame in enumerate(self.levels):
            if self.loads is None and self.searches:
                self.read[number] = self._searched(smooth, reader, number, frame)
            posterior, top = self._found(reader, number, frame)
            readable = top.square <= square_limit(top.count)
            if self.near:
                top = self._pinned(posterior, top)
            self.explained[number] = top.square <= square_limit(top.count)
            self.loss += top.loss
            self.readable[number] = readable
            if not readable:
                continue
            about = posterior.linearised(top)
            hessian = about.hessian + about.cone
            own = np.setdiff1d(np.arange(len(hessian)), rows.where)
            cross = hessian[np.ix_(own, rows.where)]
            response = np.linalg.solve(hessian[np.ix_(own, own)], cross)
            told = hessian[np.ix_(rows.where, rows.where)] - unity - cross.T @ response
            information += told
            slope += about.gradient[rows.where] - response.T @ about.gradient[own]
            slope -= (told + unity) @ top.unknowns[rows.where]
        self.searches = max(self.searches - 1, 0)
        lowest, best = self.best
        # by more than climbs of frames leave: one squared deviation
        if self.loss > lowest + 1:
            self.shared = (self.shared + best) / 2
            return False
        if not self.readable.any() and not self.shared.any():
            return True  # the model stays where it is, and would find the same again
        if self.near:
            self.best = self.loss, self.shared
        self.found = rows.average(information, information @ self.shared - slope)
        step = self.found.mean - self.shared
        self.shared = self.found.mean
        short = bool(np.sqrt(step @ (unity + information) @ step) < SETTLED)
        self.near, before = True, self.near
        return before and short

    def _pinned(self, posterior: Posterior, top: Top) -> Top:
        """What explains a frame best without any drift of its own."""
        precision, start = posterior.prior.precision.copy(), top.unknowns.copy()
        precision[self.rows.where] *= HELD
        start[self.rows.where] = 0.0
        alone = replace(posterior, prior=posterior.prior._replace(precision=precision))
        return alone.climbed(start, heats=())

    def images(self) -> Iterator[Array]:
        """Shared unknowns under which the residual has the other sign.

        Everywhere, and in each stretch between its zeros.  Without load, light tells a phase from
        its negative by no more than how smooth it is.
        """
        imaging = self.model.imaging
        assert imaging is not None
        assert imaging.residual is not None
        used, rows = usable_pixels(imaging), self.rows.fields
        stretch = np.cumsum(np.diff(np.sign(imaging.residual), prepend=0.0) != 0)
        seen = np.unique(stretch[used])
        for own in (seen, *(seen[k : k + 1] for k in range(len(seen) if len(seen) > 1 else 0))):
            turned = -2 * imaging.residual * np.isin(stretch, own)
            field = np.flatnonzero(rows.any(axis=1))
            shared = self.shared.copy()
            shared[field] += as_modes(rows[np.ix_(field, used)], turned[used])
            yield shared

    def _found(self, reader: StripFrameReader, number: int, frame: Array) -> tuple[Posterior, Top]:
        """What explains a frame best."""
        used = reader.usable_pixels
        posterior = reader.own_posterior(np.where(used, frame, np.nan))
        if self.loads is not None:
            count, prior = posterior.model.at.loads, posterior.prior
            precision, mean = prior.precision.copy(), prior.mean.copy()
            precision[:count] *= HELD
            mean[:count] = self.loads[number]
            known = prior._replace(precision=precision, mean=mean)
            # second order alone would be taken for drift
            solved = reader.solved_at(posterior, self.loads[number])
            alone = replace(solved, prior=known)
            starts = [mean]
            for row in np.flatnonzero(self.rows.design):
                # fringes that a wrong strength shifts by one are a valley of their own
                unit = np.zeros_like(mean)
                unit[self.rows.where[row]] = 1.0
                starts = [start + size * unit for start in starts for size in STRENGTHS]
            tops = [alone.climbed(start) for start in starts]
            return alone, min(tops, key=lambda top: top.loss)
        known, start = self.read[number]
        posterior = reader.posterior(posterior.frame, push_of(known))
        prior = posterior.prior._replace(friction=known.friction, yielding=known.yielding)
        posterior = reader.solved_at(posterior.under(prior), start[: posterior.model.at.loads])
        # loads of frames that show none would be made up, and tell where the camera is
        posterior = posterior.without() if self.silent[number] else posterior
        top = posterior.climbed(start, heats=())
        after = top.unknowns.copy()
        after[self.rows.where] = 0.0
        self.read[number] = known, after
        return posterior, top

    def _searched(
        self, smooth: StripFrameReader, reader: StripFrameReader, number: int, frame: Array
    ) -> tuple[Prior, Array]:
        """Prior of a frame and unknowns that lead to what explains it best.

        Under residuals that are as smooth as the drawing says: rougher ones would stand for loads.
        """
        used = reader.usable_pixels
        reading, located = smooth.followed(frame, used, None)
        self.silent[number] = reading.status is Status.NO_CONTACT
        if located is not None:
            posterior, unknowns = located.posterior, located.top.unknowns
        else:
            levels = np.where(used, frame, np.nan)
            posterior, tops = smooth.explanations(levels, ATTEMPTS, mend=True)
            nothing = np.zeros(posterior.model.at.size)
            unknowns = tops[0].unknowns if tops else posterior.climbed(nothing).unknowns
        own, count = self.rows.fields[self.rows.residual], len(self.rows.guess.modes)
        at, more = posterior.model.at, reader.uncertain.frame.at.size - posterior.model.at.size
        last = at.fields + count - more
        nodes = unknowns[at.fields : last] @ posterior.model.fields[: last - at.fields]
        field = smooth.at_pixels(nodes)
        begun = unknowns[: at.fields], as_modes(own, field), unknowns[last:]
        return posterior.prior, np.concatenate(begun)


def of_likelier_sign(state: DriftState) -> tuple[DriftState, bool]:
    """The likeliest among mirror images of the residual, and whether its own are less likely.

    Without load, descents begin where the light does not change with the residual to first order,
    and may end early; an image that is better has its own images looked at.
    """
    signed = True
    for _ in range(2):
        images = [
            DriftState(state.origin, state.levels, state.loads, shared) for shared in state.images()
        ]
        for image in images:
            any(image.improve() for _ in range(ROUNDS))
        best, *rivals = sorted([state, *images], key=lambda one: one.loss)
        signed = all(rival.loss - best.loss > square_limit(1) for rival in rivals)
        if best is state:
            break
        state = best
    return state, signed
