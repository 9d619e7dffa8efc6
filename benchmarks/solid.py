"""What the mechanics of a planar pad costs, and how near it comes to finer elements.

Section mechanics: all 363 unit loads of the shipped pad of 25 x 25 mm with 11 x 11 tactels and
256 x 256 pixels, from the design to the model, one process each; and by how much psi changes from
elements of one order less.  Section refinement: a smaller pad whose loads are
as near to its sides, against finer elements of a higher order, for covers that are nearly
incompressible.  Section locking: a small pad with covers ever nearer to incompressible, order by
order.  Section strip: the paper's strip in three dimensions against elements of a higher
order.  Errors are those of depth integrals of sigma_x - sigma_y and 2 tau_xy together, for the
worst unit load: root mean square over the pad over its own, and largest over its own peak.  Run
with the names of sections; all by default.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

import fringeforce as ff
from fringeforce.mechanics.solid.block import Block, Patches, Sides, SolidInfluence
from fringeforce.mechanics.solid.influence import pad_influence
from fringeforce.mechanics.solid.sides import SideGrading, sided_influence
from fringeforce.mechanics.solid.strip import STRIP
from fringeforce.models.pad import PadModel, characterize_pad
from fringeforce.models.pad_slices import block_of
from fringeforce.models.strip_width import strip_width

Array = NDArray[np.float64]
STRIP_DESIGN = ff.load_sensor("saad")
PAD_DESIGN = ff.load_sensor("pad")
DEFAULT = SideGrading()
FINER = replace(DEFAULT, order=6, side=0.07)
MESHES = {
    "order 6, finer at the sides": FINER,
    "order 3": replace(DEFAULT, order=3),
    "order 4": replace(DEFAULT, order=4),
    "order 5 (default)": DEFAULT,
}
REFINED: list[tuple[Sides, float]] = [("free", 0.49), ("free", 0.499), ("bonded", 0.49)]
"""Sides, and Poisson's ratio of the cover."""


def integrals(found: SolidInfluence) -> Array:
    """Over the depth, of sigma_x - sigma_y and 2 tau_xy, shape (2, nx, ny, n, 3)."""
    both = (found.difference, 1.0), (found.shear, 2.0)
    return np.stack([scale * np.einsum("xyznc,z->xync", f, found.weights) for f, scale in both])


def errors(found: Array, reference: Array) -> tuple[float, float]:
    """Of the worst column: root mean square over its own, and largest over its own peak."""
    apart, size = (np.linalg.norm(field, axis=0) for field in (found - reference, reference))
    mean = np.linalg.norm(apart, axis=(0, 1)) / np.linalg.norm(size, axis=(0, 1))
    return float(mean.max()), float((apart.max(axis=(0, 1)) / size.max(axis=(0, 1))).max())


def psi(model: PadModel) -> Array:
    """Retardance per force at every fourth pixel, shape (2, pixels, 1, n, 3) [rad/N]."""
    columns, rows = (places[1::4] for places in model.sensor.pixel_positions)
    total = 2 * model.influence.profile.sum(axis=0)
    matrix = np.einsum("m,fmpn->fpn", total, model.influence.matrix(columns, rows))
    return matrix.reshape(2, len(columns) * len(rows), 1, -1, 3)


