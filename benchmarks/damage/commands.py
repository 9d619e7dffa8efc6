"""Commands that run in a folder of their own, and the files that they take."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import fringeforce as ff
from fringeforce.io.frames import save_frames
from fringeforce.io.tables import save_forces

COMMAND = [sys.executable, "-c", "import sys; from fringeforce.cli import main; sys.exit(main())"]
EXAMPLES = Path(__file__).parents[2] / "examples"


def bench(where: Path, model: ff.SensorModel, frames: int) -> NDArray[np.float64]:
    """Make a folder with model.h5, loads.csv and frames.h5; returns the loads, shape (k, 11, 2)."""
    where.mkdir()
    model.save(where / "model.h5")
    loads = np.random.default_rng(0).uniform(0.1, 1.5, (frames, 11, 2)) * [1.0, 0.2]
    save_forces(where / "loads.csv", loads)
    save_frames(where / "frames.h5", model.expose(loads, rng=0), model.pixel_positions)
    return loads
