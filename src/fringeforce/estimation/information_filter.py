"""Frames of a strip in a row: a filter whose hot loop moves the loads alone.

What lasts from frame to frame - places and widths of touched contacts, residual fields, design
values, visibility, blur, static light - is estimated now and then, with all unknowns, from one
frame and what earlier ones told (an extended information filter).  In between it stands still, and
only the loads are fitted (`followed_frames`).  What stands still has errors, and the covariance of
the loads includes them (Schmidt's consider filter: Advances in Control Systems 3, 293, 1966): it is
the loads' block of the joint posterior covariance.

Why it stands still: one frame leaves forces, places and widths uncertain together along curved
valleys.  Information of hundreds of frames, each linearised at another point of its valley, adds up
to more than all of them have told (Julier and Uhlmann, Proc. ICRA, 4238, 2001), and stated
deviations become a third of the true ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, pdtrik

from fringeforce.estimation.followed_frames import (
    AGEING,
    DONE,
    EMERGED,
    JUMP,
    follow_frames,
    standing_at,
)
from fringeforce.estimation.followed_point import MatrixErrors, Reference, Standing
from fringeforce.estimation.frame_climb import CONVERGED, climb
from fringeforce.estimation.frame_exposure import (
    influence_slopes,
    node_columns,
    node_phase,
    point_spread,
    shares_of_channels,
)
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.frame_model import FrameModel, as_seen
from fringeforce.estimation.hypotheses import NEGLIGIBLE_LOSS, MetPhases
from fringeforce.estimation.linearised_frame import (
    Linearised,
    banded,
    linearise,
    shared_information,
)
from fringeforce.estimation.phase_stretches import (
    Hidden,
    Stretches,
    close,
    crossed,
    emerged,
    motion,
    stretches_of,
    undecided_nodes,
)
from fringeforce.estimation.pixel_columns import Single, pixels_of
from fringeforce.estimation.posterior import Top, covariance_of_products, products
from fringeforce.estimation.residual_test import FALSE_ALARM

Array = NDArray[np.float64]
Images = Callable[[Top, NDArray[np.bool_]], Array]

FORGOTTEN = 0.2
"""Share of the variance of what lasts that is new in every linearisation: errors of earlier ones
are forgotten within five."""
RELEASED = 2.0
"""Deviations of its forces below which a contact counts as released, and its place and width as
those of another touch."""
RELINEARISED = 0.15
"""Change of the phase, root mean square, from which what lasts is estimated anew [rad]."""
REACHED, REACHED_ALONE = 0.1, 0.0005
"""Squared Mahalanobis distances to the top at which it is reached, over all loads together, what
lasts being known: where anything lasts, whose errors are larger, and where nothing does."""
DRIFT_FRAMES = 4096
"""Frames after which what may drift is looked at in any case: lamps drift in seconds."""
FAR_FROM_RIVAL = 2 * NEGLIGIBLE_LOSS
"""Loss that all mirror images have more, so that while the phase hardly moves none has weight."""
FAR_STEPS = 20
"""Most steps of a climb with all unknowns."""


class Undecided(NamedTuple):
    """What may be on either side of a multiple of pi.

    Attributes
    ----------
    nodes : ndarray of bool, shape (m,)
        Nodes of the phase.
    rival : ndarray, shape (size,), or None
        Unknowns of the likeliest explanation that has another phase there, if any was met.
    """

    nodes: NDArray[np.bool_]
    rival: Array | None = None


@dataclass
class InformationFilter:
    """What is known of the unknowns of a strip from frame to frame.

    Attributes
    ----------
    model : FrameModel
        What makes frames.
    prior : Prior
        What is known of a frame alone.
    lasts : ndarray of bool, shape (size,)
        Unknowns that last while contacts are touched: all but loads and light that drifts.
    used : ndarray of bool, shape (P,)
        Pixels that count.
    faint : float
        Phase that frames must reach [rad].
    hidden : Hidden
        What noise hides of a phase beside multiples of pi.
    unknowns : ndarray, shape (size,)
        Of the last frame.
    undecided : Undecided or None
        Of a frame that was not read because a stretch of its phase may be on either side of a
        multiple of pi.
    """

    model: FrameModel
    prior: Prior
    lasts: NDArray[np.bool_]
    used: NDArray[np.bool_]
    faint: float
    hidden: Hidden
    unknowns: Array
    undecided: Undecided | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        self._pixels, self._age = pixels_of(self.model, self.used), 0
        count = int(self.used.sum())
        self._squares = float(chdtri(count, FALSE_ALARM)) / count
        self._sums = float(chdtri(np.count_nonzero(self._pixels.even_out), FALSE_ALARM))
        self._broken = float(pdtrik(1 - FALSE_ALARM, self.model.broken * count))
        self._fresh, self._lasting = np.flatnonzero(~self.lasts), np.flatnonzero(self.lasts)
        self._reference: Reference | None = None
        self._standing: Standing | None = None
        self._spread = np.empty((0, 0))

    def begin(self, about: Linearised, spread: Array) -> None:
        """Begin after a frame that was read alone.

        Parameters
        ----------
        about : Linearised
            Its loss about its top.
        spread : ndarray, shape (size, size)
            Covariance of its unknowns.
        """
        stretches = stretches_of(node_phase(self.model, self.unknowns), self.hidden)
        self._refer(about, np.diag(self.prior.precision), spread, stretches)

    def hold(self, about: Linearised, spread: Array, still: bool, sums: float) -> None:
        """Begin after a frame that was read alone, and stay there: each frame takes one step.

        Parameters
        ----------
        about, spread
            As of `begin`; the step is that of the covariance, which allows for curvature.
        still : bool
            Whether loads stay as they are.
        sums : float
            Chance of noise at which sums over neighbouring pixels end it.
        """
        self.begin(about, spread)
        own, held = self._reference, self._standing
        assert own is not None
        assert held is not None
        gain = np.ascontiguousarray(spread[np.ix_(self._fresh, self._fresh)])
        size = np.count_nonzero(self._pixels.even_out)
        self._reference = own._replace(
            gain=0 * gain if still else gain,
            reached=np.inf,
            longest=float(chdtri(len(gain), FALSE_ALARM)),
            sums=own.sums if len(self._lasting) else float(chdtri(size, sums)),
            far=np.inf,
            faint=0.0,
        )
        held.state[:2] = 0.0, -np.inf

    def follow(
        self, frames: Single, loads: Array, std: Array, covariances: Array, squares: Array
    ) -> tuple[int, int]:
        """Read frames; see `follow_frames`."""
        assert self._reference is not None
        held = not np.isfinite(self._reference.reached)
        rest = len(frames) if held or not len(self._lasting) else DRIFT_FRAMES - self._age
        done, why = follow_frames(
            self.model, self._pixels, self._reference, self._standing, frames[:rest],
            self.unknowns, loads, std, covariances, squares,
        )  # fmt: skip
        self._age += done
        if why == EMERGED:
            assert self._standing is not None
            own = undecided_nodes(self._standing.nodes, self._reference.stretches.sides)
            self.undecided = Undecided(own)
        aged = why == DONE and done < len(frames)
        return done, AGEING if aged else why

    @property
    def covariance(self) -> Array:
        """Covariance of the loads of the last frame, shape (2n, 2n) [N^2]."""
        assert self._reference is not None
        return self._reference.covariance.copy()

    def renew(self, frame: Array, images: Images) -> Top | None:
        """Estimate everything from a frame, shape (P,), and what is known before it.

        Parameters
        ----------
        frame : ndarray, shape (P,)
            Grey levels; not finite where a pixel is not used.
        images : callable
            Starts, the likeliest first, in which the phase of a top is mirrored at nodes of a mask.

        Returns
        -------
        Top or None
            None if noise does not explain the frame, or a mirror image of what came out of it does
            as well.
        """
        prior = self._prior()
        mean, precision = prior.mean, prior.joint
        whole = np.ix_(self._lasting, self._lasting)
        start = self.unknowns.copy()
        top = Top(*climb(self.model, prior, frame, start, 1.0, FAR_STEPS, CONVERGED, np.inf))
        about = Linearised(*linearise(self.model, prior, frame, top.unknowns))
        off = (top.unknowns - mean)[self._lasting]
        told = np.eye(len(off)) - precision[whole] @ _inverse(about.hessian)[whole]
        misfit = top.square > self._squares * top.count
        misfit = misfit or top.broken > self._broken
        nodes, before = (  # as single as where frames are followed: loops compile once
            node_phase(self.model, at).astype(np.float32) for at in (top.unknowns, start)
        )
        misfit = misfit or np.abs(nodes - before).max() > JUMP
        misfit = misfit or motion(nodes, before) > self.hidden.difference
        if misfit or off @ precision[whole] @ off > _limit(told):
            return None
        known = self._reference
        assert known is not None
        sides, square = known.stretches.sides, known.stretches.square
        if crossed(nodes, sides, square, self.hidden):
            self.undecided = Undecided(undecided_nodes(nodes, sides), top.unknowns)
            return None
        if emerged(nodes, known.stretches, self.hidden, known.columns, known.known):
            own = undecided_nodes(nodes, sides)
            rise, rival = self._nearest_rival(top, prior, frame, images(top, own))
            if rise < NEGLIGIBLE_LOSS:
                self.undecided = Undecided(own, rival)
                return None
            close(nodes, known.stretches, self.hidden, rise >= FAR_FROM_RIVAL)
        self.unknowns[:] = top.unknowns
        self._linearised(about, prior)
        return top

    def _nearest_rival(
        self, top: Top, prior: Prior, frame: Array, starts: Array
    ) -> tuple[float, Array | None]:
        """The likeliest other phase that starts lead to: how much larger its loss is, and unknowns.

        Climbs end at one that has weight, and where they do not lead below `FAR_FROM_RIVAL`.
        """
        phase, least, rival = node_phase(self.model, top.unknowns), np.inf, None
        told, met = self.hidden.along(len(phase)), MetPhases()
        met.add(phase, told)
        for start in starts:
            image = node_phase(self.model, start)
            if met.holds(image):
                continue
            met.add(image, told)
            steps = FAR_STEPS, CONVERGED, top.loss + FAR_FROM_RIVAL
            found, loss, *_ = climb(self.model, prior, frame, start, 1.0, *steps)
            if loss < top.loss + least and self._apart(found, phase) > told:
                least, rival = loss - top.loss, found
            if least < NEGLIGIBLE_LOSS:
                break
        return least, rival

    def _apart(self, unknowns: Array, phase: Array) -> float:
        """Largest difference of the phase under unknowns from another, shape (m,) [rad]."""
        return float(np.abs(node_phase(self.model, unknowns) - phase).max())

    def _prior(self) -> Prior:
        """What is known before the next frame."""
        mean, known = self._before()
        precision = np.diag(self.prior.precision)
        precision[np.ix_(self._lasting, self._lasting)] = np.linalg.inv(known)
        return Prior(mean, 0 * mean, self.prior.friction, self.prior.yielding, precision)

    def _linearised(self, about: Linearised, prior: Prior) -> None:
        """Take a linearisation."""
        hessian = about.hessian
        if self.model.at.fields > self.model.at.place:
            hessian = hessian - self._second_order(about)
        assert self._reference is not None
        self._refer(about, prior.joint, _inverse(hessian), self._reference.stretches)

    def _before(self) -> tuple[Array, Array]:
        """Mean of all unknowns before the next frame, and covariance of what lasts."""
        at, loads = self.model.at, self.model.at.loads
        mean, known = np.sqrt(1 - FORGOTTEN) * self.unknowns, (1 - FORGOTTEN) * self._spread
        known[np.diag_indices(len(known))] += FORGOTTEN
        deviation = np.sqrt(np.diag(self._spread))[:loads]
        size = np.abs(self.unknowns[:loads] / deviation).reshape(-1, 2).max(axis=1)
        gone = np.zeros(at.size, bool)
        for begin, end in ((at.place, at.width), (at.width, at.fields)):
            if end > begin:
                gone[begin:end] = size < RELEASED
        known[gone], known[:, gone] = 0.0, 0.0
        known[gone, gone] = 1.0
        mean[gone] = 0.0
        mean[self._fresh] = self.prior.mean[self._fresh]
        return mean, known[np.ix_(self._lasting, self._lasting)]

    def _refer(self, about: Linearised, prior: Array, spread: Array, stretches: Stretches) -> None:
        """Take a linearisation, information before it, covariance after it, sides of the phase."""
        fresh, lasting, loads = self._fresh, self._lasting, self.model.at.loads
        data = about.hessian - prior
        own = data[np.ix_(fresh, fresh)] + np.diag(self.prior.precision[fresh])
        gain = _inverse(own)
        mixed = data[np.ix_(fresh, lasting)]
        through = gain @ mixed
        information = data[np.ix_(lasting, lasting)] - mixed.T @ through
        known = spread[np.ix_(lasting, lasting)]
        inner = np.eye(len(lasting)) + information @ known
        score = known @ np.linalg.inv(inner)
        drawn = _limit(information @ known)
        rest = self.unknowns.copy()
        rest[:loads] = 0.0
        self._spread, self._age = spread, 0
        columns, anchor = (
            node_columns(self.model, self.unknowns),
            node_phase(self.model, self.unknowns),
        )
        fixed = anchor - self.unknowns[:loads] @ columns[:loads]
        columns = np.pad(columns, ((0, -len(rest) % 4), (0, 0)))
        precision = np.zeros(len(columns))
        precision[loads : len(rest)] = self.prior.precision[loads:]
        self._reference = Reference(
            columns=columns.astype(np.float32),
            fixed=fixed.astype(np.float32),
            anchor=anchor.astype(np.float32),
            kernel=point_spread(self.model, rest).astype(np.float32),
            **self._crosstalk(rest),
            fresh=fresh,
            lasting=lasting,
            information=own,
            gain=gain,
            covariance=np.ascontiguousarray(spread[:loads, :loads]),
            errors=self._matrix_errors(about, gain, spread),
            stretches=stretches,
            known=precision,
            precision=self.prior.precision[fresh],
            mean=self.prior.mean[fresh],
            through=np.ascontiguousarray(through),
            score=(score + score.T) / 2,
            squares=self._squares,
            sums=np.inf if len(lasting) else self._sums,
            drawn=drawn,
            broken=self._broken,
            faint=self.faint,
            hidden=self.hidden,
            longest=np.inf,
            reached=REACHED if len(lasting) else REACHED_ALONE,
            far=RELINEARISED if len(lasting) else np.inf,
            size=float(np.sqrt(np.mean(np.square(self.unknowns[:loads:2])))),
        )
        self._standing = standing_at(self.unknowns, self._pixels, self._reference)

    def _matrix_errors(self, about: Linearised, gain: Array, spread: Array) -> MatrixErrors:
        model, at = self.model, self.model.at
        several = len(model.influence)
        own = slice(at.modes, at.modes + several)
        waves = influence_slopes(model, self.unknowns).reshape(-1, len(model.fixed))
        found = -gain[: at.loads] @ shared_information(model, about, waves)[self._fresh]
        found = found.reshape(at.loads, several, at.loads).swapaxes(0, 1)
        return MatrixErrors(
            self.unknowns[: at.loads].copy(),
            np.ascontiguousarray(found),
            np.ascontiguousarray(spread[own, : at.loads]),
            np.ascontiguousarray(spread[own, own]),
        )

    def _crosstalk(self, unknowns: Array) -> dict[str, Single]:
        """Shares of the light of channels in each other, of a `Reference`."""
        model, ratio = self.model, np.append(self.model.dispersion, 0.0)
        shares, leaks = shares_of_channels(model, unknowns), model.leaks
        turning = shares
        if len(shares):
            turning = shares * ratio / ratio[:-1, None]
            own = np.vstack([shares, np.append(np.zeros(len(shares)), 1.0)])
            leaks = leaks @ np.linalg.inv(own)  # of the fringes as seen, and of one
        parts = {"shares": shares, "turning": turning, "leaks": leaks}
        return {name: part.astype(np.float32) for name, part in parts.items()}

    def _second_order(self, about: Linearised) -> Array:
        """Information lost to products of errors of contacts; see `Posterior.spread`."""
        waves, one, other = products(self.model, self.unknowns)
        seen = as_seen(self.model)
        known = covariance_of_products(seen @ self._spread @ seen.T, one, other)
        cross = shared_information(self.model, about, waves)
        information = waves @ banded(about, waves).T
        return cross @ np.linalg.solve(np.eye(len(known)) + known @ information, known @ cross.T)


def _inverse(matrix: Array) -> Array:
    inverse = np.linalg.inv(matrix)
    return (inverse + inverse.T) / 2


def _limit(shares: Array) -> float:
    """Limit of a quadratic form that is a sum of chi-squares, weighted with a matrix's eigenvalues.

    The chi-square of equal mean and variance (Satterthwaite, Biometrics Bull. 2, 110, 1946).
    """
    mean, square = float(np.trace(shares)), float(np.sum(shares * shares.T))
    if not mean > 0:
        return np.inf
    return square / mean * float(chdtri(mean**2 / square, FALSE_ALARM))
