"""
One frame, step by step
=======================

A notebook to play with: change a number in the next cell, and run what follows again.  It walks the
whole chain of an instrument, force, stress, phase, intensity, grey level, and all the way back.
"""

import matplotlib.pyplot as plt
import numpy as np

import fringeforce as ff
from fringeforce.plotting import axes as plot

plt.style.use(plot.STYLE)
model = ff.characterize(ff.load_sensor("saad"))

# %%
# Play with these
# ---------------

push = 1.5  # N, on the tactel that is pressed hardest
angle = 12.0  # degrees from the surface normal, towards +x
centre = 2  # mm, of the finger
width = 2.0  # mm

# %%
# 1. Forces
# ---------
# A round finger presses with a bell-shaped pressure.

place = model.sensor.tactels.positions
size = push * np.exp(-((1e3 * place - centre) ** 2) / (2 * width**2))
forces = ff.polar(size, np.full(11, angle))
fig, ax = plt.subplots(figsize=(8, 2.4))
plot.strip(ax, model.sensor.transducer, place, forces)

# %%
# 2. Phase
# --------
# The response is linear: the phase is the influence matrix times the forces.  Twice the force is
# twice the phase.

x = model.pixel_positions
phase = model.phase(forces)
assert np.allclose(model.phase(2 * forces), 2 * phase)
parts = {
    "pushes": model.phase(forces * [1, 0]),
    "drags": model.phase(forces * [0, 1]),
    "together": phase,
}
assert np.allclose(parts["pushes"] + parts["drags"], phase)
fig, ax = plt.subplots(figsize=(8, 3.2))
plot.curves(ax, x, parts, "phase [rad]")

# %%
# 3. Intensity and grey levels
# ----------------------------
# Light is not linear: its intensity goes with the squared sine of half the phase, and the camera
# adds noise and rounds to whole grey levels.

intensity = model.intensity(forces)
assert np.allclose(intensity, np.sin(phase / 2) ** 2)
camera = model.sensor.camera
clean = camera.offset + camera.amplitude * intensity
frame = model.expose(forces, rng=6)
fig, ax = plt.subplots(figsize=(8, 3.2))
ax.plot(1e3 * x, frame, ".", markersize=2, color="#888888", label="frame")
plot.curves(ax, x, {"without noise": clean}, "grey level")
ax.legend(markerscale=4)
print(f"noise of {np.std(frame - clean):.2f} grey levels")
assert np.abs(frame - clean).max() <= camera.noise + 0.5

# %%
# 4. And back
# -----------
# From the frame alone.  Bars are two standard deviations; the truth is dotted.

reading = ff.Reader(model).read(frame)
fig, (upper, lower) = plt.subplots(2, 1, figsize=(8, 5.6))
plot.forces(upper, reading.forces, reading.std)
for force, shade in zip(forces.T, ("C0", "C1"), strict=True):
    upper.plot(np.arange(1, 12), force, ":", color=shade)
plot.curves(lower, x, {"phase read": reading.phase - phase}, "error of phase [rad]")
print(reading.status.name, reading.advice)
assert reading.status is ff.Status.OK
assert (np.abs(reading.forces - forces) < 4.5 * reading.std).all()

# %%
# 5. What is left
# ---------------
# Where the model explains the frame, only noise is left: without structure, of unit size.

left = model.residuals(frame, reading.forces)
neighbours = np.corrcoef(left[:-1], left[1:])[0, 1]
print(f"residuals of size {left.std():.2f}, neighbours correlate by {neighbours:+.3f}")
assert abs(left.std() - 1) < 0.1
assert abs(neighbours) < 4.5 / np.sqrt(left.size)
fig, ax = plt.subplots(figsize=(8, 2.4))
ax.plot(1e3 * x, left, ".", markersize=2)
ax.set(xlabel="x [mm]", ylabel="residual / noise", xlim=(-12.5, 12.5))
plt.show()
