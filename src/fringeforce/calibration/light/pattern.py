"""The fixed pattern of a camera within the fit of a bench: found pixel by pixel, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.calibration.frame_models import FrameModels
from fringeforce.calibration.light.fixed_pattern_noise import NONE, FixedPatternNoise
from fringeforce.calibration.shared_unknowns import State
from fringeforce.estimation.frame_exposure import expose

FIRST = 0.02, 0.01
"""Deviations of amplitude and offset from pixel to pixel at first, over the amplitude."""
BRIGHTER = 1e-3
"""Relative step of the amplitude of all pixels, by which levels are differentiated."""
REPEATS, SAME = 50, 0.01
"""How often sizes of the pattern are found for what frames tell at most, and the relative change of
one below which it is found."""
SOUND = 10.0
"""Residual beyond which a level says nothing of its pixel, in deviations of one frame's noise: a
pattern of several is not a defect."""


@dataclass(frozen=True, eq=False)
class Pattern:
    """What pixels add to the smooth light, as far as frames and references tell.

    Attributes
    ----------
    noise : FixedPatternNoise
        The pattern.
    sizes : pair of float
        Its deviations from pixel to pixel, amplitude and offset, grey levels.
    pixels : ndarray, shape (2, 2, P)
        Information of the frames about it.
    dark : ndarray, shape (P,), optional
        Deviations of the offset that frames in the dark show, grey levels.
    variance : float or ndarray, shape (P,)
        Of these.
    """

    noise: FixedPatternNoise
    sizes: tuple[float, float]
    pixels: Array
    dark: Array | None
    variance: Array | float

    @classmethod
    def first(
        cls, pixels: int, amplitude: float, dark: Array | None, variance: Array | float
    ) -> Pattern:
        """Before any frame but those in the dark."""
        sizes = FIRST[0] * amplitude, FIRST[1] * amplitude
        noise = FixedPatternNoise.unseen(pixels, sizes, dark, variance)
        return cls(noise, sizes, np.zeros((2, 2, pixels)), dark, variance)

    def improved(
        self, models: FrameModels, state: State, levels: Array, kept: Mask, used: Mask
    ) -> Pattern:
        """The likeliest pattern, and the size under which it is most probable (MacKay).

        Parameters
        ----------
        models, state
            What explains the frames.
        levels : ndarray, shape (F, P)
            Grey levels.
        kept : ndarray of bool, shape (F,)
            Frames that count.
        used : ndarray of bool, shape (P,)
            Pixels that count.
        """
        gradient, pixels = np.zeros((2, len(used))), np.zeros((2, 2, len(used)))
        for f in np.flatnonzero(kept).tolist():
            model, amplitude = models.of_frame(f), models.bench.template.amplitude
            unknowns = models.unknowns(f, state.own[f], state.shared)
            level = expose(model, unknowns)[0]
            step = BRIGHTER * amplitude
            brighter = expose(model._replace(amplitude=amplitude + step), unknowns)[0]
            darker = expose(model._replace(offset=model.offset + 1.0), unknowns)[0]
            sigma = np.sqrt(model.variance)
            slopes = np.stack([(brighter - level) / step, darker - level]) / sigma
            left = (level - levels[f]) / sigma
            counts = used & (np.abs(left) < SOUND * np.sqrt(models.bench.averaged[f]))
            gradient += slopes * left * counts
            pixels += slopes[:, None] * slopes * counts
        before = self.sizes
        for _ in range(REPEATS):  # what frames tell of pixels need not be found again
            noise, sizes = self._sized(before, gradient, pixels, used)
            if np.abs(np.log(np.divide(sizes, before))).max() < SAME:
                break
            before = sizes
        return replace(self, noise=noise, sizes=sizes, pixels=pixels)

    def _sized(
        self, sizes: tuple[float, float], gradient: Array, pixels: Array, used: Mask
    ) -> tuple[FixedPatternNoise, tuple[float, float]]:
        """The likeliest pattern of some sizes, and sizes that are likelier."""
        noise = FixedPatternNoise.unseen(len(used), sizes, self.dark, self.variance)
        noise = replace(noise, levels=self.noise.levels).improved(gradient, pixels)
        spread = np.diagonal(np.linalg.inv(noise.information(pixels)), axis1=1, axis2=2).T
        found = [
            np.sqrt(np.square(own[used]).sum() / max((1 - var[used] / size**2).sum(), 1e-9))
            for own, var, size in zip(noise.levels, spread, sizes, strict=True)
        ]
        return noise, (max(float(found[0]), NONE), max(float(found[1]), NONE))

    def moved(self, other: Pattern) -> float:
        """Root-mean-square change from another one, in its own deviations."""
        information = self.noise.information(self.pixels)
        step = self.noise.levels - other.noise.levels
        return float(np.sqrt(np.einsum("ap,pab,bp->p", step, information, step).mean()))

    def variance_of(self, used: Mask, channels: int) -> Array:
        """Mean variance that the pattern's own errors give a grey level of each channel, (C,)."""
        errors = np.linalg.inv(self.noise.information(self.pixels))
        shown = used * self.pixels / np.maximum(self.pixels[1, 1], 1e-12)
        found = np.einsum("pab,abp->p", errors, shown).reshape(channels, -1).sum(axis=1)
        return np.asarray(found / np.maximum(used.reshape(channels, -1).sum(axis=1), 1))

    def freedom(self, used: Mask) -> float:
        """Number of free unknowns that the pattern of the used pixels amounts to."""
        shares = np.linalg.solve(
            self.noise.information(self.pixels), np.moveaxis(self.pixels, 2, 0)
        )
        return float(np.einsum("paa->p", shares)[used].sum())
