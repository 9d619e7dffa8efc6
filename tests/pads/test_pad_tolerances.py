"""Pads that are not as drawn: what tolerances allow for, and what a finding names."""

import gc
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import fringeforce as ff
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import with_values
from fringeforce.estimation.levenberg_marquardt import Curvature
from fringeforce.mechanics.solid.block import Patches
from fringeforce.models import splines
from fringeforce.models.as_built import PLACEMENT
from fringeforce.models.imaging import camera_response
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_as_built import smooth_image
from fringeforce.models.pad_slices import slice_retardance
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.models.pad_unknowns import value_of
from fringeforce.optics import camera as camera_optics
from fringeforce.reading.pads.diagnosis import PadSquaresDiagnosis
from fringeforce.reading.pads.fit import Fit
from fringeforce.reading.pads.light import REMEMBERED, Prior
from fringeforce.reading.pads.sampling import Sampling, lattice
from fringeforce.reading.pads.single_frame import PadFrameReader
from fringeforce.reading.reading import Status

Array = np.ndarray
RARE = 1e-5

pytestmark = pytest.mark.slow

EVERYTHING = {
    "camera.amplitude": "225 +/- 3 %",
    "camera.offset": "8 +/- 0.5",
    "camera.drift": "1 %",
    "camera.blur": "0.12 +/- 0.03 mm",
    "camera.gamma": "1.08 +/- 0.05",
    "camera.unevenness": "4 %",
    "camera.shift_x": "0 +/- 0.05 mm",
    "camera.shift_y": "0.02 +/- 0.05 mm",
    "camera.scale": "1 +/- 0.01",
    "polariscope.visibility": "0.95 +/- 0.02",
    "polariscope.plates": {"retardance_error": "2 +/- 1"},
    "polariscope.residual": "0 +/- 0.1 rad",
    "tactels.placement": "0 +/- 0.1 mm",
    "tactels.size": "2 +/- 0.2 mm",
    "transducer.compliant.thickness": "0.5 mm +/- 5 %",
    "transducer.photoelastic.strain_optic_coefficient": "0.05 +/- 5 %",
    "tactels.pitch": "2 mm +/- 1 %",
}


@pytest.fixture(scope="module")
def roller(pad: Pad) -> PadModel:
    return ff.characterize(pad.replace(**{"tactels.size": "2 mm", "camera.amplitude": 240.0}))


def loosened(model: PadModel, **stated: object) -> PadModel:
    return replace(model, sensor=model.sensor.replace(**stated))


def touch(model: PadModel, rng: np.random.Generator) -> Array:
    """One to three pressed tactels with some shear."""
    forces = np.zeros((model.sensor.tactels.total, 3))
    for _ in range(rng.integers(1, 4)):
        push = rng.uniform(0.5, 3)
        forces[rng.integers(len(forces))] = push * np.array([1, *rng.uniform(-0.4, 0.4, 2)])
    return forces


def test_slopes_and_curvature_are_those_of_differences(roller: PadModel) -> None:
    rng, known = np.random.default_rng(2), PadUncertainty.of(loosened(roller, **EVERYTHING))
    forces, extra = touch(roller, rng).ravel() + 0.05, 0.5 * rng.normal(size=known.size)
    frame = rng.integers(0, 255, roller.frame_shape).ravel().astype(float)
    fit = Fit(
        known.model,
        camera_response(known.model.sensor.camera),
        lattice(known.model, 96, known),
        frame,
    )
    here = fit.at(forces, extra)
    slope, curvature = fit.gradient(here, fit.misfit(here)), fit.information(here)
    point, loads = np.concatenate([forces, extra]), len(forces)
    chosen = {group.path: loads + group.begin for group in known.groups}
    single = np.diag(curvature)
    for path, number in {"a force": 4, "another": 31, **chosen}.items():
        step = 0.02 * np.eye(len(point))[number]
        ends = [fit.at((point + s)[:loads], (point + s)[loads:]) for s in (step, -step)]
        rise = (fit.misfit(ends[0]).loss - fit.misfit(ends[1]).loss) / 0.08
        # the frame is nothing but noise
        assert slope[number] == pytest.approx(
            rise, rel=0.05, abs=3e-3 * np.sqrt(single[number]) * 60
        ), path
        change = (ends[0].level - ends[1].level) / 0.04
        expected = change @ change / fit.response.variance + (number >= loads)
        # the blur acts on one factor of a product alone
        assert single[number] == pytest.approx(expected, rel=0.1), path


