"""
Which sensor should I build?
============================

Two values of a small sensor are free, the thickness of its cover and the stiffness of its clear
layer.  The strip must not become thicker than 3.5 mm, and its fringes not finer than four pixels.
Which choice makes the surest sensor?  A search with a budget of a few dozen designs gives a good
idea.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

import fringeforce as ff
from fringeforce.plotting import axes as plot
from fringeforce.studies.execution import Inline
from fringeforce.studies.optimise import optimise
from fringeforce.studies.study_file import load_study

plt.style.use(plot.STYLE)

STUDY = """
design = "small.toml"
working_load = 1.0
mesh_order = 3
[[parameters]]
path = "transducer.compliant.thickness"
lowest = "0.2 mm"
highest = "1 mm"
scale = "log"
[[parameters]]
path = "transducer.photoelastic.youngs_modulus"
lowest = "25 MPa"
highest = "200 MPa"
scale = "log"
[search]
objective = "worst_uncertainty"
budget = 64
[constraints]
thickness = "3.5 mm"
fringes_per_pixel = 0.25
"""

# %%
# The search
# ----------
# Every design is characterised with finite elements, and judged by the deviations that its frames
# allow over a set of loads.  Results are kept in a file as they come.

small = ff.load_sensor("saad").replace(**{"tactels.count": 5, "camera.pixels": 256})
with TemporaryDirectory() as name:
    folder = Path(name)
    (folder / "small.toml").write_text(small.to_toml(), encoding="utf-8")
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    best = optimise(*load_study(folder / "study.toml"), folder / "search.h5", Inline())

columns, feasible = best.sweep.columns, best.sweep.feasible
gain = best.before.worst_uncertainty / best.performance.worst_uncertainty
print(f"{feasible.sum()} of {len(feasible)} designs keep to the limits")
print(f"worst deviation {1e3 * best.before.worst_uncertainty:.1f} mN as drawn, "
      f"{1e3 * best.performance.worst_uncertainty:.1f} mN at best")  # fmt: skip
assert gain > 1.5
assert best.performance.thickness <= 3.5e-3 * (1 + 1e-9)
assert best.performance.worst_uncertainty == columns["worst_uncertainty"][feasible].min()

# %%
# What was tried
# --------------

cover = 1e3 * columns["transducer.compliant.thickness"]
layer = 1e-6 * columns["transducer.photoelastic.youngs_modulus"]
fig, ax = plt.subplots(figsize=(7, 4.4))
ax.plot(cover[~feasible], layer[~feasible], "x", color="#999999", label="beyond a limit")
dots = ax.scatter(cover[feasible], layer[feasible], c=1e3 * columns["worst_uncertainty"][feasible],
                  cmap="viridis_r", norm="log", zorder=3)  # fmt: skip
ax.plot(cover[0], layer[0], "s", color="C1", markersize=12, fillstyle="none", label="as drawn")
ax.plot(cover[best.best], layer[best.best], "o", color="C1", markersize=14, fillstyle="none",
        label="best")  # fmt: skip
ax.set(xlabel="thickness of the cover [mm]", ylabel="modulus of the clear layer [MPa]",
       xscale="log", yscale="log")  # fmt: skip
for axis, ticks in ((ax.xaxis, (0.2, 0.3, 0.5, 1)), (ax.yaxis, (25, 50, 100, 200))):
    axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_ticks([], minor=True)
ax.legend(ncols=3, loc="upper center", bbox_to_anchor=(0.5, 1.12))
bar = fig.colorbar(dots, label="worst deviation [mN]")
bar.ax.yaxis.set_major_formatter("{x:g}")
bar.ax.yaxis.set_minor_formatter("{x:g}")

# %%
# The promise is kept
# -------------------
# Noisy frames of both designs, read and compared with the truth.

rng = np.random.default_rng(4)
errors = {}
for label, sensor in (("as drawn", small), ("best", best.sensor)):
    model = ff.characterize(sensor)
    normal = rng.uniform(0.2, 1, (60, 5))
    loads = np.stack([normal, 0.2 * normal], axis=2)
    reader = ff.Reader(model)
    readings = [reader.search(frame) for frame in model.expose(loads, rng)]
    sure = np.array([reading.status is ff.Status.OK for reading in readings])
    off = np.array([reading.forces for reading in readings]) - loads
    pull = np.abs(off) / [reading.std for reading in readings]
    errors[label] = 1e3 * np.abs(off[sure]).ravel()
    print(f"{label}: {sure.sum()} of 60 sure, median error {np.median(errors[label]):.1f} mN")
    assert sure.mean() > 0.9
    assert (pull[sure] < 6).all()
assert np.median(errors["best"]) < np.median(errors["as drawn"]) / 1.3

fig, ax = plt.subplots(figsize=(7, 3.2))
for label, error in errors.items():
    ax.ecdf(error, label=label)
ax.set(xlabel="error of a force [mN]", ylabel="share of forces", xscale="log", xlim=(0.03, 300))
ax.legend()
plt.show()
