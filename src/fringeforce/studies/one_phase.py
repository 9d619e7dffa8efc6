"""What is lost when the mean of the light over a camera's line is read with one phase per pixel."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.base.progress import Progress, counted
from fringeforce.contacts.loads import PAPER_ANGLE, polar
from fringeforce.design.strip import Sensor
from fringeforce.mechanics.solid.mesh import Grading
from fringeforce.mechanics.solid.strip import STRIP
from fringeforce.models.strip import SensorModel
from fringeforce.models.strip_width import GAUSS_POINTS, StripWidth, strip_width
from fringeforce.reading.reader import Reader

LINES = (0.1, 0.25, 0.5, 1.0)
"""Widths of the camera's line, of the strip's."""
LOADS = (0.25, 1.0, 3.0)
"""Force on every tactel [N], at the angle of the paper's example."""
FRAMES = 3
NARROW = {"line_position": None, "line_width": None}
"""A camera whose line is narrow and lies in the middle."""


@dataclass(frozen=True)
class OnePhase:
    """Frames of the averaged light of one line and one load, read with one phase per pixel.

    Attributes
    ----------
    line, load : float
        Width of the line [m], force on every tactel [N].
    contrast : float
        Share of the fringes' contrast that is left where least is.
    error, noise : float
        Root mean square error of the forces read from the averaged light, and from light that has
        one phase, with the same noise [N].
    """

    line: float
    load: float
    contrast: float
    error: float
    noise: float


def one_phase(
    sensor: Sensor,
    seed: int = 0,
    progress: Progress | None = None,
    shares: tuple[float, ...] = LINES,
    loads: tuple[float, ...] = LOADS,
    mesh: Grading = STRIP,
) -> list[OnePhase]:
    """Read simulated frames of lines in the middle of a strip, by width and load.

    Parameters
    ----------
    sensor : Sensor
        The design; where its camera's line lies is left aside.
    seed : int
        Seed of the noise, the same for all.
    progress : callable, optional
        Called with words, lines done and their count.
    shares : tuple of float
        Widths of the line over that of the strip.
    loads : tuple of float
        Forces [N].
    mesh : Grading
        Sizes of the elements.
    """
    found = []
    lines = _lines(sensor, shares, mesh)
    for width, seen in counted(lines, progress, "lines of the camera", len(shares)):
        model = SensorModel(seen.sensor, seen.breaks, seen.psi)
        reader = Reader(model)
        for load in loads:
            forces = polar(load, PAPER_ANGLE, sensor.tactels.count)
            frames = [
                [source.expose(forces, rng=seed + k) for k in range(FRAMES)]
                for source in (seen, model)
            ]
            error, noise = (
                float(np.sqrt(np.mean([(reader.search(f).forces - forces) ** 2 for f in group])))
                for group in frames
            )
            found.append(OnePhase(width, load, contrast(seen, forces), error, noise))
    return sorted(found, key=lambda one: (one.load, one.line))


def contrast(seen: StripWidth, forces: Array) -> float:
    """Least share of the fringes' contrast that the mean over a line keeps, along the strip."""
    lead, cross = seen.phases(forces, seen.sensor.pixel_positions)
    return float(np.abs(seen.weights @ np.exp(1j * np.hypot(lead, cross))).min())


def _lines(
    sensor: Sensor, shares: tuple[float, ...], mesh: Grading
) -> Iterator[tuple[float, StripWidth]]:
    """What lines of several widths see, from one solution."""
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    widths = np.array(shares) * sensor.transducer.width
    solid = sensor.replace(transducer={"plane": "3d"}, camera=NARROW)
    y = np.concatenate([width / 2 * nodes for width in widths])
    every = strip_width(solid, mesh, places=(y, np.ones_like(y)))
    for i, width in enumerate(widths):
        part = slice(i * GAUSS_POINTS, (i + 1) * GAUSS_POINTS)
        yield (
            float(width),
            replace(
                every,
                y=y[part],
                weights=weights / 2,
                lead=every.lead[part],
                cross=every.cross[part],
            ),
        )