COVER, PITCH = "transducer.compliant.thickness", "tactels.pitch"
EFFECT = "transducer.photoelastic.strain_optic_coefficient"


@pytest.mark.parametrize(
    ("stated", "deviations"),
    [
        ({PITCH: "2 mm +/- 1 %"}, (3,)),
        ({PITCH: "2 mm +/- 1 %", COVER: "0.5 mm +/- 5 %"}, (2, 2)),
        ({COVER: "0.5 mm +/- 5 %", EFFECT: "0.05 +/- 5 %"}, (2, -2)),
    ],
    ids=["pitch", "pitch and cover", "cover and effect"],
)
def test_values_that_are_off_together_act_as_on_the_pad_that_has_them(
    roller: PadModel, stated, deviations
) -> None:
    """Sums of what single values change miss 0.5 to 3 mrad per radian there."""
    known = PadUncertainty.of(loosened(roller, **stated))
    drawn, extra, values = roller.sensor, np.zeros(known.size), {}
    for group, off in zip(known.groups, deviations, strict=True):
        extra[group.begin] = off
        values[group.path] = value_of(drawn, group.path) + off * group.std
    forces = np.zeros((drawn.tactels.total, 3))
    forces[6], forces[13], forces[8] = [6, 1.5, -1], [5, -1, 1.5], [3, 0.5, 0.5]
    expected = ff.characterize(with_values(drawn, values)).retardance(forces)
    modes = known.retarding(extra).spread(known.coefficients(forces.ravel(), extra))
    found = np.einsum("k,fkrc->frc", 2 * roller.influence.profile.sum(axis=0), modes)
    # at nine radians a twentieth of the noise of a pixel
    assert np.abs(found - expected).max() < 2e-4 * np.abs(expected).max()


def test_slopes_of_splines_are_those_of_a_sine() -> None:
    x = np.linspace(-6, 6, 96)
    # as fine as tractions of the fourth order behind half a millimetre, in 1/mm
    expected = 4.5 * np.cos(4.5 * x)
    found = splines.slopes(x) @ np.sin(4.5 * x)
    assert np.abs(found - expected)[3:-3].max() < 1e-3 * 4.5


@pytest.mark.parametrize(
    "stated",
    [
        {"camera.amplitude": "240 +/- 3 %", "polariscope.visibility": "0.95 +/- 0.02"},
        {"camera.unevenness": "5 %", "camera.gamma": "1 +/- 0.08"},
        {"polariscope.residual": "0 +/- 0.1 rad"},
        {"camera.shift_x": "0 +/- 0.1 mm", "camera.shift_y": "0 +/- 0.1 mm"},
        {"tactels.placement": "0 +/- 0.1 mm", "tactels.size": "2 +/- 0.2 mm"},
    ],
    ids=["light", "uneven", "residual", "registration", "contacts"],
)
def test_built_pads_are_read_within_what_their_readings_state(roller: PadModel, stated) -> None:
    model = loosened(roller, **stated)
    reader, plain = ff.Reader(model), ff.Reader(roller)
    distances, refused = [], 0
    for seed in range(4):
        rng = np.random.default_rng(seed)
        forces = touch(model, rng)
        frame = model.as_built(rng).expose(forces, rng)
        reading = reader.search(frame)
        assert reading.status is Status.OK
        assert reading.probability >= 0.999
        apart = (reading.forces - forces).ravel()
        distances.append(apart @ np.linalg.solve(reading.covariance, apart))
        as_drawn = plain.search(frame)
        refused += as_drawn.status is Status.MODEL_MISMATCH
        assert as_drawn.ok or as_drawn.probability == 0
        # what is estimated beside the forces makes them less certain
        assert (reader.bound(forces) >= 0.999 * plain.bound(forces)).all()
    low, high = stats.chi2(4 * 60).ppf([RARE, 1 - RARE])
    assert low < np.sum(distances) < high
    assert refused >= 3


