"""Registration and lighting of a fit, with its covariance as modes that readings understand."""

from __future__ import annotations

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.calibration.frame_fit import FrameFit
from fringeforce.calibration.light.references import pattern_response, pattern_variance
from fringeforce.calibration.measurements import Measurements
from fringeforce.calibration.normal_equations import EVERY, matrix_changes
from fringeforce.models.imaging import Imaging


def fitted_imaging(
    measured: Measurements,
    fit: FrameFit,
    used: Mask,
    modes: Array,
    columns: Array | None = None,
    pixels: slice = EVERY,
) -> Imaging:
    """Imaging of a fit.

    Parameters
    ----------
    measured : Measurements
        All rows.
    fit : FrameFit
        Fit of the rows that were kept.
    used : ndarray of bool, shape (P,)
        Pixels that are sound and see the strip.
    modes : ndarray, shape (m, k)
        Changes of the shared unknowns.  Without columns only as many of the first may move
        the matrix as there are unknowns that do.
    columns : ndarray, shape (k, p, 2n), optional
        What they change in the columns besides [rad/N].
    pixels : slice
        The p pixels that are wanted.
    """
    at, normal = fit.unknowns, fit.normal
    changes = matrix_changes(measured, at, fit.jacobian, pixels)
    count, lights = len(changes), measured.basis.shape[1]
    moving = modes[:count] if columns is not None else modes[:count, :count]
    influence = np.asarray(np.tensordot(moving.T, changes, 1), dtype=float)
    if columns is not None:
        influence += columns
    basis, response = measured.basis[pixels], at.response(measured).at(pixels)
    follow = pattern_response(measured, normal, modes, columns, pixels)
    bright, dark = modes[count : count + lights], modes[count + lights :]
    return Imaging(
        positions=at.positions(measured.sensor)[pixels],
        amplitude=np.asarray(response.amplitude, dtype=float),
        offset=np.asarray(response.offset, dtype=float),
        usable=used[pixels],
        influence_modes=influence.reshape(*influence.shape[:2], -1, 2),
        amplitude_modes=bright.T @ basis.T + follow[0],
        offset_modes=dark.T @ basis.T + follow[1],
        light_variance=pattern_variance(measured, normal, used),
        drift=measured.drift,
    )
