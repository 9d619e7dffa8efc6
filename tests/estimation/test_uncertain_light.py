"""Loads under uncertain light have the moments of the exact posterior, summed by other means."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import softmax
from scipy.stats import multivariate_t

import fringeforce as ff
from fringeforce.estimation.frame_climb import climb
from fringeforce.estimation.frame_exposure import expose, node_phase
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.posterior import Posterior, Top
from fringeforce.estimation.uncertain_light import light_direction
from fringeforce.models.uncertainty import uncertainty

Array = NDArray[np.float64]

TACTELS, SAMPLES = 5, 40000


def _posterior(sensor: ff.Sensor, nearest: float) -> tuple[Posterior, Top]:
    """Of loads whose phase comes so near to -pi where light is brightest [rad]."""
    drawing = {
        "transducer.edges": "roller",
        "tactels.count": TACTELS,
        "camera.pixels": 256,
        "camera.noise": 10,
        "camera.offset": 12,
        "camera.amplitude": "230 +/- 10 %",
    }
    model = uncertainty(ff.characterize(sensor.replace(**drawing))).frame
    at, rng = model.at, np.random.default_rng(3)
    truth = np.zeros(at.size)
    truth[: at.loads] = 0.3, 0.1, 0.5, 0.1, 0.2, 0.0, 0.35, -0.05, 0.4, -0.1
    truth *= (np.pi - nearest) / np.abs(node_phase(model, truth)).max()
    levels = expose(model, truth)[0]
    frame = np.round(levels + rng.uniform(-10, 10, len(levels)))
    precision = np.ones(at.size)
    precision[: at.loads] = 1 / 2.0**2
    posterior = Posterior(model, Prior(np.zeros(at.size), precision, -1.0, 1e3), frame)
    return posterior, posterior.climbed(truth, heats=(), steps=(0, 50), tolerance=1e-6)


def _exact(posterior: Posterior, tops: list[Top]) -> tuple[Array, Array, float]:
    """Mean and covariance of the loads by importance sampling, effective share of the samples."""
    model, prior, frame = posterior.model, posterior.prior, posterior.frame
    rng = np.random.default_rng(5)
    proposed = [
        multivariate_t(top.unknowns, 2 * np.linalg.inv(posterior.linearised(top).hessian), df=4)
        for top in tops
    ]
    drawn = np.concatenate([one.rvs(SAMPLES // len(tops), random_state=rng) for one in proposed])
    density = np.logaddexp.reduce([one.logpdf(drawn) for one in proposed], axis=0)
    losses = np.array([climb(model, prior, frame, one, 1.0, 0, 1.0)[1] for one in drawn])
    weights = softmax(-losses / 2 - density)
    loads = drawn[:, : model.at.loads]
    mean = weights @ loads
    covariance = (weights[:, None] * (loads - mean)).T @ (loads - mean)
    return mean, covariance, float(1 / np.square(weights).sum() / len(drawn))


@pytest.mark.parametrize("nearest", [0.3, 0.5, 0.8])
def test_loads_under_uncertain_light_have_the_moments_of_the_exact_posterior(
    sensor: ff.Sensor, nearest: float
) -> None:
    posterior, top = _posterior(sensor, nearest)
    light = posterior.relit(top)
    assert light is not None
    mean, covariance, share = _exact(
        posterior, [top, *(posterior.settled(end) for end in light.ends)]
    )
    assert share > 0.05
    count, deviation = posterior.model.at.loads, np.sqrt(np.diag(covariance))
    plain = top.unknowns[:count]
    assert np.abs((plain - mean) / deviation).max() > 1.0
    assert np.abs((plain + light.offset - mean) / deviation).max() < 0.35
    laplace = np.linalg.inv(posterior.linearised(top).hessian)[:count, :count]
    assert np.sqrt(np.diag(laplace) / np.diag(covariance)).min() < 0.6
    stated = np.sqrt(np.diag(laplace + light.covariance)) / deviation
    assert stated.min() > 0.9
    assert stated.max() < 1.2


def test_light_that_an_extreme_shows_or_that_is_known_moves_no_loads(sensor: ff.Sensor) -> None:
    posterior, top = _posterior(sensor, nearest=-0.5)
    count = posterior.model.at.loads
    deviation = np.sqrt(np.diag(np.linalg.inv(posterior.linearised(top).hessian)))[:count]
    if light := posterior.relit(top):
        assert np.abs(light.offset / deviation).max() < 0.2
    known = uncertainty(ff.characterize(sensor)).frame
    assert light_direction(known, np.eye(known.at.size)) is None
