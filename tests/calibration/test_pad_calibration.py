"""Pads calibrated on frames of presses anywhere, made by the exact series at finer depths."""

import re
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
import pytest
from pad_benches import (
    COVER,
    DARK,
    DEAD,
    EFFECT,
    PIXELS,
    PRESSES,
    PROFILES,
    TRUE,
    WRONG,
    bench,
    built,
    drawing,
    measured,
)
from scipy import stats

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.calibration.bench_expectation import DOUBT
from fringeforce.calibration.bench_loads import BenchLoads, bench_loads
from fringeforce.calibration.bench_search import Check
from fringeforce.calibration.fit import BenchFit
from fringeforce.calibration.judgement import judgement
from fringeforce.calibration.pads.bench_uncertainty import SHIFT
from fringeforce.calibration.pads.search import PadSearch
from fringeforce.contacts.press import Press
from fringeforce.design.pad import Pad
from fringeforce.mechanics.solid.block import Patches
from fringeforce.models.pad import PadModel, characterize_pad
from fringeforce.models.pad_contacts import Contact, ContactSeries
from fringeforce.models.pad_influence import Retardance
from fringeforce.models.pad_knowledge import PadKnowledge
from fringeforce.models.pad_presses import press_slices
from fringeforce.models.pad_slices import block_of, slice_retardance
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.optics import camera as camera_optics
from fringeforce.plotting.calibration_report import calibration_report


@pytest.fixture(scope="module")
def calibrated() -> PadModel:
    return ff.calibrate(drawing(), *measured())


@pytest.mark.parametrize(
    ("profile", "exponent"), [("hertz", 0.5), ("flat", 0.0), ("punch", -0.5), ("tactel", 0.0)]
)
def test_contacts_anywhere_are_those_of_the_exact_series(profile, exponent):
    pad = drawing()
    model = characterize_pad(pad)
    series = ContactSeries(pad, model.influence, block_of(pad).depths(8)[1], (), 0.1)
    place, force = np.array([0.6e-3, -0.4e-3]), np.array([1.5, 0.4, -0.3])
    x, y = pad.pixel_positions
    square = profile == "tactel"
    if square:
        contact = Contact(place, force, 2e-3, 0.0, True)
        wanted = slice_retardance(pad, [(Patches(place[None], 2e-3), force[None])], x, y, 24)
    else:
        contact = Contact(place, force, 1.6e-3, exponent, False)
        shear = (force[1], force[2])
        press = Press(
            x=place[0], y=place[1], normal=force[0], tangential=shear, width=1.6e-3, profile=profile
        )
        wanted = press_slices(pad, [press], x, y)
    influence = series.changes([contact]).influence
    modes = Retardance.at(influence, x, y).spread(influence.forward(force))
    found = 2 * np.einsum("sk,fkrc->frc", influence.profile, modes)
    whole = 2 * wanted.sum(axis=0)
    assert np.abs(found - whole).max() < 2e-3 * np.abs(whole).max()


def test_derivatives_of_contacts_are_those_of_differences():
    pad = drawing()
    model = characterize_pad(pad, None, 48, 8)
    weights = block_of(pad).depths(8)[1]
    series = ContactSeries(pad, model.influence, weights, (COVER,), 0.05)
    force = np.array([1.5, 0.4, -0.3])
    contact = Contact(np.array([0.6e-3, -0.4e-3]), force, 1.6e-3, 0.5, False)
    found = series.changes([contact])
    steps: dict[int, dict[str, Any]] = {
        0: {"place": contact.place + np.array([1e-5, 0])},
        1: {"place": contact.place + np.array([0, 1e-5])},
        2: {"width": contact.width + 1e-5},
        3: {"exponent": contact.exponent + 0.02},
    }
    before = found.influence.forward(force)
    for number, change in steps.items():
        after = series.changes([contact._replace(**change)]).influence.forward(force)
        slope = found.shapes[number].forward(force) * (0.02 if number == 3 else 1e-5)
        assert np.abs(after - before - slope).max() < 0.03 * np.abs(slope).max()
    thick = replace(series, pad=pad.replace(**{COVER: 0.5e-3 * np.exp(0.04)}))
    after = thick.changes([contact]).influence.forward(force)
    first, second = (part.forward(force) for part in found.layers[0])
    off = after - before - 0.04 * first - 0.04**2 * second
    assert np.abs(off).max() < 0.01 * np.abs(after - before).max()


