"""Frames that show the light alone: in the dark, unloaded, and with the analyser turned.

Behind crossed polarisers the grey level is A sin^2(p/2) + I_o, so without load it is the offset
I_o.  An analyser turned by 90 degrees passes what was blocked: A cos^2(p/2) + I_o, which without
load is I_o + A.  The mean of k such frames therefore enters a fit as one row of a load that is
zero, of a phase that is 0 or pi, and of a noise that is smaller by the root of k.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import InputError
from fringeforce.calibration.frame_fit import FrameFit
from fringeforce.calibration.light.fixed_pattern_noise import FixedPatternNoise
from fringeforce.calibration.measurements import Measurements, Unknowns
from fringeforce.calibration.normal_equations import EVERY, NormalEquations, linearised
from fringeforce.calibration.predictions import predict
from fringeforce.design.strip import Sensor
from fringeforce.optics.camera import noise_variance

CLIPPED = 0.01
"""Share of grey levels at full scale beyond which a reference says nothing of the light."""
STEADY = 0.05
"""Root-mean-square change of a pattern, in its own deviations, below which it stays."""


@dataclass(frozen=True, eq=False)
class References:
    """Frames without load; each kind may be missing.

    Attributes
    ----------
    dark : array_like, shape (k, n_pixels), optional
        Light off: the dark level of every pixel.
    unloaded : array_like, shape (k, n_pixels), optional
        Light on, polarisers crossed: the offset I_o.
    bright : array_like, shape (k, n_pixels), optional
        Light on, the analyser turned by 90 degrees: I_o + A.

    Examples
    --------
    >>> ff.References(dark=np.full((10, 2048), 3)).unloaded is None
    True
    """

    dark: ArrayLike | None = None
    unloaded: ArrayLike | None = None
    bright: ArrayLike | None = None

    def checked(self, sensor: Sensor) -> dict[str, Array]:
        """Frames of every kind that is there, as floats of shape (k, n_pixels).

        Raises
        ------
        InputError
            If one does not fit the camera, is saturated, or is darker than it must be.
        """
        found, camera = {}, sensor.camera
        for kind in ("dark", "unloaded", "bright"):
            if getattr(self, kind) is None:
                continue
            levels = np.atleast_2d(np.asarray(getattr(self, kind), dtype=float))
            if levels.ndim != 2 or levels.shape[1] != camera.pixels or not len(levels):
                raise InputError(
                    f"{kind.capitalize()} frames of shape {levels.shape} do not fit this sensor; "
                    f"give (frames, {camera.pixels})."
                )
            if not ((levels >= 0) & (levels <= camera.full_scale)).all():
                raise InputError(
                    f"{kind.capitalize()} frames hold grey levels that are not from 0 to "
                    f"{camera.full_scale}; check the camera's bits in the design."
                )
            if (full := (levels >= camera.full_scale).mean()) > CLIPPED:
                raise InputError(
                    f"{full:.0%} of the grey levels of the {kind} frames are at "
                    f"{camera.full_scale}; shorten the exposure of all frames and take them again."
                )
            found[kind] = levels
        kinds = list(found)
        for darker, brighter in pairwise(kinds):
            low, high = np.median(found[darker]), np.median(found[brighter])
            if low > high + np.sqrt(noise_variance(camera)):
                raise InputError(
                    f"The {darker} frames (median {low:g}) are brighter than the {brighter} ones "
                    f"({high:g}); were they swapped?"
                )
        return found


def with_references(measured: Measurements, references: dict[str, Array]) -> Measurements:
    """Measurements with the mean of every kind of lit reference as a further row."""
    kinds = [kind for kind in ("unloaded", "bright") if kind in references]
    means = [references[kind].mean(axis=0) for kind in kinds]
    turned = [np.pi * (kind == "bright") for kind in kinds]
    return replace(
        measured,
        levels=np.concatenate([measured.levels, *[mean[None] for mean in means]]),
        loads=np.concatenate([measured.loads, np.zeros((len(kinds), measured.loads.shape[1]))]),
        turned=np.append(measured.turned, turned),
        averaged=np.append(measured.averaged, [len(references[kind]) for kind in kinds]),
    )


def patterned(
    measured: Measurements, fit: FrameFit, references: dict[str, Array], sound: Mask
) -> Measurements:
    """The measurements with a pattern whose size is what pixels differ by beyond noise.

    References say so of what they show; of the rest, loaded frames do.

    Parameters
    ----------
    measured : Measurements
        All frames, lit references last, with no pattern yet.
    fit : FrameFit
        Fit of these frames.
    references : dict of ndarray
        As checked.
    sound : ndarray of bool, shape (P,)
        Pixels that follow the light.
    """
    noise, weight = noise_variance(measured.sensor.camera), sound.astype(float)
    predicted = predict(measured, fit.unknowns, fit.jacobian, weight)
    lit = [kind for kind in ("unloaded", "bright") if kind in references]
    rows = range(len(predicted.residuals) - len(lit), len(predicted.residuals))
    left = {
        k: -predicted.residuals[row] / predicted.scale[row]
        for k, row in zip(lit, rows, strict=True)
    }
    dark = None
    if "dark" in references:
        mean = references["dark"].mean(axis=0)
        smooth = np.linalg.lstsq(measured.basis[sound], mean[sound], rcond=None)[0]
        dark = left["dark"] = np.where(sound, mean - measured.basis @ smooth, 0.0)
    errors = {kind: noise / len(references[kind]) for kind in left}
    sizes = _sizes({kind: values[sound] for kind, values in left.items()}, errors, fit.normal)
    pattern = FixedPatternNoise.unseen(len(measured.basis), sizes, dark, errors.get("dark", noise))
    if not lit:
        return replace(measured, pattern=pattern)
    alone = measured.rows(np.arange(len(measured.levels)) >= rows[0])
    normal = linearised(alone, fit.unknowns, fit.jacobian, weight)
    return replace(measured, pattern=pattern.improved(normal.pixel_gradient, normal.pixels))


def _sizes(
    left: dict[str, Array], errors: dict[str, float], normal: NormalEquations
) -> tuple[float, float]:
    """Standard deviations of amplitude and offset over the pixels, without noise [grey levels]."""
    used = np.linalg.det(np.moveaxis(normal.pixels, 2, 0)) > 0
    pixels = np.moveaxis(normal.pixels[:, :, used], 2, 0)
    free = -np.linalg.solve(pixels, normal.pixel_gradient[:, used].T[..., None])[..., 0].T
    variances = np.median(np.linalg.inv(pixels), axis=0)
    base = next((kind for kind in ("unloaded", "dark") if kind in left), None)
    if base is None:
        offset = _excess(free[1], variances[1, 1])
    else:
        offset = _excess(left[base], errors[base])
    if base is None or "bright" not in left:
        amplitude = _excess(free[0], variances[0, 0])
    else:
        amplitude = _excess(left["bright"] - left[base], errors["bright"] + errors[base])
    return float(np.sqrt(amplitude)), float(np.sqrt(offset))


def _excess(values: Array, noise: float) -> float:
    """Variance beyond that of noise, from quartiles, which single bad pixels do not move."""
    low, high = np.quantile(values, [0.25, 0.75])
    return max(float((high - low) / 1.349) ** 2 - noise, 0.0)


def improved(measured: Measurements, fit: FrameFit) -> tuple[Measurements, Unknowns]:
    """Measurements and unknowns with the likeliest pattern; the same objects if it hardly changes.

    The smooth part of a pattern is handed over to the smooth lighting, where it costs nothing.

    Parameters
    ----------
    measured : Measurements
        With the pattern that is there so far, if any.
    fit : FrameFit
        Fit of frames with that pattern.
    """
    pattern, at = measured.pattern, fit.unknowns
    if pattern is None:
        return measured, at
    better = pattern.improved(fit.normal.pixel_gradient, fit.normal.pixels)
    information = pattern.information(fit.normal.pixels)
    step = better.levels - pattern.levels
    moved = np.einsum("ap,pab,bp->p", step, information, step).mean()
    if moved < STEADY**2:
        return measured, at
    smooth = np.linalg.lstsq(measured.basis, (better.levels - better.known).T, rcond=None)[0]
    better = replace(better, levels=better.levels - (measured.basis @ smooth).T)
    at = replace(at, amplitude=at.amplitude + smooth[:, 0], offset=at.offset + smooth[:, 1])
    return replace(measured, pattern=better), at


def pattern_response(
    measured: Measurements,
    normal: NormalEquations,
    modes: Array,
    columns: Array | None = None,
    pixels: slice = EVERY,
) -> Array:
    """What modes of the other unknowns change in the likeliest pattern, shape (2, k, p).

    Parameters
    ----------
    measured : Measurements
        With a pattern.
    normal : NormalEquations
        The frames about the fit.
    modes : ndarray, shape (m, k)
        Changes of the shared unknowns.
    columns : ndarray, shape (k, p, 2n), optional
        Changes of the matrix that go with them [rad/N].
    pixels : slice
        The p pixels that are wanted.
    """
    coupling = normal.coupling[pixels, : len(modes)]
    if measured.pattern is None:
        return np.zeros((2, modes.shape[1], len(coupling)))
    pulled = np.swapaxes(coupling, 1, 2) @ modes
    if columns is not None:
        by_matrix = normal.by_matrix(normal.jacobian.lit)[:, pixels]
        pulled += np.einsum("apj,kpj->pak", by_matrix, columns, optimize=True)
    follow = -np.linalg.solve(measured.pattern.information(normal.pixels)[pixels], pulled)
    return np.asarray(np.moveaxis(follow, 0, 2), dtype=float)


def pattern_variance(measured: Measurements, normal: NormalEquations, used: Mask) -> float:
    """Mean variance that the pattern's own errors give a grey level of the used pixels.

    Over intensities as the frames show them to every pixel.
    """
    if measured.pattern is None:
        return 0.0
    errors = np.linalg.inv(measured.pattern.information(normal.pixels))[used]
    shown = normal.pixels[:, :, used] / normal.pixels[1, 1, used]
    return float(np.einsum("pab,abp->p", errors, shown).mean())


def pattern_freedom(measured: Measurements, normal: NormalEquations, used: Mask) -> float:
    """Number of free unknowns that the pattern of the used pixels amounts to."""
    if measured.pattern is None:
        return 0.0
    whole = measured.pattern.information(normal.pixels)
    shares = np.linalg.solve(whole, np.moveaxis(normal.pixels, 2, 0))
    return float(np.einsum("paa->p", shares)[used].sum())
