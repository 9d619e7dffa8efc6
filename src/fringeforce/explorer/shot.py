"""One camera line and what was read from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.reading.reading import Reading
from fringeforce.reading.single_frame import SingleFrameReader


@dataclass(frozen=True, eq=False)
class Shot:
    """One camera line and what was read from it.

    Attributes
    ----------
    frame : ndarray, shape (n_pixels,)
        Grey levels.
    reading : Reading
        Of that frame.
    phase_std : ndarray, shape (n_pixels,)
        Standard deviation of the phase that the reading states [rad].
    """

    frame: NDArray[np.unsignedinteger]
    reading: Reading
    phase_std: NDArray[np.float64]

    @property
    def facts(self) -> dict[str, Any]:
        """The verdict, as JSON values."""
        chi2 = self.reading.chi2
        return {
            "status": self.reading.status.name,
            "advice": self.reading.advice,
            "chi2": float(chi2) if np.isfinite(chi2) else None,
        }

    @property
    def blocks(self) -> dict[str, NDArray[Any]]:
        """The numbers, for the page."""
        reading = self.reading
        return {
            "frame": self.frame,
            "forces": reading.forces,
            "std": reading.std,
            "phase": reading.phase,
            "phase_std": self.phase_std,
            "alternatives": reading.alternatives,
        }


def shoot(reader: SingleFrameReader, forces: list[list[float]], seed: int) -> Shot:
    """Expose one noisy line and read it.

    Parameters
    ----------
    reader : SingleFrameReader
        Of the sensor.
    forces : nested list, shape (n, 2)
        Normal and tangential forces [N].
    seed : int
        Of the camera's noise.
    """
    frame = reader.model.expose(forces, rng=seed)
    reading = reader.read(frame)
    psi = reader.influence
    variance = ((psi @ reading.covariance) * psi).sum(axis=1)
    return Shot(frame, reading, np.sqrt(np.maximum(variance, 0)))
