"""What drifted on a bench since its calibration, from frames whose loads nobody need know.

Light, residual and the camera's place change; layers and materials do not.  All of them are modes
beside those that the calibration left uncertain, and every frame adds what it tells of them once
its own unknowns are eliminated.

A residual that is like the phase of loads, the same in every frame, is told from unknown loads by
its smoothness and its size alone, which nobody knows beforehand: what follows from several
correlation lengths and sizes is averaged, as `residual_guess` says.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array, numbers
from fringeforce.base.blas_threads import one_blas_thread
from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.calibration.bench_loads import BenchLoads, presses_as_loads
from fringeforce.calibration.checks import checked_bench
from fringeforce.calibration.drift_report import ROUNDS, Drift
from fringeforce.calibration.drift_result import DriftFound, updated_model
from fringeforce.calibration.drift_rows import CAMERA, UNEVEN, DriftRows, light_by_path
from fringeforce.calibration.drift_state import DriftState, of_likelier_sign
from fringeforce.calibration.fit import fitted
from fringeforce.calibration.judgement import wrong_forces
from fringeforce.calibration.load_log import LoadLog
from fringeforce.calibration.pads.calibrated import wrong_presses
from fringeforce.calibration.pads.drift import updated_pad
from fringeforce.calibration.strip_drift_search import StripDriftSearch
from fringeforce.calibration.timed_loads import TimedLoads
from fringeforce.contacts.loads import checked_loads
from fringeforce.design.light import pairs_of_channels
from fringeforce.design.strip import SURELY
from fringeforce.design.tolerances import Tolerances, with_values
from fringeforce.models.as_built import RESIDUAL
from fringeforce.models.imaging import Calibration, Imaging
from fringeforce.models.pad import PadModel
from fringeforce.models.presses import Presses, are_presses
from fringeforce.models.strip import SensorModel
from fringeforce.models.uncertainty import uncertainty

LEAST_RESIDUAL = 1e-6
"""Standard deviation of a residual that is said not to have changed: no frame sees less [rad]."""


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
    down to the thickness of the cover, and four times as large as `drift` says or a fourth of it,
    as far as frames make that likely.  How large forces are, known loads alone tell: they find the
    scale of a given matrix that states a tolerance of it, and stay out of what a calibration found.

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

    def found(loads: Array | None) -> DriftState:
        state = DriftState(drifting, levels, loads)
        for number in range(ROUNDS):
            report(f"Finding what drifted in {len(levels)} frames", number, ROUNDS)
            if state.improve():
                break
        return state

    state, signed = found(known), True
    if state.silent.all():
        unloaded, state = True, found(np.zeros((len(levels), 2 * model.sensor.tactels.count)))
    if unloaded:
        state, signed = of_likelier_sign(state)
    report("Done", ROUNDS, ROUNDS)
    return updated_model(model, DriftFound.of(state), signed)


def _under_presses(
    model: SensorModel,
    levels: Array,
    known: BenchLoads | TimedLoads,
    drift: Drift,
    report: Progress,
) -> SensorModel:
    """What frames of presses say that are written down, and perhaps wrongly."""
    drifting = _drifting(model, drift)
    rows = DriftRows.about(drifting)
    shares = pairs_of_channels(len(model.sensor.polariscope.pictures))
    unsure = {path: std for path in shares if (std := drifting.sensor.tolerances.get(path))}
    stated = Tolerances({**model.sensor.tolerances, **unsure})
    sensor = model.sensor.model_copy(update={"tolerances": stated})
    search = StripDriftSearch(replace(model, sensor=sensor), rows, levels, known)
    fit = fitted(search, report)
    found = DriftFound(drifting, rows, *search.drifted(fit), rows.before, fit.explained)
    later = updated_model(model, found, signed=True, loose=CAMERA)
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


def _check_camera(model: SensorModel, drift: Drift) -> None:
    """Refuse a camera that may look anywhere; InputError."""
    sensor, x = model.sensor, model.sensor.pixel_positions
    half, most = sensor.transducer.length / 2, sensor.camera.scale / 3
    if drift.scale >= most:
        raise InputError(
            f"scale = {drift.scale:g} of a drift: three standard deviations must leave a "
            f"magnification above 0; state less than {most:.2g}."
        )
    if not (np.abs(x) + SURELY * np.hypot(drift.shift, drift.scale * x) <= half).any():
        raise InputError(
            f"shift = {1e3 * drift.shift:g} mm and scale = {drift.scale:g} of a drift: at "
            f"{SURELY:g} standard deviations no pixel surely sees the strip, whose ends are "
            f"{1e3 * half:g} mm from its middle; state smaller ones."
        )


def _drifting(model: SensorModel, drift: Drift) -> SensorModel:
    """The model with tolerances of all that may drift, one by one in every frame."""
    _check_camera(model, drift)
    sensor, light, stds = model.sensor, light_by_path(model.sensor), {}
    for path, grey in light.items():
        stds[path] = drift.light * grey
        stds[path.replace("amplitude", "offset")] = drift.offset * grey
    if sensor.polariscope.crosstalk:
        pairs = pairs_of_channels(len(sensor.polariscope.pictures))
        stds |= dict.fromkeys(pairs, drift.crosstalk)
    stds |= {
        RESIDUAL: max(drift.residual, LEAST_RESIDUAL),
        "camera.shift": drift.shift,
        "camera.scale": drift.scale,
    }
    stated = {**sensor.tolerances, **{path: std for path, std in stds.items() if std}}
    unsure = with_values(sensor, {**light, UNEVEN: drift.light})
    return replace(model, sensor=unsure.model_copy(update={"tolerances": Tolerances(stated)}))
