"""
How much force can it read?
===========================

The paper asks this of its two edge conditions.  Its algorithm starts at an edge and needs to know
the phase there; free edges are always dark, held ones are not.  A reader that knows the influence
matrix does not depend on it: it ends where the camera no longer resolves the fringes, or the
material is no longer elastic.
"""

import matplotlib.pyplot as plt
import numpy as np

import fringeforce as ff
from fringeforce.plotting import axes as plot
from fringeforce.studies.limits import (
    SIGN_BY_CONTACT,
    border_influence,
    edge_limit,
    nyquist_limit,
    strain_limit,
)

plt.style.use(plot.STYLE)
drawing = ff.load_sensor("saad")
models = {
    edges: ff.characterize(drawing.replace(**{"transducer.edges": edges}))
    for edges in ("free", "roller")
}

# %%
# Free edges are dark, held ones are not
# --------------------------------------

forces = ff.polar(1.0, angle=10, n=11)
x = models["free"].pixel_positions
fig, ax = plt.subplots(figsize=(8, 3.4))
plot.curves(
    ax, x, {f"{edges} edges": one.phase(forces) for edges, one in models.items()}, "phase [rad]"
)
ax.set_title("1 N at 10 degrees on every tactel")
ends = {edges: np.abs(one.phase(forces)[[0, -1]]).max() for edges, one in models.items()}
print({edges: f"{end:.3f} rad at the ends" for edges, end in ends.items()})
assert ends["free"] < 0.02 < ends["roller"]

# %%
# Where each way of reading ends
# ------------------------------
# The largest normal force on a tactel, with the worst distribution of forces up to 20 degrees from
# the normal.  Each limit is a linear program over all such loads.

limits = {
    edges: {
        "the paper's start": edge_limit(border_influence(one)),
        "its sign by contact": edge_limit(border_influence(one), interval=SIGN_BY_CONTACT),
        "half a fringe per pixel": nyquist_limit(one),
        "10 % strain": strain_limit(one),
    }
    for edges, one in models.items()
}
for edges, found in limits.items():
    print(edges, {name: f"{force:.1f} N" for name, force in found.items()})

free, roller = limits.values()
assert free["the paper's start"] == np.inf
assert roller["the paper's start"] == 0
assert 0 < roller["its sign by contact"] < roller["10 % strain"] < roller["half a fringe per pixel"]

fig, ax = plt.subplots(figsize=(8, 3))
height = np.arange(len(free))
top = 1.6 * max(free["half a fringe per pixel"], roller["half a fringe per pixel"])
for shift, (edges, found) in zip((-0.18, 0.18), limits.items(), strict=True):
    size = np.minimum(list(found.values()), top)
    bars = ax.barh(height + shift, size, 0.34, label=f"{edges} edges")
    words = [f" {f:.3g} N" if np.isfinite(f) else "no limit " for f in found.values()]
    for bar, word in zip(bars, words, strict=True):
        inside = word.startswith("no")
        ax.text(bar.get_width(), bar.get_y() + 0.17, word, va="center",
                ha="right" if inside else "left", color="white" if inside else "black")  # fmt: skip
ax.set(yticks=height, yticklabels=free, xlabel="normal force on a tactel [N]", xlim=(0, top))
ax.grid(visible=False, axis="y")
ax.invert_yaxis()
ax.legend(loc="lower right")

# %%
# The reader does not ask for the edges
# -------------------------------------
# Two newtons on every tactel are beyond the paper's limit with held edges and near the end of
# elasticity.  Each frame is read without any earlier state, with either kind of edges.

for edges, one in models.items():
    strong = ff.polar(2.0, angle=10, n=11)
    assert limits["roller"]["its sign by contact"] < 2.0 < limits[edges]["10 % strain"]
    reader = ff.Reader(one)
    readings = [reader.search(frame) for frame in one.expose([strong] * 10, rng=2)]
    right = [
        r.status is ff.Status.OK and bool((np.abs(r.forces - strong) < 6 * r.std).all())
        for r in readings
    ]
    print(f"{edges} edges: {sum(right)} of {len(right)} frames at 2 N read right")
    assert all(right)
plt.show()
