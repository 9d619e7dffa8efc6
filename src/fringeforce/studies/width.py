"""Width: how a strip's phases change with it, and when plane stress or plane strain is good."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from fringeforce.base.arrays import Array
from fringeforce.base.progress import Progress
from fringeforce.contacts.loads import PAPER_ANGLE, PAPER_LOAD, paper_load
from fringeforce.design.strip import Sensor
from fringeforce.models.strip import characterize
from fringeforce.models.strip_width import strip_width
from fringeforce.studies.execution import gathered
from fringeforce.studies.one_phase import NARROW, OnePhase, one_phase
from fringeforce.studies.study_result import StudyResult, percent

WIDTHS = (0.015, 0.05, 0.15, 0.4, 1.0, 2.5, 7.0, 20.0, 50.0)
"""Widths to look at, in thicknesses of the strip; the design's own comes between."""
PLACES = (0.0, 0.5, 0.95)
"""Places across the strip, in half widths; the last is near the side faces."""
SAMPLES = 501
PLANES = ("stress", "strain")
LEVELS = (0.01, 0.05)
"""Deviations up to which a plane model counts as good, of its largest phase."""


@dataclass(frozen=True, eq=False)
class AtWidth:
    """Phases of a strip of one width, under the same load per width.

    Attributes
    ----------
    width : float
        [m].
    lead : ndarray, shape (len(PLACES), SAMPLES)
        Phase lead at the places across the strip [rad].
    turned : float
        Largest excess of the equivalent retardance over the lead [rad].
    """

    width: float
    lead: Array
    turned: float


def at_width(sensor: Sensor, width: float) -> AtWidth:
    """Solve one width, the call that travels to the workers."""
    own = sensor.transducer.width
    wide = sensor.replace(transducer={"width": width, "plane": "3d"}, camera=NARROW)
    y = np.array(PLACES) * width / 2
    found = strip_width(wide, places=(y, np.full(len(y), 1 / len(y))))
    forces = paper_load(sensor.tactels.count) * width / own
    lead, cross = found.phases(forces, samples(sensor))
    return AtWidth(width, lead, float((np.hypot(lead, cross) - np.abs(lead)).max()))


def samples(sensor: Sensor) -> Array:
    """Places along the strip at which phases are compared, shape (SAMPLES,) [m]."""
    return np.linspace(-0.5, 0.5, SAMPLES) * sensor.transducer.length


def plane_phases(sensor: Sensor) -> dict[str, Array]:
    """Phases of plane stress and plane strain, shape (SAMPLES,) [rad]."""
    forces, x = paper_load(sensor.tactels.count), samples(sensor)
    variants = {
        plane: sensor.replace(transducer={"plane": plane}, camera=NARROW) for plane in PLANES
    }
    return {plane: characterize(variant).phase(forces, x) for plane, variant in variants.items()}


def deviations(found: Sequence[AtWidth], planes: dict[str, Array]) -> dict[str, Array]:
    """Largest deviation in mid-width from either plane, over its largest phase, (widths,)."""
    return {
        name: np.array([np.abs(one.lead[0] - p).max() for one in found]) / np.abs(p).max()
        for name, p in planes.items()
    }


def width_study(
    sensor: Sensor, pool: Executor, seed: int = 0, progress: Progress | None = None
) -> StudyResult:
    """Phases against width, and readings of a camera whose line is not narrow."""
    own = sensor.transducer.width
    depth = sensor.transducer.compliant.thickness + sensor.transducer.photoelastic.thickness
    widths = sorted({own, *(float(depth * share) for share in WIDTHS)})
    found = gathered(pool, at_width, [(sensor, width) for width in widths], "widths", progress)
    planes = plane_phases(sensor)
    away = deviations(found, planes)
    lines = one_phase(sensor, seed, progress)
    middle = SAMPLES // 2
    rows = tuple(
        (
            f"{one.width * 1e3:.3g}",
            *(f"{one.lead[k, middle]:.3f}" for k in (0, len(PLACES) - 1)),
            *(f"{np.abs(one.lead[k]).max():.3f}" for k in (0, len(PLACES) - 1)),
            *(f"{1e2 * away[name][i]:.2f}" for name in PLANES),
            f"{one.turned:.3f}",
        )
        for i, one in enumerate(found)
    )
    header = (
        "width [mm]", "p(0) in mid-width [rad]", "p(0) near a face [rad]",
        "largest |p| in mid-width [rad]", "largest |p| near a face [rad]",
        "off plane stress [%]", "off plane strain [%]", "retardance beyond |p| [rad]",
    )  # fmt: skip
    return StudyResult(
        "width",
        header,
        rows,
        f"{_words(own, found, away)} {_line_words(lines)}",
        lambda ax: _draw(ax, found, planes, lines),
        (10.0, 4.4),
    )


