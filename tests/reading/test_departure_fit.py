"""Fits of one departure, from phases that may be those of other loads."""

from dataclasses import replace

import numpy as np

import fringeforce as ff
from fringeforce.estimation.posterior import Top
from fringeforce.reading.departure_fit import begin
from fringeforce.reading.diagnosis import Diagnosis
from fringeforce.reading.strip_reader import StripFrameReader

FRAMES, STEEPEST = 8, 30.0


def test_no_blur_wider_than_the_strip_is_tried_from_a_wrong_phase() -> None:
    """The loss of a frame says little of where its top is, far from there."""
    loose = {"camera.pixels": 512, "tactels.placement": "0 +/- 0.05 mm"}
    model = ff.characterize(ff.load_sensor("saad").replace(**loose))
    single = StripFrameReader(model)
    (blur,) = [one for one in Diagnosis(single).departures.all if one.path == "camera.blur"]
    assert blur.one is not None
    rng, widest = np.random.default_rng(0), list[float]()

    def noted(own, size):
        widest.append(size)
        assert size < model.sensor.transducer.length
        return blur.one(own, size)

    for _ in range(FRAMES):
        size, angle = rng.uniform(0, 4, (2, 11)), rng.uniform(-STEEPEST, STEEPEST, (2, 11))
        forces, others = ff.polar(size, angle)
        posterior = single.own_posterior(model.expose(forces, rng).astype(float))
        unknowns = np.zeros(posterior.model.at.size)
        unknowns[: others.size] = others.ravel()
        wrong = posterior.phase(Top(unknowns, 0.0, 0.0, 0.0))
        begin(posterior, replace(blur, one=noted), wrong).finish()
    assert max(widest) > 2 * blur.deviation
