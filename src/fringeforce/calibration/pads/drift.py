"""What drifted on the bench of a pad since its calibration.

All frames share what lasts of a pad, with the calibration widened by the drift as prior.  Of its
own every frame has its forces, unless they are known, the gain of its light, and the shapes of its
contacts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.calibration.bench_search import inverse
from fringeforce.calibration.drift_report import EXPLAINED, FORCES, Drift, Told, missed
from fringeforce.calibration.pads.calibrated import known_pad, stated_value
from fringeforce.design.tolerances import with_values
from fringeforce.estimation.levenberg_marquardt import Expansion, Stop, minimise
from fringeforce.estimation.likelihood import Misfit
from fringeforce.estimation.residual_test import square_limit
from fringeforce.estimation.shared_fit import Eliminated, FrameTerms
from fringeforce.models.as_built import RESIDUAL
from fringeforce.models.pad import PadModel, characterize_pad
from fringeforce.models.pad_knowledge import PadKnowledge
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.reading.pads.fit import Fit, Place, Prior
from fringeforce.reading.pads.sampling import Sampling, lattice
from fringeforce.reading.pads.single_frame import FOLLOWED_SIDE, Earlier, PadFrameReader
from fringeforce.reading.reading import Reading

STEPS = 12
"""Most steps towards what the frames say together."""
CLOSE, NEAR = 0.1, 1.0
"""Falls of the loss, in squared deviations of all unknowns together, that a step promises below
which it need not be evaluated, and below which it is the last."""


def updated_pad(
    model: PadModel,
    levels: Array,
    known: Array | None,
    drift: Drift,
    unloaded: bool,
    report: Progress,
) -> PadModel:
    """`update` for a pad.

    Parameters
    ----------
    model : PadModel
        Calibrated.
    levels : ndarray, shape (F, P)
        Grey levels.
    known : ndarray, shape (F, 3n), optional
        Forces that acted [N]; they are found with the rest if not given.
    drift : Drift
        What may have changed.
    unloaded : bool
        Whether nothing touches the pad.
    report : callable
        Told what is done.
    """
    if model.known is None or model.calibration is None:
        raise InputError("This pad was never calibrated; calibrate it first.")
    prior = _widened(model, drift)
    reader = PadFrameReader(replace(model, known=prior))
    bench = _Bench(reader, levels, known)
    total = len(levels) + STEPS
    starts = []
    for number in range(len(levels)):
        report(f"Finding what drifted in {len(levels)} frames", number, total)
        starts.append(bench.begun(number))
    state, information, explained = bench.together(starts, report, total)
    report("Done", total, total)
    return _updated(model, bench, state.shared, information, explained)


def _widened(model: PadModel, drift: Drift) -> PadKnowledge:
    """What is known of a pad that may have drifted."""
    known = model.known
    assert known is not None
    amplitude = model.sensor.camera.amplitude
    drifts = {
        "camera.amplitude": drift.light * amplitude,
        "camera.offset": drift.offset * amplitude,
        "camera.shift_x": drift.shift,
        "camera.shift_y": drift.shift,
        "camera.scale": drift.scale,
        RESIDUAL: drift.residual,
    }
    added = [
        np.full(count, (drifts.get(path, 0.0) / known.stds[path]) ** 2)
        for path, count in known.counts.items()
    ]
    return replace(known, covariance=known.covariance + np.diag(np.concatenate(added)))


class _State(NamedTuple):
    """Values of all unknowns, and every frame there."""

    shared: Array
    own: list[Array]
    places: list[tuple[Place, Misfit]]
    loss: float


@dataclass(frozen=True, eq=False)
class _Bench:
    """Frames of a pad that may have drifted.

    Attributes
    ----------
    reader : PadFrameReader
        Of the pad with all drift as tolerances, which finds each frame by itself.
    levels : ndarray, shape (F, P)
        Grey levels.
    known : ndarray, shape (F, 3n), optional
        Forces [N].
    """

    reader: PadFrameReader
    levels: Array
    known: Array | None

    @cached_property
    def unsure(self) -> PadUncertainty:
        """What is uncertain about the pad."""
        found = self.reader.uncertain
        assert found is not None
        return found

    @cached_property
    def _sampling(self) -> Sampling:
        return lattice(self.unsure.model, FOLLOWED_SIDE, self.unsure)

    @cached_property
    def used(self) -> Mask:
        """Pixels that count."""
        return self.reader.usable_pixels

    @cached_property
    def prior(self) -> tuple[Array, Array]:
        """Mean, shape (S,), and precision, (S, S), of what all frames share."""
        lasting = self.unsure.lasting
        mean, precision = self.unsure.expected
        return mean[lasting], precision[np.ix_(lasting, lasting)]

    @property
    def loads(self) -> int:
        """Number of forces 3n."""
        return 3 * self.unsure.model.sensor.tactels.total

    @cached_property
    def _mine(self) -> Index:
        """Which of forces and unknowns are those of single frames."""
        own = self.loads + np.flatnonzero(~self.unsure.lasting)
        return own if self.known is not None else np.append(np.arange(self.loads), own)

    def begun(self, f: int) -> tuple[Array, bool]:
        """Forces and unknowns of a frame by itself, and whether they explain it."""
        nothing = np.concatenate([np.zeros(self.loads), self.unsure.expected[0]])
        if self.known is not None:
            nothing[: self.loads] = self.known[f]
            return nothing, True
        image = self.levels[f].reshape(self.reader.model.frame_shape)
        checked = self.reader.checked(image, self.used)
        if isinstance(checked, Reading):
            return nothing, False
        _, optimum = self.reader.found(checked, self.used, Earlier())
        fine = self.reader.classifier(self.used).explained(optimum)
        return np.concatenate([optimum.forces, optimum.extra]), fine

    def together(
        self, starts: list[tuple[Array, bool]], report: Progress, total: int
    ) -> tuple[_State, Array, Mask]:
        """What all frames say together, its information (S, S), and which frames are explained."""
        mine, lasting = self._mine, self.unsure.lasting
        kept = np.array([fine for _, fine in starts])
        mean, precision = self.prior
        fits = [self._fit(f, values[: self.loads]) for f, (values, _) in enumerate(starts)]

        def at(shared: Array, own: list[Array]) -> _State:
            places, loss = [], float((shared - mean) @ precision @ (shared - mean))
            for f, (fit, (values, fine)) in enumerate(zip(fits, starts, strict=True)):
                whole = values.copy()
                whole[mine] = own[f]
                whole[self.loads :][lasting] = shared
                place = fit.at(whole[: self.loads], whole[self.loads :])
                places.append((place, fit.misfit(place)))
                loss += fine * places[-1][1].loss
            return _State(shared, own, places, loss)

        def told(state: _State) -> tuple[list[Eliminated], Array, Array]:
            gradient, information = precision @ (state.shared - mean), precision.copy()
            found = []
            for fit, fine, (place, left) in zip(fits, kept, state.places, strict=True):
                found.append(Eliminated.of(self._terms(fit, place, left)))
                gradient = gradient + fine * found[-1].gradient
                information += fine * found[-1].information
            return found, gradient, information

        def expand(state: _State) -> Expansion[_State]:
            report("Finding what drifted in all frames", len(starts), total)
            found, gradient, information = told(state)

            def ahead(step: Array) -> tuple[_State, float]:
                own = [
                    value + one.step + one.response @ step
                    for value, one in zip(state.own, found, strict=True)
                ]
                there = at(state.shared + step, own)
                return there, there.loss

            return Expansion(state.loss, gradient, lambda: information, ahead)

        first = at(mean, [values[mine] for values, _ in starts])
        reached = minimise(first, expand, STEPS, Stop(close=CLOSE, near=NEAR), damping=0.0).place
        squares = np.array([left.slope @ left.slope for _, left in reached.places])
        return reached, told(reached)[2], kept & (squares <= square_limit(int(self.used.sum())))

    def _fit(self, f: int, forces: Array) -> Fit:
        unsure = self.unsure
        free = Prior(np.zeros(unsure.size), np.diag((~unsure.lasting).astype(float)))
        used = None if self.used.all() else self.used
        response = self.reader.response
        return Fit(unsure.model, response, self._sampling, self.levels[f], used, free, forces)

    def _terms(self, fit: Fit, place: Place, left: Misfit) -> FrameTerms:
        """Half the loss of a frame to second order."""
        gradient, information = fit.gradient(place, left), fit.information(place)
        # it takes all pixels for alike, which tells light from dark where no frame does
        brightness, own = self.unsure.brightness, (~self.unsure.lasting).astype(float)
        amplitude = self.unsure.group("camera.amplitude")
        assert amplitude is not None
        first = self.loads + amplitude.begin
        bright = brightness[amplitude.begin] * fit.response.amplitude * place.intensity[self.used]
        exact = float(bright @ bright / fit.response.variance)
        scale = np.ones(len(gradient))
        scale[self.loads :][brightness != 0] = np.sqrt(exact / information[first, first])
        prior = np.diag(np.concatenate([np.zeros(self.loads), own]))
        information = (information - prior) * np.outer(scale, scale) + prior
        mine, others = self._mine, self.loads + np.flatnonzero(self.unsure.lasting)
        return FrameTerms(
            information[np.ix_(mine, mine)],
            information[np.ix_(mine, others)],
            information[np.ix_(others, others)],
            gradient[mine],
            gradient[others],
        )


def _updated(
    model: PadModel, bench: _Bench, shared: Array, information: Array, explained: Mask
) -> PadModel:
    """The pad as found, with what is left uncertain and words on what changed."""
    unsure, found, pad = bench.unsure, model.calibration, model.sensor
    assert found is not None
    covariance = inverse(information)
    told = list(_told(bench, shared, covariance))
    # what frames do not tell of stays; the rest is as it is then
    groups = (unsure.group(path) for one in told if not one.known for path in one.paths)
    left = [np.arange(group.begin, group.end) for group in groups if group is not None]
    if left:
        kept = np.concatenate(left)
        off = (shared - bench.prior[0])[kept]
        moved = covariance[:, kept] @ np.linalg.solve(covariance[np.ix_(kept, kept)], off)
        shared = shared - moved
    unit, values, mean = np.ones(len(shared)), {}, np.zeros(len(shared))
    rough = unsure.group(RESIDUAL)
    assert rough is not None
    mean[rough.place] = shared[rough.place]
    for group in unsure.groups:
        if unsure.lasting[group.begin] and group.path != RESIDUAL:
            unit[group.begin] = group.std
            moved = group.std * float(shared[group.begin])
            values[group.path] = stated_value(pad, group.path) + moved
    whole = covariance * np.outer(unit, unit)
    squares = np.asarray(np.square(mean) + np.diag(covariance), dtype=float)[rough.place]
    made, known, _ = known_pad(unsure, with_values(pad, values), whole, mean, squares)
    influence = model.influence
    later = characterize_pad(made, None, len(influence.x), len(influence.profile))
    begins = [unsure.group(name) for name in found.names]
    own = np.array([group.begin for group in begins if group is not None])
    reached = np.array([stated_value(made, name) for name in found.names])
    relative = np.array([name.startswith("camera") for name in found.names])
    relative = np.where(relative, 1.0, reached)
    calibration = replace(
        found,
        values=reached,
        covariance=whole[np.ix_(own, own)] / np.outer(relative, relative),
        outliers=tuple(np.flatnonzero(~explained).tolist()),
        usable=bool(explained.mean() >= EXPLAINED),
        record=None,
        findings=(*missed(explained), *map(str, told), FORCES),
    )
    return replace(later, provenance=model.provenance, calibration=calibration, known=known)


def _told(bench: _Bench, shared: Array, covariance: Array) -> Iterator[Told]:
    """What the frames tell of each thing that may drift."""
    unsure, pad = bench.unsure, bench.unsure.model.sensor
    mean, precision = bench.prior
    before = inverse(precision)

    def told(name: str, unit: str, digits: str, path: str, change: Array) -> Told:
        std, first = (float(np.sqrt(change @ c @ change)) for c in (covariance, before))
        return Told(name, unit, digits, (path,), float(change @ (shared - mean)), std, first)

    for path, name, unit, digits, size in (
        ("camera.amplitude", "The light", " %", ".1f", 100 / pad.camera.amplitude),
        ("camera.offset", "The dark level", " grey levels", ".2f", 1.0),
        (RESIDUAL, "The residual", " rad where it changed most", ".2f", 1.0),
        ("camera.shift_x", "The camera's place along x", " mm", ".3f", 1e3),
        ("camera.shift_y", "The camera's place along y", " mm", ".3f", 1e3),
        ("camera.scale", "The camera's scale", " %", ".3f", 100.0),
    ):
        group = unsure.group(path)
        if group is None:
            continue
        change = np.zeros(len(shared))
        change[group.place] = size * group.std
        if path == RESIDUAL:
            change[group.place] = _most(unsure, (shared - mean)[group.place])
        yield told(name, unit, digits, path, change)


def _most(unsure: PadUncertainty, change: Array) -> Array:
    """What the modes of the residual are worth where they change it most, shape (r,) [rad]."""
    base = unsure.model.influence
    fields, _ = unsure.residual_at(base.x[::4], base.y[::4])
    parts = change.reshape(2, -1) @ fields
    part, place = np.unravel_index(np.abs(parts).argmax(), parts.shape)
    found = np.zeros((2, len(fields)))
    found[part] = fields[:, place]
    return found.ravel()
