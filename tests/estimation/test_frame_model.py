"""Frames and their derivatives with every tolerance at once, against differences and dense fits."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import ive

import fringeforce as ff
from fringeforce.estimation.frame_climb import climb
from fringeforce.estimation.frame_exposure import (
    expose,
    kernel_of,
    node_columns,
    node_phase,
    positive,
)
from fringeforce.estimation.frame_information import information
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.frame_model import (
    FrameModel,
    turned_moments,
)
from fringeforce.estimation.linearised_frame import linearise
from fringeforce.models.uncertainty import uncertainty
from uncertain_strip import COLOURS, TOLERANCES

Array = NDArray[np.float64]
STEP = 1e-5
LIGHTS = ({"amplitude": "180 +/- 3 %"}, {}, {"amplitude": "150 +/- 5 %", "offset": "9 +/- 0.5"})
UNEQUAL = [one | light for one, light in zip(COLOURS["polariscope.channels"], LIGHTS, strict=True)]
KERNEL = kernel_of.py_func


@pytest.fixture(
    scope="module",
    params=[
        {},
        {
            "camera.response": "0.45",
            "camera.drift": "1 %",
            "camera.shift": "0 +/- 50 um",
            "transducer.photoelastic.strain_optic_coefficient": "0.05 +/- 3 %",
        },
        {
            **COLOURS,
            "camera.response": "0.45",
            "camera.gamma": "1 +/- 0.02",
            "camera.pixels": 512,
        },
    ],
    ids=["linear", "gamma, drift, shift and effect", "colours with cross-talk"],
)
def strip(request: pytest.FixtureRequest, sensor: ff.Sensor) -> FrameModel:
    return uncertainty(ff.characterize(sensor.replace(**TOLERANCES, **request.param))).frame


def some_unknowns(strip: FrameModel) -> Array:
    rng, at = np.random.default_rng(4), strip.at
    unknowns = 0.7 * rng.standard_normal(at.size)
    unknowns[: at.loads : 2] = rng.uniform(0.3, 2.0, at.loads // 2)
    unknowns[1 : at.loads : 2] *= 0.5
    return unknowns


def differences(strip: FrameModel, unknowns: Array) -> Array:
    """Derivatives of the grey levels, shape (P, size)."""
    ahead, behind = (
        [expose(strip, unknowns + sign * STEP * row)[0] for row in np.eye(len(unknowns))]
        for sign in (1, -1)
    )
    return (np.array(ahead) - np.array(behind)).T / (2 * STEP)


def test_columns_are_the_derivatives_of_the_phase(strip: FrameModel) -> None:
    unknowns = some_unknowns(strip)
    turned = [
        (node_phase(strip, unknowns + STEP * row) - node_phase(strip, unknowns - STEP * row))
        / (2 * STEP)
        for row in np.eye(len(unknowns))
    ]
    np.testing.assert_allclose(
        node_columns(strip, unknowns), turned, atol=1e-7 * np.abs(turned).max()
    )


def test_moments_of_contacts_under_modes_give_the_phase(strip: FrameModel) -> None:
    """Those of uniform pressures, by integrals of their powers, where modes are off."""
    unknowns, at = some_unknowns(strip), strip.at
    unknowns[at.fields : at.modes] = 0
    modes = unknowns[at.modes : at.modes + len(strip.influence)]
    moments, _ = turned_moments(strip, modes)
    places = strip.place * unknowns[at.place : at.width] / strip.reach
    drawn = strip.width + strip.width_std * unknowns[at.width : at.fields]
    wide = np.array([positive(width, strip.narrow)[0] for width in drawn])
    half, k = wide / (2 * strip.reach), np.arange(moments.shape[2])[:, None]
    powers = ((places + half) ** (k + 1) - (places - half) ** (k + 1)) / (2 * (k + 1) * half)
    forces = unknowns[: at.loads].reshape(-1, 2)
    expected = strip.fixed + np.einsum("nc,kn,nckm->m", forces, powers, moments)
    found = node_phase(strip, unknowns)
    np.testing.assert_allclose(found, expected, atol=1e-4 * np.abs(found).max())


def test_a_spread_wider_than_the_line_makes_it_even_and_ends(strip: FrameModel) -> None:
    unknowns = some_unknowns(strip)
    fringes = np.ptp(expose(strip, unknowns)[0])
    for far in (1e3, 1e12):  # the kernel of the latter would have 1e13 pixels
        unknowns[strip.at.blur] = far
        assert np.ptp(expose(strip, unknowns)[0]) < 0.2 * fringes


def test_linearised_loss_is_that_of_differences_of_exposed_frames(strip: FrameModel) -> None:
    rng, unknowns = np.random.default_rng(5), some_unknowns(strip)
    sigma = np.sqrt(strip.variance)
    # within 1.7 deviations, where every pixel counts as sound
    frame = expose(strip, unknowns)[0] + sigma * rng.uniform(-1.7, 1.7, len(strip.amplitude))
    frame = np.clip(frame, 1, strip.full_scale - 1)
    prior = Prior(
        rng.standard_normal(strip.at.size), rng.uniform(0.5, 2, strip.at.size), -1.0, np.inf
    )
    about = linearise(strip, prior, frame, unknowns)
    jacobian = differences(strip, unknowns) / sigma[:, None]
    rest = (expose(strip, unknowns)[0] - frame) / sigma
    hessian = jacobian.T @ jacobian + np.diag(prior.precision)
    gradient = jacobian.T @ rest + prior.precision * (unknowns - prior.mean)
    deviation = np.sqrt(np.diag(hessian))
    scaled = np.outer(deviation, deviation)
    np.testing.assert_allclose(about[0] / scaled, hessian / scaled, atol=0.1)
    # the fringes' blur is taken out of the columns to first order
    spread, exact = (np.sqrt(np.diag(np.linalg.inv(matrix))) for matrix in (about[0], hessian))
    np.testing.assert_allclose(spread, exact, rtol=0.06)
    np.testing.assert_allclose(
        spread[: strip.at.loads].mean(), exact[: strip.at.loads].mean(), rtol=0.02
    )
    np.testing.assert_allclose(about[1] / deviation, gradient / deviation, atol=0.1)


def test_light_of_single_channels_acts_on_their_pixels(sensor: ff.Sensor) -> None:
    values = {**COLOURS, "polariscope.channels": UNEQUAL, "camera.unevenness": "3 %"}
    values |= {"camera.amplitude": 200.0}
    strip = uncertainty(ff.characterize(sensor.replace(**values))).frame
    unknowns, light = some_unknowns(strip), np.arange(strip.at.modes, strip.at.visibility)
    sigma, frame = np.sqrt(strip.variance), expose(strip, unknowns)[0] + 1.0
    jacobian = differences(strip, unknowns) / sigma[:, None]
    own = np.abs(jacobian[:, light]).reshape(3, -1, len(light)).max(axis=1) > 0
    assert own[:, :3].sum(axis=0).tolist() == [1, 1, 1]
    assert own[:, 3:].all()
    exact = information(strip, frame, unknowns, np.empty((0, len(strip.fixed))))
    hessian = jacobian.T @ jacobian
    size = np.sqrt(np.diag(hessian))
    np.testing.assert_allclose(
        exact / np.outer(size, size), hessian / np.outer(size, size), atol=1e-6
    )
    prior = Prior(np.zeros(strip.at.size), np.zeros(strip.at.size), -1.0, np.inf)
    about = linearise(strip, prior, frame, unknowns)
    # light that varies between the nodes is taken as linear there
    rows = hessian[light] / np.outer(size[light], size)
    np.testing.assert_allclose(about[0][light] / np.outer(size[light], size), rows, atol=2e-3)
    pull = jacobian.T @ np.full(len(frame), -1 / sigma)
    np.testing.assert_allclose(about[1] / size, pull / size, atol=1e-4 * np.abs(pull / size).max())


def test_joint_precision_is_that_of_a_dense_prior(strip: FrameModel) -> None:
    rng, unknowns = np.random.default_rng(6), some_unknowns(strip)
    size = strip.at.size
    root = rng.standard_normal((size, size))
    mean, frame = rng.standard_normal(size), expose(strip, unknowns)[0]
    none = linearise(strip, Prior(mean, np.zeros(size), -1.0, np.inf), frame, unknowns)
    both = linearise(
        strip, Prior(mean, np.zeros(size), -1.0, np.inf, root @ root.T), frame, unknowns
    )
    np.testing.assert_allclose(both[0] - none[0], root @ root.T, atol=1e-6 * np.abs(none[0]).max())
    pull = root @ (root.T @ (unknowns - mean))
    np.testing.assert_allclose(both[1] - none[1], pull, atol=1e-8 * np.abs(pull).max())


def test_climbs_end_where_scipy_ends(strip: FrameModel) -> None:
    rng, truth = np.random.default_rng(7), some_unknowns(strip)
    sigma = np.sqrt(strip.variance)
    frame = expose(strip, truth)[0] + sigma * rng.uniform(-1.7, 1.7, len(strip.amplitude))
    frame = np.clip(frame, 1, strip.full_scale - 1)
    precision = np.where(np.arange(strip.at.size) < strip.at.loads, 0.25, 1.0)
    prior = Prior(np.zeros(strip.at.size), precision, -1.0, np.inf)
    found, loss, square, count, _ = climb(strip, prior, frame, truth, 1.0, 40, 1e-4, np.inf)

    def rests(unknowns: Array) -> Array:
        return np.concatenate(
            [(expose(strip, unknowns)[0] - frame) / sigma, np.sqrt(precision) * unknowns]
        )

    def slopes(unknowns: Array) -> Array:
        return np.concatenate(
            [differences(strip, unknowns) / sigma[:, None], np.diag(np.sqrt(precision))]
        )

    best = least_squares(rests, truth, jac=slopes, xtol=1e-10)
    assert loss == pytest.approx(2 * best.cost, abs=0.1)
    assert square == pytest.approx(np.square(rests(found)[: len(frame)]).sum(), rel=1e-6)
    assert count == len(frame)
    off = found - best.x
    information = slopes(best.x).T @ slopes(best.x)
    assert off @ information @ off < 0.1


@pytest.mark.parametrize("deviation", [0.05, 0.4, 0.7, 0.999])
def test_narrow_point_spreads_are_the_discrete_gaussian(deviation: float) -> None:
    """Of scipy's Bessel functions; Lindeberg 1990."""
    half = KERNEL(deviation)
    assert half == pytest.approx(ive(np.arange(len(half)), deviation**2), abs=1e-6)


def test_point_spreads_change_with_their_width_without_a_jump() -> None:
    """A wave of 0.3 rad a pixel is damped a little more by each: no step where kernels grow.

    Five deviations off, two pixels of a kernel one pixel wide hold 2 exp(-12.5) / sqrt(2 pi), 3e-6.
    """
    wave = 2 * np.cos(0.3 * np.arange(60))
    wave[0] = 1.0
    for low, high in ((0.1, 0.9), (1.0, 6.0)):
        widths = np.linspace(low, high, 2_000)
        damped = [np.sum(half * wave[: len(half)]) for half in map(KERNEL, widths)]
        steps = np.diff(np.log(damped))
        assert (steps < 0).all()
        assert np.abs(np.diff(steps)).max() < 3e-6
