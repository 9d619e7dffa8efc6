"""Elastic moduli of one isotropic layer, in a plane and in three dimensions."""

from __future__ import annotations

from dataclasses import dataclass

from fringeforce.base.errors import InputError
from fringeforce.design.strip import Layer, Plane


@dataclass(frozen=True)
class PlaneModuli:
    """Stiffness of an isotropic layer in the x-z plane [Pa].

    sigma_x = c11 eps_x + c12 eps_z,  sigma_z = c12 eps_x + c11 eps_z,  tau_xz = shear gamma_xz.
    """

    c11: float
    c12: float

    @property
    def shear(self) -> float:
        """Shear modulus [Pa]; isotropy makes it (c11 - c12) / 2 in both plane states."""
        return (self.c11 - self.c12) / 2


def plane_moduli(layer: Layer, plane: Plane) -> PlaneModuli:
    """Plane-stress or plane-strain stiffness (Timoshenko and Goodier, sections 11 and 12).

    Raises
    ------
    InputError
        If the design asks for three dimensions, which no plane has.
    """
    if plane == "given":
        raise InputError(
            "The influence matrix of this model was given, so that the mechanics cannot be solved "
            "for anything else; give a matrix for that, or a design with layers."
        )
    if plane == "3d":
        raise InputError(
            'transducer.plane = "3d", but a plane model of the strip is asked for; take '
            'plane = "stress" or "strain" here.'
        )
    e, nu = layer.youngs_modulus, layer.poissons_ratio
    if plane == "stress":
        c11 = e / (1 - nu**2)
        return PlaneModuli(c11=c11, c12=nu * c11)
    scale = e / ((1 + nu) * (1 - 2 * nu))
    return PlaneModuli(c11=(1 - nu) * scale, c12=nu * scale)


def lame_parameters(layer: Layer) -> tuple[float, float]:
    """Lame's lambda and the shear modulus mu of a layer [Pa]."""
    e, nu = layer.youngs_modulus, layer.poissons_ratio
    return e * nu / ((1 + nu) * (1 - 2 * nu)), e / (2 * (1 + nu))
