"""Creep: what earlier loads add to the light of a strip whose layers relax.

Stresses under given forces depend on the ratio of the layers' moduli alone, so that layers that
relax alike keep them (correspondence principle; Christensen, Theory of Viscoelasticity, 1982,
section 2.1).  Strains do not stay: with the relaxation m(s) = 1 - sum_k g_k / (1 + s tau_k) of the
modulus, the phase by the strain-optic law is Psi (f / m), and by partial fractions

    1 / m = 1 + sum_k c_k / (1 + s / r_k),
    p = Psi (f + sum_k c_k z_k),    dz_k / dt = r_k (f - z_k),

with the zeros -r_k of m.  By the stress-optic law the phase does not creep.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import lfilter

from fringeforce.base.arrays import Array, numbers
from fringeforce.base.errors import InputError
from fringeforce.design.strip import Transducer

EVEN = 1e-6
"""Range of the steps over their mean up to which times are evenly spaced."""


@dataclass(frozen=True, eq=False)
class Creep:
    """What lags behind loads.

    Attributes
    ----------
    amounts : ndarray, shape (K,)
        c_k: what each lag adds under a load that lasts, over the load.
    rates : ndarray, shape (K,)
        r_k [1/s].
    """

    amounts: Array
    rates: Array

    @classmethod
    def of(cls, transducer: Transducer) -> Creep:
        """Of a strip's relaxation; none by the stress-optic law, or without relaxation."""
        terms = transducer.relaxation
        if not terms or transducer.photoelastic.effect == "stress_optic_coefficient":
            return cls(np.empty(0), np.empty(0))
        return cls.retarding(*np.array([(term.share, term.time) for term in terms]).T)

    @classmethod
    def retarding(cls, shares: Array, times: Array) -> Creep:
        """Of the shares g_k and the times tau_k [s] of a relaxation.

        With D = diag(1 / tau) and v = sqrt(g / tau) the relaxation is m = 1 - v' (s + D)^-1 v, and
        1 / m = 1 + v' (s + D - v v')^-1 v (Sherman and Morrison), which eigenvectors take apart.
        """
        root = np.sqrt(shares / times)
        rates, vectors = np.linalg.eigh(np.diag(1 / times) - np.outer(root, root))
        return cls(np.square(root @ vectors) / rates, rates)

    def passed(self, lags: Array, before: Array, now: Array, interval: float) -> Array:
        """Lags after a ramp from one load to the next, exactly.

        Parameters
        ----------
        lags : ndarray, shape (K, ...)
            z_k at its beginning.
        before, now : ndarray, shape (...)
            Loads, or phases, at its beginning and its end.
        interval : float
            Its length [s].
        """
        kept, own, new = (part.reshape(-1, *[1] * np.ndim(now)) for part in self.weights(interval))
        return kept * lags + own * before + new * now

    def weights(self, interval: float) -> tuple[Array, Array, Array]:
        """What lags, load before and load now count after an interval, shapes (K,)."""
        far = self.rates * interval
        kept = np.exp(-far)
        mean = np.where(far > 1e-9, -np.expm1(-far) / np.maximum(far, 1e-300), 1 - far / 2)
        return kept, mean - kept, 1 - mean

    def added(self, times: Array, values: Array) -> Array:
        """What lags add to values that are linear from one time to the next, at rest before them.

        Parameters
        ----------
        times : ndarray, shape (F,)
            Ascending [s].
        values : ndarray, shape (F, ...)
            Loads, or the phases that they cause at once.
        """
        found, lags = np.zeros_like(values), np.zeros((len(self.rates), *values.shape[1:]))
        steps = np.diff(times)
        if len(steps) and np.ptp(steps) < EVEN * steps.mean():
            for amount, kept, own, new in zip(
                self.amounts, *self.weights(float(steps.mean())), strict=True
            ):
                rest = -new * values[:1]
                found += amount * lfilter([new, own], [1.0, -kept], values, axis=0, zi=rest)[0]
            return found
        for k in range(1, len(values)):
            lags = self.passed(lags, values[k - 1], values[k], float(times[k] - times[k - 1]))
            found[k] = np.tensordot(self.amounts, lags, 1)
        return found


def checked_times(times: ArrayLike, frames: int) -> Array:
    """Times of frames, shape (F,) [s].

    Raises
    ------
    InputError
        If they are not as many as frames, not finite, or descend.
    """
    found = numbers(times, "times")
    if found.shape != (frames,):
        raise InputError(f"times of shape {found.shape} do not fit {frames} frames; give one each.")
    if not np.isfinite(found).all() or (np.diff(found) < 0).any():
        raise InputError("times have to be finite and must not descend.")
    return found
