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
from fringeforce.estimation.frame_fit import Prior, linearise
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
    influence : ndarray, shape (d, 1, n, 2, m)
        Changes of the matrix with the first d of them [rad/N].
    brightness, darkness : ndarray, shape (k, m)
        Changes of the amplitude, relative to it, and of the offset, grey levels.
    fields : ndarray, shape (k, m)
        Changes of the phase without load [rad].
    """

    influence: Array
    brightness: Array
    darkness: Array
    fields: Array

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
        brightness = at_nodes(model, imaging.amplitude_modes / np.maximum(imaging.amplitude, 1.0))
        phase = imaging.phase_modes
        return cls(
            influence[:, None],
            brightness,
            at_nodes(model, imaging.offset_modes),
            np.zeros_like(brightness) if phase is None else at_nodes(model, phase),
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
        at, count = model.at, len(self.brightness)
        modes = at.visibility - at.modes
        sizes = np.add(np.diff(at[1:]), [0, 0, count, count, 0, 0, 0])
        wide = Layout(at.loads, *accumulate(sizes.tolist(), initial=at.loads))
        whole = model._replace(
            fields=np.concatenate([model.fields, self.fields]),
            influence=self.influence,
            brightness=np.concatenate([self.brightness, model.brightness]),
            darkness=np.concatenate([self.darkness, model.darkness]),
            at=wide,
        )
        fields = np.arange(at.modes, at.modes + count)
        turned = np.arange(wide.modes, wide.modes + count)
        own = np.delete(np.arange(wide.size), np.concatenate([fields, turned]))
        there, precision, mean = np.zeros((3, wide.size))
        there[own], precision[own], mean[own] = unknowns, prior.precision, prior.mean
        assert len(model.influence) == 0 or modes == 0, "a calibrated model has no design modes"
        frame = np.where(used, expose(whole, there)[0], np.nan)
        wider = prior._replace(mean=mean, precision=precision, joint=np.empty((0, 0)))
        about = linearise(whole, wider, frame, there)
        hessian = about[0] + about[2]
        shared = hessian[np.ix_(own, turned)] + hessian[np.ix_(own, fields)]
        moved = np.linalg.solve(hessian[np.ix_(own, own)], shared)[: at.loads]
        return np.asarray(moved @ moved.T)
