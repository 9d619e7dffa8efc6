"""How a layered block gives way beneath a small normal force, far from its sides.

A half-space of the cover's material gives way like 1 / distance, and a square of uniform pressure
on it by Love's closed form.  What the layers change of that is smooth and dies away over their
depth; it is a Hankel transform of the difference of the two compliances,

    w(r) = 1 / (2 pi) * integral of [C(kappa) - 2 / (E* kappa)] J_0(kappa r) kappa d kappa.

See A. E. H. Love, Phil. Trans. R. Soc. A 228, 377-420, 1929; K. L. Johnson, Contact Mechanics,
1985, section 3.3; and O'Sullivan and King, J. Tribol. 110, 235-240, 1988, for layers.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.special import j0

from fringeforce.base.arrays import Array
from fringeforce.mechanics.fourier import surface_compliance
from fringeforce.mechanics.moduli import lame_parameters
from fringeforce.mechanics.solid.block import Block

SHORTEST = 15.0
"""Wave number times the cover's thickness from which the layers below change nothing: their part
falls with exp(-2 kappa thickness)."""
LONGEST = 0.02
"""Wave number times the height of the block below which it gives way as under a uniform load."""
NODES = 600
"""Of Gauss's rule over wave numbers; exact while kappa r turns less than some hundred times."""
RADII = 400
"""Distances between which a spline carries what the layers change."""


def contact_modulus(block: Block) -> float:
    """E / (1 - nu^2) of the cover [Pa]."""
    layer = block.compliant
    return layer.youngs_modulus / (1 - layer.poissons_ratio**2)


def patch_displacement(block: Block, step: float, count: int) -> Array:
    """Displacement into the surface beside a square under a unit normal force, at equal steps.

    Parameters
    ----------
    block : Block
        The layers; their sides are far away.
    step : float
        Side of the square, and distance of the places [m].
    count : int
        Places on either side of it.

    Returns
    -------
    ndarray, shape (2 count + 1, 2 count + 1)
        [m/N].
    """
    steps = np.arange(-count, count + 1, dtype=np.float64) * step
    x, y = np.meshgrid(steps, steps, indexing="ij")
    half, modulus = step / 2, contact_modulus(block)
    love = sum(
        sign * _corner(x + a, y + b)
        for a, b, sign in (
            (half, half, 1), (-half, -half, 1), (half, -half, -1), (-half, half, -1),
        )
    ) / (np.pi * modulus * step**2)  # fmt: skip
    radii = np.linspace(0, float(np.hypot(steps[-1], steps[-1])), RADII)
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    most = SHORTEST / block.compliant.thickness
    kappa, weights = most * (nodes + 1) / 2, most * weights / 2
    layered = np.where(kappa * -block.base < LONGEST, _uniform(block), 0.0)
    short = layered == 0
    layered[short] = surface_compliance(block.compliant, block.photoelastic, kappa[short])
    change = (layered * kappa - 2 / modulus) * weights / (2 * np.pi)
    spline = make_interp_spline(radii, j0(np.outer(radii, kappa)) @ change, k=3)
    return np.asarray(love + spline(np.hypot(x, y)))


def _corner(x: Array, y: Array) -> Array:
    """Love's antiderivative of 1 / distance over a rectangle from the origin to (x, y)."""
    return x * np.arcsinh(y / np.abs(x)) + y * np.arcsinh(x / np.abs(y))


def _uniform(block: Block) -> float:
    """Displacement per uniform pressure of layers that cannot give way sideways [m/Pa]."""
    layers = block.compliant, block.photoelastic
    return sum(
        layer.thickness / (lam + 2 * mu)
        for layer, (lam, mu) in ((layer, lame_parameters(layer)) for layer in layers)
    )
