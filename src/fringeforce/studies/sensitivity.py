"""Sensitivity: what readings and performance owe to each value of the drawing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from scipy.stats import sobol_indices, uniform

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.calibration.design_entries import design_value
from fringeforce.calibration.design_jacobian import design_jacobian
from fringeforce.contacts.loads import PAPER_ANGLE, PAPER_LOAD, paper_load
from fringeforce.design.strip import Sensor
from fringeforce.design.text import path_in_words
from fringeforce.estimation.bounds import fisher_information
from fringeforce.models.strip import SensorModel
from fringeforce.studies.evaluation import Setting, evaluate
from fringeforce.studies.execution import completed
from fringeforce.studies.performance import NAMES
from fringeforce.studies.study_result import StudyResult, percent

TOLERANCES: Mapping[str, float] = {
    "transducer.compliant.thickness": 0.05,
    "transducer.compliant.youngs_modulus": 0.1,
    "transducer.compliant.poissons_ratio": 0.01,
    "transducer.photoelastic.thickness": 0.02,
    "transducer.photoelastic.youngs_modulus": 0.1,
    "transducer.photoelastic.poissons_ratio": 0.05,
    "transducer.photoelastic.strain_optic_coefficient": 0.05,
    "transducer.width": 0.02,
    "tactels.pitch": 0.01,
}
"""Relative half widths within which values of a finished sensor may lie.

The length is left out: the edges are far from the tactels, and pixels move with it.
"""
OUTPUTS = ("peak_phase", "worst_uncertainty", "condition")
SAMPLES = 32
"""Base samples of Sobol's indices, a power of two; each costs a design for every value and two."""


@dataclass(frozen=True, eq=False)
class LocalSensitivity:
    """First-order effects of design values, per relative change.

    Attributes
    ----------
    paths : tuple of str, length d
        Dotted paths of the values.
    psi : ndarray, shape (d, n_pixels, n, 2)
        Derivative of the influence matrix by the logarithm of each value [rad/N].
    forces : ndarray, shape (d, n, 2)
        Change of the forces that the model of the drawing reads, per relative change of the true
        sensor's value, under the paper's load [N].
    """

    paths: tuple[str, ...]
    psi: Array
    forces: Array

    @property
    def relative_psi(self) -> Array:
        """Relative change of the matrix's size per relative change of each value, shape (d,)."""
        return np.linalg.norm(self.psi.reshape(len(self.psi), -1), axis=1)


def local_sensitivity(sensor: Sensor, paths: Sequence[str]) -> tuple[SensorModel, LocalSensitivity]:
    """Derivatives of the influence matrix and of read forces by design values.

    Grey levels that are wrong by d move a reading by C J' d / variance, with the covariance C of
    its noise and the Jacobian J.
    """
    jacobian = design_jacobian(sensor, tuple(paths), np.zeros(len(paths)))
    model, x = jacobian.model, sensor.pixel_positions
    psi = jacobian.at(x)[1:]
    forces = paper_load(sensor.tactels.count)
    influence = model.frame_influence
    changes = np.concatenate([ratio * psi for ratio in model.dispersions], axis=1)
    phase, response = influence @ forces.ravel(), model.response
    information = fisher_information(phase, influence, response)
    levels = response.jacobian(phase, (changes @ forces.ravel()).T)
    slopes = response.jacobian(phase, influence)
    moved = np.linalg.solve(information, (slopes.T / response.variance) @ levels).T
    shape = (len(paths), -1, *model.psi.shape[1:])
    return model, LocalSensitivity(
        tuple(paths), psi.reshape(shape), np.asarray(moved.reshape(shape)[:, 0], float)
    )


def variance_indices(
    function: Callable[[Array], Array],
    lowest: Array,
    highest: Array,
    samples: int,
    seed: int = 0,
) -> tuple[Array, Array]:
    """Sobol's indices of several outputs over a box.

    Parameters
    ----------
    function : callable
        From points (k, d) to outputs (k, s).
    lowest, highest : ndarray, shape (d,)
        The box; values are uniform in it.
    samples : int
        Base samples, a power of two.
    seed : int
        Seed of the sequence.

    Returns
    -------
    first, total : ndarray, shape (s, d)
        Shares of each output's variance that a value causes alone, and with all others.
    """
    if samples < 2 or samples & (samples - 1):
        raise InputError(f"samples = {samples}: must be a power of two, such as 32.")
    dists = [uniform(low, high - low) for low, high in zip(lowest, highest, strict=True)]
    rng = np.random.default_rng(seed)
    found = sobol_indices(func=lambda points: function(points.T).T, n=samples, dists=dists, rng=rng)
    return np.atleast_2d(found.first_order), np.atleast_2d(found.total_order)


