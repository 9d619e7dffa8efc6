"""Light of a strip under loads, finer than any picture of it, and a tilted camera."""

import numpy as np
import pytest
from numpy.typing import NDArray
from rendering import Scene

import fringeforce as ff

TOP = 2**16 - 1


@pytest.fixture(scope="session")
def tilted() -> Scene:
    """Four degrees, a little perspective, light that changes by a tenth from edge to edge."""
    return Scene(((40.3, 30.2), (556.1, 66.9), (554.2, 107.4), (36.8, 72.6)), (600, 150))


@pytest.fixture(scope="session")
def loads() -> NDArray[np.float64]:
    """Four loads of all tactels, drawn once."""
    rng = np.random.default_rng(1)
    draw = [ff.polar(rng.uniform(0.2, 0.8, 11), rng.uniform(-12, 12, 11)) for _ in range(4)]
    return np.array(draw)


@pytest.fixture(scope="session")
def light(sensor: ff.Sensor, loads: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shares of the full scale at 4000 places along the strip, without noise."""
    camera = {"pixels": 4000, "bits": 16, "amplitude": 52000, "offset": 3000, "noise": 0}
    fine = sensor.replace(**{f"camera.{key}": value for key, value in camera.items()})
    return ff.characterize(fine).expose(loads, rng=0) / TOP
