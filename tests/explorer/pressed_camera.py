"""A simulated camera whose sensor is pressed and let go, hard enough to be read without doubt."""

import numpy as np

import fringeforce as ff
from fringeforce.acquisition.cameras.camera import Settings
from fringeforce.acquisition.cameras.simulator import SimulatedCamera

BLOCK = 10
SHARE = np.tan(np.radians(10))  # tangential over normal force


def simulated(model: ff.SensorModel) -> SimulatedCamera:
    return SimulatedCamera(model, Settings(1000, None, BLOCK), script=pressed)


def pressed(times: np.ndarray) -> np.ndarray:
    """About 1 N at 10 degrees on all tactels for three seconds of four, and nothing."""
    size = (1 + 0.1 * np.sin(np.pi * times)) * (times % 4 < 3)
    return size[:, None, None] * ff.polar(1.0, 10, n=11)
