"""The exact solution for roller sides, as a double Fourier series over the block.

Roller sides are mirror planes, so with x' and y' from a corner, alpha = m pi / length,
beta = n pi / width and kappa^2 = alpha^2 + beta^2 the fields

    u ~ sin(alpha x') cos(beta y'),  v ~ cos(alpha x') sin(beta y'),  w ~ cos(alpha x') cos(beta y')

separate.  Horizontal displacements along (alpha, beta) go with w as in plane strain at the wave
number kappa; those across, along (-beta, alpha), are pure shear and obey u'' = kappa^2 u.  Both
are ordinary differential equations in z (Ewing, Jardetzky and Press, Elastic Waves in Layered
Media, 1957, chapter 4, at frequency zero).  No finite element takes part.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array
from fringeforce.mechanics.fourier import harmonic_displacement
from fringeforce.mechanics.moduli import lame_parameters
from fringeforce.mechanics.solid.block import Block, Patches, SolidInfluence

MIRRORED = ((1, 1), (-1, 1), (1, -1))
"""Signs that N, T_x and T_y take in mirrors along x and along y; shear stress has one more."""
ROUNDING = 1e-12
"""Distance that rounding leaves between a place and the mirror image of another [m]."""


def stress_influence(
    block: Block, patches: Patches, x: Array, y: Array, slices: int = 8, digits: float = 6.0
) -> SolidInfluence:
    """Stresses inside the photoelastic layer per unit force on every tactel.

    Parameters
    ----------
    block : Block
        Block whose sides are taken to be rollers, whatever it says.
    patches : Patches
        Where the forces act.
    x, y : ndarray, shape (nx,), (ny,)
        Places of the samples [m].
    slices : int
        Samples over the depth of the photoelastic layer.
    digits : float
        The series ends where the cover has damped its harmonics by ten to this power.
    """
    heights, weights = block.depths(slices)
    alpha, beta = _wave_numbers_of(block, digits)
    # every tactel's stresses side by side in memory, as they are found
    shape = 3, len(patches.places), slices, len(y), len(x)
    difference, shear = np.empty(shape), np.empty(shape)
    loads = load_harmonics(block, patches, alpha, beta)
    source, flipped = _mirror_images(patches, x, y)
    solved, across = source == np.arange(len(source)), patches.places[:, 1]
    rows = [np.flatnonzero(solved & (across == place)) for place in np.unique(across[solved])]
    synthesis = zip(loads, _known_waves(block, digits, slices), strict=True)
    at_x, at_y = np.outer(x + block.length / 2, alpha), np.outer(y + block.width / 2, beta)
    for component, ((load_x, load_y), (waves_d, waves_s)) in enumerate(synthesis):
        for field, waves, wave_x, wave_y in (
            (difference, waves_d, np.cos(at_x), np.cos(at_y)),
            (shear, waves_s, np.sin(at_x), np.sin(at_y)),
        ):
            turned = waves.swapaxes(1, 2)
            for row in rows:  # tactels beside each other share half of the sum
                half = (wave_y * load_y[:, row[0]]) @ turned
                for tactel in row:
                    right = (wave_x * load_x[:, tactel]).T
                    np.matmul(half, right, out=field[component, tactel])
    for tactel in np.flatnonzero(~solved):
        step = np.where(flipped[tactel], -1, 1)
        for field, own in ((difference, 1), (shear, -1)):
            for component, signs in enumerate(MIRRORED):
                sign = np.prod(np.multiply(own, signs)[flipped[tactel]])
                seen = field[component, source[tactel], :, :: step[1], :: step[0]]
                np.multiply(seen, sign, out=field[component, tactel])
    fields = np.transpose(difference), np.transpose(shear)
    return SolidInfluence(x, y, heights, weights, *fields)


def _mirror_images(
    patches: Patches, x: Array, y: Array
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Which patch every patch is the mirror image of, shape (n,), and along which axes, (n, 2).

    Patches and samples that are symmetric about the centre need a quarter of the patches solved;
    others are images of themselves.
    """
    places = patches.places
    alone = np.arange(len(places)), np.zeros(places.shape, dtype=bool)
    even = all(np.allclose(one, -one[::-1], rtol=0.0, atol=ROUNDING) for one in (x, y))
    if np.ndim(patches.size) or not even:
        return alone
    turned = places > ROUNDING
    apart = np.abs(np.where(turned, -places, places)[:, None] - places).max(axis=2)
    source = apart.argmin(axis=1)
    return (source, turned) if apart.min(axis=1).max() < ROUNDING else alone


