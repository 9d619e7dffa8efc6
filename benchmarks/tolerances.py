"""Speed of a strip with every tolerance at once, beside the same strip without any.

    python benchmarks/tolerances.py [sensors] [followed frames]

22 loads and 37 other unknowns at 2,048 pixels.  Frames come from sensors made from the
tolerances, with contacts by the surface's elements and not by the reader's moments: one frame of
each is read cold, and frames of moving loads are followed on each, for errors of contacts that stay
where they are last.  Times of a
busy machine are all too long by the same factor: the ratios to the ideal strip of the same run are
not.
"""

from __future__ import annotations

import sys
import time

import numpy as np

import fringeforce as ff

SENSORS, FOLLOWED, SEED = 40, 40000, 1
TOLERANCES = {
    "tactels.placement": "0 +/- 0.1 mm",
    "tactels.contact_width": "0.4 +/- 0.2 mm",
    "polariscope.visibility": "0.97 +/- 0.02",
    "polariscope.residual": "0 +/- 0.05 rad",
    "polariscope.residual_length": "3 mm",
    "camera.amplitude": "237 +/- 3 %",
    "camera.blur": "49 um +/- 24 um",
}
BEGUN = 200
"""Frames with which following begins, which are not counted."""
NEWTONS_A_FRAME = 2e-4
"""Two newtons a second at 10,000 frames per second."""


def forces(rng: np.random.Generator, count: int) -> np.ndarray:
    normal = rng.uniform(0.3, 2.0, count)
    return np.stack([normal, 0.5 * normal * rng.uniform(-1, 1, count)], axis=1)


def measured(model: ff.SensorModel, sensors: int, followed: int) -> tuple[float, float, str]:
    """Median time of a cold frame and mean of a followed one [s], and how good these are."""
    rng, reader = np.random.default_rng(SEED), ff.Reader(model)
    count, each = model.sensor.tactels.count, followed // sensors
    reader.prepare()
    cold, moving, tracked = list[float](), list[float](), list[float]()
    within, within_cold = list[float](), list[float]()
    for _ in range(sensors):
        built = model.as_built(rng)
        sway = NEWTONS_A_FRAME * np.arange(BEGUN + each)[:, None, None]
        sway = sway * rng.choice([-1, 1], (count, 2))
        loads = forces(rng, count) + 0.2 * np.sin(sway / 0.2)
        frames = built.expose(loads, rng, built.contacts((), rng))
        reader.reset()
        begin = time.perf_counter()
        first = reader.search(frames[0])
        cold.append(time.perf_counter() - begin)
        within_cold.append(float(np.mean(np.abs(first.forces - loads[0]) < 1.96 * first.std)))
        reader.read_on(frames[:BEGUN])
        begin = time.perf_counter()
        batch = reader.read_on(frames[BEGUN:])
        moving.append((time.perf_counter() - begin) / each)
        tracked.append(float(batch.tracked.mean()))
        within.append(float(np.mean(np.abs(batch.forces - loads[BEGUN:]) < 1.96 * batch.std)))
    notes = f"{np.mean(tracked):.1%} followed, inside 95 %: "
    notes += f"{np.mean(within_cold):.1%} of forces cold, {np.mean(within):.1%} followed"
    return float(np.median(cold)), float(np.mean(moving)), notes


def main(sensors: int, followed: int) -> None:
    """Print a table."""
    ideal = measured(ff.characterize(ff.load_sensor("saad")), sensors, followed)
    drawing = ff.load_sensor("saad").replace(**TOLERANCES)
    real = measured(ff.characterize(drawing), sensors, followed)
    for name, (search, each, notes) in (("ideal", ideal), ("all tolerances", real)):
        print(
            f"{name:15} cold {search * 1e3:6.1f} ms ({search / ideal[0]:5.1f} times), "
            f"followed {1 / each:8,.0f} frames/s (1 / {each / ideal[1]:.1f}); {notes}"
        )


if __name__ == "__main__":
    main(*(int(text) for text in (sys.argv[1:] or [SENSORS, FOLLOWED])))
