"""Pads with free and bonded sides, end to end: against scikit-fem, and read from a frame."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags_array
from scipy.sparse.linalg import cg
from skfem import Basis, ElementHex2, ElementVector, FacetBasis, LinearForm, Mesh, MeshHex, condense
from skfem.models.elasticity import lame_parameters, linear_elasticity

import fringeforce as ff
from fringeforce.design.pad import Pad
from fringeforce.models.pad import PadModel
from fringeforce.optics.photoelasticity import stress_optic_constant

pytestmark = pytest.mark.slow

Array = NDArray[np.float64]
TOLD: list[tuple[str, int, int]] = []


def _tell(words: str, done: int, count: int) -> None:
    TOLD.append((words, done, count))


@pytest.fixture(scope="module", params=["free", "bonded"])
def model(request: pytest.FixtureRequest) -> PadModel:
    """Four tactels that reach to a millimetre from the sides, which the sides therefore change."""
    pad = ff.load_sensor("pad").replace(
        **{
            "transducer.length": "6 mm",
            "transducer.width": "5 mm",
            "transducer.photoelastic.thickness": "2.6 mm",
            "transducer.sides": request.param,
            "tactels.count": [2, 2],
            "tactels.pitch": "1.5 mm",
            "camera.pixels": [64, 64],
        }
    )
    TOLD.clear()
    return ff.characterize(pad, progress=_tell)


@pytest.fixture(scope="module")
def rollers(model: PadModel) -> PadModel:
    return ff.characterize(model.sensor.replace(**{"transducer.sides": "roller"}))


def _graded(*marks: tuple[float, int]) -> Array:
    """Boundaries through marks [mm], so many cells from one to the next."""
    pieces = [
        np.linspace(start, end, count + 1)[1:]
        for (start, _), (end, count) in pairwise([(marks[0][0], 0), *marks[1:]])
    ]
    return np.concatenate([[marks[0][0]], *pieces]) * 1e-3


Problem = tuple[Basis, csr_matrix, Array]
HALF, BASE, INTERFACE = (3e-3, 2.5e-3), -3.1e-3, -0.5e-3


@pytest.fixture(scope="module")
def problem() -> Problem:
    """Stiffness and forces of a quarter, all tactels pressed with 1 N, no side held yet."""
    hexes = MeshHex.init_tensor(
        _graded((0, 0), (1.5, 3), (3, 4)),
        _graded((0, 0), (1.5, 3), (2.5, 3)),
        _graded((-3.1, 0), (-2.7, 1), (-0.5, 3), (0, 2)),
    )
    basis = Basis(hexes, ElementVector(ElementHex2()), intorder=4)
    pad = ff.load_sensor("pad").transducer
    matrix: Any = 0
    for layer, here in ((pad.compliant, ~_clear(hexes)), (pad.photoelastic, _clear(hexes))):
        form = linear_elasticity(*lame_parameters(layer.youngs_modulus, layer.poissons_ratio))
        matrix = matrix + form.assemble(basis.with_elements(np.flatnonzero(here)))
    # the four tactels are one square of 3 mm
    pressed = hexes.facets_satisfying(
        lambda p: np.isclose(p[2], 0) & (p[0] < 1.5e-3) & (p[1] < 1.5e-3)
    )
    pressure = LinearForm(lambda v, w: -v[2] / 1.5e-3**2)
    forces = pressure.assemble(FacetBasis(hexes, basis.elem, facets=pressed, intorder=4))
    return basis, matrix, forces


def _clear(hexes: Mesh) -> NDArray[np.bool_]:
    return hexes.p[2, hexes.t].mean(axis=0) < INTERFACE


def _by_scikit_fem(problem: Problem, pad: Pad, sides: str) -> tuple[Array, Array, Array]:
    """Places x, y and the depth integral of sigma_x - sigma_y there.

    At the Gauss points of bricks of second order, which know slopes best.
    """
    basis, matrix, forces = problem
    fixed = [basis.get_dofs(lambda p: np.isclose(p[2], BASE)).all()]
    for axis, half in enumerate(HALF):
        across = [f"u^{axis + 1}"]
        held = {"free": [], "roller": across, "bonded": ["u^1", "u^2", "u^3"]}[sides]
        for place, components in ((0.0, across), (half, held)):
            plane = basis.get_dofs(lambda p, a=axis, at=place: np.isclose(p[a], at))
            fixed += [plane.all(components)] if components else []
    condensed: Any = condense(matrix, forces, D=np.unique(np.concatenate(fixed)))
    inner, load, solution, free = condensed
    solution[free], failed = cg(inner, load, rtol=1e-8, M=diags_array(1 / inner.diagonal()))
    assert not failed
    hexes, clear = basis.mesh, _clear(basis.mesh)
    points = Basis(hexes, basis.elem, intorder=3, elements=np.flatnonzero(clear))
    field: Any = points.interpolate(solution)
    gradient = np.asarray(field.grad)
    layer = pad.transducer.photoelastic
    _, mu = lame_parameters(layer.youngs_modulus, layer.poissons_ratio)
    stress = 2 * mu * (gradient[0, 0] - gradient[1, 1])
    x, y, _ = points.global_coordinates()
    heights = np.ptp(hexes.p[2, hexes.t[:, clear]], axis=0)
    places = np.stack([x, y], axis=-1).reshape(-1, 2).round(9)
    columns, column = np.unique(places, axis=0, return_inverse=True)
    at_x, at_y = columns.T
    share = stress * heights[:, None] / 2  # two points of a Gauss rule along z
    return at_x, at_y, np.bincount(column.ravel(), share.ravel()).astype(np.float64)


def _integral(model: PadModel, x: Array, y: Array) -> Array:
    """The same of a model, at any places."""
    pad = model.sensor
    constant = stress_optic_constant(pad.transducer.photoelastic, pad.polariscope.wavelength)
    (columns, column), (rows, row) = (np.unique(places, return_inverse=True) for places in (x, y))
    everywhere = model.influence.matrix(columns, rows)[0] @ np.tile([1.0, 0.0, 0.0], 4)
    modes = everywhere.reshape(-1, len(rows), len(columns))[:, row, column]
    return model.influence.profile.sum(axis=0) @ modes / constant


def test_what_the_sides_change_is_what_scikit_fem_finds(
    model: PadModel, rollers: PadModel, problem: Problem
) -> None:
    x, y, own = _by_scikit_fem(problem, model.sensor, model.sensor.transducer.sides)
    expected = own - _by_scikit_fem(problem, model.sensor, "roller")[2]
    found = _integral(model, x, y) - _integral(rollers, x, y)
    np.testing.assert_allclose(found, expected, atol=0.03 * np.abs(expected).max())
    assert np.abs(expected).max() > 0.1 * np.abs(own).max()


def test_a_frame_is_read_within_its_own_deviations(model: PadModel) -> None:
    forces = np.array([[2.0, 0.3, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, -0.2], [0.5, 0.1, 0.1]])
    reading = ff.Reader(model).read(model.expose(forces, rng=1))
    assert reading.status is ff.Status.OK
    assert (np.abs(reading.forces - forces) < 5 * reading.std).all()


def test_progress_is_told_to_its_end(model: PadModel) -> None:
    assert TOLD[0][1] == 0
    assert TOLD[-1][1] == TOLD[-1][2] == len(TOLD) - 1
