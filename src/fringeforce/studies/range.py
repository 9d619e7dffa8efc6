"""Dynamic range: the largest load that each way of reading is guaranteed to read, in both cases."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from fringeforce.base.progress import Progress
from fringeforce.design.strip import Sensor
from fringeforce.models.strip import SensorModel, characterize
from fringeforce.studies.execution import gathered
from fringeforce.studies.limits import (
    PAPER_START,
    SIGN_BY_CONTACT,
    border_influence,
    edge_limit,
    nyquist_limit,
    strain_limit,
)
from fringeforce.studies.loads import LARGEST_ANGLE, scattered_load, uniform_load
from fringeforce.studies.monte_carlo import bracket, reader_judge, reading_limit
from fringeforce.studies.study_result import StudyResult

CASES = {"free": "Case 1 (free edges)", "roller": "Case 2 (roller edges)"}
SETS = {"uniform": (True, uniform_load), "any distribution": (False, scattered_load)}
FRAMES = 100
"""Random loads at each level of the Monte Carlo search."""


@dataclass(frozen=True)
class RangeLimits:
    """Largest normal force on a tactel that each condition allows, one case and set of loads [N].

    Attributes
    ----------
    paper_start : float
        Equation (12) may start with zeros: the phase at both borders stays in [-pi, 0].
    sign_by_contact : float
        The same where contact tells the sign: the phase at both borders stays in [-pi, pi].
    nyquist : float
        The camera resolves the fringes.
    strain : float
        Linear elasticity holds.
    reader : float
        Our reader reads at least 99 % of random loads right from one noisy frame.
    """

    paper_start: float
    sign_by_contact: float
    nyquist: float
    strain: float
    reader: float


LABELS = {
    "paper_start": "the paper's start, phase at the borders in [-pi, 0]",
    "sign_by_contact": "the same with the sign from contact, in [-pi, pi]",
    "nyquist": "camera, half a fringe per pixel",
    "reader": "our reader, 99 % of random loads right",
    "strain": "linear elasticity, 10 % strain",
}


def range_study(
    sensor: Sensor,
    pool: Executor,
    frames: int = FRAMES,
    seed: int = 0,
    progress: Progress | None = None,
) -> StudyResult:
    """Dynamic range of a design with free and with roller edges.

    Parameters
    ----------
    sensor : Sensor
        The design; its own kind of edges is set aside.
    pool : Executor
        Where cases and sets of loads are worked on.
    frames : int
        Random loads at each level of the Monte Carlo search.
    seed : int
        Seed of loads and noise.
    progress : callable, optional
        Called with words, the cases done and their count.
    """
    cases = [sensor.replace(**{"transducer.edges": edges}) for edges in CASES]
    questions = [(case, loads, frames, seed) for case in cases for loads in SETS]
    answers = gathered(pool, _answer, questions, "cases and loads", progress)
    found = dict(zip(product(CASES, SETS), answers, strict=True))
    rows = tuple(
        (label, *(newtons(getattr(one, name)) for one in found.values()))
        for name, label in LABELS.items()
    )
    header = ("limit", *(f"{CASES[edges]}, {loads}" for edges, loads in found))
    text = _words(characterize(cases[-1]), found)
    return StudyResult("range", header, rows, text, lambda ax: _draw(ax, found))


def _answer(sensor: Sensor, loads: str, frames: int, seed: int) -> RangeLimits:
    return limits(characterize(sensor), loads, frames, seed)


def limits(model: SensorModel, loads: str, frames: int, seed: int = 0) -> RangeLimits:
    """All limits of one model under one of the `SETS` of loads."""
    uniform, draw = SETS[loads]
    border = border_influence(model)
    start, stop = bracket(model)
    return RangeLimits(
        paper_start=edge_limit(border, uniform, PAPER_START),
        sign_by_contact=edge_limit(border, uniform, SIGN_BY_CONTACT),
        nyquist=nyquist_limit(model, uniform),
        strain=strain_limit(model),
        reader=reading_limit(reader_judge(model, draw), start, stop, frames, seed),
    )


def steepest_angle(model: SensorModel) -> float:
    """Largest angle of a uniform load that turns no border's phase above zero [degrees]."""
    normal, tangential = border_influence(model).sum(axis=1).T
    if not tangential.any():
        return 90.0
    return float(np.degrees(np.arctan(np.min(-normal / np.abs(tangential)))))


def _words(roller: SensorModel, found: dict[tuple[str, str], RangeLimits]) -> str:
    one, two = (found[edges, "uniform"] for edges in CASES)
    angle = steepest_angle(roller)
    border = border_influence(roller).sum(axis=1)[0]
    if one.sign_by_contact == two.sign_by_contact:
        verdict = "For the paper's algorithm both cases have the same range."
    else:
        larger = 1 if one.sign_by_contact > two.sign_by_contact else 2
        verdict = f"For the paper's algorithm Case {larger} has the larger range."
    held = (
        f"Roller edges carry stress: {border[0]:.3g} rad per newton of normal and {border[1]:.3g} "
        f"rad per newton of tangential force on every tactel at the left border. A uniform load "
        f"steeper than {max(angle, 0):.1f} degrees turns a border's phase above zero however small "
        f"the load, so [-pi, 0] is guaranteed up to {newtons(two.paper_start)} for angles up to "
        f"{LARGEST_ANGLE:g} degrees, and up to {newtons(two.sign_by_contact)} where contact tells "
        "the sign."
    )
    readers = {edges: min(found[edges, loads].reader for loads in SETS) for edges in CASES}
    strain = min(one.strain, two.strain)
    first = "before" if strain < min(readers.values()) else "after"
    return (
        "Free edges carry no stress, so their phase is zero and the paper's start holds for "
        f"{newtons(one.paper_start)}. {held} {verdict} Our reader starts from the "
        "influence matrix and not from a border's phase: of random loads at least 99 % read right "
        f"up to {newtons(readers['free'])} in Case 1 and {newtons(readers['roller'])} in Case 2. "
        f"Linear elasticity ends {first} that, at {newtons(strain)} on a tactel."
    )


def newtons(value: float) -> str:
    """A limit in words."""
    return "any load" if np.isinf(value) else f"{value:.3g} N"


def _draw(ax: Axes, found: dict[tuple[str, str], RangeLimits]) -> None:
    """A bar for each limit; unlimited ones run off the axes."""
    finite = [v for one in found.values() for v in vars(one).values() if 0 < v < np.inf]
    low, high = min(finite) / 3, max(finite) * 3
    height = 0.8 / len(found)
    places = np.arange(len(LABELS))
    for index, ((edges, loads), one) in enumerate(found.items()):
        values = [getattr(one, name) for name in LABELS]
        y = places + (index - (len(found) - 1) / 2) * height
        style: dict[str, Any] = {"alpha": 1.0 if loads == "uniform" else 0.5}
        colour = "#0072b2" if edges == "free" else "#d55e00"
        widths = np.clip(values, low, high) - low
        ax.barh(
            y, widths, height * 0.9, low, color=colour, label=f"{CASES[edges]}, {loads}", **style
        )
        for place, value in zip(y, values, strict=True):
            ax.text(
                np.clip(value, low, high) * 1.05, place, newtons(value), va="center", fontsize=7
            )
    ax.set(xscale="log", xlim=(low, high * 4), xlabel="largest normal force on a tactel [N]")
    wrapped = [label.replace(", ", ",\n", 1) for label in LABELS.values()]
    ax.set_yticks(places, wrapped)
    ax.invert_yaxis()
    ax.grid(visible=False, axis="y")
    ax.legend(fontsize=7, loc="lower right")
