"""Pads with free and bonded sides, end to end: against scikit-fem, and read from a frame."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse.linalg import splu
from skfem import Basis, ElementHex2, ElementVector, FacetBasis, LinearForm, MeshHex, condense
from skfem.models.elasticity import lame_parameters, linear_elasticity

import fringeforce as ff
from fringeforce.optics.photoelasticity import stress_optic_constant
from fringeforce.pads.design import Pad
from fringeforce.pads.model import PadModel

Array = NDArray[np.float64]
TOLD: list[tuple[str, int, int]] = []


@pytest.fixture(scope="module", params=["free", "bonded"])
def model(request: pytest.FixtureRequest) -> PadModel:
    """Four tactels that reach to a millimetre from the sides, which the sides therefore change."""
    pad = ff.load_sensor("pad").replace(
        **{
            "transducer.length": "6 mm",
            "transducer.width": "5 mm",
            "transducer.photoelastic.thickness": "2 mm",
            "transducer.sides": request.param,
            "tactels.count": [2, 2],
            "tactels.pitch": "1.5 mm",
            "camera.pixels": [64, 64],
        }
    )
    TOLD.clear()
    return ff.characterize(pad, progress=lambda *step: TOLD.append(step))


def _graded(*marks: tuple[float, int]) -> Array:
    """Boundaries through marks [mm], so many cells from one to the next."""
    pieces = [
        np.linspace(start, end, count + 1)[1:]
        for (start, _), (end, count) in pairwise([(marks[0][0], 0), *marks[1:]])
    ]
    return np.concatenate([[marks[0][0]], *pieces]) * 1e-3


def _by_scikit_fem(pad: Pad, x: Array, y: Array) -> Array:
    """Depth integral of sigma_x - sigma_y on a grid, all tactels pressed with 1 N, in a quarter."""
    block = pad.transducer
    hexes = MeshHex.init_tensor(
        _graded((0, 0), (1.5, 4), (3, 5)),
        _graded((0, 0), (1.5, 4), (2.5, 4)),
        _graded((-2.5, 0), (-2.2, 1), (-0.5, 4), (0, 2)),
    )
    basis = Basis(hexes, ElementVector(ElementHex2()), intorder=4)
    in_cover = hexes.p[2, hexes.t].mean(axis=0) > -0.5e-3
    matrix = 0
    for layer, here in ((block.compliant, in_cover), (block.photoelastic, ~in_cover)):
        form = linear_elasticity(*lame_parameters(layer.youngs_modulus, layer.poissons_ratio))
        matrix = matrix + form.assemble(basis.with_elements(np.flatnonzero(here)))
    # the four tactels are one square of 3 mm
    pressed = hexes.facets_satisfying(
        lambda p: np.isclose(p[2], 0) & (p[0] < 1.5e-3) & (p[1] < 1.5e-3)
    )
    pressure = LinearForm(lambda v, w: -v[2] / 1.5e-3**2)
    forces = pressure.assemble(FacetBasis(hexes, basis.elem, facets=pressed, intorder=4))
    fixed = [basis.get_dofs(lambda p: np.isclose(p[2], -2.5e-3)).all()]
    for axis, half in enumerate((3e-3, 2.5e-3)):
        mirror = basis.get_dofs(lambda p, a=axis: np.isclose(p[a], 0))
        fixed.append(mirror.all([f"u^{axis + 1}"]))
        if block.sides == "bonded":
            side = basis.get_dofs(lambda p, a=axis, h=half: np.isclose(p[a], h))
            fixed.append(side.all())
    inner, load, solution, free = condense(matrix, forces, D=np.unique(np.concatenate(fixed)))
    solution[free] = splu(inner.tocsc()).solve(load)
    return _difference(pad, basis, solution, x, y)


def _difference(pad: Pad, basis: Basis, solution: Array, x: Array, y: Array) -> Array:
    nodes, weights = np.polynomial.legendre.leggauss(6)
    z, step = -1.5e-3 + 1e-3 * nodes, 2e-5
    places = np.stack(np.meshgrid(x, y, z, indexing="ij")).reshape(3, -1)

    def slope(axis: int) -> Array:
        shift = np.zeros((3, 1))
        shift[axis] = step
        count = places.shape[1]
        ahead, behind = (
            (basis.probes(places + s * shift) @ solution).reshape(3, count)[axis] for s in (1, -1)
        )
        return (ahead - behind) / (2 * step)

    layer = pad.transducer.photoelastic
    _, mu = lame_parameters(layer.youngs_modulus, layer.poissons_ratio)
    field = 2 * mu * (slope(0) - slope(1)).reshape(len(x), len(y), len(z))
    return field @ weights * 1e-3


def test_retardance_is_that_of_scikit_fem_on_bricks_of_its_own(model: PadModel) -> None:
    pad = model.sensor
    x, y = pad.pixel_positions
    columns, rows = np.arange(33, 63, 3), np.arange(34, 63, 4)  # up to a pixel from the sides
    forces = np.zeros((4, 3))
    forces[:, 0] = 1.0
    found = model.retardance(forces)[0][rows[:, None], columns]
    constant = stress_optic_constant(pad.transducer.photoelastic, pad.polariscope.wavelength)
    expected = 2 * constant * _by_scikit_fem(pad, x[columns], y[rows]).T
    np.testing.assert_allclose(found, expected, atol=0.02 * np.abs(expected).max())


def test_the_sides_matter_here(model: PadModel) -> None:
    rollers = ff.characterize(model.sensor.replace(**{"transducer.sides": "roller"}))
    forces = np.tile([1.0, 0.0, 0.0], (4, 1))
    apart = np.abs(model.retardance(forces) - rollers.retardance(forces)).max()
    assert apart > 0.1 * np.abs(model.retardance(forces)).max()


def test_a_frame_is_read_within_its_own_deviations(model: PadModel) -> None:
    forces = np.array([[2.0, 0.3, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, -0.2], [0.5, 0.1, 0.1]])
    reading = model.read(model.expose(forces, rng=1))
    assert reading.status is ff.Status.OK
    assert (np.abs(reading.forces - forces) < 5 * reading.std).all()


def test_progress_is_told_to_its_end(model: PadModel) -> None:
    assert TOLD[0][1] == 0
    assert TOLD[-1][1] == TOLD[-1][2] == len(TOLD) - 1
