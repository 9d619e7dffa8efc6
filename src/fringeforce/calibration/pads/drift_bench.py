"""Frames of a pad that may have drifted, and what they say of it together.

Of its own every frame has its forces, unless they are known, or the contacts of a skin, the gain of
its light, and the shapes of contacts on tactels.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.progress import Progress
from fringeforce.calibration.drift_report import ROUNDS
from fringeforce.estimation.levenberg_marquardt import Curvature, Expansion, Stop, minimise
from fringeforce.estimation.likelihood import Misfit
from fringeforce.estimation.residual_test import square_limit
from fringeforce.estimation.shared_fit import Eliminated, FrameTerms
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_skin import SIZE_OF
from fringeforce.models.pad_uncertainty import PadUncertainty, Reference
from fringeforce.reading.pads.fit import Fit
from fringeforce.reading.pads.light import Prior
from fringeforce.reading.pads.pad_frames import PadFrames
from fringeforce.reading.pads.sampling import Sampling, for_steps
from fringeforce.reading.pads.single_frame import Earlier, PadFrameReader
from fringeforce.reading.pads.skin_reader import PadSkinReader
from fringeforce.reading.reading import Reading

CLOSE, NEAR = 0.1, 1.0
"""Falls of the loss, in squared deviations of all unknowns together, that a step promises below
which it need not be evaluated, and below which it is the last."""


class DriftFrame:
    """One frame with all of its unknowns: of what presses, then of tolerances.

    Parameters
    ----------
    bench : DriftBench
        Of all frames.
    fit : Fit or SkinFit
        Without a prior of what lasts.
    start : ndarray, shape (m + q,)
        Where to begin.
    explained : bool
        Whether that explains the frame, but for what the others say.
    """

    def __init__(self, bench: DriftBench, fit: Any, start: Array, explained: bool) -> None:
        self.fit, self.start, self.explained = fit, start, explained
        self.unsure = bench.unsure
        self.count = len(start) - self.unsure.size
        lasting = self.unsure.lasting
        own = self.count + np.flatnonzero(~lasting)
        self.mine = own if bench.known is not None else np.append(np.arange(self.count), own)
        self.others = self.count + np.flatnonzero(lasting)

    def at(self, own: Array, shared: Array) -> tuple[Any, Misfit]:
        """The frame for values of its own unknowns and of what lasts."""
        whole = self.start.copy()
        whole[self.mine], whole[self.others] = own, shared
        return self.evaluated(*np.split(whole, [self.count]))

    def evaluated(self, forces: Array, extra: Array) -> tuple[Any, Misfit]:
        """The frame under forces and unknowns of tolerances."""
        place = self.fit.at(forces, extra)
        return place, self.fit.misfit(place)

    def by_unknowns(self, place: Any, left: Misfit) -> tuple[Array, Array]:
        """Half the derivatives of the loss, first and second."""
        return self.fit.gradient(place, left), self.fit.information(place)

    def terms(self, place: Any, left: Misfit, used: Mask) -> FrameTerms:
        """Half the loss of the frame to second order."""
        gradient, information = self.by_unknowns(place, left)
        # it takes all pixels for alike, which tells light from dark where no frame does
        camera, own = self.unsure.camera, (~self.unsure.lasting).astype(float)
        amplitude = self.unsure.group("camera.amplitude")
        assert amplitude is not None
        first, response = self.count + amplitude.begin, self.fit.response
        bright = camera.brightness[amplitude.begin] * response.amplitude * place.intensity[used]
        if place.bend is not None:
            bright = bright * place.bend[used]
        exact = float(bright @ bright / response.variance)
        scale = np.ones(len(gradient))
        brightness = scale[self.count : self.count + camera.size]
        brightness[camera.brightness != 0] = np.sqrt(exact / information[first, first])
        prior = np.diag(np.concatenate([np.zeros(self.count), own]))
        information = (information - prior) * np.outer(scale, scale) + prior
        mine, others = self.mine, self.others
        return FrameTerms(
            information[np.ix_(mine, mine)],
            information[np.ix_(mine, others)],
            information[np.ix_(others, others)],
            gradient[mine],
            gradient[others],
        )


class _SkinFrame(DriftFrame):
    """One frame of a skin: of what presses, the unknowns of its contacts, (k, SIZE_OF)."""

    def evaluated(self, forces: Array, extra: Array) -> tuple[Any, Misfit]:
        """The frame under contacts and unknowns of tolerances."""
        place = self.fit.at(forces.reshape(-1, SIZE_OF), extra)
        return place, place.left

    def by_unknowns(self, place: Any, left: Misfit) -> tuple[Array, Array]:
        """Half the derivatives of the loss, first and second."""
        free = np.ones(place.contacts.shape, dtype=bool)
        return self.fit.gradient(place, free), self.fit.information(place, free)


class DriftState(NamedTuple):
    """Values of all unknowns, and every frame there."""

    shared: Array
    own: list[Array]
    places: list[tuple[Any, Misfit]]
    loss: float


class DriftBench(ABC):
    """Frames of a pad that may have drifted.

    Parameters
    ----------
    reader : PadFrames
        Of the pad with all drift as tolerances, which finds each frame by itself.
    unsure : PadUncertainty
        What is uncertain about the pad.
    levels : ndarray, shape (F, P)
        Grey levels.
    known : ndarray, shape (F, 3n), optional
        Forces [N].
    """

    def __init__(
        self, reader: PadFrames, unsure: PadUncertainty, levels: Array, known: Array | None
    ) -> None:
        self.reader, self.unsure, self.levels, self.known = reader, unsure, levels, known

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

    @cached_property
    def own_prior(self) -> Prior:
        """Of the unknowns of tolerances of single frames."""
        unsure = self.unsure
        return Prior(np.zeros(unsure.size), np.diag((~unsure.lasting).astype(float)))

    @abstractmethod
    def begun(self, f: int) -> DriftFrame:
        """A frame as it is explained by itself."""

    def checked(self, f: int) -> NDArray[Any] | None:
        """Grey levels of a frame, or nothing if it cannot be used."""
        image = self.levels[f].reshape(self.reader.model.frame_shape)
        checked = self.reader.checked(image, self.used)
        return None if isinstance(checked, Reading) else checked

    def together(
        self,
        frames: Sequence[DriftFrame],
        report: Progress,
        total: int,
        start: Array | None = None,
    ) -> tuple[DriftState, Array, Mask]:
        """What all frames say together, its information (S, S), and which frames are explained.

        Parameters
        ----------
        frames : sequence of DriftFrame
            As explained one by one.
        report : callable
            Told what is done, of a total of steps.
        total : int
            Number of these.
        start : ndarray, shape (S,), optional
            Of what all frames share; its mean before any frame if not given.
        """
        kept = np.array([frame.explained for frame in frames])
        mean, precision = self.prior

        def at(shared: Array, own: list[Array]) -> DriftState:
            loss = float((shared - mean) @ precision @ (shared - mean))
            places = []
            for frame, values in zip(frames, own, strict=True):
                places.append(frame.at(values, shared))
                loss += frame.explained * places[-1][1].loss
            return DriftState(shared, own, places, loss)

        def told(state: DriftState) -> tuple[list[Eliminated], Array, Array]:
            gradient, information = precision @ (state.shared - mean), precision.copy()
            found = []
            for frame, (place, left) in zip(frames, state.places, strict=True):
                found.append(Eliminated.of(frame.terms(place, left, self.used)))
                gradient = gradient + frame.explained * found[-1].gradient
                information += frame.explained * found[-1].information
            return found, gradient, information

        def expand(state: DriftState) -> Expansion[DriftState]:
            report("Finding what drifted in all frames", len(frames), total)
            found, gradient, information = told(state)

            def ahead(step: Array) -> tuple[DriftState, float]:
                own = [
                    value + one.step + one.response @ step
                    for value, one in zip(state.own, found, strict=True)
                ]
                there = at(state.shared + step, own)
                return there, there.loss

            return Expansion(state.loss, gradient, lambda: Curvature(information), ahead)

        own = [frame.start[frame.mine] for frame in frames]
        first = at(mean if start is None else start, own)
        reached = minimise(first, expand, ROUNDS, Stop(close=CLOSE, near=NEAR), damping=0.0).place
        squares = np.array([left.slope @ left.slope for _, left in reached.places])
        return reached, told(reached)[2], kept & (squares <= square_limit(int(self.used.sum())))


class TactelBench(DriftBench):
    """Frames of forces on tactels, or on squares of a skin if they are known."""

    def __init__(self, model: PadModel, levels: Array, known: Array | None) -> None:
        self._single = PadFrameReader(model)
        assert self._single.uncertain is not None
        super().__init__(self._single, self._single.uncertain, levels, known)

    @cached_property
    def _sampling(self) -> Sampling:
        return for_steps(self.unsure.model, self.unsure)

    def begun(self, f: int) -> DriftFrame:
        """A frame as it is explained by itself."""
        forces = np.zeros(3 * self.unsure.model.sensor.tactels.total)
        extra, fine = self.unsure.expected[0], self.known is not None
        if self.known is not None:
            forces = self.known[f]
        elif (checked := self.checked(f)) is not None:
            _, optimum = self._single.found(checked, self.used, Earlier())
            fine = self._single.classifier(self.used).explained(optimum)
            forces, extra = optimum.forces, optimum.extra
        used = None if self.used.all() else self.used
        unsure, grey, response = self.unsure, self.levels[f], self.reader.response
        about = Reference(forces, extra)
        fit = Fit(unsure.model, response, self._sampling, grey, used, self.own_prior, about)
        return DriftFrame(self, fit, np.concatenate([forces, extra]), fine)


class SkinBench(DriftBench):
    """Frames of contacts anywhere that nobody knows."""

    def __init__(self, model: PadModel, levels: Array, known: Array | None) -> None:
        self._single = PadSkinReader(model)
        assert self._single.uncertain is not None
        super().__init__(self._single, self._single.uncertain, levels, known)

    def begun(self, f: int) -> DriftFrame:
        """A frame as it is explained by itself."""
        contacts, extra, fine = np.zeros((0, SIZE_OF)), self.unsure.expected[0], False
        if (checked := self.checked(f)) is not None:
            reading, one = self._single.found(checked, self.used)
            fine = reading.trusted
            if one is not None:
                contacts, extra = one.contacts, one.extra
        classifier = self._single.classifier(self.used)
        fit = replace(self._single.fit(self.levels[f], classifier), prior=self.own_prior)
        return _SkinFrame(self, fit, np.concatenate([contacts.ravel(), extra]), fine)
