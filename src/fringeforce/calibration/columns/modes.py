"""What a calibration with corrected columns leaves uncertain, in as few modes as readings need."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.calibration.columns.fit import ColumnFit
from fringeforce.calibration.light.modes import fitted_imaging
from fringeforce.calibration.normal_equations import EVERY
from fringeforce.estimation.bounds import covariance
from fringeforce.models.imaging import Imaging

LEFT_OUT = 0.01
"""Share of what the calibration adds to the readings' variances that need not be kept."""
THINNED = 8
"""Every so many pixels tell which modes matter."""


def column_imaging(
    found: ColumnFit, used: Mask, scale: float, left_out: float = LEFT_OUT
) -> Imaging:
    """Registration and lighting, with the modes of the covariance that matter.

    Modes are turned so that they show in readings one after the other, which for the loads of the
    calibration itself is an eigenvalue problem; those that add next to nothing are left out.

    Parameters
    ----------
    found : ColumnFit
        Design, camera, light and columns.
    used : ndarray of bool, shape (P,)
        Pixels that are sound and see the strip.
    scale : float
        Factor of all covariances.
    left_out : float
        Share of what the calibration adds to the readings' variances that need not be kept.
    """
    others = np.concatenate([found.responses, np.linalg.cholesky(found.own)], axis=1)
    columns = np.zeros((others.shape[1], *found.posterior.mean.shape))
    columns[: len(found.posterior.modes)] = found.posterior.modes
    others, columns = others * np.sqrt(scale), columns * np.sqrt(scale)
    few = _imaging(found, used, others, columns, slice(None, None, THINNED))
    turn = _turned(found, few, left_out)
    turned = np.asarray(np.tensordot(turn.T, columns, 1), dtype=float)
    return _imaging(found, used, others @ turn, turned, EVERY)


def _imaging(found: ColumnFit, used: Mask, others: Array, columns: Array, pixels: slice) -> Imaging:
    """Imaging of some pixels, with modes of the other unknowns (m, k) and columns (k, 4n, K)."""
    positions = found.fit.unknowns.positions(found.measured.sensor)[pixels]
    corrections = found.shapes.correction(columns, positions)
    return fitted_imaging(found.measured, found.fit, used, others, corrections, pixels)


def _turned(found: ColumnFit, imaging: Imaging, left_out: float) -> Array:
    """Combinations of modes, in order of what they do to readings, shape (all, kept)."""
    measured, used = found.measured, imaging.usable
    jacobian, design = found.fit.jacobian, found.fit.unknowns.design
    influence = jacobian.matrix(design, imaging.positions[used])
    response = found.fit.unknowns.response(measured)
    seen = imaging.at(used)
    response = replace(response, amplitude=seen.amplitude, offset=seen.offset)
    total = np.zeros((len(imaging.influence_modes),) * 2)
    for loads in measured.loads[found.kept & (np.abs(measured.loads).max(axis=1) > 0)]:
        phase = influence @ loads
        spread = covariance(phase, influence, response)
        pulled = (seen.level_modes(loads, phase) * response.slope(phase)) @ influence
        moved = pulled @ np.linalg.cholesky(spread) / response.variance
        total += moved @ moved.T
    sizes, turn = np.linalg.eigh(total)
    sizes, turn = np.maximum(sizes[::-1], 0.0), turn[:, ::-1]
    enough = np.searchsorted(np.cumsum(sizes), (1 - left_out) * sizes.sum()) + 1
    return turn[:, :enough]
