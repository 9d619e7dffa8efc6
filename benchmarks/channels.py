"""What several pictures of one strip are worth: predicted bounds, and Monte Carlo beside them.

Bounds are those of one frame of the paper's load, mean over the tactels.  The Monte Carlo reads
frames of random loads up to 2 N and 20 degrees, each load's errors in units of its own bound.
Run with a number of frames; 400 by default.
"""

from __future__ import annotations

import sys

import numpy as np
from rich.console import Console
from rich.table import Table

import fringeforce as ff
from fringeforce.estimation.bounds import cramer_rao_bound

COLOURS: list[dict[str, object]] = [{}, {"wavelength": "532 nm"}, {"wavelength": "450 nm"}]
ARRANGEMENTS: dict[str, list[dict[str, object]]] = {
    "dark field": [{}],
    "quarter-wave bias": [{"bias": 90}],
    "dark and bright field": [{}, {"bias": 180}],
    "quadrature": [{}, {"bias": 90}],
    "three colours": COLOURS,
    "four orientations": [{"bias": bias} for bias in (0, 90, 180, 270)],
}


def bound(model: ff.SensorModel, forces: np.ndarray) -> np.ndarray:
    """Smallest deviations of one frame, shape (n, 2) [N]."""
    psi = model.frame_influence
    return cramer_rao_bound(psi @ forces.ravel(), psi, model.response).reshape(forces.shape)


def main() -> None:
    """Print the table."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 400
    sensor = ff.load_sensor("saad")
    n = sensor.tactels.count
    paper = ff.polar(1.0, 10, n)
    table = Table(title=f"{count} frames a row")
    for heading in ("pictures", "bound N, mN", "bound T, mN", "rms / bound", "OK"):
        table.add_column(heading, justify="right" if table.columns else "left")
    for name, channels in ARRANGEMENTS.items():
        model = ff.characterize(sensor.replace(**{"polariscope.channels": channels}))
        rng, off, done = np.random.default_rng(0), [], 0
        for _ in range(count):
            load = ff.polar(rng.uniform(0.2, 2, n), rng.uniform(-20, 20, n))
            reading = ff.Reader(model).search(model.expose(load, rng=rng))
            done += reading.status is ff.Status.OK
            off.append((reading.forces - load) / bound(model, load))
        normal, tangential = 1e3 * bound(model, paper).mean(axis=0)
        efficiency = np.sqrt(np.mean(np.square(off)))
        table.add_row(
            name, f"{normal:.1f}", f"{tangential:.1f}", f"{efficiency:.3f}", f"{done / count:.1%}"
        )
    Console().print(table)


if __name__ == "__main__":
    main()
