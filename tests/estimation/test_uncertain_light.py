"""Loads under uncertain light have the moments of the exact posterior, summed by other means."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax
from scipy.stats import multivariate_t

import fringeforce as ff
from fringeforce.estimation.frame_climb import climb
from fringeforce.estimation.frame_exposure import expose, node_phase
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.posterior import Posterior, Top
from fringeforce.models.uncertainty import uncertainty

Array = NDArray[np.float64]

TACTELS, SAMPLES = 7, 60000


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
    truth[: at.loads] = 0, 0, 0, 0, 0.5, 0.1, 0.35, -0.05, 0.2, 0.0, 0, 0, 0, 0
    truth *= (np.pi - nearest) / np.abs(node_phase(model, truth)).max()
    levels = expose(model, truth)[0]
    frame = np.round(levels + rng.uniform(-10, 10, len(levels)))
    precision = np.ones(at.size)
    precision[: at.loads] = 1 / 2.0**2
    posterior = Posterior(model, Prior(np.zeros(at.size), precision, -1.0, 1e3), frame)
    return posterior, posterior.climbed(truth, heats=(), steps=(0, 50), tolerance=1e-6)


def _exact(posterior: Posterior, top: Top) -> tuple[Array, Array, float]:
    """Mean and covariance of the loads by importance sampling, effective share of the samples."""
    model, prior, frame = posterior.model, posterior.prior, posterior.frame
    spread = 1.5 * np.linalg.inv(posterior.linearised(top).hessian)
    proposed = multivariate_t(top.unknowns, spread, df=4)
    drawn = proposed.rvs(SAMPLES, random_state=np.random.default_rng(5))
    losses = np.array([climb(model, prior, frame, one, 1.0, 0, 1.0)[1] for one in drawn])
    weights = softmax(-losses / 2 - proposed.logpdf(drawn))
    loads = drawn[:, : model.at.loads]
    mean = weights @ loads
    covariance = (weights[:, None] * (loads - mean)).T @ (loads - mean)
    return mean, covariance, float(1 / np.square(weights).sum() / SAMPLES)


def test_loads_under_uncertain_light_have_the_moments_of_the_exact_posterior(
    sensor: ff.Sensor,
) -> None:
    posterior, top = _posterior(sensor, nearest=0.4)
    light = posterior.relit(top)
    assert light is not None
    mean, covariance, share = _exact(posterior, top)
    assert share > 0.1
    count, deviation = posterior.model.at.loads, np.sqrt(np.diag(covariance))
    plain = top.unknowns[:count]
    assert np.abs((plain - mean) / deviation).max() > 0.25
    assert np.abs((plain + light.offset - mean) / deviation).max() < 0.12
    laplace = np.linalg.inv(posterior.linearised(top).hessian)[:count, :count]
    stated = np.sqrt(np.diag(laplace + light.covariance))
    np.testing.assert_allclose(stated, deviation, rtol=0.06)
