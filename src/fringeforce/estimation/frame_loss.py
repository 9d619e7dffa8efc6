"""The loss of a frame: twice the negative logarithm of the posterior of all its unknowns.

The unknowns are those of a `FrameModel`.  Pixels are Gaussian about their level, clipped, or broken
with a small probability; contacts push, within the friction cone.
"""

from __future__ import annotations

from math import erfc
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import apart, sums, sums_entry
from fringeforce.estimation.frame_exposure import fill_exposure, workspace

Array = NDArray[np.float64]

SOUND = 2.5
"""Standard deviations within which a pixel counts as sound; it is broken once in a thousand."""


class Prior(NamedTuple):
    """What is known of the unknowns before a frame: normal, and contacts push.

    Attributes
    ----------
    mean, precision : ndarray, shape (size,)
        Of the unknowns.
    friction : float
        Largest |tangential| / normal force; negative if any.
    yielding : float
        Force by which a contact may miss the friction cone at one standard deviation [N].
    joint : ndarray, shape (size, size)
        Precision of unknowns together, beside that of each; empty if none is known together.
    """

    mean: Array
    precision: Array
    friction: float
    yielding: float
    joint: Array = np.empty((0, 0))


@sums
def _log_normal_cdf(x):
    if x > -10:
        return np.log(0.5 * erfc(-x / np.sqrt(2.0)))
    # the asymptotic series, to 1e-4 there
    return -0.5 * x * x - np.log(-x) - 0.5 * np.log(2 * np.pi) + np.log1p(-1 / (x * x))


@sums
def pixel_loss(model, frame, level, sigma):
    """Loss of one pixel, half its derivative by the level and half its second one, in sigmas.

    Most pixels are Gaussian about their level, and a share of them shows anything: the loss is that
    of the mixture.  A clipped pixel has the likelihood that noise carries it past the limit (Tobin,
    Econometrica 26, 24-36, 1958).
    """
    side = limit = 0.0
    if frame <= model.floor:
        side, limit = -1.0, model.floor + 0.5
    elif frame >= model.ceiling:
        side, limit = 1.0, model.ceiling - 0.5
    if side != 0.0:
        beyond = side * (level - limit) / sigma
        log_chance = _log_normal_cdf(beyond)
        hazard = np.exp(-0.5 * beyond * beyond - log_chance) / np.sqrt(2 * np.pi)
        return -2 * log_chance, -side * hazard, hazard * (hazard + beyond)
    left = (level - frame) / sigma
    if abs(left) < SOUND:
        return left * left, left, 1.0
    good = (1 - model.broken) * np.exp(-0.5 * left * left)
    bad = model.broken * np.sqrt(2 * np.pi) * sigma / model.full_scale
    share = good / (good + bad)
    return -2 * np.log(good + bad), share * left, share


@sums_entry
def prior_loss(prior, loads, unknowns, heat):
    """What the prior adds to the loss of unknowns, of which the first are so many loads."""
    total = 0.0
    for k in range(len(unknowns)):
        total += prior.precision[k] * (unknowns[k] - prior.mean[k]) ** 2
    for k in range(len(prior.joint)):
        part = 0.0
        for x in range(len(unknowns)):
            part += prior.joint[k, x] * (unknowns[x] - prior.mean[x])
        total += (unknowns[k] - prior.mean[k]) * part
    for j in range(loads // 2):
        normal, tangential = unknowns[2 * j], unknowns[2 * j + 1]
        if prior.friction < 0:
            total += (min(normal, 0.0) / prior.yielding) ** 2 / heat
        else:
            for side in (-1.0, 1.0):
                miss = min(prior.friction * normal + side * tangential, 0.0)
                total += (miss / prior.yielding) ** 2 / heat
    return total


@apart
def frame_loss(model, prior, frame, unknowns, level, sigma, heat):
    """Twice the negative logarithm of the posterior, less a constant."""
    total = prior_loss(prior, model.at.loads, unknowns, heat)
    for p in range(len(frame)):
        if np.isfinite(frame[p]):
            total += pixel_loss(model, frame[p], level[p], sigma[p])[0]
    return total


@apart
def weighed_squares(model, frame, level):
    """Weighted sum of squared residuals in units of the noise, sum of the weights, broken pixels.

    Light that is clipped says less, so that it weighs less, but it is not broken.
    """
    sigma = np.sqrt(model.variance)
    square = count = broken = 0.0
    for p in range(len(frame)):
        if np.isfinite(frame[p]):
            _, pull, weight = pixel_loss(model, frame[p], level[p], sigma[p])
            if weight > 0:
                square += pull * pull / weight
                count += weight
            if model.floor < frame[p] < model.ceiling:
                broken += 1 - weight
    return square, count, broken


@apart
def add_cone(prior, loads, unknowns, heat, cone, gradient):
    """Fill in what the cone adds to the Hessian, and add to the gradient."""
    cone[:] = 0.0
    stiff = 1 / (prior.yielding**2 * heat)
    for j in range(loads // 2):
        a, b = 2 * j, 2 * j + 1
        if prior.friction < 0:
            if unknowns[a] < 0:
                cone[a, a] += stiff
                gradient[a] += stiff * unknowns[a]
            continue
        for side in (-1.0, 1.0):
            miss = prior.friction * unknowns[a] + side * unknowns[b]
            if miss < 0:
                gradient[a] += stiff * prior.friction * miss
                gradient[b] += stiff * side * miss
                cone[a, a] += stiff * prior.friction**2
                cone[b, b] += stiff
                cone[b, a] += stiff * side * prior.friction
                cone[a, b] += stiff * side * prior.friction


@sums_entry
def loss_at(model, prior, frame, unknowns):
    """The loss at a point, and its parts; parameters as of `linearise`.

    Returns
    -------
    loss : float
        Twice the negative logarithm of the posterior, less a constant.
    square, count : float
        Weighted sum of squared residuals in units of the noise, and sum of the weights.
    """
    work = workspace(model)
    fill_exposure(model, unknowns, work)
    loss = frame_loss(model, prior, frame, unknowns, work[4], np.sqrt(model.variance), 1.0)
    square, count, _ = weighed_squares(model, frame, work[4])
    return loss, square, count


@sums_entry
def pulls_at(model, frame, unknowns):
    """Half the derivative of the loss by each grey level, shape (P,), in deviations of the noise.

    That is the residual of a sound pixel, and zero where a pixel is not used; parameters as of
    `linearise`.
    """
    work, sigma = workspace(model), np.sqrt(model.variance)
    fill_exposure(model, unknowns, work)
    pulls = np.zeros(len(frame))
    for p in range(len(frame)):
        if np.isfinite(frame[p]):
            pulls[p] = pixel_loss(model, frame[p], work[4][p], sigma[p])[1]
    return pulls
