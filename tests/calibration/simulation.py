"""Simulated calibrations whose errors, and nothing else, disturb readings."""

import numpy as np
from scipy.optimize import least_squares

import fringeforce as ff
from fringeforce.calibration.frame_fit import levenberg_marquardt
from fringeforce.calibration.measurements import Measurements
from fringeforce.calibration.planning.knowledge import knowledge
from fringeforce.estimation.bounds import covariance
from fringeforce.models.imaging import camera_response

REPEATS = 40


class Simulation:
    """Frames of loads, fitted; then typical loads read without noise: only the fit's errors act."""

    def __init__(self, model: ff.SensorModel, typical: np.ndarray) -> None:
        self.model, self.known = model, knowledge(model)
        truth = model.pixel_influence.reshape(model.sensor.camera.pixels, -1)
        response, used = camera_response(model.sensor.camera), self.known.used
        self.typical = typical.reshape(len(typical), -1)
        self.levels = [response.level(truth @ load)[used] for load in self.typical]
        spreads = [covariance(truth[used] @ f, truth[used], response) for f in self.typical]
        self.noise = float(np.mean([np.trace(spread) for spread in spreads]))

    def added(self, loads: np.ndarray) -> np.ndarray:
        """Squared share of error that each of REPEATS calibrations adds."""
        rng = np.random.default_rng(6)
        return np.array([self._one(loads, rng) for _ in range(REPEATS)])

    def _one(self, loads: np.ndarray, rng: np.random.Generator) -> float:
        frames, sensor = self.model.expose(loads, rng=rng).astype(float), self.model.sensor
        flat, used = loads.reshape(len(loads), -1), self.known.used
        bench = Measurements(sensor, frames, flat, self.known.measured.basis)
        at = levenberg_marquardt(bench, self.known.unknowns, self.known.jacobian, used).unknowns
        matrix = self.known.jacobian.matrix(at.design, at.positions(sensor))[used]
        response = at.response(bench).at(used)
        off = [
            least_squares(
                lambda f, level=level: response.level(matrix @ f) - level,
                load,
                jac=lambda f: response.slope(matrix @ f)[:, None] * matrix,  # pyright: ignore
                method="lm",
            ).x
            - load
            for level, load in zip(self.levels, self.typical, strict=True)
        ]
        return float(np.square(off).sum(axis=1).mean() / self.noise)
