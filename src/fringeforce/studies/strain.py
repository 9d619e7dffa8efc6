"""Strain: up to which load the linear phase holds, and what its second order buys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.contacts.loads import PAPER_ANGLE, polar
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import Tolerances
from fringeforce.estimation.bounds import fisher_information
from fringeforce.models.finite_strain import second_order_influence
from fringeforce.models.strip import SensorModel, characterize
from fringeforce.studies.study_result import StudyResult

LOADS = (0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0)
"""Forces on every tactel [N]."""
ORDERS = ("linear", "second order")


@dataclass(frozen=True, eq=False)
class AtLoad:
    """What the orders leave of the phase under one load; linear first, then the second order.

    Attributes
    ----------
    load : float
        Force on every tactel [N].
    peak : float
        Largest phase [rad].
    off : ndarray, shape (2,)
        Largest error of the phase, over its largest value.
    forces : ndarray, shape (2,)
        Largest error of a force that follows from it [N].
    deviations : ndarray, shape (2,)
        The same in standard deviations of the force, by the noise alone.
    """

    load: float
    peak: float
    off: Array
    forces: Array
    deviations: Array


def at_load(model: SensorModel, curvature: Array, load: float) -> AtLoad:
    """Solve one load with Newton's steps, and compare.

    Parameters
    ----------
    model : SensorModel
        Of small strain, contacts of some width.
    curvature : ndarray, shape (P, 2n, 2n)
        Second order of the phase [rad/N^2].
    load : float
        Force on every tactel [N].
    """
    forces = polar(load, PAPER_ANGLE, model.sensor.tactels.count)
    flat, influence = forces.ravel(), model.frame_influence
    true = model.phase(forces, strain="finite")
    linear = influence @ flat
    bent = curvature @ flat
    error = np.stack([true - linear, true - linear - bent @ flat])
    # least squares of the grey levels take an error of the phase for these forces, to first order;
    # the second order is seen along its own tangent
    response, found, deviations = model.response, [], []
    for left, tangent in zip(error, (influence, influence + 2 * bent), strict=True):
        information = fisher_information(true, tangent, response)
        weights = np.square(response.slope(true)) / response.variance
        moved = np.linalg.solve(information, tangent.T @ (weights * left))
        spread = np.sqrt(np.diag(np.linalg.inv(information)))
        found.append(np.abs(moved).max())
        deviations.append(np.abs(moved / spread).max())
    peak = float(np.abs(true).max())
    off = np.abs(error).max(axis=1) / peak
    return AtLoad(load, peak, off, np.array(found), np.array(deviations))


def strain_study(
    sensor: Sensor, progress: Progress | None = None, loads: Sequence[float] = LOADS
) -> StudyResult:
    """Errors of the linear phase and of its second order against load.

    Parameters
    ----------
    sensor : Sensor
        The design; contacts without width are given the thickness of the cover.
    progress : callable, optional
        Told words, the loads done and their number.
    loads : sequence of float
        Forces on every tactel [N].

    Raises
    ------
    InputError
        If the strip is not solved in a plane, or has a skin.
    """
    if not sensor.transducer.solved_in_a_plane or sensor.skin is not None:
        raise InputError(
            'This study takes tactels and plane = "stress" or "strain"; give such a design.'
        )
    report = progress or (lambda title, done, total: None)
    width = sensor.tactels.contact_width or sensor.transducer.compliant.thickness
    drawn = sensor.model_copy(update={"tolerances": Tolerances()}).replace(
        **{"tactels.contact_width": width, "transducer.strain": "linear"},
        **{"transducer.relaxation": [], "polariscope.channels": []},
    )
    model = characterize(drawn)
    report("second order", 0, len(loads) + 1)
    curvature = second_order_influence(drawn, drawn.pixel_positions)
    found = list[AtLoad]()
    for number, load in enumerate(loads, 1):
        report(f"{load:g} N on every tactel", number, len(loads) + 1)
        try:
            found.append(at_load(model, curvature, load))
        except InputError:  # the surface folds
            break
    report("done", len(loads) + 1, len(loads) + 1)
    rows = tuple(
        (
            f"{one.load:g}",
            f"{one.peak:.2f}",
            *(f"{value:.2%}" for value in one.off),
            *(_short(1e3 * value) for value in one.forces),
            *(_short(value) for value in one.deviations),
        )
        for one in found
    )
    header = (
        "load [N]", "peak phase [rad]", "linear off", "second order off",
        "force off, linear [mN]", "second order [mN]", "in deviations, linear", "second order",
    )  # fmt: skip
    return StudyResult(
        "strain",
        header,
        rows,
        _words(found, width, len(found) < len(loads)),
        lambda ax: _draw(ax, found),
        (10.0, 4.2),
    )


def _short(value: float) -> str:
    return f"{value:.2g}" if value < 100 else f"{value:.0f}"


def _words(found: list[AtLoad], width: float, folds: bool) -> str:
    said = []
    for k, order in enumerate(ORDERS):
        bad = [one.load for one in found if one.deviations[k] > 1]
        good = [one.load for one in found if not bad or one.load < bad[0]]
        reach = f"up to {good[-1]:g} N" if good else f"not even at {found[0].load:g} N"
        said.append(f"{order} {reach}")
    last = f" Above {found[-1].load:g} N the surface folds." if folds else ""
    return (
        f"Under the same force at {PAPER_ANGLE:g} degrees on every tactel, contacts "
        f"{width * 1e3:.3g} mm wide, large strain moves no force by more than a standard deviation "
        f"of a single frame: {', '.join(said)}, of the loads in the table.{last} Linear readings "
        'are off by the rest and do not know it; strain = "finite" in the design reads by the '
        "second order, and solves the strip anew where that is not enough."
    )


def _draw(ax: Axes, found: list[AtLoad]) -> None:
    ax.axis("off")
    left, right = ax.inset_axes((0, 0, 0.43, 1)), ax.inset_axes((0.57, 0, 0.43, 1))
    loads = [one.load for one in found]
    for k, order in enumerate(ORDERS):
        left.plot(loads, [1e2 * one.off[k] for one in found], "o-", label=order)
        right.plot(loads, [one.deviations[k] for one in found], "o-", label=order)
    right.axhline(1, color="0.5", linewidth=0.8)
    left.set(ylabel="error of the phase [% of its peak]")
    right.set(ylabel="largest error of a force [standard deviations]")
    for part in (left, right):
        part.set(xscale="log", yscale="log", xlabel="force on every tactel [N]")
        part.legend(fontsize=8)
