"""What a calibration leaves uncertain of the grey levels, and how far that moves a reading.

Every mode of a calibration is one more unknown e ~ N(0, 1) of the frame.  It is small, so that the
loads are not sought again: the other unknowns, of curvature H, follow it by -H^-1 X e, where X is
the curvature that they share with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.design.light import pairs_of_channels
from fringeforce.estimation.frame_exposure import NARROWEST_BLUR, expose, positive
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.frame_model import FrameModel, Layout
from fringeforce.estimation.linearised_frame import (
    Linearised,
    banded,
    light_information,
    linearise,
    over_channels,
    shared_information,
    spread_profiles,
)
from fringeforce.estimation.shared_fit import FrameTerms
from fringeforce.models.crosstalk import Crosstalk
from fringeforce.models.imaging import Imaging
from fringeforce.models.strip import SensorModel
from fringeforce.models.strip_nodes import at_nodes

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class CalibrationUncertainty:
    """Modes of a calibration at the nodes, of unit variance each; k modes.

    Attributes
    ----------
    influence : ndarray, shape (d, m, 2n)
        Changes of the matrix with the first d of them [rad/N].
    brightness, darkness : ndarray, shape (k, C m)
        Changes of the amplitude, relative to it, and of the offset, grey levels, of all channels in
        turn.
    fields : ndarray, shape (k, m)
        Changes of the phase without load [rad].
    lens : ndarray, shape (k, 2 + l)
        Changes of the blur [pixels], of the gamma, and of what `leaks` are.
    leaks : ndarray, shape (l, C, C + 1)
        Change of the cross-talk of a `FrameModel` with each share that was unknown.
    """

    influence: Array
    brightness: Array
    darkness: Array
    fields: Array
    lens: Array
    leaks: Array

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
        forces = int(np.prod(influence.shape[1:-1]))  # there may be no modes
        columns = influence.reshape(len(influence), forces, influence.shape[-1])
        count, channels = len(imaging.amplitude_modes), len(model.sensor.polariscope.pictures)
        brightness, darkness = (
            at_nodes(model, one.reshape(count, channels, -1)).reshape(count, -1)
            for one in (
                imaging.amplitude_modes / np.maximum(imaging.amplitude, 1.0),
                imaging.offset_modes,
            )
        )
        phase = imaging.phase_modes
        if phase is None:
            phase = np.zeros((count, len(imaging.positions)))
        lens = np.zeros((count, 2)) if imaging.lens_modes is None else imaging.lens_modes
        shares, pairs = imaging.crosstalk_modes, pairs_of_channels(channels)
        stds = {} if shares is None else dict.fromkeys(pairs, 1.0)
        shares = np.zeros((count, 0)) if shares is None else shares
        camera = model.sensor.camera
        pixel = model.sensor.transducer.length / camera.pixels
        power = 1.0 if camera.response in ("linear", "sRGB") else float(camera.response)
        return cls(
            np.ascontiguousarray(np.swapaxes(columns, 1, 2)),
            brightness,
            darkness,
            at_nodes(model, phase),
            np.concatenate([lens * [1 / pixel, power], shares], axis=1),
            Crosstalk.of(model.sensor.polariscope, stds).leaks,
        )

    def covariance(self, model: FrameModel, prior: Prior, unknowns: Array, used: Mask) -> Array:
        """Covariance that the modes add to loads, shape (2n, 2n) [N^2]; as of `terms`."""
        about = self._linearised(model, prior, unknowns, used, None)
        moved = np.linalg.solve(about.own, about.cross)[: model.at.loads]
        return np.asarray(moved @ moved.T)

    def terms(
        self,
        model: FrameModel,
        prior: Prior,
        unknowns: Array,
        used: Mask,
        modes: Array | None = None,
    ) -> FrameTerms:
        """Half the loss of a frame that is as expected; modes are shared, all else is its own.

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
        modes : ndarray, shape (k,), optional
            What the sensor is; as calibrated if not given.
        """
        one = self._linearised(model, prior, unknowns, used, modes)
        weights, bright, dark = one.about.weights, self.brightness, self.darkness
        by_phase, by_bright, by_dark = (
            weights[u, 1] * bright + weights[u, 2] * dark for u in range(3)
        )
        # each pair of phase, light and lens once, then its transpose
        half = (
            one.spread
            @ (banded(one.about, one.spread) / 2 + over_channels(by_phase, one.spread.shape[1])).T
        )
        half += (bright @ by_bright.T + dark @ by_dark.T) / 2
        half += one.lens @ (one.by_lens + one.lens_own @ one.lens.T / 2)
        none = np.zeros(len(half))  # a frame that is as expected pulls nowhere
        return FrameTerms(one.own, one.cross, half + half.T, np.zeros(len(one.own)), none)

    def _linearised(
        self, model: FrameModel, prior: Prior, unknowns: Array, used: Mask, modes: Array | None
    ) -> _About:
        at, loads = model.at, unknowns[: model.at.loads]
        # blur, gamma and shares are unknowns now, and the first mode is what the sensor is
        sizes = np.add(np.diff(at[1:]), [0, 0, 0, 1, 0, 0, 0, len(self.leaks)])
        sizes[-3:-1] = 1
        wide = Layout(at.loads, *accumulate(sizes.tolist(), initial=at.loads))
        scale = np.array([model.blur_std or 1.0, model.gamma_std or 1.0])
        start = 0.0
        blur, slope = model.blur or NARROWEST_BLUR / 2, 1.0
        if at.gamma == at.blur:  # the unknown starts where it makes the blur what it is
            start = blur - NARROWEST_BLUR**2 / (4 * blur)
            slope = positive(start, NARROWEST_BLUR)[1]
            start = (start - model.blur) / scale[0]
        lens = self.lens.copy()
        lens[:, :2] /= scale * [slope, 1.0]
        found = np.zeros(len(self.brightness)) if modes is None else modes
        influence = np.tensordot(found[: len(self.influence)], self.influence, 1)
        first = np.zeros((1, *model.influence.shape[1:]))
        first[0, 0] = influence.T.reshape(first.shape[2:])
        moves = 1 if len(model.moving) else 0  # the first mode moves no contact
        whole = model._replace(
            fixed=model.fixed + found @ self.fields,
            influence=np.concatenate([first, model.influence]),
            moving=np.pad(model.moving, ((moves, 0), (0, 0))),
            origin=np.pad(model.origin, (1 if len(model.origin) else 0, 0)),
            scaling=np.pad(model.scaling, (1 if len(model.scaling) else 0, 0)),
            brightness=np.concatenate([[found @ self.brightness], model.brightness]),
            darkness=np.concatenate([[found @ self.darkness], model.darkness]),
            blur_std=float(scale[0]),
            gamma_std=float(scale[1]),
            leaks=np.concatenate([model.leaks, self.leaks]) if len(self.leaks) else model.leaks,
            at=wide,
        )
        own = np.ones(wide.size, dtype=bool)
        own[wide.modes] = False
        own[wide.blur], own[wide.gamma] = at.gamma > at.blur, at.crosstalk > at.gamma
        pair = [wide.blur, wide.gamma, *range(wide.size - len(self.leaks), wide.size)]
        own[pair[2:]] = False
        there, precision, mean = np.zeros((3, wide.size))
        there[own], precision[own], mean[own] = unknowns, prior.precision, prior.mean
        there[pair] += found @ lens
        there[wide.blur] += start
        there[wide.modes] = 1.0
        frame = np.where(used, expose(whole, there)[0], np.nan)
        wider = prior._replace(mean=mean, precision=precision, joint=np.empty((0, 0)))
        about = linearise(whole, wider, frame, there)
        hessian = about.hessian + about.cone
        turned = self.fields.copy()
        turned[: len(self.influence)] += np.tensordot(self.influence, loads, 1)
        spread = spread_profiles(whole, there, turned)
        shared = shared_information(whole, about, spread)
        shared += light_information(whole, about, self.brightness, self.darkness)
        by_lens = shared[pair]
        shared += hessian[:, pair] @ lens.T
        return _About(
            hessian[np.ix_(own, own)],
            shared[own],
            about,
            spread,
            lens,
            by_lens,
            hessian[np.ix_(pair, pair)],
        )


class _About(NamedTuple):
    """A frame about what explains it: `own` and `cross` as of `FrameTerms`, and what modes do.

    That is the change of the phase at the nodes (k, m) and of the unknowns of lens and shares
    (k, 2 + l), what these have to do with phase and light (2 + l, k), and with themselves.
    """

    own: Array
    cross: Array
    about: Linearised
    spread: Array
    lens: Array
    by_lens: Array
    lens_own: Array
