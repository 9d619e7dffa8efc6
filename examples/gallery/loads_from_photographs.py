"""
Loads from photographs of a beam
================================

A student laboratory made photographs of a beam in four-point bending public, each with the load
that its testing machine showed.  They are as photographs are: overexposed, of unknown light, tone
curve, place and residual stress, scratched and written on.  The folder ``examples/photographs``
holds profiles that were measured on them; the pictures are at github.com/fmarrar/ae461.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import fringeforce as ff
from fringeforce.plotting import axes as plot

plt.style.use(plot.STYLE)
folder = Path(sys.argv[0]).resolve().parents[1] / "photographs"
load, row, grey = np.loadtxt(folder / "profiles.csv", delimiter=",", skiprows=1).T
profiles = {int(one): grey[load == one] for one in np.unique(load)}

# %%
# The beam and its formula
# ------------------------
# Between the upper pins the moment is F a / 2, where a is the distance of an upper from a lower
# pin.  Light that passes through the beam once shows sigma t / f fringes, 6 F a y / (H^3 f), of any
# thickness.  The fringe value f is that of polycarbonate, 546 nm over 72 TPa^-1, until the
# photographs say better.

HEIGHT, ARM, FRINGE_VALUE = 25.4e-3, 25.9e-3, 7.6e3  # m, m, N/m
EDGE = 0.04  # of the height, at either edge: bevels and their glare


def beam(rows: int, used: int) -> ff.SensorModel:
    """What a camera of `rows` rows over the height shows of the middle `used` of them."""
    length = HEIGHT * used / rows
    y = np.linspace(-length / 2, length / 2, 101)
    fringes = 6 * ARM * y / (HEIGHT**3 * FRINGE_VALUE)
    camera = {"pixels": used, "bits": 8, "noise": 6.0, "noise_model": "gaussian", "clipped": True}
    camera |= {"amplitude": "360 +/- 100", "offset": "12 +/- 6", "gamma": "0.45 +/- 0.08"}
    camera |= {"shift": "0 +/- 0.1 mm"}  # a row is 0.08 mm high
    light = {"wavelength": "546.1 nm", "residual": "0 +/- 0.6 rad", "residual_length": "12.7 mm"}
    return ff.model_from_influence(y, 2 * np.pi * fringes[:, None], camera, light)


# %%
# Of the light it is known that the camera's tone curve is near sRGB's, that bright fringes are cut
# off, and that levels above 235 lie on the shoulder of the curve; those are cut off too.  Of the
# residual it is known that it varies smoothly over half of the height; a tenth of a fringe is the
# size at which its four modes come out at one standard deviation, so that the photographs say it.

SHOULDER = 235.0
readings, fitted = {}, {}
for one, levels in profiles.items():
    trim = round(EDGE * len(levels))
    frame = np.rint(np.minimum(levels[trim:-trim], SHOULDER) * 255 / SHOULDER)
    model = beam(len(levels), len(frame))
    readings[one] = ff.Reader(model).read(frame)
    fitted[one] = frame, readings[one].phase

# %%
# Leave one out
# -------------
# The fringe value comes from three photographs with their loads, the load of the fourth from its
# fringes.

read = np.array([one.forces[0, 0] for one in readings.values()])
std = np.array([one.std[0, 0] for one in readings.values()])
written = np.array(list(profiles), dtype=float)
print("written   read     deviation  error")
found, deviations = [], []
for own in range(len(written)):
    others = np.arange(len(written)) != own
    ratio, spread = read[others] / written[others], std[others] / written[others]
    weight = 1 / spread**2
    scale, error = (ratio @ weight) / weight.sum(), 1 / np.sqrt(weight.sum())
    found.append(read[own] / scale)
    deviations.append(np.hypot(std[own], read[own] * error / scale) / scale)
    off = 100 * (found[-1] / written[own] - 1)
    print(f"{written[own]:5.0f} N  {found[-1]:6.1f} N  {deviations[-1]:5.1f} N   {off:+5.1f} %")

errors = np.array(found) / written - 1
inside = np.abs(np.array(found) - written) < 1.96 * np.array(deviations)
print(f"inside their 95 % intervals: {inside.sum()} of {len(inside)}")
print(f"median error {100 * np.median(np.abs(errors)):.1f} %")
assert inside.all()
assert np.median(np.abs(errors)) < 0.03

# %%
# The photograph of the smallest load shows one dark line; its load is as uncertain as that leaves
# it.  The reader calls only this one OK: in the others smooth deviations of up to ten levels, of
# scratches and of a tone curve that is no power, are more than noise.  It says what to do about the
# bright fringes:

for reading in readings.values():
    print(reading.status.name, "-", reading.advice)

# %%
# Lines are dark where the formula alone says so; the residual moves them to where they are.

fig, panels = plt.subplots(2, 2, figsize=(10, 6), sharey=True, layout="tight")
for ax, (one, (frame, phase)) in zip(panels.ravel(), fitted.items(), strict=True):
    height = np.linspace(-0.5, 0.5, len(frame)) * (1 - 2 * EDGE) * 1e3 * HEIGHT
    ax.plot(height, frame, color="0.6", label="photograph")
    for order in range(-3, 4):
        place = np.interp(2 * np.pi * order, phase, height, left=np.nan, right=np.nan)
        ax.axvline(place, color="C0", linewidth=0.8, label=None if order else "formula")
    ax.set_title(f"{one} N written, {found[list(profiles).index(one)]:.1f} N read")
    ax.set_xlabel("mm below the middle")
panels[0, 0].set_ylabel("grey level")
panels[0, 0].legend()
