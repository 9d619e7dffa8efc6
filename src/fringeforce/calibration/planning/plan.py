"""Which calibration loads to apply, so that readings of the calibrated sensor err least.

Frames of a calibration load are predicted, and so is what they tell of all unknowns (Fisher's
information, as in the fit).  What is made small is not the unknowns' covariance but what it does to
readings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.calibration.bench_loads import BenchLoads, in_words, loads_on_tactels
from fringeforce.calibration.planning.candidates import Limits, pressable
from fringeforce.calibration.planning.knowledge import Knowledge, knowledge
from fringeforce.calibration.planning.pads import PadBenchKnowledge, pad_knowledge
from fringeforce.calibration.planning.selection import CandidateExperiments
from fringeforce.contacts.loads import checked_loads
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.models.pad import PadModel
from fringeforce.models.strip import SensorModel

TYPICAL = 24
"""Typical loads over which the error of readings is averaged."""
PAIRS = 2
"""Pairs of imagined designs, one the mirror of the other, over which a plan is averaged."""
MOST = 1000
"""Calibration loads beyond which nobody plans."""
GAIN = 0.01
"""Part of the error of readings below which further loads do not pay."""
NEXT = 3
"""Calibration loads that a calibration proposes to apply next."""
DOMINATED = 1.1
"""Error of readings, over that of a known sensor, beyond which a calibration asks for more."""


@dataclass(frozen=True, eq=False)
class Plan:
    """Calibration loads in the order of their worth, and what is expected of them.

    Attributes
    ----------
    loads : ndarray, shape (k, n, components)
        Normal and tangential forces [N], on tactels or at places of a skin or a pad.
    places : ndarray, shape (n, 1), or (n, 2) of a pad
        Where these are [m].
    names : tuple of str, length d
        Unknowns: dotted paths of the design, then "camera shift" [m], "camera scale" [1] and shares
        of cross-talk.
    values : ndarray, shape (d,)
        As known before.
    covariance : ndarray, shape (k + 1, d, d)
        Before the first load and after each, in the values' own units.
    ratio : ndarray, shape (k + 1,)
        Expected error of readings over that of a perfectly known sensor, to first order.
    anywhere : bool
        Whether loads are by place, as on a skin or a pad, and not by tactel.

    Examples
    --------
    >>> plan = ff.plan_presses(ff.load_sensor("saad"), 3, ["transducer.compliant.youngs_modulus"])
    >>> plan.loads.shape, plan.std.shape
    ((3, 11, 2), (4, 3))
    >>> print(plan.words[0])
    push on tactel 7 at 1.0 mm, 3 N right
    """

    loads: Array
    places: Array
    names: tuple[str, ...]
    values: Array
    covariance: Array
    ratio: Array
    anywhere: bool = False

    @property
    def presses(self) -> BenchLoads:
        """The loads as a bench writes them down, by tactel or by place."""
        found = loads_on_tactels(self.loads, self.places)
        return replace(found, tactels=None) if self.anywhere else found

    @property
    def words(self) -> list[str]:
        """What to press, a sentence for each load."""
        return in_words(self.presses)

    @property
    def std(self) -> Array:
        """Standard deviations before the first load and after each, shape (k + 1, d)."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    @property
    def enough(self) -> int:
        """Number of loads from which on all others together gain less than GAIN."""
        return int(np.argmax(self.ratio <= self.ratio[-1] * (1 + GAIN)))


