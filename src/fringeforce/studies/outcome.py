"""Sweeps and searches as figures, tables and words, with the design they start from marked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import XAxis, YAxis
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray
from scipy.stats import binned_statistic_2d, spearmanr

from fringeforce.base.arrays import Array, Index
from fringeforce.base.words import counted
from fringeforce.design.text import path_in_words
from fringeforce.design.units import READABLE
from fringeforce.studies.optimise import BestDesign
from fringeforce.studies.performance import UNITS
from fringeforce.studies.sampling import Axis
from fringeforce.studies.study_result import StudyResult, percent
from fringeforce.studies.sweep import Sweep
from fringeforce.studies.verification import Verified

UNCERTAINTY, RANGE = "worst_uncertainty", "largest_load"
PANELS, BINS = 4, 12
SIZE = (10.0, 7.6)
SHOWN = {
    "worst_uncertainty": (1e3, "mN"),
    "mean_uncertainty": (1e3, "mN"),
    "thickness": (1e3, "mm"),
    "volume": (1e9, "mm^3"),
}
"""Scale and unit in which a person reads a number; all others as they are."""


def sweep_result(sweep: Sweep, name: str) -> StudyResult:
    """Pareto front as a table, what the sweep says, and its figure."""
    front = sweep.pareto(UNCERTAINTY, RANGE)
    header = (*(_title(one) for one in sweep.axes), "worst uncertainty [mN]", "largest load [N]")
    rows = tuple(
        (
            *(_shown(one, sweep.columns[one.path][i]) for one in sweep.axes),
            f"{sweep.columns[UNCERTAINTY][i] * 1e3:.3g}",
            f"{sweep.columns[RANGE][i]:.3g}",
        )
        for i in front
    )
    return StudyResult(
        name, header, rows, _sweep_words(sweep, front), lambda ax: draw_sweep(ax, sweep), SIZE
    )


def optimum_result(optimum: BestDesign, verified: Sequence[Verified], name: str) -> StudyResult:
    """The design found beside the one it started from.

    Parameters
    ----------
    optimum : BestDesign
        What was found.
    verified : sequence of Verified
        Noisy frames of the design it started from and of the one found.
    name : str
        Name of the files.
    """
    sweep, best = optimum.sweep, optimum.best
    rows = [
        (_title(one), *(_shown(one, sweep.columns[one.path][i]) for i in (0, best)))
        for one in sweep.axes
    ]
    for quantity, unit in UNITS.items():
        scale, shown = SHOWN.get(quantity, (1.0, unit))
        label = quantity.replace("_", " ") + (f" [{shown}]" if shown else "")
        values = (getattr(p, quantity) for p in (optimum.before, optimum.performance))
        rows.append((label, *(_limit(scale * value) for value in values)))
    rows.append(("worst error of noisy frames [mN]", *(f"{v.found * 1e3:.3g}" for v in verified)))
    text = _optimum_words(optimum, *verified)
    header = ("", "start", "found")
    return StudyResult(
        name, header, tuple(rows), text, lambda ax: draw_sweep(ax, sweep, best), SIZE
    )


def draw_sweep(ax: Axes, sweep: Sweep, best: int | None = None) -> None:
    """Pareto front, heat map, and the objective over each of the first few values."""
    ax.axis("off")
    _draw_front(ax.inset_axes((0.0, 0.56, 0.42, 0.44)), sweep, best)
    ranges = [one for one in sweep.axes if not one.choices]
    if len(ranges) > 1:
        _draw_heat_map(ax.inset_axes((0.54, 0.56, 0.37, 0.44)), sweep, ranges[:2], best)
    shown = sweep.axes[:PANELS]
    width = 1 / len(shown)
    for index, one in enumerate(shown):
        panel = ax.inset_axes((index * width, 0.0, width * 0.9, 0.4))
        _draw_trade_off(panel, sweep, one, best)
        if index:
            panel.set(ylabel="", yticklabels=[])


def _draw_front(ax: Axes, sweep: Sweep, best: int | None) -> None:
    x, y = sweep.columns[UNCERTAINTY] * 1e3, sweep.columns[RANGE]
    _cloud(ax, sweep, x, y)
    front = sweep.pareto(UNCERTAINTY, RANGE)
    ax.plot(x[front], y[front], "-", color="#009e73", label="Pareto front")
    _marks(ax, x, y, best)
    ax.set(xlabel="worst uncertainty [mN]", ylabel="largest load [N]")
    _scaled(ax.xaxis, True)
    _scaled(ax.yaxis, True)
    ax.legend(fontsize=7, loc="lower right", frameon=True, framealpha=0.85)


def _draw_heat_map(ax: Axes, sweep: Sweep, axes: list[Axis], best: int | None) -> None:
    """Least worst uncertainty of the feasible designs in each cell."""
    feasible = np.flatnonzero(sweep.feasible)
    scaled = [sweep.columns[one.path] * READABLE[one.unit][0] for one in axes]
    edges = [_edges(one) for one in axes]
    first, second = scaled
    # SciPy's own types forget the function and the edges that its documentation allows
    cells: dict[str, Any] = {
        "statistic": lambda values: np.min(values) if len(values) else np.nan,
        "bins": edges,
    }
    least, *_ = binned_statistic_2d(
        first[feasible], second[feasible], sweep.columns[UNCERTAINTY][feasible] * 1e3, **cells
    )
    image = ax.pcolormesh(edges[0], edges[1], least.T, cmap="viridis_r", norm="log")
    _marks(ax, first, second, best)
    _scaled(ax.xaxis, axes[0].logarithmic)
    _scaled(ax.yaxis, axes[1].logarithmic)
    ax.set(xlabel=_title(axes[0]), ylabel=_title(axes[1]))
    ax.grid(visible=False)
    scale = ax.inset_axes((1.03, 0, 0.04, 1))
    ax.figure.colorbar(image, cax=scale, label="least worst uncertainty [mN]")


def _draw_trade_off(ax: Axes, sweep: Sweep, one: Axis, best: int | None) -> None:
    y = sweep.columns[UNCERTAINTY] * 1e3
    values = sweep.columns[one.path]
    if values.dtype.kind == "U":
        names = [str(choice) for choice in one.choices]
        x: NDArray[Any] = np.array([names.index(value) for value in values], dtype=float)
        ax.set_xticks(range(len(names)), names)
    else:
        x = values * READABLE[one.unit][0]
        _scaled(ax.xaxis, one.logarithmic)
    _cloud(ax, sweep, x, y)
    _marks(ax, x, y, best)
    _scaled(ax.yaxis, True)
    ax.set(xlabel=_title(one, "\n"), ylabel="worst uncertainty [mN]")


def _cloud(ax: Axes, sweep: Sweep, x: NDArray[Any], y: NDArray[Any]) -> None:
    fine = sweep.feasible
    ax.plot(x[~fine], y[~fine], ".", color="#bbbbbb", markersize=3, label="beyond a constraint")
    ax.plot(x[fine], y[fine], ".", color="#0072b2", markersize=4, label="within the constraints")


def _marks(ax: Axes, x: NDArray[Any], y: NDArray[Any], best: int | None) -> None:
    style: dict[str, Any] = {"linestyle": "", "markeredgecolor": "white", "zorder": 5}
    ax.plot(
        x[0], y[0], "*", color="#d55e00", markersize=13, label="the design at the start", **style
    )
    if best is not None:
        ax.plot(x[best], y[best], "D", color="#cc79a7", markersize=8, label="the best", **style)


def _scaled(axis: XAxis | YAxis, logarithmic: bool) -> None:
    """A scale with few ticks, in plain numbers where it is logarithmic."""
    if not logarithmic:
        return
    getattr(axis.axes, f"set_{axis.axis_name}scale")("log")
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FormatStrFormatter("%g"))
    axis.set_minor_formatter(NullFormatter())


def _edges(one: Axis) -> Array:
    factor = READABLE[one.unit][0]
    space = np.geomspace if one.logarithmic else np.linspace
    return space(one.low * factor, one.high * factor, BINS + 1)


def _sweep_words(sweep: Sweep, front: Index) -> str:
    count = len(sweep.columns["state"]) - 1
    fine = np.flatnonzero(sweep.feasible)
    words = [
        f"{counted(count, 'designs')}: {int(sweep.feasible[1:].sum())} within the constraints, "
        f"{sweep.failed} that could not be computed."
    ]
    if len(fine):
        uncertainty = sweep.columns[UNCERTAINTY]
        best = fine[np.argmin(uncertainty[fine])]
        values = ", ".join(f"{_title(one)} {_shown(one, sweep.columns[one.path][best])}"
                           for one in sweep.axes)  # fmt: skip
        words.append(
            f"The surest has a worst uncertainty of {uncertainty[best] * 1e3:.3g} mN, against "
            f"{uncertainty[0] * 1e3:.3g} mN of the design at the start: {values}."
        )
        ranks = {
            _title(one): _rank_correlation(sweep.columns[one.path][fine], uncertainty[fine])
            for one in sweep.axes
            if sweep.columns[one.path].dtype.kind == "f" and np.ptp(sweep.columns[one.path][fine])
        }
        if len(fine) > 2 and ranks:
            strongest = max(ranks, key=lambda name: abs(ranks[name]))
            words.append(
                f"It goes most with the {strongest} (rank correlation {ranks[strongest]:+.2f})."
            )
        several = counted(len(front), "designs are", "design is")
        words.append(f"{several} on the Pareto front of uncertainty and largest load.")
    return " ".join(words)


def _rank_correlation(one: NDArray[Any], other: NDArray[Any]) -> float:
    found: Any = spearmanr(one, other)
    return float(found.statistic)


def _optimum_words(optimum: BestDesign, before: Verified, after: Verified) -> str:
    found, start = optimum.performance.worst_uncertainty, optimum.before.worst_uncertainty
    thickness = optimum.performance.thickness * 1e3, optimum.before.thickness * 1e3
    limits = "" if optimum.sweep.feasible[0] else ", which exceeds a constraint"
    right = [_share(one) for one in (after.read_right, after.elsewhere, before.elsewhere)]
    return (
        f"The design found has a worst uncertainty of {found * 1e3:.3g} mN, "
        f"{_compared(found, start)} the {start * 1e3:.3g} mN of the design at the start{limits}, "
        f"in a strip {thickness[0]:.3g} mm thick against {thickness[1]:.3g} mm. Of {after.frames} "
        f"noisy frames at its worst load {right[0]} were read right, with an error of "
        f"the worst force of {after.found * 1e3:.3g} mN (predicted {after.predicted * 1e3:.3g}); "
        f"the design at the start has {before.found * 1e3:.3g} mN (predicted "
        f"{before.predicted * 1e3:.3g}). Over all loads {right[1]} were read right, and "
        f"{right[2]} at the start."
    )


def _limit(value: float) -> str:
    """A number, or that there is no limit."""
    return f"{value:.3g}" if np.isfinite(value) else "no limit"


def _share(value: float) -> str:
    return f"{100 * value:.3g} %"


def _compared(one: float, other: float) -> str:
    """How a number compares with another, before the words for that one."""
    if one == other:
        return "the same as"
    return f"{percent(abs(1 - one / other))} {'less' if one < other else 'more'} than"


def _title(one: Axis, joint: str = " ") -> str:
    unit = READABLE[one.unit][1]
    name = path_in_words(one.path, joint)
    return f"{name} [{unit}]" if unit else name


def _shown(one: Axis, value: Any) -> str:
    return str(value) if isinstance(value, str) else f"{value * READABLE[one.unit][0]:.4g}"
