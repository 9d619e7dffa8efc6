"""The phase under large strain beside NGSolve, an independent program, in plane strain.

    python benchmarks/finite_strain.py [largest force in newtons ...]

Both solve the paper's strip with neo-Hookean layers under dead loads on patches of 0.5 mm: NGSolve
from its symbolic energy, on even elements of order 4 and by Newton steps of its own, ours on a
graded mesh.  The light is integrated along vertical lines through NGSolve's deformed section by
cubic splines.  off: largest difference of the phases over the peak; ends: the same in the last
half millimetre of the strip, where the stress at the bonded corners has no bound; linear: that of
the linear phase of ours, beside the ends.  s: time of each, one thread.
"""

from __future__ import annotations

import sys
import time
from importlib import import_module
from typing import Any

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

import fringeforce as ff
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

ng: Any = import_module("ngsolve")  # only where `make bench` installed it
meshes: Any = import_module("ngsolve.meshes")
solvers: Any = import_module("ngsolve.solvers")

WIDTH, ORDER = 0.5e-3, 4
COLUMNS, COVER, CLEAR = 200, 4, 6
"""Elements along the strip, whose edges meet those of the patches, and over the layers."""
STEPS = 4
"""Load steps."""
HEIGHTS, STATIONS = 12, 4000
"""Gauss heights of the clear layer, and places along it, where the light is sampled."""
SENSOR = ff.load_sensor("saad").replace(
    **{"tactels.contact_width": WIDTH, "transducer.plane": "strain"}
)
END = 0.5e-3
"""What counts as an end of the strip [m]."""
MM = 1e3
"""Lengths of NGSolve's mesh are in millimetres, stresses in megapascals."""


def by_ngsolve(forces: NDArray, pixels: NDArray) -> NDArray:
    """Phase lead at the pixels [rad]."""
    strip = SENSOR.transducer
    depth, clear = strip.compliant.thickness + strip.photoelastic.thickness, CLEAR / (COVER + CLEAR)
    boundary = strip.photoelastic.thickness

    def place(u: float, v: float) -> tuple[float, float]:
        above = boundary + (v - clear) / (1 - clear) * (depth - boundary)
        return (u - 0.5) * strip.length * MM, (v / clear * boundary if v < clear else above) * MM

    mesh = meshes.MakeStructured2DMesh(quads=True, nx=COLUMNS, ny=COVER + CLEAR, mapping=place)
    space = ng.VectorH1(mesh, order=ORDER, dirichlet="bottom")
    shift = space.TrialFunction()

    def by_layer(cover: float, below: float) -> Any:
        return ng.IfPos(ng.y - boundary * MM, cover, below)

    layers = strip.compliant, strip.photoelastic
    shear = by_layer(*(one.youngs_modulus / (2 + 2 * one.poissons_ratio) / 1e6 for one in layers))
    bulk = by_layer(*(one.youngs_modulus / (3 - 6 * one.poissons_ratio) / 1e6 for one in layers))
    gradient = ng.Id(2) + ng.Grad(shift)
    volume = ng.Det(gradient)
    square = ng.InnerProduct(gradient, gradient) + 1
    energy = shear / 2 * (volume ** (-2 / 3) * square - 3) + bulk / 2 * (volume - 1) ** 2
    load, area = ng.Parameter(0.0), strip.width * WIDTH * MM**2
    along, down = ng.CoefficientFunction(0.0), ng.CoefficientFunction(0.0)
    for centre, (normal, tangential) in zip(SENSOR.tactels.positions, forces, strict=True):
        inside = ng.IfPos((WIDTH / 2 * MM) ** 2 - (ng.x - centre * MM) ** 2, 1 / area, 0.0)
        along, down = along + inside * tangential, down + inside * normal
    form = ng.BilinearForm(space)
    form += ng.Variation(energy.Compile() * ng.dx(bonus_intorder=2 * ORDER))
    form += ng.Variation(load * (down * shift[1] - along * shift[0]) * ng.ds("top"))
    found = ng.GridFunction(space)
    for step in range(1, STEPS + 1):
        load.Set(step / STEPS)
        solvers.Newton(form, found, maxit=30, maxerr=1e-8, printing=False)
    return _phase(mesh, found, pixels)


def _phase(mesh: Any, found: Any, pixels: NDArray) -> NDArray:
    """The light's phase along vertical lines through the deformed layer."""
    layer, half = SENSOR.transducer.photoelastic, SENSOR.transducer.length / 2 * MM
    shear = layer.youngs_modulus / (2 + 2 * layer.poissons_ratio)
    places = np.linspace(-half, half, STATIONS) * (1 - 1e-9)
    heights, weights = leggauss(HEIGHTS)
    total = np.zeros(len(pixels))
    for height, weight in zip(heights, weights, strict=True):
        points = mesh(places, np.full(STATIONS, (height + 1) / 2 * layer.thickness * MM))
        f = np.asarray(ng.Grad(found)(points)).reshape(-1, 2, 2) + np.eye(2)
        j = np.linalg.det(f)
        # along and across: the isotropic part drops out
        seen = shear * j ** (-5 / 3) * ((f[:, 0] ** 2).sum(axis=1) - 1)
        stands = (places + np.asarray(found(points))[:, 0]) / MM
        line = CubicSpline(stands, seen * j / f[:, 0, 0])(pixels)
        total += weight / 2 * layer.thickness * line
    constant = stress_optic_constant(layer, SENSOR.polariscope.wavelength)
    return phase_lead(total, constant)


def main() -> None:
    """Print the table."""
    largest = [float(text) for text in sys.argv[1:]] or [0.01, 0.5, 1.0, 2.0, 4.0]
    model, rng = ff.characterize(SENSOR), np.random.default_rng(0)
    pattern = rng.uniform(0, 1, (SENSOR.tactels.count, 1)) * [1.0, 0.2]
    pattern /= pattern.max()
    pixels = SENSOR.pixel_positions
    inner = np.abs(pixels) < SENSOR.transducer.length / 2 - END
    print("   N   peak      off     ends   linear   s NGSolve  s ours")
    with ng.TaskManager():
        for force in largest:
            begun = time.perf_counter()
            theirs = by_ngsolve(force * pattern, pixels)
            between = time.perf_counter()
            ours = model.phase(force * pattern, strain="finite")
            ended = time.perf_counter()
            peak = np.abs(theirs).max()
            error = np.abs(ours - theirs) / peak
            linear = np.abs(model.phase(force * pattern) - theirs)[inner].max() / peak
            print(
                f"{force:5g} {peak:6.2f} {error[inner].max():8.3%} {error[~inner].max():8.3%} "
                f"{linear:8.3%} {between - begun:11.1f} "
                f"{ended - between:7.1f}",
                flush=True,
            )


if __name__ == "__main__":
    ng.SetNumThreads(1)
    main()
