"""Score tests of departures beside the forces of pads of tactels."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import fringeforce as ff
from fringeforce.design.pad import Pad
from fringeforce.estimation.levenberg_marquardt import Curvature
from fringeforce.estimation.residual_test import square_limit
from fringeforce.estimation.score_test import Score
from fringeforce.models.pad import PadModel, characterize_pad
from fringeforce.models.pad_departures import pad_departures
from fringeforce.models.pad_series import PadSeries
from fringeforce.reading.pads.departure_record import RETESTED, DepartureRecord, FullTest
from fringeforce.reading.pads.departure_test import SquaresDepartureTest
from fringeforce.reading.pads.fit import Fit, Optimum
from fringeforce.reading.pads.single_frame import PadFrameReader
from fringeforce.reading.reading import Status

RARE = 1e-3
COVER = "transducer.compliant.thickness"


def pressed(model: PadModel, rng: np.random.Generator, share: float = 1.0) -> np.ndarray:
    """Forces on three neighbours, which retard light by 2 rad times a share."""
    forces = np.zeros((model.sensor.tactels.total, 3))
    first = int(rng.integers(model.sensor.tactels.total - 2))
    forces[first : first + 3, 0] = rng.uniform(1.0, 2.0, 3)
    forces[first : first + 3, 1:] = rng.uniform(-0.5, 0.5, (3, 2))
    largest = np.hypot(*model.retardance(forces)).max()
    return share * 2.0 / largest * forces


def made(pad: Pad, model: PadModel, **departs: float) -> PadModel:
    """A pad that is not as drawn, made as the model of the drawing."""
    drawn = pad.replace(**departs)
    if any(path.startswith("transducer.") for path in departs):
        return characterize_pad(drawn, samples=48, slices=6)
    return replace(model, sensor=drawn)


@pytest.fixture(scope="module")
def reader(model: PadModel) -> PadFrameReader:
    return PadFrameReader(model)


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[Score]:
    """What is told of every frame that is tested."""
    found, real = list[Score](), SquaresDepartureTest.full

    def kept(self: SquaresDepartureTest, fit: Fit, one: Optimum, curvature: Curvature) -> FullTest:
        test = real(self, fit, one, curvature)
        found.append(test.score)
        return test

    monkeypatch.setattr(SquaresDepartureTest, "full", kept)
    return found


def test_squares_of_frames_as_drawn_are_chi_square_numbers(
    model: PadModel, reader: PadFrameReader, told: list[Score]
) -> None:
    rng, used = np.random.default_rng(1), reader.usable(None)
    for _ in range(40):
        frame = model.expose(pressed(model, rng, rng.uniform(0.3, 1.0)), rng)
        assert reader.search(frame.ravel(), used).ok
    scores = np.array([each.pull for each in told])
    known = np.array([each.information.diagonal() for each in told])
    for square, information in zip((scores**2 / known).T, known.T, strict=True):
        if information.min() > 1:
            assert stats.kstest(square, stats.chi2(1).cdf).pvalue > RARE / known.shape[1]
    assert (known.min(axis=0) > 1).sum() >= 7


def test_sizes_scatter_as_much_as_one_frame_can_tell(
    model: PadModel, reader: PadFrameReader, told: list[Score]
) -> None:
    rng, used = np.random.default_rng(6), reader.usable(None)
    forces, count = pressed(model, rng), 30
    bound = reader.departure_bound(forces)
    told.clear()
    for _ in range(count):
        assert reader.search(model.expose(forces, rng).ravel(), used).ok
    scores = np.array([each.pull for each in told])
    known = np.array([each.information.diagonal() for each in told])
    for k, one in enumerate(reader.tested_departures):
        sizes = one.deviation * scores[:, k] / known[:, k]
        share = float(np.sum(np.square(sizes))) / bound[one.path] ** 2
        assert RARE / len(bound) < stats.chi2(count).cdf(share) < 1 - RARE / len(bound)


def test_changes_of_layers_are_those_of_pads_that_are_made_so(pad: Pad, model: PadModel) -> None:
    layers = [one for one in pad_departures(model) if one.path.startswith("transducer.")]
    forces = pressed(model, np.random.default_rng(2))
    whole = 2 * model.profile.sum(axis=0)
    series = PadSeries(model.sensor, model.influence)
    for one in layers:
        change_of_influence, _ = series.changes(one.path, one.deviation * one.unit)
        image = model.retarding.spread(change_of_influence.forward(forces.ravel()))
        ahead, behind = (
            made(pad, model, **{one.path: one.unit * (1 + way * one.deviation)}).retardance(forces)
            for way in (1, -1)
        )
        change = (ahead - behind) / 2
        difference = np.einsum("k,fkrc->frc", whole, image) - change
        # the influence is made of splines, and of fewer depth profiles
        assert np.sqrt(np.mean(difference**2) / np.mean(change**2)) < 0.02


@pytest.mark.parametrize(
    ("departs", "words"),
    [
        ({"camera.blur": 0.08e-3}, "blurred by 0.0"),
        ({"camera.shift_x": 0.01e-3}, "shifted along x by 0.01"),
        ({"camera.scale": 1.003}, "scale seems 0.3"),
        ({"camera.amplitude": 244.4}, "light seems 0."),
        ({"polariscope.visibility": 0.985}, "visibility of the fringes seems 0.98"),
        ({COVER: 0.53e-3}, "compliant layer seems 6"),
    ],
)
def test_what_the_residual_of_all_pixels_hides_is_refused_and_named(
    pad: Pad,
    model: PadModel,
    reader: PadFrameReader,
    told: list[Score],
    departs: dict[str, float],
    words: str,
) -> None:
    rng = np.random.default_rng(3)
    frame = made(pad, model, **departs).expose(pressed(model, rng), rng)
    reading = reader.search(frame.ravel(), reader.usable(None))
    assert told  # only what forces explain is tested
    assert reading.status is Status.MODEL_MISMATCH
    (finding,) = reading.findings
    assert words in finding
    assert next(iter(departs)) in finding


def test_what_a_design_allows_for_is_not_tested(pad: Pad, model: PadModel) -> None:
    loose, rng = model.with_tolerances(**{COVER: "0.5 mm +/- 5 %"}), np.random.default_rng(3)
    forces = pressed(model, rng)
    reading = ff.Reader(loose).search(made(pad, model, **{COVER: 0.53e-3}).expose(forces, rng))
    assert reading.ok
    assert (np.abs(reading.forces - forces) < 5 * reading.std).all()


def test_no_frame_tells_one_layers_modulus_from_the_others(pad: Pad, model: PadModel) -> None:
    quiet, rng = pad.replace(**{"camera.noise": 1.0}), np.random.default_rng(5)
    stiff = made(quiet, model, **{"transducer.compliant.youngs_modulus": 16.5e6})
    reader = PadFrameReader(replace(model, sensor=quiet))
    frame = stiff.expose(pressed(model, rng), rng)
    reading = reader.search(frame.ravel(), reader.usable(None))
    assert reading.status is Status.MODEL_MISMATCH
    (finding,) = reading.findings
    assert "The compliant layer seems" in finding
    assert "stiffer than drawn" in finding
    assert "the photoelastic layer seems" in finding
    assert "softer than drawn" in finding


def test_frames_that_follow_are_tested_where_more_is_pressed(pad: Pad, model: PadModel) -> None:
    seen = made(pad, model, **{"polariscope.visibility": 0.95})
    reader, rng = ff.Reader(model), np.random.default_rng(4)
    forces = pressed(model, rng)
    readings = [
        reader.read(seen.expose(share * forces, rng)) for share in np.geomspace(0.02, 1, 60)
    ]
    assert readings[0].trusted  # hardly any light tells of it yet
    assert any(reading.tracked for reading in readings)
    refused = next(one for one in readings if not one.trusted)
    assert "visibility of the fringes" in refused.findings[0]
    assert not readings[-1].trusted


@pytest.mark.slow
def test_scores_of_frames_together_are_normal_and_tell_what_departs() -> None:
    rng, departs, tests = np.random.default_rng(7), np.array([0.0, 0.5]), 60
    squares, sizes = [], []
    for _ in range(400):
        record, one = DepartureRecord(), np.ones(2)
        told = Score(one, np.eye(2), one, np.zeros((1, 2)), np.eye(1))
        for _ in range(tests):
            known = rng.uniform(0.5, 4.0, 2)
            pull = -known * departs + np.sqrt(known) * rng.standard_normal(2)
            score = told._replace(pull=pull, information=np.diag(known), alone=one)
            for _ in range(RETESTED):
                record.due(one)
            told = record.together(score)
            record.add(score)
        squares.append(told.square()[0] - told.of(slice(1, 2)).square()[0])
        sizes.append(told.of(slice(1, 2)).best)
    assert stats.kstest(squares, stats.chi2(1).cdf).pvalue > RARE
    spread = np.std(sizes) / np.sqrt(len(sizes))
    assert abs(np.mean(sizes) - departs[1]) < stats.norm.isf(RARE) * spread
    # a quarter of what one frame of the mean information shows
    assert np.std(sizes) < 0.3 / np.sqrt(2.25)


@pytest.mark.slow
def test_what_no_single_frame_shows_is_refused_once_frames_that_follow_do(
    pad: Pad, model: PadModel, reader: PadFrameReader, told: list[Score]
) -> None:
    fine = characterize_pad(pad.replace(**{"polariscope.visibility": 0.95}), samples=64, slices=12)
    rng = np.random.default_rng(8)
    forces = pressed(model, rng, 0.5)
    follow = ff.Reader(model)
    readings = [follow.read(fine.expose(forces, rng)) for _ in range(80)]
    assert readings[0].ok
    alone = np.array([each.pull**2 / each.information.diagonal() for each in told])
    assert (alone < square_limit(1)).all()
    refused = [one for one in readings if not one.ok]
    assert "visibility of the fringes seems 0.9" in refused[0].findings[0]
    assert not readings[-1].ok


@pytest.mark.slow
def test_frames_that_follow_a_drift_are_not_sure_of_forces_beyond_what_they_state(
    pad: Pad, model: PadModel
) -> None:
    fine = characterize_pad(pad, samples=64, slices=12)
    rng, reader = np.random.default_rng(), ff.Reader(model)
    forces = pressed(model, rng)
    statuses = []
    for shift in np.linspace(0, 0.03e-3, 90):
        frame = made(pad, fine, **{"camera.shift_x": shift}).expose(forces, rng)
        reading = reader.read(frame)
        statuses.append(reading.status)
        if reading.ok:
            off = (reading.forces - forces).ravel()
            square = off @ np.linalg.solve(reading.covariance, off)
            assert square < stats.chi2(off.size).isf(1e-9)
    assert statuses[0] is Status.OK
    assert statuses[-1] is Status.MODEL_MISMATCH
