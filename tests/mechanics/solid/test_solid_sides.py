"""What free and bonded sides change: equilibrium, the limit of rollers, and elements for all."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import fringeforce as ff
from fringeforce.mechanics.solid.block import Block, Patches, Sides
from fringeforce.mechanics.solid.fields import stress, superposed
from fringeforce.mechanics.solid.fourier import stress_influence
from fringeforce.mechanics.solid.influence import patch_loads
from fringeforce.mechanics.solid.mesh import BoxMesh
from fringeforce.mechanics.solid.sides import SideGrading, side_mesh, sided_influence

pytestmark = pytest.mark.slow

Array = NDArray[np.float64]
PATCHES = Patches(np.array([[0.8e-3, -0.5e-3], [-0.5e-3, 0.2e-3]]), 1e-3)


def _block(sides: Sides) -> Block:
    strip = ff.load_sensor("saad").transducer
    return Block(5e-3, 4e-3, strip.compliant, strip.photoelastic, sides)


def _gauss(half: Array, order: int) -> tuple[Array, Array]:
    """Gauss points and weights of all elements on both sides of a mirror."""
    breaks = np.concatenate([-half[:0:-1], half])
    points, weights = np.polynomial.legendre.leggauss(order)
    sizes = np.diff(breaks)[:, None] / 2
    return (breaks[:-1, None] + sizes * (1 + points)).ravel(), (sizes * weights).ravel()


def test_a_layer_of_bricks_between_free_sides_carries_the_whole_load_and_its_moment() -> None:
    block, loads, sizes = _block("free"), patch_loads(PATCHES), SideGrading(order=3)
    mesh = side_mesh(block, loads, sizes)
    forces = np.array([[2.0, 0.3, 0.0], [1.0, 0.0, -0.4]])
    parts = superposed(block, loads, mesh, forces)
    (x, along), (y, across) = (_gauss(breaks, 4) for breaks in (mesh.x, mesh.y))
    # what lies above moves rigidly, what lies below rests: finite elements balance that exactly
    points, weights = np.polynomial.legendre.leggauss(4)
    bottom, top = mesh.z[1:3]
    z = (bottom + top) / 2 + (top - bottom) / 2 * points
    found = stress(block, parts, mesh, x, y, z)
    volume = np.einsum("x,y,z->xyz", along, across, weights / 2)
    totals = [(found[i, 2] * volume).sum() for i in range(3)]
    np.testing.assert_allclose(totals, [0.3, -0.4, -3.0], atol=1e-7)
    moment = ((z * found[0, 2] - x[:, None, None] * found[2, 2]) * volume).sum()
    assert moment == pytest.approx(forces[:, 0] @ PATCHES.places[:, 0], rel=1e-6)


def test_rollers_change_nothing_of_the_exact_series() -> None:
    block, x = _block("roller"), np.linspace(-2e-3, 2e-3, 5)
    mesh = BoxMesh(np.array([0, 2.5e-3]), np.array([0, 2e-3]), np.array([-3.5e-3, -0.5e-3, 0]), 2)
    found = sided_influence(block, PATCHES, x, x, 3, mesh)
    exact = stress_influence(block, PATCHES, x, x, 3)
    for one, other in ((found.difference, exact.difference), (found.shear, exact.shear)):
        np.testing.assert_allclose(one, other, atol=1e-6 * np.abs(other).max())


def test_a_cover_that_is_nearly_incompressible_does_not_lock_the_bricks() -> None:
    block, x = _block("free"), np.linspace(-1.8e-3, 1.8e-3, 7)
    apart = {}
    for ratio in (0.45, 0.499):
        cover = block.compliant.model_copy(update={"poissons_ratio": ratio})
        one = replace(block, compliant=cover)
        coarse, fine = (
            sided_influence(one, PATCHES, x, x, 3, mesh=SideGrading(order=order))
            for order in (3, 4)
        )
        size = np.sqrt((fine.difference**2).mean())
        apart[ratio] = np.sqrt(((coarse.difference - fine.difference) ** 2).mean()) / size
    # elements that lock err by as much more as the cover is stiffer against pressure: fifty times
    assert apart[0.499] < 0.05
    assert apart[0.499] < 2 * apart[0.45]


def test_loads_that_come_near_a_side_ask_for_smaller_bricks() -> None:
    near = Patches(np.array([[1.9e-3, 0.0]]), 1e-3)
    wide = Block(25e-3, 25e-3, _block("free").compliant, _block("free").photoelastic, "free")
    far, close = (side_mesh(wide, patch_loads(p), SideGrading()) for p in (PATCHES, near))
    assert close.unknowns == far.unknowns
    beside = Patches(np.array([[12e-3, 0.0]]), 1e-3)
    assert side_mesh(wide, patch_loads(beside), SideGrading()).unknowns > far.unknowns


def test_a_load_beyond_the_block_is_refused() -> None:
    with pytest.raises(ff.FringeforceError, match=r"y = 1\.9 mm.*5 x 4 mm"):
        sided_influence(_block("free"), Patches(np.array([[0.0, 1.9e-3]]), 1e-3), [0.0], [0.0])
