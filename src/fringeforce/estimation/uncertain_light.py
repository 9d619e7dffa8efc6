"""Loads of a frame whose light is uncertain where no fringe shows how bright it is.

Where the phase meets no multiple of pi that shows the brightest or the darkest light, the loads go
with the light: a dimmer one asks for a larger phase, more so the nearer that comes to the extreme,
and the posterior is bent.  There loads and everything else are fitted again for some values of the
light, and what they are is a sum over these (Laplace's approximation of each, as of nuisances in
Rue, Martino and Chopin, J. R. Stat. Soc. B 71, 319, 2009).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.special import softmax

from fringeforce.estimation.frame_climb import CONVERGED, climb
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.frame_model import FrameModel
from fringeforce.estimation.hypotheses import mixture
from fringeforce.estimation.linearised_frame import Linearised, linearise

Array = NDArray[np.float64]

BENT_SHARE = 0.1
"""Share of the variance of some loads that has to come with the light: from less no valley bends
that is wide."""
TOLD = 0.005
"""Relative deviation of the light below which it is told: it moves the phase near an extreme, where
light is quadratic in it, by a tenth of a radian."""
STRIDE, STRIDES = 0.6, 5
"""Steps of the light, in its standard deviations, and how many to either side: three deviations.
A sum over a normal density in such steps is its integral, to rounding."""
CLIMB_STEPS = 10
"""Most steps of a climb from one value of the light to the next."""
DIMMEST = 0.1
"""Share of the light as drawn below which none is tried: there is no light without any."""
UNLIKELY = 15.0
"""Loss above the least at which a value of the light has no weight: exp(-7.5), less than a part in
a thousand."""


class Relit(NamedTuple):
    """What uncertain light does to the loads of an explanation.

    Attributes
    ----------
    offset : ndarray, shape (2n,)
        Mean of the loads beside those of the top [N].
    covariance : ndarray, shape (2n, 2n)
        Their covariance beside Laplace's, nowhere negative [N^2].
    ends : ndarray, shape (k, size)
        Unknowns at the last values of the light, from where another explanation may be near.
    """

    offset: Array
    covariance: Array
    ends: Array


def light_direction(model: FrameModel, covariance: Array) -> tuple[Array, float] | None:
    """Modes of the light that loads go with most, shape (s,), and their deviation; none if little.

    Parameters
    ----------
    model : FrameModel
        What makes frames.
    covariance : ndarray, shape (size, size)
        Of all unknowns.

    Returns
    -------
    direction : ndarray, shape (s,)
        Of unit length; s modes change amplitude or offset.
    deviation : float
        Of the light along it where its other modes are known, in deviations as drawn.
    """
    at = model.at
    lit = np.flatnonzero(model.brightness.any(axis=1) | model.darkness.any(axis=1))
    if not len(lit):
        return None
    own = covariance[np.ix_(at.modes + lit, at.modes + lit)]
    cross = covariance[at.modes + lit, : at.loads]
    shared = cross @ np.linalg.solve(covariance[: at.loads, : at.loads], cross.T)
    shares, combined = eigh(shared, own)
    direction = np.zeros(len(model.brightness))
    direction[lit] = own @ combined[:, -1]
    direction /= np.linalg.norm(direction)
    deviation = 1 / np.sqrt(direction[lit] @ np.linalg.solve(own, direction[lit]))
    dark = np.abs(direction @ model.darkness).max() / model.amplitude.mean()
    size = max(np.abs(direction @ model.brightness).max(), dark)
    if shares[-1] < BENT_SHARE or deviation * size < TOLD:
        return None
    return direction, float(deviation)


def _lit(model: FrameModel, direction: Array, value: float) -> FrameModel:
    """What makes frames of a known value of the light in one direction of its modes, shape (s,)."""
    channels, nodes = len(model.bias), len(model.fixed)
    pixels = len(model.amplitude) // channels
    bright, dark = direction @ model.brightness, direction @ model.darkness
    begin = model.first + np.repeat(np.arange(channels) * nodes, pixels)
    seen = begin[:, None] + np.arange(4)
    free = np.eye(len(direction)) - np.outer(direction, direction)
    return model._replace(
        amplitude=model.amplitude * (1 + value * (model.weights * bright[seen]).sum(axis=1)),
        offset=model.offset + value * (model.weights * dark[seen]).sum(axis=1),
        brightness=free @ model.brightness / (1 + value * bright),
        darkness=free @ model.darkness,
    )


class _Refitted(NamedTuple):
    """What explains a frame at a known value of the light in one direction.

    Attributes
    ----------
    unknowns : ndarray, shape (size,)
        The top there.
    loss : float
        Twice the negative logarithm of its posterior, less a constant.
    hessian : ndarray, shape (size, size)
        Half the second derivative of that, at this light.
    """

    unknowns: Array
    loss: float
    hessian: Array

    def evidence(self, counted: NDArray[np.bool_]) -> float:
        """Logarithm of the posterior mass of some unknowns at this light, less a constant."""
        own = self.hessian[np.ix_(counted, counted)]
        return -float(np.linalg.slogdet(own)[1] + self.loss) / 2


def _refitted(
    model: FrameModel, prior: Prior, frame: Array, start: Array, direction: Array, value: float
) -> _Refitted:
    """What a start leads to at a known value of the light in a direction of its modes."""
    known, modes = _lit(model, direction, value), model.at.modes + np.arange(len(direction))
    start = start.copy()
    start[modes] -= direction * (direction @ start[modes])
    unknowns, loss = climb(known, prior, frame, start, 1.0, CLIMB_STEPS, CONVERGED)[:2]
    about = Linearised(*linearise(known, prior, frame, unknowns))
    unknowns = unknowns.copy()
    unknowns[modes] += direction * value
    return _Refitted(unknowns, loss + value**2, about.hessian)


def _needed(covariance: Array, unknowns: Array, loads: int) -> NDArray[np.bool_]:
    """All unknowns but the loads of contacts that are no larger than their deviations, (size,).

    As many loads as a drawing has tactels widen under a dimmer light, whether a frame asks for them
    or not, and their volume would speak for it.  Priors of each contact as wide as its own force
    take out those it does not ask for (MacKay, ASHRAE Trans. 100, 1053, 1994).
    """
    counted = np.ones(len(unknowns), dtype=bool)
    square = np.square(unknowns[:loads]) / covariance.diagonal()[:loads]
    counted[:loads] = np.repeat(square.reshape(-1, 2).mean(axis=1) > 1, 2)
    return counted


def relit(model: FrameModel, prior: Prior, frame: Array, unknowns: Array) -> Relit | None:
    """What uncertain light does to the loads about a top; none if they hardly go with it.

    Parameters
    ----------
    model, prior, frame
        As of `climb`.
    unknowns : ndarray, shape (size,)
        The top.
    """
    at = model.at
    laplace = np.linalg.inv(linearise(model, prior, frame, unknowns)[0])
    if (found := light_direction(model, laplace)) is None:
        return None
    direction, deviation = found
    modes = slice(at.modes, at.modes + len(direction))
    begin = float(direction @ unknowns[modes])
    top = _refitted(model, prior, frame, unknowns, direction, begin)
    slope = laplace[:, modes] @ np.linalg.solve(laplace[modes, modes], direction)
    points, ends, bright = [top], list[Array](), direction @ model.brightness
    for step in (-STRIDE * deviation, STRIDE * deviation):
        here, ahead = top, top.unknowns + step * slope
        for number in range(1, STRIDES + 1):
            before, value = here, begin + number * step
            if (1 + value * bright).min() < DIMMEST:
                break
            here = _refitted(model, prior, frame, ahead, direction, value)
            points.append(here)
            if here.loss > top.loss + UNLIKELY:
                break
            ahead = 2 * here.unknowns - before.unknowns
        ends.append(here.unknowns)
    counted = _needed(laplace, unknowns, at.loads)
    shares = softmax([one.evidence(counted) for one in points])
    means = np.array([one.unknowns[: at.loads] for one in points])
    alone = [np.linalg.inv(one.hessian)[: at.loads, : at.loads] for one in points]
    mean, covariance = mixture(shares, means, np.array(alone, dtype=float))
    own = laplace[: at.loads, : at.loads]
    sizes, axes = eigh(covariance - own, own)
    root = own @ axes
    wider = (root * np.maximum(sizes, 0.0)) @ root.T
    return Relit(mean - unknowns[: at.loads], wider, np.array(ends))
