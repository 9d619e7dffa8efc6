"""The influence matrix beside scikit-fem (uniform linear) and NGSolve: time, accuracy, memory.

Roller edges, because an exact solution exists.  Every row is one process of its own with one
thread, timed after a warm-up, the best of several; ratios are within this one run.
"""

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.sparse.linalg import splu

import fringeforce as ff
from fringeforce.mechanics import fourier, stress
from fringeforce.mechanics.elements import gauss_interpolation
from fringeforce.mechanics.mesh import strip_mesh
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

SENSOR = ff.load_sensor("saad").replace(**{"transducer.edges": "roller"})
STRIP, TACTELS = SENSOR.transducer, SENSOR.tactels.positions
CONSTANT = stress_optic_constant(STRIP.photoelastic, SENSOR.polariscope.wavelength)
# elements are cut this many times in each direction
SCALES = {"1x": 1, "9x": 3, "100x": 10}
Solver = Callable[[int], tuple[np.ndarray, int]]


def ours(scale: int) -> tuple[np.ndarray, int]:
    mesh = strip_mesh(STRIP, TACTELS)
    stress._solved.cache_clear()  # each run solves anew
    model = ff.characterize(SENSOR, mesh.refined(scale))
    return model.pixel_influence, int(model.provenance["unknowns"])


def scikit_fem(scale: int) -> tuple[np.ndarray, int]:
    """Uniform bilinear elements, sparse direct solve, stress from the depth integral of u."""
    from skfem import Basis, ElementQuad1, ElementVector, MeshQuad, condense
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    columns, rows = 250 * scale, 35 * scale
    a, b, half = STRIP.compliant.thickness, STRIP.photoelastic.thickness, STRIP.length / 2
    x, z = np.linspace(-half, half, columns + 1), np.linspace(-a - b, 0, rows + 1)
    basis = Basis(MeshQuad.init_tensor(x, z), ElementVector(ElementQuad1()))
    parts = []
    for layer, cover in ((STRIP.compliant, True), (STRIP.photoelastic, False)):
        young, poisson = layer.youngs_modulus, layer.poissons_ratio
        plane = young * (1 + 2 * poisson) / (1 + poisson) ** 2, poisson / (1 + poisson)
        elements = np.nonzero((basis.mesh.p[1, basis.mesh.t].mean(axis=0) > -a) == cover)[0]
        form = linear_elasticity(*lame_parameters(*plane))
        parts.append(form.assemble(basis.with_elements(elements)))
    nodes = np.asarray(basis.nodal_dofs)
    px, pz = basis.mesh.p
    sides, bottom = np.isclose(np.abs(px), half), np.isclose(pz, z[0])
    fixed = np.unique(np.concatenate([nodes[0, sides | bottom], nodes[1, bottom]]))
    grid_u, grid_w = nodes[:, np.lexsort((pz, px))].reshape(2, len(x), len(z))
    loads = np.zeros((basis.N, len(TACTELS), 2))
    for i, place in enumerate(TACTELS):
        left = np.clip(np.searchsorted(x, place) - 1, 0, len(x) - 2)
        share = (place - x[left]) / (x[left + 1] - x[left])
        for node, weight in ((left, 1 - share), (left + 1, share)):
            loads[grid_w[node, -1], i, 0] -= weight / STRIP.width
            loads[grid_u[node, -1], i, 1] += weight / STRIP.width
    condensed: Any = condense(sum(parts), np.zeros(basis.N), D=fixed)
    matrix, _, _, free = condensed
    solution = np.zeros((basis.N, 2 * len(TACTELS)))
    solution[free] = _factorised(matrix).solve(loads.reshape(basis.N, -1)[free])
    rows_clear = round(b / (a + b) * rows)
    along = np.trapezoid(solution[grid_u[:, : rows_clear + 1]], z[: rows_clear + 1], axis=1)
    young, poisson = STRIP.photoelastic.youngs_modulus, STRIP.photoelastic.poissons_ratio
    c11 = young / (1 - poisson**2)
    slope = np.diff(along, axis=0) / np.diff(x)[:, None]
    middle, pixels = (x[1:] + x[:-1]) / 2, SENSOR.pixel_positions
    sinking = solution[grid_w[:, rows_clear]]
    integral = [
        c11 * np.interp(pixels, middle, slope[:, i])
        + c11 * poisson * np.interp(pixels, x, sinking[:, i])
        for i in range(slope.shape[1])
    ]
    psi = phase_lead(np.stack(integral, axis=1), CONSTANT).reshape(-1, len(TACTELS), 2)
    return psi, int(basis.N)


