"""A simulated camera: the sensor's own model under a scripted touch, line by line or as images."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from math import prod
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fringeforce.acquisition.cameras.camera import Block, Interruptible, Settings
from fringeforce.base.errors import InputError
from fringeforce.contacts.fingertip import PERIODS, bearable, fingertip_forces, fingertip_presses
from fringeforce.models.pad import PadModel
from fringeforce.models.strip import SensorModel

LINE_RATE, IMAGE_RATE = 1000.0, 20.0
"""Lines of a strip, and images of a pad, per second."""
# exposing a line takes longer than a fast camera does, so a loop of lines is exposed beforehand
LOOP, PRESSED = 4096, 1024
"""Lines of a loop at most; presses take ten times as long as forces of tactels."""
SOLVED = 64
"""The same of a skin under large strain, which takes a tenth of a second for each."""
PIXELS = 2**23
"""Pixels of all images of a loop; 128 of 256 x 256."""
Script = Callable[[NDArray[Any]], Any]


class SimulatedCamera(Interruptible):
    """Plays a script of forces at a line rate; what nobody collects in time is lost and counted.

    All that it shows is exposed when it is made, which takes some seconds for images of a pad.

    Parameters
    ----------
    model : SensorModel or PadModel
        The sensor.
    settings : Settings
        Rate (1000 lines or 20 images per second if not given) and block; exposure changes nothing.
    script : callable, optional
        From times (k,) [s] to forces (k, n, components) [N], or to a list of presses for each; a
        touch if not given.
    period : float, optional
        After which the script repeats [s]; that of the touch if not given.  At most 4096 lines of
        it are exposed, or images of 2^23 pixels in all; what comes faster shows neighbours that
        are equal.
    memory : float
        How much the camera keeps for a late reader [s]; never less than two blocks.
    rng : int
        Seed of the noise.
    """

    patient = False

    def __init__(
        self,
        model: SensorModel | PadModel,
        settings: Settings | None = None,
        script: Script | None = None,
        period: float | None = None,
        memory: float = 0.5,
        rng: int = 0,
    ) -> None:
        if period is not None and not period > 0:
            raise InputError(f"period = {period}: must be a number of seconds above 0.")
        images = model.sensor.dimensions > 1
        super().__init__(settings, images)
        self.line_rate = self.settings.line_rate or (IMAGE_RATE if images else LINE_RATE)
        self.name = f"simulated touch, {self.line_rate:g} {'images' if images else 'lines'}/s"
        period = period or PERIODS[model.sensor.dimensions]
        self._per_loop = max(round(period * self.line_rate), 1)
        sensor, skin = model.sensor, model.sensor.skin
        most = max(PIXELS // prod(model.frame_shape), 2) if images else PRESSED if skin else LOOP
        if skin is not None and getattr(sensor.transducer, "strain", "linear") == "finite":
            most = SOLVED
        count = min(most, self._per_loop)
        times = np.arange(count) * (period / count)
        if script is None:
            script = partial(fingertip_forces, places=model.sensor.tactels.places)
            if skin is not None:
                modulus = sensor.transducer.compliant.youngs_modulus
                across = None if images else sensor.transducer.width
                force = bearable(skin.extent, modulus, across)
                script = partial(fingertip_presses, extent=skin.extent, force=force)
        self.forces: Any = script(times)
        noise = np.random.default_rng(rng)
        # one by one, for intensities of images take eight times their room
        self.lines: NDArray[Any] = np.stack([model.expose(load, noise) for load in self.forces])
        # a line is exposed until the next one; an image is, as by a flash, there at once
        self._ahead = 1 if images else 0
        self._kept = max(int(memory * self.line_rate), 2 * self.block)

    def __enter__(self) -> Self:
        super().__enter__()
        # a camera that was left goes on where it was, without losses in between
        self._start = time.time() - self._next / self.line_rate
        return self

    def __iter__(self) -> Iterator[Block]:
        size = self.block
        while not self._closed.wait(self._due(self._next + size - self._ahead) - time.time()):
            exposed = int((time.time() - self._start) * self.line_rate)
            behind = exposed - self._kept - self._next
            dropped = -(-behind // size) * size if behind > 0 else 0
            first = self._next + dropped
            numbers = np.arange(first, first + size)
            self._next = first + size
            yield Block(self.lines[self._shown(numbers)], self._due(numbers), dropped, first)

    def true_forces(self, numbers: NDArray[np.integer]) -> Any:
        """Forces behind frames of given running numbers, as the script gives them [N]."""
        shown = self._shown(numbers)
        presses = isinstance(self.forces, list)
        return [self.forces[k] for k in shown] if presses else self.forces[shown]

    def _shown(self, numbers: NDArray[np.integer]) -> NDArray[np.integer]:
        return numbers % self._per_loop * len(self.lines) // self._per_loop

    def _due(self, number: Any) -> Any:
        return self._start + number / self.line_rate
