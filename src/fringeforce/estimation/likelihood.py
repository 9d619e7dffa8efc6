"""How likely grey levels are, given the phase: noise, rounding and clipping."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

Array = NDArray[np.float64]

NO_BIAS = 1e-3
"""Sine of a bias below which it counts as none or as half a turn."""


@dataclass(frozen=True, eq=False)
class Response:
    """From phase to grey levels, equation (13), and what the converter hides.

    Attributes
    ----------
    amplitude, offset : float or ndarray, shape (P,)
        A and I_o, grey levels; of all pixels or of each.
    variance : float or ndarray, shape (P,)
        Of all pixels or each, noise and rounding together, squared grey levels.
    floor, ceiling : float
        Grey levels at or beyond which a pixel only says 'this dark' or 'this bright'; infinite
        where the converter clips nothing.
    bias : float or ndarray, shape (P,)
        Phase that the polariscope adds to the strip's [rad]; none in a dark field.
    shares : ndarray, shape (C, C)
        Cross-talk: of the fringes of every channel in those of each, whose pixels stand in turn;
        shape (0, 0) without.
    """

    amplitude: float | Array
    offset: float | Array
    variance: float | Array
    floor: float = -np.inf
    ceiling: float = np.inf
    bias: float | Array = 0.0
    shares: Array = field(default_factory=lambda: np.empty((0, 0)))

    def level(self, phase: Array) -> Array:
        """Expected grey level before clipping."""
        return self.amplitude * self.brightness(phase) + self.offset

    def brightness(self, phase: Array) -> Array:
        """Normalised intensity, cross-talk included; the last axis is that of pixels."""
        return self._mixed(np.sin((phase + self.bias) / 2) ** 2)

    def _mixed(self, light: Array) -> Array:
        """Light of all channels, shape (..., P), with that of others in each."""
        if not len(self.shares):
            return light
        lines = light.reshape(*light.shape[:-1], len(self.shares), -1)
        return (self.shares @ lines).reshape(light.shape)

    def at(self, pixels: NDArray[Any] | slice) -> Response:
        """Response of some pixels only, by a mask, by numbers or by a slice; without cross-talk."""
        own = {name: getattr(self, name) for name in ("amplitude", "offset", "variance", "bias")}
        some = {n: v[pixels] if isinstance(v, np.ndarray) else v for n, v in own.items()}
        return replace(self, **some, shares=np.empty((0, 0)))

    @cached_property
    def even(self) -> bool:
        """Whether a phase and its negative give the same level everywhere."""
        return bool(np.all(np.abs(np.sin(self.bias)) < NO_BIAS))

    def slope(self, phase: Array) -> Array:
        """Derivative of the grey level by the phase; without cross-talk."""
        return self.amplitude / 2 * np.sin(phase + self.bias)

    def jacobian(self, phase: Array, influence: Array) -> Array:
        """What phases that change change in the grey levels, shape (P, m).

        Parameters
        ----------
        phase : ndarray, shape (P,)
            Phase [rad].
        influence : ndarray, shape (P, m)
            Its change with each of m unknowns.
        """
        turned = np.sin(phase + self.bias) * influence.T
        return np.asarray((self.amplitude / 2 * self._mixed(turned)).T)


@dataclass(frozen=True, eq=False)
class Misfit:
    """A frame against expected grey levels, pixel by pixel, in units of the noise.

    Attributes
    ----------
    loss : float
        Twice the negative logarithm of the likelihood, less a constant.
    slope : ndarray, shape (P,)
        Half the derivative of the loss by the expected level: the residual, for ordinary pixels.
    weight : ndarray, shape (P,)
        Half the second derivative: one, for ordinary pixels.
    """

    loss: float
    slope: Array
    weight: Array


def misfit(frame: Array, level: Array, response: Response) -> Misfit:
    """Compare a frame with expected grey levels.

    A clipped pixel has the likelihood that noise carries it past the limit (Tobin, Econometrica 26,
    24-36, 1958); all others are Gaussian with the variance of noise and rounding.
    """
    sigma = np.broadcast_to(np.sqrt(response.variance), level.shape)
    slope = (level - frame) / sigma
    loss, weight = float(np.vdot(slope, slope)), np.ones_like(slope)
    for hidden, sign, limit in (
        (frame <= response.floor, -1.0, response.floor + 0.5),
        (frame >= response.ceiling, 1.0, response.ceiling - 0.5),
    ):
        if not hidden.any():
            continue
        beyond = sign * (level[hidden] - limit) / sigma[hidden]
        log_chance = log_ndtr(beyond)
        hazard = np.exp(-0.5 * beyond**2 - log_chance) / np.sqrt(2 * np.pi)
        loss += float(-2 * log_chance.sum() - slope[hidden] @ slope[hidden])
        slope[hidden] = -sign * hazard
        weight[hidden] = hazard * (hazard + beyond)
    return Misfit(loss, slope, weight)
