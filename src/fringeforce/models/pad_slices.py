"""Retardance of the slices of a pad under any tractions, by the exact series."""

from __future__ import annotations

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.design.pad import Pad, PadTransducer
from fringeforce.mechanics.solid.block import Block, Patches
from fringeforce.mechanics.solid.fourier import retardance_waves, stress_of_loads
from fringeforce.optics.photoelasticity import stress_optic_constant

DIGITS = 4.0
"""The series ends where the cover has damped its harmonics by ten to this power: what is left out
of a retardance is less than a hundredth of a grey level of 8 bits."""


def block_of(pad: Pad) -> Block:
    """The block of a pad, as mechanics wants it."""
    return block_of_transducer(pad.transducer)


def block_of_transducer(t: PadTransducer) -> Block:
    """The same of its layers and sides alone."""
    return Block(t.length, t.width, t.compliant, t.photoelastic, t.sides)


def slice_retardance(
    pad: Pad, loads: list[tuple[Patches, Array]], x: Array, y: Array, slices: int
) -> Array:
    """Single-pass retardance of every slice under tractions of any shape, by the exact series.

    Sides are taken to be rollers.

    Parameters
    ----------
    pad : Pad
        The design.
    loads : list of (Patches, ndarray)
        Tractions and the forces (n, 3) that they belong to [N].
    x, y : ndarray, shape (columns,), (rows,)
        Places [m].
    slices : int
        Number of them.

    Returns
    -------
    ndarray, shape (slices, 2, rows, columns)
        (A, B) at the polariscope's wavelength [rad].
    """
    block = block_of(pad)
    constant = stress_optic_constant(pad.transducer.photoelastic, pad.polariscope.wavelength)
    difference, shear = stress_of_loads(block, loads, x, y, slices)
    depth = constant * block.depths(slices)[1][:, None, None, None]
    return np.asarray(depth * np.stack([difference, 2 * shear], axis=1))


def profile_waves(
    pad: Pad, profile: Array, weights: Array, digits: float = DIGITS
) -> tuple[Array, Array, Array]:
    """Retardance of depth profiles per harmonic of tractions, by the exact series.

    Sides are taken to be rollers.

    Parameters
    ----------
    pad : Pad
        The design.
    profile : ndarray, shape (slices, modes)
        The profiles, perhaps of another pad.
    weights : ndarray, shape (slices,)
        Of the depth integral of that pad [m].
    digits : float
        The series ends where the cover has damped its harmonics by ten to this power.

    Returns
    -------
    alpha, beta : ndarray, shape (m,), (n,)
        Wave numbers along x and y [1/m].
    waves : ndarray, shape (2, modes, 3, m, n)
        (A, B) per unit harmonic of N, T_x and T_y [rad/Pa].
    """
    block, slices = block_of(pad), len(profile)
    alpha, beta, waves = retardance_waves(block, slices, digits)
    constant = stress_optic_constant(pad.transducer.photoelastic, pad.polariscope.wavelength)
    # profiles are the root of the weights times orthonormal vectors
    reduction = constant * profile / weights[:, None] * block.depths(slices)[1][:, None]
    return alpha, beta, np.einsum("sk,sfcmn->fkcmn", reduction, waves, optimize=True)