def begin(search: PadSearch, path: str) -> int:
    group = search.known.group(path)
    assert group is not None
    return group.begin


def test_a_shift_of_the_camera_and_of_contacts_is_told_as_differences_tell_it():
    frames, loads = measured()
    levels = frames.reshape(len(frames), -1).astype(float)
    search = PadSearch(drawing(), levels, loads, (COVER,))
    posterior, f = search.posterior(np.ones(len(levels)), 1.0), DARK
    shared, own = search.state.shared.copy(), search.state.own[f]
    for path, value in {"camera.shift_x": 0.15, "camera.scale": 0.2, "camera.blur": 0.05}.items():
        shared[begin(search, path)] = value
    gradient, information = posterior._half(f, own, shared)
    size = len(own)
    paths = "camera.shift_x", "camera.scale", "camera.blur", COVER
    chosen = [size - 4, *(size + begin(search, path) for path in paths)]
    ways = 1e-3 * np.eye(len(gradient))[chosen]
    # the camera and the contact together, which changes little
    ways = np.concatenate([ways, [ways[1] + SHIFT / DOUBT["place"] * ways[0]]])
    prior = np.concatenate([posterior.precision(f), np.zeros(len(shared))])
    slopes, squares = [], []
    for way in ways:
        ends = [(own + sign * way[:size], shared + sign * way[size:]) for sign in (-1, 1)]
        low, high = (posterior._evaluated(f, *end)[1] for end in ends)
        slopes.append((high.loss - low.loss) / 4)
        change = (high.place.level - low.place.level)[search.bench.used] / 2
        squares.append(change @ change / search.bench.response.variance + prior @ way**2)
    np.testing.assert_allclose(ways @ gradient, slopes, atol=0.02 * np.abs(slopes).max())
    np.testing.assert_allclose(np.diag(ways @ information @ ways.T), squares, rtol=0.2)


@pytest.mark.slow
def test_the_pad_is_found_within_its_deviations(calibrated):
    found = calibrated.calibration
    assert found.usable, found.findings
    for name, value in TRUE.items():
        place = found.names.index(name)
        assert abs(found.values[place] - value) < 4 * found.std[place], name
        assert found.std[place] < 0.1 * abs(value)


@pytest.mark.slow
def test_a_wrong_press_and_dead_pixels_are_named(calibrated):
    found = calibrated.calibration
    assert WRONG in found.outliers
    assert set(DEAD) <= set(found.dead)
    assert any(f"Frame {WRONG}" in words for words in found.findings)


@pytest.mark.slow
def test_readings_with_a_calibrated_pad_hold_their_intervals(calibrated):
    rng, true = np.random.default_rng(3), built()
    forces = np.zeros((3, 4, 3))
    forces[:, :, 0] = rng.uniform(0.5, 1.5, (3, 4))
    forces[:, :, 1:] = rng.uniform(-0.3, 0.3, (3, 4, 2))
    reader = ff.Reader(calibrated)
    readings = [reader.search(frame) for frame in true.expose(forces, rng)]
    assert all(reading.status is ff.Status.OK for reading in readings)
    off = np.array([r.forces - f for r, f in zip(readings, forces, strict=True)])
    std = np.array([reading.std for reading in readings])
    assert (np.abs(off) < 5 * std).all()


