"""The filter's steps, covariances and verdicts, against dense computations."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

import fringeforce as ff
from fringeforce.estimation.compiling import sums_entry
from fringeforce.estimation.followed_frames import ALARM, DONE, FAINT, standing_at
from fringeforce.estimation.followed_point import compare, lay_out, stand
from fringeforce.estimation.frame_exposure import expose
from fringeforce.estimation.information_filter import FORGOTTEN, InformationFilter
from fringeforce.estimation.posterior import Posterior
from fringeforce.reading.strip_reader import StripFrameReader
from uncertain_strip import COLOURS, TOLERANCES

Array = NDArray[np.float64]
STEP = 1e-5


@sums_entry
def loss_gradient(model, pixels, reference, frame, standing):
    """Half the loss of one frame at a point: weighted squares, weights, and `standing.gradient`."""
    lay_out(pixels, standing, frame, np.float32(model.full_scale / 2))
    stand(model, pixels, reference, standing)
    squares, count, _, _ = compare(model, pixels, reference, standing, True)
    return squares, count + pixels.used.sum()


class Case:
    """A filter that begins at the very truth."""

    def __init__(self, reader: StripFrameReader) -> None:
        rng, at = np.random.default_rng(8), reader.uncertain.frame.at
        truth = 0.5 * rng.standard_normal(at.size)
        truth[: at.loads : 2] = rng.uniform(0.6, 2.0, at.loads // 2)
        truth[1 : at.loads : 2] *= 0.5
        self.model, self.rng, self.truth = reader.uncertain.frame, rng, truth
        self.posterior = reader.posterior(self.frame(truth), 1.0)
        self.top = self.posterior.climbed(truth, heats=(), steps=(0, 40), tolerance=1e-4)
        about = self.posterior.linearised(self.top)
        self.spread = np.asarray(np.linalg.inv(about.hessian), dtype=float)
        used = np.ones(len(self.model.amplitude), bool)
        self.filter = InformationFilter(
            self.model,
            self.posterior.prior,
            reader.uncertain.lasting,
            used,
            1.5,
            reader.mirrored,
            self.top.unknowns.copy(),
        )
        self.filter.begin(about, self.spread)

    def frame(self, unknowns: Array) -> Array:
        noise = np.sqrt(self.model.variance) * self.rng.uniform(-1.7, 1.7, len(self.model.offset))
        return expose(self.model, unknowns)[0] + noise

    def follow(self, frame: Array) -> tuple[Array, int, int]:
        loads, std = np.empty((2, 1, self.model.at.loads))
        room = np.empty((0, 0, 0)), np.empty((1, 2))
        done, why = self.filter.follow(frame[None].astype(np.float32), loads, std, *room)
        return loads[0], done, why

    def gradient(self, frame: Array, unknowns: Array) -> tuple[Array, float, float]:
        own = self.filter
        assert own._reference is not None
        standing = standing_at(unknowns, own._pixels, own._reference)
        squares, count = loss_gradient(
            self.model, own._pixels, own._reference, frame.astype(np.float32), standing
        )
        return standing.gradient, float(squares), float(count)

    def rests(self, loads: Array, frame: Array, others: Array) -> Array:
        at, prior = self.model.at, self.posterior.prior
        unknowns = np.concatenate([loads, others[at.loads :]])
        left = (expose(self.model, unknowns)[0] - frame) / np.sqrt(self.model.variance)
        return np.concatenate([left, np.sqrt(prior.precision[: at.loads]) * loads])


@pytest.fixture(
    scope="module",
    params=[{}, COLOURS | {"camera.pixels": 1024}],
    ids=["one channel", "colours with cross-talk"],
)
def reader(request: pytest.FixtureRequest, sensor: ff.Sensor) -> StripFrameReader:
    return StripFrameReader(ff.characterize(sensor.replace(**TOLERANCES, **request.param)))


@pytest.fixture
def case(reader: StripFrameReader) -> Case:
    return Case(reader)


def test_gradient_is_that_of_differences_of_exposed_frames(case: Case) -> None:
    own = case.filter
    frame, here = case.frame(case.truth), own.unknowns.copy()
    here[: case.model.at.loads] += 0.001
    assert own._reference is not None
    found, squares, count = case.gradient(frame, here)

    def half(unknowns: Array) -> float:
        left = expose(case.model, unknowns)[0] - frame
        return float(left @ (left / case.model.variance) / 2)

    rows = STEP * np.eye(len(here))
    off = found - [(half(here + row) - half(here - row)) / (2 * STEP) for row in rows]
    # how far the error leads the loads astray, in deviations of all of them together
    loads = case.model.at.loads
    assert off[:loads] @ own._reference.gain[:loads, :loads] @ off[:loads] < 0.003**2
    # and each unknown of light, lens and cross-talk
    assert np.abs(off * np.sqrt(np.diag(case.spread)))[case.model.at.modes :].max() < 0.02
    assert squares == pytest.approx(2 * half(here), rel=1e-4)
    assert count == pytest.approx(len(frame), abs=0.1)


def test_followed_loads_are_those_that_scipy_finds_with_the_rest_known(case: Case) -> None:
    at, others = case.model.at, case.top.unknowns
    moved = case.top.unknowns.copy()
    moved[: at.loads] *= 1.01
    frame = case.frame(moved)
    loads, done, why = case.follow(frame)
    assert (done, why) == (1, DONE)
    best = least_squares(case.rests, others[: at.loads], args=(frame, others), xtol=1e-10)
    off = loads - best.x
    assert off @ (best.jac.T @ best.jac) @ off < 0.1
    # with what the others leave unknown, that is far less than the stated deviation
    deviation = np.sqrt(np.diag(case.filter.covariance))
    assert np.abs(off / deviation).max() < 0.1


def test_covariance_is_that_of_a_dense_consider_filter(case: Case) -> None:
    at, here = case.model.at, case.top.unknowns
    rows = [
        (expose(case.model, here + STEP * row)[0] - expose(case.model, here - STEP * row)[0])
        / (2 * STEP * np.sqrt(case.model.variance))
        for row in np.eye(at.size)
    ]
    own, other = np.array(rows[: at.loads]), np.array(rows[at.loads :])
    alone = np.linalg.inv(own @ own.T + np.diag(case.posterior.prior.precision[: at.loads]))
    through = alone @ (own @ other.T)
    expected = alone + through @ case.spread[at.loads :, at.loads :] @ through.T
    factor = np.linalg.inv(np.linalg.cholesky(expected))
    ratios = np.linalg.eigvalsh(factor @ case.filter.covariance @ factor.T)
    assert ratios.min() > 0.9
    assert ratios.max() < 1.1


def test_renewal_is_the_maximum_a_posteriori_with_what_earlier_frames_told(case: Case) -> None:
    at, size = case.model.at, case.model.at.size
    before = case.filter.unknowns.copy()
    moved = case.top.unknowns.copy()
    moved[: at.loads] *= 1.01
    frame = case.frame(moved)
    top = case.filter.renew(frame, lambda top, within: np.empty((0, at.size)))
    assert top is not None
    known = (1 - FORGOTTEN) * case.spread[at.loads :, at.loads :]
    known[np.diag_indices(size - at.loads)] += FORGOTTEN
    root = np.linalg.cholesky(np.linalg.inv(known)).T
    mean = np.sqrt(1 - FORGOTTEN) * before[at.loads :]
    scale = np.sqrt(case.posterior.prior.precision[: at.loads])
    yielding = case.posterior.prior.yielding

    def rests(unknowns: Array) -> Array:
        left = (expose(case.model, unknowns)[0] - frame) / np.sqrt(case.model.variance)
        loads, others = unknowns[: at.loads], unknowns[at.loads :]
        pulling = np.minimum(loads[::2], 0.0) / yielding
        return np.concatenate([left, scale * loads, pulling, root @ (others - mean)])

    best = least_squares(rests, top.unknowns, xtol=1e-10)
    off = top.unknowns - best.x
    assert off @ (best.jac.T @ best.jac) @ off < 0.2
    assert np.diag(case.filter.covariance) == pytest.approx(
        np.diag(np.linalg.inv(best.jac.T @ best.jac))[: at.loads], rel=0.25
    )


def test_frames_of_another_touch_raise_the_alarm(case: Case) -> None:
    at = case.model.at
    other = case.top.unknowns.copy()
    other[at.place : at.width] += 1.5  # every contact lands elsewhere
    _, done, why = case.follow(case.frame(other))
    assert done == 0
    assert why != DONE


def test_broken_pixels_beyond_their_stated_share_raise_the_alarm(case: Case) -> None:
    frame = case.frame(case.top.unknowns)
    few, many = frame.copy(), frame.copy()
    few[::700], many[::40] = 20.0, 20.0
    assert case.follow(few)[1:] == (1, DONE)
    assert case.follow(many)[2] == ALARM


def test_a_frame_without_fringes_is_not_followed(case: Case) -> None:
    released = case.top.unknowns.copy()
    released[: case.model.at.loads] = 0.0
    case.filter.unknowns[: case.model.at.loads] = 0.0
    assert case.follow(case.frame(released))[2] == FAINT


def test_posteriors_and_filters_agree_on_the_loss(case: Case) -> None:
    assert isinstance(case.posterior, Posterior)
    frame = case.posterior.frame
    _, squares, _ = case.gradient(frame, case.top.unknowns)
    assert squares == pytest.approx(case.top.square, rel=1e-4)
