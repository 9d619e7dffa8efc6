"""How tractions that are moved, wider, narrower or of another pressure differ from those as drawn.

The outline of a traction is a rectangle or an ellipse, whose centre is normal about its tactel with
the tolerance `tactels.placement`, and whose two axes are about the square's side with that of
`tactels.size`.  Its pressure is one of those of `Press`, each as likely: uniform, Hertz's, that of
a flat punch or of an edge.  Where the tolerance of the size is small, other shapes than a rectangle
under a uniform pressure are rare: Hertz's pressure is like one on a narrower square.

Where a traction ends it is not smooth, so that no few polynomials over the square are like it;
but the cover carries long waves only, so that few functions of place are like all that light shows
of it.  They are those of Karhunen and Loeve: with S the spectrum of a traction less that of the
square, and g^2 the light of harmonics, the eigenvectors of the mean of (g S) (g S)^T.  Means over
places and sides are those of Gauss and Hermite's rule.

Mirrored tractions are as likely, so that each function is even or odd along either axis.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import Tolerances
from fringeforce.mechanics.solid.block import Shape
from fringeforce.models.as_built import PLACEMENT, SIZE
from fringeforce.models.imaging import camera_response
from fringeforce.models.pad_contacts import SMALL_ARGUMENT, bessel
from fringeforce.models.pad_slices import block_of, profile_waves

WIDTH_SHARE = 1 / 10
"""Tolerance of the size, over the side of a square, from which all shapes are as likely: Hertz's
pressure and a punch's are as wide as uniform ones on squares that are a fifth narrower or wider,
two deviations."""
PLACES, SIDES = 7, 3
"""Points of the rules for places and for sides along an axis: with more, no function that shows is
another one."""
WHOLE = 4
"""Sides of a square along a pad whose harmonics say all of the light of one tactel."""
SHEAR = 0.5
"""Shear over the push whose light counts as well, the largest that the search expects."""
UNSEEN = 1.0
"""Chi-square number of a frame, expected of functions under the force of a tactel, that is left
out: that of noise in one number."""
MOST_FUNCTIONS = 64
"""Functions of a tactel at most, the strongest: what is known of those of 11 x 11 tactels takes
half a gigabyte."""
KEPT = 4
"""Drawings whose functions are kept: a reader asks for its own, and for wider tolerances."""

Signs = tuple[int, int]
"""1 where a function is odd along x and along y."""
EVEN: Signs = (0, 0)
"""Signs of what is even along both axes."""
Function = tuple[float, Signs, Array]
"""Chi-square number that is expected of it and of all weaker ones, mirror signs and spectrum."""


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


def traction_modes(pad: Pad, profile: Array) -> tuple[TractionMode, ...]:
    """Those of a drawing's tolerances, the strongest first; none without tolerances.

    Those of the last drawings are kept: all that read frames of a pad share them.

    Parameters
    ----------
    pad : Pad
        The drawing.
    profile : ndarray, shape (slices, modes)
        Depth profiles of its model.
    """
    place, size = (pad.tolerances.get(path, 0.0) for path in (PLACEMENT, SIZE))
    if not place and not size:
        return ()
    # other tolerances change nothing
    drawn = pad.model_copy(update={"tolerances": Tolerances()})
    return _modes(drawn, (place, size), np.asarray(profile, dtype=float).tobytes(), profile.shape)


@lru_cache(maxsize=KEPT)
def _modes(
    pad: Pad, tolerances: tuple[float, float], values: bytes, shape: tuple[int, ...]
) -> tuple[TractionMode, ...]:
    """`traction_modes` of tolerances of place and size, and of profiles of a shape."""
    profile, (place, size) = np.frombuffer(values).reshape(shape), tolerances
    alpha, beta, light = _light(pad, profile)
    shapes = _shapes(alpha, beta, pad.tactels.side, size)
    square = np.outer(*(bessel(0.5, wave * pad.tactels.side / 2) for wave in (alpha, beta)))
    mean = sum(share * spectrum for share, odd, spectrum in shapes if odd == EVEN)
    spread: dict[Signs, list[Array]] = {}
    for share, odd, spectrum in shapes:
        spread.setdefault(odd, []).append(np.sqrt(share) * (spectrum - mean * (odd == EVEN)))
    few = _even_waves(pad)
    # places hide no less of what is left out
    kept = _strongest(spread, (light, few), UNSEEN / 10)
    moved: dict[Signs, list[Array]] = {signs: [] for signs in np.ndindex(2, 2)}
    for turned, factor in _places(alpha, beta, place):
        # the cosine of no wave number is the root of the share
        moved[turned].append(factor * mean - factor[0, 0] * square)
        for _, odd, spectrum in kept:
            signs = (odd[0] + turned[0]) % 2, (odd[1] + turned[1]) % 2
            moved[signs].append(factor * spectrum)
    found = _strongest(moved, (light, few), UNSEEN, MOST_FUNCTIONS)
    return tuple(TractionMode(Shape(odd, spectrum), square) for square, odd, spectrum in found)


def _strongest(
    spectra: Mapping[Signs, Sequence[Array]],
    seen: tuple[Array, tuple[slice, slice]],
    least: float,
    most: int | None = None,
) -> list[Function]:
    """Karhunen and Loeve's functions, the strongest first, but for those that leave little light.

    Parameters
    ----------
    spectra : mapping
        Of functions by their mirror signs, shape (m, n) each, whose squares add up to the mean.
    seen : (ndarray, (slice, slice))
        Chi-square number of harmonics, shape (m, n), and those of them that stand for all.
    least : float
        Chi-square number of all that is left out together.
    most : int, optional
        Functions at most; any number if not given.
    """
    light, few = seen
    root, values, signs, vectors = np.sqrt(light[few]), [], [], []
    whole = {odd: np.array(own) for odd, own in spectra.items() if own}
    for odd, own in whole.items():
        rows = (root * own[:, few[0], few[1]]).reshape(len(own), -1)
        squares, combined = np.linalg.eigh(rows @ rows.T)
        values += (light.size / root.size * np.maximum(squares, 0)).tolist()
        signs += [odd] * len(rows)
        vectors += list(combined.T)
    order = np.argsort(values)[::-1]
    left = np.cumsum(np.array(values)[order][::-1])[::-1]
    return [
        (float(square), signs[k], np.tensordot(vectors[k], whole[signs[k]], 1))
        for square, k in zip(left[left > least][:most], order, strict=False)
    ]


def _even_waves(pad: Pad) -> tuple[slice, slice]:
    """Every so many harmonics: those of a pad of `WHOLE` tactels, which is as good for one."""
    sides = pad.transducer.length, pad.transducer.width
    x, y = (slice(None, None, max(int(side / (WHOLE * pad.tactels.side)), 1)) for side in sides)
    return x, y


def _light(pad: Pad, profile: Array) -> tuple[Array, Array, Array]:
    """Wave numbers (m,) and (n,), and the light (m, n) of harmonics of a tactel's traction.

    It is the chi-square number of a frame under a newton, at most: pixels see half of the amplitude
    times the sine of one of the two parts of the retardance.
    """
    weights = block_of(pad).depths(len(profile))[1]
    alpha, beta, waves = profile_waves(pad, profile, weights)
    whole = np.einsum("fkcmn,k->cfmn", waves, 2 * profile.sum(axis=0))
    squares = np.square(whole).sum(axis=1)
    light = squares[0] + SHEAR**2 * (squares[1] + squares[2]) / 2
    # by the means over the pad, and over where tactels are, of squared cosines and sines
    light /= (pad.transducer.length * pad.transducer.width) ** 2
    response = camera_response(pad.camera)
    pixels = np.prod(pad.camera.pixels) * len(pad.polariscope.pictures)
    return alpha, beta, light * (pixels * np.mean(response.amplitude**2 / response.variance) / 8)


def _places(alpha: Array, beta: Array, place: float) -> Iterator[tuple[Signs, Array]]:
    """Cosines and sines (m, n) of places, times the roots of their shares, by their mirror signs.

    Places on one side stand for both.
    """
    at, shares = np.polynomial.hermite_e.hermegauss(PLACES if place else 1)
    here = at > -1e-9
    weights = np.where(at > 1e-9, 2.0, 1.0)[here] * shares[here] / shares.sum()
    axes = [
        [
            (odd, np.sqrt(weight) * turn(wave * place * one))
            for one, weight in zip(at[here], weights, strict=True)
            for odd, turn in enumerate((np.cos, np.sin)[: 1 + (one > 1e-9)])
        ]
        for wave in (alpha, beta)
    ]
    for (first, x), (second, y) in itertools.product(*axes):
        yield (first, second), np.outer(x, y)


def _shapes(
    alpha: Array, beta: Array, side: float, size: float
) -> list[tuple[float, Signs, Array]]:
    """Shares, mirror signs and spectra (m, n) of tractions of all shapes about their centres.

    Shares of those that are even along both axes add up to one.
    """
    at, weights = np.polynomial.hermite_e.hermegauss(SIDES if size else 1)
    widths, weights = np.abs(side + size * at), weights / weights.sum()
    other = min((size / (WIDTH_SHARE * side)) ** 2, 1.0)
    found = []
    for (a, first), (b, second) in itertools.product(zip(widths, weights, strict=True), repeat=2):
        for share, odd, spectrum in _pressures(alpha * a / 2, beta * b / 2, other):
            if share:
                found.append((first * second * share, odd, spectrum))
    return found


def _pressures(x: Array, y: Array, other: float) -> Iterator[tuple[float, Signs, Array]]:
    """Shares, mirror signs and spectra (m, n), by wave numbers times half the axes of an outline.

    The spectrum of (1 - t^2)^k is Bessel's of order k + 1/2 along an axis, and k + 1 on a disc
    (NIST Handbook, 10.9.4 and 10.22.19); an edge adds t times the pressure of a punch.

    Parameters
    ----------
    x, y : ndarray, shape (m,), (n,)
        The wave numbers.
    other : float
        Share of tractions that may be of any shape; the others are uniform on a rectangle.
    """
    each = other / 8
    (flat_x, hertz_x, punch_x), (flat_y, hertz_y, punch_y) = (
        [bessel(order, one) for order in (0.5, 1.0, 0.0)] for one in (x, y)
    )
    yield 1 - other + each, EVEN, np.outer(flat_x, flat_y)
    yield each, EVEN, np.outer(punch_x, punch_y)
    for along, across in (
        (hertz_x, flat_y),
        (punch_x, flat_y),
        (flat_x, hertz_y),
        (flat_x, punch_y),
    ):
        yield each / 2, EVEN, np.outer(along, across)
    yield each / 2, (1, 0), np.outer(_tilted(0.0, x), flat_y)
    yield each / 2, (0, 1), np.outer(flat_x, _tilted(0.0, y))
    t = np.hypot(x[:, None], y)
    punch, tilted = bessel(0.5, t), _tilted(0.5, t) / np.maximum(t, SMALL_ARGUMENT)
    yield each, EVEN, bessel(1.0, t)
    yield each, EVEN, bessel(1.5, t)
    yield 2 * each, EVEN, punch
    yield each / 2, (1, 0), tilted * x[:, None]
    yield each / 2, (0, 1), tilted * y


def _tilted(order: float, t: Array) -> Array:
    """Spectrum of a coordinate times the pressure of an order; the derivative of Bessel's."""
    return t / (2 * (order + 1)) * bessel(order + 1, t)
