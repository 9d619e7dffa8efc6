"""Section IV: how the edges limit the loads that can be read, by the paper's way and by ours."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes

from fringeforce.reproduction.example import PaperExample
from fringeforce.studies.limits import PAPER_START, SIGN_BY_CONTACT, border_influence, edge_limit
from fringeforce.studies.loads import LARGEST_ANGLE, uniform_load
from fringeforce.studies.monte_carlo import paper_judge, reader_judge, share_right, shares_right
from fringeforce.studies.range import CASES, newtons, steepest_angle

LOADS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
"""Uniform loads at random angles that both ways of reading are tried on [N]."""
DRAWS = 20


def draw_dynamic_range(example: PaperExample, ax: Axes) -> None:
    """Share of random loads that are read right over their size."""
    for edges, case in CASES.items():
        model = example.models[edges]
        # broad and narrow, so that lines that agree are both seen
        colour, width = ("#56b4e9", 5.0) if edges == "free" else ("#d55e00", 1.5)
        for judge, way, style in (
            (paper_judge, "equation (12), no noise", "o--"),
            (reader_judge, "our reader, noisy frames", "s-"),
        ):
            shares = shares_right(judge(model, uniform_load), LOADS, DRAWS)
            ax.semilogx(
                LOADS, shares * 100, style, color=colour, linewidth=width, label=f"{case}, {way}"
            )
        limit = edge_limit(border_influence(model), uniform=True, interval=SIGN_BY_CONTACT)
        if np.isfinite(limit):
            ax.axvline(
                limit, color=colour, linestyle=":", label=f"guaranteed by the border, {case}"
            )
    ax.set(xlabel="normal force on every tactel [N]", ylabel="read right [%]", ylim=(-3, 103))
    ax.set_xticks(LOADS, [f"{load:g}" for load in LOADS])
    ax.minorticks_off()
    ax.legend(fontsize=8)


def dynamic_range_statements(example: PaperExample) -> Iterator[tuple[str, str, str, str]]:
    """The section's conclusion with numbers, and what its guarantee leaves out."""
    borders = [border_influence(example.models[edges]) for edges in CASES]
    strict, signed = (
        [edge_limit(border, uniform=True, interval=interval) for border in borders]
        for interval in (PAPER_START, SIGN_BY_CONTACT)
    )
    largest = LOADS[-1]
    ours = [
        share_right(reader_judge(example.models[edges], uniform_load), largest, DRAWS)
        for edges in CASES
    ]
    yield (
        "Sec. IV",
        "Case 1 has the larger dynamic range",
        f"for uniform loads at any angle up to {LARGEST_ANGLE:g} degrees the border phase stays in "
        f"[-pi, 0] for {newtons(strict[0])} in Case 1 and up to {newtons(strict[1])} in Case 2, "
        f"where a load steeper than {steepest_angle(example.models['roller']):.1f} degrees turns "
        f"one border above zero; with the sign from contact, for {newtons(signed[0])} and up to "
        f"{newtons(signed[1])}. At {largest:g} N our reader reads {ours[0]:.0%} and {ours[1]:.0%} "
        "right",
        "Equation (12) follows the phase from a border, so the border limits it. A reader that "
        "uses the influence matrix needs no start: what the edges limit is the equation, not the "
        "sensor."
        if ours[1] >= ours[0]
        else "",
    )
    mirrored = paper_judge(example.models["free"], uniform_load, sign_by_contact=False)
    wrong = 1 - share_right(mirrored, 1.0, DRAWS)
    yield (
        "Sec. IV",
        "Case 1 guarantees the start independently of the force",
        f"equation (12) finds -p for {wrong:.0%} of uniform loads of 1 N within "
        f"{LARGEST_ANGLE:g} degrees",
        "The border is at zero, but the phase just inside it may rise above. Light alone does not "
        "tell p from -p; that contact pushes does."
        if wrong
        else "",
    )
