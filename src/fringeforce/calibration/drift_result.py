"""The model of a strip that drifted, with what is left uncertain and words on what changed."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.calibration.crosstalk import allowed_shares
from fringeforce.calibration.drift_report import EXPLAINED, FORCES, LARGE, Told, missed
from fringeforce.calibration.drift_rows import (
    CAMERA,
    UNEVEN,
    DriftRows,
    light_by_path,
    usable_pixels,
)
from fringeforce.calibration.drift_state import DriftState
from fringeforce.design.light import pairs_of_channels
from fringeforce.design.tolerances import Tolerances, with_values
from fringeforce.estimation.residual_test import FALSE_VERDICT
from fringeforce.models.as_built import RESIDUAL
from fringeforce.models.imaging import Imaging
from fringeforce.models.strip import SensorModel

CERTAIN = 1e-8
"""Variance that nothing falls short of, over that before any frame: of a ten thousandth of a
deviation, so that the covariance of what is told has a root.  A smooth residual has no rough
modes."""


class DriftFound(NamedTuple):
    """What frames tell of the drift, under all lengths and sizes that the residual may have.

    Attributes
    ----------
    origin : SensorModel
        With tolerances of all that may drift.
    rows : DriftRows
        What the unknowns change.
    shared : ndarray, shape (S,)
        Mean of the unknowns.
    covariance, before : ndarray, shape (S, S)
        Their covariances after the frames and before.
    explained : ndarray of bool, shape (F,)
        Frames that are explained.
    """

    origin: SensorModel
    rows: DriftRows
    shared: Array
    covariance: Array
    before: Array
    explained: Mask

    @classmethod
    def of(cls, state: DriftState) -> DriftFound:
        """Of frames that were read."""
        rows, (shared, covariance) = state.rows, state.found
        return cls(state.origin, rows, shared, covariance, rows.before, state.explained)


def _told(state: DriftFound, imaging: Imaging, signed: bool) -> list[Told]:
    """What the frames tell of each thing that may drift."""
    rows, covariance = state.rows, state.covariance
    residual = rows.fields[:, usable_pixels(imaging)]
    most = int(np.abs(state.shared @ residual).argmax())
    lights = light_by_path(state.origin.sensor)
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


def updated_model(
    model: SensorModel, state: DriftFound, signed: bool, loose: tuple[str, ...] = ()
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
    own = rows.residual
    large = bool(own.stop) and rows.guess.chance(state.shared[own]) < FALSE_VERDICT
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
    spread = covariance[np.ix_(kept, kept)]
    root[kept] = np.linalg.cholesky(spread + CERTAIN * np.eye(len(spread)))
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
        usable=bool(state.explained.mean() >= EXPLAINED) and not large,
        record=None,
        findings=(
            *[LARGE] * large,
            *missed(state.explained),
            *map(str, told),
            *[FORCES] * (not rows.design.any()),
        ),
    )
    drifting, light = state.origin.sensor, light_by_path(model.sensor)
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
