"""The paper's example: one design in both of its cases, under the paper's load."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.contacts.loads import paper_load
from fringeforce.design.strip import Sensor
from fringeforce.mechanics.elasticity import Displacement, unit_displacements
from fringeforce.mechanics.mesh import Mesh, paper_mesh, strip_mesh
from fringeforce.mechanics.stress import stress_field
from fringeforce.models.strip import SensorModel, characterize
from fringeforce.optics.photoelasticity import (
    phase_lead_rectangle_rule,
    stress_optic_constant,
)
from fringeforce.studies.range import CASES

DEPTHS = (0.5e-3, 1.5e-3, 2.5e-3)


@dataclass(frozen=True)
class PaperExample:
    """A design in both of the paper's cases, under the paper's load."""

    sensor: Sensor

    @cached_property
    def models(self) -> dict[str, SensorModel]:
        """Characterised sensors by the kind of their edges."""
        return {
            edges: characterize(self.sensor.replace(**{"transducer.edges": edges}))
            for edges in CASES
        }

    @cached_property
    def forces(self) -> Array:
        """The load of the paper's example, 1 N at 10 degrees on every tactel, shape (n, 2)."""
        return paper_load(self.sensor.tactels.count)

    @cached_property
    def x(self) -> Array:
        """Evenly spaced positions for curves [m]."""
        half = self.sensor.transducer.length / 2
        return np.linspace(-half, half, 1501)

    @cached_property
    def constant(self) -> float:
        """K_t [rad/(Pa m)]."""
        return stress_optic_constant(
            self.sensor.transducer.photoelastic, self.sensor.polariscope.wavelength
        )

    def phase(self, edges: str) -> Array:
        """Phase lead under the load at `x` [rad]."""
        return self.models[edges].phase(self.forces, self.x)

    def displacement(self, edges: str, mesh: Mesh | None = None) -> Displacement:
        """Displacements of one case on the default mesh or another."""
        strip = self.sensor.replace(**{"transducer.edges": edges}).transducer
        tactels = self.sensor.tactels.positions
        return unit_displacements(strip, tactels, mesh or strip_mesh(strip, tactels))

    def stresses(self, edges: str, x: Array, z: Array) -> Array:
        """Stresses sigma_x, sigma_z, tau_xz under the load, shape (3, len(x), len(z)) [Pa]."""
        return stress_field(self.displacement(edges).superposed(self.forces), x, z)


def rectangle_rule(study: PaperExample) -> tuple[Array, Array]:
    """Phase on the paper's mesh, integrated consistently and by equation (3), at `study.x`."""
    sensor = study.sensor
    mesh = paper_mesh(sensor.transducer, sensor.tactels.positions)
    nodes = mesh.z[mesh.z <= -sensor.transducer.compliant.thickness * (1 - 1e-9)]
    displacement = study.displacement("free", mesh).superposed(study.forces)
    sigma_x = stress_field(displacement, study.x, nodes)[0]
    rule = phase_lead_rectangle_rule(sigma_x, nodes[1] - nodes[0], study.constant)
    model = characterize(sensor.replace(**{"transducer.edges": "free"}), mesh="paper")
    return model.phase(study.forces, study.x), rule
