"""What a reader makes of frames that depart from its drawing, one departure at a time.

    python benchmarks/departures.py [frames a row] [seed] [part of a departure's name]

Frames come from the exact Fourier series of the paper's strip with roller edges and not from the
reader's matrix: distributed contacts by quadrature, light and camera by their own formulas.  Every
tactel carries up to 2 N, at up to 30 degrees from the normal; the pixels have a uniform noise of
5 grey levels.

Each departure is read twice: with the drawing alone, and with a drawing that states a tolerance
for it.  OK: share of frames that are read as OK.  far: read as OK, but a force lies more than six
stated standard deviations off.  inside: share of forces within their 95 % intervals.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

import fringeforce as ff
from fringeforce.mechanics import fourier

Array = NDArray[np.float64]

FRAMES, SEED = 40, 0
TERMS = 400
"""Harmonics; ten digits for this cover."""
LARGEST, STEEPEST = 2.0, 30.0
"""Force on a tactel [N] and its angle from the normal [degrees]."""
FAR = 6.0
"""Stated standard deviations."""
INTERVAL = 1.96
"""Standard deviations of a 95 % interval."""
QUADRATURE = 12
"""Gauss points over a wide contact."""
SPECTRUM = 61
"""Wavelengths of a light that is not monochromatic."""


def same(values: Array) -> Array:
    """No change."""
    return values


@dataclass(frozen=True)
class Bench:
    """What makes a frame, and departs from the drawing in one way.

    Attributes
    ----------
    design : mapping
        Values of the sensor that are not those of the drawing.
    width, beside, scatter : float
        Of the contacts: width, common offset, and standard deviation of the offset of each [m].
    shift : float
        Of the camera along the strip [m].
    phase : callable
        What becomes of a phase lead, shape (n_pixels,).
    residual : float
        Standard deviation of a smooth phase lead without load [rad].
    bandwidth : float
        Full width at half maximum of a Gaussian spectrum [m].
    visibility : float
        Of the fringes.
    blur : float
        Standard deviation of the point spread [pixels].
    light : callable
        What becomes of the light, from x / half length and intensity.
    gamma : float
        Power of the grey level as a share of the full scale.
    tolerance : mapping
        Values of a drawing that allows for it.
    """

    design: dict[str, Any] = field(default_factory=dict)
    width: float = 0.0
    beside: float = 0.0
    scatter: float = 0.0
    shift: float = 0.0
    phase: Callable[[Array], Array] = same
    residual: float = 0.0
    bandwidth: float = 0.0
    visibility: float = 1.0
    blur: float = 0.0
    light: Callable[[Array, Array], Array] = lambda _, intensity: intensity
    gamma: float = 1.0
    tolerance: dict[str, Any] = field(default_factory=dict)


BENCHES = {
    "none": Bench(),
    "contacts 0.8 mm wide in the place of points": Bench(
        width=0.8e-3, tolerance={"tactels.contact_width": "0.5 +/- 0.3 mm"}
    ),
    "all presses 0.05 mm beside the tactels": Bench(
        beside=0.05e-3, tolerance={"tactels.placement": "0 +/- 0.05 mm"}
    ),
    "each press 0.1 mm rms beside its tactel": Bench(
        scatter=0.1e-3, tolerance={"tactels.placement": "0 +/- 0.1 mm"}
    ),
    "forces half way between tactels": Bench(
        beside=0.5e-3, tolerance={"tactels.placement": "0.4 +/- 0.1 mm"}
    ),
    "camera shifted by 0.05 mm": Bench(shift=0.05e-3, tolerance={"camera.shift": "0 +/- 0.05 mm"}),
    "cover 5 % thicker": Bench(
        {"transducer.compliant.thickness": 0.525e-3},
        tolerance={"transducer.compliant.thickness": "0.5 mm +/- 5 %"},
    ),
    "light 5 % darker at the ends": Bench(
        light=lambda x, light: light * (1 - 0.05 * x**2), tolerance={"camera.unevenness": "5 %"}
    ),
    "lamp 3 % dim": Bench(
        light=lambda _, light: 0.97 * light, tolerance={"camera.amplitude": "245 +/- 3 %"}
    ),
    "residual retardance 0.1 rad": Bench(
        residual=0.1, tolerance={"polariscope.residual": "0 +/- 0.1 rad"}
    ),
    "blur of 4 px": Bench(blur=4.0, tolerance={"camera.blur": "30 +/- 20 um"}),
    "blur of 12 px": Bench(blur=12.0, tolerance={"camera.blur": "100 +/- 50 um"}),
    "gamma 1.05": Bench(gamma=1.05, tolerance={"camera.gamma": "1 +/- 0.05"}),
    "fringe visibility 0.95": Bench(
        visibility=0.95, tolerance={"polariscope.visibility": "0.97 +/- 0.02"}
    ),
    "LED 20 nm wide": Bench(bandwidth=20e-9, tolerance={"polariscope.bandwidth": "20 nm"}),
    "phase 1 % nonlinear at 6 rad": Bench(
        phase=lambda p: p * (1 + 0.01 * p / 6), tolerance={"transducer.influence_error": "1 %"}
    ),
    "clear layer 5 % softer (scale)": Bench(
        {"transducer.photoelastic.youngs_modulus": 104.5e6},
        tolerance={"transducer.photoelastic.youngs_modulus": "110 MPa +/- 5 %"},
    ),
}


def exact_influence(bench: Bench, sensor: ff.Sensor, centres: Array, x: Array) -> Array:
    """Phase lead per force from the Fourier series, shape (n_pixels, n, 2) [rad/N]."""
    strip = sensor.transducer
    nodes, weights = np.polynomial.legendre.leggauss(QUADRATURE if bench.width else 1)
    places = centres[:, None] + bench.width / 2 * nodes
    lines = fourier.integrated_stress(strip, places.ravel(), x, TERMS)
    stress = np.einsum("mcqt,q->mct", lines.reshape(len(x), *places.shape, 2), weights / 2)
    clear = strip.photoelastic
    constant = (1 + clear.poissons_ratio) / clear.youngs_modulus * 2 * np.pi
    return 2 * constant * clear.strain_optic_coefficient / sensor.polariscope.wavelength * stress


def intensity(bench: Bench, phase: Array, wavelength: float) -> Array:
    """Dark-field light, averaged over the spectrum."""
    if not bench.bandwidth:
        swing = np.cos(phase)
    else:
        deviation = bench.bandwidth / np.sqrt(8 * np.log(2))
        steps = np.linspace(-5, 5, SPECTRUM)
        weights = np.exp(-(steps**2) / 2)
        ratio = wavelength / (wavelength + deviation * steps)
        swing = np.cos(phase[:, None] * ratio) @ weights / weights.sum()
    return (1 - bench.visibility * swing) / 2


def smooth(x: Array, rng: np.random.Generator, length: float = 5e-3) -> Array:
    """A Gaussian process of unit variance, by the eigenvectors of its covariance."""
    some = np.linspace(x[0], x[-1], 101)
    values, vectors = np.linalg.eigh(np.exp(-(((some[:, None] - some) / length) ** 2) / 2))
    drawn = vectors @ (np.sqrt(np.maximum(values, 0)) * rng.standard_normal(len(some)))
    return np.interp(x, some, drawn)


def exposed(
    bench: Bench, sensor: ff.Sensor, forces: Array, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Frames of one bench, shape (frames, n_pixels), uint8."""
    made, camera = sensor.replace(**bench.design), sensor.camera
    half = sensor.transducer.length / 2
    seen = sensor.pixel_positions
    x = np.clip(seen + bench.shift, -half, half)
    tactels = sensor.tactels.positions
    fixed = None
    if not bench.scatter:
        fixed = exact_influence(bench, made, tactels + bench.beside, x)
    frames = np.empty((len(forces), camera.pixels), dtype=np.uint8)
    for frame, load in zip(frames, forces, strict=True):
        influence = fixed
        if influence is None:
            beside = rng.normal(bench.beside, bench.scatter, len(tactels))
            influence = exact_influence(bench, made, tactels + beside, x)
        phase = bench.phase(np.einsum("mct,ct->m", influence, load))
        if bench.residual:
            phase = phase + bench.residual * smooth(x, rng)
        light = intensity(bench, phase, made.polariscope.wavelength)
        if bench.blur:
            light = gaussian_filter1d(light, bench.blur, mode="nearest")
        level = camera.amplitude * bench.light(x / half, light) + camera.offset
        level = camera.full_scale * (level / camera.full_scale) ** bench.gamma
        noisy = level + rng.uniform(-camera.noise, camera.noise, len(level))
        frame[:] = np.clip(np.rint(noisy), 0, camera.full_scale)
    return frames


