"""Draw the pictures of docs/gallery.md: `python examples/stories.py [FOLDER] [STORY ...]`.

What presses is simulated by contact mechanics, and its light comes from its own tractions; the
reader gets grey levels only. Noise has a seed, so that every run draws the same.
"""

import io
import runpy
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from PIL import Image

import fringeforce as ff
from fringeforce.contacts.contact import EventKind
from fringeforce.models.presses import tractions
from fringeforce.plotting import axes as plot

NORMAL, TANGENTIAL, WARNING = "#0072B2", "#D55E00", "#A0007A"
FRAME_MS, HOLD_MS, COLOURS, DPI = 90, 1500, 48, 90


def picture(figure: Figure) -> Image.Image:
    """A figure as it looks on the page."""
    held = io.BytesIO()
    figure.savefig(held, dpi=DPI)
    plt.close(figure)
    return Image.open(held).convert("RGB")


def save_motion(path: Path, pictures: Sequence[Image.Image]) -> None:
    """Write a GIF of one palette, which stops a while at its last picture and begins again."""
    every = Image.fromarray(np.concatenate([np.asarray(one) for one in pictures[::5]]))
    palette = every.quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE)
    first, *rest = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in pictures]
    times = [FRAME_MS] * len(rest) + [HOLD_MS]
    first.save(path, save_all=True, append_images=rest, duration=times, loop=0, optimize=True)


def finger(folder: Path) -> None:
    """A cylinder presses, travels along a skin and lets go: pressure read over true."""
    sensor = ff.load_sensor("skin")
    model = ff.characterize(sensor)
    way = np.linspace(0, 1, 28)
    presses = [
        ff.Press(x=x, normal=n, tangential=0.2 * n, radius=6e-3)
        for x, n in zip(-4e-3 + 8e-3 * way, 0.4 + 2.6 * np.sin(np.pi * way) ** 2, strict=True)
    ]
    frames = model.expose([[press] for press in presses], rng=0)
    pictures, forces_inside, pressure_inside = [], [], []
    for press, frame, reading in zip(presses, frames, ff.Reader(model).stream(frames), strict=True):
        assert reading.status is ff.Status.OK
        assert reading.traction is not None
        figure, (light, axes) = plt.subplots(
            2, 1, figsize=(7.6, 4), height_ratios=(1, 5), sharex=True, layout="constrained"
        )
        ends = sensor.pixel_positions[[0, -1]] * 1e3
        light.imshow(
            frame[None], cmap="gray", aspect="auto", extent=(*ends, 0, 1), vmin=0, vmax=255
        )
        light.grid(visible=False)
        light.set(yticks=[], title="what the camera sees")
        places, forces = tractions(sensor, press)
        true = forces[:, 0] / (np.gradient(places) * sensor.transducer.width)
        x, value, std = (
            reading.traction.places * 1e3,
            *(part[:, 0] / 1e6 for part in (reading.traction.values, reading.traction.std)),
        )
        touched = np.interp(x, places * 1e3, true / 1e6, left=0, right=0)
        pressure_inside += list((np.abs(value - touched) <= 2 * std)[touched > 0])
        found = reading.contacts[0]
        forces_inside.append(abs(found.force[0] - press.normal) <= 2 * found.std[0])
        axes.fill_between(
            x, value - 2 * std, value + 2 * std, color=NORMAL, alpha=0.3, linewidth=0,
            label="two standard deviations",
        )  # fmt: skip
        axes.plot(x, value, color=NORMAL, label="pressure, read from this frame")
        axes.plot(places * 1e3, true / 1e6, color="black", linewidth=1, label="pressure, true")
        axes.set(xlabel="x [mm]", ylabel="MPa", xlim=(-6.5, 6.5), ylim=(-0.2, 2.2))
        axes.legend(loc="upper left", frameon=False)
        axes.text(
            0.98, 0.95,
            f"read  {found.force[0]:.3f} ± {found.std[0]:.3f} N\ntrue  {press.normal:.3f} N",
            transform=axes.transAxes, ha="right", va="top", family="monospace",
        )  # fmt: skip
        pictures.append(picture(figure))
    inside = f"{sum(forces_inside)} of {len(forces_inside)} forces"
    print(
        f"finger: in two deviations {inside}, {100 * np.mean(pressure_inside):.0f} % of pressures"
    )
    save_motion(folder / "finger.gif", pictures)


