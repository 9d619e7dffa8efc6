"""Pictures of a calibration: what is left of the frames, the fields, the contacts, the values."""

from __future__ import annotations

from itertools import count, cycle
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.measured import INTERVAL
from fringeforce.design.text import path_in_words
from fringeforce.models.bench_record import BenchRecord
from fringeforce.models.imaging import Calibration, Imaging
from fringeforce.plotting.axes import MILLI, STYLE
from fringeforce.plotting.pad_calibration import draw_residual_images

WRONG, MARK, SHEAR = "#d55e00", "#0072b2", "#009e73"
PARTS = {2: ("normal", "tangential"), 3: ("normal", "tangential\nx", "tangential\ny")}
"""Components of forces, by their number."""
LENGTHS = "camera shift", "camera.shift", "camera.blur", "tactel "
"""What names of values begin with that are lengths of their own, and no shares of a drawn one."""


def _panels(height: float, rows: int = 1, **options: Any) -> tuple[Figure, Array]:
    canvas = Figure(figsize=(8.0, height))
    return canvas, np.atleast_1d(canvas.subplots(rows, **options))


def draw_misfit(record: BenchRecord, outliers: tuple[int, ...]) -> Figure:
    """Residuals by frame and pixel, and the misfit of every frame beside them; images of pads."""
    if record.dimensions > 1:
        return draw_residual_images(record, outliers)
    with mpl.rc_context(STYLE):
        count = len(record.misfits)
        height = float(np.clip(1.6 + 0.06 * count, 3.2, 7.0))
        canvas, (ax, beside) = _panels(height, 1, ncols=2, sharey=True, width_ratios=(5, 1))
        image = ax.imshow(
            record.residuals,
            aspect="auto",
            cmap="RdBu_r",
            vmin=-5,
            vmax=5,
            interpolation="nearest",
            extent=(0, 100, count - 0.5, -0.5),
        )
        ax.set(xlabel="pixels, share of the frame [%]", ylabel="frame")
        ax.grid(visible=False)
        canvas.colorbar(image, ax=ax, label="residual / its deviation", location="left")
        wrong = np.isin(np.arange(count), outliers)
        rows = np.arange(count)
        beside.axvline(1, color="#888888", linewidth=1)
        for own, colour, label in ((~wrong, MARK, "kept"), (wrong, WRONG, "left out")):
            if own.any():
                beside.plot(record.misfits[own], rows[own], "o", color=colour, ms=4, label=label)
        beside.set(xlabel="misfit", xscale="log", ylim=(count - 0.5, -0.5))
        beside.xaxis.set_minor_formatter("")
        if wrong.any():
            beside.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=8)
        return canvas


def draw_fields(imaging: Imaging, residual: ArrayLike) -> Figure:
    """Amplitude, offset and residual retardance along the strip, with 95 % bands."""
    with mpl.rc_context(STYLE):
        canvas, axes = _panels(6.0, 3, sharex=True)
        order = np.argsort(imaging.positions)
        order = order[imaging.usable.reshape(-1, len(order))[:, order].any(axis=0)]
        modes = imaging.phase_modes
        none = np.zeros((0, len(imaging.positions)))
        fields = (
            (imaging.amplitude, imaging.amplitude_modes, "amplitude\n[grey levels]"),
            (imaging.offset, imaging.offset_modes, "offset\n[grey levels]"),
            (np.asarray(residual), none if modes is None else modes, "phase without\nload [rad]"),
        )
        x = MILLI * imaging.positions[order]
        for ax, (values, own, label) in zip(axes, fields, strict=True):
            reach = INTERVAL * np.sqrt(np.square(own).sum(axis=0))
            for channel, line, width, colour in zip(
                count(1),
                values.reshape(-1, len(imaging.positions))[:, order],
                reach.reshape(-1, len(imaging.positions))[:, order],
                cycle((MARK, SHEAR, WRONG)),
                strict=False,
            ):
                band = line - width, line + width
                ax.fill_between(x, *band, color=colour, alpha=0.25, linewidth=0)
                ax.plot(x, line, color=colour, linewidth=1.4, label=f"channel {channel}")
            ax.set_ylabel(label)
        if len(axes[0].lines) > 1:
            place = {"loc": "lower left", "bbox_to_anchor": (0, 1)}
            axes[0].legend(fontsize=8, ncols=len(axes[0].lines), **place)
        axes[-1].set(xlabel="x [mm]", xlim=(x[0], x[-1]))
        canvas.align_ylabels()
        return canvas


def draw_contacts(record: BenchRecord, outliers: tuple[int, ...]) -> Figure:
    """Contacts where they were thought and where they were, and how far they moved."""
    with mpl.rc_context(STYLE):
        canvas, axes = _panels(8.2, 4, sharex=True, height_ratios=(2.2, 1, 1, 1))
        wrong = np.isin(record.frames, outliers)
        _places(axes[0], record, wrong)
        x, units = MILLI * record.written[:, 0], (MILLI, 1.0, 1.0)
        names = "place\n[mm]", "normal\n[N]", "tangential\n[N]"
        for column, (ax, unit, name) in enumerate(zip(axes[1:], units, names, strict=True)):
            off = unit * (record.found - record.written)[:, column]
            reach = INTERVAL * unit * record.std[:, column]
            own = ~wrong & np.isfinite(off)
            ax.axhline(0, color="#888888", linewidth=1)
            ax.errorbar(x[own], off[own], reach[own], fmt="o", ms=3, lw=1, color=MARK)
            ax.set_ylabel(name)
        axes[1].set_title("found less written, of the frames that were kept", fontsize=10)
        axes[-1].set_xlabel("x as written [mm]")
        canvas.align_ylabels()
        return canvas


