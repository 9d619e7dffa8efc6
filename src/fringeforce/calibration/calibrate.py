"""From measured frames with known loads to the model of the sensor on the bench.

Maximum likelihood on raw grey levels: design values through the finite elements, the camera's
place and the lighting, all together.  Phases are never recovered, so small loads do no harm.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.calibration import checks
from fringeforce.calibration.column_fit import ColumnFit, fit_columns
from fringeforce.calibration.column_modes import column_imaging
from fringeforce.calibration.design_tangent import (
    DesignTangent,
    design_tangent,
    design_value,
    followed,
    varied,
)
from fringeforce.calibration.findings import findings, unidentified
from fringeforce.calibration.frame_fit import (
    SHIFT,
    STAGES,
    Bench,
    Fit,
    Unknowns,
    calm,
    climb,
    light_basis,
    on_strip,
    phase_and_matrix,
    residuals,
    start,
)
from fringeforce.design import Sensor
from fringeforce.errors import InputError
from fringeforce.imaging import Calibration, Imaging
from fringeforce.model import SensorModel, characterize

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Progress = Callable[[str, int, int], None]

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
ROUNDS = 10
"""Largest number of tangents of the last stage."""


def calibrate(
    sensor: Sensor,
    frames: ArrayLike,
    forces: ArrayLike,
    parameters: Sequence[str] = PARAMETERS,
    progress: Progress | None = None,
    columns: bool = False,
) -> SensorModel:
    """Make the model agree with the sensor on the bench.

    Estimated together: the chosen design values, the camera's shift and scale along the strip, and
    a smooth amplitude and offset of the light.  Dead pixels and wrong presses are found, left out
    and named in the result's `calibration`; its `imaging` carries the covariance, which readings
    add to their own.

    Parameters
    ----------
    sensor : Sensor
        The drawing; its camera's noise is taken as known.
    frames : array_like, shape (F, n_pixels)
        Grey levels; unloaded frames have zero forces and determine the offset.
    forces : array_like, shape (F, 2, n)
        Known normal and tangential forces [N].
    parameters : sequence of str
        Dotted paths of the design values to estimate.  Young's moduli of both layers and the
        strain-optic coefficient matter only as E_1/E_2 and K_s/E_2: given all three, the
        combination that no frame shows is named and the drawing kept along it.
    progress : callable, optional
        Called with a title, the steps done and the steps expected.
    columns : bool
        Also correct the columns of the influence matrix where no design value can: smooth along
        the strip, and by no more than the frames themselves make probable, which may be nothing.

    Returns
    -------
    SensorModel
        With `imaging` and `calibration`.

    Raises
    ------
    InputError
        If frames and forces do not fit the sensor or each other, or a path cannot be calibrated.
    """
    levels, loads = checks.checked_bench(sensor, frames, forces)
    paths = _checked_paths(sensor, parameters)
    bench = Bench(sensor, levels, loads, light_basis(sensor.camera.pixels, LIGHTS))
    report = progress or (lambda title, done, expected: None)
    found = _fitted(bench, paths, report)
    if columns:
        report("Correcting the columns", 2 * len(STAGES) - 1, 2 * len(STAGES))
        found = _corrected(bench, paths, found)
    model = _built(bench, paths, found)
    report("Done", 2 * len(STAGES), 2 * len(STAGES))
    return model


@dataclass(frozen=True, eq=False)
class _Found:
    fit: Fit
    sound: Mask
    kept: Mask
    columns: ColumnFit | None = None

    def used(self, sensor: Sensor) -> Mask:
        return self.sound & on_strip(self.fit.unknowns.positions(sensor), sensor)


def _checked_paths(sensor: Sensor, parameters: Sequence[str]) -> tuple[str, ...]:
    for path in parameters:
        design_value(sensor, path)
        if path.startswith("camera.") or path in ("transducer.length", "tactels.count"):
            raise InputError(
                f"{path!r} is not calibrated: the camera's shift, scale and light are found "
                "in any case, and a length only by its scale; take other parameters."
            )
    if len(set(parameters)) < len(parameters):
        raise InputError(f"{', '.join(parameters)} name a value twice; name each once.")
    return tuple(parameters)


def _fitted(bench: Bench, paths: tuple[str, ...], report: Progress) -> _Found:
    """The fit, in stages of growing phase, and what it leaves out."""
    report("Finding the strip", 0, 2 * len(STAGES))
    sensor, at = bench.sensor, start(bench, len(paths))
    sound = ~checks.stuck_pixels(bench.levels, sensor.camera)
    kept = np.ones(len(bench.levels), dtype=bool)
    tangent = design_tangent(sensor, paths, at.design)
    at = _placed(bench, at, tangent, sound)
    for number, limit in enumerate(STAGES):
        chosen = calm(bench, at, tangent, limit)
        report(f"Fitting {chosen.sum()} frames", 1 + number, 2 * len(STAGES))
        at = climb(bench.rows(chosen), at, tangent, sound).unknowns
        tangent = followed(sensor, paths, at.design, tangent)
    fit = climb(bench, at, tangent, sound)
    for number in range(ROUNDS):
        report(f"Fitting {kept.sum()} frames", min(4 + number, 5), 2 * len(STAGES))
        left = residuals(bench, fit.unknowns, tangent)
        seen = on_strip(fit.unknowns.positions(sensor), sensor)
        before = kept, sound
        kept = ~checks.misfitting_frames(left[:, sound & seen])
        sound = sound & ~(checks.misfitting_pixels(left[kept]) & seen)
        previous, tangent = tangent, followed(sensor, paths, fit.unknowns.design, tangent)
        if previous is tangent and all(map(np.array_equal, before, (kept, sound))):
            break
        fit = climb(bench.rows(kept), fit.unknowns, tangent, sound)
    return _Found(fit, sound, kept)


def _corrected(bench: Bench, paths: tuple[str, ...], found: _Found) -> _Found:
    """The fit with corrected columns, or the one without if the frames show no error of them."""
    stuck = checks.stuck_pixels(bench.levels, bench.sensor.camera)
    columns = fit_columns(bench, paths, found.fit, stuck, found.kept)
    if columns.belief.size == 0:
        return found
    return _Found(columns.fit, columns.sound, columns.kept, columns)


def _placed(bench: Bench, at: Unknowns, tangent: DesignTangent, sound: Mask) -> Unknowns:
    """The start with the shift under which calm frames fit best."""
    few = bench.rows(calm(bench, at, tangent, STAGES[0]))
    trials = [replace(at, place=np.array([shift, 0.0])) for shift in SHIFTS]
    losses = []
    for trial in trials:
        seen = sound & on_strip(trial.positions(bench.sensor), bench.sensor)
        left = residuals(few, trial, tangent)[:, seen] ** 2
        losses.append(np.minimum(left, 1e3).mean(axis=1).sum())
    return trials[int(np.argmin(losses))]


def _built(bench: Bench, paths: tuple[str, ...], found: _Found) -> SensorModel:
    """The calibrated model with its covariance and what is to be said of it."""
    sensor, at = bench.sensor, found.fit.unknowns
    model = characterize(varied(sensor, paths, at.design))
    used, kept = found.used(sensor), found.kept
    left = residuals(bench, at, found.fit.tangent)[kept][:, used]
    chi2 = float((left**2).sum()) / (left.size - len(at.flat))
    covariance = found.fit.covariance * max(chi2, 1.0)
    designs = found.fit.covariance[: len(paths), : len(paths)]
    unit = np.concatenate([np.ones(len(paths)), [SHIFT, 1.0]])
    entries = len(unit)
    drawing = np.array([design_value(sensor, path) for path in paths])
    calibration = Calibration(
        names=(*paths, "camera shift", "camera scale"),
        drawing=np.append(drawing, [0.0, 1.0]),
        values=np.append(drawing * np.exp(at.design), [at.place[0] * SHIFT, 1 + at.place[1]]),
        covariance=covariance[:entries, :entries] * np.outer(unit, unit),
        unidentified=unidentified(paths, designs),
        outliers=tuple(np.flatnonzero(~kept).tolist()),
        dead=tuple(np.flatnonzero(~found.sound).tolist()),
        chi2=chi2,
        findings=(),
    )
    origin = {"method": "finite elements, calibrated", "calibration frames": int(kept.sum())}
    if found.columns is None:
        imaging = _imaging(bench, found, np.asarray(np.linalg.cholesky(covariance), float))
        psi = model.psi
    else:
        imaging = column_imaging(bench, found.columns, max(chi2, 1.0))
        psi = model.psi + found.columns.correction(model.x).reshape(model.psi.shape)
        origin |= found.columns.origin
    model = replace(
        model,
        psi=psi,
        imaging=imaging,
        calibration=calibration,
        provenance={**model.provenance, **origin},
    )
    return replace(model, calibration=replace(calibration, findings=findings(bench, model)))


def _imaging(bench: Bench, found: _Found, root: Array) -> Imaging:
    """Registration and lighting, with the modes of a covariance given by its lower root."""
    at, tangent = found.fit.unknowns, found.fit.tangent
    positions, lights = at.positions(bench.sensor), bench.basis.shape[1]
    _, parts = phase_and_matrix(bench, at, tangent)
    slope = tangent.matrix(at.design, positions, slope=True)
    along = np.stack([slope * SHIFT, slope * bench.sensor.pixel_positions[:, None]])
    changes = np.concatenate([parts[1:], along])
    count = len(changes)
    response = at.response(bench)
    # the root is lower triangular: only the first modes move the unknowns that come first
    modes = np.tensordot(root[:count, :count].T, changes, 1)
    return Imaging(
        positions=positions,
        amplitude=np.asarray(response.amplitude, dtype=float),
        offset=np.asarray(response.offset, dtype=float),
        usable=found.used(bench.sensor),
        influence_modes=modes.reshape(*modes.shape[:2], 2, -1),
        amplitude_modes=root[count : count + lights].T @ bench.basis.T,
        offset_modes=root[count + lights :].T @ bench.basis.T,
    )
