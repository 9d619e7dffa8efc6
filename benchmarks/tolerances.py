"""Speed of a strip with every tolerance at once, beside the same strip without any.

    python benchmarks/tolerances.py [cold frames] [followed frames]

22 loads and 37 other unknowns at 2,048 pixels.  Frames come from a sensor made from the
tolerances, with contacts by the surface's elements and not by the reader's moments.  Times of a
busy machine are all too long by the same factor: the ratios to the ideal strip of the same run are
not.
"""

from __future__ import annotations

import sys
import time

import numpy as np

import fringeforce as ff

COLD, FOLLOWED, SEED = 40, 2000, 1
TOLERANCES = {
    "tactels.placement": "0 +/- 0.1 mm",
    "tactels.contact_width": "0.4 +/- 0.2 mm",
    "polariscope.visibility": "0.97 +/- 0.02",
    "polariscope.residual": "0 +/- 0.05 rad",
    "polariscope.residual_length": "3 mm",
    "camera.amplitude": "237 +/- 3 %",
    "camera.blur": "49 um +/- 24 um",
}
NEWTONS_A_FRAME = 2e-4
"""Two newtons a second at 10,000 frames per second."""


def forces(rng: np.random.Generator, count: int) -> np.ndarray:
    normal = rng.uniform(0.3, 2.0, count)
    return np.stack([normal, 0.5 * normal * rng.uniform(-1, 1, count)], axis=1)


def measured(model: ff.SensorModel, cold: int, followed: int) -> tuple[float, float, str]:
    """Median time of a cold frame and mean of a followed one [s], and how good these are."""
    rng, reader, times = np.random.default_rng(SEED), ff.Reader(model), []
    count = model.sensor.tactels.count
    reader.prepare()
    built = model.as_built(rng)
    for _ in range(cold):
        frame = built.expose(forces(rng, count), rng)
        begin = time.perf_counter()
        reader.search(frame)
        times.append(time.perf_counter() - begin)
    sway = NEWTONS_A_FRAME * np.arange(followed)[:, None, None] * rng.choice([-1, 1], (count, 2))
    loads = forces(rng, count) + 0.2 * np.sin(sway / 0.2)
    frames = built.expose(loads, rng, built.contacts((), rng))
    reader.reset()
    reader.read_on(frames[:200])
    begin = time.perf_counter()
    batch = reader.read_on(frames[200:])
    each = (time.perf_counter() - begin) / (followed - 200)
    inside = np.mean(np.abs(batch.forces - loads[200:]) < 1.96 * batch.std)
    notes = f"{batch.tracked.mean():.1%} followed, {inside:.1%} of forces inside 95 %"
    return float(np.median(times)), each, notes


def main(cold: int, followed: int) -> None:
    """Print a table."""
    ideal = measured(ff.characterize(ff.load_sensor("saad")), cold, followed)
    drawing = ff.load_sensor("saad").replace(**TOLERANCES)
    real = measured(ff.characterize(drawing), cold, followed)
    for name, (search, each, notes) in (("ideal", ideal), ("all tolerances", real)):
        print(
            f"{name:15} cold {search * 1e3:6.1f} ms ({search / ideal[0]:5.1f} times), "
            f"followed {1 / each:8,.0f} frames/s (1 / {each / ideal[1]:.1f}); {notes}"
        )


if __name__ == "__main__":
    main(*(int(text) for text in (sys.argv[1:] or [COLD, FOLLOWED])))
