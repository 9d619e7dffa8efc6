"""The figures by which a designer compares sensors, each a number with its unit and meaning."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fringeforce.contacts.loads import paper_load
from fringeforce.models.strip import SensorModel
from fringeforce.studies.performance import uncertainties
from fringeforce.studies.summary import LINEAR, fringe_density, surface_strain

VISIBLE = 3.0
"""Standard deviations that a force needs to be told from none."""


@dataclass(frozen=True)
class Figure:
    """One figure of a design.

    Attributes
    ----------
    key, name : str
        For the page and for people.
    value : float
        In the unit.
    unit : str
        As it is written.
    meaning : str
        What it says, in a sentence.
    """

    key: str
    name: str
    value: float
    unit: str
    meaning: str


def design_figures(model: SensorModel) -> list[Figure]:
    """Figures of a sensor under the paper's load, in the order of a designer's questions."""
    psi, load = model.frame_influence, paper_load(model.sensor.tactels.count)
    phase = psi @ load.ravel()
    spread = uncertainties(model, load[None])
    largest = 0.5 / max(fringe_density(model), 1e-12)
    smallest = VISIBLE * float(spread.max())
    return [
        Figure(
            "peak",
            "Peak phase, 1 N each",
            float(np.abs(phase).max()),
            "rad",
            "Largest phase lead under 1 N at 10 degrees on every tactel; 2 pi make one fringe.",
        ),
        Figure(
            "condition",
            "Condition number",
            float(np.linalg.cond(psi)),
            "",
            "Of the influence matrix: how much worse the least visible load is seen than the best.",
        ),
        Figure(
            "uncertainty",
            "Worst deviation, 1 N each",
            float(spread.max()) * 1e3,
            "mN",
            "Largest standard deviation of a force read from one frame of that load.",
        ),
        Figure(
            "range",
            "Dynamic range",
            20 * float(np.log10(max(largest / smallest, 1e-12))),
            "dB",
            f"From {smallest:.3g} N, {VISIBLE:g} standard deviations, to {largest:.3g} N, where "
            "fringes become finer than two pixels.",
        ),
        Figure(
            "linear",
            "Strain of 10 % at",
            LINEAR / surface_strain(model),
            "N",
            "Force on one tactel that strains the cover by 10 %. Large strain is seen earlier: "
            "`fringeforce study strain` tells from where.",
        ),
    ]