def stress_of_loads(
    block: Block,
    loads: Sequence[tuple[Patches, Array]],
    x: Array,
    y: Array,
    slices: int = 8,
    digits: float = 6.0,
) -> tuple[Array, Array]:
    """Stresses inside the photoelastic layer under many loads at once.

    The loads are summed before the series is, so that thousands of patches take as long as one.

    Parameters
    ----------
    block : Block
        Block whose sides are taken to be rollers, whatever it says.
    loads : sequence of (Patches, ndarray)
        Patches and the forces on them, shape (n, 3) [N].
    x, y : ndarray, shape (nx,), (ny,)
        Places [m].
    slices, digits
        As of `stress_influence`.

    Returns
    -------
    difference, shear : ndarray, shape (slices, ny, nx)
        sigma_x - sigma_y and tau_xy [Pa].
    """
    alpha, beta = _wave_numbers_of(block, digits)
    traction = np.zeros((3, len(alpha), len(beta)))
    for patches, forces in loads:
        traction += tractions_of(load_harmonics(block, patches, alpha, beta), forces)
    at_x, at_y = np.outer(x + block.length / 2, alpha), np.outer(y + block.width / 2, beta)
    waves = _known_waves(block, digits, slices)
    differences, shears = (
        sum(one * load for one, load in zip(part, traction, strict=True))
        for part in zip(*waves, strict=True)
    )
    return (
        np.asarray(np.cos(at_y) @ np.swapaxes(differences, 1, 2) @ np.cos(at_x).T),
        np.asarray(np.sin(at_y) @ np.swapaxes(shears, 1, 2) @ np.sin(at_x).T),
    )


def retardance_waves(block: Block, slices: int, digits: float) -> tuple[Array, Array, Array]:
    """What light sees of harmonic tractions on the top surface.

    Parameters
    ----------
    block : Block
        Block whose sides are taken to be rollers, whatever it says.
    slices, digits
        As of `stress_influence`.

    Returns
    -------
    alpha, beta : ndarray, shape (m,), (n,)
        Wave numbers along x and y [1/m].
    waves : ndarray, shape (slices, 2, 3, m, n)
        Harmonics of sigma_x - sigma_y and of 2 tau_xy per unit harmonic of N, T_x and T_y.
    """
    alpha, beta = _wave_numbers_of(block, digits)
    waves = _known_waves(block, digits, slices)
    return alpha, beta, np.stack([np.stack([d, 2 * s], axis=1) for d, s in waves], axis=2)


@lru_cache(maxsize=2)
def _known_waves(block: Block, digits: float, slices: int) -> list[tuple[Array, Array]]:
    """`_stress_waves` of the last blocks, for frames of the same pad."""
    return _stress_waves(block, *_wave_numbers_of(block, digits), block.depths(slices)[0])


def _stress_waves(
    block: Block, alpha: Array, beta: Array, heights: Array
) -> list[tuple[Array, Array]]:
    """Harmonics of sigma_x - sigma_y and tau_xy per unit harmonic of N, T_x and T_y.

    Each has the shape (slices, m, n).
    """
    _, mu = lame_parameters(block.photoelastic)
    turn_c, turn_s = _doubled_angle(alpha, beta)
    # Hooke's law: 2 mu (eps_x - eps_y), and mu gamma_xy
    return [
        (2 * mu * (turn_c * along - turn_s * across), -mu * (turn_s * along + turn_c * across))
        for along, across in zip(*_horizontal(block, alpha, beta, heights), strict=True)
    ]


def _wave_numbers_of(block: Block, digits: float) -> tuple[Array, Array]:
    return (
        _wave_numbers(block.length, block, digits),
        _wave_numbers(block.width, block, digits),
    )


def _wave_numbers(side: float, block: Block, digits: float) -> Array:
    terms = math.ceil(digits * math.log(10) * side / (math.pi * block.compliant.thickness))
    return np.arange(terms + 1, dtype=np.float64) * (np.pi / side)


