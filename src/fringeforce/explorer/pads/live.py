"""A running pad for pages: its last image, the forces of its tactels, and their sum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.explorer.live import Latest, Live, Watcher
from fringeforce.explorer.pads.pictures import camera_picture
from fringeforce.explorer.pads.resultants import resultant
from fringeforce.models.pad import PadModel

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class PadGlimpse:
    """The last image of a block, as it was read.

    Attributes
    ----------
    number : int
        Running number of the image.
    time : float
        Since the first image of the run [s].
    picture : ndarray of uint8, shape (rows, columns, 1)
        Grey levels, stretched to eight bits; of several pictures the first.
    forces, std : ndarray, shape (n, 3)
        N, T_x, T_y and their standard deviations [N].
    sums : ndarray, shape (6,)
        Of all tactels, in the order of `resultants.QUANTITIES`.
    status, advice : str
        The verdict, and what to do.
    chi2 : float
        Reduced chi-square.
    """

    number: int
    time: float
    picture: Array
    forces: Array
    std: Array
    sums: Array
    status: str
    advice: str
    chi2: float


class PadLatest(Latest):
    """The newest readings of a pad.

    Parameters
    ----------
    model : PadModel
        The sensor that is read.
    """

    def __init__(self, model: PadModel) -> None:
        super().__init__()
        self._model = model

    def _seen(self, readings: Readings, elapsed: float) -> PadGlimpse:
        forces, status = readings.forces[-1], readings.status[-1]
        tactels = self._model.sensor.tactels
        sums, _ = resultant(tactels.places, forces, np.ones(tactels.total, dtype=bool))
        return PadGlimpse(
            number=readings.first + len(readings) - 1,
            time=elapsed,
            picture=camera_picture(self._model, "camera-0", readings.lines[-1]),
            forces=forces,
            std=readings.std[-1],
            sums=sums,
            status=status.name,
            advice=status.advice,
            chi2=float(readings.chi2[-1]),
        )


class PadLive(Live):
    """The camera of a pad."""

    def watcher(self) -> PadWatcher:
        """What one page sees of it."""
        return PadWatcher(self)

    def _latest(self) -> PadLatest:
        return PadLatest(self.model)


class PadWatcher(Watcher):
    """What one page sees of a pad."""

    def _begin(self) -> None:
        """Nothing is remembered from one image to the next."""

    def _shown(
        self, glimpse: PadGlimpse, friction: float
    ) -> tuple[dict[str, Any], dict[str, Array]]:
        facts = {
            "time": glimpse.time,
            "line": glimpse.number,
            "status": glimpse.status,
            "advice": glimpse.advice,
            "chi2": glimpse.chi2 if np.isfinite(glimpse.chi2) else None,
            "shape": glimpse.picture.shape,
        }
        arrays = ("image", glimpse.picture), ("forces", glimpse.forces), ("std", glimpse.std)
        return facts, dict([*arrays, ("sums", glimpse.sums)])
