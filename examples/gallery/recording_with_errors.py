"""
A recording with errors
=======================

Real frames are not always good.  Pixels die, lamps are too bright, cables come loose, and now and
then something covers the strip.  A reader never raises an error for a bad frame: it says what is
the matter, and goes on.
"""

import matplotlib.pyplot as plt
import numpy as np

import fringeforce as ff
from fringeforce import plot

plt.style.use(plot.STYLE)
model = ff.characterize(ff.load_sensor("saad"))
rng = np.random.default_rng(5)
forces = ff.polar(0.8, angle=10, n=11)
good = model.expose(forces, rng)

# %%
# Seven frames of the same load
# -----------------------------

dead = good.copy()
dead[rng.choice(good.size, 12, replace=False)] = 0
bright = np.minimum(1.6 * good.astype(float), 255).astype(np.uint8)
covered = good.copy()
covered[700:1300] = 90
shifted = np.roll(good, 60)
unloaded = model.expose(np.zeros((2, 11)), rng)
frames = {
    "good": good,
    "12 dead pixels": dead,
    "too bright": bright,
    "partly covered": covered,
    "camera moved": shifted,
    "nothing touches": unloaded,
    "cable loose": np.zeros_like(good),
}

fig, ax = plt.subplots(figsize=(8, 4))
extent = (-12.5, 12.5, len(frames) - 0.5, -0.5)
ax.imshow(list(frames.values()), aspect="auto", cmap="gray", extent=extent, interpolation="nearest")
ax.set(xlabel="x [mm]", yticks=range(len(frames)), yticklabels=frames)
ax.grid(visible=False)
ax.set_title("What the camera delivers")

# %%
# What the reader says
# --------------------

readings = {name: model.read(frame) for name, frame in frames.items()}
for name, reading in readings.items():
    print(f"{name:16} {reading.status.name:15} {reading.advice}")

# %%
# Dead pixels cost next to nothing: they stand out from their neighbours as no fringe does, and are
# left out.  The other faults are named.

close = readings["12 dead pixels"]
assert close.status is ff.Status.OK
assert (np.abs(close.forces - forces) < 4.5 * close.std).all()
assert close.std.max() < 1.1 * readings["good"].std.max()
assert readings["too bright"].status is ff.Status.SATURATED
assert readings["nothing touches"].status is ff.Status.NO_CONTACT
assert readings["cable loose"].status is ff.Status.BAD_FRAME
for name in ("partly covered", "camera moved"):
    assert readings[name].status is ff.Status.MODEL_MISMATCH

# %%
# A fault that is known can be left out
# -------------------------------------
# Where the covered part is known, a mask leaves it out.  Forces below it are then known less well,
# and their deviations say so.

mask = np.zeros(good.size, dtype=bool)
mask[700:1300] = True
masked = model.read(covered, mask)
assert masked.status is ff.Status.OK
assert (np.abs(masked.forces - forces) < 4.5 * masked.std).all()
assert (masked.std > readings["good"].std).mean() > 0.9

fig, ax = plt.subplots(figsize=(8, 3.6))
for label, one, shift in (("whole frame", readings["good"], -0.1), ("masked", masked, 0.1)):
    tactel = np.arange(1, 12) + shift
    ax.errorbar(tactel, one.forces[0], 2 * one.std[0], fmt="o", capsize=3, label=label)
ax.axhline(forces[0, 0], color="#555555", linestyle=":", label="applied")
left, right = np.interp(
    model.pixel_positions[[700, 1300]], model.sensor.tactels.positions, np.arange(1, 12)
)
ax.axvspan(left, right, color="#eeeeee", zorder=0)
ax.set(xlabel="tactel", ylabel="normal force [N]", xticks=range(1, 12))
ax.legend(ncols=3)
ax.set_title("The shaded part of the strip was covered")
plt.show()
