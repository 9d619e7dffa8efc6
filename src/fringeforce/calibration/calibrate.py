"""From measured frames with known loads to the model of the sensor on the bench.

Maximum likelihood on raw grey levels: design values through the finite elements, the camera's
place and the lighting, all together.  Phases are never recovered, so small loads do no harm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.progress import Progress
from fringeforce.calibration import checks
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.columns.fit import fit_columns
from fringeforce.calibration.design_entries import checked_paths, entries
from fringeforce.calibration.design_jacobian import DesignJacobian, design_jacobian, relinearised
from fringeforce.calibration.fit import fitted
from fringeforce.calibration.fitted_model import calibrated_model
from fringeforce.calibration.frame_fit import (
    STAGES,
    CalibrationFit,
    consistent,
    levenberg_marquardt,
    light_basis,
    on_strip,
    pixel_weight,
    small_phases,
    start,
)
from fringeforce.calibration.light.drift import drifting
from fringeforce.calibration.light.references import (
    References,
    improved,
    patterned,
    with_references,
)
from fringeforce.calibration.load_log import LoadLog
from fringeforce.calibration.measurements import Measurements, Unknowns
from fringeforce.calibration.predictions import predict
from fringeforce.calibration.result import built
from fringeforce.design.strip import Sensor
from fringeforce.estimation.bad_pixels import stuck_pixels
from fringeforce.models.presses import Presses
from fringeforce.models.strip import SensorModel

PARAMETERS = (
    "transducer.photoelastic.strain_optic_coefficient",
    "transducer.compliant.youngs_modulus",
    "transducer.compliant.thickness",
)
"""Design values that drawings know worst."""
LIGHTS = 10
"""Smooth functions along the frame that make up amplitude and offset each."""
SHIFTS = np.arange(-2.0, 2.1, 0.25)
"""Shifts that are tried first, in units of SHIFT."""
RELINEARISATIONS = 10
"""Largest number of linearizations in the last stage."""


def calibrate(
    sensor: Sensor,
    frames: ArrayLike,
    forces: ArrayLike | BenchLoads | LoadLog | Presses,
    parameters: Sequence[str] = PARAMETERS,
    progress: Progress | None = None,
    references: References | None = None,
    columns: bool = False,
    *,
    times: ArrayLike | None = None,
    aside: int = 5,
) -> SensorModel:
    """Make the model agree with the sensor on the bench.

    Estimated together, as the most probable of all (maximum a posteriori): the chosen design
    values; the camera's shift and scale along the strip; amplitude and offset of the light and the
    retardance without load, as smooth fields; blur and gamma; and of every frame the forces, places
    and widths of its contacts about what is written down, and gain and offset of its light.  What
    the design or the list of loads states as a tolerance is taken as stated; how far all else
    scatters, the frames tell.  Dead pixels and wrong loads are found, left out and named in the
    result's `calibration`; its `imaging` carries the covariance, which readings add to their own.

    Parameters
    ----------
    sensor : Sensor
        The drawing; its camera's noise is taken as known.
    frames : array_like, shape (F, n_pixels)
        Grey levels; unloaded frames have zero forces and determine the offset.
    forces : array_like, shape (F, n, 2), BenchLoads, LoadLog, or sequences of Press
        Known normal and tangential forces of tactels [N]; or contacts at any place, for every
        frame; or a log of them by time, whose constant delay is found.
    parameters : sequence of str
        Dotted paths of the design values to estimate; "tactels.positions" means the place of every
        tactel, expected within 0.2 pitches of the drawing.  Their common shift looks like the
        camera's but for the strip's ends, so little more than that is known of it.  Young's
        moduli of both layers and the strain-optic coefficient matter only as E_1/E_2 and K_s/E_2:
        given all three, the combination that no frame shows is named and the drawing kept along it.
    progress : callable, optional
        Called with a title, the steps done and the steps expected.
    references : References, optional
        Frames that show the light alone.  With them every pixel has an amplitude and an offset of
        its own; what their noise leaves unknown is added to the noise of readings.
    columns : bool
        Also fit corrections to the columns that no design value explains: smooth along the strip,
        and by no more than the frames themselves make probable, which may be nothing.
    times : array_like, shape (F,), optional
        When the frames were taken [s]; with a log by time.
    aside : int
        Every so many loaded frames one is put aside at first and checked, if there are enough;
        none if zero.

    Returns
    -------
    SensorModel
        With `imaging` and `calibration`.

    Raises
    ------
    InputError
        If frames and forces do not fit the sensor or each other, or a path cannot be calibrated.

    Examples
    --------
    >>> drawing = ff.load_sensor("saad")
    >>> path = "transducer.photoelastic.strain_optic_coefficient"
    >>> made = ff.characterize(drawing.replace(**{path: 0.054}))
    >>> presses = np.random.default_rng(0).uniform(0.1, 1.5, (6, 11, 2)) * [1.0, 0.2]
    >>> model = ff.calibrate(drawing, made.expose(presses, rng=0), presses, [path])
    >>> round(model.sensor.transducer.photoelastic.strain_optic_coefficient, 3)
    0.054
    """
    report = progress or (lambda title, done, expected: None)
    if not columns:
        levels, known = checks.checked_bench(sensor, frames, forces, times)
        paths = checked_paths(sensor, tuple(parameters))
        lights = (references or References()).checked(sensor)
        fit = fitted(sensor, levels, known, paths, report, lights, aside)
        return calibrated_model(fit, levels, known)
    levels, loads = checks.checked_measurements(sensor, frames, cast(ArrayLike, forces))
    paths = checked_paths(sensor, tuple(parameters))
    lights = (references or References()).checked(sensor)
    measured = Measurements(sensor, levels, loads, light_basis(sensor.camera.pixels, LIGHTS))
    found = _fitted(with_references(measured, lights), paths, lights, report)
    report("Correcting the columns", 2 * len(STAGES) - 1, 2 * len(STAGES))
    found = _corrected(found, paths)
    model = built(found, paths, len(levels))
    report("Done", 2 * len(STAGES), 2 * len(STAGES))
    return model


def _fitted(
    measured: Measurements, paths: tuple[str, ...], lights: dict[str, Array], report: Progress
) -> CalibrationFit:
    """The fit, in stages of growing phase, and what it leaves out."""
    report("Finding the strip", 0, 2 * len(STAGES))
    sensor, at = measured.sensor, start(measured, len(entries(measured.sensor, paths)))
    sound = ~stuck_pixels(measured.levels, sensor.camera.noise)
    kept = np.ones(len(measured.levels), dtype=bool)
    jacobian = design_jacobian(sensor, paths, at.design)
    at = _placed(measured, at, jacobian, sound)
    for number, limit in enumerate(STAGES):
        chosen = small_phases(measured, at, jacobian, limit)
        report(f"Fitting {chosen.sum()} frames", 1 + number, 2 * len(STAGES))
        fit = levenberg_marquardt(measured.rows(chosen), at, jacobian, sound)
        at = fit.unknowns
        jacobian = relinearised(sensor, paths, at.design, fit.covariance, jacobian)
    fit = levenberg_marquardt(measured, at, jacobian, sound)
    if lights:
        measured = patterned(measured, fit, lights, sound)
        fit = levenberg_marquardt(measured, fit.unknowns, jacobian, sound)
    previous = None
    for number in range(RELINEARISATIONS):
        report(f"Fitting {kept.sum()} frames", min(4 + number, 5), 2 * len(STAGES))
        weight = pixel_weight(measured, fit.unknowns, sound)
        before = measured, kept, sound
        measured, at = improved(measured, fit)
        if previous is jacobian:
            measured = drifting(measured, at, jacobian, weight)
        clear, kept = consistent(measured, at, jacobian, sound)
        sound = sound & clear
        same = measured is before[0] and all(map(np.array_equal, before[1:], (kept, sound)))
        if same and previous is jacobian:
            break
        share, design = 0.5 if number else 1.0, fit.unknowns.design
        previous = jacobian
        jacobian = relinearised(sensor, paths, design, fit.covariance, jacobian, share)
        fit = levenberg_marquardt(measured.rows(kept), at, jacobian, sound)
    return CalibrationFit(measured, fit, sound, kept)


def _corrected(found: CalibrationFit, paths: tuple[str, ...]) -> CalibrationFit:
    """The fit with corrected columns, or the one without if the frames show no error of them."""
    measured = found.measured
    stuck = stuck_pixels(measured.levels, measured.sensor.camera.noise)
    columns = fit_columns(measured, paths, found.fit, stuck, found.kept)
    return columns if columns.posterior.size else found


def _placed(
    measured: Measurements, at: Unknowns, jacobian: DesignJacobian, sound: Mask
) -> Unknowns:
    """The start with the shift under which calm frames fit best."""
    few = measured.rows(small_phases(measured, at, jacobian, STAGES[0]))
    trials = [replace(at, place=np.array([shift, 0.0])) for shift in SHIFTS]
    losses = []
    for trial in trials:
        seen = sound & on_strip(trial.positions(measured.sensor), measured.sensor)
        left = predict(few, trial, jacobian).residuals[:, seen] ** 2
        losses.append(np.minimum(left, 1e3).mean(axis=1).sum())
    return trials[int(np.argmin(losses))]
