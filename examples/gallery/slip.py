"""
Feeling slip before it happens
==============================

A contact slides where the tangential force exceeds friction times the normal one.  A sensor that
reads both can learn the friction of a surface from one stroke, and announce slip before it comes.
"""

import matplotlib.pyplot as plt
import numpy as np

import fringeforce as ff
from fringeforce.contacts.contact import EventKind
from fringeforce.plotting import axes as plot

plt.style.use(plot.STYLE)
model = ff.characterize(ff.load_sensor("saad"))
rng = np.random.default_rng(8)
place = model.sensor.tactels.positions
normal = 1.5 * np.exp(-(place**2) / (2 * 2.5e-3**2))
FRICTION = 0.4

# %%
# A stroke teaches the friction
# -----------------------------
# While the finger slides every tactel pulls with as much as friction allows.  Each frame gives an
# estimate, weighted with its own covariance.

sliding = np.stack([normal, FRICTION * normal], axis=1)
contact = ff.Contact.none(model.sensor.tactels.count)
history = []
for frame in model.expose([sliding] * 20, rng):
    reading = ff.Reader(model).read(frame)
    contact, _ = contact.follow(reading)
    contact = contact.slid(reading)
    history.append((contact.friction.coefficient, contact.friction.variance**0.5))

learned = contact.friction
mean, deviation = np.array(history).T
print(f"friction {learned.coefficient:.4f} +- {learned.variance**0.5:.4f}, true {FRICTION}")
assert abs(learned.coefficient - FRICTION) < 4.5 * learned.variance**0.5
assert deviation[-1] < deviation[0] / 4

fig, ax = plt.subplots(figsize=(8, 3.2))
frames = 1 + np.arange(len(mean))
ax.fill_between(frames, mean - 2 * deviation, mean + 2 * deviation, alpha=0.2, linewidth=0)
ax.plot(frames, mean, "o-", markersize=3)
ax.axhline(FRICTION, color="#555555", linestyle=":")
ax.set(xlabel="frames of the stroke", ylabel="friction", xlim=(1, 20), xticks=range(2, 21, 2))
ax.set_title("What one stroke teaches; the band is two deviations")

# %%
# Following a pull
# ----------------
# The finger rests, and is then pulled harder and harder.  A live reader follows from frame to
# frame, and the contact says what happens at every tactel.

pull = np.linspace(0, 0.99 * FRICTION, 160)
loads = np.stack([np.broadcast_to(normal, (160, 11)), pull[:, None] * normal], axis=2)
reader = ff.Reader(model)
resting = ff.Contact.none(11, learned)
margin, warned, shares = [], [], []
for number, frame in enumerate(model.expose(loads, rng)):
    reading = reader.read(frame)
    resting, events = resting.follow(reading)
    warned += [(event.tactel, number) for event in events if event.kind is EventKind.SLIP]
    push, drag = reading.forces.sum(axis=0)
    shares.append(drag / push)

# %%
# The warning comes while there is still some way to go: earlier where a tactel carries little and
# its forces are known less well, later in the middle of the contact.

first = dict(reversed(warned))
middle = 5
left = 1 - pull[first[middle]] / FRICTION
print(f"the middle tactel warns with {100 * left:.1f} % of friction left")
assert middle in first
assert 0 < left < 0.25
assert resting.slipping[middle]

fig, (course, warning) = plt.subplots(1, 2, figsize=(10, 3.8))
course.plot(shares, label="as read")
course.plot(pull, ":", color="#555555", label="applied")
course.axhline(FRICTION, color="C1", label="friction")
course.set(xlabel="frame", ylabel="tangential / normal", xlim=(0, 160))
course.legend()
course.set_title("The pull")
tactels = np.array(sorted(first))
announced = pull[[first[tactel] for tactel in tactels]]
warning.vlines(tactels + 1, announced, FRICTION, color="C1", alpha=0.4, linewidth=6)
warning.plot(tactels + 1, announced, "v", color="C1")
warning.axhline(FRICTION, color="C1")
warning.set(xlabel="tactel", ylabel="tangential / normal", xticks=range(1, 12), ylim=(0, 0.42))
warning.set_title("Where each tactel warns, and what is left then")
plt.show()
