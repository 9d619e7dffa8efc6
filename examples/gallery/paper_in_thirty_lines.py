"""
The paper in thirty lines
=========================

Saad, Bonen, Smith and Benhabib press all eleven tactels of a two-layer strip with 1 N at 10 degrees
from the surface normal.  This script does the same: from the drawing to the fringes, and back from
one noisy camera line to the forces.
"""

import matplotlib.pyplot as plt
import numpy as np

import fringeforce as ff
from fringeforce.plotting import axes as plot

plt.style.use(plot.STYLE)
model = ff.characterize(ff.load_sensor("saad"))
forces = ff.polar(1.0, angle=10, n=11)
phase, x = model.phase(forces), model.pixel_positions

# %%
# From force to fringe
# --------------------
# The force stresses the clear layer, the stress turns the light's polarisation, and a camera behind
# crossed polarisers sees bright and dark bands.

fig, (strip, lead, eye) = plt.subplots(3, 1, figsize=(8, 6), height_ratios=(2, 3, 1), sharex=False)
plot.strip(strip, model.sensor.transducer, model.sensor.tactels.positions, forces)
plot.curves(lead, x, {"phase": phase}, "phase [rad]")
light = model.sensor.polariscope.wavelength
plot.fringes(eye, x, model.intensity(forces), model.sensor.transducer.width, light)

# %%
# Without noise the intensity gives the phase back exactly, by equation (12) of the paper.

error = np.abs(ff.recover_phase(model.intensity(forces)) - phase).max()
print(f"largest phase lead {np.abs(phase).max():.2f} rad, recovered to {error:.0e} rad")
assert error < 1e-6

# %%
# From a noisy line to forces
# ---------------------------
# With noise that algorithm fails.  The reader compares the whole line with what the influence
# matrix can explain, and states a deviation with every force.

reading = ff.Reader(model).read(model.expose(forces, rng=0))
off = reading.forces - forces
print(reading.status.name, f"chi-square {reading.chi2:.2f}, rms error {np.std(off) * 1e3:.0f} mN")
assert reading.status is ff.Status.OK
assert (np.abs(off) < 4.5 * reading.std).all()

fig, ax = plt.subplots(figsize=(8, 3.6))
plot.forces(ax, reading.forces, reading.std)
for level, shade in zip(forces[0], ("C0", "C1"), strict=True):
    ax.axhline(level, color=shade, linestyle=":")
ax.set_title("One noisy line: forces read, two deviations, and the truth (dotted)")
plt.show()
