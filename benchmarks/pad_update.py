"""A pad that drifted since its calibration, brought up to date with presses by position.

    python benchmarks/pad_update.py [presses] [held-out frames] [seed] [tactels]

The pad, its light and its presses are those of `benchmarks/pad_calibration.py` with all departures
at once: frames by the exact double Fourier series at 16 depths on four points a pixel, discs of 1.2
to 2.4 mm under three pressures, places 0.1 mm beside what is written down, forces 1 % wrong, one
press written down wrongly.  It is calibrated on 64 presses.  Then the lamp is dimmed by 4 %, the
camera pushed by 0.1 and -0.06 mm, and a residual of 0.1 rad comes on top.

OK: held-out frames read OK.  inside: forces of OK readings in their 95 % intervals.  far: OK
readings with a force off by more than 6 of its deviations.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from time import process_time

import numpy as np
from pad_calibration import (
    ALL,
    FAR,
    INTERVAL,
    STATED,
    TACTELS,
    Truth,
    held_out,
    made,
    measured,
    off,
)
from pad_departures import drawing

import fringeforce as ff
from fringeforce.models.pad import PadModel

PRESSES, FRAMES, SEED = 12, 20, 1
DRIFT = {"camera.amplitude": 0.96, "camera.shift_x": 0.1e-3, "camera.shift_y": -0.06e-3}
"""Share of the light that is left, and how far the camera is pushed [m]."""
ROUGH = 0.1
"""Standard deviation of the residual that comes on top [rad]."""


def drifted(truth: Truth, rng: np.random.Generator) -> Truth:
    """The same pad some weeks on."""
    camera = truth.pad.camera
    values = {
        "camera.amplitude": DRIFT["camera.amplitude"] * camera.amplitude,
        "camera.shift_x": camera.shift_x + DRIFT["camera.shift_x"],
        "camera.shift_y": camera.shift_y + DRIFT["camera.shift_y"],
    }
    more = made(truth.pad, replace(ALL, design={}, residual=ROUGH), rng).residual
    return Truth(truth.pad.replace(**values), truth.residual + more, truth.shade)


def row(name: str, model: PadModel, frames: np.ndarray, forces: np.ndarray) -> str:
    """One line of the table."""
    reader = ff.Reader(model)
    readings = [reader.search(frame) for frame in frames]
    fine = np.array([reading.ok for reading in readings])
    std = np.array([reading.std for reading in readings])
    errors = np.abs(np.array([reading.forces for reading in readings]) - forces)[fine] / std[fine]
    inside = f"{np.mean(errors < INTERVAL):.1%}" if fine.any() else "-"
    far = int((errors > FAR).any(axis=(1, 2)).sum())
    return f"{name:<12} {np.mean(fine):>4.0%} {inside:>7} {far:>4}"


def main() -> None:
    """Print the table."""
    given = [int(one) for one in sys.argv[1:5]]
    count, frames, seed, side = given + [PRESSES, FRAMES, SEED, TACTELS][len(given) :]
    rng, pad = np.random.default_rng(seed), drawing(side).replace(**STATED)
    truth = made(pad, ALL, rng)
    levels, loads, *_ = measured(truth, ALL, rng)
    calibrated = ff.calibrate(pad, levels, loads)
    later = drifted(truth, rng)
    levels, loads, wrong, _ = measured(later, replace(ALL, wrong=1), rng, count)
    begun = process_time()
    fresh = ff.update(calibrated, levels, loads=loads)
    spent = process_time() - begun
    images, forces = held_out(later, ALL, rng, frames)
    print(f"{side} x {side} tactels, {count} presses by position, {frames} frames held out")
    print("model          OK  inside  far")
    print(row("calibrated", calibrated, images, forces), flush=True)
    print(row("up to date", fresh, images, forces))
    found = fresh.calibration
    assert found is not None
    size, worst = off(fresh, later)
    print(f"largest error of a value {size:.1f} deviations ({worst}); frames left out "
          f"{found.outliers}, wrong {tuple(wrong)}; {spent:.0f} s of the processor")  # fmt: skip
    print("\n".join(found.findings))


if __name__ == "__main__":
    main()