def _factorised(matrix: Any) -> Any:
    """SuperLU told that the matrix is symmetric and positive, its best case."""
    symmetric = {"SymmetricMode": True, "DiagPivotThresh": 0.0}
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", options=symmetric)


def ngsolve(scale: int) -> tuple[np.ndarray, int]:
    """Our elements and order in NGSolve, statically condensed, sparse Cholesky."""
    ng: Any = import_module("ngsolve")  # only where `make bench` installed it
    netgen: Any = import_module("netgen.meshing")

    graded = strip_mesh(STRIP, TACTELS).refined(scale)
    x, z = graded.x * 1e3, graded.z * 1e3  # millimetres, newtons: netgen's points want order one
    raw = netgen.Mesh(dim=2)
    points = [[raw.Add(netgen.MeshPoint(netgen.Pnt(a, b, 0))) for b in z] for a in x]
    for number, name in enumerate(("clear", "cover"), start=1):
        raw.SetMaterial(number, name)
        raw.Add(netgen.FaceDescriptor(surfnr=number, domin=number, bc=number))
    rows, cover = len(z) - 1, -STRIP.compliant.thickness * 1e3
    for i in range(len(x) - 1):
        for j in range(rows):
            corners = [points[i][j], points[i + 1][j], points[i + 1][j + 1], points[i][j + 1]]
            raw.Add(netgen.Element2D(2 if z[j] > cover - 1e-9 else 1, corners))
    for i in range(len(x) - 1):
        raw.Add(netgen.Element1D([points[i][0], points[i + 1][0]], index=1))
        raw.Add(netgen.Element1D([points[i + 1][-1], points[i][-1]], index=2))
    for j in range(rows):
        raw.Add(netgen.Element1D([points[-1][j], points[-1][j + 1]], index=3))
        raw.Add(netgen.Element1D([points[0][j + 1], points[0][j]], index=3))
    for number, name in enumerate(("bottom", "top", "side")):
        raw.SetBCName(number, name)
    mesh = ng.Mesh(raw)
    space = ng.H1(mesh, order=graded.order, dirichlet="bottom|side") * ng.H1(
        mesh, order=graded.order, dirichlet="bottom"
    )
    (u, w), (du, dw) = space.TnT()

    def moduli(kind: int) -> Any:
        values = []
        for layer in (STRIP.photoelastic, STRIP.compliant):
            c11 = layer.youngs_modulus * 1e-6 / (1 - layer.poissons_ratio**2)
            c12 = c11 * layer.poissons_ratio
            values.append((c11, c12, (c11 - c12) / 2)[kind])
        return mesh.MaterialCF({"clear": values[0], "cover": values[1]})

    c11, c12, shear = (moduli(kind) for kind in range(3))
    gu, gw, gdu, gdw = ng.grad(u), ng.grad(w), ng.grad(du), ng.grad(dw)
    form = ng.BilinearForm(space, symmetric=True, condense=True)
    form += (
        c11 * (gu[0] * gdu[0] + gw[1] * gdw[1])
        + c12 * (gu[0] * gdw[1] + gw[1] * gdu[0])
        + shear * (gu[1] + gw[0]) * (gdu[1] + gdw[0])
    ) * ng.dx
    form.Assemble()
    inverse = form.mat.Inverse(space.FreeDofs(coupling=True), inverse="sparsecholesky")
    gauss, weights = np.polynomial.legendre.leggauss(graded.order)
    clear = z[z <= cover + 1e-9]
    heights = ((clear[1:] + clear[:-1])[:, None] + np.diff(clear)[:, None] * gauss).ravel() / 2
    depth = (np.diff(clear)[:, None] * weights).ravel() / 2
    grid = mesh(
        *(part.ravel() for part in np.meshgrid(graded.stations * 1e3, heights, indexing="ij"))
    )
    columns = []
    for place in TACTELS * 1e3:
        for component in (1, 0):
            load = ng.LinearForm(space)
            sign = -1.0 if component == 1 else 1.0
            test = (du, dw)[component]
            load += test(place, 0.0)
            load.Assemble()
            load.vec.data *= sign / (STRIP.width * 1e3)
            field = ng.GridFunction(space)
            rhs = load.vec.CreateVector()
            rhs.data = load.vec + form.harmonic_extension_trans * load.vec
            field.vec.data = inverse * rhs
            field.vec.data += form.harmonic_extension * field.vec
            field.vec.data += form.inner_solve * load.vec
            fu, fw = field.components
            stress = c11 * ng.grad(fu)[0] + c12 * ng.grad(fw)[1]
            columns.append(np.reshape(stress(grid), (-1, len(depth))) @ depth * 1e3)
    to_pixels = gauss_interpolation(graded.order, graded.x, SENSOR.pixel_positions)
    psi = to_pixels @ phase_lead(np.stack(columns, axis=1), CONSTANT)
    return psi.reshape(-1, len(TACTELS), 2), int(space.ndof)


