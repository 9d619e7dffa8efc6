"""What drifted on a bench since its calibration, from frames whose loads nobody need know.

Light, residual and the camera's place change; layers and materials do not.  All of them are modes
beside those that the calibration left uncertain, and every frame adds what it tells of them once
its own unknowns are eliminated.

A residual that is like the phase of loads, the same in every frame, is told from unknown loads by
its smoothness alone, and how smooth it is nobody knows beforehand: what follows from several
correlation lengths is averaged, as `residual_length` says.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.arrays import Array, Mask, numbers
from fringeforce.base.blas_threads import one_blas_thread
from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.calibration.bench_loads import BenchLoads, presses_as_loads
from fringeforce.calibration.bench_search import SETTLED
from fringeforce.calibration.checks import checked_bench, see_strip
from fringeforce.calibration.crosstalk import allowed_shares
from fringeforce.calibration.drift_report import EXPLAINED, FORCES, ROUNDS, Drift, Told, missed
from fringeforce.calibration.fit import fitted
from fringeforce.calibration.judgement import wrong_forces
from fringeforce.calibration.load_log import LoadLog
from fringeforce.calibration.pads.calibrated import wrong_presses
from fringeforce.calibration.pads.drift import updated_pad
from fringeforce.calibration.residual_length import (
    UNLIKELY,
    correlation_lengths,
    equally_likely,
    probabilities,
)
from fringeforce.calibration.strip_drift_search import DriftModes, StripDriftSearch
from fringeforce.calibration.timed_loads import TimedLoads
from fringeforce.contacts.loads import checked_loads
from fringeforce.design.light import light_of_channels, pairs_of_channels
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import Tolerances, number_at, with_values
from fringeforce.estimation.posterior import HELD, Posterior, Top
from fringeforce.estimation.residual_test import square_limit
from fringeforce.models.as_built import RESIDUAL
from fringeforce.models.imaging import Calibration, Imaging
from fringeforce.models.pad import PadModel
from fringeforce.models.presses import Presses, are_presses
from fringeforce.models.strip import SensorModel
from fringeforce.models.uncertainty import (
    DRIFTS,
    FIELD_SAMPLES,
    SMALLEST,
    SPLINE_SAMPLES,
    uncertainty,
)
from fringeforce.reading.strip_reader import StripFrameReader

CAMERA = "camera.shift", "camera.scale"
UNEVEN, LENGTH = "camera.unevenness", "polariscope.residual_length"
STRENGTHS = np.linspace(-3, 3, 25)
"""Strengths of the effect that are tried for a frame of known loads, in standard deviations."""
ATTEMPTS = 8
"""Starts of the search of a frame that is not explained."""


@overload
def update(
    model: SensorModel,
    frames: ArrayLike,
    *,
    loads: ArrayLike | BenchLoads | LoadLog | Presses | None = None,
    unloaded: bool = False,
    drift: Drift | None = None,
    progress: Progress | None = None,
    times: ArrayLike | None = None,
) -> SensorModel: ...


@overload
def update(
    model: PadModel,
    frames: ArrayLike,
    *,
    loads: ArrayLike | BenchLoads | LoadLog | Presses | None = None,
    unloaded: bool = False,
    drift: Drift | None = None,
    progress: Progress | None = None,
    times: ArrayLike | None = None,
) -> PadModel: ...


def update(
    model: SensorModel | PadModel,
    frames: ArrayLike,
    *,
    loads: ArrayLike | BenchLoads | LoadLog | Presses | None = None,
    unloaded: bool = False,
    drift: Drift | None = None,
    progress: Progress | None = None,
    times: ArrayLike | None = None,
) -> SensorModel | PadModel:
    """Bring a model up to date with frames whose loads nobody need have written down.

    The calibration is the prior; light, residual and the camera's shift and scale may have drifted
    from it, and of several channels the light of each and cross-talk that there is.  Unloaded
    frames tell of the residual and of darkness; frames under unknown loads tell of all, as loads of
    many frames fit one sensor.  Of a strip the residual may be rougher than `residual_length` says,
    down to the thickness of the cover, as far as frames make that likely.  How large forces
    are, known loads alone tell: they find the scale of a given matrix that states a tolerance
    of it, and stay out of what a calibration found.

    Parameters
    ----------
    model : SensorModel or PadModel
        Calibrated; a strip with a skin takes unloaded frames or presses by position.  A model with
        a given matrix need not be calibrated: known loads tell the scale of its matrix, if that has
        a tolerance.
    frames : array_like, shape (F, n_pixels), or (F, rows, columns) of a pad
        Grey levels.
    loads : array_like, shape (F, n, components), BenchLoads, LoadLog or sequences, optional
        Forces of tactels that acted [N], if they are known; or presses by position or by time, as
        `calibrate` takes them, within what is stated of places, widths and forces, wrong ones left
        out.  Otherwise they are found with the rest.
    unloaded : bool
        Whether nothing touches the sensor in any of the frames.
    drift : Drift, optional
        What may have changed, and by how much.
    progress : callable, optional
        Called with a title, the steps done and the steps expected.
    times : array_like, shape (F,), optional
        When the frames were taken [s]; with loads by time.

    Returns
    -------
    SensorModel or PadModel
        With `imaging`, of a pad its design and `known`, brought up to date, and `calibration` with
        findings that say what changed, and with `usable` false where the frames are not explained.

    Raises
    ------
    InputError
        If the model was not calibrated, frames or loads do not fit it, or loads are given with
        frames that are said to be unloaded.

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
    model = _begun(model)
    given = _of_tactels(model, loads)
    levels = _checked(model, frames, given, unloaded)
    known = _known(model, frames, levels, given, unloaded, times)
    with one_blas_thread():
        return UPDATED[model.sensor.kind](model, levels, known, drift or Drift(), unloaded, report)


