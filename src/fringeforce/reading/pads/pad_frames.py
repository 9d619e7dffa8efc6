"""What readers of pads have in common, whether forces act at tactels or anywhere on a skin."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.base.errors import InputError
from fringeforce.estimation.levenberg_marquardt import Curvature
from fringeforce.estimation.likelihood import Response
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_uncertainty import PadUncertainty, pad_response
from fringeforce.optics.arrangement import signed
from fringeforce.reading.frame_reader import FrameReader
from fringeforce.reading.pads.verdict import FrameClassifier


@dataclass(frozen=True, eq=False)
class PadFrames(FrameReader):
    """Reads frames of one pad, each for itself."""

    model: PadModel

    @property
    @abstractmethod
    def uncertain(self) -> PadUncertainty | None:
        """What is uncertain about the pad; none if nothing is."""

    def lasting(self, curvature: Curvature | None) -> Curvature | None:
        """The curvature of the frame before, if it serves for the next.

        Where light hardly tells forces from unknowns, one of other forces takes them for unknowns.
        """
        known = self.uncertain
        return None if known is not None and known.scales else curvature

    def check_signed(self) -> None:
        """Raise InputError if frames do not tell a force from its negative."""
        forms = np.concatenate([picture.forms for picture in self.model.pictures])
        if not signed(forms):
            raise InputError(
                "Frames of this polariscope are the same for a force and its negative, so that "
                "nothing can be read without an earlier state; take a polarisation camera, or "
                'channels with arrangement = "analyser" at two angles, 45 degrees apart.'
            )

    @cached_property
    def response(self) -> Response:
        """What the camera makes of light."""
        return pad_response(self.model.sensor)

    def phase(self, forces: Array) -> Array:
        """Retardance over both passes, shape (2, rows, columns) [rad]."""
        return self.model.retardance(forces)

    def turned(self, pixels: Index) -> Iterator[tuple[str, Index]]:
        """Mirrored, and turned by the angles that keep the shape of a frame."""
        yield "it is mirrored, left to right", pixels[:, :, ::-1]
        yield "it is mirrored, top to bottom", pixels[:, ::-1]
        _, rows, columns = pixels.shape
        for quarters in (2, 1, 3) if rows == columns else (2,):
            yield f"it is turned by {90 * quarters} degrees", np.rot90(pixels, quarters, (1, 2))

    def trial(self, share: float, rng: np.random.Generator) -> NDArray[Any]:
        """A frame of a share of a newton on the tactel in the middle."""
        forces = np.zeros(self.forces_shape)
        forces[len(forces) // 2, 0] = share
        return self.model.expose(forces, rng)

    @property
    def pixels(self) -> int:
        """Of a frame, all channels together."""
        return int(np.prod(self.model.frame_shape))

    def classifier(self, used: Mask) -> FrameClassifier:
        """What judges frames of which some pixels count."""
        if self.complete(used):
            return self._unmasked
        last = self._last.get("classifier")
        if last is None or last.used is not used:
            last = self._last["classifier"] = FrameClassifier(
                self.model, self.response, used, self.confidence
            )
        return last

    @cached_property
    def _last(self) -> dict[str, FrameClassifier]:
        """The judge of the last mask, which others with the same mask take."""
        return {}

    @cached_property
    def _unmasked(self) -> FrameClassifier:
        return FrameClassifier(self.model, self.response, confidence=self.confidence)