SOLVERS: dict[str, Solver] = {
    "fringeforce": ours,
    "scikit-fem, linear": scikit_fem,
    "NGSolve, same mesh": ngsolve,
}


def measure(name: str, scale: int) -> None:
    """Print one row as JSON: time, unknowns, error, peak memory; run in a process of its own."""
    solver = SOLVERS[name]
    psi, unknowns = solver(scale)
    times = []
    while not times or (sum(times) < 2 and len(times) < 10):
        start = time.perf_counter()
        solver(scale)
        times.append(time.perf_counter() - start)
    exact = phase_lead(
        fourier.integrated_stress(STRIP, TACTELS, SENSOR.pixel_positions, terms=1500), CONSTANT
    )
    error = (np.linalg.norm(psi - exact, axis=0) / np.linalg.norm(exact, axis=0)).max()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({"seconds": min(times), "unknowns": unknowns, "error": error, "MB": peak}))


def main() -> None:
    table = Table(title="psi of the paper's design, roller edges, one thread")
    for column in ("solver", "scale", "unknowns", "error", "time", "against ours", "peak memory"):
        table.add_column(column, justify="left" if column == "solver" else "right")
    threads = {f"{name}_NUM_THREADS": "1" for name in ("OPENBLAS", "OMP", "MKL", "NGS")}
    costs = []
    for label, scale in SCALES.items():
        reference = None
        for name in SOLVERS:
            command = [sys.executable, __file__, name, str(scale)]
            run = subprocess.run(
                command, capture_output=True, text=True, check=False, env=os.environ | threads
            )
            if run.returncode:
                reason = (run.stderr.strip().splitlines() or ["killed"])[-1]
                table.add_row(name, label, reason[:40])
                continue
            row = json.loads(run.stdout.splitlines()[-1])
            reference = reference or row["seconds"]
            if name == "fringeforce":
                costs.append((row["unknowns"], row["seconds"]))
            ratio = row["seconds"] / reference
            table.add_row(
                name, label, f"{row['unknowns']:,}", f"{row['error']:.1e}",
                f"{row['seconds']:.3f} s", f"{ratio:.2f}", f"{row['MB']:.0f} MB",
            )  # fmt: skip
    console = Console(width=110)
    console.print(table)
    (first, t_first), (last, t_last) = costs[0], costs[-1]
    exponent = np.log(t_last / t_first) / np.log(last / first)
    console.print(f"cost grows as unknowns^{exponent:.2f} from {first:,} to {last:,}")


if __name__ == "__main__":
    if len(sys.argv) == 3:
        measure(sys.argv[1], int(sys.argv[2]))
    else:
        main()
