"""Creep: what earlier loads add to the light of a strip whose layers relax.

Stresses under given forces depend on the ratio of the layers' moduli alone, so that layers that
relax alike keep them (correspondence principle; Christensen, Theory of Viscoelasticity, 1982,
section 2.1).  Strains do not stay: with the relaxation m(s) = 1 - sum_k g_k / (1 + s tau_k) of the
modulus, the phase by the strain-optic law is Psi (f / m), and by partial fractions

    1 / m = 1 + sum_k c_k / (1 + s / r_k),
    p = Psi (f + sum_k c_k z_k),    dz_k / dt = r_k (f - z_k),

with the zeros -r_k of m.  By the stress-optic law the phase does not creep.

Layers that relax unlike, by m_1 of the cover and m_2 of the clear layer, turn the influence matrix
as their ratio q = m_1 / m_2 does: p = Psi(q) f / m_2, with q an operator in time.  Psi is a
polynomial in q - 1 to far below the noise, and q - 1 a sum of lags, whose powers are lags of lags.
What the photoelastic effect itself gains is one more factor, 1 + sum_k o_k / (1 + s tau_k).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array, numbers
from fringeforce.base.errors import InputError
from fringeforce.design.pad import Pad, PadTransducer
from fringeforce.design.parts import RelaxationTerm
from fringeforce.design.strip import Sensor, Transducer
from fringeforce.models.presses import are_presses

AnySensor = TypeVar("AnySensor", Sensor, Pad)

DECADE = np.log(10.0)
"""Distance on the logarithm of time to the neighbours of a single term."""
RATE_GAP = 1e-7
"""Share by which rates are moved apart that would be equal, far below what creep is known to."""
EVEN_STEPS = 1e-6
"""Range of the steps over their mean up to which times are evenly spaced."""
TERMS = (
    "transducer.relaxation",
    "transducer.compliant.relaxation",
    "transducer.photoelastic.relaxation",
    "transducer.photoelastic.optical_creep",
)
"""Paths of what makes a strip creep."""


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

    @property
    def ripple(self) -> float:
        """Standard deviation of what so few terms miss of creep that goes on evenly, over it.

        Materials creep evenly with the logarithm of time t, terms of equal amounts at distances h
        of it in steps.  By Poisson's summation their sum differs from a line by waves, the longest
        of which has the amplitude 2 |Gamma(2 pi i / h)| / h of a term; |Gamma(iy)|^2 is
        pi / (y sinh(pi y)) (Abramowitz and Stegun, 6.1.29).
        """
        if not len(self.rates):
            return 0.0
        apart = np.ptp(np.log(self.rates)) / (len(self.rates) - 1) if len(self.rates) > 1 else 0.0
        apart = apart or DECADE
        y = min(2 * np.pi / apart, 100.0)  # closer terms leave less than a double number holds
        wave = np.sqrt(2 * np.pi / (y * np.sinh(np.pi * y))) / apart
        return float(wave / len(self.rates))

    @classmethod
    def of(cls, transducer: Transducer | PadTransducer) -> Creep:
        """Of the clear layer's relaxation by the strain-optic law, and of its optical creep."""
        clear = transducer.photoelastic
        by_strain = clear.effect == "strain_optic_coefficient"
        found = cls.retarding(*_shares(transducer.relaxations[1] if by_strain else ()))
        if not clear.optical_creep:
            return found
        shares, times = _shares(clear.optical_creep)
        return found.after(cls(shares, 1 / times))

    @classmethod
    def of_ratio(cls, transducer: Transducer) -> Creep:
        """Of the compliant over the photoelastic modulus; none if both relax alike."""
        one, other = transducer.relaxations
        if one == other:
            return cls(np.empty(0), np.empty(0))
        shares, times = _shares(one)
        return cls.retarding(*_shares(other)).after(cls(-shares, 1 / times))

    def after(self, other: Creep) -> Creep:
        """The product of 1 + lags of both, by partial fractions, whose lags are of single poles.

        Of rates a and b, 1 / ((1 + s/a) (1 + s/b)) = (b / (1 + s/a) - a / (1 + s/b)) / (b - a).
        """
        a, b = self.rates[:, None], other.rates[None, :] * (1 + RATE_GAP)
        both = np.multiply.outer(self.amounts, other.amounts) / (b - a)
        own = self.amounts + (both * b).sum(axis=1)
        its = other.amounts - (both * a).sum(axis=0)
        return Creep(np.concatenate([own, its]), np.concatenate([self.rates, b[0]]))

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
        from scipy.signal import lfilter  # takes half a second, so only where a strip creeps

        found, steps = np.zeros_like(values), np.diff(times)
        if len(steps) and np.ptp(steps) < EVEN_STEPS * steps.mean():
            for amount, kept, own, new in zip(
                self.amounts, *self.weights(float(steps.mean())), strict=True
            ):
                rest = -new * values[:1]
                found += amount * lfilter([new, own], [1.0, -kept], values, axis=0, zi=rest)[0]
            return found
        for k, (_, added) in enumerate(self.each(times, values)):
            found[k] = added
        return found

    def each(self, times: Array, values: Iterable[Array]) -> Iterator[tuple[Array, Array]]:
        """Values, and what lags add to each, as of `added`; one after the other, for large ones.

        Parameters
        ----------
        times : ndarray, shape (F,)
            Ascending [s].
        values : iterable of ndarray, shape (...)
            Of each time.
        """
        lags, before, last = np.empty(0), np.empty(0), 0.0
        for number, (time, value) in enumerate(zip(times.tolist(), values, strict=True)):
            if number:
                lags = self.passed(lags, before, value, time - last)
            else:
                lags = np.zeros((len(self.rates), *value.shape))
            before, last = value, time
            yield value, np.tensordot(self.amounts, lags, 1)


