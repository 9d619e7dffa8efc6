"""A strip with every tolerance at once, and frames of sensors made from it in slow motion."""

import numpy as np
from numpy.typing import NDArray

import fringeforce as ff

Array = NDArray[np.float64]

TOLERANCES = {
    "transducer.edges": "roller",
    "tactels.placement": "0 +/- 0.1 mm",
    "tactels.contact_width": "0.4 +/- 0.2 mm",
    "polariscope.visibility": "0.97 +/- 0.02",
    "polariscope.residual": "0 +/- 0.05 rad",
    "polariscope.residual_length": "3 mm",
    "camera.amplitude": "237 +/- 3 %",
    "camera.blur": "49 um +/- 24 um",
}
COLOURS = {
    "polariscope.channels": [
        {"wavelength": "red LED"},
        {"wavelength": "525 nm", "noise": 4.0},
        {"wavelength": "470 nm", "noise": 8.0},
    ],
    "polariscope.crosstalk": "5 +/- 2 %",
    "camera.offset": 8.0,
}
"""A colour camera, one light of which is not of one wavelength, with noise of its own in each."""


def slow_motion(
    model: ff.SensorModel, frames: int, seed: int, turns: float = 0.05
) -> tuple[Array, NDArray[np.unsignedinteger]]:
    """Forces (frames, n, 2) that sway by a third, and frames, of one touch on one made sensor."""
    rng = np.random.default_rng([9, seed])
    built, count = model.as_built(rng), model.sensor.tactels.count
    normal = rng.uniform(0.3, 2.0, count)
    mean = np.stack([normal, normal * rng.uniform(-0.5, 0.5, count)], axis=1)
    phase = 2 * np.pi * (turns * np.linspace(0, 1, frames)[:, None, None] + rng.random((count, 2)))
    forces = mean * (1 + 0.3 * np.sin(phase))
    return forces, built.expose(forces, rng, built.contacts((), rng))
