"""What a person should know of a calibration: what was identified, and what was wrong."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.calibration.bench_loads import BenchLoads, loads_on_tactels
from fringeforce.calibration.checks import remarks
from fringeforce.calibration.design_entries import DEVIATION
from fringeforce.contacts.resultant import Resultant, touch
from fringeforce.design.strip import Sensor
from fringeforce.models.as_built import PLACEMENT
from fringeforce.models.bench_record import BenchRecord
from fringeforce.models.imaging import ABSOLUTE, Calibration
from fringeforce.models.strip import SensorModel
from fringeforce.reading.reader import Reader
from fringeforce.reading.reading import Status

LEARNT = 0.5
"""Share of the drawing's own uncertainty that frames must remove to have said anything."""
DESCRIBED = 5
"""Wrong calibration loads that are read to say what they look like; the others are only listed."""
VAGUE = 0.02
"""Relative standard deviation of a design value beyond which better loads are asked for."""
NAMED = 0.1
"""Share of the largest force, or exponent, below which a part of a description is left out."""


def unidentified(paths: tuple[str, ...], covariance: Array) -> tuple[str, ...]:
    """Products of powers of design values that the frames say nothing of.

    Parameters
    ----------
    paths : tuple of str, length d
        Dotted paths of the values.
    covariance : ndarray, shape (d, d)
        Covariance of their logarithms, the drawing's own uncertainty included.
    """
    variances, directions = np.linalg.eigh(covariance) if paths else (np.empty(0), np.empty((0, 0)))
    unknown = variances > ((1 - LEARNT) * DEVIATION["value"]) ** 2
    found = []
    for direction in directions.T[unknown]:
        powers = direction / direction[np.abs(direction).argmax()]
        parts = [
            f"{path}^{round(power, 1):g}"  # more digits are noise
            for path, power in zip(paths, powers, strict=True)
            if abs(power) > NAMED
        ]
        found.append(" * ".join(parts))
    return tuple(found)


def findings(
    model: SensorModel, levels: Array, loads: BenchLoads, references: Mask
) -> tuple[str, ...]:
    """Sentences on a calibrated model and the frames behind it.

    Parameters
    ----------
    model : SensorModel
        Calibrated.
    levels : ndarray, shape (F, P)
        All frames with loads, those left out included.
    loads : BenchLoads
        What was written down for them.
    references : ndarray of bool, shape (r,)
        Whether each of the references agrees with the frames.
    """
    found = model.calibration
    if found is None:
        return ()
    said = remarks(levels, loads, model.sensor)
    if changed := model.provenance.get("column correction"):
        said.append(
            f"The influence matrix is corrected by {changed}: the frames show errors of it that no "
            "design value explains."
        )
    for combination in found.unidentified:
        said.append(
            f"The frames say nothing of {combination}; the drawing was kept along it. Young's "
            "moduli matter only by their ratio and through K_s/E_2: leave one of the values out."
        )
    said += [*_vague(found), *_places(model, found), *_light(model, references)]
    said += [_wrong_load(model, levels[row], loads, row) for row in found.outliers[:DESCRIBED]]
    if others := found.outliers[DESCRIBED:]:
        rows = ", ".join(map(str, others))
        said.append(f"Frames {rows} contradict the others too and were left out.")
    if found.dead:
        count = model.sensor.camera.pixels
        several = len(model.frame_shape) > 1
        places = [
            f"{number % count}" + f" of channel {number // count + 1}" * several
            for number in found.dead[:20]
        ]
        pixels = ", ".join(places) + (" and more" if found.dead[20:] else "")
        said.append(f"Pixels {pixels} do not follow the light and were left out.")
    return tuple(said)


def _vague(found: Calibration) -> list[str]:
    """Design values that the frames fix but poorly, and what to press for more."""
    said = []
    for name, value, std in zip(found.names, found.values, found.std, strict=True):
        unknown = any(name in combination for combination in found.unidentified)
        unknown = unknown or name.startswith(ABSOLUTE)
        if std > VAGUE * abs(value) and not unknown:
            said.append(
                f"{name} is known to {std / abs(value):.0%} only. Press so hard that single loads "
                "pass half a fringe: below it more light and a stronger effect look alike."
            )
    return said


def _places(model: SensorModel, found: Calibration) -> list[str]:
    """What is not known of the tactels' places."""
    own = np.array([name.startswith("tactel ") for name in found.names])
    if not own.any():
        return []
    common = float(np.sqrt(found.covariance[np.ix_(own, own)].mean()))
    before = DEVIATION["position"] * model.sensor.tactels.pitch / np.sqrt(own.sum())
    if common < LEARNT * before:
        return []
    return [
        f"All tactels together are known to {common * 1e3:.2g} mm only: but for the strip's ends "
        "their shift looks like the camera's, and the drawing was kept."
    ]