def sensitivity_study(
    sensor: Sensor,
    pool: Executor,
    samples: int = SAMPLES,
    seed: int = 0,
    progress: Progress | None = None,
) -> StudyResult:
    """Derivatives and Sobol's indices of a design by the values that are never exactly known."""
    effect = sensor.transducer.photoelastic.effect
    paths = tuple(path.replace("strain_optic_coefficient", effect) for path in TOLERANCES)
    model, found = local_sensitivity(sensor, paths)
    size = float(np.linalg.norm(model.pixel_influence))
    tolerance = np.array(list(TOLERANCES.values()))
    setting = Setting(sensor, PAPER_LOAD, 5, np.random.SeedSequence(seed))
    total_calls = samples * (len(paths) + 2)
    chosen = [NAMES.index(name) for name in OUTPUTS]
    known = 0

    def outputs(points: Array) -> Array:
        nonlocal known
        values = np.full((len(points), len(OUTPUTS)), np.nan)
        tasks = ((i, (setting, _values(sensor, paths, row))) for i, row in enumerate(points))
        for i, outcome in completed(pool, evaluate, tasks):
            if isinstance(outcome, str):
                raise InputError(f"A design within the tolerances cannot be computed: {outcome}")
            values[i] = np.array(astuple(outcome))[chosen]
            known += 1
            if progress:
                progress("designs", known, total_calls)
        return values

    first, total = variance_indices(outputs, 1 - tolerance, 1 + tolerance, samples, seed)
    relative = found.relative_psi / size
    moved = np.sqrt((found.forces**2).mean(axis=1)) / PAPER_LOAD
    rows = tuple(
        (path, f"{1e2 * tolerance[i]:.0f}", f"{relative[i]:.2f}", *(f"{v:.2f}" for v in moved[i]),
         *(f"{max(first[s, i], 0):.2f} / {total[s, i]:.2f}" for s in range(len(OUTPUTS))))
        for i, path in enumerate(paths)
    )  # fmt: skip
    header = ("value", "tolerance [%]", "psi, % per %", "normal, % per %", "tangential, % per %",
              *(f"{name.replace('_', ' ')}: alone / with others" for name in OUTPUTS))  # fmt: skip
    text = _words(paths, tolerance, moved, total)
    return StudyResult(
        "sensitivity", header, rows, text, lambda ax: _draw(ax, paths, moved, total), (8.0, 5.0)
    )


def _values(sensor: Sensor, paths: Sequence[str], factors: Array) -> dict[str, Any]:
    return {p: design_value(sensor, p) * float(f) for p, f in zip(paths, factors, strict=True)}


def _words(paths: tuple[str, ...], tolerance: Array, moved: Array, total: Array) -> str:
    by_reading = int(np.argmax(np.linalg.norm(moved, axis=1)))
    within = np.linalg.norm(moved, axis=1) * tolerance
    widest = int(np.argmax(within))
    phase, uncertainty = (int(np.argmax(total[s])) for s in (0, 1))
    return (
        f"Under {PAPER_LOAD:g} N at {PAPER_ANGLE:g} degrees, read forces react most to "
        f"{paths[by_reading]}: 1 % of it moves normal ones by {moved[by_reading, 0]:.2f} % and "
        f"tangential ones by {moved[by_reading, 1]:.2f} % of the load (root mean square over "
        f"tactels). Within its tolerance of {percent(tolerance[widest])}, {paths[widest]} matters "
        f"most, so calibrate it first. The peak phase owes {percent(total[0, phase])} of its "
        f"variance to {paths[phase]}, and the worst uncertainty "
        f"{percent(total[1, uncertainty])} to {paths[uncertainty]} (Sobol's total indices within "
        "the tolerances)."
    )


def _draw(ax: Axes, paths: tuple[str, ...], moved: Array, total: Array) -> None:
    ax.axis("off")
    left, right = ax.inset_axes((0.16, 0, 0.36, 1)), ax.inset_axes((0.6, 0, 0.4, 1))
    places = np.arange(len(paths))
    for shift, values, name in ((-0.2, moved[:, 0], "normal"), (0.2, moved[:, 1], "tangential")):
        left.barh(places + shift, values, 0.38, label=name)
    left.set(xlabel="change of read forces, % of load per %", xscale="log")
    labels = [path_in_words(path, "\n") for path in paths]
    left.set_yticks(places, labels, fontsize=8)
    for index, name in enumerate(OUTPUTS):
        right.barh(places + (index - 1) * 0.27, total[index], 0.25, label=name.replace("_", " "))
    right.set_xlabel("total Sobol index")
    right.set_yticks(places, [""] * len(paths))
    for axes in (left, right):
        axes.invert_yaxis()
        axes.grid(visible=False, axis="y")
        axes.legend(fontsize=8)
