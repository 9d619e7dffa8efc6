"""What a calibration leaves uncertain of the grey levels, and how far that moves a reading.

Every mode of a calibration is one more unknown e ~ N(0, 1) of the frame.  It is small, so that the
loads are not sought again: the other unknowns, of curvature H, follow it by -H^-1 X e, where X is
the curvature that they share with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.frame_exposure import expose
from fringeforce.estimation.frame_fit import (
    Prior,
    light_information,
    linearise,
    shared_information,
    spread_profiles,
)
from fringeforce.estimation.frame_model import FrameModel, Layout
from fringeforce.models.imaging import Imaging
from fringeforce.models.strip import SensorModel
from fringeforce.models.uncertainty import at_nodes

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class CalibrationUncertainty:
    """Modes of a calibration at the nodes, of unit variance each; k modes.

    Attributes
    ----------
    influence : ndarray, shape (d, m, 2n)
        Changes of the matrix with the first d of them [rad/N].
    brightness, darkness : ndarray, shape (k, m)
        Changes of the amplitude, relative to it, and of the offset, grey levels.
    fields : ndarray, shape (k, m)
        Changes of the phase without load [rad].
    lens : ndarray, shape (k, 2)
        Changes of the blur [pixels] and of the gamma.
    """

    influence: Array
    brightness: Array
    darkness: Array
    fields: Array
    lens: Array

    @classmethod
    def left_in(cls, model: SensorModel) -> CalibrationUncertainty | None:
        """What the calibration of a model leaves uncertain, if there was one."""
        imaging = model.imaging
        if imaging is None or not len(imaging.amplitude_modes):
            return None
        return cls.of(model, imaging)

    @classmethod
    def of(cls, model: SensorModel, imaging: Imaging) -> CalibrationUncertainty:
        """What an imaging of a model states."""
        influence = at_nodes(model, np.moveaxis(imaging.influence_modes, 1, -1))
        columns = influence.reshape(len(influence), -1, influence.shape[-1])
        brightness = at_nodes(model, imaging.amplitude_modes / np.maximum(imaging.amplitude, 1.0))
        phase, lens = imaging.phase_modes, imaging.lens_modes
        pixel = model.sensor.transducer.length / model.sensor.camera.pixels
        return cls(
            np.ascontiguousarray(np.swapaxes(columns, 1, 2)),
            brightness,
            at_nodes(model, imaging.offset_modes),
            np.zeros_like(brightness) if phase is None else at_nodes(model, phase),
            np.zeros((len(brightness), 2)) if lens is None else lens / [pixel, 1.0],
        )

    def covariance(self, model: FrameModel, prior: Prior, unknowns: Array, used: Mask) -> Array:
        """Covariance that the modes add to loads, shape (2n, 2n) [N^2].

        Parameters
        ----------
        model : FrameModel
            Of a frame.
        prior : Prior
            Of its unknowns.
        unknowns : ndarray, shape (size,)
            What explains the frame.
        used : ndarray of bool, shape (P,)
            Pixels that were used.
        """
        at, nodes = model.at, model.fixed.size
        assert not len(model.influence), "a calibrated model has no modes of the matrix itself"
        # blur and gamma are unknowns now, and one mode of no effect makes room for the light
        sizes = np.add(np.diff(at[1:]), np.eye(1, 7, 3, dtype=int)[0])
        sizes[-2:] = 1
        wide = Layout(at.loads, *accumulate(sizes.tolist(), initial=at.loads))
        lens = [model.blur_std or 1.0, model.gamma_std or 1.0]
        none = np.zeros((1, nodes))
        whole = model._replace(
            brightness=np.concatenate([model.brightness, none]),
            darkness=np.concatenate([model.darkness, none]),
            blur_std=lens[0],
            gamma_std=lens[1],
            at=wide,
        )
        own = np.ones(wide.size, dtype=bool)
        own[wide.visibility - 1] = False
        own[wide.blur], own[wide.gamma] = at.gamma > at.blur, at.size > at.gamma
        there, precision, mean = np.zeros((3, wide.size))
        there[own], precision[own], mean[own] = unknowns, prior.precision, prior.mean
        frame = np.where(used, expose(whole, there)[0], np.nan)
        wider = prior._replace(mean=mean, precision=precision, joint=np.empty((0, 0)))
        about = linearise(whole, wider, frame, there)
        hessian = about.hessian + about.cone
        turned = self.fields.copy()
        turned[: len(self.influence)] += np.tensordot(self.influence, unknowns[: at.loads], 1)
        shared = shared_information(whole, about, spread_profiles(whole, there, turned))
        shared += light_information(whole, about, self.brightness, self.darkness)
        shared += hessian[:, [wide.blur, wide.gamma]] @ (self.lens / lens).T
        moved = np.linalg.solve(hessian[np.ix_(own, own)], shared[own])[: at.loads]
        return np.asarray(moved @ moved.T)
