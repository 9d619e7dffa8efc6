"""What drifted on a bench since its calibration, from frames whose loads nobody knows.

Light, residual and the camera's place change; layers and materials do not.  All of them are modes
beside those that the calibration left uncertain, and every frame adds what it tells of them once
its own unknowns are eliminated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.design.tolerances import Tolerances, with_values
from fringeforce.estimation.posterior import Posterior, Top
from fringeforce.estimation.residual_test import square_limit
from fringeforce.models.as_built import RESIDUAL
from fringeforce.models.imaging import Imaging
from fringeforce.models.strip import SensorModel
from fringeforce.models.uncertainty import DRIFTS, Uncertainty
from fringeforce.reading.strip_reader import StripFrameReader

CAMERA = "camera.shift", "camera.scale"
UNEVEN = "camera.unevenness"
LIGHT = "camera.amplitude", UNEVEN
FORCES = (
    "How large forces are, only known loads tell: that stays as the calibration found it, with its "
    "deviation."
)
ROUNDS = 6
"""Most times that the model is moved to what the frames say of it."""
SETTLED = 0.1
"""Length of a move, in standard deviations of all unknowns together, below which it is the last."""
EXPLAINED = 0.9
"""Share of the frames that must be explained for the model to be used."""
NOTHING = 1e8
"""Factor on the precision of loads where there are none."""
TOLD = 0.9
"""Standard deviation over that before any frame, above which frames told nothing."""
ATTEMPTS = 8
"""Starts of the search of a frame that is not explained."""


@dataclass(frozen=True)
class Drift:
    """How far a bench may have drifted since its calibration, one standard deviation each.

    Attributes
    ----------
    light : float
        Of the amplitude over itself, even and uneven alike.
    offset : float
        Of the light that fringes do not modulate, over the amplitude.
    residual : float
        Of the retardance without load, smooth along the strip [rad].
    shift : float
        Of the camera along the strip [m].
    scale : float
        Of the camera's magnification, relative.

    Examples
    --------
    >>> ff.Drift(light=0.1).light
    0.1
    """

    light: float = 0.05
    offset: float = 0.01
    residual: float = 0.1
    shift: float = 0.1e-3
    scale: float = 1e-3

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value >= 0):
                raise InputError(
                    f"Drift({name}={value}): a standard deviation is finite and not negative."
                )


def update(
    model: SensorModel,
    frames: ArrayLike,
    *,
    unloaded: bool = False,
    drift: Drift | None = None,
    progress: Progress | None = None,
) -> SensorModel:
    """Bring a calibrated model up to date with frames whose loads nobody wrote down.

    The calibration is the prior; light, residual and the camera's shift and scale may have drifted
    from it.  Frames without loads tell of all of these but the shift and the scale; frames under
    unknown loads tell of these too, as loads of many frames fit one sensor.  None of them tells how
    large forces are: what the calibration says of that stays, with its deviation.

    Parameters
    ----------
    model : SensorModel
        Calibrated, of a strip; one with a skin takes unloaded frames.
    frames : array_like, shape (F, n_pixels)
        Grey levels.
    unloaded : bool
        Whether nothing touches the strip in any of them; otherwise loads are found with the rest.
    drift : Drift, optional
        What may have changed, and by how much.
    progress : callable, optional
        Called with a title, the steps done and the steps expected.

    Returns
    -------
    SensorModel
        With `imaging` brought up to date, and `calibration` with findings that say what changed,
        and with `usable` false where the frames are not explained.

    Raises
    ------
    InputError
        If the model was not calibrated, or frames do not fit it.

    Examples
    --------
    >>> drawing = ff.load_sensor("saad")
    >>> made = ff.characterize(drawing)
    >>> presses = np.random.default_rng(0).uniform(0.1, 1.5, (6, 11, 2)) * [1.0, 0.2]
    >>> path = "transducer.photoelastic.strain_optic_coefficient"
    >>> calibrated = ff.calibrate(drawing, made.expose(presses, rng=0), presses, [path])
    >>> dimmer = ff.characterize(drawing.replace(**{"camera.amplitude": 220.0}))
    >>> later = ff.update(calibrated, dimmer.expose(np.zeros((4, 11, 2)), rng=1), unloaded=True)
    >>> print(later.calibration.findings[-1])
    How large forces are, only known loads tell: that stays as the calibration found it, with its
    deviation.
    """
    report = progress or (lambda title, done, expected: None)
    levels = _checked(model, frames, unloaded)
    assert model.imaging is not None
    drifting = _drifting(model, drift or Drift())
    state = _State(drifting, levels, unloaded)
    for number in range(ROUNDS):
        report(f"Finding what drifted in {len(levels)} frames", number, ROUNDS)
        if state.improve():
            break
    signed = True
    for shared in state.images() if unloaded else ():
        other = _State(drifting, levels, unloaded, shared)
        any(other.improve() for _ in range(ROUNDS))
        signed &= abs(other.loss - state.loss) > square_limit(1)
        state = min(state, other, key=lambda one: one.loss)
    report("Done", ROUNDS, ROUNDS)
    return _updated(model, state, signed)


def _checked(model: SensorModel, frames: ArrayLike, unloaded: bool) -> Array:
    if model.imaging is None or model.calibration is None:
        raise InputError(
            "update takes the calibrated model of a strip; this one is as drawn. Calibrate it "
            "first."
        )
    if model.sensor.skin is not None and not unloaded:
        raise InputError(
            "A skin is brought up to date with frames without load; take such frames and say so, "
            "unloaded=True."
        )
    levels = np.atleast_2d(np.asarray(frames, dtype=float))
    pixels = len(model.imaging.positions)
    if levels.ndim != 2 or levels.shape[1] != pixels or not len(levels):
        raise InputError(
            f"Frames of shape {np.shape(frames)} are not rows of {pixels} pixels, as the model's."
        )
    if not np.isfinite(levels).all():
        raise InputError("Frames hold values that are not finite; leave those frames out.")
    return levels


def _drifting(model: SensorModel, drift: Drift) -> SensorModel:
    """The model with tolerances of all that may drift, one by one in every frame."""
    sensor = model.sensor
    stds = {
        "camera.amplitude": drift.light * sensor.camera.amplitude,
        "camera.offset": drift.offset * sensor.camera.amplitude,
        RESIDUAL: drift.residual,
        "camera.shift": drift.shift,
        "camera.scale": drift.scale,
    }
    stated = {**sensor.tolerances, **{path: std for path, std in stds.items() if std}}
    uneven = with_values(sensor, {UNEVEN: drift.light})
    return replace(model, sensor=uneven.model_copy(update={"tolerances": Tolerances(stated)}))


class _Rows(NamedTuple):
    """What the unknowns that all frames share change, those of the matrix first; S unknowns.

    Attributes
    ----------
    names : tuple of str
        Dotted paths of the values that they are parts of.
    where : ndarray of int, shape (S,)
        Where they stand among the unknowns of a frame.
    influence : ndarray, shape (d, P, n, 2)
        Changes of the matrix at the pixels with the first d [rad/N].
    brightness, darkness, fields : ndarray, shape (S, P)
        Changes of the amplitude, relative to it, of the offset, and of the phase [rad].
    camera : ndarray, shape (S, 2)
        Changes of the shift [m] and of the scale of the camera.
    """

    names: tuple[str, ...]
    where: NDArray[np.int64]
    influence: Array
    brightness: Array
    darkness: Array
    fields: Array
    camera: Array

    @classmethod
    def of(cls, uncertain: Uncertainty) -> _Rows:
        frame, at = uncertain.frame, uncertain.frame.at
        modes = [m for m, one in enumerate(uncertain.modes) if one.name not in DRIFTS]
        fields = at.modes - at.fields
        nodes = frame.first[:, None] + np.arange(4)
        where = np.append(at.modes + np.array(modes, dtype=int), np.arange(at.fields, at.modes))

        def pixels(rows: Array) -> Array:
            return np.einsum("...pk,pk->...p", rows[..., nodes], frame.weights)

        light = [pixels(rows[modes]) for rows in (frame.brightness, frame.darkness)]
        camera = np.zeros((len(where), 2))
        for row, m in enumerate(modes):
            one = uncertain.modes[m]
            if one.name in CAMERA:
                camera[row, CAMERA.index(one.name)] = one.std
        bright, dark = (np.pad(rows, [(0, fields), (0, 0)]) for rows in light)
        residual = np.pad(pixels(frame.fields), [(len(modes), 0), (0, 0)])
        influence = np.moveaxis(pixels(frame.influence[:, 0]), -1, 1)
        names = *(uncertain.modes[m].name for m in modes), *[RESIDUAL] * fields
        return cls(names, where, influence, bright, dark, residual, camera)

    def moved(self, imaging: Imaging, shared: Array) -> Imaging:
        """An imaging that has drifted by so much."""
        shift, scale = shared @ self.camera
        residual = 0.0 if imaging.residual is None else imaging.residual
        return replace(
            imaging,
            positions=imaging.positions * (1 + scale) + shift,
            amplitude=imaging.amplitude * (1 + shared @ self.brightness),
            offset=imaging.offset + shared @ self.darkness,
            residual=residual + shared @ self.fields,
        )


class _State:
    """What the frames say of the drift so far."""

    def __init__(
        self, model: SensorModel, levels: Array, unloaded: bool, shared: Array | None = None
    ) -> None:
        self.origin, self.levels, self.unloaded = model, levels, unloaded
        self.rows = _Rows.of(StripFrameReader(model).uncertain)
        self.shared = np.zeros(len(self.rows.where)) if shared is None else shared
        self.information = np.eye(len(self.shared))
        self.explained = np.zeros(len(levels), dtype=bool)
        self.loss, self.near = np.inf, shared is not None

    @property
    def model(self) -> SensorModel:
        """The sensor as found so far."""
        assert self.origin.imaging is not None
        return replace(self.origin, imaging=self.rows.moved(self.origin.imaging, self.shared))

    def improve(self) -> bool:
        """Move the model to where all frames agree; whether that was little.

        At first every frame is read with a drift of its own, then all with the one found so far:
        from a drift d, gradient g with its prior and Schur complement K of a frame, its likelihood
        has the gradient g - (1 + K) d where the model is.
        """
        reader = StripFrameReader(self.model)
        rows = self.rows = _Rows.of(reader.uncertain)
        unity = np.eye(len(self.shared))
        self.information, slope = unity.copy(), self.shared.copy()
        self.loss = float(self.shared @ self.shared)
        for number, frame in enumerate(self.levels):
            posterior, top = self._found(reader, frame)
            readable = top.square <= square_limit(top.count)
            if self.near:
                top = self._pinned(posterior, top)
            self.explained[number] = top.square <= square_limit(top.count)
            self.loss += top.loss
            if not readable:
                continue
            about = posterior.linearised(top)
            hessian = about.hessian + about.cone
            own = np.setdiff1d(np.arange(len(hessian)), rows.where)
            cross = hessian[np.ix_(own, rows.where)]
            response = np.linalg.solve(hessian[np.ix_(own, own)], cross)
            told = hessian[np.ix_(rows.where, rows.where)] - unity - cross.T @ response
            self.information += told
            slope += about.gradient[rows.where] - response.T @ about.gradient[own]
            slope -= (told + unity) @ top.unknowns[rows.where]
        step = -np.linalg.solve(self.information, slope)
        self.shared = self.shared + step
        short = bool(np.sqrt(step @ self.information @ step) < SETTLED)
        self.near, before = True, self.near
        return before and short

    def _pinned(self, posterior: Posterior, top: Top) -> Top:
        """What explains a frame best without any drift of its own."""
        precision, start = posterior.prior.precision.copy(), top.unknowns.copy()
        precision[self.rows.where] *= NOTHING
        start[self.rows.where] = 0.0
        alone = replace(posterior, prior=posterior.prior._replace(precision=precision))
        return alone.climbed(start, heats=())

    def images(self) -> Iterator[Array]:
        """Shared unknowns under which the residual has the other sign.

        Everywhere, and in each stretch between its zeros.  Without load, light tells a phase from
        its negative by no more than how smooth it is.
        """
        imaging = self.model.imaging
        assert imaging is not None
        assert imaging.residual is not None
        used, rows = imaging.usable, self.rows.fields
        stretch = np.cumsum(np.diff(np.sign(imaging.residual), prepend=0.0) != 0)
        seen = np.unique(stretch[used])
        for own in (seen, *(seen[k : k + 1] for k in range(len(seen) if len(seen) > 1 else 0))):
            turned = -2 * imaging.residual * np.isin(stretch, own)
            field = np.flatnonzero(rows.any(axis=1))
            known = rows[np.ix_(field, used)]
            # as near as the modes come, to a hundredth of a radian
            gram = known @ known.T + 1e-4 * used.sum() * np.eye(len(field))
            shared = self.shared.copy()
            shared[field] += np.linalg.solve(gram, known @ turned[used])
            yield shared

    def _found(self, reader: StripFrameReader, frame: Array) -> tuple[Posterior, Top]:
        """What explains a frame best."""
        used = reader.usable_pixels
        posterior = reader.own_posterior(np.where(used, frame, np.nan))
        if self.unloaded:
            precision = posterior.prior.precision.copy()
            precision[: posterior.model.at.loads] *= NOTHING
            alone = replace(posterior, prior=posterior.prior._replace(precision=precision))
            return alone, alone.climbed(np.zeros(posterior.model.at.size))
        located = reader.followed(frame, used, None)[1]
        if located is not None:
            return located
        posterior, tops = reader.explanations(posterior.frame, ATTEMPTS, mend=True)
        nothing = posterior.climbed(np.zeros(posterior.model.at.size))
        return posterior, tops[0] if tops else nothing


class _Told(NamedTuple):
    """What frames tell of one thing that may drift.

    Attributes
    ----------
    name, unit, digits : str
        For a sentence.
    paths : tuple of str
        Values of the design that it is.
    change, std, before : float
        Its change, in the unit, and standard deviation after the frames and before.
    signed : bool
        Whether frames tell its sign.
    """

    name: str
    unit: str
    digits: str
    paths: tuple[str, ...]
    change: float
    std: float
    before: float
    signed: bool = True

    @property
    def known(self) -> bool:
        """Whether frames tell of it."""
        return self.signed and self.std < TOLD * self.before

    def __str__(self) -> str:
        if not self.signed:
            return (
                f"{self.name}: unloaded frames tell its size, but not its sign; readings allow for "
                "both."
            )
        if not self.known:
            return (
                f"{self.name}: these frames do not tell whether it changed; readings allow for it."
            )
        change, std = f"{self.change:+{self.digits}}", f"{self.std:{self.digits}}"
        return f"{self.name} changed by {change}{self.unit} (standard deviation {std})."


def _told(state: _State, used: Mask, signed: bool) -> list[_Told]:
    """What the frames tell of each thing that may drift."""
    rows, covariance = state.rows, np.linalg.inv(state.information)
    residual = rows.fields[:, used]
    most = int(np.abs(state.shared @ residual).argmax())
    light = rows.brightness[:, used].mean(axis=1) * 100

    def told(name: str, unit: str, digits: str, paths: tuple[str, ...], change: Array) -> _Told:
        std = float(np.sqrt(change @ covariance @ change))
        by, before = float(change @ state.shared), float(np.linalg.norm(change))
        return _Told(name, unit, digits, paths, by, std, before)

    found = (
        told("The light", " %", ".1f", LIGHT, light),
        told("The residual", " rad where it changed most", ".2f", (RESIDUAL,), residual[:, most]),
        told("The camera's place", " mm", ".3f", CAMERA[:1], rows.camera[:, 0] * 1e3),
        told("The camera's scale", " %", ".3f", CAMERA[1:], rows.camera[:, 1] * 100),
    )
    found = (found[0], found[1]._replace(signed=signed), *found[2:])
    return [one for one in found if one.before]


def _updated(model: SensorModel, state: _State, signed: bool) -> SensorModel:
    """The model as found, with what is left uncertain and words on what changed.

    What frames do not tell of stays where the calibration found it, as a tolerance of the model,
    which every reading estimates.
    """
    assert model.imaging is not None
    assert model.calibration is not None
    before, rows, found = model.imaging, state.rows, model.calibration
    told = _told(state, before.usable, signed)
    left = {path for one in told if not one.known for path in one.paths}
    kept = np.array([name not in left for name in rows.names])
    covariance = np.linalg.inv(state.information)
    shared = state.shared.copy()
    if left:  # as they are if nothing of the rest had changed
        shared -= covariance[:, ~kept] @ np.linalg.solve(
            covariance[np.ix_(~kept, ~kept)], shared[~kept]
        )
    shared[~kept] = 0.0
    root = np.zeros((len(kept), int(kept.sum())))
    root[kept] = np.linalg.cholesky(covariance[np.ix_(kept, kept)])
    moving, known = int(kept[: len(rows.influence)].sum()), len(before.influence_modes)
    moved = rows.moved(before, shared)

    def among(old: Array | None, new: Array) -> Array:
        """Modes of the calibration and of the drift, those of the matrix first."""
        own = np.zeros((len(before.amplitude_modes), new.shape[1])) if old is None else old
        return np.concatenate([own[:known], new[:moving], own[known:], new[moving:]])

    influence = np.tensordot(root[: len(rows.influence), :moving].T, rows.influence, 1)
    imaging = replace(
        moved,
        influence_modes=np.concatenate([before.influence_modes, influence]),
        amplitude_modes=among(before.amplitude_modes, moved.amplitude * (root.T @ rows.brightness)),
        offset_modes=among(before.offset_modes, root.T @ rows.darkness),
        phase_modes=among(before.phase_modes, root.T @ rows.fields),
        lens_modes=among(before.lens_modes, np.zeros((root.shape[1], 2))),
    )
    at = [found.names.index(name.replace(".", " ")) for name in CAMERA]
    change, values = np.zeros((len(found.names), root.shape[1])), found.values.copy()
    change[at] = rows.camera.T @ root
    values[at] += rows.camera.T @ shared
    old = found.modes
    if old is None:  # the first modes are those of the values
        old = np.asarray(np.linalg.cholesky(found.covariance), dtype=float)
        old = np.pad(old, [(0, 0), (0, len(before.amplitude_modes) - len(old))])
    calibration = replace(
        found,
        values=values,
        covariance=found.covariance + change @ change.T,
        modes=among(old.T, change.T).T,
        outliers=tuple(np.flatnonzero(~state.explained).tolist()),
        usable=bool(state.explained.mean() >= EXPLAINED),
        record=None,
        findings=(*_missed(state), *map(str, told), FORCES),
    )
    drifting = state.origin.sensor
    sensor = with_values(
        model.sensor, {UNEVEN: drifting.camera.unevenness} if UNEVEN in left else {}
    )
    stated = {path: std for path, std in drifting.tolerances.items() if path in left}
    tolerances = Tolerances({**sensor.tolerances, **stated})
    return replace(
        model,
        sensor=sensor.model_copy(update={"tolerances": tolerances}),
        imaging=imaging,
        calibration=calibration,
    )


def _missed(state: _State) -> Iterator[str]:
    """What does not fit."""
    missed, count = int((~state.explained).sum()), len(state.explained)
    if missed > (1 - EXPLAINED) * count:
        yield (
            f"Do not use this model: no drift of light, residual and camera explains {missed} of "
            f"{count} frames. Calibrate anew."
        )
    elif missed:
        yield f"{missed} of {count} frames are not explained and were left out."