def _doubled_angle(alpha: Array, beta: Array) -> tuple[Array, Array]:
    """Kappa times cosine and sine of twice the wave's direction, shape (1, m, n)."""
    kappa = np.hypot(alpha[:, None], beta)
    kappa[0, 0] = 1.0
    return (
        ((alpha[:, None] ** 2 - beta**2) / kappa)[None],
        (2 * alpha[:, None] * beta / kappa)[None],
    )


def _horizontal(
    block: Block, alpha: Array, beta: Array, heights: Array
) -> tuple[list[Array], list[Array]]:
    """Displacement along and across the wave, per unit harmonic of each traction component.

    Returns two lists over N, T_x, T_y of arrays, shape (slices, m, n).
    """
    kappa = np.hypot(alpha[:, None], beta)
    kappa[0, 0] = 1.0  # the mean pressure gives no stress difference: _doubled_angle is zero there
    size, kind = np.unique(kappa, return_inverse=True)
    kind = kind.reshape(kappa.shape)
    pressed, pulled = np.moveaxis(
        harmonic_displacement(block.compliant, block.photoelastic, size, heights), -1, 0
    )
    twisted = _shear_displacement(block, size, heights)
    pressed, pulled, twisted = (values.T[:, kind] for values in (pressed, pulled, twisted))
    cosine, sine = alpha[:, None] / kappa, beta / kappa
    return (
        [pressed, pulled * cosine, pulled * sine],
        [np.zeros_like(pressed), -twisted * sine, twisted * cosine],
    )


def _shear_displacement(block: Block, kappa: Array, heights: Array) -> Array:
    """Displacement across the wave for a unit traction across it, shape (len(kappa), slices)."""
    soft, clear = (lame_parameters(layer)[1] for layer in (block.compliant, block.photoelastic))
    cover, depth = block.compliant.thickness, block.photoelastic.thickness
    damped = np.exp(-kappa * cover)
    cosh, sinh = (1 + damped**2) / 2, (1 - damped**2) / 2  # over exp(kappa cover)
    interface = damped / (kappa * (clear / np.tanh(kappa * depth) * cosh + soft * sinh))
    above = heights - block.base
    rising = np.exp(kappa[:, None] * (above - depth))
    ratio = rising * np.expm1(-2 * kappa[:, None] * above) / np.expm1(-2 * kappa * depth)[:, None]
    return interface[:, None] * ratio


def load_harmonics(
    block: Block,
    patches: Patches,
    alpha: Array,
    beta: Array,
    odd: tuple[int, int] | None = None,
) -> list[tuple[Array, Array]]:
    """Harmonics of unit forces on patches.

    Parameters
    ----------
    block : Block
        Block whose sides are taken to be rollers, whatever it says.
    patches : Patches
        Where the forces act.
    alpha, beta : ndarray, shape (m,), (n,)
        Wave numbers along x and y [1/m].
    odd : (int, int), optional
        Mirror signs, as of `Shape`, of point loads in the place of the patches.

    Returns
    -------
    list of (ndarray, ndarray)
        For N, T_x and T_y those along x, shape (m, tactels), and along y, shape (n, tactels).
    """
    ends = np.array([block.length, block.width])
    sides = np.broadcast_to(patches.size, patches.places.shape)
    waves = []
    for axis, wave in enumerate((alpha, beta)):
        share = np.where(wave > 0, 2.0, 1.0)[:, None] / ends[axis]
        if odd is None:
            share = share * np.sinc(np.outer(wave, sides[:, axis]) / (2 * np.pi))
        elif odd[axis]:
            share = 1j * share
        place = patches.places[:, axis] + ends[axis] / 2
        turned = share * np.exp(1j * np.outer(wave, place))
        waves.append((turned.real, turned.imag))
    (cos_x, sin_x), (cos_y, sin_y) = waves
    return [(cos_x, cos_y), (sin_x, cos_y), (cos_x, sin_y)]


def tractions_of(harmonics: list[tuple[Array, Array]], forces: Array) -> Array:
    """Harmonics of the tractions of forces, shape (n, 3), from those of unit forces: (3, m, n)."""
    return np.stack(
        [
            (along * forces[:, component]) @ across.T
            for component, (along, across) in enumerate(harmonics)
        ]
    )
