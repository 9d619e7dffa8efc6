"""The figures of the pages Accuracy and Speed, drawn from the records that benchmarks left."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from conventions_figure import BASE, NORMAL, TANGENTIAL
from matplotlib import ticker
from matplotlib.figure import Figure
from records import Table, aligned, boxed, number
from scipy.stats import beta

if TYPE_CHECKING:
    from matplotlib.axes import Axes

THIRD, FOURTH = "#009E73", "#CC79A7"
WIDTH = 6.4
ROW = 0.2
"""Height of a row of a figure with names at its side [in]."""
STYLE: Any = {
    "svg.hashsalt": "fringeforce",
    "font.size": 10,
    "font.family": "sans-serif",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}


def characterize(path: Path) -> Figure:
    """Error over time of each solver."""
    (table,) = boxed(path)
    figure, (axes,) = _figure(3.4)
    solvers = np.array(table.texts("solver"))
    time, error = np.array(table.numbers("time")), np.array(table.numbers("error"))
    for name, colour in zip(dict.fromkeys(solvers), (NORMAL, TANGENTIAL, THIRD), strict=False):
        own = solvers == name
        axes.loglog(time[own], error[own], "o-", color=colour, label=name)
    axes.set(xlabel="time to compute it [s]", ylabel="error of the influence matrix")
    axes.legend()
    return figure


def reading(path: Path) -> Figure:
    """Share read, error over the bound, and share inside, of each row but those of rollers."""
    (table,) = boxed(path)
    own = [row for row in table.rows if not row[0].startswith("roller")]
    table = Table(table.columns, tuple(own))
    names = table.texts("loads")
    counted = re.search(r"(\d+) frames a row", path.read_text(encoding="utf-8"))
    frames = int(counted[1]) if counted else 0
    refused = [
        sum(int(n) for n in re.findall(r"[A-Z_]+ (\d+)", text))
        for text in table.texts("verdicts other than OK")
    ]
    okay = [100 * (1 - count / frames) for count in refused]
    shares = [np.nan if share == 0 else share for share in table.numbers("95 % holds")]
    figure, (left, middle, right) = _rows(names, 3)
    left.barh(range(len(names)), okay, color=NORMAL)
    left.set(xlabel="frames OK [%]", xlim=(0, 100))
    _dots(middle, table.numbers("rms / bound"), "error / bound", 1.0)
    _dots(right, shares, "inside 95 % [%]", 95.0)
    return figure


def departures(path: Path) -> Figure:
    """Frames that are OK as drawn and with a tolerance, and forces inside their intervals."""
    table = aligned(path, "departure")
    names = table.texts("departure")
    figure, (left, right) = _rows(names, 2)
    _pair(left, table.numbers("OK"), table.numbers("OK 2"), ("as drawn", "with tolerance"))
    left.set(xlabel="frames OK [%]", xlim=(-4, 104))
    _pair(right, table.numbers("inside"), table.numbers("inside 2"), None, 95.0)
    right.set(xlabel="inside 95 % [%]")
    _legend(figure, left)
    return figure


def diagnosis(path: Path) -> Figure:
    """Frames that were refused, rightly diagnosed, and without another cause beside."""
    table = aligned(path, "departure")
    names = table.texts("departure")
    figure, (axes,) = _rows(names, 1)
    rows = np.arange(len(names))
    axes.barh(rows, table.numbers("refused"), 0.8, color="#DDDDDD", label="refused")
    axes.barh(rows, table.numbers("right"), 0.55, color=NORMAL, label="cause named")
    axes.barh(rows, table.numbers("alone"), 0.25, color=TANGENTIAL, label="no other named")
    axes.set(xlabel="frames of 20")
    _legend(figure, axes)
    return figure


def bench_calibration(path: Path) -> Figure:
    """Calibrated readings beside those of the true sensor, for each departure of the bench."""
    table = aligned(path, "departure")
    names = table.texts("departure")
    figure, (left, middle, right) = _rows(names, 3)
    _pair(left, table.numbers("OK"), table.numbers("best"), ("calibrated", "true sensor"))
    left.set(xlabel="frames OK [%]", xlim=(80, 101))
    _dots(middle, table.numbers("ratio"), "error / true's", 1.0)
    middle.set_xlim(0.9, 1.3)
    _dots(right, table.numbers("inside"), "inside 95 % [%]", 95.0)
    _legend(figure, left)
    return figure


def calibration(path: Path) -> Figure:
    """Error of readings over the bound by where the model came from, on two benches."""
    benches = boxed(path)
    names = benches[0].texts("model from")
    figure, (axes,) = _rows(names, 1)
    labels = ("matrix as some design", "matrix 3 % off every design")
    for table, colour, label in zip(benches, (NORMAL, TANGENTIAL), labels, strict=True):
        axes.plot(table.numbers("rms/bound"), range(len(names)), "o", color=colour, label=label)
    axes.axvline(1, color=BASE, linewidth=0.8)
    axes.set(xscale="log", xlabel="error of readings / bound")
    _legend(figure, axes)
    return figure


def large_strain(path: Path) -> Figure:
    """Share inside and error over the bound by load, of linear and of finite strain."""
    table = aligned(path, "patch")
    columns = [table.texts(name) for name in ("patch", "reader", "N", "inside", "rms")]
    found: dict[tuple[str, str], list[list[float]]] = {}
    for patch, reader, *values in zip(*columns, strict=True):
        if reader in ("linear", "finite"):  # no line of words
            found.setdefault((patch, reader), []).append([number(text) for text in values])
    figure, (left, right) = _figure(3.4, 2)
    patches = dict.fromkeys(patch for patch, _ in found)
    colours = dict(zip(patches, (NORMAL, TANGENTIAL, THIRD), strict=False))
    for (patch, reader), values in found.items():
        load, inside, rms = np.transpose(values)
        style: Any = {"linestyle": ":" if reader == "linear" else "-", "marker": "o"}
        style |= {"color": colours[patch], "label": f"{patch}, {reader}"}
        left.plot(load, inside, **style)
        right.semilogy(load, rms, **style)
    left.axhline(95, color=BASE, linewidth=0.8)
    right.axhline(1, color=BASE, linewidth=0.8)
    left.set(xlabel="force on every tactel [N]", ylabel="inside 95 % [%]", ylim=(0, 100))
    right.set(xlabel="force on every tactel [N]", ylabel="error / bound")
    _legend(figure, left)
    return figure


def finite_strain(path: Path) -> Figure:
    """Difference from NGSolve by load, of ours and of the linear model; neo-Hookean layers.

    Of dead loads, and of those that follow the surface.
    """
    table = aligned(path, "law")
    figure, (axes,) = _figure(2.8)
    plain = np.array(table.texts("law")) == "neo-Hookean"
    for loads, mark in (("dead", "o"), ("follower", "x")):
        rows = plain & (np.array(table.texts("loads")) == loads)
        load, linear, off = (np.array(table.numbers(one))[rows] for one in ("N", "linear", "off"))
        axes.loglog(load, linear, f"{mark}:", color=TANGENTIAL, label=f"linear, {loads} loads")
        axes.loglog(load, off, f"{mark}-", color=NORMAL, label=f"Newton steps, {loads} loads")
    axes.set(xlabel="force on every tactel [N]", ylabel="off NGSolve\n[% of the peak phase]")
    axes.legend()
    return figure


def creep(path: Path) -> Figure:
    """Error, and what stays after a release, by what is known of the creep."""
    table = aligned(path, "reading")
    names = table.texts("reading")
    figure, (left, right) = _rows(names, 2)
    _dots(left, table.numbers("rms"), "error / error without creep", 1.0)
    right.barh(range(len(names)), table.numbers("left"), color=NORMAL)
    right.set(xlabel="left after release [% of the load]")
    return figure


def rivals(path: Path) -> Figure:
    """Share of frames recovered, and time for each, by method and largest force."""
    (table,) = boxed(path)
    ranges: list[str] = []
    found: dict[str, list[tuple[float, float]]] = {}
    columns = table.texts("method"), table.numbers("recovered"), table.numbers("ms")
    for name, share, ms in zip(*columns, strict=True):
        if name.startswith("up to"):
            ranges.append(name.removeprefix("up to "))
        else:
            found.setdefault(name, []).append((share, ms))
    figure, (left, right) = _figure(3.6, 2)
    place = range(len(ranges))
    for (name, values), colour in zip(
        found.items(), (NORMAL, TANGENTIAL, FOURTH, BASE, THIRD), strict=False
    ):
        share, ms = np.transpose(values)
        left.plot(place, share, "o-", color=colour, label=name)
        right.semilogy(place, ms, "o-", color=colour)
    for axes in (left, right):
        axes.set_xticks(place, ranges)
        axes.set_xlabel("forces up to")
    left.set(ylabel="frames recovered [%]")
    right.set(ylabel="time [ms]")
    _legend(figure, left, columns=1)
    return figure


def channels(path: Path) -> Figure:
    """Bound of the standard deviations by what the camera sees at once."""
    (table,) = boxed(path)
    names = table.texts("pictures")
    figure, (axes,) = _rows(names, 1, each=2)
    _bars(axes, (table.numbers("bound N, mN"), table.numbers("bound T, mN")))
    axes.set(xlabel="standard deviation of a force [mN]")
    _legend(figure, axes)
    return figure


def presses(path: Path) -> Figure:
    """What a calibration leaves uncertain, by kind and number of its loads."""
    row = r"^ *(\d+) +(\w+) +([\d.]+) +([\d.]+) \+- ([\d.]+)"
    found = re.findall(row, path.read_text(encoding="utf-8"), re.MULTILINE)
    if not found:
        raise ValueError("no row such as '10 planned 0.153 0.156 +- 0.008'")
    kinds = np.array([cells[1] for cells in found])
    counts, predicted, value, std = np.array(
        [[float(cell) for cell in (cells[0], *cells[2:])] for cells in found]
    ).T
    figure, (axes,) = _figure(3.4)
    colours = (NORMAL, TANGENTIAL, THIRD, FOURTH, BASE)
    for number_, (kind, colour) in enumerate(zip(dict.fromkeys(kinds), colours, strict=False)):
        own, shift = kinds == kind, 1 + 0.02 * (number_ - 2)
        axes.plot(counts[own] * shift, predicted[own], ":", color=colour)
        bars: Any = {"fmt": "o", "color": colour, "label": kind}
        axes.errorbar(counts[own] * shift, value[own], 2 * std[own], **bars)
    axes.set(xscale="log", yscale="log", xlabel="loads", ylabel="uncertainty of the matrix")
    axes.set_xticks(sorted(set(counts)), [f"{count:.0f}" for count in sorted(set(counts))])
    axes.set_yticks([0.05, 0.1, 0.2], ["0.05", "0.1", "0.2"])
    axes.minorticks_off()
    axes.legend()
    return figure


def robustness(path: Path) -> Figure:
    """Counts of inputs by what became of them."""
    table = boxed(path)[0]
    names = table.texts("input")
    tried = np.array(table.numbers("tried"))
    figure, (axes,) = _rows(names, 1)
    start = np.zeros(len(names))
    parts = ("clear errors", NORMAL), ("taken rightly", THIRD), ("failures", TANGENTIAL)
    for column, colour in parts:
        share = 100 * np.array(table.numbers(column)) / tried
        axes.barh(range(len(names)), share, left=start, color=colour, label=column)
        start = start + share
    axes.set(xlabel="share of the inputs [%]", xlim=(0, 100))
    _legend(figure, axes)
    return figure


def reliability(path: Path) -> Figure:
    """Share of frames that were right over the probability that was stated."""
    table = aligned(path, "probability")
    stated, frames = np.array(table.numbers("stated")), np.array(table.numbers("frames"))
    stated = np.minimum(stated, 1 - 2.5e-5)  # of four digits: 1.0000 is more than 0.99995
    right = np.array(table.numbers("right")) * frames
    shape = right + 0.5, frames - right + 0.5  # Jeffreys' interval of a share
    middle, low, high = (beta.ppf(p, *shape) for p in (0.5, 0.025, 0.975))
    figure, (axes,) = _figure(4.4)
    axes.set(xscale="logit", yscale="logit", xlabel="stated probability", ylabel="share right")
    ends = min(low.min(), *stated) / 2, 1 - (1 - max(high.max(), *stated)) / 2
    axes.plot(ends, ends, color=BASE, linewidth=0.8)
    axes.errorbar(stated, middle, (middle - low, high - middle), fmt="o", color=NORMAL)
    marks = [0.1, 0.5, 0.9, 0.99, 0.999, 0.9999, 0.99999, 0.999999]
    shown = [tick for tick in marks if ends[0] <= tick <= ends[1]]
    for which in (axes.xaxis, axes.yaxis):
        which.set_ticks(shown, [f"{tick:g}" for tick in shown])
        which.set_minor_locator(ticker.NullLocator())
    return figure


def live(path: Path) -> Figure:
    """Frames a second by method, and by numbers of pixels and tactels."""
    methods = boxed(path)[0]
    names = methods.texts("method")
    figure, (axes,) = _rows(names, 1)
    bars = axes.barh(range(len(names)), methods.numbers("frames/s"), color=NORMAL)
    axes.bar_label(bars, methods.texts("frames/s"), padding=3, fontsize=9)
    axes.set(xscale="log", xlabel="frames a second, one core", xlim=(50, 400_000))
    return figure


def growth(path: Path) -> Figure:
    """Frames a second by numbers of pixels, and of tactels."""
    table = boxed(path)[1]
    pixels, tactels = np.array(table.numbers("pixels")), np.array(table.numbers("tactels"))
    rate = np.array(table.numbers("frames/s"))
    figure, axes = _figure(2.8, 2)
    for one, values, own, name in (
        (axes[0], pixels, tactels == 11, "pixels"),
        (axes[1], tactels, pixels == 2048, "tactels"),
    ):
        order = np.argsort(values[own])
        one.loglog(values[own][order], rate[own][order], "o-", color=NORMAL)
        one.set(xlabel=name)
        one.set_xticks(np.sort(values[own]), [f"{v:.0f}" for v in np.sort(values[own])])
        one.minorticks_off()
    axes[0].set_ylabel("frames a second")
    axes[0].set_ylim(100, 100_000)
    axes[1].set_ylim(100, 100_000)
    return figure


def pictures(path: Path) -> Figure:
    """Time for each picture by size."""
    strips, pads = boxed(path)[:2]
    names = [f"{a}, {b} bits" for a, b in strips.pairs("picture", "bits")]
    names += [f"pad, {a}, {b}" for a, b in pads.pairs("picture of a pad", "camera")]
    times = [*strips.numbers("line"), *[number(row[-1]) for row in pads.rows]]
    figure, (axes,) = _rows(names, 1)
    bars = axes.barh(range(len(names)), times, color=NORMAL)
    axes.bar_label(bars, [f"{time:.2g}" for time in times], padding=3, fontsize=9)
    axes.set(xscale="log", xlabel="time for each picture [ms]", xlim=(0.01, 500))
    return figure


def sweep(path: Path) -> Figure:
    """Designs a second by how they are computed."""
    table = boxed(path)[0]
    names = table.texts("how")
    figure, (axes,) = _rows(names, 1)
    axes.barh(range(len(names)), table.numbers("designs a second"), color=NORMAL)
    axes.set(xlabel="designs a second")
    return figure


FIGURES: dict[str, tuple[Callable[[Path], Figure], ...]] = {
    "characterize": (characterize,),
    "reading": (reading,),
    "departures": (departures,),
    "pad_departures": (departures,),
    "diagnosis": (diagnosis,),
    "bench_calibration": (bench_calibration,),
    "calibration": (calibration,),
    "large_strain": (large_strain,),
    "finite_strain": (finite_strain,),
    "creep": (creep,),
    "rivals": (rivals,),
    "channels": (channels,),
    "presses": (presses,),
    "robustness": (robustness,),
    "reliability": (reliability,),
    "live": (live, growth),
    "pictures": (pictures,),
    "sweep": (sweep,),
}
"""What is drawn of a record; those that are missing here have a table only."""


def save(path: Path, folder: Path) -> list[Path]:
    """Draw the figures of a record into a folder; the same record gives the same bytes."""
    made = []
    for draw in FIGURES.get(path.stem, ()):
        with mpl.rc_context(STYLE):
            target = folder / f"{path.stem}-{draw.__name__}.svg"
            folder.mkdir(parents=True, exist_ok=True)
            try:
                figure = draw(path)
                for axes in figure.axes:
                    _plain(axes)
                figure.savefig(target, metadata={"Date": None})
            except (KeyError, ValueError, IndexError) as wrong:
                raise ValueError(
                    f"{path.name} is not as {draw.__name__} draws it: {wrong}"
                ) from wrong
            made.append(target)
    return made


def _figure(height: float, columns: int = 1, share: bool = False) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, list(figure.subplots(1, columns, sharey=share, squeeze=False)[0])


def _rows(names: Sequence[str], columns: int, each: int = 1) -> tuple[Figure, list[Axes]]:
    """A figure with a row for each name, the first above."""
    figure, axes = _figure(1.2 + ROW * each * len(names), columns, share=True)
    axes[0].set_yticks(range(len(names)), names)
    axes[0].set_ylim(len(names) - 0.4, -0.6)
    for one in axes:
        one.tick_params(axis="y", length=0)
        one.grid(axis="y", color="#EEEEEE")
        one.set_axisbelow(True)
    return figure, axes


def _dots(axes: Axes, values: Sequence[float], label: str, right: float) -> None:
    """A dot for each row, and a line where it should be."""
    axes.axvline(right, color=BASE, linewidth=0.8)
    axes.plot(values, range(len(values)), "o", color=NORMAL, markersize=4)
    axes.set_xlabel(label)


def _pair(
    axes: Axes,
    first: Sequence[float],
    second: Sequence[float],
    labels: tuple[str, str] | None,
    right: float | None = None,
) -> None:
    """Two dots for each row, the second one smaller, so that both are seen where they agree."""
    if right is not None:
        axes.axvline(right, color=BASE, linewidth=0.8)
    names = labels or (None, None)
    axes.plot(first, range(len(first)), "o", color=TANGENTIAL, markersize=7, label=names[0])
    axes.plot(second, range(len(second)), "o", color=NORMAL, markersize=4, label=names[1])


def _bars(axes: Axes, parts: tuple[Sequence[float], Sequence[float]]) -> None:
    for values, shift, name, colour in zip(
        parts, (-0.2, 0.2), ("normal", "tangential"), (NORMAL, TANGENTIAL), strict=True
    ):
        place = np.arange(len(values)) + shift
        bars = axes.barh(place, values, 0.38, color=colour, label=name)
        axes.bar_label(bars, [f"{value:.0f}" for value in values], padding=3, fontsize=9)


def _legend(figure: Figure, axes: Axes, columns: int = 3) -> None:
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=columns)


def _plain(axes: Axes) -> None:
    """Numbers in the place of powers of ten, where these are neither large nor small."""
    for which, scale in ((axes.xaxis, axes.get_xscale()), (axes.yaxis, axes.get_yscale())):
        low, high = sorted(which.get_view_interval())
        small = scale == "log" and low > 1e-3 and high < 1e6
        if small and isinstance(which.get_major_locator(), ticker.LogLocator):
            which.set_major_formatter(ticker.StrMethodFormatter("{x:,g}"))
            which.set_minor_formatter(ticker.NullFormatter())
