"""How one camera really sees one strip, and what a calibration found out about both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fringeforce.design.light import CROSSTALK, Polariscope
from fringeforce.design.parts import Converter
from fringeforce.design.strip import Sensor
from fringeforce.estimation.likelihood import Response
from fringeforce.models.bench_record import BenchRecord
from fringeforce.optics.camera import noise_variance
from fringeforce.optics.jones import Fringe
from fringeforce.optics.polariscope import Picture, together

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


ABSOLUTE = "camera", "tactel ", CROSSTALK
"""What names of values begin with whose deviations are not relative."""


@dataclass(frozen=True, eq=False)
class Imaging:
    """Where every pixel looks, how it is lit, and how sure that is.

    What is uncertain is written as modes: each is what one independent unknown of unit variance
    changes, so that a covariance is the sum of the modes' outer products.

    Attributes
    ----------
    positions : ndarray, shape (P,)
        Places along the strip [m]; beyond its ends for pixels that see no strip.
    amplitude, offset : ndarray, shape (C P,)
        A and I_o of equation (13) at every pixel of the C channels in turn, grey levels, as
        measured: they hold the visibility of the fringes.
    usable : ndarray of bool, shape (C P,)
        False for pixels that are dead, stuck or see no strip.
    influence_modes : ndarray, shape (d, P, n, 2)
        Modes of the influence matrix [rad/N].
    amplitude_modes, offset_modes : ndarray, shape (k, C P), k >= d
        Modes of the lighting, grey levels; the first d belong to the modes of the matrix.
    light_variance : float or ndarray, shape (C,)
        Mean variance of the grey levels that amplitude and offset of single pixels, independent
        of each other, are uncertain by, of all channels or each; readings count it as noise.
    drift : pair of float
        Standard deviations from frame to frame of the gain of the amplitude, and of the offset in
        grey levels.
    residual : ndarray, shape (P,), optional
        Phase lead without load [rad]; that of the design if not given.
    phase_modes : ndarray, shape (k, P), optional
        Modes of the residual [rad]; none if not given.
    lens_modes : ndarray, shape (k, 2), optional
        Modes of the camera's blur [m] and gamma; none if not given.
    crosstalk_modes : ndarray, shape (k, C (C - 1)), optional
        Modes of the share of light of each pair of channels; none if not given.
    """

    positions: Array
    amplitude: Array
    offset: Array
    usable: Mask
    influence_modes: Array
    amplitude_modes: Array
    offset_modes: Array
    light_variance: Array | float = 0.0
    drift: tuple[float, float] = (0.0, 0.0)
    residual: Array | None = None
    phase_modes: Array | None = None
    lens_modes: Array | None = None
    crosstalk_modes: Array | None = None

    @classmethod
    def known(cls, positions: Array, amplitude: Array, offset: Array) -> Imaging:
        """One that is known exactly, such as that of a simulated bench; shapes (P,) and (C P,)."""
        none, usable = np.empty((0, len(amplitude))), np.ones(len(amplitude), dtype=bool)
        influence = np.empty((0, len(positions), 0, 2))
        return cls(positions, amplitude, offset, usable, influence, none, none)

    def level_modes(self, loads: Array, phase: Array) -> Array:
        """Modes of the grey levels of one channel under given loads, those of the lens left out.

        Parameters
        ----------
        loads : ndarray, shape (2n,)
            Normal and tangential force of tactel after tactel [N].
        phase : ndarray, shape (P,)
            Phase, residual included [rad].

        Returns
        -------
        ndarray, shape (k, P)
            Grey levels.
        """
        count, pixels = self.influence_modes.shape[:2]
        levels = self.amplitude_modes * np.sin(phase / 2) ** 2 + self.offset_modes
        slope = self.amplitude / 2 * np.sin(phase)
        if count:
            turned = self.influence_modes.reshape(count, pixels, -1) @ loads
            levels[:count] += turned * slope
        if self.phase_modes is not None:
            levels += self.phase_modes * slope
        return levels


@dataclass(frozen=True, eq=False)
class Calibration:
    """What a calibration found.

    Attributes
    ----------
    names : tuple of str
        Unknowns: dotted paths of the design or "tactel 1 position" [m] and so on, then, of a strip,
        "camera shift" [m], "camera scale" [1] and shares of cross-talk.
    drawing, values : ndarray, shape (d,)
        Before and after.
    covariance : ndarray, shape (d, d)
        Covariance of the logarithms of the design's values, but of places [m], and of values of the
        camera and of cross-talk in their units.
    unidentified : tuple of str
        Combinations that the frames say nothing of; along them the drawing was kept.
    outliers : tuple of int
        Rows of frames that contradict the others and were left out.
    dead : tuple of int
        Pixels that do not follow the light and were left out.
    chi2 : float
        Reduced chi-square of the frames that were kept; near one if all is understood.
    findings : tuple of str
        All that a person should know, in sentences.
    checked : tuple of int
        Frames that were put aside, those of them that are explained, their forces within 95 %
        intervals, and all these forces.
    usable : bool
        Whether readings by the model can be trusted.
    delay : float
        By which the log of the loads was behind the frames, if there was one [s].
    record : BenchRecord, optional
        Contacts as found and residuals, for pictures.
    modes : ndarray, shape (d, k), optional
        What every mode of the imaging changes in the values, in the units of the covariance; if not
        given, the first modes are the covariance's Cholesky factor.
    scatter : tuple of float
        Standard deviations from frame to frame of normal and tangential forces over the whole force
        of a contact, places and widths of contacts [m], the lamp's gain and offset [grey levels];
        empty if that was not found.
    """

    names: tuple[str, ...]
    drawing: Array
    values: Array
    covariance: Array
    unidentified: tuple[str, ...]
    outliers: tuple[int, ...]
    dead: tuple[int, ...]
    chi2: float
    findings: tuple[str, ...]
    checked: tuple[int, ...] = (0, 0, 0, 0)
    usable: bool = True
    delay: float = 0.0
    record: BenchRecord | None = None
    modes: Array | None = None
    scatter: tuple[float, ...] = ()

    @property
    def std(self) -> Array:
        """Standard deviations of the values, shape (d,), in their own units."""
        relative = np.array([not name.startswith(ABSOLUTE) for name in self.names])
        return np.sqrt(np.diag(self.covariance)) * np.where(relative, np.abs(self.values), 1.0)


def designed_response(sensor: Sensor, seen: Sequence[Picture]) -> Response:
    """Response of a camera to the pictures of a design, all pixels of each in turn."""
    camera, (bright, dark) = sensor.camera, sensor.light
    if len(seen) == 1 and replace(seen[0].fringe, spread=0.0) == Fringe():
        return camera_response(camera, float(bright[0]), float(dark[0]), float(sensor.noise[0]))
    fringes = np.array([[p.fringe.amplitude, p.fringe.bias, p.fringe.offset] for p in seen]).T
    strength, lost = (together(sensor.polariscope, list(row[:, None])) for row in fringes[[0, 2]])
    own = [bright * np.ravel(strength), fringes[1], dark + bright * np.ravel(lost)]
    amplitude, bias, offset = np.repeat(own, camera.pixels, axis=1)
    shares = fringe_shares(sensor.polariscope, seen)
    light = amplitude, offset, *pixel_noise(sensor)
    return replace(camera_response(camera, *light), bias=bias, shares=shares)


def pixel_noise(sensor: Sensor, imaging: Imaging | None = None) -> tuple[Array, Array]:
    """Noise of every pixel of a strip, and variance of what is uncertain of its light, (C P,)."""
    light = np.zeros(1) if imaging is None else imaging.light_variance
    every = np.broadcast_arrays(sensor.noise, light)
    noise, variance = np.repeat(every, sensor.camera.pixels, axis=1)
    return noise, variance


def fringe_shares(light: Polariscope, seen: Sequence[Picture]) -> Array:
    """Share that the fringes of every channel have in those of each; (0, 0) without cross-talk."""
    shares = light.channel_shares
    if not len(shares):
        return shares
    weighed = shares * np.array([one.fringe.amplitude for one in seen])
    return np.asarray(weighed / weighed.sum(axis=1, keepdims=True))


def camera_response(
    camera: Converter,
    amplitude: Array | float | None = None,
    offset: Array | float | None = None,
    noise: Array | float | None = None,
    light_variance: Array | float = 0.0,
    brighter: float = 0.0,
) -> Response:
    """Response of a camera; it clips only where its noise can carry a level beyond its range.

    Parameters
    ----------
    camera : Converter
        As designed.
    amplitude, offset : ndarray, shape (P,), or float, optional
        Measured ones, or those of a channel, which take the place of the design's, grey levels.
    noise : ndarray, shape (P,), or float, optional
        Of channels that have their own, in place of the camera's, grey levels.
    light_variance : ndarray, shape (P,), or float
        Variance by which they are uncertain from pixel to pixel, squared grey levels.
    brighter : float
        Share by which all light may be brighter than that.
    """
    bright = camera.amplitude if amplitude is None else amplitude
    dark = camera.offset if offset is None else offset
    own = camera.noise if noise is None else noise
    reach = own * (1 if camera.noise_model == "uniform" else 4)
    brightest = float(np.max((dark + bright) * (1 + brighter) + reach))
    return Response(
        amplitude=bright,
        offset=dark,
        variance=noise_variance(camera, own) + light_variance,
        floor=0.0 if np.min(dark - reach) < -0.5 else -np.inf,
        ceiling=float(camera.full_scale) if brightest > camera.full_scale + 0.5 else np.inf,
    )
