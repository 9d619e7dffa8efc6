"""Simulated benches that scatter, fitted; their errors, and nothing else, disturb readings."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

import fringeforce as ff
from fringeforce.calibration.bench_expectation import DOUBT, FIELDS
from fringeforce.calibration.bench_loads import loads_on_tactels
from fringeforce.calibration.calibrate import PARAMETERS
from fringeforce.calibration.shared_unknowns import State
from fringeforce.calibration.strip_search import StripSearch
from fringeforce.estimation.bounds import fisher_information
from fringeforce.estimation.frame_exposure import expose, node_columns
from fringeforce.estimation.frame_model import FrameModel
from fringeforce.models.as_built import BuiltSensor

REPEATS = 40
ENTRIES = tuple(PARAMETERS)
SCATTER = {
    "tactels.placement": f"0 +/- {DOUBT['place'] * 1e3} mm",
    "tactels.contact_width": f"0.5 +/- {DOUBT['width'] * 1e3} mm",
    "camera.drift": DOUBT["gain"],
}
"""What scatters from frame to frame, beside forces."""
LASTING = {
    "camera.unevenness": FIELDS["bright"],
    "polariscope.residual": f"0 +/- {FIELDS['residual']} rad",
}
"""What differs from sensor to sensor and that no design value explains."""


def scattered(loads: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """What is applied where `loads` are written down: off by a share, and by the full scale's."""
    sizes = np.linalg.norm(loads, axis=2, keepdims=True)
    unit = np.hypot(sizes, 0.05 * sizes.max()) * (sizes > 0)
    return loads + unit * [DOUBT["normal"], DOUBT["tangential"]] * rng.standard_normal(loads.shape)


def shaken(sensor: ff.Sensor) -> BuiltSensor:
    """The sensor as drawn, on a bench whose contacts and lamp scatter."""
    exact = sensor.replace(tolerances=dict.fromkeys(sensor.tolerances, 0.0))
    return ff.characterize(exact.replace(**SCATTER)).as_built(0)


def slopes(model: FrameModel, unknowns: np.ndarray, count: int) -> np.ndarray:
    """Derivatives of the grey levels by the first unknowns, shape (P, count).

    Of a sharp camera with a linear response: the fringes of a channel change with its phase by half
    of what lies between those a quarter of a turn ahead and behind.
    """
    change = np.zeros(len(model.amplitude))
    for channel, ratio in zip(np.eye(len(model.bias)), model.dispersion, strict=True):
        ahead, behind = (
            expose(model._replace(bias=model.bias + turn * channel), unknowns)[0]
            for turn in (np.pi / 2, -np.pi / 2)
        )
        change += ratio * (ahead - behind) / 2
    nodes = model.first[:, None] + np.arange(4)
    columns = np.einsum("pk,upk->pu", model.weights, node_columns(model, unknowns)[:count, nodes])
    return change[:, None] * columns


class Simulation:
    """Frames of loads, fitted; then typical loads read without noise: only the fit's errors act."""

    def __init__(self, model: ff.SensorModel, typical: np.ndarray) -> None:
        self.model, self.bench = model, shaken(model.sensor)
        truth, response = model.frame_influence, model.response
        self.typical = typical.reshape(len(typical), -1)
        told = [fisher_information(truth @ f, truth, response) for f in self.typical]
        spreads = np.linalg.inv(told)
        self.noise = float(np.mean([np.trace(spread) for spread in spreads]))
        self.levels = response.level(self.typical @ truth.T)

    def added(self, loads: np.ndarray, repeats: int = REPEATS, seed: int = 6) -> np.ndarray:
        """Squared share of error that each of so many calibrations adds."""
        rng, listed = np.random.default_rng(seed), loads_on_tactels(loads, self._places)
        search = StripSearch(self.model.sensor, self._frames(loads, rng), listed, ENTRIES, {})
        start, reader = search.state, self._reader()
        found = []
        for _ in range(repeats):
            search.levels, search.state = self._frames(loads, rng), start
            search.descend(search.kept, 1.0)
            found.append(reader(search.state))
        return np.array(found)

    @property
    def _places(self) -> np.ndarray:
        return self.model.sensor.tactels.positions[:, None]

    def _frames(self, loads: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        frames = self.bench.expose(scattered(loads, rng), rng=rng)
        return frames.reshape(len(frames), -1).astype(float)

    def _reader(self) -> Callable[[State], float]:
        """What reads typical loads with the sensor that a fit found, and says how far it errs."""
        loads = self.typical.reshape(len(self.typical), -1, 2) + 1e-9  # all tactels are read
        listed = loads_on_tactels(loads, self._places)
        search = StripSearch(self.model.sensor, self.levels, listed, ENTRIES, {})
        plain, used = search.posterior(np.ones(len(loads)), 1.0), slice(2, -2)

        def share(state: State) -> float:
            models, total = plain.models(state.shared), 0.0
            for f, level in enumerate(self.levels):
                own = plain.mean(f, state.shared)
                count = 2 * int((search.which[f] >= 0).sum())
                unknowns, model = models.unknowns(f, own, state.shared), models.of_frame(f)

                def left(loads: np.ndarray) -> np.ndarray:
                    unknowns[:count] = loads  # noqa: B023
                    return (expose(model, unknowns)[0] - level)[used]  # noqa: B023

                def turned(loads: np.ndarray) -> np.ndarray:
                    unknowns[:count] = loads  # noqa: B023
                    return slopes(model, unknowns, count)[used]  # noqa: B023

                start = own[:count]
                off = least_squares(left, start, turned, method="lm", xtol=1e-6).x - start
                total += float(off @ off)
            return total / len(self.levels) / self.noise

        return share
