"""The phase under large strain beside NGSolve, an independent program, in plane strain.

    python benchmarks/finite_strain.py [largest force in newtons ...]

Both solve the paper's strip with hyperelastic layers under loads on patches of 0.5 mm: NGSolve
from its symbolic energy, on even elements of order 4 and by Newton steps of its own, ours on a
graded mesh.  law: of both layers, with the same moduli; Mooney and Rivlin's and Yeoh's under the
largest force alone.  loads: dead, or follower, whose tractions per deformed length NGSolve has in
its weak form, by the chords of the patches in the last solution until these stay.  The light is
integrated along vertical lines through NGSolve's deformed section by cubic splines.  off: largest
difference of the phases over the peak; ends: the same in the last half millimetre of the strip,
where the stress at the bonded corners has no bound; linear: that of the linear phase of ours,
beside the ends.  s: time of each, one thread.
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
SAME_CHORD = 1e-6
"""Change of the chords of patches, over their width, at which follower loads are solved."""
HEIGHTS, STATIONS = 12, 4000
"""Gauss heights of the clear layer, and places along it, where the light is sampled."""
SENSOR = ff.load_sensor("saad").replace(
    **{
        "tactels.contact_width": WIDTH,
        "transducer.plane": "strain",
        "transducer.strain": "finite",
    }
)
LAWS = {
    "neo-Hookean": {},
    "Mooney-Rivlin": {"mooney_rivlin": [0.6, 0.4]},
    "Yeoh": {"yeoh": [1.0, 2.0, 5.0]},
}
"""What both layers state beside their moduli; Yeoh's is stiffer by a tenth at 10 % of strain."""
END = 0.5e-3
"""What counts as an end of the strip [m]."""
MM = 1e3
"""Lengths of NGSolve's mesh are in millimetres, stresses in megapascals."""


def by_ngsolve(sensor: ff.Sensor, forces: NDArray, pixels: NDArray) -> NDArray:
    """Phase lead at the pixels [rad]."""
    strip = sensor.transducer
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
    names = strip.compliant.coefficients
    c = {name: by_layer(*(one.coefficients[name] / 1e6 for one in layers)) for name in names}
    bulk = by_layer(*(one.youngs_modulus / (3 - 6 * one.poissons_ratio) / 1e6 for one in layers))
    gradient = ng.Id(2) + ng.Grad(shift)
    volume = ng.Det(gradient)
    right = gradient.trans * gradient
    trace, squared = ng.Trace(right) + 1, ng.InnerProduct(right, right) + 1
    first, second = (
        volume ** (-2 / 3) * trace - 3,
        volume ** (-4 / 3) * (trace**2 - squared) / 2 - 3,
    )
    terms = {"C10": first, "C20": first**2, "C30": first**3, "C01": second}
    energy = sum((c[name] * terms[name] for name in names), bulk / 2 * (volume - 1) ** 2)
    load, area = ng.Parameter(0.0), strip.width * WIDTH * MM**2
    follows, half = strip.loads == "follower", WIDTH / 2 * MM
    stretches = [ng.Parameter(1.0) for _ in forces]  # of the chords of follower loads
    along, down = ng.CoefficientFunction(0.0), ng.CoefficientFunction(0.0)
    centres, top = sensor.tactels.positions * MM, depth * MM
    for centre, stretch, (normal, tangential) in zip(centres, stretches, forces, strict=True):
        inside = ng.IfPos(half**2 - (ng.x - centre) ** 2, 1 / area, 0.0) / stretch
        along, down = along + inside * tangential, down + inside * normal
    slope, other = ng.Grad(shift).Trace()[:, 0], space.TestFunction()
    rise_x, rise_z = (1 + slope[0], slope[1]) if follows else (1.0, 0.0)
    push_x, push_z = along * rise_x + down * rise_z, along * rise_z - down * rise_x
    form = ng.BilinearForm(space)
    form += ng.Variation(energy.Compile() * ng.dx(bonus_intorder=2 * ORDER))
    form += -load * (push_x * other[0] + push_z * other[1]) * ng.ds("top")
    found = ng.GridFunction(space)
    ends = mesh(np.concatenate([centres - half, centres + half]), np.full(2 * len(forces), top))
    for step in range(1, STEPS + 1):
        load.Set(step / STEPS)
        change = np.inf
        while change > SAME_CHORD:
            solvers.Newton(form, found, maxit=30, maxerr=1e-8, inverse="umfpack", printing=False)
            if not follows or step < STEPS:
                break
            left, right = np.asarray(found(ends)).reshape(2, len(forces), 2)
            now = np.linalg.norm((right - left) / (2 * half) + [1.0, 0.0], axis=1)
            change = max(abs(one - old.Get()) for one, old in zip(now, stretches, strict=True))
            for one, old in zip(now, stretches, strict=True):
                old.Set(one)
    return _phase(sensor, mesh, found, pixels)


