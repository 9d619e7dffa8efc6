"""Light of one frame of a strip, and the frame as lines of intensity under light as drawn."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Mask
from fringeforce.estimation.extremes import extremes, light_of_extremes
from fringeforce.estimation.frame_model import FrameModel
from fringeforce.estimation.phase.folding import phase_pace
from fringeforce.estimation.posterior import Top
from fringeforce.optics.camera import decoded

CONTRAST = 0.3
"""Lowest contrast of blurred fringes that is undone."""
FASTEST = 0.4
"""Pace beyond which blur is not followed further: more of it makes the search endless [rad per
pixel]."""
LEAST_POWER = 0.1
"""Power of a camera's response, over that of the drawing, below which none is taken seriously."""


class Light(NamedTuple):
    """Light of a frame.

    Attributes
    ----------
    modes : ndarray, shape (s,)
        Of light and influence matrix, of which those of the light count.
    offset : float
        Against the drawing's, over the amplitude.
    visibility, blur : float
        Of the fringes, and of the point spread [pixels].
    power : float
        Of the camera's response over that of the drawing.
    """

    modes: Array
    offset: float
    visibility: float
    blur: float
    power: float


class Lines(NamedTuple):
    """A frame as lines of normalised intensity, one for each channel.

    Attributes
    ----------
    intensity : ndarray, shape (C, P)
        Of the light as drawn; gaps are bridged.
    seen : ndarray of bool, shape (C, P)
        Pixels that are used and not clipped.
    variance : ndarray, shape (C,)
        Of the noise.
    pace : ndarray, shape (C, P)
        Local pace of the phase, as seen [rad per pixel].
    light : Light
        From the extremes of the lines.
    """

    intensity: Array
    seen: NDArray[np.bool_]
    variance: Array
    pace: Array
    light: Light


