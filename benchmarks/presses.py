"""Planned presses beside single and random ones: what calibration errors add to readings.

Every number is the error that the calibration adds to readings of typical loads, as a share of the
error that noise makes with a perfectly known sensor: predicted to first order, and simulated by
fitting exposed frames and reading typical loads without noise.  Random presses are averaged over
several draws.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

import fringeforce as ff
from fringeforce.calibration.frame_fit import levenberg_marquardt
from fringeforce.calibration.measurements import Measurements
from fringeforce.calibration.planning.candidates import candidates, typical_loads
from fringeforce.calibration.planning.knowledge import Knowledge, knowledge
from fringeforce.estimation.bounds import covariance
from fringeforce.estimation.likelihood import Response
from fringeforce.models.imaging import camera_response

BUDGETS = 10, 20, 40
REPEATS, DRAWS, TYPICAL = 24, 4, 12
FORCE = 3.0
CAPTION = f"""
even: each tactel alone, {FORCE:g} N normally and {FORCE / 2:g} N tangentially, then the weaker
strong: the same with {FORCE:g} N in both directions; in what readings err, a near-tie with the plan
random: any of the plan's candidates, mean of {DRAWS} draws
contacts: many tactels at a time, beyond the limits of this plan, which presses one"""


def singles(budget: int, n: int, tangential: float) -> np.ndarray:
    """Each tactel pressed alone, normally and tangentially, strong and then weak, spread evenly."""
    unit = np.eye(2 * n).reshape(2 * n, n, 2) * [FORCE, tangential]
    both = np.concatenate([unit, 0.6 * unit])
    return both[np.linspace(0, len(both) - 1, budget).round().astype(int)]


def simulated(
    known: Knowledge, typical: np.ndarray, draws: Sequence[np.ndarray], rng: np.random.Generator
) -> tuple[float, float]:
    """Added share of error, the draws in turn, and its standard error."""
    model, sensor = known.jacobian.model, known.sensor
    flat = typical.reshape(len(typical), -1)
    truth = model.pixel_influence.reshape(sensor.camera.pixels, -1)
    response = camera_response(sensor.camera)
    noise = np.mean([np.trace(covariance(truth @ f, truth, response)) for f in flat])
    levels = [response.level(truth @ f)[known.used] for f in flat]
    added = []
    for number in range(REPEATS):
        loads = draws[number % len(draws)]
        frames = model.expose(loads, rng=rng).astype(float)
        bench = Measurements(sensor, frames, loads.reshape(len(loads), -1), known.measured.basis)
        at = levenberg_marquardt(bench, known.unknowns, known.jacobian, known.used).unknowns
        matrix = known.jacobian.matrix(at.design, at.positions(sensor))[known.used]
        seen = at.response(bench).at(known.used)
        off = [
            least_squares(_left, f, args=(level, matrix, seen), xtol=1e-12).x - f
            for level, f in zip(levels, flat, strict=True)
        ]
        added.append(np.square(off).sum(axis=1).mean() / noise)
    share = np.sqrt(np.mean(added))
    return share, np.std(added) / np.sqrt(REPEATS) / (2 * share)


def _left(loads: np.ndarray, level: np.ndarray, matrix: np.ndarray, seen: Response) -> np.ndarray:
    """What loads leave of grey levels."""
    return seen.level(matrix @ loads) - level


def main() -> None:
    """Print the table."""
    sensor = ff.load_sensor(sys.argv[1] if len(sys.argv) > 1 else "saad")
    known, rng = knowledge(sensor), np.random.default_rng(0)
    limits, n, model = ff.Limits(FORCE), sensor.tactels.count, known.jacobian.model
    pool, typical = candidates(model, limits), typical_loads(model, limits, TYPICAL)
    print("presses  kind      predicted  simulated        readings err")
    for budget in BUDGETS:
        kinds = {
            "planned": [ff.plan_presses(sensor, budget, limits=limits, typical=typical).loads],
            "even": [singles(budget, n, FORCE / 2)],
            "strong": [singles(budget, n, FORCE)],
            "random": [pool[rng.integers(0, len(pool), budget)] for _ in range(DRAWS)],
            "contacts": [typical_loads(model, limits, budget)],
        }
        for kind, draws in kinds.items():
            plans = [ff.assess_presses(sensor, loads, typical=typical) for loads in draws]
            predicted = np.sqrt(np.mean([plan.ratio[-1] ** 2 - 1 for plan in plans]))
            share, error = simulated(known, typical, draws, rng)
            print(
                f"{budget:>7}  {kind:<8}  {predicted:>9.3f}  {share:>9.3f} +- "
                f"{error:.3f}  x {np.sqrt(1 + share**2):.4f}",
                flush=True,
            )
    print(CAPTION)


if __name__ == "__main__":
    main()
