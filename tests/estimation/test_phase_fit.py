"""Tops that are reached through the phase are those of damped steps; bins have means of pixels."""

import numpy as np
import pytest
from numpy.typing import NDArray

import fringeforce as ff
from fringeforce.estimation.binning import binned, means, seen_means
from fringeforce.estimation.frame_climb import climb
from fringeforce.estimation.frame_exposure import expose, node_phase
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.frame_model import FrameModel
from fringeforce.estimation.phase_fit import contact_coordinates
from fringeforce.estimation.posterior import Posterior
from fringeforce.models.uncertainty import uncertainty
from uncertain_strip import TOLERANCES

Array = NDArray[np.float64]
NOISE = 5.0


@pytest.fixture(
    scope="module",
    params=[{}, {"camera.response": "0.45", "camera.drift": "1 %", "camera.shift": "0 +/- 50 um"}],
    ids=["linear", "gamma, drift and shift"],
)
def strip(request: pytest.FixtureRequest, sensor: ff.Sensor) -> FrameModel:
    return uncertainty(ff.characterize(sensor.replace(**TOLERANCES, **request.param))).frame


@pytest.fixture(scope="module")
def unknowns(strip: FrameModel) -> Array:
    rng, at = np.random.default_rng(4), strip.at
    found = 0.7 * rng.standard_normal(at.size)
    found[: at.loads : 2] = rng.uniform(0.3, 1.0, at.loads // 2)
    found[1 : at.loads : 2] *= 0.3
    return found


@pytest.fixture(scope="module")
def posterior(strip: FrameModel, unknowns: Array) -> Posterior:
    rng = np.random.default_rng(5)
    levels = expose(strip, unknowns)[0]
    frame = np.round(levels + rng.uniform(-NOISE, NOISE, len(levels)))
    precision = np.ones(strip.at.size)
    precision[: strip.at.loads] = 0.25
    return Posterior(strip, Prior(np.zeros(strip.at.size), precision, -1.0, 0.05), frame)


def test_coordinates_hold_the_phase_of_contacts(strip: FrameModel, unknowns: Array) -> None:
    basis, contacts = contact_coordinates(strip)
    loaded = unknowns.copy()
    loaded[strip.at.fields : strip.at.modes] = 0
    phase = node_phase(strip, loaded) - strip.fixed
    assert np.abs(node_phase(contacts, loaded) @ basis - phase).max() < 1e-3 * np.abs(phase).max()


def test_a_start_settles_on_the_top_of_damped_steps(posterior: Posterior, unknowns: Array) -> None:
    model, prior = posterior.model, posterior.prior
    start = unknowns + 0.02 * np.random.default_rng(6).standard_normal(len(unknowns))
    exact, loss, *_ = climb(model, prior, posterior.frame, unknowns, 1.0, 60, 1e-6)
    top = posterior.settled(start, heats=(10.0,), tolerance=1e-4)
    spread = np.sqrt(np.diag(posterior.spread(top)))
    assert top.loss == pytest.approx(loss, abs=0.3)
    assert (np.abs(top.unknowns - exact) < 0.3 * spread).all()


@pytest.mark.parametrize("size", [2, 4])
def test_bins_show_the_means_of_their_pixels(strip: FrameModel, unknowns: Array, size: int) -> None:
    whole = means(expose(strip, unknowns)[0], size, len(strip.bias))
    bins = binned(strip, size)
    assert (np.abs(expose(bins, unknowns)[0] - whole) < np.sqrt(bins.variance) / 4).all()


def test_bins_of_which_half_is_not_seen_are_not_used() -> None:
    frame = np.array([1.0, np.nan, 3.0, np.nan, np.nan, 5.0, 7.0, 8.0, 9.0])
    assert np.array_equal(seen_means(frame, 4, 1), [2.0, 20 / 3])
