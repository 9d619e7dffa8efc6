"""A simulated camera: the sensor's own model under a scripted touch, line by line."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fringeforce.cameras.camera import Block, Settings
from fringeforce.cameras.interruptible import Interruptible
from fringeforce.cameras.touch import PERIOD, touch
from fringeforce.errors import InputError
from fringeforce.model import SensorModel

LINE_RATE = 1000.0
# exposing a line takes longer than a fast camera does, so a loop of lines is exposed beforehand
LOOP = 4096
Script = Callable[[NDArray[Any]], NDArray[Any]]


class SimulatedCamera(Interruptible):
    """Plays a script of forces at a line rate; what nobody collects in time is lost and counted.

    Parameters
    ----------
    model : SensorModel
        The sensor.
    settings : Settings
        Line rate (1000 lines per second if not given) and block; exposure changes nothing.
    script : callable, optional
        From times (k,) [s] to forces (k, 2, n) [N]; a touch if not given.
    period : float
        After which the script repeats [s].  At most 4096 lines of it are exposed; above
        4096 / period lines per second neighbouring lines are equal.
    memory : float
        How much the camera keeps for a late reader [s]; never less than two blocks.
    rng : int
        Seed of the noise.
    """

    patient = False

    def __init__(
        self,
        model: SensorModel,
        settings: Settings | None = None,
        script: Script | None = None,
        period: float = PERIOD,
        memory: float = 0.5,
        rng: int = 0,
    ) -> None:
        if not period > 0:
            raise InputError(f"period = {period}: must be a number of seconds above 0.")
        super().__init__(settings)
        self.line_rate = self.settings.line_rate or LINE_RATE
        self.name = f"simulated touch, {self.line_rate:g} lines/s"
        self._per_loop = max(round(period * self.line_rate), 1)
        count = min(LOOP, self._per_loop)
        positions = model.sensor.tactels.positions
        times = np.arange(count) * (period / count)
        self.forces = touch(times, positions) if script is None else script(times)
        self.lines: NDArray[Any] = model.expose(self.forces, rng=rng)
        self._kept = max(int(memory * self.line_rate), 2 * self.settings.block)

    def __enter__(self) -> Self:
        super().__enter__()
        # a camera that was left goes on where it was, without losses in between
        self._start = time.time() - self._next / self.line_rate
        return self

    def __iter__(self) -> Iterator[Block]:
        size = self.settings.block
        while not self._closed.wait(self._due(self._next + size) - time.time()):
            exposed = int((time.time() - self._start) * self.line_rate)
            behind = exposed - self._kept - self._next
            dropped = -(-behind // size) * size if behind > 0 else 0
            first = self._next + dropped
            numbers = np.arange(first, first + size)
            self._next = first + size
            yield Block(self.lines[self._shown(numbers)], self._due(numbers), dropped, first)

    def true_forces(self, numbers: NDArray[np.integer]) -> NDArray[np.float64]:
        """Forces behind lines of given running numbers, shape (k, 2, n) [N]."""
        return self.forces[self._shown(numbers)]

    def _shown(self, numbers: NDArray[np.integer]) -> NDArray[np.integer]:
        return numbers % self._per_loop * len(self.lines) // self._per_loop

    def _due(self, number: Any) -> Any:
        return self._start + number / self.line_rate
