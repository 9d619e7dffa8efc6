"""Strain energies against closed forms of incompressible rubber, and their derivatives.

Treloar, The Physics of Rubber Elasticity, 3rd ed., chapters 5 and 10; Holzapfel, Nonlinear Solid
Mechanics, section 6.5: the Cauchy stresses of principal stretches l1, l2, l3 differ by
s1 - s2 = 2 (l1^2 - l2^2) (W1 + l3^2 W2), with W1 and W2 the derivatives of the energy by the
invariants I1 and I2.
"""

from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from fringeforce.base.errors import InputError
from fringeforce.design.parts import Layer
from fringeforce.mechanics.hyperelasticity import Hyperelastic

Array = NDArray[np.float64]
Plane = Literal["stress", "strain"]
BULK = 80e6
MATERIALS = {
    "neo-Hookean": Hyperelastic((0.5e6,), BULK),
    "Mooney-Rivlin": Hyperelastic((0.4e6,), BULK, second=0.15e6),
    "Yeoh": Hyperelastic((0.5e6, -0.05e6, 0.02e6), BULK),
}
LAWS: dict[str, dict[str, tuple[float, ...]]] = {
    "neo-Hookean": {},
    "Mooney-Rivlin": {"mooney_rivlin": (0.7, 0.3)},
    "Yeoh": {"yeoh": (1.0, -0.1, 0.04)},
}
named = pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)
lawful = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
planes = pytest.mark.parametrize("plane", ["stress", "strain"])
stretched = pytest.mark.parametrize("stretch", [0.7, 1.3, 1.8])
ROTATION = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])


def _layer(law: dict[str, Any], poissons_ratio: float = 0.4999999) -> Layer:
    moduli = {"youngs_modulus": 3e6, "poissons_ratio": poissons_ratio}
    return Layer.model_validate({"thickness": 1e-3, **moduli, **law})


def _derivatives(layer: Layer, first: float) -> tuple[float, float]:
    """W1 and W2 of the textbooks [Pa]."""
    c = layer.coefficients
    excess = first - 3
    rise = c["C10"] + 2 * c.get("C20", 0) * excess + 3 * c.get("C30", 0) * excess**2
    return rise, c.get("C01", 0.0)


@named
@planes
def test_a_rotation_causes_no_stress(material: Hyperelastic, plane: Plane) -> None:
    found = material.plane(ROTATION, plane)
    np.testing.assert_allclose(found.stress, 0, atol=1e-7 * BULK)
    assert found.energy == pytest.approx(0, abs=1e-7 * BULK)


@named
@planes
def test_rotations_turn_stresses_and_change_no_energy(material: Hyperelastic, plane: Plane) -> None:
    """Before the deformation (isotropy) and behind it (objectivity)."""
    gradient = np.array([[1.2, 0.3], [-0.1, 0.8]])
    found = material.plane(gradient, plane)
    for turned, stress in (
        (ROTATION @ gradient, ROTATION @ found.stress),
        (gradient @ ROTATION, found.stress @ ROTATION),
    ):
        other = material.plane(turned, plane)
        assert other.energy == pytest.approx(found.energy, rel=1e-12)
        np.testing.assert_allclose(other.stress, stress, atol=1e-10 * BULK)


@named
@planes
def test_stress_and_tangent_are_derivatives_of_the_energy(
    material: Hyperelastic, plane: Plane
) -> None:
    gradient = np.array([[1.2, 0.3], [-0.1, 0.8]])
    found, step = material.plane(gradient, plane), 1e-6
    for i, k in np.ndindex(2, 2):
        change = np.zeros((2, 2))
        change[i, k] = step
        up, down = (material.plane(gradient + s * change, plane) for s in (1, -1))
        slope = (up.energy - down.energy) / (2 * step)
        assert slope == pytest.approx(found.stress[i, k], rel=1e-6, abs=10)
        curve = (up.stress - down.stress) / (2 * step)
        np.testing.assert_allclose(curve, found.tangent[i, k], rtol=1e-6, atol=1e-6 * BULK)


@lawful
@pytest.mark.parametrize("poissons_ratio", [0.3, 0.49])
def test_the_tangent_without_load_is_hookes_law(law: dict[str, Any], poissons_ratio: float) -> None:
    """Timoshenko and Goodier, sections 11 and 12."""
    layer = _layer(law, poissons_ratio)
    e, nu, material = layer.youngs_modulus, poissons_ratio, Hyperelastic.of(layer)
    stress = e / (1 - nu**2)
    strain = e / ((1 + nu) * (1 - 2 * nu))
    assert sum(
        layer.coefficients[name] for name in ("C10", "C01") if name in layer.coefficients
    ) == (pytest.approx(e / (4 * (1 + nu)), rel=1e-12))
    for plane, c11, c12 in (
        ("stress", stress, nu * stress),
        ("strain", (1 - nu) * strain, nu * strain),
    ):
        tangent = material.plane(np.eye(2), plane).tangent
        shear = e / (2 * (1 + nu))
        for found, expected in (
            (tangent[0, 0, 0, 0], c11),
            (tangent[0, 0, 1, 1], c12),
            (tangent[0, 1, 0, 1], shear),
            (tangent[0, 1, 1, 0], shear),
        ):
            assert found == pytest.approx(expected, rel=1e-9)


