"""From grey levels to the sine of the retardance with its direction, near every pixel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from fringeforce.estimation.likelihood import Response
from fringeforce.models.pad import PadModel
from fringeforce.optics.area_camera import Picture
from fringeforce.reading.pads.light import Curve

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

AVERAGED_SIDE = 3
"""Rows and columns of pixels that are averaged, which all kinds of a mosaic are among."""


@dataclass(frozen=True, eq=False)
class StressVectors:
    """What the pictures of one wavelength show: sin |p| p / |p|, for p the retardance (A, B).

    Attributes
    ----------
    dispersion : float
        Retardance over that of the polariscope's own wavelength.
    directions : ndarray, shape (r, 2)
        Orthonormal directions, of the two, that are seen.
    values : ndarray, shape (r, ...)
        The vector along them.
    known : ndarray of bool, shape (...)
        Where enough pixels count.
    noise : float
        Standard deviation of the values.
    """

    dispersion: float
    directions: Array
    values: Array
    known: Mask
    noise: float

    def at(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> StressVectors:
        """Those of a lattice of pixels, in one row."""
        values = self.values[:, rows[:, None], columns].reshape(len(self.values), -1)
        return replace(self, values=values, known=self.known[rows[:, None], columns].ravel())


def stress_vectors(
    model: PadModel, response: Response, frame: Array, used: Mask | None = None
) -> list[StressVectors]:
    """What a frame shows at every pixel, of each wavelength.

    Parameters
    ----------
    model : PadModel
        Of the pad.
    response : Response
        Of its camera.
    frame : ndarray, shape (channels * P,)
        Grey levels.
    used : ndarray of bool, same shape, optional
        Pixels that count; all if not given.
    """
    shape = len(model.pictures), *model.frame_shape[-2:]
    frame, response = Curve.of(model.sensor.camera).straightened(frame, response)
    light = ((frame - response.offset) / response.amplitude).reshape(shape)
    counts = np.ones(shape, dtype=bool) if used is None else used.reshape(shape)
    found = []
    for dispersion in sorted({picture.dispersion for picture in model.pictures}):
        mine = [k for k, picture in enumerate(model.pictures) if picture.dispersion == dispersion]
        parts = [_kinds(model, model.pictures[k], light[k], counts[k]) for k in mine]
        slopes, values, shares = (np.concatenate(part) for part in zip(*parts, strict=True))
        left, sizes, right = np.linalg.svd(slopes, full_matrices=False)
        seen = sizes > 1e-6
        if not seen.any():
            continue
        solve = left[:, seen].T / sizes[seen, None]
        shares[shares < 0.5 / AVERAGED_SIDE**2] = 0
        known = np.asarray((shares > 0).all(axis=0), dtype=bool)
        noise = np.sqrt(response.variance) / np.max(response.amplitude)
        pixels = np.median(shares, axis=(1, 2)) * AVERAGED_SIDE**2
        deviation = float(noise * np.sqrt((solve**2 / np.maximum(pixels, 1)).sum(axis=1).max()))
        averages = np.divide(values, shares, out=np.zeros_like(values), where=shares > 0)
        found.append(
            StressVectors(
                dispersion, right[seen], np.tensordot(solve, averages, axes=1), known, deviation
            )
        )
    return found


def _kinds(
    model: PadModel, picture: Picture, light: Array, counts: Mask
) -> tuple[Sequence[Array], Sequence[Array], Sequence[Array]]:
    """Slopes by the vector, sums of values and shares of pixels, of all kinds of one picture."""
    kinds = model.kinds.reshape(light.shape)
    slopes, values, shares = [], [], []
    for kind, form in enumerate(picture.forms):
        mine = counts & (kinds == kind)
        # the vector is twice c (a, b) of the light
        slopes.append(form[:2, 2])
        values.append(uniform_filter(np.where(mine, light - form[2, 2], 0.0), AVERAGED_SIDE))
        shares.append(uniform_filter(mine.astype(float), AVERAGED_SIDE))
    return slopes, values, shares
