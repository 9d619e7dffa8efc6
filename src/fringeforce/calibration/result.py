"""From a fit to a calibrated model: its covariance as modes, and what is to be said of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fringeforce.calibration.bench_loads import loads_on_tactels
from fringeforce.calibration.columns.fit import ColumnFit
from fringeforce.calibration.columns.modes import column_imaging
from fringeforce.calibration.design_entries import POSITIONS, entries, names, units, values, varied
from fringeforce.calibration.findings import findings, unidentified
from fringeforce.calibration.frame_fit import CalibrationFit
from fringeforce.calibration.light.modes import fitted_imaging
from fringeforce.calibration.light.references import pattern_freedom
from fringeforce.calibration.measurements import SHIFT
from fringeforce.calibration.predictions import predict
from fringeforce.models.imaging import Calibration
from fringeforce.models.strip import SensorModel, characterize


def built(found: CalibrationFit, paths: tuple[str, ...], frames: int) -> SensorModel:
    """The calibrated model with its covariance and what is to be said of it.

    Parameters
    ----------
    found : CalibrationFit
        The fit.
    paths : tuple of str
        Dotted paths of the design values that were estimated.
    frames : int
        Measured rows that are frames with loads; the rest are references.
    """
    measured, kept, used = found.measured, found.kept, found.used
    sensor, at, normal = measured.sensor, found.fit.unknowns, found.fit.normal
    model = characterize(varied(sensor, paths, at.design))
    left = predict(measured, at, found.fit.jacobian, used.astype(float)).residuals
    left = left[kept][:, used]
    free = len(at.flat) + pattern_freedom(measured, normal, used) + normal.side.shape[1]
    chi2 = float((left**2).sum()) / (left.size - free)
    covariance = found.fit.covariance * max(chi2, 1.0)
    whole = names(sensor, paths)
    single = np.array([path != POSITIONS for path in entries(sensor, paths)], dtype=bool)
    designs = found.fit.covariance[: len(whole), : len(whole)][np.ix_(single, single)]
    unit = np.concatenate([units(sensor, paths, at.design), [SHIFT, 1.0]])
    count = len(unit)
    drawn = values(sensor, paths, np.zeros(len(whole)))
    reached = values(sensor, paths, at.design)
    calibration = Calibration(
        names=(*whole, "camera shift", "camera scale"),
        drawing=np.append(drawn, [0.0, 1.0]),
        values=np.append(reached, [at.place[0] * SHIFT, 1 + at.place[1]]),
        covariance=covariance[:count, :count] * np.outer(unit, unit),
        unidentified=unidentified(tuple(np.array(whole)[single].tolist()), designs),
        outliers=tuple(np.flatnonzero(~kept[:frames]).tolist()),
        dead=tuple(np.flatnonzero(~found.sound).tolist()),
        chi2=chi2,
        findings=(),
    )
    origin: dict[str, str | int] = {
        "method": "finite elements, calibrated",
        "calibration frames": int(kept[:frames].sum()),
    }
    if not isinstance(found, ColumnFit):
        root = np.asarray(np.linalg.cholesky(covariance), dtype=float)
        imaging = fitted_imaging(measured, found.fit, used, root)
    else:
        imaging = column_imaging(found, used, max(chi2, 1.0))
        correction = found.correction(model.x).reshape(model.psi.shape)
        model = replace(model, psi=model.psi + correction)
        origin |= found.origin
    model = replace(
        model,
        imaging=imaging,
        calibration=calibration,
        provenance={**model.provenance, **origin},
    )
    loads = measured.loads[:frames].reshape(frames, -1, 2)
    known = loads_on_tactels(loads, sensor.tactels.positions[:, None])
    said = findings(model, measured.levels[:frames], known, kept[frames:])
    return replace(model, calibration=replace(calibration, findings=said))
