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
from fringeforce.plotting import axes as plot

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
covered[600:800] = 90
shifted = np.roll(good, 60)
unloaded = model.expose(np.zeros((11, 2)), rng)
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

reader = ff.Reader(model)
readings = {name: reader.search(frame) for name, frame in frames.items()}
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
# A hair lies on the strip.  It hides 50 pixels, and the frame as a whole cannot be explained.  A
# mask leaves them out, and the deviations grow by what is lost.

hair = np.zeros(good.size, dtype=bool)
hair[1000:1050] = True
hairy = np.where(hair, 20, good)
unmasked, masked = reader.search(hairy), reader.search(hairy, hair)
print(f"unmasked {unmasked.status.name}, masked {masked.status.name}")
assert unmasked.status is not ff.Status.OK
assert masked.status is ff.Status.OK
assert (np.abs(masked.forces - forces) < 4.5 * masked.std).all()
assert masked.std.mean() > readings["good"].std.mean()

# %%
# A mask should be narrow against the fringes.  Over a wide gap the search may lose count of them,
# and then it says that nothing fits rather than something wrong.

for width in (50, 150, 600):
    gap = np.abs(np.arange(good.size) - 1000) < width / 2
    reading = reader.search(good, gap)
    print(f"{width} pixels left out: {reading.status.name}")
    within = (np.abs(reading.forces - forces) < 4.5 * reading.std).all()
    assert reading.status is not ff.Status.OK or within

fig, (line, bars) = plt.subplots(2, 1, figsize=(8, 5.6))
line.plot(1e3 * model.pixel_positions, hairy, ".", markersize=2, color="#888888")
line.axvspan(*1e3 * model.pixel_positions[[1000, 1049]], color="C4", alpha=0.5, linewidth=0)
line.set(xlabel="x [mm]", ylabel="grey level", xlim=(-12.5, 12.5))
line.set_title("A hair hides a part of the strip; forces with the hair masked, truth dotted")
plot.forces(bars, masked.forces, masked.std)
for level, shade in zip(forces[0], ("C0", "C1"), strict=True):
    bars.axhline(level, color=shade, linestyle=":")
plt.show()