def slip(folder: Path) -> None:
    """A resting cylinder is pulled harder and harder: the warning comes before it slides."""
    sensor, friction = ff.load_sensor("skin"), 0.5
    model = ff.characterize(sensor)
    pulls = np.linspace(0, 0.995 * friction, 48)
    frames = model.expose(
        [
            [ff.Press(x=1e-3, normal=2.0, tangential=2.0 * pull, radius=6e-3, friction=friction)]
            for pull in pulls
        ],
        rng=1,
    )
    contacts = ff.SkinContacts(friction=ff.Friction(coefficient=friction, variance=0.05**2))
    ratios, stds, warned, pictures = [], [], None, []
    for number, reading in enumerate(ff.Reader(model).stream(frames)):
        contacts, events = contacts.follow(reading)
        if warned is None and any(event.kind is EventKind.SLIP for event in events):
            warned = number
        push, drag = reading.contacts[0].force
        ratios.append(drag / push)
        stds.append(np.hypot(reading.contacts[0].std[1], ratios[-1] * reading.contacts[0].std[0]))
        figure, axes = plt.subplots(figsize=(7.6, 3.6), layout="constrained")
        axes.axhspan(friction, 0.6, color="#F3DDEE", label="slides at this ratio")
        axes.plot(pulls, ":", color="black", label="applied")
        band = 2 * np.array(stds) / 2.0
        axes.fill_between(
            range(number + 1), ratios - band, ratios + band, color=TANGENTIAL, alpha=0.3
        )
        axes.plot(ratios, color=TANGENTIAL, label="read")
        axes.plot(number, ratios[-1], "o", color=TANGENTIAL)
        if warned is not None:
            axes.plot(warned, ratios[warned], "v", color=WARNING, markersize=11)
            left = 100 * (1 - pulls[warned] / friction)
            axes.annotate(
                f"warning:\n{left:.0f} % of the grip is left", (warned, ratios[warned]),
                color=WARNING, xytext=(0, -48), textcoords="offset points",
                ha="center", weight="bold",
            )  # fmt: skip
        axes.grid(visible=False)
        axes.set(xlim=(0, 52), ylim=(-0.02, 0.6), xlabel="frame")
        axes.set_ylabel("tangential / normal force")
        axes.legend(loc="upper left", frameon=False)
        pictures.append(picture(figure))
    assert warned is not None
    print(f"slip: warned at frame {warned} of {len(pulls)}, at {pulls[warned]:.3f} of {friction}")
    save_motion(folder / "slip.gif", pictures)


def egg(folder: Path) -> None:
    """A pad grips something like an egg, takes its weight, and it turns a little in the grip."""
    model = ff.characterize(ff.load_sensor("pad-skin"))
    way = np.linspace(0, 1, 22)
    presses, sizes = [], []
    for part in way:
        grip = 1.0 + 3.0 * min(1.0, 2 * part)
        weight = 1.2 * max(0.0, 2 * part - 1)
        size = (5e-3 * (grip / 4) ** (1 / 3), 3.6e-3 * (grip / 4) ** (1 / 3))
        sizes.append(size)
        presses.append(
            ff.Press(
                x=1e-3, y=-0.5e-3, normal=grip, tangential=(0.0, -weight), width=size,
                angle=20.0 + 40.0 * max(0.0, 2 * part - 1),
            )
        )  # fmt: skip
    frames = model.expose([[press] for press in presses], rng=2)
    pictures, off, turned = [], [], []
    readings = ff.Reader(model).stream(frames)
    for press, size, frame, reading in zip(presses, sizes, frames, readings, strict=True):
        assert reading.status is ff.Status.OK
        found = reading.contacts[0]
        assert found.axes is not None
        assert found.orientation is not None
        true = np.array([press.normal, *press.shear])
        off.append(np.abs(np.array(found.force) - true) / np.array(found.std[:3]))
        turned.append(abs((found.orientation - press.angle + 90) % 180 - 90))
        figure, (light, axes) = plt.subplots(1, 2, figsize=(7.6, 3.7), layout="constrained")
        light.imshow(frame[::2, ::2], cmap="gray", origin="lower", extent=(-12.5, 12.5) * 2)
        light.grid(visible=False)
        light.set(title="what the camera sees", xlabel="x [mm]", ylabel="y [mm]")
        centre = (found.centre[0] * 1e3, found.centre[1] * 1e3)
        axes.add_patch(
            Ellipse(
                (press.x * 1e3, (press.y or 0) * 1e3), *np.multiply(size, 1e3),
                angle=press.angle, color="0.85", label="contact, true",
            )
        )  # fmt: skip
        long, short = np.multiply(found.axes, 1e3)
        axes.add_patch(
            Ellipse(
                centre, width=long, height=short, angle=found.orientation, edgecolor=NORMAL,
                facecolor="none", linewidth=2, label="contact, read",
            )
        )  # fmt: skip
        pull = np.multiply(found.force[1:], 3)  # mm per newton
        if np.hypot(*pull) > 0.3:
            arrow = {"arrowstyle": "->", "color": TANGENTIAL, "linewidth": 2}
            axes.annotate("", tuple(np.add(centre, pull)), centre, arrowprops=arrow)
        rows = zip(("grip", "pull"), (found.force[0], -found.force[2]), (0, 2), strict=True)
        text = [f"{name}  {force:6.3f} ± {found.std[part]:.3f} N" for name, force, part in rows]
        axes.text(0.04, 0.04, "\n".join(text), transform=axes.transAxes, family="monospace")
        axes.set(xlim=(-6, 6), ylim=(-6, 6), aspect="equal", xlabel="x [mm]", title="contact")
        axes.legend(loc="upper left", frameon=False)
        pictures.append(picture(figure))
    inside = 100 * np.mean(np.array(off) <= 2)
    print(
        f"egg: {inside:.0f} % of components in two deviations, angle off {max(turned):.1f} degrees"
    )
    save_motion(folder / "egg.gif", pictures)