def loads(frames: int, tactels: int, rng: np.random.Generator) -> Array:
    """Presses on every tactel, shape (frames, n, 2) [N]."""
    size = rng.uniform(0, LARGEST, (frames, tactels))
    return ff.polar(size, rng.uniform(-STEEPEST, STEEPEST, (frames, tactels)))


def row(reader: ff.Reader, frames: NDArray[np.uint8], forces: Array) -> str:
    """Shares of frames that are OK and far off, and of forces inside their intervals."""
    errors = []
    for frame, truth in zip(frames, forces, strict=True):
        reading = reader.search(frame)
        if reading.status is ff.Status.OK:
            errors.append(np.abs(reading.forces - truth) / reading.std)
    if not errors:
        return f"{0:>5.0%} {'':>4} {'':>7}"
    off = np.array(errors)
    far = (off > FAR).any(axis=(1, 2)).mean()
    return f"{len(errors) / len(frames):>5.0%} {far:>4.0%} {(off < INTERVAL).mean():>7.1%}"


def main() -> None:
    """Print the table."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else FRAMES
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else SEED
    wanted = sys.argv[3] if len(sys.argv) > 3 else ""
    sensor = ff.load_sensor("saad").replace(**{"transducer.edges": "roller"})
    plain = ff.Reader(ff.characterize(sensor))
    print(f"{'':<45}    as drawn          with a tolerance")
    print(f"{'departure':<45}   OK  far  inside     OK  far  inside")
    for number, (name, bench) in enumerate(BENCHES.items()):
        if wanted not in name:
            continue
        rng = np.random.default_rng([seed, number])
        forces = loads(frames, sensor.tactels.count, rng)
        seen = exposed(bench, sensor, forces, rng)
        told = ff.Reader(ff.characterize(sensor.replace(**bench.tolerance)))
        print(f"{name:<45} {row(plain, seen, forces)}  {row(told, seen, forces)}", flush=True)


if __name__ == "__main__":
    main()