def measure(sides: Sides) -> None:
    """Print what one pad costs, and its error, as JSON; run in a process of its own."""
    pad = PAD_DESIGN.replace(**{"transducer.sides": sides})
    wall, used = time.perf_counter(), time.process_time()
    model = ff.characterize(pad)
    cost = {"seconds": time.perf_counter() - wall, "processors": time.process_time() - used}
    cost["GB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    if sides != "roller":
        patches = Patches(pad.tactels.places, pad.tactels.side)
        x, y, less = model.influence.x, model.influence.y, replace(DEFAULT, order=4)
        coarser = characterize_pad(pad, sided_influence(block_of(pad), patches, x, y, mesh=less))
        cost["mean"], cost["peak"] = errors(psi(coarser), psi(model))
    print(json.dumps(cost))


def mechanics(console: Console) -> None:
    threads = os.environ.get("OPENBLAS_NUM_THREADS", "all")
    table = Table(title=f"363 unit loads, from design to model; BLAS threads: {threads}")
    for head in ("sides", "time", "of processors", "peak memory"):
        table.add_column(head, justify="right")
    table.add_column("psi of order 4 beside 5\nroot mean square", justify="right")
    table.add_column("worst column\nlargest over peak", justify="right")
    for sides in ("roller", "free", "bonded"):
        run = subprocess.run(
            [sys.executable, __file__, "measure", sides], capture_output=True, text=True, check=True
        )
        cost: dict[str, float] = json.loads(run.stdout.splitlines()[-1])
        seconds = (f"{cost[name]:.1f} s" for name in ("seconds", "processors"))
        change = [f"{cost[name]:.2%}" if name in cost else "exact" for name in ("mean", "peak")]
        table.add_row(sides, *seconds, f"{cost['GB']:.2f} GB", *change)
    console.print(table)


def refinement(console: Console) -> None:
    for sides, ratio in REFINED:
        strip = STRIP_DESIGN.transducer
        cover = strip.compliant.model_copy(update={"poissons_ratio": ratio})
        block = Block(9e-3, 9e-3, cover, strip.photoelastic, sides)
        line = np.array([-2e-3, 0.0, 2e-3])
        places = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
        patches, x = Patches(places, 2e-3), ((np.arange(45) + 0.5) / 45 - 0.5) * 9e-3
        title = f"3 x 3 tactels on 9 x 9 mm, {sides} sides, cover's nu = {ratio}: worst of 27 loads"
        table = Table(title=title)
        for head in ("elements", "root mean square", "largest over peak", "time of processors"):
            table.add_column(head, justify="right")
        reference: Array | None = None
        solvers: dict[str, Callable[[], SolidInfluence]] = {
            name: lambda m=mesh: sided_influence(block, patches, x, x, mesh=m)  # noqa: B023
            for name, mesh in MESHES.items()
        }
        if (sides, ratio) == REFINED[0]:
            solvers["order 5, elements for all"] = lambda: pad_influence(block, patches, x, x)  # noqa: B023
        for name, solve in solvers.items():
            start = time.process_time()
            found = integrals(solve())
            seconds = time.process_time() - start
            reference = found if reference is None else reference
            told = [f"{error:.2%}" if error else "reference" for error in errors(found, reference)]
            table.add_row(name, *told, f"{seconds:.1f} s")
        console.print(table)


def locking(console: Console) -> None:
    """Elements that locked would err the more, the less a cover can be compressed."""
    layers, ratios = STRIP_DESIGN.transducer, (0.49, 0.499, 0.4999)
    patches = Patches(np.array([[0.8e-3, -0.5e-3], [-0.5e-3, 0.2e-3]]), 1e-3)
    x, y = np.linspace(-2.4e-3, 2.4e-3, 21), np.linspace(-1.9e-3, 1.9e-3, 17)
    found: dict[int, list[Array]] = {}
    for order in (2, 3, 4, 5, 6):
        mesh, found[order] = replace(DEFAULT, order=order), []
        for ratio in ratios:
            cover = layers.compliant.model_copy(update={"poissons_ratio": ratio})
            block = Block(5e-3, 4e-3, cover, layers.photoelastic, "free")
            found[order].append(integrals(sided_influence(block, patches, x, y, mesh=mesh)))
    title = "2 tactels on 5 x 4 mm, free sides: root mean square beside order 6, worst of 6 loads"
    table = Table(title=title)
    for head in ("elements", *(f"cover's nu = {ratio}" for ratio in ratios)):
        table.add_column(head, justify="right")
    references = found.pop(6)
    for order, columns in found.items():
        pairs = zip(columns, references, strict=True)
        table.add_row(f"order {order}", *(f"{errors(*pair)[0]:.2%}" for pair in pairs))
    console.print(table)


def strip(console: Console) -> None:
    forces, x = ff.polar(1.0, 10, 11), np.linspace(-12.45e-3, 12.45e-3, 500)
    half = STRIP_DESIGN.transducer.width / 2
    places = np.array([0.0, 0.5, 0.95]) * half, np.full(3, 1 / 3)
    table = Table(title="The paper's strip and load in 3-D: error of p over its largest value")
    for head in ("elements", "unknowns", "middle", "halfway", "near a face", "time"):
        table.add_column(head, justify="right")
    reference: Array | None = None
    for name, sizes in (
        ("order 6, finer corners", replace(STRIP, order=6, corner=0.05)),
        ("order 3", replace(STRIP, order=3)),
        ("order 4", replace(STRIP, order=4)),
        ("order 5 (default)", STRIP),
    ):
        start = time.perf_counter()
        found = strip_width(STRIP_DESIGN, sizes, places=places)
        seconds = time.perf_counter() - start
        lead, _ = found.phases(forces, x)
        reference = lead if reference is None else reference
        errors = np.abs(lead - reference).max(axis=1) / np.abs(reference).max(axis=1)
        told = [f"{error:.2%}" if error else "reference" for error in errors]
        table.add_row(name, f"{found.unknowns:,}", *told, f"{seconds:.1f} s")
    console.print(table)


SECTIONS: dict[str, Callable[[Console], None]] = {
    "mechanics": mechanics,
    "refinement": refinement,
    "locking": locking,
    "strip": strip,
}

if __name__ == "__main__":
    if sys.argv[1:2] == ["measure"]:
        measure(cast(Sides, sys.argv[2]))
    else:
        for section in sys.argv[1:] or SECTIONS:
            SECTIONS[section](Console(width=110))