def _words(own: float, found: Sequence[AtWidth], away: dict[str, Array]) -> str:
    widths = np.array([one.width for one in found])
    here = int(np.argmin(np.abs(widths - own)))
    narrow, wide = (
        [_reach(widths[::step], away[name][::step], level) for level in LEVELS]
        for name, step in (("stress", 1), ("strain", -1))
    )
    middle, face = (np.abs(found[here].lead[k]).max() for k in (0, -1))
    return (
        f"Under {PAPER_LOAD:g} N at {PAPER_ANGLE:g} degrees on every tactel of this strip, and as "
        f"much per width on the others of the table, plane stress holds in mid-width "
        f"{_held(narrow, 'up to')}, plane strain {_held(wide, 'from')}. This strip is "
        f"{own * 1e3:.3g} mm wide: its phase in mid-width is off plane stress by "
        f"{percent(away['stress'][here], 1)} and off plane strain by "
        f"{percent(away['strain'][here])} of the largest phase of either. The largest phase is "
        f"{middle:.2f} rad in mid-width and {face:.2f} rad near a side face, where shear stresses "
        f"add up to {found[here].turned:.2f} rad to the retardance."
    )


def _held(reaches: Sequence[float], bound: str) -> str:
    return " and ".join(
        f"within {percent(level)} {f'{bound} {reach * 1e3:.3g} mm' if reach else 'nowhere'}"
        for level, reach in zip(LEVELS, reaches, strict=True)
    )


def _reach(widths: Array, away: Array, level: float) -> float:
    """The last width, from the first on, up to which all deviate by less than a level; or 0."""
    bad = np.flatnonzero(away > level)
    count = int(bad[0]) if bad.size else len(widths)
    return float(widths[count - 1]) if count else 0.0


def _line_words(lines: Sequence[OnePhase]) -> str:
    worst = {load: [one for one in lines if one.load == load] for load in {o.load for o in lines}}
    good, bad = [], []
    for load, group in sorted(worst.items()):
        wide = [one.line for one in group if one.error <= 2 * one.noise]
        reach = f"up to {max(wide) * 1e3:.3g} mm" if wide else "at no width"
        good.append(f"{reach} at {load:g} N")
        last = group[-1]
        bad.append(
            f"{last.error:.2g} N at {load:g} N, where noise alone makes {last.noise:.2g} N and "
            f"{percent(last.contrast)} of the contrast is left"
        )
    return (
        "A pixel that sees a wide line takes the mean of the light across it. Read as the light of "
        "one phase, it puts forces off by at most twice what noise does with lines of a width "
        f"{', '.join(good)} on every tactel. A line of {last.line * 1e3:.3g} mm puts them off, "
        f"root mean square, by {'; '.join(bad)}."
    )


def _draw(
    ax: Axes, found: Sequence[AtWidth], planes: dict[str, Array], lines: Sequence[OnePhase]
) -> None:
    ax.axis("off")
    left, right = ax.inset_axes((0, 0, 0.52, 1)), ax.inset_axes((0.64, 0, 0.36, 1))
    width = [one.width * 1e3 for one in found]
    for k, name in ((0, "middle"), (len(PLACES) - 1, "near a side face")):
        left.plot(width, [one.lead[k, SAMPLES // 2] for one in found], "o-", label=name)
    for name, style in zip(PLANES, ("--", ":"), strict=True):
        value = planes[name][SAMPLES // 2]
        left.axhline(value, linestyle=style, color="0.4", label=f"plane {name}")
    left.set(xscale="log", xlabel="width [mm]", ylabel="p at x = 0 [rad]")
    left.legend(fontsize=8)
    for load in sorted({one.load for one in lines}):
        group = [one for one in lines if one.load == load]
        (curve,) = right.plot(
            [one.line * 1e3 for one in group],
            [one.error for one in group],
            "o-",
            label=f"{load:g} N on every tactel",
        )
        right.plot(
            [one.line * 1e3 for one in group],
            [one.noise for one in group],
            ":",
            color=curve.get_color(),
        )
    right.set(
        yscale="log",
        xlabel="width of the camera's line [mm]",
        ylabel="rms error of forces [N]\n(dotted: noise alone)",
    )
    right.set_xlim(0, None)
    right.set_ylim(right.get_ylim()[0] / 8, None)
    right.legend(fontsize=8, loc="lower left")
