"""What is known of a sensor before the next press: from its drawing, or from a calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.calibration.calibrate import LIGHTS, PARAMETERS, checked_paths
from fringeforce.calibration.design_tangent import design_value
from fringeforce.calibration.unknowns import (
    SHIFT,
    Presses,
    Unknowns,
    light_basis,
    on_strip,
    precision,
    start,
)
from fringeforce.design import Sensor
from fringeforce.errors import InputError
from fringeforce.imaging import Calibration, Imaging
from fringeforce.model import SensorModel

Array = NDArray[np.float64]

TOLERANCE = 0.1
"""Relative deviation that a drawing's values are trusted to when the truth is imagined."""


@dataclass(frozen=True, eq=False)
class Knowledge:
    """Estimate and covariance of all unknowns of a calibration.

    Attributes
    ----------
    sensor : Sensor
        As drawn, or as calibrated.
    paths : tuple of str, length d
        Design values that are unknown.
    basis : ndarray, shape (P, k)
        Functions that make up the lighting.
    unknowns : Unknowns
        The estimate; design values are relative to the sensor, so their logarithms are zero.
    root : ndarray, shape (u, u)
        Lower root of the covariance of all unknowns.
    used : ndarray of bool, shape (P,)
        Pixels that can be used.
    """

    sensor: Sensor
    paths: tuple[str, ...]
    basis: Array
    unknowns: Unknowns
    root: Array
    used: NDArray[np.bool_]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of design values and of the camera's place."""
        return (*self.paths, "camera shift", "camera scale")

    @property
    def values(self) -> Array:
        """Values of what is named, in their own units."""
        design = [design_value(self.sensor, path) for path in self.paths]
        shift, scale = self.unknowns.place
        return np.array([*design, shift * SHIFT, 1 + scale])

    @property
    def units(self) -> Array:
        """What a unit of the unknowns is in the values' own units."""
        return np.array([*np.abs(self.values[:-2]), SHIFT, 1.0])

    def presses(self, loads: Array) -> Presses:
        """Presses of loads (F, 2, n) on this sensor."""
        return Presses(self.sensor, loads.reshape(len(loads), -1), self.basis)

    def imagined(self, pairs: int) -> list[Unknowns]:
        """The estimate, and designs that scatter about it as what is known allows.

        Drawings are trusted to TOLERANCE here: the wide prior of the fit is meant to leave all to
        the frames and not to describe a workshop.
        """
        d = len(self.paths)
        known = np.linalg.inv(self.root[:d, :d] @ self.root[:d, :d].T)
        root = np.linalg.cholesky(np.linalg.inv(known + np.eye(d) / TOLERANCE**2))
        rest = np.zeros(len(self.root) - d)
        steps = np.random.default_rng(0).standard_normal((pairs, d)) @ root.T
        return [
            self.unknowns,
            *(self.unknowns.moved(np.append(s, rest)) for step in steps for s in (step, -step)),
        ]


def knowledge(source: Sensor | SensorModel, parameters: Sequence[str] | None = None) -> Knowledge:
    """What a drawing or a calibrated model says of all unknowns.

    Parameters
    ----------
    source : Sensor or SensorModel
        A model that was never calibrated says what its drawing says.
    parameters : sequence of str, optional
        Dotted paths of design values to estimate; those of `calibrate`, or of the model's own
        calibration, if not given.

    Raises
    ------
    InputError
        If a path cannot be calibrated, or differs from those of the model's calibration.
    """
    sensor = source if isinstance(source, Sensor) else source.sensor
    basis = light_basis(sensor.camera.pixels, LIGHTS)
    if isinstance(source, SensorModel) and source.calibration and source.imaging:
        paths = source.calibration.names[:-2]
        if parameters is not None and set(parameters) != set(paths):
            raise InputError(
                f"The model was calibrated in {', '.join(paths)}; its covariance says nothing of "
                "others. Leave the parameters out, or plan from the drawing."
            )
        return _of_calibration(sensor, source.calibration, source.imaging, basis)
    paths = checked_paths(sensor, PARAMETERS if parameters is None else parameters)
    presses = Presses(sensor, np.empty((0, 2 * sensor.tactels.count)), basis)
    unknowns = start(presses, len(paths))
    root = np.diag(1 / np.sqrt(precision(presses, len(paths))))
    used = on_strip(unknowns.positions(sensor), sensor)
    return Knowledge(sensor, paths, basis, unknowns, root, used)


def _of_calibration(
    sensor: Sensor, found: Calibration, imaging: Imaging, basis: Array
) -> Knowledge:
    """Estimate and covariance behind a calibrated model; its modes are the covariance's root."""
    count, lights = len(found.names), basis.shape[1]
    unit = np.concatenate([np.ones(count - 2), [SHIFT, 1.0]])
    root = np.zeros((count + 2 * lights,) * 2)
    root[:count, :count] = np.linalg.cholesky(found.covariance / np.outer(unit, unit))
    modes = [imaging.amplitude_modes, imaging.offset_modes]
    root[count:] = np.concatenate([_coefficients(basis, mode.T) for mode in modes])
    unknowns = Unknowns(
        design=np.zeros(count - 2),
        place=np.array([found.values[-2] / SHIFT, found.values[-1] - 1]),
        amplitude=_coefficients(basis, imaging.amplitude),
        offset=_coefficients(basis, imaging.offset),
    )
    return Knowledge(sensor, found.names[:-2], basis, unknowns, root, imaging.usable)


def _coefficients(basis: Array, values: Array) -> Array:
    """What smooth functions along the frame are made of, shape (k, ...)."""
    return np.asarray(np.linalg.lstsq(basis, values, rcond=None)[0], float)
