"""What the mechanics of a planar pad costs, and how near it comes to finer elements.

Section mechanics: time and peak memory of all unit loads of a pad against unknowns and tactels, one
process each.  Section refinement: depth integrals of sigma_x - sigma_y and tau_xy on a smaller pad
with free sides, against those of finer elements.  Section strip: the paper's strip in three
dimensions against elements of a higher order.  Run with the names of sections; all by default.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

import fringeforce as ff
from fringeforce.mechanics.solid.block import Block, Patches, Sides
from fringeforce.mechanics.solid.influence import PAD, pad_influence
from fringeforce.mechanics.solid.mesh import Grading, box_mesh
from fringeforce.mechanics.solid.strip import STRIP
from fringeforce.strip_width import strip_width

Array = NDArray[np.float64]
STRIP_DESIGN = ff.load_sensor("saad")
SIDE, PITCH = 25e-3, 1e-3
CASES: list[tuple[Sides, int, int]] = [
    ("roller", 5, 4),
    ("roller", 11, 4),
    ("free", 5, 5),
    ("free", 11, 5),
]
"""Sides, tactels along one side of the pad, and order of the elements."""


def pad(sides: Sides, tactels: int, side: float = SIDE) -> tuple[Block, Patches]:
    """The layers of the paper as a square pad under a square grid of touching tactels."""
    strip = STRIP_DESIGN.transducer
    line = np.arange(tactels, dtype=np.float64) * PITCH
    line -= line.mean()
    places = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    return Block(side, side, strip.compliant, strip.photoelastic, sides), Patches(places, PITCH)


def solved(
    block: Block, patches: Patches, sizes: Grading, samples: int
) -> tuple[list[Array], dict[str, float]]:
    """Depth integrals of both stresses, and what they cost."""
    borders = patches.places[..., None] + np.array([-0.5, 0.5]) * patches.size
    mesh = box_mesh(block, borders[:, 0], borders[:, 1], sizes)
    x = (np.arange(samples) + 0.5) / samples * block.length - block.length / 2
    start = time.perf_counter()
    found = pad_influence(block, patches, x, x, mesh=mesh)
    cost = {"seconds": time.perf_counter() - start, "unknowns": mesh.unknowns}
    fields = found.difference, found.shear
    return [np.einsum("xyzcn,z->xycn", field, found.weights) for field in fields], cost


def measure(sides: Sides, tactels: int, order: int) -> None:
    """Print one row as JSON; run in a process of its own."""
    _, cost = solved(*pad(sides, tactels), replace(PAD, order=order), 64)
    cost["GB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(json.dumps(cost))


def mechanics(console: Console) -> None:
    table = Table(title="All unit loads of a pad of 25 x 25 mm, 64 x 64 samples, 8 depths")
    for head in ("sides", "tactels", "order", "unknowns of a quarter", "time", "peak memory"):
        table.add_column(head, justify="right")
    for sides, tactels, order in CASES:
        command = [sys.executable, __file__, "measure", sides, str(tactels), str(order)]
        run = subprocess.run(command, capture_output=True, text=True, check=True)
        cost = json.loads(run.stdout.splitlines()[-1])
        table.add_row(
            sides, f"{tactels} x {tactels}", str(order), f"{cost['unknowns']:,}",
            f"{cost['seconds']:.1f} s", f"{cost['GB']:.2f} GB",
        )  # fmt: skip
    console.print(table)


def refinement(console: Console) -> None:
    block, patches = pad("free", 3, 9e-3)
    families = {
        "order 6, finer at the sides": replace(PAD, order=6, corner=0.3),
        "order 3": replace(PAD, order=3),
        "order 4": replace(PAD, order=4),
        "order 5 (default)": PAD,
    }
    table = Table(title="3 x 3 tactels on 9 x 9 mm, free sides: worst relative L2 error of a load")
    for head in ("elements", "unknowns", "difference", "shear", "time"):
        table.add_column(head, justify="right")
    reference: list[Array] = []
    for name, sizes in families.items():
        fields, cost = solved(block, patches, sizes, 45)
        reference = reference or fields
        errors = [
            (np.linalg.norm(f - r, axis=(0, 1)) / np.linalg.norm(r, axis=(0, 1))).max()
            for f, r in zip(fields, reference, strict=True)
        ]
        told = [f"{error:.2%}" if error else "reference" for error in errors]
        table.add_row(name, f"{cost['unknowns']:,}", *told, f"{cost['seconds']:.1f} s")
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
    "strip": strip,
}

if __name__ == "__main__":
    if sys.argv[1:2] == ["measure"]:
        sides, tactels, order = sys.argv[2:]
        measure(sides, int(tactels), int(order))  # type: ignore[arg-type]
    else:
        for section in sys.argv[1:] or SECTIONS:
            SECTIONS[section](Console(width=110))
