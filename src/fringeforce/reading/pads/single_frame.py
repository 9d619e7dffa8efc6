"""One frame of a pad to one reading, without any earlier state or from forces nearly right."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import InputError
from fringeforce.estimation.covariance import covariance_of
from fringeforce.estimation.levenberg_marquardt import Curvature
from fringeforce.estimation.likelihood import Response
from fringeforce.models.imaging import camera_response
from fringeforce.models.pad import PadModel
from fringeforce.optics.arrangement import signed
from fringeforce.reading.frame_reader import FrameReader
from fringeforce.reading.pads.fit import Fit, Optimum, Start
from fringeforce.reading.pads.mirror_images import Mirror, Verdict, are_apart, weighed
from fringeforce.reading.pads.sampling import Sampling, lattice
from fringeforce.reading.pads.search import Search
from fringeforce.reading.pads.verdict import FrameClassifier
from fringeforce.reading.reading import Reading

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FOLLOWED, STEPPED, STATED = 32, 48, 64
"""Rows and columns of pixels of the matrix of followed and searched frames, and of a covariance."""
DEPTH = 4
"""Times that mirror images are tried, each time of what is likelier than all before."""
PROMISING = 0.5
"""Mean square by which a mirror image may be worse than what it is an image of, to be tried."""


@dataclass(frozen=True, eq=False)
class PadFrameReader(FrameReader):
    """Reads frames of one pad, each for itself or from forces that are nearly right."""

    model: PadModel

    def __post_init__(self) -> None:
        if self.friction is not None:
            raise InputError("friction is for strips; read a pad without it.")

    @cached_property
    def response(self) -> Response:
        """What the camera makes of light."""
        return camera_response(self.model.sensor.camera)

    @cached_property
    def _following(self) -> Sampling:
        return lattice(self.model, FOLLOWED)

    @cached_property
    def _stepping(self) -> Sampling:
        return lattice(self.model, STEPPED)

    @cached_property
    def _stating(self) -> Sampling:
        return lattice(self.model, STATED)

    @cached_property
    def _search(self) -> Search:
        forms = np.concatenate([picture.forms for picture in self.model.pictures])
        if not signed(forms):
            raise InputError(
                "Frames of this polariscope are the same for a force and its negative, so that "
                "nothing can be read without an earlier state; take a polarisation camera, or "
                'channels with arrangement = "analyser" at two angles, 45 degrees apart.'
            )
        return Search(self.model, self.response)

    @cached_property
    def _mirror(self) -> Mirror:
        waves = {picture.dispersion for picture in self.model.pictures}
        return Mirror(self._search.places, tuple(sorted(waves)))

    def search(self, levels: NDArray[Any], used: Mask, start: Array | None = None) -> Reading:
        """Read a frame that was checked, without an earlier state or from forces (n, 3) [N]."""
        classifier = self._classifier(used)
        return self._searched(classifier.filled(levels), start, classifier)[0]

    def found(
        self, levels: NDArray[Any], used: Mask, start: Start | None, known: Curvature | None
    ) -> tuple[Reading, Optimum]:
        """Reading of a frame that comes soon after another, and where it is.

        Parameters
        ----------
        levels, used
            As of `search`.
        start : Start or None
            Where to follow it from; it is searched without one, and where following fails.
        known : Curvature or None
            Of a place near by.
        """
        classifier = self._classifier(used)
        grey = classifier.filled(levels)
        if start is not None:
            optimum = self._fit(grey, self._following, classifier).climb(start, 6, known)
            if classifier.explained(optimum):
                curvature, none = optimum.curvature, np.empty((0, len(optimum.forces)))
                verdict = Verdict(optimum.forces, curvature.information, none)
                spread = partial(getattr, curvature, "covariance")
                return classifier.reading(grey, optimum, verdict, spread, tracked=True), optimum
        return self._searched(grey, None, classifier)

    def _searched(
        self, levels: Array, start: Array | None, classifier: FrameClassifier
    ) -> tuple[Reading, Optimum]:
        """Reading of a frame without an earlier state, or from a start, and where it is."""
        fit = self._fit(levels, self._stepping, classifier)
        if start is not None:
            optima, sure = [fit.climb(self.model.checked(start, single=True).ravel())], True
        else:
            optima, sure = self._explanations(fit, classifier)
        fine = self._fit(levels, self._stating, classifier).information(optima[0].place)
        if not classifier.explained(optima[0]):
            return classifier.unexplained(levels, optima[0], partial(covariance_of, fine)), optima[
                0
            ]
        if start is None:
            sure = sure and self._stays_this_side(fine)
        verdict = weighed([optimum for optimum in optima if classifier.explained(optimum)], fine)
        spread = partial(covariance_of, verdict.information)
        return classifier.reading(levels, optima[0], verdict, spread, sure=sure), optima[0]

    def _explanations(self, fit: Fit, classifier: FrameClassifier) -> tuple[list[Optimum], bool]:
        """Where a search, and mirror images of what it finds, lead, and whether that is all.

        The likeliest comes first.
        """
        optima: list[Optimum] = []
        sure = False
        for forces, whole in self._search.attempts(fit.frame, classifier.used):
            optima.append(fit.climb(forces))
            plain = classifier.plain(fit.frame, optima[-1])
            sure |= whole or plain
            if classifier.explained(optima[-1]) and plain:
                break
        optima.sort(key=lambda optimum: optimum.misfit.loss)
        return (
            self._with_images(fit, classifier, optima)
            if classifier.explained(optima[0])
            else optima
        ), sure

    def _stays_this_side(self, information: Array) -> bool:
        """Whether no push is uncertain by as much as takes retardance from one fold to beyond it.

        Where one is, as may be where a mask hides its tactel, deviations, which are those of a
        linear model, do not say how far other forces are that explain a frame as well.
        """
        deviations = np.sqrt(np.diag(covariance_of(information))[::3])
        most = self._search.strongest * max(self._mirror.dispersions)
        return bool(deviations.max() * most < np.pi / 2)

    def _with_images(
        self, fit: Fit, classifier: FrameClassifier, optima: list[Optimum]
    ) -> list[Optimum]:
        """Explanations, and where their mirror images lead, the likeliest first."""
        shown = None
        if classifier.used is not None:
            counts = classifier.used.reshape(len(self.model.pictures), -1)
            shown = np.asarray(counts.any(axis=0), dtype=bool)
        for _ in range(DEPTH):
            likeliest = optima[0]
            for forces in self._mirror.images(likeliest.forces, shown):
                start = fit.at(forces)
                if fit.misfit(start).loss < likeliest.misfit.loss + PROMISING * self._pixels:
                    optima.append(fit.climb(start))
            optima.sort(key=lambda optimum: optimum.misfit.loss)
            # what returned to where it was an image of has the same images again
            known = likeliest.curvature.information
            if not are_apart(optima[0].forces, likeliest.forces, known):
                break
        return optima

    def bound(self, forces: ArrayLike) -> Array:
        """Smallest deviations that an unbiased reading can have, shape (n, 3) [N]."""
        loads = self.model.checked(forces, single=True)
        fit = self._fit(np.zeros(self._pixels), self._stating, self._classifier(self.usable(None)))
        information = fit.information(fit.at(loads.ravel()))
        return np.sqrt(np.diag(covariance_of(information))).reshape(loads.shape)

    def phase(self, forces: Array) -> Array:
        """Retardance over both passes, shape (2, rows, columns) [rad]."""
        return self.model.retardance(forces)

    def trial_forces(self) -> Array:
        """A newton on the tactel in the middle, shape (n, 3) [N]."""
        forces = np.zeros(self.forces_shape)
        forces[len(forces) // 2, 0] = 1.0
        return forces

    @property
    def _pixels(self) -> int:
        return int(np.prod(self.model.frame_shape))

    def _classifier(self, used: Mask) -> FrameClassifier:
        if self.complete(used):
            return self._unmasked
        last = self._last.get("classifier")
        if last is None or last.used is not used:
            last = self._last["classifier"] = FrameClassifier(self.model, self.response, used)
        return last

    @cached_property
    def _last(self) -> dict[str, FrameClassifier]:
        """The judge of the last mask, which others with the same mask take."""
        return {}

    @cached_property
    def _unmasked(self) -> FrameClassifier:
        return FrameClassifier(self.model, self.response)

    def _fit(self, levels: Array, sampling: Sampling, classifier: FrameClassifier) -> Fit:
        return Fit(self.model, self.response, sampling, levels, classifier.used)
