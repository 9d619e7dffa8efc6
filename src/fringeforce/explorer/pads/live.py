"""A running pad for pages: its last image, the forces of its tactels, and their sum."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.explorer.live import Glimpse, Latest, Live, Watcher
from fringeforce.explorer.pads.pictures import camera_picture
from fringeforce.explorer.pads.resultants import resultant

Array = NDArray[Any]


class PadLive(Live):
    """The camera of a pad."""

    def watcher(self) -> PadWatcher:
        """What one page sees of it."""
        return PadWatcher(self)

    def _latest(self) -> Latest:
        # grey levels, stretched to eight bits
        picture = partial(camera_picture, self.model, "camera-0")
        return Latest(picture, lambda _, std, __: np.diag(std.ravel() ** 2), self.model.retardance)


class PadWatcher(Watcher):
    """What one page sees of a pad."""

    def __init__(self, source: PadLive) -> None:
        super().__init__(source)
        self._places = source.model.sensor.tactels.places

    def _begin(self) -> None:
        """Nothing is remembered from one image to the next."""

    def _shown(self, glimpse: Glimpse, friction: float) -> tuple[dict[str, Any], dict[str, Array]]:
        every = np.ones(len(self._places), dtype=bool)
        sums, _ = resultant(self._places, glimpse.reading.forces, every)
        return {"shape": glimpse.frame.shape}, {"image": glimpse.frame, "sums": sums}