@dataclass(frozen=True, eq=False)
class FrameLight:
    """Tells the light of frames of one strip.

    Attributes
    ----------
    model : FrameModel
        What makes frames.
    """

    model: FrameModel

    def lines(self, frame: Array) -> Lines:
        """Lines of a frame, shape (P,), whose unused pixels are not finite."""
        model = self.model
        channels = len(model.bias)
        light = (_decoded(model, frame) - model.offset) / model.amplitude
        lines, seen = light.reshape(channels, -1).copy(), np.isfinite(frame).reshape(channels, -1)
        told = seen & (frame < model.ceiling).reshape(channels, -1)
        along = np.arange(lines.shape[1])
        for line, own in zip(lines, seen, strict=True):
            if own.any() and not own.all():
                line[~own] = np.interp(along[~own], along[own], line[own])
        bright = np.square(model.amplitude).reshape(channels, -1).mean(axis=1)
        variance = model.variance[:: lines.shape[1]] / bright
        if len(model.crosstalk):  # every channel's own light, where all of them are seen
            own = np.linalg.inv(model.crosstalk[:, :-1])
            lines, variance = own @ lines, np.square(own) @ variance
            seen, told = (np.broadcast_to(part.all(axis=0), part.shape) for part in (seen, told))
        pace = np.array([phase_pace(*line) for line in zip(lines, variance, seen, strict=True)])
        return Lines(lines, told, variance, pace, self._light(lines, seen & ~told, variance, pace))

    def _light(self, lines: Array, clipped: Mask, variances: Array, paces: Array) -> Light:
        """Light from the extremes of lines; those that are clipped are none."""
        model, at = self.model, self.model.at
        if not model.brightness.any() and at.crosstalk == at.visibility:  # it is as drawn
            return self.drawn
        rows = [
            extremes(line, pace, float(variance), out)
            for line, out, variance, pace in zip(lines, clipped, variances, paces, strict=True)
        ]
        found, channel = np.concatenate(rows), np.repeat(np.arange(len(rows)), list(map(len, rows)))
        place = np.clip(np.rint(found[:, 4]).astype(np.intp), 0, lines.shape[1] - 1)
        blur = model.blur, model.blur_std if at.gamma > at.blur else 0.0
        visibility = model.visibility, model.visibility_std if at.blur > at.visibility else 0.0
        # behind the curve of sRGB a power does something else
        power = 0.0 if model.srgb else model.gamma_std / model.gamma
        gains = self._gains[:, channel, place].T
        found = light_of_extremes(found, gains, visibility, blur, power, self._response[channel])
        return Light(found[0], 0.0, *found[1:])

    @cached_property
    def drawn(self) -> Light:
        """Light as of the design."""
        return Light(
            np.zeros(len(self.model.brightness)), 0.0, self.model.visibility, self.model.blur, 1.0
        )

    @cached_property
    def _gains(self) -> Array:
        """What modes change in the gain at the pixels of every channel, shape (s, C, P)."""
        model, channels = self.model, len(self.model.bias)
        pixels = len(model.amplitude) // channels
        rows = model.brightness.reshape(-1, channels, len(model.fixed))
        first, weights = model.first[:pixels], model.weights[:pixels]
        found = np.zeros((len(rows), channels, pixels))
        for t in range(4):
            found += rows[:, :, first + t] * weights[:, t]
        return found

    @cached_property
    def _response(self) -> Array:
        """Amplitude and offset of every channel over the full scale, shape (C, 2)."""
        rows = np.stack([self.model.amplitude, self.model.offset])
        return rows.reshape(2, len(self.model.bias), -1).mean(axis=2).T / self.model.full_scale

    def gain(self, light: Light) -> Array:
        """Gain of a light at the pixels of every channel, shape (C, P)."""
        return np.asarray(1 + np.tensordot(light.modes, self._gains, axes=1))

    def plain(self, lines: Lines, light: Light) -> Array:
        """Intensity of lines if the gain were one all along, without offset, shape (C, P).

        Parameters
        ----------
        lines : Lines
            Of the frame.
        light : Light
            Of the frame.
        """
        found, gain = lines.intensity, self.gain(light)
        if light.power != 1.0:
            a, b = self._response.T[:, :, None]
            found = (np.maximum(a * found + b, 0.0) ** (1 / light.power) - b) / a
        return (found - light.offset) / np.maximum(gain, np.finfo(float).eps)

    def true_pace(self, lines: Lines, light: Light) -> tuple[Array, Array]:
        """Pace of the phase before the blur, in the strip's own, and the contrast it leaves."""
        ratio = self.model.dispersion[:, None]
        seen, contrast = lines.pace, np.ones_like(lines.pace)
        if light.blur:
            for _ in range(4):
                undone = np.minimum(seen / np.maximum(contrast, CONTRAST), FASTEST)
                contrast = np.exp(-np.square(undone * light.blur) / 2)
        return np.max(seen / np.maximum(contrast, CONTRAST) / ratio, axis=0), contrast

    def lit(self, starts: Array, light: Light) -> None:
        """Fill in the unknowns of the light."""
        model, at = self.model, self.model.at
        starts[:, at.modes : at.visibility] += light.modes
        if at.blur > at.visibility:
            starts[:, at.visibility] = (light.visibility - model.visibility) / model.visibility_std
        if at.gamma > at.blur:
            starts[:, at.blur] = (light.blur - model.blur) / model.blur_std
        if at.crosstalk > at.gamma:
            starts[:, at.gamma] = (light.power - 1) * model.gamma / model.gamma_std

    def fitted(self, top: Top) -> Light:
        """Light of an explanation."""
        model, at, e = self.model, self.model.at, top.unknowns
        modes = e[at.modes : at.visibility] * model.brightness.any(axis=1)
        offset = float(model.darkness.mean(axis=1) @ e[at.modes : at.visibility])
        visibility, blur, power = model.visibility, model.blur, 1.0
        if at.blur > at.visibility:
            visibility += model.visibility_std * e[at.visibility]
        if at.gamma > at.blur:
            blur = max(blur + model.blur_std * e[at.blur], 0.0)
        if at.crosstalk > at.gamma and not model.srgb:
            power = max(1 + model.gamma_std / model.gamma * e[at.gamma], LEAST_POWER)
        return Light(modes, offset / float(model.amplitude.mean()), visibility, blur, power)


def _decoded(model: FrameModel, grey: Array) -> Array:
    """Grey levels of a linear response."""
    if model.gamma == 1.0 and not model.srgb:
        return grey
    share = np.clip(grey / model.full_scale, 0, 1) ** (1 / model.gamma)
    if model.srgb:
        share = decoded(share, "sRGB")
    return model.full_scale * share
