"""Planned presses beside single and random ones: what calibration errors add to readings.

Every number is the error that the calibration adds to readings of typical loads, as a share of the
error that noise makes with a perfectly known sensor: predicted to first order, and simulated by
fitting exposed frames and reading typical loads without noise.
"""

from __future__ import annotations

import sys

import numpy as np

import fringeforce as ff
from fringeforce.calibration.bench import Bench
from fringeforce.calibration.calibrate import PARAMETERS
from fringeforce.calibration.candidates import candidates, typical_loads
from fringeforce.calibration.design_tangent import design_tangent
from fringeforce.calibration.frame_fit import climb
from fringeforce.calibration.knowledge import knowledge
from fringeforce.calibration.planning import TYPICAL
from fringeforce.force.bounds import covariance
from fringeforce.force.estimate import maximum_likelihood
from fringeforce.imaging import camera_response

REPEATS = 40
FORCE = 3.0


def singles(budget: int, n: int) -> np.ndarray:
    """Each tactel pressed alone, normally and tangentially, strong and then weak, spread evenly."""
    unit = np.eye(2 * n).reshape(2 * n, 2, n) * np.array([[FORCE], [FORCE / 2]])
    both = np.concatenate([unit, 0.6 * unit])
    return both[np.linspace(0, len(both) - 1, budget).round().astype(int)]


def simulated(model: ff.SensorModel, loads: np.ndarray, rng: np.random.Generator):
    """Added share of error and its standard error."""
    sensor, known = model.sensor, knowledge(model)
    typical = typical_loads(model, ff.Limits(FORCE), TYPICAL).reshape(TYPICAL, -1)
    truth = model.pixel_influence.reshape(sensor.camera.pixels, -1)
    response = camera_response(sensor.camera)
    tangent = design_tangent(sensor, PARAMETERS, np.zeros(len(PARAMETERS)))
    noise = np.mean([np.trace(covariance(truth @ f, truth, response)) for f in typical])
    added = []
    for _ in range(REPEATS):
        frames = model.expose(loads, rng=rng).astype(float)
        flat = loads.reshape(len(loads), -1)
        bench = Bench(sensor, frames, flat, known.bench.basis)
        at = climb(bench, known.unknowns, tangent, known.used).unknowns
        matrix = tangent.matrix(at.design, at.positions(sensor))[known.used]
        seen = at.response(bench).at(known.used)
        levels = [response.level(truth @ f)[known.used] for f in typical]
        off = [
            maximum_likelihood(level, matrix, seen, f, tolerance=1e-8).loads - f
            for level, f in zip(levels, typical, strict=True)
        ]
        added.append(np.square(off).sum(axis=1).mean() / noise)
    share = np.sqrt(np.mean(added))
    return share, np.std(added) / np.sqrt(REPEATS) / (2 * share)


def main() -> None:
    """Print the table."""
    sensor = ff.load_sensor(sys.argv[1] if len(sys.argv) > 1 else "saad")
    model, rng = ff.characterize(sensor), np.random.default_rng(0)
    limits, n = ff.Limits(FORCE), sensor.tactels.count
    pool = candidates(model, limits)
    print("presses  kind      predicted  simulated        readings err")
    for budget in (10, 20, 40):
        kinds = {
            "planned": ff.plan_presses(sensor, budget, limits=limits).loads,
            "singles": singles(budget, n),
            "random": pool[rng.integers(0, len(pool), budget)],
            "contacts": typical_loads(model, limits, budget),
        }
        for kind, loads in kinds.items():
            ratio = ff.assess_presses(sensor, loads, limits=limits).ratio[-1]
            share, error = simulated(model, loads, rng)
            print(
                f"{budget:>7}  {kind:<8}  {np.sqrt(ratio**2 - 1):>9.3f}  {share:>9.3f} +- "
                f"{error:.3f}  x {np.sqrt(1 + share**2):.4f}"
            )


if __name__ == "__main__":
    main()
