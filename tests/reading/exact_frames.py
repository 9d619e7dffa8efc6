"""Frames of strips by the exact Fourier series, with contacts, light and camera as they please.

Nothing of the reader's model is used: tractions are integrated by Gauss quadrature over the series,
the point spread and the response by their own formulas.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

import fringeforce as ff
from fringeforce.mechanics import fourier

Array = NDArray[np.float64]

NODES, WEIGHTS = leggauss(8)


@dataclass
class Bench:
    """A strip with roller edges as it is built; lengths in metres, blur in pixels."""

    sensor: ff.Sensor
    places: Array
    widths: Array
    shift: float = 0.0
    residual: Array = field(default_factory=lambda: np.zeros(1))
    gain: Array = field(default_factory=lambda: np.ones(1))
    visibility: float = 1.0
    blur: float = 0.0
    gamma: float = 1.0
    shares: Array | None = None  # of the light of each channel in each; of one channel if none
    light: tuple[Array, Array] | None = (
        None  # amplitude and offset of channels, if not the camera's
    )

    def influence(self) -> Array:
        """Phase lead per force, shape (n_pixels, n, 2) [rad/N]."""
        strip, half = self.sensor.transducer, self.sensor.transducer.length / 2
        x = np.clip(self.sensor.pixel_positions + self.shift, -half, half)
        points = self.places[:, None] + self.widths[:, None] / 2 * NODES
        lines = fourier.integrated_stress(strip, points.ravel(), x, 300)
        stress = np.einsum("mcqt,q->mct", lines.reshape(len(x), *points.shape, 2), WEIGHTS / 2)
        clear, light = strip.photoelastic, self.sensor.polariscope.wavelength
        compliance = (1 + clear.poissons_ratio) / clear.youngs_modulus
        return 4 * np.pi * compliance * clear.strain_optic_coefficient / light * stress

    def frames(self, forces: Array, rng: np.random.Generator) -> NDArray[np.uint8]:
        """Frames of forces (k, n, 2), shape (k, n_pixels) or (k, n_channels, n_pixels)."""
        camera = self.sensor.camera
        phase = np.einsum("mct,kct->km", self.influence(), forces) + self.residual
        if self.shares is not None:
            drawn = self.sensor.polariscope
            waves = [channel.wavelength or drawn.wavelength for channel in drawn.channels]
            phase = phase[:, None] * (drawn.wavelength / np.array(waves))[:, None]
        light = (1 - self.visibility * np.cos(phase)) / 2
        if self.shares is not None:
            light = np.einsum("cd,kdm->kcm", self.shares, light)
        if self.blur:
            light = gaussian_filter1d(light, self.blur, axis=-1, mode="nearest")
        amplitude, offset = self.light or (np.array(camera.amplitude), np.array(camera.offset))
        level = offset[..., None] + amplitude[..., None] * self.gain * light
        level = camera.full_scale * (level / camera.full_scale) ** self.gamma
        noise = self.sensor.noise[:, None] * rng.uniform(-1, 1, level.shape)
        return np.clip(np.rint(level + noise), 0, camera.full_scale).astype(np.uint8)


def drawing(**values: object) -> ff.Sensor:
    """The paper's strip with roller edges, for which there is an exact series."""
    return ff.load_sensor("saad").replace(**{"transducer.edges": "roller"}).replace(**values)


def loads(rng: np.random.Generator, frames: int, tactels: int = 11, largest: float = 2.0) -> Array:
    """Contacts that push, at up to 30 degrees from the normal, shape (frames, n, 2) [N]."""
    size = rng.uniform(0, largest, (frames, tactels))
    return ff.polar(size, rng.uniform(-30, 30, (frames, tactels)))
