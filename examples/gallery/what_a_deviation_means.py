"""
What a deviation means
======================

Every force comes with a standard deviation.  It is a promise: of many forces, 68 % lie within one
deviation of the truth and 95 % within two.  Monte Carlo puts it to the test.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import chi2, norm

import fringeforce as ff
from fringeforce.plotting import axes as plot

plt.style.use(plot.STYLE)
model = ff.characterize(ff.load_sensor("saad"))
rng = np.random.default_rng(12)

# %%
# Three hundred touches
# ---------------------
# Random forces at random angles, one noisy frame each, read without any earlier state.

normal = rng.uniform(0.2, 2, (300, 11))
forces = np.stack([normal, normal * np.tan(np.radians(rng.uniform(-20, 20, (300, 11))))], axis=2)
reader = ff.Reader(model)
readings = [reader.search(frame) for frame in model.expose(forces, rng)]
sure = [reading.status is ff.Status.OK for reading in readings]
off = np.array([reading.forces for reading in readings]) - forces
pull = off / np.array([reading.std for reading in readings])
print(f"{sum(sure)} of {len(sure)} frames are read without doubt")
assert np.mean(sure) > 0.98

# %%
# Errors in units of their deviation
# ----------------------------------
# They should follow the bell curve of unit width, for small and large forces alike.

levels = np.array([1.0, 2.0, 3.0])
promised = norm.cdf(levels) - norm.cdf(-levels)
kept = [np.mean(np.abs(pull) < level) for level in levels]
for level, share, wanted in zip(levels, kept, promised, strict=True):
    print(f"within {level:.0f} deviations: {100 * share:.1f} %, promised {100 * wanted:.1f} %")

# %%
# The 22 forces of a frame share its noise, so frames are what counts: with 300 the share within one
# deviation is itself uncertain by about a hundredth.

shares = np.abs(pull).reshape(300, -1) < 1
uncertain = shares.mean(axis=1).std() / np.sqrt(300)
print(f"share within one deviation: {shares.mean():.3f} +- {uncertain:.3f}")
assert abs(kept[0] - promised[0]) < 0.03
assert abs(kept[1] - promised[1]) < 0.02

fig, (left, right) = plt.subplots(1, 2, figsize=(10, 3.8))
grid = np.linspace(-4, 4, 201)
left.hist(pull.ravel(), 50, range=(-4, 4), density=True, color="C5", label="6,600 errors")
left.plot(grid, norm.pdf(grid), color="C1", label="promised")
left.set(xlabel="error / deviation", ylabel="density")
left.legend()

# %%
# All forces of a frame together
# ------------------------------
# Errors of neighbours hang together, and the covariance says how.  Weighted with it, the squared
# error of a frame's 22 forces follows the chi-square distribution of 22 degrees of freedom.

flat = off.reshape(300, -1)
spreads = np.array([reading.covariance for reading in readings])
weighted = np.einsum("ki,kij,kj->k", flat, np.linalg.inv(spreads), flat)
print(f"mean {weighted.mean():.1f}, promised 22 +- {np.sqrt(44 / 300):.1f}")
assert abs(np.median(weighted) - chi2.median(22)) < 1.5

right.ecdf(weighted, label="300 frames")
span = np.linspace(0, 55, 200)
right.plot(span, chi2.cdf(span, 22), color="C1", label="promised")
right.set(xlabel="weighted squared error of a frame", ylabel="share of frames", xlim=(0, 55))
right.legend()
plt.show()