def _updated_strip(
    model: SensorModel,
    levels: Array,
    known: Array | BenchLoads | TimedLoads | None,
    drift: Drift,
    unloaded: bool,
    report: Progress,
) -> SensorModel:
    """`update` for a strip."""
    if isinstance(known, BenchLoads | TimedLoads):
        return _under_presses(model, levels, known, drift, report)
    drifting = _drifting(model, drift)
    state = _State(drifting, levels, known)
    for number in range(ROUNDS):
        report(f"Finding what drifted in {len(levels)} frames", number, ROUNDS)
        if state.improve():
            break
    signed = True
    if unloaded:
        state, signed = _of_likelier_sign(state)
    states = _of_lengths(state)
    report("Done", ROUNDS, ROUNDS)
    return _updated(model, _Found.of(states), signed)


def _under_presses(
    model: SensorModel,
    levels: Array,
    known: BenchLoads | TimedLoads,
    drift: Drift,
    report: Progress,
) -> SensorModel:
    """What frames of presses say that are written down, and perhaps wrongly."""
    drifting = _drifting(model, drift)
    reader = StripFrameReader(drifting)
    rows = _Rows.of(reader)
    if RESIDUAL in rows.names:
        places = reader.uncertain.places[:: SPLINE_SAMPLES // FIELD_SAMPLES]
        lengths = correlation_lengths(drifting.sensor)
        nodes = equally_likely(lengths, places, len(reader.uncertain.frame.fixed))
        rows = rows.with_fields(drifting.sensor.tolerances[RESIDUAL] * reader.at_pixels(nodes))
    changes = DriftModes(rows.camera, rows.fields, rows.brightness, rows.darkness, rows.shares)
    shares = pairs_of_channels(len(model.sensor.polariscope.pictures))
    unsure = {path: std for path in shares if (std := drifting.sensor.tolerances.get(path))}
    stated = Tolerances({**model.sensor.tolerances, **unsure})
    sensor = model.sensor.model_copy(update={"tolerances": stated})
    search = StripDriftSearch(replace(model, sensor=sensor), changes, levels, known)
    fit = fitted(search, report)
    shared, covariance = search.drifted(fit)
    found = _Found(drifting, rows, shared, covariance, np.eye(len(shared)), fit.explained)
    later = _updated(model, found, signed=True, loose=CAMERA)
    assert later.calibration is not None
    loads = known if isinstance(known, BenchLoads) else known.at(fit.delay)
    wrong = wrong_forces(fit)
    words = (
        *[f"Do not use this model: {wrong} Compare the loads with the frames."] * bool(wrong),
        *later.calibration.findings,
        *wrong_presses(later.calibration.outliers, loads),
    )
    usable = later.calibration.usable and not wrong
    told = replace(later.calibration, usable=usable, delay=fit.delay, findings=words)
    return replace(later, calibration=told)


UPDATED: Mapping[str, Any] = {"strip": _updated_strip, "pad": updated_pad}
"""`update` by the kind of the sensor."""


def _of_likelier_sign(state: _State) -> tuple[_State, bool]:
    """The likeliest among mirror images of the residual, and whether its own are less likely.

    Without load, descents begin where the light does not change with the residual to first order,
    and may end early; an image that is better has its own images looked at.
    """
    signed = True
    for _ in range(2):
        images = [
            _State(state.origin, state.levels, state.loads, shared) for shared in state.images()
        ]
        for image in images:
            any(image.improve() for _ in range(ROUNDS))
        best, *rivals = sorted([state, *images], key=lambda one: one.loss)
        signed = all(rival.loss - best.loss > square_limit(1) for rival in rivals)
        if best is state:
            break
        state = best
    return state, signed


def _of_lengths(state: _State) -> list[_State]:
    """The same under shorter and shorter correlation lengths of the residual, as far as likely."""
    found, shown = [state], RESIDUAL in state.rows.names
    for length in correlation_lengths(state.origin.sensor)[1:] if shown else []:
        shorter = found[-1].with_residual_length(length)
        any(shorter.improve() for _ in range(ROUNDS))
        found.append(shorter)
        weights = _weights(found)
        before, now = (one.readable.mean() for one in found[-2:])
        lost = before >= now < EXPLAINED  # another sensor is no rougher residual
        if lost or weights[-1] < UNLIKELY * weights.max():
            break
    return found


def _weights(states: list[_State]) -> Array:
    """Probabilities of models of the same frames, by those that all of them explain, shape (k,)."""
    common = np.all([one.readable for one in states], axis=0)
    return probabilities([one.evidence_loss(common) for one in states])


def _begun(model: Any) -> Any:
    """A model with a given matrix with what it states for what a calibration finds."""
    sensor = model.sensor
    if getattr(sensor.transducer, "plane", "") != "given" or model.calibration is not None:
        return model
    effect, drawn = sensor.transducer.photoelastic.effect, np.array([1.0, 0.0, 1.0])
    frame = uncertainty(model).frame
    lost = frame.amplitude * (1 - frame.visibility)
    imaging = Imaging.known(sensor.pixel_positions, frame.amplitude - lost, frame.offset + lost / 2)
    return replace(
        model,
        imaging=replace(
            imaging,
            influence_modes=np.zeros((0, *model.pixel_influence.shape)),
            drift=(sensor.camera.drift, 0.0),
            residual=np.full(sensor.camera.pixels, sensor.polariscope.residual),
        ),
        calibration=Calibration(
            names=(f"transducer.photoelastic.{effect}", "camera shift", "camera scale"),
            drawing=drawn,
            values=drawn,
            covariance=np.zeros((3, 3)),
            unidentified=(),
            outliers=(),
            dead=(),
            chi2=1.0,
            findings=(),
            modes=np.zeros((3, 0)),
        ),
    )


def _of_tactels(
    model: SensorModel | PadModel, loads: ArrayLike | BenchLoads | LoadLog | Presses | None
) -> ArrayLike | BenchLoads | LoadLog | None:
    """Forces of tactels, (F, n, components) [N], where presses are no more; else as given."""
    found: Any = presses_as_loads(loads) if are_presses(loads) else loads
    if isinstance(found, BenchLoads) and found.named and not found.stated:
        return found.on_tactels(model.sensor.tactels.total)
    return found


def _known(
    model: SensorModel | PadModel,
    frames: ArrayLike,
    levels: Array,
    loads: ArrayLike | BenchLoads | LoadLog | None,
    unloaded: bool,
    times: ArrayLike | None,
) -> Array | BenchLoads | TimedLoads | None:
    """Known loads of all frames, of tactels in the shape (F, components n) [N], or None."""
    count, components = model.sensor.tactels.total, len(model.sensor.components)
    if unloaded and loads is not None:
        raise InputError("loads= and unloaded=True contradict each other; give one of them.")
    if unloaded:
        return np.zeros((len(levels), components * count))
    if loads is None:
        return None
    if isinstance(loads, BenchLoads | LoadLog):
        return checked_bench(model.sensor, frames, loads, times)[1]
    forces = checked_loads(loads, count, components)
    if forces.shape != (len(levels), count, components):
        raise InputError(
            f"loads of shape {forces.shape} do not fit {len(levels)} frames of {count} tactels; "
            f"give ({len(levels)}, {count}, {components})."
        )
    return forces.reshape(len(levels), -1)


def _checked(
    model: SensorModel | PadModel,
    frames: ArrayLike,
    loads: ArrayLike | BenchLoads | LoadLog | None,
    unloaded: bool,
) -> Array:
    if model.calibration is None:
        raise InputError(
            "update takes a calibrated model; this one is as drawn. Calibrate it first."
        )
    known = loads is not None and not isinstance(loads, BenchLoads | LoadLog)
    skin, strip = model.sensor.skin is not None, isinstance(model, SensorModel)
    if skin and strip and loads is None and not unloaded:
        raise InputError(
            "A strip's skin is brought up to date with frames without load, unloaded=True, or with "
            "loads by position: a list of presses for every frame, or a table with x_mm."
        )
    if (
        strip
        and isinstance(loads, BenchLoads | LoadLog)
        and "column correction" in model.provenance
    ):
        raise InputError(
            "The columns of this model were corrected, those of tactels; give forces of tactels, "
            "frame by frame, or calibrate without columns."
        )
    if skin and known:
        raise InputError(
            "A skin has no tactels whose loads are known; leave loads= out, or on a pad say where "
            "each contact is: a list of presses for every frame, or a table with x_mm and y_mm."
        )
    levels, shape = numbers(frames, "Grey levels"), model.frame_shape
    levels = levels[None] if levels.shape == shape else levels
    if levels.shape[1:] != shape or not len(levels):
        raise InputError(
            f"Frames of shape {np.shape(frames)} are not those of the model; give frames of "
            f"{' x '.join(map(str, shape))} pixels."
        )
    levels = levels.reshape(len(levels), -1)
    if not np.isfinite(levels).all():
        raise InputError("Frames hold values that are not finite; leave those frames out.")
    return levels


def _drifting(model: SensorModel, drift: Drift) -> SensorModel:
    """The model with tolerances of all that may drift, one by one in every frame."""
    sensor, light, stds = model.sensor, _light(model.sensor), {}
    for path, grey in light.items():
        stds[path] = drift.light * grey
        stds[path.replace("amplitude", "offset")] = drift.offset * grey
    if sensor.polariscope.crosstalk:
        pairs = pairs_of_channels(len(sensor.polariscope.pictures))
        stds |= dict.fromkeys(pairs, drift.crosstalk)
    stds |= {
        RESIDUAL: drift.residual,
        "camera.shift": drift.shift,
        "camera.scale": drift.scale,
    }
    stated = {**sensor.tolerances, **{path: std for path, std in stds.items() if std}}
    unsure = with_values(sensor, {**light, UNEVEN: drift.light})
    return replace(model, sensor=unsure.model_copy(update={"tolerances": Tolerances(stated)}))


def _light(sensor: Sensor) -> dict[str, float]:
    """Amplitude of the light, or that of each channel, by its path."""
    light = sensor.light[0]
    own = light_of_channels(len(sensor.polariscope.pictures)) or {"camera.amplitude": 0}
    return {path: float(light[c]) for path, c in own.items()}


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
    brightness, darkness : ndarray, shape (S, C P)
        Changes of the amplitude, relative to it, and of the offset, of all channels in turn.
    fields : ndarray, shape (S, P)
        Changes of the phase [rad].
    camera : ndarray, shape (S, 2)
        Changes of the shift [m] and of the scale of the camera.
    shares : ndarray, shape (S, C (C - 1))
        Changes of the share of light of each pair of channels.
    design : ndarray, shape (S,)
        Relative changes of the values of the design that the first d stand for.
    """

    names: tuple[str, ...]
    where: NDArray[np.int64]
    influence: Array
    brightness: Array
    darkness: Array
    fields: Array
    camera: Array
    shares: Array
    design: Array

    @classmethod
    def of(cls, reader: StripFrameReader) -> _Rows:
        sensor, uncertain = reader.model.sensor, reader.uncertain
        frame, at = uncertain.frame, uncertain.frame.at
        modes = [m for m, one in enumerate(uncertain.modes) if one.name not in DRIFTS]
        nodes, lit, pairs = len(frame.fixed), len(modes), pairs_of_channels(len(frame.bias))
        unsure = {path: std for path in pairs if (std := sensor.tolerances.get(path))}
        where = np.concatenate(
            [
                at.modes + np.array(modes, dtype=int),
                np.arange(at.fields, at.modes),
                np.arange(at.crosstalk, at.size),
            ]
        )

        def along(rows: Array, first: int) -> Array:
            """At the pixels of every channel, of all unknowns; rows are those from `first` on."""
            own = rows.reshape(len(rows), -1, nodes)
            found = reader.at_pixels(own).reshape(len(rows), -1)
            return np.pad(found, [(first, len(where) - first - len(found)), (0, 0)])

        camera, design = np.zeros((len(where), 2)), np.zeros(len(where))
        for row, m in enumerate(modes):
            one = uncertain.modes[m]
            if one.name in CAMERA:
                camera[row, CAMERA.index(one.name)] = one.std
            elif one.influence:
                found = number_at(sensor, one.name)
                design[row] = one.std / (found[0] if found else 1.0)
        shares = np.zeros((len(where), len(pairs)))
        for row, (path, std) in enumerate(unsure.items(), len(where) - len(unsure)):
            shares[row, list(pairs).index(path)] = std
        names = (
            *(uncertain.modes[m].name for m in modes),
            *[RESIDUAL] * (at.modes - at.fields),
            *unsure,
        )
        influence = np.moveaxis(reader.at_pixels(frame.influence[:, 0]), -1, 1)
        bright, dark = (along(rows[modes], 0) for rows in (frame.brightness, frame.darkness))
        fields = along(frame.fields, lit)
        return cls(names, where, influence, bright, dark, fields, camera, shares, design)

    def anew(self, reader: StripFrameReader) -> _Rows:
        """The same about a model that has drifted; values of the design change as they did."""
        found, moving = _Rows.of(reader), len(self.influence)
        own = (self.design[:moving] != 0)[:, None, None, None]
        return found._replace(influence=np.where(own, self.influence, found.influence))

    def moved(self, model: SensorModel, shared: Array) -> SensorModel:
        """A model that has drifted by so much."""
        imaging = model.imaging
        assert imaging is not None
        shift, scale = shared @ self.camera
        residual = 0.0 if imaging.residual is None else imaging.residual
        own = self.design != 0
        psi = model.psi
        if own.any():  # the camera's own modes follow from its positions
            change = np.tensordot(shared[own], self.influence[own[: len(self.influence)]], 1)
            order = np.argsort(imaging.positions)
            flat = change.reshape(len(order), -1)[order].T
            at = imaging.positions[order]
            more = np.stack([np.interp(model.x, at, column) for column in flat], axis=1)
            psi = psi + more.reshape(psi.shape)
        positions = imaging.positions * (1 + scale) + shift
        inside = see_strip(model.sensor, positions)
        seen = replace(
            imaging,
            positions=positions,
            usable=imaging.usable & np.tile(inside, len(imaging.usable) // len(inside)),
            amplitude=imaging.amplitude * (1 + shared @ self.brightness),
            offset=imaging.offset + shared @ self.darkness,
            residual=residual + shared @ self.fields,
        )
        moved = with_values(model.sensor, self.found_shares(model.sensor, shared))
        return replace(model, sensor=moved, psi=psi, imaging=seen)

    def nearest(self, others: _Rows, shared: Array) -> Array:
        """The unknowns that change nearly what those of others do, of as many modes or not."""
        own, theirs = (
            np.array([name == RESIDUAL for name in rows.names]) for rows in (self, others)
        )
        found = np.zeros(len(self.names))
        found[~own] = shared[~theirs]
        found[own] = _as_modes(self.fields[own], shared @ others.fields)
        return found

    def with_fields(self, fields: Array) -> _Rows:
        """The same with other modes of the residual, shape (r, P), which no frame has."""
        own = np.array([name == RESIDUAL for name in self.names])
        first, last = int(np.argmax(own)), int(own.sum()) + int(np.argmax(own))

        def among(rows: Array, new: Array | None = None) -> Array:
            more = np.zeros((len(fields), *rows.shape[1:])) if new is None else new
            return np.concatenate([rows[:first], more, rows[last:]])

        return self._replace(
            names=(*self.names[:first], *[RESIDUAL] * len(fields), *self.names[last:]),
            where=np.empty(0, dtype=np.int64),
            brightness=among(self.brightness),
            darkness=among(self.darkness),
            fields=among(self.fields, fields),
            camera=among(self.camera),
            shares=among(self.shares),
            design=among(self.design),
        )

    def found_shares(self, sensor: Sensor, shared: Array) -> dict[str, float]:
        """Cross-talk of a design after such a drift, by path; perhaps shares below zero."""
        pairs = pairs_of_channels(len(sensor.polariscope.pictures)).items()
        drawn, change = sensor.polariscope.crosstalk, shared @ self.shares
        return {
            path: drawn[c][d] + float(change[k])
            for k, (path, (c, d)) in enumerate(pairs)
            if self.shares[:, k].any()
        }


class _State:
    """What the frames say of the drift so far."""

    def __init__(
        self,
        model: SensorModel,
        levels: Array,
        loads: Array | None,
        shared: Array | None = None,
    ) -> None:
        self.origin, self.levels, self.loads = model, levels, loads
        self.rows = _Rows.of(StripFrameReader(model))
        self.shared = np.zeros(len(self.rows.where)) if shared is None else shared
        self.information = np.eye(len(self.shared))
        self.explained = np.zeros(len(levels), dtype=bool)
        self.readable = np.zeros(len(levels), dtype=bool)
        self.parts, self.lost = np.zeros(len(levels)), 0.0
        self.loss, self.near = np.inf, shared is not None
        self.best = np.inf, self.shared

    @property
    def model(self) -> SensorModel:
        """The sensor as found so far."""
        return self.rows.moved(self.origin, self.shared)

    def improve(self) -> bool:
        """Move the model to where all frames agree; whether that was little.

        At first every frame is read with a drift of its own, then all with the one found so far:
        from a drift d, gradient g with its prior and Schur complement K of a frame, its likelihood
        has the gradient g - (1 + K) d where the model is.
        """
        reader = StripFrameReader(self.model)
        earlier, rows = self.rows, self.rows.anew(reader)
        if len(rows.names) != len(earlier.names):  # as many modes as count where the camera looks
            self.shared = rows.nearest(earlier, self.shared)
            self.best = np.inf, self.shared
        self.rows = rows
        unity = np.eye(len(self.shared))
        self.information, slope = unity.copy(), self.shared.copy()
        self.loss = self.lost = float(self.shared @ self.shared)
        for number, frame in enumerate(self.levels):
            posterior, top = self._found(reader, number, frame)
            readable = top.square <= square_limit(top.count)
            if self.near:
                top = self._pinned(posterior, top)
            self.explained[number] = top.square <= square_limit(top.count)
            self.loss += top.loss
            self.readable[number] = readable
            if not readable:
                continue
            about = posterior.linearised(top)
            hessian = about.hessian + about.cone
            own = np.setdiff1d(np.arange(len(hessian)), rows.where)
            cross = hessian[np.ix_(own, rows.where)]
            response = np.linalg.solve(hessian[np.ix_(own, own)], cross)
            told = hessian[np.ix_(rows.where, rows.where)] - unity - cross.T @ response
            volume = np.linalg.slogdet(hessian[np.ix_(own, own)])[1]
            self.parts[number] = top.loss + volume - np.log(posterior.prior.precision[own]).sum()
            self.information += told
            slope += about.gradient[rows.where] - response.T @ about.gradient[own]
            slope -= (told + unity) @ top.unknowns[rows.where]
        lowest, best = self.best
        # by more than climbs of frames leave: one squared deviation
        if self.loss > lowest + 1:
            self.shared = (self.shared + best) / 2
            return False
        if not self.readable.any() and not self.shared.any():
            return True  # the model stays where it is, and would find the same again
        if self.near:
            self.best = self.loss, self.shared
        step = -np.linalg.solve(self.information, slope)
        self.shared = self.shared + step
        short = bool(np.sqrt(step @ self.information @ step) < SETTLED)
        self.near, before = True, self.near
        return before and short

    @property
    def residual_length(self) -> float:
        """Correlation length that the residual has here [m]."""
        return float(self.origin.sensor.polariscope.residual_length)

    def evidence_loss(self, frames: Mask) -> float:
        """Twice the negative logarithm of the probability of some frames, less a constant.

        All unknowns are integrated out (MacKay, Neural Computation 4, 415-447, 1992).
        """
        volume = float(np.linalg.slogdet(self.information)[1])
        return self.lost + volume + float(self.parts[frames].sum())

    def with_residual_length(self, length: float) -> _State:
        """The same frames about the same drift, whose residual has another correlation length."""
        sensor = with_values(self.origin.sensor, {LENGTH: length})
        other = _State(replace(self.origin, sensor=sensor), self.levels, self.loads)
        shared = other.rows.nearest(self.rows, self.shared)
        return _State(other.origin, self.levels, self.loads, shared)

    def _pinned(self, posterior: Posterior, top: Top) -> Top:
        """What explains a frame best without any drift of its own."""
        precision, start = posterior.prior.precision.copy(), top.unknowns.copy()
        precision[self.rows.where] *= HELD
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
        used, rows = _seen(imaging), self.rows.fields
        stretch = np.cumsum(np.diff(np.sign(imaging.residual), prepend=0.0) != 0)
        seen = np.unique(stretch[used])
        for own in (seen, *(seen[k : k + 1] for k in range(len(seen) if len(seen) > 1 else 0))):
            turned = -2 * imaging.residual * np.isin(stretch, own)
            field = np.flatnonzero(rows.any(axis=1))
            shared = self.shared.copy()
            shared[field] += _as_modes(rows[np.ix_(field, used)], turned[used])
            yield shared

    def _found(self, reader: StripFrameReader, number: int, frame: Array) -> tuple[Posterior, Top]:
        """What explains a frame best."""
        used = reader.usable_pixels
        posterior = reader.own_posterior(np.where(used, frame, np.nan))
        if self.loads is not None:
            count, prior = posterior.model.at.loads, posterior.prior
            precision, mean = prior.precision.copy(), prior.mean.copy()
            precision[:count] *= HELD
            mean[:count] = self.loads[number]
            known = prior._replace(precision=precision, mean=mean)
            # second order alone would be taken for drift
            solved = reader.solved_at(posterior, self.loads[number])
            alone = replace(solved, prior=known)
            starts = [mean]
            for row in np.flatnonzero(self.rows.design):
                # fringes that a wrong strength shifts by one are a valley of their own
                unit = np.zeros_like(mean)
                unit[self.rows.where[row]] = 1.0
                starts = [start + size * unit for start in starts for size in STRENGTHS]
            tops = [alone.climbed(start) for start in starts]
            return alone, min(tops, key=lambda top: top.loss)
        located = reader.followed(frame, used, None)[1]
        if located is not None:
            return located.posterior, located.top
        posterior, tops = reader.explanations(posterior.frame, ATTEMPTS, mend=True)
        nothing = posterior.climbed(np.zeros(posterior.model.at.size))
        return posterior, tops[0] if tops else nothing


class _Found(NamedTuple):
    """What frames tell of the drift, under all correlation lengths that the residual may have.

    Attributes
    ----------
    origin : SensorModel
        With tolerances of all that may drift.
    rows : _Rows
        What the unknowns change; those of the residual are of all lengths together.
    shared : ndarray, shape (S,)
        Mean of the unknowns.
    covariance, before : ndarray, shape (S, S)
        Their covariances after the frames and before.
    explained : ndarray of bool, shape (F,)
        Frames that are explained under the likeliest length.
    """

    origin: SensorModel
    rows: _Rows
    shared: Array
    covariance: Array
    before: Array
    explained: Mask

    @classmethod
    def of(cls, states: list[_State]) -> _Found:
        """The average of what follows from each length, with its probability as weight."""
        weights = _weights(states)
        kept = weights >= UNLIKELY * weights.max()
        states = [one for one, is_kept in zip(states, kept, strict=True) if is_kept]
        weights = weights[kept] / weights[kept].sum()
        best = states[int(weights.argmax())]
        if len(states) == 1:
            covariance: Array = np.asarray(np.linalg.inv(best.information), dtype=float)
            before = np.eye(len(best.shared))
            return cls(best.origin, best.rows, best.shared, covariance, before, best.explained)
        own = [np.array([name == RESIDUAL for name in one.rows.names]) for one in states]
        fields = np.concatenate([one.rows.fields[at] for one, at in zip(states, own, strict=True)])
        turn, sizes, _ = np.linalg.svd(fields, full_matrices=False)
        turn = turn[:, np.square(sizes) > SMALLEST * sizes[0] ** 2]
        rows = best.rows.with_fields(turn.T @ fields)
        moves, last, first = [], 0, int(np.argmax(own[0]))
        for at in own:
            count = int(at.sum())
            move = np.zeros((len(rows.names), len(at)))
            others = [k for k, name in enumerate(rows.names) if name != RESIDUAL]
            move[others, np.flatnonzero(~at)] = 1.0
            move[first : first + turn.shape[1], at] = turn[last : last + count].T
            moves.append(move)
            last += count
        each = [move @ one.shared for move, one in zip(moves, states, strict=True)]
        mean = weights @ np.array(each)
        covariance, before = np.zeros((2, len(mean), len(mean)))
        for weight, move, one, shared in zip(weights, moves, states, each, strict=True):
            off = shared - mean
            covariance += weight * (move @ np.linalg.inv(one.information) @ move.T)
            covariance += weight * np.outer(off, off)
            before += weight * (move @ move.T)
        return cls(best.origin, rows, mean, covariance, before, best.explained)


def _as_modes(modes: Array, field: Array) -> Array:
    """Unknowns of modes (k, P) that come as near to a field (P,) as a hundredth of a radian."""
    gram = modes @ modes.T + 1e-4 * len(field) * np.eye(len(modes))
    return np.asarray(np.linalg.solve(gram, modes @ field), dtype=float)


def _seen(imaging: Imaging) -> Mask:
    """Pixels of a row that some channel uses, shape (P,)."""
    return np.any(imaging.usable.reshape(-1, len(imaging.positions)), axis=0)


def _told(state: _Found, imaging: Imaging, signed: bool) -> list[Told]:
    """What the frames tell of each thing that may drift."""
    rows, covariance = state.rows, state.covariance
    residual = rows.fields[:, _seen(imaging)]
    most = int(np.abs(state.shared @ residual).argmax())
    lights = _light(state.origin.sensor)
    pairs = pairs_of_channels(len(state.origin.sensor.polariscope.pictures))

    def told(name: str, unit: str, paths: tuple[str, ...], change: Array) -> Told:
        std = float(np.sqrt(change @ covariance @ change))
        by, before = float(change @ state.shared), float(np.sqrt(change @ state.before @ change))
        return Told(name, unit, paths, by, std, before)

    def light(c: int) -> Array:
        """Change of the mean light of one channel."""
        lit = rows.brightness.reshape(len(state.shared), len(lights), -1)[:, c]
        used = imaging.usable.reshape(len(lights), -1)[c]
        return np.asarray(lit[:, used].mean(axis=1) * 100)

    found = (
        *(
            told(
                "The light" + f" of channel {c + 1}" * (len(lights) > 1),
                "%",
                (path, UNEVEN),
                light(c),
            )
            for c, path in enumerate(lights)
        ),
        *(
            told(
                f"The share of channel {d + 1} in the light of channel {c + 1}",
                "%",
                (path,),
                rows.shares[:, k] * 100,
            )
            for k, (path, (c, d)) in enumerate(pairs.items())
        ),
        told("The residual", "rad where it changed most", (RESIDUAL,), residual[:, most])._replace(
            signed=signed
        ),
        told("The camera's place", "mm", CAMERA[:1], rows.camera[:, 0] * 1e3),
        told("The camera's scale", "%", CAMERA[1:], rows.camera[:, 1] * 100),
        told("The strength of the effect", "%", (), rows.design * 100),
    )
    return [one for one in found if one.before]


def _updated(
    model: SensorModel, state: _Found, signed: bool, loose: tuple[str, ...] = ()
) -> SensorModel:
    """The model as found, with what is left uncertain and words on what changed.

    What frames do not tell of stays where the calibration found it, as a tolerance of the model,
    which every reading estimates.  So does, about what is found, what is `loose`: found less surely
    than single frames tell it.
    """
    assert model.imaging is not None
    assert model.calibration is not None
    before, rows, found = model.imaging, state.rows, model.calibration
    told = _told(state, before, signed)
    left = {path for one in told if not one.known for path in one.paths}
    kept = np.array([name not in left for name in rows.names])
    covariance, shared = state.covariance, state.shared.copy()
    if left:  # as they are if nothing of the rest had changed
        shared -= covariance[:, ~kept] @ np.linalg.solve(
            covariance[np.ix_(~kept, ~kept)], shared[~kept]
        )
    shared[~kept] = 0.0
    opened = {
        name: state.origin.sensor.tolerances[name] * float(np.sqrt(covariance[row, row]))
        for row, name in enumerate(rows.names)
        if name in loose and name not in left
    }
    kept &= np.array([name not in opened for name in rows.names])
    root = np.zeros((len(kept), int(kept.sum())))
    root[kept] = np.linalg.cholesky(covariance[np.ix_(kept, kept)])
    moving, known = int(kept[: len(rows.influence)].sum()), len(before.influence_modes)
    drifted = rows.moved(model, shared)
    moved = drifted.imaging
    assert moved is not None
    shares = rows.found_shares(model.sensor, shared)

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
        crosstalk_modes=among(before.crosstalk_modes, root.T @ rows.shares) if shares else None,
    )
    named = {name.replace(".", " "): rows.camera[:, k] for k, name in enumerate(CAMERA)}
    paths = pairs_of_channels(len(model.sensor.polariscope.pictures))
    named |= {path: rows.shares[:, k] for k, path in enumerate(paths) if path in found.names}
    at, by = [found.names.index(name) for name in named], np.array(list(named.values()))
    change, values = np.zeros((len(found.names), root.shape[1])), found.values.copy()
    change[at] = by @ root
    values[at] += by @ shared
    apart = np.zeros_like(found.covariance)
    for path, std in opened.items():
        own = found.names.index(path.replace(".", " "))
        apart[own, own] = std**2
    for row, name in enumerate(rows.names):
        if rows.design[row] and name in found.names:
            own = found.names.index(name)
            change[own] += rows.design[row] * root[row]
            values[own] *= 1 + rows.design[row] * shared[row]
    old = found.modes
    if old is None:  # the first modes are those of the values
        old = np.asarray(np.linalg.cholesky(found.covariance), dtype=float)
        old = np.pad(old, [(0, 0), (0, len(before.amplitude_modes) - len(old))])
    calibration = replace(
        found,
        values=values,
        covariance=found.covariance + change @ change.T + apart,
        modes=among(old.T, change.T).T,
        outliers=tuple(np.flatnonzero(~state.explained).tolist()),
        usable=bool(state.explained.mean() >= EXPLAINED),
        record=None,
        findings=(*missed(state.explained), *map(str, told), *[FORCES] * (not rows.design.any())),
    )
    drifting, light = state.origin.sensor, _light(model.sensor)
    lit = {path: grey for path, grey in light.items() if path in left}
    lit |= {UNEVEN: drifting.camera.unevenness} if UNEVEN in left else {}
    found_now = allowed_shares(model.sensor.polariscope, shares)
    sensor = with_values(model.sensor, {**found_now, **lit})
    stated = {path: std for path, std in drifting.tolerances.items() if path in left}
    unsure = {path: std for path, std in sensor.tolerances.items() if path not in rows.names}
    tolerances = Tolerances({**unsure, **stated, **opened})
    return replace(
        model,
        psi=drifted.psi,
        sensor=sensor.model_copy(update={"tolerances": tolerances}),
        imaging=imaging,
        calibration=calibration,
    )
