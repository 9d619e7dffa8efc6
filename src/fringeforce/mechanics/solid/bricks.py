"""Elements in the shape of bricks: one dimension more than `mechanics.elements`."""

from __future__ import annotations

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.mechanics.elements import interval
from fringeforce.mechanics.solid.section import mirrored_interval


def brick_stiffness(
    order: int, size: tuple[float, float, float], lame: tuple[float, float]
) -> Array:
    """Stiffness of one brick: the weak form of linear elasticity.

    The energy is  lambda (div u)^2 / 2 + mu eps : eps  with the symmetric gradient eps.

    Parameters
    ----------
    order : int
        Polynomial order in all directions.
    size : (float, float, float)
        Along x, y and z [m].
    lame : (float, float)
        lambda and mu [Pa].

    Returns
    -------
    ndarray, shape (3 m, 3 m) with m = (order + 1)^3
        Unknowns run over (component u, v or w, along x, along y, along z); along x they are those
        of `section.mirrored_interval`.
    """
    lines, m = (mirrored_interval(order), interval(order), interval(order)), (order + 1) ** 3
    volume = float(np.prod(size))
    lam, mu = lame

    def gradients(row: int, column: int) -> Array:
        """Integral of d phi_i / d x_row times d phi_j / d x_column."""
        factors = [line.mass for line in lines]
        if row == column:
            factors[row] = lines[row].stiffness
        else:
            factors[row], factors[column] = lines[row].mixed, lines[column].mixed.T
        scale = volume / (size[row] * size[column])
        product = np.kron(np.kron(factors[0], factors[1]), factors[2])
        return np.asarray(scale * product, dtype=np.float64)

    along = [gradients(axis, axis) for axis in range(3)]
    laplacian = mu * sum(along)
    k = np.empty((3, m, 3, m))
    for a in range(3):
        k[a, :, a] = laplacian + (lam + mu) * along[a]
        for b in range(a):
            cross = gradients(a, b)
            k[a, :, b] = lam * cross + mu * cross.T
            k[b, :, a] = k[a, :, b].T
    return k.reshape(3 * m, 3 * m)
