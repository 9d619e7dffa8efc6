"""Frames that show the light alone make up for a camera whose pixels differ."""

from dataclasses import replace

import numpy as np
import pytest
from benches import (
    PIXELS,
    PLACE,
    STRAIN_OPTIC,
    drawing,
    findings,
    held_out,
    is_plausible,
    lit,
    seen_by,
)

from benches import presses, shots  # isort: skip

import fringeforce as ff
from fringeforce.optics.camera import expose, noise_variance

pytestmark = pytest.mark.slow

KINDS = ("dark", "unloaded", "bright")


@pytest.fixture(scope="module")
def plain() -> ff.SensorModel:
    return ff.characterize(drawing().replace(**{STRAIN_OPTIC: 0.054}))


def references(true, rng, count: int, kinds=KINDS) -> ff.References:
    """What a person takes: a cap on the lens, an idle sensor, the analyser turned."""
    amplitude, offset = seen_by(true).amplitude, seen_by(true).offset
    none, leak = np.zeros((count, PIXELS)), 3.0
    camera = true.sensor.camera
    taken = {
        "dark": lambda: expose(camera, none, rng, (0 * amplitude, offset - leak)),
        "unloaded": lambda: expose(camera, none, rng, (amplitude, offset)),
        "bright": lambda: expose(camera, none + 1, rng, (amplitude, offset)),
    }
    return ff.References(**{kind: taken[kind]() for kind in kinds})


def calibrated(true, rng, given: ff.References | None, count: int = 4) -> ff.SensorModel:
    forces = presses(rng, count)
    frames = shots(true, forces, rng)
    # none are put aside: `held_out` reads frames of its own
    return ff.calibrate(drawing(), frames, forces, [STRAIN_OPTIC], references=given, aside=0)


def test_a_pattern_that_no_smooth_light_explains_is_explained_by_references(plain) -> None:
    rng = np.random.default_rng(31)
    true = lit(plain, rng, pattern=2.0)
    model = calibrated(true, rng, references(true, rng, 16), count=12)
    assert findings(model).chi2 == pytest.approx(1, abs=0.04)
    assert findings(model).dead == ()
    assert findings(model).outliers == ()
    truth = np.array([0.054, *PLACE])
    assert (np.abs(findings(model).values - truth) < 4.5 * findings(model).std).all()
    seen = seen_by(model).usable
    sigma = np.sqrt(noise_variance(true.sensor.camera) / 16)
    for kind, factor in (("offset", 1), ("amplitude", np.sqrt(2))):
        error = getattr(seen_by(model), kind) - getattr(seen_by(true), kind)
        assert error[seen].std() < 1.1 * factor * sigma
    found = held_out(model, true, rng)
    assert found.efficiency < 1.15
    assert 0.93 <= found.coverage <= 0.97
    assert found.read > 0.9
    assert found.chi2 == pytest.approx(1, abs=0.03)


def test_without_references_the_same_pattern_is_said_not_to_be_explained(
    plain, cause_not_asked
) -> None:
    rng = np.random.default_rng(31)
    true = lit(plain, rng, pattern=2.0)
    model = calibrated(true, rng, None)
    assert any("not explained" in text for text in findings(model).findings)


@pytest.mark.parametrize("kinds", [("dark",), ("unloaded",), ("bright",)], ids=" ".join)
def test_one_kind_of_reference_helps_and_loaded_frames_say_the_rest(plain, kinds) -> None:
    rng = np.random.default_rng(32)
    true = lit(plain, rng, pattern=2.0)
    model = calibrated(true, rng, references(true, rng, 16, kinds))
    assert findings(model).chi2 == pytest.approx(1, abs=0.05)
    found = held_out(model, true, rng)
    assert found.efficiency < 1.2
    assert 0.92 <= found.coverage <= 0.98


def test_few_reference_frames_leave_a_noise_that_readings_count(plain) -> None:
    rng = np.random.default_rng(33)
    true = lit(plain, rng, pattern=2.0)
    few, many = (calibrated(true, rng, references(true, rng, k)) for k in (1, 64))
    assert seen_by(few).light_variance > 1.5 * seen_by(many).light_variance > 0
    found = held_out(few, true, rng)
    assert 0.93 <= found.coverage <= 0.97
    # the noise that readings assume is the noise that they meet
    assert found.chi2 == pytest.approx(1, abs=0.03)


def test_a_camera_without_pattern_is_given_none(plain) -> None:
    rng = np.random.default_rng(34)
    true = lit(plain, rng)
    model = calibrated(true, rng, references(true, rng, 16))
    assert seen_by(model).light_variance < 0.02
    assert 0.92 <= held_out(model, true, rng).coverage <= 0.98


def test_estimates_scatter_as_their_covariance_says(plain) -> None:
    rng, total = np.random.default_rng(35), 0.0
    truth = np.array([np.log(1.08), *PLACE])
    for _ in range(5):
        true = lit(plain, rng, pattern=2.0)
        found = findings(calibrated(true, rng, references(true, rng, 4), count=0))
        reached = np.append(np.log(found.values[0] / found.drawing[0]), found.values[1:])
        total += (reached - truth) @ np.linalg.solve(found.covariance, reached - truth)
    assert is_plausible(float(total), 5 * 3)


def test_a_model_with_a_pattern_and_a_drift_survives_its_file(plain, tmp_path) -> None:
    true = lit(plain, np.random.default_rng(37))
    model = replace(true, imaging=replace(seen_by(true), light_variance=0.3, drift=(0.02, 0.5)))
    model.save(tmp_path / "m.h5")
    imaging = ff.load_model(tmp_path / "m.h5").imaging
    assert imaging is not None
    assert (imaging.light_variance, imaging.drift) == (0.3, (0.02, 0.5))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"dark": np.zeros((3, 100))}, ["Dark", "(3, 100)", str(PIXELS)]),
        ({"unloaded": np.full((3, PIXELS), -1.0)}, ["Unloaded", "0 to 255", "bits"]),
        ({"bright": np.full((3, PIXELS), 255)}, ["bright", "255", "shorten the exposure"]),
        (
            {"unloaded": np.full((2, PIXELS), 90), "bright": np.full((2, PIXELS), 20)},
            ["unloaded", "brighter", "bright", "swapped"],
        ),
    ],
)
def test_references_that_do_not_fit_are_named_with_their_remedy(given, words) -> None:
    with pytest.raises(ff.FringeforceError) as caught:
        ff.calibrate(
            drawing(),
            np.zeros((8, PIXELS)),
            np.ones((8, 11, 2)),
            references=ff.References(**given),
        )
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_an_unloaded_frame_with_a_load_on_it_is_told(plain) -> None:
    rng = np.random.default_rng(38)
    true = lit(plain, rng)
    leaning = shots(true, 0.6 * ff.polar(1.0, 10, n=11)[None], rng)
    model = calibrated(true, rng, ff.References(unloaded=leaning))
    assert any("Reference frames contradict" in text for text in findings(model).findings)