def _light(model: SensorModel, references: Mask) -> list[str]:
    """A lamp that drifts, and references that do not belong to the frames."""
    said = []
    gain, offset = (0.0, 0.0) if model.imaging is None else model.imaging.drift
    if gain or offset:
        said.append(
            f"The light drifted by {gain:.2%} of the amplitude and {offset:.2g} grey levels over "
            "the frames (standard deviations); readings allow for as much. A steadier lamp, or "
            "a longer warm-up, would read better."
        )
    if not references.all():
        said.append(
            "Reference frames contradict the others and were left out: take them with the same "
            "lamp and exposure, and nothing on the sensor."
        )
    return said


def _wrong_load(model: SensorModel, levels: Array, loads: BenchLoads, row: int) -> str:
    """What is wrong with one frame: what it was recorded as, and what it looks like."""
    recorded = described(loads.rows([row]))
    said = f"Frame {row}, recorded as {recorded}, contradicts the others and was left out"
    if model.calibration is None or not model.calibration.usable:
        return f"{said}."  # what is of no use reads nothing that can be believed
    if there := _found_elsewhere(model.calibration, row):
        return f"{said}; it looks like {there}."
    reading = Reader(model).search(levels.reshape(model.frame_shape))
    if reading.status in (Status.OK, Status.AMBIGUOUS, Status.NO_CONTACT):
        clear = np.where(np.abs(reading.forces) > 3 * reading.std, reading.forces, 0.0)
        unsure = " or what makes the same frame" if reading.status is Status.AMBIGUOUS else ""
        seen = loads_on_tactels(clear[None], model.sensor.tactels.positions[:, None])
        return f"{said}; it looks like {described(seen)}{unsure}."
    return f"{said}; no load explains it: the contact may have slipped."


def _found_elsewhere(found: Calibration, row: int) -> str:
    """The single contact of a frame left out, if it was found."""
    record = found.record
    if record is None:
        return ""
    for x, normal, tangential, _ in record.found[record.frames == row]:
        if np.isfinite([x, normal, tangential]).all():
            return f"{normal:.3g} N normal, {tangential:.3g} N tangential at {x * 1e3:.3g} mm"
    return ""


def with_readings(record: BenchRecord, model: SensorModel, levels: Array) -> BenchRecord:
    """A record with the single contacts of frames left out, as the calibrated model reads them.

    Parameters
    ----------
    record : BenchRecord
        Of the bench.
    model : SensorModel
        Calibrated; one of no use reads nothing that can be believed.
    levels : ndarray, shape (F, P)
        Frames with loads.
    """
    found = model.calibration
    if found is None or not found.usable or not found.outliers:
        return record
    reader, there, unsure = _anywhere(model), record.found.copy(), record.std.copy()
    for row in found.outliers[:DESCRIBED]:
        own = record.frames == row
        if own.sum() == 1:
            there[own], unsure[own] = _read(reader, levels[row])
    return replace(record, found=there, std=unsure)


def _anywhere(model: SensorModel) -> Reader:
    """A reader that allows for contacts anywhere between the tactels, where no tolerance does."""
    if model.sensor.skin is not None or PLACEMENT in model.sensor.tolerances:
        return Reader(model)
    between = 1e3 * model.sensor.tactels.pitch / np.sqrt(12)  # of what is uniform over a pitch
    return Reader(model.with_tolerances(**{PLACEMENT: f"0 +/- {between:.6g} mm"}))


def _read(reader: Reader, levels: Array) -> tuple[Array, Array]:
    """Place, forces and width of the one contact of a frame, and their deviations."""
    reading = reader.search(levels.reshape(reader.model.frame_shape))
    if not reading.trusted:
        return np.full(4, np.nan), np.full(4, np.nan)
    sensor = cast(Sensor, reader.model.sensor)
    total: Resultant = reading.total or touch(sensor, reading).total
    centre = float(total.centre_covariance[0, 0])
    values = [total.centre[0], *total.force, np.nan]
    unsure = [np.sqrt(centre), *np.sqrt(np.diag(total.force_covariance)), np.nan]
    return np.array(values), np.array(unsure)


def described(loads: BenchLoads) -> str:
    """The largest forces of one frame in words."""
    own = np.flatnonzero(loads.present[0])
    forces = loads.forces[0, own]
    largest = np.abs(forces).max(initial=0.0)
    if largest == 0:
        return "no load"
    numbers = np.full(len(own), -1) if loads.tactels is None else loads.tactels[0, own]
    places = [
        f"on tactel {number + 1}" if number >= 0 else f"at {place * 1e3:.3g} mm"
        for number, place in zip(numbers, loads.places[0, own], strict=True)
    ]
    order = np.unravel_index(np.argsort(-np.abs(forces), axis=None), forces.shape)
    words = [
        f"{forces[j, kind]:.3g} N {('normal', 'tangential')[kind]} {places[j]}"
        for j, kind in zip(*order, strict=True)
        if abs(forces[j, kind]) > NAMED * largest
    ]
    return ", ".join(words[:3]) + (" and more" if words[3:] else "")