def press(folder: Path) -> None:
    """A calibration of 24 presses, one of which was written down a third too large."""
    rng, drawing = np.random.default_rng(3), ff.load_sensor("saad")
    softer = ff.characterize(drawing.replace(**{"transducer.compliant.youngs_modulus": "11 MPa"}))
    places, normal = rng.uniform(-6e-3, 6e-3, 24), rng.uniform(1, 3, 24)
    truly = places + rng.normal(0, 1e-4, 24), normal * (1 + 0.01 * rng.standard_normal(24))
    pressed = [
        [ff.Press(x=x, normal=n, tangential=0.2 * n, width=0.5e-3)]
        for x, n in zip(*truly, strict=True)
    ]
    shear = 0.2 * normal
    normal[7] *= 4 / 3
    written = [
        [ff.Press(x=x, normal=n, tangential=t)]
        for x, n, t in zip(places, normal, shear, strict=True)
    ]
    model = ff.calibrate(drawing, softer.expose(pressed, rng), written)
    assert model.calibration is not None
    record = model.calibration.record
    print("press:", model.calibration.findings)
    figure, axes = plt.subplots(figsize=(7.6, 3.2), layout="constrained")
    right = np.isin(record.frames, model.calibration.outliers, invert=True)
    for some, colour, marker in ((right, NORMAL, "o"), (~right, TANGENTIAL, "X")):
        axes.plot(record.written[some, 1], record.found[some, 1], marker, color=colour)
    line = [0, 1.1 * normal.max()]
    axes.plot(line, line, color="0.6", linewidth=1, zorder=0)
    for x, y, frame in zip(
        record.written[~right, 1], record.found[~right, 1], record.frames[~right], strict=True
    ):
        axes.annotate(
            f"frame {frame}", (x, y), (12, -4), textcoords="offset points", color=TANGENTIAL
        )
    axes.set(xlabel="force written down [N]", ylabel="force that the frame shows [N]")
    figure.savefig(folder / "press.png", dpi=DPI)
    plt.close(figure)


def cover(folder: Path) -> None:
    """What a thicker cover costs in certainty, and what it buys in fringes."""
    drawing, thickness = ff.load_sensor("saad"), np.linspace(0.3, 1.0, 8)
    load = ff.polar(1.0, angle=10, n=drawing.tactels.count)
    deviation, dense = [], []
    for each in thickness:
        drawn = drawing.replace(**{"transducer.compliant.thickness": each * 1e-3})
        model = ff.characterize(drawn)
        deviation.append(1e3 * ff.Reader(model).read(model.expose(load, rng=0)).std.max())
        slope = np.gradient(model.phase(load), model.pixel_positions)
        dense.append(1e-3 * np.abs(slope).max() / (2 * np.pi))
        print(f"cover: {each:.1f} mm  {deviation[-1]:5.1f} mN  {dense[-1]:.2f} fringes/mm")
    figure, panels = plt.subplots(1, 2, figsize=(7.6, 3.2), layout="constrained")
    titles = ("worst deviation at 1 N per tactel [mN]", "fringes per mm, where densest")
    both = (deviation, dense), titles, (NORMAL, TANGENTIAL)
    for axes, values, title, colour in zip(panels, *both, strict=True):
        axes.plot(thickness, values, "o-", color=colour)
        axes.set(xlabel="cover [mm]", title=title, ylim=(0, None))
    figure.savefig(folder / "cover.png", dpi=DPI)
    plt.close(figure)


def photographs(folder: Path) -> None:
    """Four photographs of a beam: the profiles that were measured on them, and the loads read."""
    runpy.run_path(str(Path(__file__).parent / "gallery" / "loads_from_photographs.py"))
    plt.gcf().savefig(folder / "photographs.png", dpi=DPI)
    plt.close("all")


STORIES: tuple[Callable[[Path], None], ...] = (finger, slip, egg, press, cover, photographs)


def main(folder: Path, names: Sequence[str]) -> None:
    """Draw the stories of these names, or all."""
    folder.mkdir(parents=True, exist_ok=True)
    with plt.rc_context(plot.STYLE):
        for story in STORIES:
            if not names or story.__name__ in names:
                story(folder)


if __name__ == "__main__":
    plt.switch_backend("agg")
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "gallery"), sys.argv[2:])
