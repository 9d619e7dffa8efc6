"""Polarisers, plates and a birefringent strip by Jones calculus, and the fringes that they make.

Light runs along the strip's depth; angles are from the strip's length, x.  Whatever stands before
and behind a linear retarder of phase lead p along x, the light that passes is a constant plus a
cosine and a sine of p, which is A sin^2((p + bias) / 2) + offset: three numbers that reduce to
equation (11) for a perfect dark-field polariscope (Theocaris and Gdoutos, Matrix Theory of
Photoelasticity, Springer 1979, chapter 4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.arrays import Array

Jones = NDArray[np.complex128]


@dataclass(frozen=True)
class Fringe:
    """Light over phase lead, amplitude sin^2((p + bias) / 2) + offset.

    Attributes
    ----------
    amplitude, offset : float
        In units of what a perfect dark-field polariscope lets through at most.
    bias : float
        Phase lead that the arrangement adds to the strip's [rad].
    spread : float
        Standard deviation of the light's wave number, 1 / wavelength, over its mean.
    """

    amplitude: float = 1.0
    bias: float = 0.0
    offset: float = 0.0
    spread: float = 0.0

    def intensity(self, phase: ArrayLike) -> Array:
        """Light that passes at a phase lead [rad], same shape."""
        lead = np.asarray(phase, dtype=float)
        if self.spread:
            swing = self.contrast(lead) * np.cos(lead + self.bias)
            return self.amplitude * (1 - swing) / 2 + self.offset
        return self.amplitude * np.sin((lead + self.bias) / 2) ** 2 + self.offset

    def contrast(self, phase: ArrayLike) -> Array:
        """Share of the fringes that a spectrum leaves at a phase lead [rad], same shape.

        The phase is proportional to the wave number.  Over a Gaussian spectrum of the wave number
        the mean of cos(p k / k_0 + bias) is exp(-(p spread)^2 / 2) cos(p + bias): its Fourier
        transform (Born and Wolf, Principles of Optics, section 7.5.8).
        """
        return np.exp(-np.square(np.asarray(phase, dtype=float) * self.spread) / 2)

    def turned(self, lead: ArrayLike, cross: ArrayLike) -> Array:
        """Light that passes a retarder whose axis does not lie along x.

        Exact for perfect plates, between which a retardance d at an angle a shows itself as cos d
        and sin d cos 2a.

        Parameters
        ----------
        lead, cross : array_like, same shape
            d cos 2a and d sin 2a [rad].
        """
        along = np.asarray(lead, dtype=float)
        size = np.hypot(along, cross)
        sine = along * np.sinc(size / np.pi)
        swing = np.cos(size) * np.cos(self.bias) - sine * np.sin(self.bias)
        if self.spread:
            swing *= self.contrast(size)
        return self.amplitude * (1 - swing) / 2 + self.offset


def polariser(angle: float, extinction: float = 0.0) -> Jones:
    """A linear polariser, shape (2, 2).

    Parameters
    ----------
    angle : float
        Direction that passes [rad].
    extinction : float
        Share of the light that passes across it, zero if perfect.
    """
    return _turned(np.diag([1.0, np.sqrt(extinction)]).astype(complex), angle)


def retarder(retardance: ArrayLike, angle: float = 0.0) -> Jones:
    """A linear retarder, shape (..., 2, 2).

    Parameters
    ----------
    retardance : array_like, any shape
        Phase by which light along the axis leads light across it [rad].
    angle : float
        Direction of the axis [rad].
    """
    half = np.asarray(retardance, dtype=float)[..., None, None] / 2
    along, across = np.diag([1.0, 0.0]), np.diag([0.0, 1.0])
    return _turned(np.exp(1j * half) * along + np.exp(-1j * half) * across, angle)


def passed(before: Sequence[Jones], phase: ArrayLike, behind: Sequence[Jones]) -> Jones:
    """Share of natural light that passes elements, a strip of a phase lead, and more elements.

    Parameters
    ----------
    before, behind : sequence of ndarray, shape (2, 2)
        Elements in the order in which light meets them.
    phase : array_like, any shape
        Phase lead of the strip, axis along x [rad].

    Returns
    -------
    ndarray, same shape
        One if all light passes.
    """
    light = product(behind) @ retarder(phase) @ product(before)
    # natural light is an equal mixture of any two states that are at right angles
    return (np.abs(light) ** 2).sum(axis=(-2, -1)) / 2


def fringe(before: Sequence[Jones], behind: Sequence[Jones]) -> Fringe:
    """The fringe that an arrangement makes of a strip between its elements.

    A perfect polariser passes half of natural light at most, which counts as one.

    Parameters
    ----------
    before, behind : sequence of ndarray, shape (2, 2)
        Elements in the order in which light meets them.
    """
    start, quarter, half = 2 * passed(before, np.array([0.0, np.pi / 2, np.pi]), behind)
    mean, cosine = (start + half) / 2, (start - half) / 2
    sine = round(float(quarter - mean), 14)  # no bias at all, rather than one of the last digit
    size = round(float(np.hypot(cosine, sine)), 14)
    # size sin^2((p + bias)/2) is size/2 - size/2 cos(p + bias)
    bias = float(np.arctan2(sine, -cosine))
    return Fringe(2 * size, bias, max(round(float(mean) - size, 14), 0.0))


def _turned(element: Jones, angle: float) -> Jones:
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    return turn @ element @ turn.T


def product(elements: Sequence[Jones]) -> Jones:
    """What elements do together, shape (2, 2), in the order in which light meets them."""
    whole = np.eye(2, dtype=complex)
    for element in elements:
        whole = element @ whole
    return whole
