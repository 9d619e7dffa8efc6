"""Starts for frames of a skin: from candidates of the phase to contacts.

A beam search follows the phase with loads on a coarse row of patches.  What presses anywhere inside
the friction cone is then fitted to that phase by nonnegative least squares, for the cone of a plane
has two rays, and what it finds is divided into contacts, which are fitted to the phase in turn.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.optimize import nnls

from fringeforce.base.arrays import Array, Index
from fringeforce.estimation.frame_exposure import node_phase
from fringeforce.estimation.frame_model import FrameModel
from fringeforce.estimation.hypotheses import NEGLIGIBLE_LOSS, SAME_PHASE
from fringeforce.models.skin import (
    FIRST_SHAPE,
    GEOMETRY,
    PLACE,
    WIDTH,
    Contacts,
    SkinModel,
    variances,
)
from fringeforce.reading.frame_light import Lines
from fringeforce.reading.posterior_search import (
    CANDIDATES,
    Effort,
    PosteriorSearch,
    phase_information,
)
from fringeforce.reading.skin_fit import between, limited_step

PATCHES = 1.0, 0.5
"""Widths of the patches of a beam search, in thicknesses of the cover.  Those as wide as the cover
is thick miss up to 6 % of the phase of a narrow contact beside their middles, which is too much
where covers are thick; half as wide ones miss 0.05 %."""
GRID = 0.4
"""Distance of the line loads of the fit, in thicknesses of the cover."""
SMALL = 2.5e-3
"""Share of the normal force below which a line load is none."""
PHASE_ERROR = 0.1
"""Standard deviation of a candidate of the phase, for patches are not contacts [rad]."""
EFFORTS = (
    Effort(push=0.0, scale=2.0, phase_error=PHASE_ERROR),
    Effort(push=0.0, scale=2.0, phase_error=PHASE_ERROR, backward=True),
    Effort(push=0.0, scale=4.0, phase_error=PHASE_ERROR),
    Effort(push=0.0, scale=2.0, phase_error=PHASE_ERROR / 2, light="drawn"),
    Effort(push=0.0, scale=2.0, phase_error=PHASE_ERROR, extent=0.25, width=512, cut=120.0),
    Effort(),
)
"""Attempts in the order in which they are made: few patches are pressed, those much."""
FIRST = EFFORTS[:2]
"""Those that find nearly all that explains a frame, at a tenth of what all cost in vain."""
PULL = 0.3
"""Share of the push by which a patch may pull at one standard deviation, for its neighbours are no
better known."""
MOST_CONTACTS = 6
"""Contacts that are looked for at most."""
WEAK_SHARE = 0.05
"""Share of the strongest contact's force below which a contact is noise of the candidate, at first.
"""
EMPTY = 3
"""Line loads from one to the next that are the same contact: more than a cover's thickness apart,
light tells them apart."""
FIT_STEPS = 6
"""Most steps in which contacts are fitted to a phase, for the frame says the rest."""
WIDE_PRESSURE = 2.0
"""Standard deviation of the pressure of a contact, in thicknesses of the cover, beyond which it is
looked for as two at first."""


@dataclass(frozen=True, eq=False)
class SkinSearch:
    """Finds starts for frames of one skin.

    Attributes
    ----------
    skin : SkinModel
        What contacts do.
    """

    skin: SkinModel

    @cached_property
    def beam(self) -> PosteriorSearch:
        """The beam search on patches as wide as the cover is thick."""
        return self._on_skin[0]

    @cached_property
    def _on_skin(self) -> tuple[PosteriorSearch, ...]:
        """The beam search on rows of patches of each of `PATCHES`, all over the skin."""
        return tuple(PosteriorSearch(self._patches(width, self.skin.half)) for width in PATCHES)

    @cached_property
    def _beyond(self) -> list[PosteriorSearch]:
        """The same of the widest ones, as far as line loads reach; none if that is no farther."""
        last, skin = self.skin.places[-1], self.skin
        farther = last > skin.half + skin.narrowest
        return [PosteriorSearch(self._patches(PATCHES[0], last))] if farther else []

    def _patches(self, width: float, reach: float) -> FrameModel:
        """The strip with patches as far to either side as given [m] in the place of tactels."""
        skin = self.skin
        count = max(round(2 * reach / (width * skin.cover)), 2)
        geometry = np.zeros((count, GEOMETRY))
        half = reach / count
        geometry[:, WIDTH] = half
        geometry[:, PLACE] = -reach + half * (1 + 2 * np.arange(count))
        return skin.touched(geometry)

    @cached_property
    def _places(self) -> Array:
        """Places of the line loads of the fit, where middles of contacts lie [m]."""
        skin = self.skin
        count = int(np.ceil(2 * skin.half / (GRID * skin.cover))) + 1
        return np.linspace(-skin.half, skin.half, count)

    @cached_property
    def _rays(self) -> Array:
        """Phase at the nodes under loads at the limits of friction, shape (2 n, m) [rad/N]."""
        skin = self.skin
        unit = skin.line_shares(self._places)
        normal, tangential = unit @ skin.lines[0], unit @ skin.lines[1]
        mu = skin.friction
        return np.concatenate([normal + mu * tangential, normal - mu * tangential])

    def phases(self, lines: Lines, efforts: tuple[Effort, ...] = EFFORTS) -> Iterator[Array]:
        """Candidates of the phase at the nodes, shape (m,), the likeliest of each effort first."""
        given = list[Array]()
        for effort, beam in self._beams(efforts):
            starts, scores, push = beam.starts(lines, lines.light, effort)
            loads = starts[:, : beam.model.at.loads].reshape(len(starts), -1, 2)[:, :, 0]
            # both signs are found alike, and contacts push; the sum of wide loads hardly shows
            pulls = np.minimum(np.stack([loads, -loads]), 0)
            unlikely = np.square(pulls / (PULL * push)).sum(axis=2)
            sides = np.where(unlikely[1] < unlikely[0], -1.0, 1.0)
            order = np.argsort(scores + unlikely.min(axis=0), kind="stable")
            for k in order[:CANDIDATES]:
                phase = sides[k] * node_phase(beam.model, starts[k])
                if all(np.abs(phase - known).max() > SAME_PHASE for known in given):
                    given.append(phase)
                    yield phase

    def _beams(self, efforts: tuple[Effort, ...]) -> Iterator[tuple[Effort, PosteriorSearch]]:
        """Attempts in the order in which they are made, first on the skin.

        Patches from end to end of the strip would explain many frames by even pressure besides,
        which hardly shows, so that those across the ends of the skin come after all others.
        """
        yield from product(efforts, self._on_skin)
        yield from product(efforts, self._beyond)

    def pressed(self, phase: Array) -> tuple[Array, float]:
        """Line loads inside the friction cone that fit a phase best.

        Parameters
        ----------
        phase : ndarray, shape (m,)
            At the nodes [rad].

        Returns
        -------
        loads : ndarray, shape (n, 2)
            Normal and tangential, at `_places` [N].
        misfit : float
            Weighted sum of squares that they leave.
        """
        root = np.sqrt(self._certainty(phase))
        wanted = phase - self.skin.uncertain.frame.fixed
        # what the light does not show counts a little, or loads there would be free
        found, misfit = nnls((self._rays * root).T, wanted * root, maxiter=10 * len(self._rays))
        plus, minus = found.reshape(2, -1)
        loads = np.column_stack([plus + minus, self.skin.friction * (plus - minus)])
        return loads, misfit**2

    def _certainty(self, phase: Array) -> Array:
        """Reciprocal variance of a candidate of the phase at the nodes, shape (m,) [1/rad^2]."""
        known = phase_information(self.skin.uncertain.frame, phase)
        return np.asarray(known / (1 + known * PHASE_ERROR**2))

    def images(self, phase: Array, push: float, growth: float) -> Array:
        """Phases that look like one, the likeliest first, shape (k, m).

        A stretch is mirrored, or all is whole orders of fringes less, as without an even pressure
        from end to end, or mirrored there.
        """
        changes, columns, _ = self.beam.mirrored(phase, push, growth)
        order = 2 * np.pi * np.round(np.median(phase) / (2 * np.pi))
        whole = [phase - order, order - phase] if order else []
        return np.array([*whole, *(phase + changes @ columns.T)])

    def fewest(self, loads: Array) -> int:
        """Contacts that line loads are at least, each in one piece and not too wide."""
        places, normal = self._places, loads[:, 0]
        kept = np.flatnonzero(normal > SMALL * normal.sum())
        pieces = np.split(normal[kept], np.flatnonzero(np.diff(kept) > EMPTY) + 1)
        pushed = np.array([own.sum() for own in pieces])
        for count in range(np.count_nonzero(pushed > WEAK_SHARE * pushed.max()), MOST_CONTACTS):
            parts = np.split(kept, _groups(places[kept], normal[kept], count))
            if all(
                _spread(places[own], normal[own]) < WIDE_PRESSURE * self.skin.cover for own in parts
            ):
                return count
        return MOST_CONTACTS

    def divided(self, loads: Array, count: int) -> Contacts | None:
        """Line loads as so many contacts, apart where that leaves the narrowest ones."""
        places, normal = self._places, loads[:, 0]
        kept = np.flatnonzero(normal > SMALL * normal.sum())
        if len(kept) < count:
            return None
        ends = _groups(places[kept], normal[kept], count)
        forces, geometry = np.zeros((count, 2)), np.zeros((count, GEOMETRY))
        for k, own in enumerate(np.split(kept, ends)):
            force = loads[own].sum(axis=0)
            place = normal[own] @ places[own] / force[0]
            variance = normal[own] @ np.square(places[own] - place) / force[0]
            wider = np.sqrt(max(variance / variances(self.skin.drawn), 1.0))
            forces[k] = force
            geometry[k] = self.skin.drawn
            geometry[k, :FIRST_SHAPE] = place, wider * self.skin.drawn[WIDTH]
        strong = forces[:, 0] > WEAK_SHARE * forces[:, 0].max()
        return Contacts(forces[strong], self.skin.limited(geometry[strong]))

    def fitted(self, contacts: Contacts, phase: Array) -> Contacts:
        """The contacts, near some, whose phase is likeliest to be a candidate's.

        Gauss-Newton steps in forces and geometry, with what is known of both before a frame; a step
        that leaves more is halved.  They stay in the friction cone.

        Parameters
        ----------
        contacts : Contacts
            Where to start.
        phase : ndarray, shape (m,)
            At the nodes [rad].
        """
        skin, known = self.skin.plain, self._certainty(phase)
        count, push = contacts.forces.size, contacts.forces[:, 0].sum()
        if not push > 0:  # pulling is no start
            return contacts
        best, least = contacts, np.inf
        for _ in range(FIT_STEPS):
            model, unknowns = skin.frame(contacts)
            own = np.r_[:count, model.at.fields : model.at.fields + contacts.geometry.size]
            fields = model.fields[: contacts.geometry.size]
            rows = np.concatenate([model.moments.reshape(count, -1), fields])
            precision, now = skin.prior(model, push).precision[own], unknowns[own]
            left = phase - model.fixed - now @ rows
            loss = float(known @ np.square(left) + precision @ np.square(now))
            if loss > least:
                contacts = between(skin, best, contacts)
                continue
            best, gained, least = contacts, least - loss, loss
            if gained < NEGLIGIBLE_LOSS:
                break
            normal = (rows * known) @ rows.T + np.diag(precision)
            unknowns[own] += np.linalg.solve(normal, rows @ (known * left) - precision * now)
            after = skin.contacts(model, unknowns)
            pushed = np.maximum(after.forces[:, 0], SMALL * push)
            most = skin.friction * pushed
            forces = np.column_stack([pushed, np.clip(after.forces[:, 1], -most, most)])
            contacts = limited_step(skin, contacts, Contacts(forces, after.geometry))
        return best


def _spread(places: Array, weights: Array) -> float:
    mean = weights @ places / weights.sum()
    return float(np.sqrt(weights @ np.square(places - mean) / weights.sum()))


def _groups(places: Array, weights: Array, count: int) -> Index:
    """Where to part a row of weights so that the parts are narrowest, by dynamic programming."""
    n = len(places)
    w, x, q = (
        np.concatenate([[0.0], np.cumsum(part)])
        for part in (weights, weights * places, weights * np.square(places))
    )
    start, end = np.meshgrid(np.arange(n), np.arange(1, n + 1), indexing="ij")
    mass = np.maximum(w[end] - w[start], 1e-30)
    cost = q[end] - q[start] - np.square(x[end] - x[start]) / mass
    cost = np.where(end > start, cost, np.inf)  # [i, j]: part of i to j
    best, parts = cost[0].copy(), []
    for _ in range(count - 1):
        total = best[:-1, None] + cost[1:]
        parts.append(total.argmin(axis=0))
        best = total.min(axis=0)
    cuts, last = [], n - 1
    for part in reversed(parts):
        last = int(part[last])
        cuts.append(last + 1)
    return np.array(cuts[::-1], dtype=np.intp)
