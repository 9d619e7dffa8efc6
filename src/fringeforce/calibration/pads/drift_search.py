"""The search for a pad that drifted since its calibration, under presses that are known."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.bench_expectation import DOUBT
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.fit import BenchFit
from fringeforce.calibration.pads.bench_uncertainty import OWN, BenchUncertainty, is_layer
from fringeforce.calibration.pads.search import PadSearch
from fringeforce.calibration.shared_unknowns import Expected, ExpectedTogether
from fringeforce.calibration.timed_loads import TimedLoads
from fringeforce.design.tolerances import Tolerances
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_uncertainty import PadUncertainty


class DriftSearch(PadSearch):
    """As of a calibration, with what is known of the pad before the frames.

    Parameters
    ----------
    model : PadModel
        Calibrated, with what is known of it widened by the drift.
    levels : ndarray, shape (F, P)
        Grey levels.
    loads : BenchLoads or TimedLoads
        What is written down of them.
    """

    def __init__(self, model: PadModel, levels: Array, loads: BenchLoads | TimedLoads) -> None:
        paths = tuple(path for path in model.sensor.tolerances if is_layer(path))
        super().__init__(model.sensor, levels, loads, paths, model=model)
        shared = np.zeros(self.bench.at.size)
        shared[self.bench.at.own("pad")] = self.prior[0]
        self.state = replace(self.state, shared=shared)

    def uncertain_of(self, model: PadModel, paths: tuple[str, ...]) -> BenchUncertainty:
        """What the calibration and the drift leave uncertain, and the lamp."""
        pad = model.sensor
        stated = {path: std for path, std in pad.tolerances.items() if path not in OWN}
        drift = pad.camera.drift or DOUBT["gain"]
        update = {
            "tolerances": Tolerances(stated),
            "camera": pad.camera.model_copy(update={"drift": drift}),
        }
        loose = replace(model, sensor=pad.model_copy(update=update))
        return BenchUncertainty(PadUncertainty.of(loose).model)

    @cached_property
    def prior(self) -> tuple[Array, Array]:
        """Mean, shape (S,), and precision, (S, S), of what lasts of the pad."""
        lasting, (mean, precision) = self.known.lasting, self.known.expected
        return mean[lasting], precision[np.ix_(lasting, lasting)]

    def expected(self) -> Expected:
        """What is known before the frames are seen."""
        plain, own = super().expected(), self.bench.at.own("pad")
        mean, together = np.zeros(len(plain.precision)), plain.information
        mean[own], together[own, own] = self.prior
        return ExpectedTogether(plain.precision, plain.sizes, mean=mean, together=together)

    def fields(self) -> dict[str, slice]:
        """Nothing: how rough the residual is, the calibration and the drift say."""
        return {}

    def uncertain(self, fit: BenchFit) -> Array:
        """Covariance of what lasts of the pad, shape (S, S).

        Small errors of contacts' tractions are another in every frame, and make what frames tell
        scatter by more than their noise.
        """
        own = fit.posterior.bench.at.own("pad")
        covariance = fit.covariance
        before = covariance @ fit.posterior.expected.information @ covariance
        more = np.sqrt(np.maximum(fit.excess, max(fit.chi2, 1.0)))
        whole = before + np.outer(more, more) * (covariance - before)
        return whole[own, own]