def pressed_all_over(model: PadModel, rng: np.random.Generator) -> Array:
    """Forces with some shear on every other tactel."""
    forces = np.zeros((model.sensor.tactels.total, 3))
    chosen = rng.choice(len(forces), len(forces) // 2, replace=False)
    forces[chosen, 0] = rng.uniform(0, 1, len(chosen))
    forces[chosen, 1:] = forces[chosen, :1] * rng.uniform(-0.3, 0.3, (len(chosen), 2))
    return forces


def test_a_camera_far_from_where_it_is_drawn_is_no_other_departure(roller: PadModel) -> None:
    """It looks three deviations beside; its frames are those of a pad drawn so."""
    stated = {"camera.shift_x": "0 +/- 0.1 mm", "camera.shift_y": "0 +/- 0.1 mm"}
    reader = ff.Reader(loosened(roller, **stated))
    built = loosened(roller, **{"camera.shift_x": "0.3 mm", "camera.shift_y": "-0.3 mm"})
    rng, distances = np.random.default_rng(0), []
    for _ in range(6):
        forces = pressed_all_over(roller, rng)
        reading = reader.search(built.expose(forces, rng))
        assert reading.ok
        apart = (reading.forces - forces).ravel()
        distances.append(apart @ np.linalg.solve(reading.covariance, apart))
    low, high = stats.chi2(6 * 60).ppf([RARE, 1 - RARE])
    assert low < np.sum(distances) < high


def test_a_fit_on_the_wrong_tactels_leads_to_the_right_ones(roller: PadModel) -> None:
    """It took the camera for shifted by a pitch of 2 mm, four deviations."""
    model = loosened(roller, **{"camera.shift_x": "0 +/- 0.5 mm", "camera.shift_y": "0 +/- 1 mm"})
    reader = PadFrameReader(model)
    forces, beside = np.zeros((2, model.sensor.tactels.total, 3))
    across = model.sensor.tactels.count[1]
    forces[2 * across + 1], beside[3 * across + 2] = [1, 0.2, 0], [1, 0.2, 0]
    levels = reader.classifier(reader.usable_pixels).filled(
        roller.expose(forces, np.random.default_rng(0)).ravel()
    )
    fit = reader._fit(levels, reader.stepping, reader.classifier(reader.usable_pixels))
    wrong = fit.climb(fit.at(beside.ravel(), np.array([4.0, 2.0])))
    assert wrong.extra == pytest.approx([4, 2], abs=0.5)
    right = min(reader._on_other_tactels(fit, wrong), key=lambda one: one.misfit.loss)
    assert right.misfit.loss < wrong.misfit.loss
    assert right.extra == pytest.approx([0, 0], abs=0.1)
    assert right.forces == pytest.approx(forces.ravel(), abs=0.1)


def test_contacts_beside_tactels_do_not_tell_the_scale_of_the_light(roller: PadModel) -> None:
    """Fewer forces under a stronger effect look alike, wherever they act."""
    effect = "transducer.photoelastic.strain_optic_coefficient"
    model = loosened(roller, **{effect: "0.05 +/- 3 %", "tactels.placement": "0 +/- 0.1 mm"})
    reader, rng, distances = ff.Reader(model), np.random.default_rng(0), []
    for _ in range(4):
        forces = pressed_all_over(roller, rng)
        reading = reader.search(model.as_built(rng).expose(forces, rng))
        assert reading.ok
        every, covariance = reading.forces.ravel(), reading.covariance
        along = float(np.sqrt(every @ covariance @ every) / (every @ every))
        assert 0.98 * 0.03 < along < 1.1 * 0.03
        apart = every - forces.ravel()
        distances.append(apart @ np.linalg.solve(covariance, apart))
    low, high = stats.chi2(4 * 60).ppf([RARE, 1 - RARE])
    assert low < np.sum(distances) < high


def test_a_camera_that_is_not_linear_is_read_by_its_gamma(roller: PadModel) -> None:
    """By a gamma that is exact, too, for which nothing is estimated."""
    bent, rng, squares = loosened(roller, **{"camera.gamma": 1.3}), np.random.default_rng(9), []
    for _ in range(3):
        forces = touch(bent, rng)
        reading = ff.Reader(bent).search(bent.expose(forces, rng))
        assert reading.status is Status.OK
        apart = (reading.forces - forces).ravel()
        squares.append(apart @ np.linalg.solve(reading.covariance, apart))
    low, high = stats.chi2(3 * 60).ppf([RARE, 1 - RARE])
    assert low < np.sum(squares) < high


def test_the_light_of_a_built_pad_is_as_uneven_as_stated(roller: PadModel) -> None:
    """Of 200 pads the mean square is that of the drawing within its own scatter."""
    model, squares = loosened(roller, **{"camera.unevenness": "4 %"}), []
    for seed in range(200):
        light = model.as_built(seed).light
        assert light is not None
        squares.append(np.mean(np.square(light - 1)))
    error = np.std(squares) / np.sqrt(len(squares))
    assert abs(np.mean(squares) - 0.04**2) < 4 * error


def fine_frame(model: PadModel, centre: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Hertz's pressure on squares of a third of a tactel's, by the exact series at every pixel."""
    pad = model.sensor
    fine = pad.replace(
        tactels={"count": [15, 12], "pitch": pad.tactels.pitch / 3, "size": pad.tactels.pitch / 3}
    )
    apart = np.hypot(*(fine.tactels.places - centre).T) / 3e-3
    pressure = np.sqrt(np.clip(1 - apart**2, 0, None))
    small = 6 * (pressure / pressure.sum())[:, None] * [1, 0.2, -0.1]
    loads = [(Patches(fine.tactels.places, fine.tactels.side), small)]
    slices = slice_retardance(pad, loads, *pad.pixel_positions, 16)
    light = model.seen(slices).reshape(model.frame_shape)
    frame = camera_optics.expose(pad.camera, light, rng)
    return frame, small.reshape(5, 3, 4, 3, 3).sum(axis=(1, 3)).reshape(-1, 3)


def test_pressures_finer_than_tactels_are_for_a_skin(roller: PadModel) -> None:
    """Tactels that lend their neighbours force explain them as well, so that no reading is sure."""
    frame, forces = fine_frame(roller, np.array([0.4e-3, -0.3e-3]), np.random.default_rng(1))
    refused = ff.Reader(roller).search(frame)
    assert refused.status is Status.MODEL_MISMATCH
    loose = {"tactels.placement": "0 +/- 0.3 mm", "tactels.size": "2 +/- 0.4 mm"}
    reading = ff.Reader(loosened(roller, **loose)).search(frame)
    assert reading.status is Status.AMBIGUOUS
    assert "a skin reads" in reading.advice
    assert reading.forces.sum() == pytest.approx(forces.sum(), rel=0.01)


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"camera.shift_x": 0.06e-3}, "shifted along x by 0.06"),
        ({"camera.amplitude": 232.0}, "dimmer than drawn"),
    ],
)
def test_a_finding_names_what_departs(roller: PadModel, stated, words: str) -> None:
    rng = np.random.default_rng(3)
    made = loosened(roller, **stated)
    reading = ff.Reader(roller).search(made.expose(touch(roller, rng), rng))
    assert reading.status is Status.MODEL_MISMATCH
    (finding,) = reading.findings
    assert words in finding
    assert "standard deviations" in finding
    assert next(iter(stated)) in finding


def test_a_shifted_camera_is_not_taken_for_contacts_beside_many_tactels() -> None:
    model = ff.characterize(ff.load_sensor("pad"))
    forces = np.zeros((model.sensor.tactels.total, 3))
    forces[60], forces[63] = [5, 1, 0], [2.5, 0, 0.5]
    shifted = loosened(model, **{"camera.shift_x": 0.1e-3})
    frame = shifted.expose(forces, np.random.default_rng(3)).ravel()
    reader = PadFrameReader(model)
    diagnosis = PadSquaresDiagnosis(reader)
    few = "camera.shift_x", PLACEMENT
    diagnosis.departures = tuple(one for one in diagnosis.departures if one.path in few)
    (finding,) = diagnosis.findings(frame, reader.usable(None))
    assert "shifted along x by 0.1 mm" in finding


def test_narrower_squares_are_read_with_a_tolerance_of_their_size(roller: PadModel) -> None:
    rng, pad = np.random.default_rng(2), roller.sensor
    reader = ff.Reader(loosened(roller, **{"tactels.size": "2 +/- 0.2 mm"}))
    distances = []
    for _ in range(2):
        forces = touch(roller, rng)
        narrow = [(Patches(pad.tactels.places, 1.8e-3), forces)]
        light = roller.seen(slice_retardance(pad, narrow, *pad.pixel_positions, 16))
        frame = camera_optics.expose(pad.camera, light.reshape(roller.frame_shape), rng)
        reading = reader.search(frame)
        assert reading.status is Status.OK
        apart = (reading.forces - forces).ravel()
        distances.append(apart @ np.linalg.solve(reading.covariance, apart))
    low, high = stats.chi2(2 * 60).ppf([RARE, 1 - RARE])
    assert low < np.sum(distances) < high


def test_a_search_ends_where_a_climb_from_the_truth_does(roller: PadModel) -> None:
    model = loosened(roller, **{"tactels.placement": "0 +/- 0.1 mm"})
    reader, rng = PadFrameReader(model), np.random.default_rng(3)
    # a fingertip on all tactels, whose shear turns over it
    apart = np.hypot(*model.sensor.tactels.places.T) / 8e-3
    push = np.sqrt(np.clip(1 - apart**2, 0, None))
    angle = 2 * np.pi * np.arange(len(push)) / len(push)
    shear = 0.4 * np.stack([np.cos(angle), np.sin(angle)])
    forces = (push * [np.ones_like(push), *shear]).T
    # at most 3 rad over both passes, as in the benchmark
    forces *= 3 / np.hypot(*model.retardance(forces)).max()
    frame = model.as_built(rng).expose(forces, rng)
    used = reader.usable(None)
    found = reader.search(frame.ravel(), used)
    near = reader.search(frame.ravel(), used, forces)
    assert near.status is Status.OK
    assert found.status is Status.OK
    assert found.chi2 == pytest.approx(near.chi2, abs=1e-3)


def test_findings_of_more_frames_keep_no_more_matrices(roller: PadModel) -> None:
    reader, rng = PadFrameReader(roller), np.random.default_rng(5)
    diagnosis, used, counts = PadSquaresDiagnosis(reader), reader.usable(None), []
    one = {"camera.amplitude": 232.0}
    # the second is explained by no single departure, so that combinations are tried
    for departing in (one, {**one, "camera.shift_x": 0.06e-3}):
        frame = loosened(roller, **departing).expose(touch(roller, rng), rng)
        assert diagnosis.findings(frame.ravel(), used)
        gc.collect()
        counts.append(sum(type(held) is Sampling for held in gc.get_objects()))
    assert counts[1] == counts[0]


def test_frames_that_follow_are_read_whatever_the_tractions(roller: PadModel) -> None:
    model = loosened(
        roller, **{"tactels.placement": "0 +/- 0.1 mm", "camera.amplitude": "240 +/- 3 %"}
    )
    rng = np.random.default_rng(6)
    real, forces = model.as_built(rng), touch(model, rng)
    tractions = real.contacts((), rng)
    steps = [forces * (1 + 0.02 * k) for k in range(3)]
    frames = [real.expose(step, rng, tractions) for step in steps]
    readings = list(ff.Reader(model).stream(frames))
    assert [reading.tracked for reading in readings] == [False, True, True]
    for reading, step in zip(readings, steps, strict=True):
        assert reading.status is Status.OK
        assert (np.abs(reading.forces - step) < 5 * reading.std).all()


def test_frames_that_follow_carry_on_what_lasts(roller: PadModel) -> None:
    model = loosened(
        roller, **{"camera.shift_x": "0 +/- 0.1 mm", "camera.amplitude": "240 +/- 3 %"}
    )
    rng = np.random.default_rng(4)
    real, forces = model.as_built(rng), touch(model, rng)
    steps = [forces * (1 + 0.02 * k) for k in range(5)]
    frames = [real.expose(step, rng) for step in steps]
    reader = ff.Reader(model)
    readings = list(reader.stream(frames))
    assert [reading.tracked for reading in readings] == [False] + [True] * 4
    for reading, step in zip(readings, steps, strict=True):
        assert reading.status is Status.OK
        assert reading.probability >= 0.999
        assert (np.abs(reading.forces - step) < 5 * reading.std).all()
    alone = ff.Reader(model).search(frames[-1])
    assert (readings[-1].std < 1.02 * alone.std).all()


def test_what_frames_tell_together_stays_beside_what_is_stated(roller: PadModel) -> None:
    """Frames alike, each of which counts a share less than the next: sums of a geometric series.

    One that is stated as m with the precision S, and that N frames tell to be t with the precision
    F each, is known with the precision S + F (r + r^2 + ... + r^N) = S + G, about
    (S m + G t) / (S + G).
    """
    known = PadUncertainty(loosened(roller, **{"camera.amplitude": "240 +/- 3", "camera.drift": 0}))
    assert known.size == 1
    stated, told, there, count = 1.0, 0.4, 7.0, 12
    prior = Prior.stated(known)
    for _ in range(count):
        # a load beside it that it has nothing to do with, and the value where the frame ends
        whole = np.diag([5.0, prior.precision[0, 0] + told])
        extra = (prior.precision[0] * prior.mean + told * there) / whole[1, 1]
        prior = prior.after(known, extra, Curvature(whole))
    frames = told * np.sum(REMEMBERED ** np.arange(1, count + 1))
    assert prior.precision[0, 0] == pytest.approx(stated + frames)
    assert prior.mean[0] == pytest.approx(frames * there / (stated + frames))
    # with an earlier matrix frames end where many alike do, which forget what they tell
    share = told * REMEMBERED / (1 - REMEMBERED)
    for _ in range(400):
        prior = Prior(prior.mean, np.array([[stated + share]]))
        extra = (prior.precision[0] * prior.mean + told * there) / (prior.precision[0] + told)
        prior = prior.after(known, extra, None)
    assert prior.precision[0, 0] == pytest.approx(stated + share)
    assert prior.mean[0] == pytest.approx(share * there / (stated + share))


def test_no_contact_is_seen_as_none_under_another_light(roller: PadModel) -> None:
    model = loosened(roller, **{"camera.amplitude": "240 +/- 3 %"})
    dim = loosened(roller, **{"camera.amplitude": 232.0})
    frame = dim.expose(np.zeros((roller.sensor.tactels.total, 3)), rng=0)
    assert ff.Reader(model).search(frame).status is Status.NO_CONTACT


def test_the_residual_of_a_pad_is_a_smooth_field_of_the_stated_size() -> None:
    rng, length = np.random.default_rng(5), 4e-3
    x, y = np.linspace(-5e-3, 5e-3, 5), np.linspace(-3e-3, 3e-3, 4)
    fields = np.array([smooth_image(x, y, length, rng).ravel() for _ in range(3000)])
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    square = ((places[:, None] - places) ** 2).sum(axis=2)
    wanted = np.exp(-square / length**2 / 2)
    # standard error of a covariance of unit variances, at most sqrt(2 / n)
    assert np.abs(fields.T @ fields / len(fields) - wanted).max() < 6 * np.sqrt(2 / len(fields))


def test_built_tractions_move_and_widen_as_the_tolerances_say(roller: PadModel) -> None:
    model = loosened(
        roller, **{"tactels.placement": "0 +/- 0.1 mm", "tactels.size": "2 +/- 0.2 mm"}
    )
    drawn = model.as_built(1).contacts(400, rng=2)
    assert drawn.shape == (400, 20, 4)
    # standard errors of 16,000 draws
    np.testing.assert_allclose(drawn.mean(axis=(0, 1)), [0, 0, 2e-3, 2e-3], atol=1e-5)
    np.testing.assert_allclose(drawn.std(axis=(0, 1)), [1e-4, 1e-4, 2e-4, 2e-4], rtol=0.05)


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"camera.noise": "5 +/- 0.5"}, "camera.noise has a tolerance"),
        ({"transducer.length": "13 +/- 0.1 mm"}, "transducer.length has a tolerance"),
    ],
)
def test_what_readings_do_not_allow_for_is_refused(roller: PadModel, stated, words: str) -> None:
    with pytest.raises(ff.FringeforceError, match=words):
        ff.Reader(loosened(roller, **stated))


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"tactels.placement": "0.1 +/- 0.1 mm"}, "a tolerance about 0"),
        ({"polariscope.residual": "0.1 +/- 0.1 rad"}, "a tolerance about 0"),
    ],
)
def test_what_has_no_mean_is_refused_with_its_remedy(pad: Pad, stated, words: str) -> None:
    with pytest.raises(ff.FringeforceError, match=words):
        pad.replace(**stated)