@pytest.mark.slow
def test_a_calibrated_pad_is_saved_with_all_that_it_knows(calibrated, tmp_path):
    calibrated.save(tmp_path / "pad.h5")
    again = ff.load_model(tmp_path / "pad.h5")
    assert again.calibration.findings == calibrated.calibration.findings
    np.testing.assert_array_equal(again.known.covariance, calibrated.known.covariance)
    np.testing.assert_array_equal(again.usable, calibrated.usable)
    frame = built().expose(np.full((4, 3), [1.0, 0.1, 0.2]), 0)
    readings = [ff.Reader(model).search(frame) for model in (calibrated, again)]
    np.testing.assert_allclose(readings[0].std, readings[1].std, rtol=1e-6)


def shaded() -> np.ndarray:
    """Light of every pixel over the mean: dim towards a corner, and a wave."""
    y, x = np.meshgrid(*[np.linspace(-1, 1, PIXELS)] * 2, indexing="ij")
    return 1 + 0.06 * np.sin(1.5 * x + 0.7 * y) - 0.03 * y**2


def light_found(model: PadModel, true: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Relative errors of the light of all pixels, and their deviations."""
    unsure, known = PadUncertainty.of(model), model.known
    light, amplitude = unsure.expected_light, model.sensor.camera.amplitude
    assert light is not None
    assert known is not None
    begins = dict(zip(known.counts, np.cumsum([0, *known.counts.values()]).tolist(), strict=False))
    change = np.zeros((len(known.mean), PIXELS**2))
    change[begins["camera.amplitude"]] = known.stds["camera.amplitude"] / amplitude
    begin = begins["camera.unevenness"]
    modes = unsure.shades.modes() / light.ravel()
    change[begin : begin + len(modes)] = modes
    std = np.sqrt(np.einsum("sp,st,tp->p", change, known.covariance, change, optimize=True))
    return (amplitude * light / true - 1).ravel(), std


@pytest.mark.slow
def test_uneven_light_and_a_gamma_are_found_with_all_else():
    """A bench whose grey level is a power of light that is dim towards one side."""
    rng, model = np.random.default_rng(12), built(**{"camera.gamma": 1.1})
    camera = model.sensor.camera

    def exposed(loads: list[list[Press]] | np.ndarray) -> np.ndarray:
        light = np.array([model.intensity(one) for one in loads]) * shaded()
        return camera_optics.expose(camera, light, rng, frame_axes=2)

    presses = [[] for _ in range(DARK)]
    for number in range(PRESSES):
        (x, y), normal = rng.uniform(-1.5e-3, 1.5e-3, 2), rng.uniform(0.8, 2.5)
        shear, wide = (0.3 * normal * rng.uniform(-1, 1, 2)).tolist(), rng.uniform(1.4e-3, 2.2e-3)
        profile = PROFILES[number % 3]
        tangential = shear[0], shear[1]
        presses.append(
            [Press(x=x, y=y, normal=normal, tangential=tangential, width=wide, profile=profile)]
        )
    pressed = [one[0] for one in presses[DARK:]]
    places = np.array([[one.x, one.y] for one in pressed])
    places = places + 0.05e-3 * rng.standard_normal(places.shape)
    forces = np.array([[one.normal, *one.shear] for one in pressed])
    forces = forces * (1 + 0.01 * rng.standard_normal(forces.shape))
    written = bench_loads(places, forces, np.arange(PRESSES) + DARK, DARK + PRESSES)
    found = ff.calibrate(drawing(), exposed(presses), written, aside=0)
    told = found.calibration
    assert told is not None
    assert told.usable, told.findings
    for name, value in {COVER: TRUE[COVER], EFFECT: TRUE[EFFECT], "camera.gamma": 1.1}.items():
        place = told.names.index(name)
        assert abs(told.values[place] - value) < 4 * told.std[place], name
    assert told.std[told.names.index("camera.gamma")] < 0.02
    off, std = light_found(found, camera.amplitude * shaded())
    assert np.abs(off).max() < 0.02
    assert np.abs(off / std).max() < 5  # neighbours err together
    loads = np.zeros((4, 4, 3))
    loads[..., 0] = rng.uniform(0.5, 1.5, (4, 4))
    loads[..., 1:] = rng.uniform(-0.3, 0.3, (4, 4, 2))
    reader = ff.Reader(found)
    readings = [reader.search(frame) for frame in exposed(loads)]
    assert all(reading.status is ff.Status.OK for reading in readings)
    off = np.array([(r.forces - f) / r.std for r, f in zip(readings, loads, strict=True)])
    # 48 forces: one in a thousand has so few inside
    assert (np.abs(off) < 1.96).sum() >= stats.binom.ppf(0.001, off.size, 0.95)


def test_what_is_stated_anew_takes_the_place_of_what_is_known_together():
    known = PadKnowledge(
        {"a": 0.1, "b": 2.0}, {"a": 1, "b": 2}, np.array([0.5, 0.0, 1.0]), 0.1 + 0.2 * np.eye(3)
    )
    mean, precision = known.expected({"b": (slice(0, 2), 2.0), "a": (slice(3, 4), 0.1)}, 4)
    np.testing.assert_array_equal(mean, [0.0, 1.0, 0.0, 0.5])
    np.testing.assert_allclose(np.linalg.inv(precision)[0], [0.3, 0.1, 0.0, 0.1])
    mean, precision = known.expected({"b": (slice(0, 2), 1.0), "a": (slice(3, 4), 0.1)}, 4)
    np.testing.assert_array_equal(mean, [0.0, 0.0, 0.0, 0.5])
    np.testing.assert_allclose(np.diag(precision), [1.0, 1.0, 1.0, 1 / 0.3])


NONE = Check(0, 0, 0, 0)


@dataclass(frozen=True)
class Fitted:
    """What a judgement asks of a fit, with frames that only some loads explain."""

    explained: np.ndarray
    right: BenchLoads
    sensor: Pad = field(default_factory=drawing)
    kept: np.ndarray = field(default_factory=lambda: np.ones(DARK + PRESSES, dtype=bool))
    checked: Check = NONE
    chi2: float = 50.0
    beyond: tuple[str, ...] = ()

    def rough(self, levels: np.ndarray, loads: BenchLoads, limit: float) -> float:
        right = self.right.rows(np.flatnonzero(np.isin(TAGS, levels[:, 0])))
        same = np.allclose(loads.places, right.places, equal_nan=True)
        free = np.isfinite(loads.force_std).all()
        return 1.0 if same and (free or np.allclose(loads.forces, right.forces)) else 50.0


TAGS = np.arange(DARK + PRESSES)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"places": [-1.0, 1.0]}, "mirror x"),
        ({"places": [1.0, -1.0], "forces": [1.0, 1.0, -1.0]}, "y seems to be written down"),
        ({"forces": [3.0, 0.5, 2.0]}, "another day"),
        ({"places": [0.3, 0.7]}, "not the one of the design"),
    ],
)
def test_frames_that_are_not_explained_must_not_be_used(change, words):
    rng, count = np.random.default_rng(4), DARK + PRESSES
    places, forces = rng.uniform(-1e-3, 1e-3, (PRESSES, 2)), rng.uniform(0.5, 1.0, (PRESSES, 3))
    right, written = (
        bench_loads(p, f, DARK + np.arange(PRESSES), count)
        for p, f in (
            (places, forces),
            (places * change.get("places", 1.0), forces * change.get("forces", 1.0)),
        )
    )
    levels = np.tile(TAGS[:, None], 4).astype(float)
    odd, loaded = (cast(BenchFit, Fitted(some, right)) for some in (TAGS % 2 > 0, TAGS >= DARK))
    found = judgement(odd, levels, written, {})
    assert not found.usable
    assert found.words[0].startswith("Do not use this model: 6 of its 12 frames are not explained")
    assert words in found.words[0]
    assert judgement(loaded, levels, written, {}).usable


def test_forces_that_scatter_as_those_of_no_load_cell_are_not_believed():
    loads = bench_loads(np.zeros((1, 2)), np.ones((1, 3)), np.array([2]), DARK + PRESSES)
    fit = cast(BenchFit, Fitted(TAGS >= 0, loads, beyond=("normal",)))
    found = judgement(fit, np.zeros((DARK + PRESSES, 4)), loads, {})
    assert not found.usable
    assert "another day" in found.words[0]


def test_a_value_far_beyond_its_tolerance_is_another_sensor():
    loads = bench_loads(np.zeros((1, 2)), np.ones((1, 3)), np.array([2]), DARK + PRESSES)
    stated = drawing(**{COVER: "1 +/- 0.02 mm"})
    frames, values = np.zeros((DARK + PRESSES, 4)), {COVER: (0.54e-3, 0.01e-3)}
    for pad, usable, words in (
        (stated, False, "21 standard deviations from the 1 mm of the drawing"),
        (drawing(**{COVER: 1e-3}), True, "0.54 mm, and 1 mm in the drawing"),
        (drawing(**{COVER: "0.55 +/- 0.02 mm"}), True, ""),
        (drawing(), True, ""),
    ):
        fit = cast(BenchFit, Fitted(TAGS >= 0, loads, pad))
        found = judgement(fit, frames, loads, values)
        assert found.usable == usable
        assert words in " ".join(found.words)
        assert bool(found.words) == bool(words)


@pytest.mark.slow
def test_the_record_has_contacts_nearer_to_the_truth_than_written(calibrated):
    record, true = calibrated.calibration.record, bench()[2]
    kept = record.frames != WRONG
    off, written = ((v[:, :2] - true)[kept] for v in (record.found, record.written))
    assert np.abs(off).mean() < 0.5 * np.abs(written).mean()
    assert (np.abs(off) < 5 * record.std[kept, :2]).all()
    assert np.isnan(record.found[~kept]).all()
    # residuals of groups of pixels have the variance of noise
    explained = np.arange(DARK + PRESSES) != WRONG
    assert np.nanstd(record.residuals[explained]) == pytest.approx(1, abs=0.1)
    assert record.misfits[WRONG] > 2 * record.misfits[explained].max()


@pytest.mark.slow
def test_the_page_of_a_saved_pad_holds_every_picture(calibrated, tmp_path):
    calibrated.save(tmp_path / "pad.h5")
    calibration_report(ff.load_model(tmp_path / "pad.h5"), tmp_path / "r.html")
    page = (tmp_path / "r.html").read_text()
    # nothing was put aside: there are too few frames
    titles = [
        "What the model leaves of the frames",
        "Contacts as written and as found",
        "Fields found",
        "Values beside the drawing",
    ]
    assert re.findall(r"<h2>(.*)</h2>\n<p>", page) == titles
    assert page.count("data:image/png;base64,") == len(titles)
    assert f"Frame {WRONG}, recorded as" in page


def test_what_is_for_strips_is_refused_with_a_remedy():
    frames, loads = np.zeros((6, PIXELS, PIXELS)), bench_loads([[0, 0]], [[1, 0, 0]], count=6)
    dark = ff.References(dark=frames)
    pressed = bench_loads(np.zeros((6, 2)), np.tile([1.0, 0, 0], (6, 1)), np.arange(6), 6)
    noisy = np.random.default_rng(0).integers(0, 200, frames.shape)
    with pytest.raises(InputError, match="are for strips"):
        ff.calibrate(drawing(), noisy, pressed, references=dark)
    with pytest.raises(InputError, match="give loads of tactels"):
        ff.calibrate(drawing(), noisy, pressed, columns=True)  # pyrefly: ignore[no-matching-overload]
    with pytest.raises(InputError, match="at least 4"):
        ff.calibrate(drawing(), frames, loads)
    with pytest.raises(InputError, match="do not fit this pad"):
        ff.calibrate(drawing(), np.zeros((6, PIXELS, 8)), loads)
