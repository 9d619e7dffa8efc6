"""What a calibration with corrected columns leaves uncertain, in as few modes as readings need."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fringeforce.calibration.column_fit import ColumnFit
from fringeforce.calibration.frame_fit import SHIFT, Bench, on_strip
from fringeforce.force.bounds import covariance
from fringeforce.imaging import Imaging

Array = NDArray[np.float64]

LEFT_OUT = 0.01
"""Share of what the calibration adds to the readings' variances that need not be kept."""
THINNED = 8
"""Every so many pixels tell which modes matter."""


def column_imaging(
    bench: Bench, found: ColumnFit, scale: float, left_out: float = LEFT_OUT
) -> Imaging:
    """Registration and lighting, with the modes of the covariance that matter.

    Modes are turned so that they show in readings one after the other, which for the loads of the
    calibration itself is an eigenvalue problem; those that add next to nothing are left out.

    Parameters
    ----------
    bench : Bench
        All frames.
    found : ColumnFit
        Design, camera, light and columns.
    scale : float
        Factor of all covariances.
    left_out : float
        Share of what the calibration adds to the readings' variances that need not be kept.
    """
    others = np.concatenate([found.responses, np.linalg.cholesky(found.own)], axis=1).T
    columns = np.zeros((len(others), *found.belief.mean.shape))
    columns[: len(found.belief.modes)] = found.belief.modes
    others, columns = others * np.sqrt(scale), columns * np.sqrt(scale)
    few = _imaging(bench, found, np.arange(0, bench.levels.shape[1], THINNED), others, columns)
    turn = _turned(bench, found, few, left_out)
    every = np.arange(bench.levels.shape[1])
    turned = np.asarray(np.tensordot(turn.T, columns, 1), dtype=float)
    return _imaging(bench, found, every, turn.T @ others, turned)


def _imaging(
    bench: Bench, found: ColumnFit, pixels: NDArray[np.intp], others: Array, columns: Array
) -> Imaging:
    """Imaging of some pixels, with modes of the other unknowns (k, U) and columns (k, 2n, K)."""
    sensor, at, tangent = bench.sensor, found.fit.unknowns, found.fit.tangent
    positions = at.positions(sensor)[pixels]
    basis, response = bench.basis[pixels], at.response(bench).at(pixels)
    slope = tangent.matrix(at.design, positions, slope=True)
    along = np.stack([slope * SHIFT, slope * sensor.pixel_positions[pixels, None]])
    changes = np.concatenate([tangent.at(positions)[1:], along])
    own, bright, dark = np.split(others, np.cumsum([len(changes), len(at.amplitude)]), axis=1)
    modes = np.asarray(np.tensordot(own, changes, 1), dtype=float)
    modes += found.shapes.correction(columns, positions)
    return Imaging(
        positions=positions,
        amplitude=np.asarray(response.amplitude, dtype=float),
        offset=np.asarray(response.offset, dtype=float),
        usable=found.sound[pixels] & on_strip(positions, sensor),
        influence_modes=modes.reshape(*modes.shape[:2], 2, -1),
        amplitude_modes=bright @ basis.T,
        offset_modes=dark @ basis.T,
    )


def _turned(bench: Bench, found: ColumnFit, imaging: Imaging, left_out: float) -> Array:
    """Combinations of modes, in order of what they do to readings, shape (all, kept)."""
    used = imaging.usable
    tangent, design = found.fit.tangent, found.fit.unknowns.design
    influence = tangent.matrix(design, imaging.positions[used])
    response = found.fit.unknowns.response(bench)
    seen = imaging.at(used)
    response = replace(response, amplitude=seen.amplitude, offset=seen.offset)
    total = np.zeros((len(imaging.influence_modes),) * 2)
    for loads in bench.loads[found.kept & (np.abs(bench.loads).max(axis=1) > 0)]:
        phase = influence @ loads
        spread = covariance(phase, influence, response)
        pulled = (seen.level_modes(loads, phase) * response.slope(phase)) @ influence
        moved = pulled @ np.linalg.cholesky(spread) / response.variance
        total += moved @ moved.T
    sizes, turn = np.linalg.eigh(total)
    sizes, turn = np.maximum(sizes[::-1], 0.0), turn[:, ::-1]
    enough = np.searchsorted(np.cumsum(sizes), (1 - left_out) * sizes.sum()) + 1
    return turn[:, :enough]