def _places(ax: Axes, record: BenchRecord, wrong: Mask) -> None:
    written, found = (v[:, :2] * [MILLI, 1.0] for v in (record.written, record.found))
    parts = (~wrong, MARK, "found", "-"), (wrong, WRONG, "found, left out", "-|>")
    for own, colour, label, style in parts:
        if not own.any():
            continue
        for (x, n), (to_x, to_n) in zip(written[own], found[own], strict=True):
            ax.annotate(
                "",
                (to_x, to_n) if np.isfinite(to_x) else (x, n),
                (x, n),
                arrowprops={"arrowstyle": style, "color": colour, "lw": 1.2, "shrinkB": 2},
            )
        reach = INTERVAL * record.std[own, :2] * [MILLI, 1.0]
        dx, dy = reach.T if colour == WRONG else (None, None)
        x, n = found[own].T
        ax.errorbar(x, n, dy, dx, "o", color=colour, ms=5, lw=1.2, label=label)
    ax.plot(*written.T, "o", mfc="white", mec="#444444", ms=5, zorder=1, label="written")
    middle = np.mean(ax.get_xlim())
    for frame, (x, n), there in zip(
        record.frames[wrong], written[wrong], found[wrong], strict=True
    ):
        unknown = "" if np.isfinite(there).all() else ", see the findings"
        ax.plot(x, n, "o", mfc="white", mec=WRONG, mew=1.8, ms=7)
        ax.annotate(
            f"frame {frame}{unknown}",
            (x, n),
            (6 if x < middle else -6, 7),
            textcoords="offset points",
            ha="left" if x < middle else "right",
            color=WRONG,
            fontsize=8,
        )
    ax.set_ylabel("normal force [N]")
    ax.legend(loc="lower left", bbox_to_anchor=(0, 1.0), ncols=3, fontsize=8)


def draw_values(found: Calibration) -> Figure:
    """How far every value lies from the drawing, with 95 % intervals."""
    with mpl.rc_context(STYLE):
        lengths = np.array([n.startswith(LENGTHS) for n in found.names])
        off = found.values - found.drawing
        groups = [
            (~lengths, 100 / np.where(found.drawing == 0, 1.0, found.drawing), "change [%]"),
            (lengths, np.full(len(off), MILLI), "change [mm]"),
        ]
        canvas, axes = _panels(
            1.6 + 0.34 * len(off), 2, height_ratios=[int(own.sum()) + 0.6 for own, *_ in groups]
        )
        for ax, (own, unit, label) in zip(axes, groups, strict=True):
            rows = np.arange(own.sum())
            reach = INTERVAL * np.abs(unit * found.std)[own]
            ax.axvline(0, color="#888888", linewidth=1)
            ax.errorbar((unit * off)[own], rows, xerr=reach, fmt="o", color=MARK, capsize=3)
            pairs = zip(found.names, own, strict=True)
            names = [path_in_words(name, "\n") for name, here in pairs if here]
            ax.set(yticks=rows, yticklabels=names, xlabel=label, ylim=(len(rows) - 0.4, -0.6))
        canvas.align_ylabels()
        return canvas


def draw_aside(record: BenchRecord) -> Figure:
    """Errors of the forces of frames that were put aside, with 95 % intervals."""
    with mpl.rc_context(STYLE):
        parts = PARTS[record.dimensions + 1]
        canvas, axes = _panels(2.2 * len(parts), len(parts), sharex=True)
        order = np.unique(record.aside[:, 0])
        for part, ax in enumerate(axes):
            rows = record.aside[record.aside[:, 1] == part]
            first = np.searchsorted(rows[:, 0], rows[:, 0])
            many = np.searchsorted(rows[:, 0], rows[:, 0], "right") - first
            beside = (np.arange(len(rows)) - first + 0.5) / many - 0.5
            at = np.searchsorted(order, rows[:, 0]) + 0.6 * beside  # contacts side by side
            off, reach = rows[:, 2], INTERVAL * rows[:, 3]
            inside = np.abs(off) < reach
            ax.axhline(0, color="#888888", linewidth=1)
            for own, colour in ((inside, MARK), (~inside & np.isfinite(off), WRONG)):
                ax.errorbar(at[own], off[own], reach[own], fmt="o", ms=3.5, lw=1.2, color=colour)
            lost = np.unique(at[~np.isfinite(off)])
            ax.plot(lost, np.zeros(len(lost)), "x", color=WRONG, ms=8)
            ax.set_ylabel(f"{parts[part]}\n[N]")
        step = max(len(order) // 20, 1)
        axes[-1].set(
            xlabel="frame", xticks=range(0, len(order), step), xticklabels=order[::step].astype(int)
        )
        canvas.align_ylabels()
        return canvas
