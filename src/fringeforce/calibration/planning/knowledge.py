"""What is known of a sensor before the next load: from its drawing, or from a calibration.

All that a bench shares is written as modes of unit variance, as a calibrated model states them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import InputError
from fringeforce.calibration import bench_expectation as before
from fringeforce.calibration.bench import SCALE as SCALE_UNIT
from fringeforce.calibration.bench import SHIFT as SHIFT_UNIT
from fringeforce.calibration.bench_posterior import FULL_SCALE, GROUPS, PINNED
from fringeforce.calibration.calibrate import usual_parameters
from fringeforce.calibration.design_entries import (
    DRAWN,
    POSITIONS,
    checked_paths,
    names,
    prior,
    units,
    values,
)
from fringeforce.calibration.design_jacobian import design_jacobian
from fringeforce.calibration.planning.candidates import Limits, candidates, typical_loads
from fringeforce.design.light import CROSSTALK, pairs_of_channels
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import Tolerances
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.frame_model import FrameModel
from fringeforce.estimation.shared_fit import Eliminated
from fringeforce.models.as_built import PLACEMENT, WIDTH
from fringeforce.models.crosstalk import Crosstalk
from fringeforce.models.imaging import ABSOLUTE, Calibration, Imaging, pixel_noise
from fringeforce.models.strip import SensorModel
from fringeforce.models.strip_nodes import at_nodes
from fringeforce.models.uncertainty import uncertainty
from fringeforce.optics.camera import noise_variance
from fringeforce.reading.calibration_uncertainty import CalibrationUncertainty
from fringeforce.reading.strip_reader import StripFrameReader


@dataclass(frozen=True, eq=False)
class Knowledge:
    """Estimate and covariance of all that a bench shares, as k modes of unit variance.

    Attributes
    ----------
    model : SensorModel
        The sensor as drawn or as calibrated; of tolerances it has those of contacts alone.
    paths, names : tuple of str
        Design values that are unknown, and names of the design's entries, of the camera's place and
        of shares of cross-talk.
    values : ndarray, shape (d,)
        Of what is named, in their own units.
    root : ndarray, shape (d, k)
        What every mode changes in the values, in the units of a calibration's covariance.
    modes : CalibrationUncertainty
        What every mode changes in a frame.
    used : ndarray of bool, shape (P,)
        Pixels of all channels in turn that can be used.
    scatter : dict of str to float
        How much loads and lamp scatter from frame to frame, as of `Calibration`.
    """

    model: SensorModel
    paths: tuple[str, ...]
    names: tuple[str, ...]
    values: Array
    root: Array
    modes: CalibrationUncertainty
    used: Mask
    scatter: dict[str, float]

    @property
    def sensor(self) -> Sensor:
        """The sensor, as drawn or as calibrated."""
        return self.model.sensor

    @property
    def own_root(self) -> Array:
        """What every mode changes in the values, in their own units, shape (d, k)."""
        own = [name.startswith(ABSOLUTE) for name in self.names]
        return np.where(own, 1.0, np.abs(self.values))[:, None] * self.root

    def imagined(self, pairs: int) -> list[Array]:
        """Modes (k,) of the estimate, and of designs that scatter about it as what is known allows.

        Drawings are trusted to DRAWN here: the wide prior of the fit is meant to leave all to
        the frames and not to describe a workshop.
        """
        d = self.names.index("camera shift")
        design = self.root[:d] / units(self.sensor, self.paths, np.zeros(d))[:, None]
        known = np.linalg.inv(design @ design.T)
        root = np.linalg.cholesky(np.linalg.inv(known + np.eye(d) / DRAWN**2))
        steps = np.random.default_rng(0).standard_normal((pairs, d)) @ root.T
        moved = steps @ np.linalg.pinv(design).T
        return [np.zeros(len(self.root.T)), *(s for step in moved for s in (step, -step))]

    @property
    def places(self) -> Array:
        """Where it can be pressed, shape (n, 1) [m]."""
        return self.sensor.tactels.places

    def candidates(self, limits: Limits) -> Array:
        """Loads that can be applied, shape (C, n, 2) [N]."""
        return candidates(self.model, limits)

    def typical(self, limits: Limits, count: int) -> Array:
        """Loads that the sensor is to read, shape (count, n, 2) [N]."""
        return typical_loads(self.model, limits, count)

    def told_by(self, loads: Array, modes: Array) -> Iterator[Array]:
        """Information on the modes of every frame of loads (C, n, 2), shape (k, k)."""
        largest = float(np.linalg.norm(loads, axis=2).max())
        for load in loads.reshape(len(loads), -1):
            yield self.calibrated(load, largest, modes)

    def readings(self, loads: Array, modes: Array) -> Iterator[tuple[Array, Array]]:
        """What errors of the modes move in readings of loads (j, n, 2), and covariance of noise."""
        for load in loads.reshape(len(loads), -1):
            told = self.read(load, modes)
            yield told.response[: len(load)], told.spread[: len(load), : len(load)]

    @cached_property
    def _reader(self) -> StripFrameReader:
        return StripFrameReader(self.model)

    def read(self, loads: Array, modes: Array) -> Eliminated:
        """Loads (2n,) as a reading tells them, and how far they follow the modes about some."""
        reader = self._reader
        frame, unknowns = reader.uncertain.frame, np.zeros(reader.uncertain.frame.at.size)
        unknowns[: len(loads)] = loads
        weak = reader.prior_near(loads)
        return Eliminated.of(self.modes.terms(frame, weak, unknowns, self.used, modes))

    @cached_property
    def _bench(self) -> FrameModel:
        """A frame of a bench, whose loads and lamp scatter."""
        scatter, stated = self.scatter, self.sensor.tolerances
        contacts = {
            path: stated.get(path, scatter[name])
            for path, name in ((PLACEMENT, "place"), (WIDTH, "width"))
        }
        made = self.sensor.model_copy(update={"tolerances": Tolerances(contacts)})
        assert self.model.imaging is not None
        lamp = replace(self.model.imaging, drift=(scatter["gain"], scatter["offset"]))
        frame = uncertainty(replace(self.model, sensor=made, imaging=lamp)).frame
        noise, _ = pixel_noise(self.sensor)
        return frame._replace(variance=noise_variance(self.sensor.camera, noise))

    def calibrated(self, loads: Array, largest: float, modes: Array) -> Array:
        """Information (k, k) on the modes of a frame of known loads (2n,) of a bench.

        Parameters
        ----------
        loads : ndarray, shape (2n,)
            As written down [N].
        largest : float
            Largest force of a contact of the bench [N].
        modes : ndarray, shape (k,)
            What the sensor is.
        """
        frame = self._bench
        whole = np.repeat(np.linalg.norm(loads.reshape(-1, 2), axis=1), 2)
        share = np.tile([self.scatter["normal"], self.scatter["tangential"]], len(loads) // 2)
        unsure = share * np.hypot(whole, FULL_SCALE * largest)
        precision, unknowns = np.ones(frame.at.size), np.zeros(frame.at.size)
        precision[: len(loads)] = np.where(whole > 0, 1 / np.square(unsure), PINNED)
        unknowns[: len(loads)] = loads
        known = Prior(unknowns, precision, -1.0, 1e6)
        told = Eliminated.of(self.modes.terms(frame, known, unknowns, self.used, modes))
        # sums at nodes are good to some digits, so that what a frame does not tell may be negative
        sizes, directions = np.linalg.eigh(told.information)
        return (directions * np.maximum(sizes, 0.0)) @ directions.T


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
    if isinstance(source, SensorModel) and source.calibration and source.imaging:
        found = _of_calibration(source, source.calibration, source.imaging)
        checked_against(found.paths, parameters)
        return found
    paths = checked_paths(
        sensor, tuple(usual_parameters(sensor) if parameters is None else parameters)
    )
    return _of_drawing(sensor, paths)


def checked_against(paths: tuple[str, ...], parameters: Sequence[str] | None) -> None:
    """InputError if parameters are others than those of a calibration."""
    if parameters is not None and set(parameters) != set(paths):
        raise InputError(
            f"The model was calibrated in {', '.join(paths)}; its covariance says nothing of "
            "others. Leave the parameters out, or plan from the drawing."
        )


def _of_drawing(sensor: Sensor, paths: tuple[str, ...]) -> Knowledge:
    """What a calibration expects before it has seen a frame."""
    stated = {path: std for path, std in sensor.tolerances.items() if path in (PLACEMENT, WIDTH)}
    plain = sensor.model_copy(update={"tolerances": Tolerances(stated)})
    unsure = prior(sensor, paths)
    jacobian, x = design_jacobian(plain, paths, np.zeros(len(unsure))), sensor.pixel_positions
    found = uncertainty(replace(jacobian.model, sensor=plain))
    frame, dim = found.frame, 1 - found.frame.visibility
    lit = Imaging.known(x, frame.amplitude * (1 - dim), frame.offset + frame.amplitude * dim / 2)
    model = replace(jacobian.model, sensor=plain, imaging=lit)
    grey = frame.amplitude.reshape(len(frame.bias), -1).mean(axis=1)
    fields, brightness, darkness = before.smooth_fields(
        sensor, found.places, len(frame.fixed), grey
    )
    light = sensor.polariscope
    shares = {
        path: (light.crosstalk[c][d], std)
        for path, (c, d) in pairs_of_channels(len(grey)).items()
        if (std := sensor.tolerances.get(path))
    }
    leaks = Crosstalk.of(light, {path: std for path, (_, std) in shares.items()}).leaks
    slope = jacobian.matrix(jacobian.centre, x, slope=True)
    place = np.array([before.SHIFT * SHIFT_UNIT, before.SCALE * SCALE_UNIT])
    changes = np.concatenate(
        [
            unsure[:, None, None] * jacobian.at(x)[1:],
            place[:, None, None] * [slope, slope * x[:, None]],
        ]
    )
    moving, lights = len(changes), len(brightness)
    count = moving + len(fields) + lights + 2 + len(leaks)
    lens = np.diag([before.BLUR, before.GAMMA, *np.ones(len(leaks))])

    def among(rows: Array, before: int) -> Array:
        return np.pad(rows, [(before, count - before - len(rows)), (0, 0)])

    modes = CalibrationUncertainty(
        at_nodes(model, changes.swapaxes(1, 2)).swapaxes(1, 2),
        among(brightness, moving + len(fields)),
        among(darkness, moving + len(fields)),
        among(fields, moving),
        among(lens, moving + len(fields) + lights),
        leaks,
    )
    sizes = np.append(unsure * units(sensor, paths, 0 * unsure), place)
    drawn, spread = np.array(list(shares.values())).reshape(-1, 2).T
    root = np.zeros((moving + len(leaks), count))
    root[:moving, :moving] = np.diag(sizes)
    root[moving:, count - len(leaks) :] = np.diag(spread)
    margin = sensor.transducer.length * (1 / 2 - 2 / sensor.camera.pixels)
    return Knowledge(
        model,
        paths,
        (*names(sensor, paths), "camera shift", "camera scale", *shares),
        np.concatenate([values(sensor, paths, 0 * unsure), [0.0, 1.0], drawn]),
        root,
        modes,
        np.tile(np.abs(x) < margin, len(grey)),
        before.DOUBT | {"offset": before.DOUBT["offset"] * float(grey.mean())},
    )


def _of_calibration(model: SensorModel, found: Calibration, imaging: Imaging) -> Knowledge:
    """Estimate and covariance behind a calibrated model."""
    single = [name for name in found.names if not name.startswith(("camera s", CROSSTALK))]
    # the names of all tactels' places stand for one path
    paths = tuple(dict.fromkeys(POSITIONS if n.startswith("tactel ") else n for n in single))
    modes, root = CalibrationUncertainty.of(model, imaging), found.modes
    if root is None:  # the first modes are those of the values
        own = np.asarray(np.linalg.cholesky(found.covariance), dtype=float)
        root = np.pad(own, [(0, 0), (0, len(modes.brightness) - len(own))])
    scatter = before.DOUBT | {"offset": before.DOUBT["offset"] * float(np.mean(imaging.amplitude))}
    scatter |= dict(zip(GROUPS, found.scatter, strict=False))
    return Knowledge(model, paths, found.names, found.values, root, modes, imaging.usable, scatter)
