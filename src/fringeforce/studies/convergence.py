"""Convergence: how far finer elements move the influence matrix."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.design.strip import Sensor
from fringeforce.mechanics import fourier
from fringeforce.mechanics.mesh import ORDER, Mesh, paper_mesh, strip_mesh
from fringeforce.models.strip import characterize
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant
from fringeforce.plotting import axes as plot
from fringeforce.studies.study_result import StudyResult

ORDERS, REFINEMENTS = range(2, 10), (1, 2, 3)
FINEST = 12
"""Order of the elements that stand for the exact solution where none is known."""
TERMS = 1500
"""Terms of the exact series for roller edges."""


def relative_error(found: Array, reference: Array) -> float:
    """Largest relative L2 error over the columns of an influence matrix (m, n, 2)."""
    difference = np.linalg.norm(found - reference, axis=0)
    return float((difference / np.linalg.norm(reference, axis=0)).max())


def reference_influence(sensor: Sensor) -> Array:
    """Influence matrix at the pixels: exact for roller edges, of high order for free ones.

    Parameters
    ----------
    sensor : Sensor
        The design.

    Returns
    -------
    ndarray, shape (n_pixels, n, 2)
        Phase lead per force [rad/N].
    """
    strip, tactels, x = sensor.transducer, sensor.tactels.positions, sensor.pixel_positions
    if strip.edges == "roller":
        constant = stress_optic_constant(strip.photoelastic, sensor.polariscope.wavelength)
        return phase_lead(fourier.integrated_stress(strip, tactels, x, terms=TERMS), constant)
    return characterize(sensor, strip_mesh(strip, tactels, FINEST)).influence(x)


def mesh_errors(sensor: Sensor) -> Iterator[tuple[str, list[int], list[float]]]:
    """Unknowns and errors of the influence matrix, by family of meshes."""
    strip, tactels = sensor.transducer, sensor.tactels.positions
    reference = reference_influence(sensor)
    families: dict[str, Callable[[], list[Mesh]]] = {
        "paper's mesh, order 1, refined": lambda: [
            paper_mesh(strip, tactels).refined(factor) for factor in REFINEMENTS
        ],
        f"our mesh, order {ORDERS[0]} to {ORDERS[-1]}": lambda: [
            strip_mesh(strip, tactels, order) for order in ORDERS
        ],
    }
    for label, build in families.items():
        meshes = build()
        found = (characterize(sensor, mesh).influence(sensor.pixel_positions) for mesh in meshes)
        errors = [relative_error(psi, reference) for psi in found]
        yield label, [mesh.unknowns for mesh in meshes], errors


def convergence_study(sensor: Sensor) -> StudyResult:
    """Errors of coarse and fine meshes of one design."""
    families = list(mesh_errors(sensor))
    (_, linear, crawling), (_, ours, falling) = families
    rows = tuple(
        (label, f"{n}", f"{error:.2e}")
        for label, unknowns, errors in families
        for n, error in zip(unknowns, errors, strict=True)
    )
    rate = -np.polyfit(np.log(linear), np.log(crawling), 1)[0]
    gain = (falling[0] / falling[-1]) ** (1 / (len(falling) - 1))
    exact = sensor.transducer.edges == "roller"
    against = "the exact solution" if exact else f"elements of order {FINEST}"
    default = falling[ORDERS.index(ORDER)]
    text = (
        f"Against {against}, the default mesh (order {ORDER}, {ours[ORDERS.index(ORDER)]:,} "
        f"unknowns) has an error of {default:.1e} in its worst column. Each further order divides "
        f"the error by {gain:.1f}. The paper's linear elements stand at {crawling[0]:.1e} with "
        f"{linear[0]:,} unknowns, and their error falls as the unknowns to the power {rate:.2f}."
    )
    labels, unknowns, errors = zip(*families, strict=True)
    return StudyResult(
        "convergence",
        ("mesh", "unknowns", "relative error"),
        rows,
        text,
        lambda ax: plot.convergence(ax, unknowns, errors, labels),
    )
