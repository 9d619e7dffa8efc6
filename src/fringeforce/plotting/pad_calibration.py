"""Pictures of a pad's calibration: residuals as images, contacts on the pad, the residual found."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from fringeforce.base.arrays import Array, Index
from fringeforce.base.measured import INTERVAL
from fringeforce.models.bench_record import BenchRecord
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_influence import Retardance
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.plotting.axes import MILLI, STYLE

WRONG, MARK = "#d55e00", "#0072b2"
COLUMNS, IMAGES = 8, 32
"""Images in a row, and frames that are shown at most: those that fit worst."""
FIELD = 64
"""Pixels along each side of a picture of a field."""


def draw_residual_images(record: BenchRecord, outliers: tuple[int, ...]) -> Figure:
    """Residuals of frames as images, the frames that fit worst if there are many."""
    with mpl.rc_context(STYLE):
        count = len(record.misfits)
        shown = np.sort(np.argsort(-record.misfits, kind="stable")[:IMAGES])
        columns = min(COLUMNS, len(shown))
        rows = -(-len(shown) // columns)
        canvas = Figure(figsize=(8.0, 1.3 * rows + 0.5))
        axes = np.atleast_1d(canvas.subplots(rows, columns, squeeze=False)).ravel()
        shades = ScalarMappable(Normalize(-5, 5), "RdBu_r")
        for ax in axes:
            ax.set_axis_off()
        for ax, frame in zip(axes, shown, strict=False):
            ax.imshow(
                record.residuals[frame],
                cmap=shades.cmap,
                norm=shades.norm,
                interpolation="nearest",
                origin="lower",
            )
            wrong = frame in outliers
            ax.set_title(
                f"{frame}: {record.misfits[frame]:.2f}",
                fontsize=8,
                color=WRONG if wrong else "black",
                fontweight="bold" if wrong else "normal",
            )
        canvas.colorbar(shades, ax=axes, label="residual / its deviation", shrink=0.8)
        if len(shown) < count:
            canvas.suptitle(f"the {len(shown)} of {count} frames that fit worst", fontsize=10)
        return canvas


def draw_pad_contacts(record: BenchRecord, outliers: tuple[int, ...], pad: PadModel) -> Figure:
    """Contacts on the pad where they were thought and where they were, and how forces differ."""
    with mpl.rc_context(STYLE):
        canvas = Figure(figsize=(8.0, 5.4))
        grid = canvas.add_gridspec(4, 2, width_ratios=(1.25, 1))
        ax = canvas.add_subplot(grid[:, 0])
        wrong = np.isin(record.frames, outliers)
        written, found = MILLI * record.written[:, :2], MILLI * record.found[:, :2]
        t = pad.sensor.transducer
        ends = MILLI * t.length / 2, MILLI * t.width / 2
        ax.add_patch(
            Rectangle((-ends[0], -ends[1]), 2 * ends[0], 2 * ends[1], fill=False, ec="#888888")
        )
        for own, colour, label in ((~wrong, "#444444", "written"), (wrong, WRONG, "left out")):
            ax.plot(*written[own].T, "o", mfc="white", mec=colour, ms=6, label=label)
        reach = MILLI * INTERVAL * record.std[:, :2]
        ax.errorbar(*found.T, *reach.T[::-1], fmt="o", color=MARK, ms=3, lw=1, label="found")
        ax.plot(*np.stack([written, found], axis=1).T, color=MARK, lw=0.8)
        for frame, place in zip(record.frames[wrong], written[wrong], strict=True):
            ax.annotate(
                f"frame {frame}", place, (5, 5), textcoords="offset points", color=WRONG, fontsize=8
            )
        ax.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
        ax.legend(loc="lower left", bbox_to_anchor=(0, 1.0), ncols=3, fontsize=8)
        off = record.found - record.written
        x_off, *rest = [canvas.add_subplot(grid[number, 1]) for number in range(4)]
        _beside(x_off, record.frames, MILLI * off[:, :2], MILLI * record.std[:, :2])
        x_off.set_ylabel("x (blue), y\n(green) [mm]")
        x_off.set_title("found less written", fontsize=10)
        names = "normal\n[N]", "x\n[N]", "y\n[N]"
        for number, (one, name) in enumerate(zip(rest, names, strict=True), 2):
            _beside(one, record.frames, off[:, [number]], record.std[:, [number]])
            one.set_ylabel(name)
        rest[-1].set_xlabel("frame")
        for one in (x_off, *rest[:-1]):
            one.tick_params(labelbottom=False)
        canvas.align_ylabels([x_off, *rest])
        return canvas


def _beside(ax: Axes, frames: Index, off: Array, std: Array) -> None:
    """Differences of contacts by frame, with 95 % intervals; the second beside the first."""
    ax.axhline(0, color="#888888", linewidth=1)
    for number, colour in enumerate((MARK, "#009e73")[: off.shape[1]]):
        ax.errorbar(
            frames + 0.3 * number,
            off[:, number],
            INTERVAL * std[:, number],
            fmt="o",
            ms=3,
            lw=1,
            color=colour,
        )


def draw_residual(model: PadModel) -> Figure:
    """The two parts of the retardance without load that was found, over both passes."""
    with mpl.rc_context(STYLE):
        canvas = Figure(figsize=(8.0, 3.4))
        axes = canvas.subplots(1, 2)
        t, fields = model.sensor.transducer, residual_field(model)
        ends = [MILLI * way * side / 2 for side in (t.length, t.width) for way in (-1, 1)]
        most = max(float(np.abs(fields).max()), 1e-3)
        shades = ScalarMappable(Normalize(-most, most), "PuOr")
        for ax, field, name in zip(axes, fields, ("0 and 90", "45 and 135"), strict=True):
            ax.imshow(field, cmap=shades.cmap, norm=shades.norm, origin="lower", extent=tuple(ends))
            ax.set(xlabel="x [mm]", title=f"between {name} degrees")
            ax.grid(visible=False)
        axes[0].set_ylabel("y [mm]")
        canvas.colorbar(shades, ax=axes, label="rad, both passes")
        return canvas


def residual_field(model: PadModel) -> Array:
    """The residual that is expected, shape (2, FIELD, FIELD) [rad], over both passes."""
    known = PadUncertainty.of(model)
    t, still = model.sensor.transducer, known.still
    found = np.zeros((2, FIELD, FIELD))
    if still is None:
        return found
    x, y = (((np.arange(FIELD) + 0.5) / FIELD - 0.5) * side for side in (t.length, t.width))
    model = known.model
    modes = Retardance.at(model.influence, x, y).spread(still)
    return np.asarray(2 * np.einsum("k,fkrc->frc", model.influence.profile.sum(axis=0), modes))