def plan_presses(
    source: Sensor | Pad | SensorModel | PadModel,
    presses: int,
    parameters: Sequence[str] | None = None,
    limits: Limits | None = None,
    typical: ArrayLike | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Calibration loads after which readings of the calibrated sensor err least.

    Parameters
    ----------
    source : Sensor, Pad, SensorModel or PadModel
        The drawing, or a calibrated model, whose covariance is what is known already.  A skin is
        pressed at places two thicknesses of its cover apart, a pad at some of its tactels, and a
        strip in three dimensions is planned in the plane that is nearer.
    presses : int
        Number of calibration loads, a frame each; one may come several times.
    parameters : sequence of str, optional
        Dotted paths of the design values to estimate, as in `calibrate`.
    limits : Limits, optional
        What can be applied; up to 3 N on one tactel if not given.  Without a friction, that of a
        skin's design limits loads.
    typical : array_like, shape (j, n, components), optional
        Loads that the sensor is to read [N]; random contacts up to the largest force if not given.

    progress : callable, optional
        Called with a title, the steps done and the steps expected.

    Returns
    -------
    Plan
        The loads in order, and what they are expected to achieve.

    Raises
    ------
    InputError
        If nothing can be planned within the limits, or parameters or loads do not fit.

    Examples
    --------
    >>> plan = ff.plan_presses(ff.load_sensor("saad"), 3, limits=ff.Limits(force=2.0))
    >>> bool(plan.ratio[-1] < plan.ratio[0])
    True
    """
    if not (isinstance(presses, int | np.integer) and 1 <= presses <= MOST):
        raise InputError(f"presses = {presses}: must be a whole number from 1 to {MOST}.")
    problem = planning_problem(source, parameters, limits or Limits(), typical)
    return problem.best(int(presses), progress or _silent)


def assess_presses(
    source: Sensor | Pad | SensorModel | PadModel,
    forces: ArrayLike,
    parameters: Sequence[str] | None = None,
    limits: Limits | None = None,
    typical: ArrayLike | None = None,
) -> Plan:
    """What given loads are expected to achieve in the order given, as in `plan_presses`.

    Parameters
    ----------
    forces : array_like, shape (k, n, components)
        Normal and tangential forces [N].
    source, parameters, limits, typical
        As in `plan_presses`; of the limits only the size of typical loads matters.

    Examples
    --------
    >>> presses = [ff.polar(force, angle=0, n=11) for force in (1.0, 2.0)]
    >>> ff.assess_presses(ff.load_sensor("saad"), presses).ratio.shape
    (3,)
    """
    problem = planning_problem(source, parameters, limits or Limits(), typical)
    loads = _checked(forces, problem.known.sensor)
    return problem.plan(loads, problem.experiments(loads), list(range(len(loads))))


def next_presses(model: SensorModel | PadModel, forces: ArrayLike) -> str:
    """A sentence on what to press next on a calibrated sensor, or that more gains little.

    Parameters
    ----------
    model : SensorModel or PadModel
        Calibrated.
    forces : array_like, shape (F, n, components)
        Loads that it was calibrated with: what was pressed before can be pressed again [N].
    """
    loads = np.asarray(forces, dtype=float)
    strongest = float(np.linalg.norm(loads, axis=-1).max())
    try:
        plan = planning_problem(model, None, Limits(force=strongest), None, pairs=0).best(NEXT)
    except InputError as reason:
        return f"No load is proposed: {reason}"
    before, after = plan.ratio[0], plan.ratio[-1]
    said = "Readings are expected to err"
    if before <= DOMINATED:
        return (
            f"{said} as with a sensor that is known exactly; more loads gain less than "
            f"{1e2 * (before - 1):.1f} %."
        )
    words = "; ".join(plan.words)
    return (
        f"{said} {before:.3g} times as much as with a sensor that is known exactly. Press next: "
        f"{words}. That would leave {after:.3g} times."
    )


def _silent(title: str, done: int, expected: int) -> None:
    """Report nothing."""


@dataclass(frozen=True, eq=False)
class PlanningProblem:
    """What is known of a sensor, what can be pressed, and what it is to read.

    Attributes
    ----------
    known : Knowledge or PadBenchKnowledge
        Estimate and covariance of all unknowns.
    limits : Limits
        What can be applied.
    typical : ndarray, shape (j, n, 2)
        Loads that the sensor is to read [N].
    pairs : int
        Pairs of imagined designs over which a plan is averaged, beside the estimate.
    anywhere : bool
        Whether presses are by place, and not by tactel.
    """

    known: Knowledge | PadBenchKnowledge
    limits: Limits
    typical: Array
    pairs: int
    anywhere: bool = False

    def experiments(self, loads: Array, report: Progress = _silent) -> CandidateExperiments:
        """What loads tell of the modes, and what these do to typical readings."""
        truths, total = self.known.imagined(self.pairs), len(loads)
        information = []
        for number, truth in enumerate(truths):
            rows = []
            for told in self.known.told_by(loads, truth):
                done = number * total + len(rows)
                report(f"Predicting {total} presses", done, len(truths) * total)
                rows.append(told)
            information.append(rows)
        report("Done", len(truths) * total, len(truths) * total)
        return CandidateExperiments(
            np.array(information), np.array(list(map(self._weights, truths)))
        )

    def _weights(self, truth: Array) -> Array:
        """Variance that errors of the modes add to readings, over that of noise alone."""
        noise, added = 0.0, np.zeros((len(truth),) * 2)
        for moved, spread in self.known.readings(self.typical, truth):
            noise += float(np.trace(spread))
            added += moved.T @ moved
        return added / noise

    def best(self, presses: int, report: Progress = _silent) -> Plan:
        """The best so many loads within the limits."""
        loads = self.known.candidates(self.limits)
        experiments = self.experiments(loads, report)
        rows = experiments.chosen(presses)
        return self.plan(loads[rows], experiments, rows)

    def plan(self, loads: Array, experiments: CandidateExperiments, rows: list[int]) -> Plan:
        """What some of the loads achieve in order."""
        covariances = experiments.covariances(rows).mean(axis=0)
        root = self.known.own_root
        ratio = np.sqrt(1 + experiments.variances(rows))
        covariance = root @ covariances @ root.T
        places = self.known.places
        names, values = self.known.names, self.known.values
        return Plan(loads, places, names, values, covariance, ratio, self.anywhere)


def planning_problem(
    source: Sensor | Pad | SensorModel | PadModel,
    parameters: Sequence[str] | None,
    limits: Limits,
    typical: ArrayLike | None,
    pairs: int = PAIRS,
) -> PlanningProblem:
    """What is to be planned; parameters as in `plan_presses` and `PlanningProblem`."""
    sensor: Any = getattr(source, "sensor", source)
    if sensor.skin is not None and limits.friction is None:
        limits = replace(limits, friction=sensor.skin.friction)
    known = KINDS[sensor.kind](source, parameters)
    loads = known.typical(limits, TYPICAL) if typical is None else _checked(typical, known.sensor)
    anywhere = sensor.dimensions == 2 or sensor.skin is not None
    return PlanningProblem(known, limits, loads, pairs, anywhere)


def _on_strip(source: Any, parameters: Sequence[str] | None) -> Knowledge:
    drawn = getattr(source, "calibration", None) is None
    return knowledge(pressable(getattr(source, "sensor", source)) if drawn else source, parameters)


KINDS = {"strip": _on_strip, "pad": pad_knowledge}
"""What is known of a sensor, by its kind."""


def _checked(forces: ArrayLike, sensor: Sensor | Pad) -> Array:
    n, components = sensor.tactels.total, len(sensor.components)
    loads = checked_loads(forces, n, components)
    if loads.ndim != 3 or not len(loads):
        raise InputError(
            f"Loads of shape {loads.shape} do not fit; give (k, {n}, {components}) in newtons."
        )
    if not np.isfinite(loads).all():
        raise InputError("Loads are not all finite; give numbers in newtons.")
    return loads