class Crept(NamedTuple):
    """What creep of earlier loads adds to a frame.

    Attributes
    ----------
    left : ndarray, shape (...)
        What it adds to what loads cause: the phase at the nodes of a strip [rad], the harmonics of
        the tractions of a pad [N].
    modes : ndarray, shape (u, ...)
        Its change with a standard deviation of each value that is uncertain about it.
    """

    left: Array
    modes: Array


def lasting_forces(
    transducer: Transducer | PadTransducer, forces: Array, times: ArrayLike
) -> Array:
    """Forces that show at once what forces in a row show with creep.

    Parameters
    ----------
    transducer : Transducer or PadTransducer
        Whose layers relax alike.
    forces : ndarray, shape (F, n, components)
        Linear from one frame to the next [N].
    times : array_like, shape (F,)
        When the frames are exposed [s].
    """
    own = checked_times(times, len(forces))
    return forces + Creep.of(transducer).added(own, forces)


def crept_forces(pad: Pad, forces: Any, times: ArrayLike | None) -> Any:
    """Forces of tactels, shape (F, n, 3), that show at once what these show with creep.

    Parameters
    ----------
    pad : Pad
        The design.
    forces : array_like, shape (F, n, 3)
        Linear from one frame to the next [N].
    times : array_like, shape (F,), optional
        When the frames are exposed [s]; without, nothing creeps.

    Raises
    ------
    InputError
        If forces are not of frames in a row, or presses, or times do not fit.
    """
    if times is None:
        return forces
    if are_presses(forces):
        raise InputError(
            "A pad as built that creeps is simulated with forces on tactels; give forces of shape "
            "(F, n, 3), or the model of the drawing."
        )
    loads = np.asarray(forces, dtype=float)
    if loads.ndim != 3:
        raise InputError(f"times go with frames in a row, not with shape {loads.shape[:-2]}.")
    return lasting_forces(pad.transducer, loads, times)


def creeps(transducer: Transducer) -> bool:
    """Whether what loads do to the light changes while they last."""
    return any(len(found.rates) for found in (Creep.of(transducer), Creep.of_ratio(transducer)))


def without_creep(sensor: AnySensor) -> AnySensor:
    """The design of a sensor that neither relaxes nor creeps."""
    return sensor.replace(**dict.fromkeys(TERMS, ()))


def _shares(terms: tuple[RelaxationTerm, ...]) -> tuple[Array, Array]:
    """Shares and times [s] of terms, shapes (K,)."""
    found = np.array([(term.share, term.time) for term in terms], dtype=float).reshape(-1, 2)
    return found[:, 0], found[:, 1]


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
