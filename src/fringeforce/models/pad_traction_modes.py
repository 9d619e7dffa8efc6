"""How tractions that are moved, wider, narrower or uneven differ in light from those as drawn.

A traction is that of a rectangle, whose centre is normal about its tactel with the tolerance
`tactels.placement`, and whose two sides are about the square's with that of `tactels.size`.
Besides it is uneven, by

    c_1 xi + c_2 eta + c_3 P_2(xi) + c_4 P_2(eta) + c_5 xi eta + ...

with xi, eta from -1 to 1 over the square, Legendre's P_2, and all products of the third and the
fourth order.  c_1 and c_2 move its centre by side / 6 each, as far as the placement says, c_3 and
c_4 widen it by side / 5, as far as the size says; those of higher orders are as large as c_3.

Where a rectangle ends it is not smooth, so that no few polynomials over the square are like it;
but the cover carries long waves only, so that few functions of place are like all that light shows
of it.  They are those of Karhunen and Loeve: with S the spectrum of a traction less that of the
square, and g^2 the light of harmonics, the eigenvectors of the mean of (g S) (g S)^T.  Means over
places and sides are those of Gauss and Hermite's rule.

Mirrored tractions are as likely, so that each function is even or odd along either axis.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import spherical_jn

from fringeforce.base.arrays import Array
from fringeforce.design.pad import Pad
from fringeforce.mechanics.solid.block import Shape
from fringeforce.models.as_built import PLACEMENT, SIZE
from fringeforce.models.imaging import camera_response
from fringeforce.models.pad_slices import block_of, profile_waves

HIGHEST = 4
"""Order of the polynomials of an uneven traction."""
CENTRE_SHARE, WIDTH_SHARE = 1 / 6, 1 / 5
"""By what share of the side of a square the first and the second polynomials move its centre and
widen it."""
TURNED = float(np.sqrt(0.72))
"""Standard deviation of that of xi eta over that of the second ones, so that the matrix of
second moments is as likely in any axes (2 / 15 by sqrt 2, over 1 / 9)."""
PLACES, SIDES = 7, 3
"""Points of the rules for places and for sides along an axis: with more, no function that shows is
another one."""
DIGITS = 4.0
"""Harmonics of what differs count up to where the cover has damped them by ten to this power: less
than a hundredth of a grey level of 8 bits."""
SHEAR = 0.5
"""Shear over the push whose light counts as well, the largest that the search expects."""
UNSEEN = 1.0
"""Chi-square number of a frame, expected of functions under the force of a tactel, that is left
out: that of noise in one number."""
MOST_FUNCTIONS = 64
"""Functions of a tactel at most: what is known of those of 11 x 11 tactels takes half a gigabyte.
Wider tolerances would need more, and allow for uneven tractions on the squares only."""

Function = tuple[float, tuple[int, int], Array]
"""Chi-square number that is expected of it, mirror signs and spectrum."""


@dataclass(frozen=True, eq=False)
class TractionMode:
    """A function of place that a traction may have beside that of the square, per unit deviation.

    Attributes
    ----------
    shape : Shape
        The function.
    square : float
        Chi-square number of a frame that this and all weaker ones are expected to add under a push
        of a newton [1/N^2].
    """

    shape: Shape
    square: float


def traction_modes(pad: Pad, profile: Array) -> list[TractionMode]:
    """Those of a drawing's tolerances, the strongest first; none without tolerances.

    Parameters
    ----------
    pad : Pad
        The drawing.
    profile : ndarray, shape (slices, modes)
        Depth profiles of its model.
    """
    place, size = (pad.tolerances.get(path, 0.0) for path in (PLACEMENT, SIZE))
    if not place and not size:
        return []
    side = pad.tactels.side
    alpha, beta, light = _light(pad, profile)
    uneven = list(_uneven((alpha, beta), side, place, size))
    along, across = (_drawn(wave, side, place, size) for wave in (alpha, beta))
    square = np.outer(*(np.sinc(wave * side / (2 * np.pi)) for wave in (alpha, beta)))
    found: list[Function] = []
    for odd in np.ndindex(2, 2):
        moved = np.einsum("im,jn->ijmn", along[odd[0]], across[odd[1]]).reshape(-1, *square.shape)
        if odd == (0, 0):
            shares = np.outer(along[2], across[2]).ravel()
            moved -= shares[:, None, None] * square
        spectra = np.array([*moved, *(one for own, one in uneven if own == odd)])
        seen = (np.sqrt(light) * spectra).reshape(len(spectra), square.size)
        values, vectors = np.linalg.eigh(seen @ seen.T)
        for value, vector in zip(values, vectors.T, strict=True):
            found.append((float(value), odd, np.tensordot(vector, spectra, 1)))
    shown = _shown(found)
    if len(shown) <= MOST_FUNCTIONS:
        return shown
    return _shown([(float((light * one**2).sum()), odd, one) for odd, one in uneven])


def _shown(found: list[Function]) -> list[TractionMode]:
    """The strongest functions, but for those that together do not show."""
    found = sorted(found, key=lambda one: -one[0])
    left = np.cumsum([one[0] for one in found][::-1])[::-1]
    return [
        TractionMode(Shape(odd, spectrum), float(square))
        for square, (_, odd, spectrum) in zip(left, found, strict=True)
        if square > UNSEEN
    ]


def _light(pad: Pad, profile: Array) -> tuple[Array, Array, Array]:
    """Wave numbers (m,) and (n,), and the light (m, n) of harmonics of a tactel's traction.

    It is the chi-square number of a frame under a newton, at most: pixels see half of the amplitude
    times the sine of one of the two parts of the retardance.
    """
    weights = block_of(pad).depths(len(profile))[1]
    alpha, beta, waves = profile_waves(pad, profile, weights, DIGITS)
    whole = np.einsum("fkcmn,k->cfmn", waves, 2 * profile.sum(axis=0))
    squares = np.square(whole).sum(axis=1)
    light = squares[0] + SHEAR**2 * (squares[1] + squares[2]) / 2
    # by the means over the pad, and over where tactels are, of squared cosines and sines
    light /= (pad.transducer.length * pad.transducer.width) ** 2
    response = camera_response(pad.camera)
    pixels = np.prod(pad.camera.pixels) * len(pad.polariscope.pictures)
    return alpha, beta, light * (pixels * np.mean(response.amplitude**2 / response.variance) / 8)


def _drawn(wave: Array, side: float, place: float, size: float) -> tuple[Array, Array, Array]:
    """Means with cosines (k, m) and with sines of tractions along an axis, times their shares (k,).

    Shares are roots of the weights of the rules; of places those on one side stand for both.
    """
    at, shares = np.polynomial.hermite_e.hermegauss(PLACES if place else 1)
    here = at > -1e-9
    weights = np.where(at > 1e-9, 2.0, 1.0)[here] * shares[here] / shares.sum()
    at = place * at[here]
    widths, parts = np.polynomial.hermite_e.hermegauss(SIDES if size else 1)
    root = np.sqrt(np.outer(weights, parts / parts.sum()))
    means = root[..., None] * np.sinc(np.outer(side + size * widths, wave) / (2 * np.pi))
    angles = np.outer(at, wave)[:, None]
    even, odd = (turn(angles) * means for turn in (np.cos, np.sin))
    return even.reshape(-1, len(wave)), odd[at > 0].reshape(-1, len(wave)), root.ravel()


def _uneven(
    waves: tuple[Array, Array], side: float, place: float, size: float
) -> Iterator[tuple[tuple[int, int], Array]]:
    """Mirror signs and spectra (m, n) of the polynomials, per standard deviation."""
    moving, widening = place / (CENTRE_SHARE * side), size / (WIDTH_SHARE * side)
    for order in range(1, HIGHEST + 1):
        for k in range(order + 1):
            orders, std = (order - k, k), moving if order == 1 else widening
            if not std:
                continue
            # the mean of P_n(t) exp(i k t) is i^n j_n(k) (NIST Handbook, 10.54.2)
            spectrum = np.outer(
                *(spherical_jn(n, wave * side / 2) for n, wave in zip(orders, waves, strict=True))
            )
            share = TURNED * std if orders == (1, 1) else std
            yield (orders[0] % 2, orders[1] % 2), share * spectrum