def _phase(sensor: ff.Sensor, mesh: Any, found: Any, pixels: NDArray) -> NDArray:
    """The light's phase along vertical lines through the deformed layer."""
    layer, half = sensor.transducer.photoelastic, sensor.transducer.length / 2 * MM
    c = {"C20": 0.0, "C30": 0.0, "C01": 0.0, **layer.coefficients}
    places = np.linspace(-half, half, STATIONS) * (1 - 1e-9)
    heights, weights = leggauss(HEIGHTS)
    total = np.zeros(len(pixels))
    for height, weight in zip(heights, weights, strict=True):
        points = mesh(places, np.full(STATIONS, (height + 1) / 2 * layer.thickness * MM))
        f = np.asarray(ng.Grad(found)(points)).reshape(-1, 2, 2) + np.eye(2)
        j = np.linalg.det(f)
        # Cauchy's stress of an isotropic material by B = J^(-2/3) F F^T, along the strip less
        # across it: the isotropic part drops out
        left, unit = f @ f.transpose(0, 2, 1) / j[:, None, None] ** (2 / 3), j ** (-2 / 3)
        excess = np.trace(left, axis1=1, axis2=2) + unit - 3
        rise = c["C10"] + 2 * c["C20"] * excess + 3 * c["C30"] * excess**2
        once, twice = left[:, 0, 0] - unit, (left @ left)[:, 0, 0] - unit**2
        seen = 2 / j * ((rise + c["C01"] * (excess + 3)) * once - c["C01"] * twice)
        stands = (places + np.asarray(found(points))[:, 0]) / MM
        line = CubicSpline(stands, seen * j / f[:, 0, 0])(pixels)
        total += weight / 2 * layer.thickness * line
    constant = stress_optic_constant(layer, sensor.polariscope.wavelength)
    return phase_lead(total, constant)


def compare(law: str, loads: str, force: float, pattern: NDArray) -> None:
    """Print a row of the table."""
    both = {f"transducer.{layer}": LAWS[law] for layer in ("compliant", "photoelastic")}
    sensor = SENSOR.replace(**both, **{"transducer.loads": loads})
    model, pixels = ff.characterize(sensor), sensor.pixel_positions
    inner = np.abs(pixels) < sensor.transducer.length / 2 - END
    begun = time.perf_counter()
    theirs = by_ngsolve(sensor, force * pattern, pixels)
    between = time.perf_counter()
    ours = model.phase(force * pattern)
    ended = time.perf_counter()
    peak = np.abs(theirs).max()
    error = np.abs(ours - theirs) / peak
    linear = np.abs(model.phase(force * pattern, strain="linear") - theirs)[inner].max() / peak
    print(
        f"{law:<13s} {loads:<8s} {force:5g} {peak:6.2f} {error[inner].max():8.3%} "
        f"{error[~inner].max():8.3%} {linear:8.3%} {between - begun:11.1f} {ended - between:7.1f}",
        flush=True,
    )


def main() -> None:
    """Print the table."""
    largest = [float(text) for text in sys.argv[1:]] or [0.01, 0.5, 1.0, 2.0, 4.0]
    rng = np.random.default_rng(0)
    pattern = rng.uniform(0, 1, (SENSOR.tactels.count, 1)) * [1.0, 0.2]
    pattern /= pattern.max()
    print("law           loads        N   peak      off     ends   linear   s NGSolve  s ours")
    with ng.TaskManager():
        for law in LAWS:
            for force in largest if law == "neo-Hookean" else [max(largest)]:
                compare(law, "dead", force, pattern)
        for force in largest:
            compare("neo-Hookean", "follower", force, pattern)


if __name__ == "__main__":
    ng.SetNumThreads(1)
    main()
