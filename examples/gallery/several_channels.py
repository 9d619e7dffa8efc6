"""
Several channels: sensitive at every phase
==========================================

Where a dark field is darkest or brightest, its intensity does not change with the phase.  A second
picture, a quarter wave further, is most sensitive just there.
"""

import matplotlib.pyplot as plt
import numpy as np

import fringeforce as ff
from fringeforce.plotting import axes as plot

plt.style.use(plot.STYLE)
drawing = ff.load_sensor("saad")
quadrature = drawing.replace(**{"polariscope.channels": [{"bias": 0}, {"bias": 90}]})
one, two = ff.characterize(drawing), ff.characterize(quadrature)
forces = ff.polar(1.0, angle=10, n=11)
x = one.pixel_positions

# %%
# Two pictures of the same strip
# ------------------------------

dark, quarter = two.intensity(forces)
fig, (upper, lower) = plt.subplots(2, 1, figsize=(8, 5), sharex=True)
plot.curves(upper, x, {"dark field": dark, "a quarter wave further": quarter}, "intensity")

phase = two.phase(forces)
slopes = np.array([np.sin(phase), np.sin(phase + np.pi / 2)]) / 2
sight = np.hypot(*slopes)
plot.curves(
    lower,
    x,
    {"dark field": np.abs(slopes[0]), "both together": sight},
    "change of intensity\nwith phase [1/rad]",
)
print(f"both together change by {sight.min():.3f} to {sight.max():.3f} per radian everywhere")
assert np.ptp(sight) < 1e-12
assert np.abs(slopes[0]).min() < 1e-2

# %%
# The intensities are those of light: each is the dark field's, shifted by its bias.

assert np.allclose(quarter, np.sin((phase + np.pi / 2) / 2) ** 2)

# %%
# What that is worth
# ------------------
# Deviations of forces read from one frame, from the lightest touch to five newtons.  The cover then
# strains by more than the 10 % up to which small strain is near enough, so that it is asked for by
# name: the question is what the light tells.

loads = np.geomspace(0.05, 5, 13)
spread = {
    name: [
        reader.search(reader.model.expose(f * forces, rng=1, strain="linear")).std.mean()
        for f in loads
    ]
    for name, reader in (("dark field", ff.Reader(one)), ("two in quadrature", ff.Reader(two)))
}
fig, ax = plt.subplots(figsize=(8, 3.6))
for label, values in spread.items():
    ax.loglog(loads, 1e3 * np.array(values), "o-", label=label)
ax.set(xlabel="force on every tactel [N]", ylabel="mean deviation [mN]")
ax.legend()
gain = np.divide(*spread.values())
print(f"deviations smaller by a factor of {gain.min():.1f} to {gain.max():.1f}")
assert (gain > 1).all()
even = np.array(spread["two in quadrature"])
# that a touch is faint makes its deviations a little smaller
assert even.max() / even.min() < 1.05

# %%
# A sign for pure shear
# ---------------------
# A load and its negative look the same in a dark field.  Contact pushes, which settles the sign
# unless nothing pushes: pure shear is ambiguous, and both explanations are stated.  With a bias it
# is not.

shear = np.zeros((11, 2))
shear[4, 1] = -0.5
blind, seeing = (ff.Reader(model).read(model.expose(shear, rng=3)) for model in (one, two))
print(f"dark field: {blind.status.name}; quadrature: {seeing.status.name}")
assert blind.status is ff.Status.AMBIGUOUS
assert seeing.status is ff.Status.OK
assert abs(seeing.forces[4, 1] + 0.5) < 4.5 * seeing.std[4, 1]
plt.show()
