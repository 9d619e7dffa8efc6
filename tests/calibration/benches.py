"""Small simulated benches: a sensor that is not the one on the drawing, and its frames."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import chi2 as chi_square

import fringeforce as ff
from fringeforce.estimation.bounds import cramer_rao_bound
from fringeforce.models.imaging import Calibration, Imaging
from fringeforce.optics.camera import expose
from fringeforce.reading.strip_reader import StripFrameReader

N, PIXELS = 11, 512
STRAIN_OPTIC = "transducer.photoelastic.strain_optic_coefficient"
COVER = "transducer.compliant.youngs_modulus"
PLACE = np.array([0.2e-3, 1.005])


def drawing() -> ff.Sensor:
    """The paper's sensor with a smaller camera, dark levels well above zero."""
    camera = {"pixels": PIXELS, "amplitude": 200.0, "offset": 15.0, "noise": 3.0}
    return ff.load_sensor("saad").replace(camera=camera)


def lit(model: ff.SensorModel, rng: np.random.Generator, pattern: float = 0.0) -> ff.SensorModel:
    """A sensor under a lamp of its own, with a camera whose pixels differ by a pattern."""
    along = np.linspace(-0.5, 0.5, PIXELS)
    own = pattern * rng.standard_normal((2, PIXELS))
    imaging = Imaging.known(
        positions=PLACE[0] + PLACE[1] * drawing().pixel_positions,
        amplitude=150 * (1 + 0.25 * np.cos(4.5 * along + 0.6)) + 3 * own[0],
        offset=20 + 3 * np.sin(3 * along) + own[1],
    )
    return replace(model, imaging=imaging)


def presses(rng: np.random.Generator, count: int) -> np.ndarray:
    """Every single load once, then some combined ones."""
    unit = np.eye(2 * N).reshape(2 * N, N, 2) * [3.0, 1.5]
    return np.concatenate([unit, combined(rng, count)])


def combined(rng: np.random.Generator, count: int, largest: float = 2.0) -> np.ndarray:
    size = rng.uniform(0, largest, (count, N)) * (rng.random((count, N)) < 0.7)
    angle = np.radians(rng.uniform(-20, 20, (count, N)))
    return np.stack([size * np.cos(angle), size * np.sin(angle)], axis=2)


def shots(
    true: ff.SensorModel, forces, rng, gains: ArrayLike = 0.0, offsets: ArrayLike = 0.0
) -> np.ndarray:
    """Frames of a lamp whose gain and offset may change from frame to frame."""
    assert true.imaging is not None
    amplitude, offset = true.imaging.amplitude, true.imaging.offset
    return np.array(
        [
            expose(true.sensor.camera, intensity, rng, (amplitude * (1 + gain), offset + dark))
            for intensity, gain, dark in zip(
                true.intensity(forces),
                np.broadcast_to(gains, len(forces)),
                np.broadcast_to(offsets, len(forces)),
                strict=True,
            )
        ]
    )


@dataclass(frozen=True)
class Held:
    """How a model reads frames that it has not seen."""

    efficiency: float
    coverage: float
    chi2: float
    read: float


def held_out(model, true, rng, count: int = 40, gain: float = 0.0, offset: float = 0.0) -> Held:
    """Read new frames; errors in units of the bound of a perfectly known sensor."""
    forces, known = combined(rng, count), StripFrameReader(true)
    frames = shots(
        true, forces, rng, gain * rng.standard_normal(count), offset * rng.standard_normal(count)
    )
    seen = np.abs(true.pixel_positions) < true.sensor.transducer.length / 2
    influence, response = known.influence[seen], true.response.at(seen)
    reader = ff.Reader(model)
    readings = [reader.search(frame) for frame in frames]
    off = np.array([r.forces - load for r, load in zip(readings, forces, strict=True)])
    std = np.array([r.std for r in readings])
    bounds = [cramer_rao_bound(influence @ load.ravel(), influence, response) for load in forces]
    return Held(
        efficiency=float(np.sqrt(np.mean(off**2) / np.mean(np.square(bounds)))),
        coverage=float((np.abs(off) < 1.96 * std).mean()),
        chi2=float(np.mean([r.chi2 for r in readings])),
        read=float(np.mean([r.status is ff.Status.OK for r in readings])),
    )


def findings(model: ff.SensorModel) -> Calibration:
    assert model.calibration is not None
    return model.calibration


def seen_by(model: ff.SensorModel) -> Imaging:
    assert model.imaging is not None
    return model.imaging


def is_plausible(total: float, freedom: int) -> bool:
    """Whether a sum of squared, whitened errors is what chance would make it."""
    low, high = chi_square.ppf([1e-4, 1 - 1e-4], freedom)
    return bool(low < total < high)
