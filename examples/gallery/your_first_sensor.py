"""
Your first own sensor
=====================

A design is a text file: sizes and materials with their units.  This one is a fingertip with eight
tactels, a thicker cover than the paper's and a camera with fewer pixels.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

import fringeforce as ff
from fringeforce.plotting import axes as plot

plt.style.use(plot.STYLE)

DESIGN = """
name = "fingertip"
[transducer]
length = "16 mm"
width = "3 mm"
edges = "free"
plane = "stress"
[transducer.compliant]
thickness = "0.6 mm"
youngs_modulus = "8 MPa"
poissons_ratio = 0.49
[transducer.photoelastic]
thickness = "2.5 mm"
youngs_modulus = "60 MPa"
poissons_ratio = 0.42
strain_optic_coefficient = 0.05
[tactels]
count = 8
pitch = "1.5 mm"
[polariscope]
wavelength = "632.8 nm"
[camera]
pixels = 1024
bits = 8
amplitude = 230
offset = 8
noise = 2
noise_model = "gaussian"
"""

with TemporaryDirectory() as folder:
    path = Path(folder, "fingertip.toml")
    path.write_text(DESIGN, encoding="utf-8")
    sensor = ff.load_sensor(path)

# %%
# What one newton does
# --------------------
# Finite elements give one number for every place, tactel and direction: the influence matrix.  A
# push darkens and brightens the light around its tactel; a drag does so on both sides with opposite
# signs.

model = ff.characterize(sensor)
x = np.linspace(-8e-3, 8e-3, 801)
psi = model.influence(x)
shades = plt.get_cmap("viridis")(np.linspace(0, 0.9, sensor.tactels.count))
fig, axes = plt.subplots(2, 1, figsize=(8, 5), sharex=True)
for ax, part, name in zip(axes, (0, 1), ("push", "drag"), strict=True):
    for tactel, shade in enumerate(shades):
        ax.plot(1e3 * x, psi[:, tactel, part], color=shade)
    ax.set_ylabel(f"{name} [rad/N]")
axes[-1].set_xlabel("x [mm]")
axes[0].set_title("Phase lead per newton, tactel by tactel from left (dark) to right (light)")

# %%
# The strip is its own mirror image, and so is the matrix: a push at one end looks like one at the
# other end, seen in a mirror.

pushes = psi[..., 0]
asymmetry = np.abs(pushes - pushes[::-1, ::-1]).max() / np.abs(pushes).max()
print(f"asymmetry of the pushes: {asymmetry:.1e} of their peak")
assert asymmetry < 1e-6

# %%
# A mistake in the file is told with its place and its remedy.

try:
    sensor.replace(**{"tactels.pitch": "3 mm"})
except ff.FringeforceError as error:
    print(error)
else:
    raise AssertionError("eight tactels at 3 mm cannot fit on 16 mm")

# %%
# A finger on the skin
# --------------------
# A fingertip presses harder in its middle.  One frame tells how hard, tactel by tactel.

place = sensor.tactels.positions
normal = 1.2 * np.exp(-((place - 1e-3) ** 2) / (2 * 2.5e-3**2))
forces = np.stack([normal, 0.15 * normal], axis=1)
reading = ff.Reader(model).read(model.expose(forces, rng=3))
assert reading.status is ff.Status.OK
assert (np.abs(reading.forces - forces) < 4.5 * reading.std).all()
print(f"a push is known to {1e3 * reading.std[:, 0].mean():.0f} mN from one frame")

fig, ax = plt.subplots(figsize=(8, 3.6))
plot.forces(ax, reading.forces, reading.std)
ax.plot(np.arange(1, 9), forces[:, 0], ":", color="C0")
ax.plot(np.arange(1, 9), forces[:, 1], ":", color="C1")
ax.set_title("Read (dots, two deviations) and applied (dotted)")
plt.show()
