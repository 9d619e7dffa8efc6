"""The stiffness of short waves on a surface, against closed forms."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.mechanics.finite_strain import finite_strip
from fringeforce.mechanics.hyperelasticity import Hyperelastic
from fringeforce.mechanics.surface_stability import surface_stiffness

Array = NDArray[np.float64]
HARD = Hyperelastic((0.5e6,), bulk=1e11)
"""Nearly incompressible, of a shear modulus of 1 MPa."""


def _least(gradient: Array) -> float:
    return float(surface_stiffness(HARD.plane(gradient[:, :, None], "strain").tangent)[0])


def _relaxed(along: float) -> Array:
    """A stretch along the surface, nothing pressing on it."""

    def pressure(across: float) -> float:
        return float(HARD.plane(np.diag([along, across])[:, :, None], "strain").stress[1, 1, 0])

    return np.diag([along, brentq(pressure, 0.99 / along, 1.01 / along, xtol=1e-14)])


def test_a_compressed_surface_folds_at_the_stretch_of_biot() -> None:
    """In plane strain, where the stretch x solves x^6 + x^4 + 3 x^2 = 1."""
    stretch = brentq(lambda x: x**6 + x**4 + 3 * x**2 - 1, 0.4, 0.7)
    assert brentq(lambda x: _least(_relaxed(x)), 0.4, 0.7) == pytest.approx(stretch, rel=1e-4)


def test_dead_pressure_on_a_block_that_cannot_widen_folds_it_at_twice_its_shear_modulus() -> None:
    """From the stream function of an incompressible half-plane under equal pressures."""

    def at(pressure: float) -> float:
        def left(stretch: float) -> float:
            gradient = np.diag([stretch, stretch])[:, :, None]
            return float(HARD.plane(gradient, "strain").stress[1, 1, 0]) + pressure

        stretch = brentq(left, 0.99, 1.0, xtol=1e-15)
        return _least(np.diag([stretch, stretch]))

    assert brentq(at, 0.5e6, 3e6) == pytest.approx(2e6, rel=1e-3)


def test_the_unstrained_surface_has_the_stiffness_of_linear_elasticity() -> None:
    """Of incompressible material tractions are 2 mu k times the displacements of a wave."""
    assert _least(np.eye(2)) == pytest.approx(2e6, rel=1e-3)


def test_solids_that_shear_bands_cross_are_unstable() -> None:
    moduli = HARD.plane(np.eye(2)[:, :, None], "strain").tangent.copy()
    moduli[0, 1, 0, 1] *= -1
    assert surface_stiffness(moduli)[0] == -np.inf


@pytest.mark.parametrize(("order", "share"), [(4, np.inf), (5, 1 / 4), (6, 1 / 8)])
def test_narrow_dead_contacts_fold_at_one_load_on_every_mesh(
    sensor: ff.Sensor, order: int, share: float
) -> None:
    """Coarse elements alone would find a stable state up to half as much."""
    strip = finite_strip(sensor.transducer, [0.0], [2e-4], order=order, share=share)
    whole = 11e6 * 2e-4 * 2e-3
    strip.solved([[0.30 * whole, 0.03 * whole]])
    with pytest.raises(InputError, match="folds"):
        strip.solved([[0.33 * whole, 0.033 * whole]])
