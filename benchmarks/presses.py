"""Planned presses beside single and random ones: what calibration errors add to readings.

Every number is the error that the calibration adds to readings of typical loads, as a share of the
error that noise makes with a perfectly known sensor: predicted to first order, and simulated by
fitting frames of a bench that scatters and reading typical loads without noise.  Forces are off
by 1 % and a share of full scale, contacts by 0.1 mm, widths by 0.3 mm and the lamp by 2 %, which
is what plans expect where nobody states it.  Random presses are averaged over several draws.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import fringeforce as ff
from fringeforce.calibration.planning.candidates import candidates, typical_loads

sys.path.append(str(Path(__file__).parents[1] / "tests" / "calibration"))

from simulation import Simulation  # pyrefly: ignore[missing-import]

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


def main() -> None:
    """Print the table."""
    sensor = ff.load_sensor(sys.argv[1] if len(sys.argv) > 1 else "saad")
    model, rng = ff.characterize(sensor), np.random.default_rng(0)
    limits, n = ff.Limits(FORCE), sensor.tactels.count
    pool, typical = candidates(model, limits), typical_loads(model, limits, TYPICAL)
    simulation = Simulation(model, typical)
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
            added = np.concatenate(
                [
                    simulation.added(loads, REPEATS // len(draws), seed)
                    for seed, loads in enumerate(draws)
                ]
            )
            share = np.sqrt(np.mean(added))
            error = np.std(added) / np.sqrt(len(added)) / (2 * share)
            print(
                f"{budget:>7}  {kind:<8}  {predicted:>9.3f}  {share:>9.3f} +- "
                f"{error:.3f}  x {np.sqrt(1 + share**2):.4f}",
                flush=True,
            )
    print(CAPTION)


if __name__ == "__main__":
    main()
