"""
Calibration on a bench
======================

No sensor equals its drawing.  The folder ``examples/bench`` holds frames of a simulated one: its
cover is softer and thicker than drawn, its camera looks elsewhere, its lamp is uneven, pixels are
dead, and one press was written down on the wrong tactel.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import fringeforce as ff
from fringeforce.calibration.verification import verify
from fringeforce.io.frames import load_frames
from fringeforce.io.tables import load_forces
from fringeforce.plotting import axes as plot

plt.style.use(plot.STYLE)
bench = Path(sys.argv[0]).resolve().parents[1] / "bench"
sensor = ff.load_sensor("saad")
frames = load_frames(bench / "calibration.h5")
loads = load_forces(bench / "calibration.csv", sensor.tactels.count)
print(f"{len(frames)} frames with known loads")

# %%
# The drawing alone cannot read them
# ----------------------------------
# With a wrong model no load explains a frame, and the reader says so.

drawing = ff.characterize(sensor)
reader = ff.Reader(drawing)
statuses = [reader.search(frame).status for frame in frames[-5:]]
print(*(status.name for status in statuses))
assert ff.Status.OK not in statuses

# %%
# One call
# --------
# Design values, the camera's place and the light are fitted together to the raw grey levels.

model = ff.calibrate(sensor, frames, loads)
found = model.calibration
assert found is not None
for sentence in found.findings:
    print("-", sentence)

# %%
# The frame that contradicts the others is found, and so are all ten dead pixels.

assert len(found.outliers) == 1
assert len(found.dead) == 10

fig, (before, after) = plt.subplots(1, 2, figsize=(10, 4.2), sharey=True)
plot.residuals(before, drawing.residuals(frames, loads), (), ())
plot.residuals(after, model.residuals(frames, loads), found.outliers, found.dead)
before.set_title("The drawing", pad=16)
after.set_title("Calibrated", pad=16)

# %%
# The proof
# ---------
# Frames that the calibration has not seen tell whether the model is right, and whether its
# deviations are.

unseen = load_frames(bench / "check.h5")
known = load_forces(bench / "check.csv", sensor.tactels.count)
proof = verify(model, unseen, known)
print(f"error {1e3 * proof.error:.1f} mN, stated {1e3 * proof.stated:.1f} mN")
print(f"{100 * proof.coverage:.1f} % of forces lie within their 95 % intervals")
assert proof.passed
assert 0.90 < proof.coverage < 0.99
assert abs(np.log(proof.error / proof.stated)) < np.log(1.25)

reader = ff.Reader(model)
read = np.array([reader.search(frame).forces for frame in unseen])
fig, ax = plt.subplots(figsize=(5, 4.6))
for part, name in enumerate(("normal", "tangential")):
    ax.plot(known[..., part].ravel(), read[..., part].ravel(), "o", markersize=4, label=name)
ax.axline((0, 0), slope=1, color="#555555", linewidth=0.8)
ax.set(xlabel="load cell [N]", ylabel="read from the fringes [N]", aspect="equal")
ax.legend()
plt.show()