@lawful
@stretched
def test_uniaxial_tension_is_that_of_the_textbook(law: dict[str, Any], stretch: float) -> None:
    layer = _layer(law)
    material = Hyperelastic.of(layer)

    def pulled(other: float) -> float:
        return float(material.plane(np.diag([stretch, other]), "stress").stress[1, 1])

    other: Any = brentq(pulled, 0.9 / np.sqrt(stretch), 1.1 / np.sqrt(stretch), xtol=1e-15)
    first, second = _derivatives(layer, stretch**2 + 2 / stretch)
    expected = 2 * (stretch - stretch**-2) * (first + second / stretch)
    found = material.plane(np.diag([stretch, other]), "stress")
    assert found.stress[0, 0] == pytest.approx(expected, rel=1e-5)
    assert found.across == pytest.approx(1 / np.sqrt(stretch), rel=1e-5)


@lawful
@stretched
def test_equibiaxial_tension_is_that_of_the_textbook(law: dict[str, Any], stretch: float) -> None:
    layer = _layer(law)
    found = Hyperelastic.of(layer).plane(np.diag([stretch, stretch]), "stress")
    first, second = _derivatives(layer, 2 * stretch**2 + stretch**-4)
    expected = 2 * (stretch - stretch**-5) * (first + stretch**2 * second)
    np.testing.assert_allclose(np.diag(found.stress), expected, rtol=1e-5)
    assert found.across == pytest.approx(stretch**-2, rel=1e-5)


@lawful
@stretched
def test_pure_shear_is_that_of_the_textbook(law: dict[str, Any], stretch: float) -> None:
    """Of a wide sheet whose width is held, in the plane of the sheet and across it."""
    layer = _layer(law)
    material = Hyperelastic.of(layer)
    first, second = _derivatives(layer, stretch**2 + 1 + stretch**-2)
    pulled = 2 * (stretch - stretch**-3) * (first + second)
    held = 2 * (1 - stretch**-2) * (first + stretch**2 * second)
    sheet = material.plane(np.diag([stretch, 1.0]), "stress")
    np.testing.assert_allclose(np.diag(sheet.stress), [pulled, held], rtol=1e-5)
    edge = material.plane(np.diag([stretch, 1 / stretch]), "strain")
    cauchy = np.diag(edge.stress) * [stretch, 1 / stretch]
    assert cauchy[0] - cauchy[1] == pytest.approx(stretch * pulled, rel=1e-5)
    assert edge.stress_across - cauchy[1] == pytest.approx(held, rel=1e-5)


@lawful
@planes
@pytest.mark.parametrize("shear", [-0.4, 0.9])
def test_simple_shear_is_that_of_the_textbook(
    law: dict[str, Any], plane: Plane, shear: float
) -> None:
    """With Rivlin's difference of the normal stresses, which all isotropic materials have."""
    layer = _layer(law)
    gradient = np.array([[1.0, shear], [0.0, 1.0]])
    cauchy = Hyperelastic.of(layer).plane(gradient, plane).stress @ gradient.T
    expected = 2 * shear * sum(_derivatives(layer, 3 + shear**2))
    assert cauchy[0, 1] == pytest.approx(expected, rel=1e-5)
    assert cauchy[0, 0] - cauchy[1, 1] == pytest.approx(shear * expected, rel=1e-5)


@planes
@pytest.mark.parametrize("law", [{"mooney_rivlin": (1.0, 0.0)}, {"yeoh": (1.0, 0.0, 0.0)}])
def test_without_further_coefficients_a_layer_is_neo_hookean(
    law: dict[str, Any], plane: Plane
) -> None:
    gradient = np.array([[1.2, 0.3], [-0.1, 0.8]])
    found, plain = (Hyperelastic.of(_layer(one, 0.45)).plane(gradient, plane) for one in (law, {}))
    np.testing.assert_array_equal(found.stress, plain.stress)
    np.testing.assert_array_equal(found.tangent, plain.tangent)


def test_what_is_not_stable_at_small_strain_is_refused() -> None:
    with pytest.raises(InputError, match="shear modulus"):
        Hyperelastic((0.1e6,), BULK, second=-0.2e6)
    with pytest.raises(InputError, match="bulk modulus"):
        Hyperelastic((0.1e6,), 0.0)
