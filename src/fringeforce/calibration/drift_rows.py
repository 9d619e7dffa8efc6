"""What the unknowns of a drift change of the light of a strip and of its design."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Mask
from fringeforce.calibration.checks import see_strip
from fringeforce.calibration.residual_guess import Averaged, ResidualGuess
from fringeforce.design.light import light_of_channels, pairs_of_channels
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import number_at, with_values
from fringeforce.estimation.frame_exposure import influence_slopes
from fringeforce.models.as_built import RESIDUAL
from fringeforce.models.design_modes import DRIFTS
from fringeforce.models.imaging import Imaging
from fringeforce.models.strip import SensorModel
from fringeforce.models.strip_nodes import at_nodes, places_of_fields
from fringeforce.models.uncertainty import uncertainty
from fringeforce.reading.strip_reader import StripFrameReader

CAMERA = "camera.shift", "camera.scale"
UNEVEN = "camera.unevenness"


def light_by_path(sensor: Sensor) -> dict[str, float]:
    """Amplitude of the light, or that of each channel, by its path."""
    light = sensor.light[0]
    own = light_of_channels(len(sensor.polariscope.pictures)) or {"camera.amplitude": 0}
    return {path: float(light[c]) for path, c in own.items()}


class DriftRows(NamedTuple):
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
    guess : ResidualGuess
        What the residual may be.
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
    guess: ResidualGuess

    @classmethod
    def about(cls, model: SensorModel) -> DriftRows:
        """Those of a model of which what may drift is a tolerance."""
        places, nodes = places_of_fields(model)
        std, guess = model.sensor.tolerances.get(RESIDUAL), ResidualGuess.none(nodes)
        if std:
            guess = ResidualGuess.of(model.sensor, std, places, nodes)
        return cls.of(_reader(model, guess.modes), guess)

    def reader_of(self, model: SensorModel) -> StripFrameReader:
        """What reads frames of a model that has drifted, and may still."""
        return _reader(model, at_nodes(model, self.fields[self.residual]))

    @classmethod
    def of(cls, reader: StripFrameReader, guess: ResidualGuess) -> DriftRows:
        """Those of a reader that allows for such a residual."""
        sensor, uncertain = reader.model.sensor, reader.uncertain
        frame, at = uncertain.frame, uncertain.frame.at
        modes = [m for m, one in enumerate(uncertain.modes) if one.name not in DRIFTS]
        nodes, lit, pairs = len(frame.fixed), len(modes), pairs_of_channels(len(frame.bias))
        unsure = {path: std for path in pairs if (std := sensor.tolerances.get(path))}
        where = np.concatenate(
            [
                at.modes + np.array(modes, dtype=int),
                np.arange(at.fields, at.fields + len(guess.modes)),
                np.arange(at.crosstalk, at.size),
            ]
        )

        def along(rows: Array, first: int) -> Array:
            """At the pixels of every channel, of all unknowns; rows are those from `first` on."""
            if not len(rows):
                return np.zeros((len(where), math.prod(reader.model.frame_shape)))
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
            *[RESIDUAL] * len(guess.modes),
            *unsure,
        )
        influence = np.moveaxis(reader.at_pixels(influence_slopes(frame, np.zeros(at.size))), -1, 1)
        bright, dark = (along(rows[modes], 0) for rows in (frame.brightness, frame.darkness))
        fields = along(frame.fields[: len(guess.modes)], lit)
        return cls(names, where, influence, bright, dark, fields, camera, shares, design, guess)

    @property
    def residual(self) -> slice:
        """Unknowns of the residual."""
        first = self.names.index(RESIDUAL) if len(self.guess.modes) else 0
        return slice(first, first + len(self.guess.modes))

    def average(self, information: Array, pull: Array) -> Averaged:
        """What frames tell of the unknowns; as of `ResidualGuess.average`."""
        return self.guess.average(self.residual, information, pull)

    def loss(self, shared: Array) -> float:
        """Twice the negative logarithm of the unknowns' probability, less a constant."""
        own = self.residual
        return self.guess.loss(shared[own]) + float(np.square(np.delete(shared, own)).sum())

    @property
    def before(self) -> Array:
        """Covariance of the unknowns before the frames, shape (S, S)."""
        return np.asarray(self.guess.before(self.residual, len(self.names)).mean(axis=0))

    def anew(self, reader: StripFrameReader) -> DriftRows:
        """The same about a model that has drifted.

        Values of the design, and modes of the residual, change what they did.
        """
        found, moving = DriftRows.of(reader, self.guess), len(self.influence)
        own = (self.design[:moving] != 0)[:, None, None, None]
        influence = np.where(own, self.influence, found.influence)
        return found._replace(influence=influence, fields=self.fields)

    def signs_beside(self, others: DriftRows) -> Array:
        """Signs with which unknowns of others are the same here, shape (S,).

        Modes of uneven light are eigenvectors, which may turn round where the camera moves.
        """
        alike = (self.brightness * others.brightness).sum(axis=1)
        alike += (self.darkness * others.darkness).sum(axis=1)
        return np.where(alike < 0, -1.0, 1.0)

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

    def found_shares(self, sensor: Sensor, shared: Array) -> dict[str, float]:
        """Cross-talk of a design after such a drift, by path; perhaps shares below zero."""
        pairs = pairs_of_channels(len(sensor.polariscope.pictures)).items()
        drawn, change = sensor.polariscope.crosstalk, shared @ self.shares
        return {
            path: drawn[c][d] + float(change[k])
            for k, (path, (c, d)) in enumerate(pairs)
            if self.shares[:, k].any()
        }


def _reader(model: SensorModel, modes: Array) -> StripFrameReader:
    """What reads frames of a model that allows for modes of the residual at the nodes (q, m)."""
    return StripFrameReader(model, centre=uncertainty(model, modes if len(modes) else None))


def as_modes(modes: Array, field: Array) -> Array:
    """Unknowns of modes (k, P) that come as near to a field (P,) as a hundredth of a radian."""
    gram = modes @ modes.T + 1e-4 * len(field) * np.eye(len(modes))
    return np.asarray(np.linalg.solve(gram, modes @ field), dtype=float)


def usable_pixels(imaging: Imaging) -> Mask:
    """Pixels of a row that some channel uses, shape (P,)."""
    return np.any(imaging.usable.reshape(-1, len(imaging.positions)), axis=0)
