"""Bad input ends in one clear error, or is taken for what it says."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.base.arrays import numbers
from fringeforce.base.errors import InputError
from fringeforce.contacts.loads import checked_loads
from fringeforce.datasets.study_file import load_dataset_study
from fringeforce.io.bench_loads import load_bench_loads
from fringeforce.io.tables import load_forces

ROOT = Path(__file__).parents[1]
HEAD = "frame,tactel,normal_N,tangential_N\n"


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (f"0,1,{'9' * 10**6}x,0", "line 2: normal_N has 1000001 characters"),
        ("0,1,1_0,0", "'1_0' is not a number"),
        ("0,1,1e308,0", r"line 2: normal_N is 1e\+308 N"),
        ("0,1,1.5\0,0", "is not a number"),
    ],
    ids=["huge", "underscore", "strength", "NUL"],
)
def test_a_cell_that_is_no_force_is_named_in_few_words(
    sensor: ff.Sensor, tmp_path: Path, row: str, words: str
) -> None:
    path = tmp_path / "loads.csv"
    path.write_text(HEAD + row + "\n", encoding="utf-8")
    with pytest.raises(ff.FringeforceError, match=words) as caught:
        load_forces(path, sensor.tactels.count)
    assert len(str(caught.value)) < 300


def test_forces_in_a_unit_that_overflows_are_refused(sensor: ff.Sensor, tmp_path: Path) -> None:
    path = tmp_path / "loads.csv"
    path.write_text("tactel,normal_kN,tangential_N\n1,1e307,0\n", encoding="utf-8")
    with pytest.raises(ff.FringeforceError, match="normal_kN is inf N"):
        load_forces(path, sensor.tactels.count)


def test_a_table_of_too_many_columns_is_refused_at_once(sensor: ff.Sensor, tmp_path: Path) -> None:
    path = tmp_path / "loads.csv"
    path.write_text(",".join(["a"] * 10**6) + "\n" + HEAD, encoding="utf-8")
    with pytest.raises(ff.FringeforceError, match="1000000 columns"):
        load_forces(path, sensor.tactels.count)


def test_two_contacts_of_a_frame_at_one_place_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "loads.csv"
    path.write_text("frame,x_mm,normal_N,tangential_N\n0,1,1,0\n0,1,2,0\n", encoding="utf-8")
    with pytest.raises(ff.FringeforceError, match="line 3: frame 0 has two contacts at one place"):
        load_bench_loads(path, ff.load_sensor("skin"))


def test_a_range_with_a_missing_end_is_named(tmp_path: Path) -> None:
    text = (ROOT / "examples/dataset/fingers.toml").read_text(encoding="utf-8")
    study = tmp_path / "study.toml"
    study.write_text(text.replace("sliding = [0.0, 0.9]", "sliding = [0.5]"), encoding="utf-8")
    with pytest.raises(InputError, match=r"presses\.sliding needs one value more"):
        load_dataset_study(study)


@pytest.mark.parametrize(
    "values",
    [
        np.ones((11, 2)) + 1j,
        np.full((11, 2), np.datetime64("2020-01-01")),
        np.full((11, 2), "one"),
        b"forces",
        [[1, 2], [3]],
        {1.0, 2.0},
        None,
        np.empty(0),
    ],
    ids=["complex", "dates", "words", "bytes", "ragged", "set", "None", "empty"],
)
def test_what_is_no_array_of_forces_is_refused(model: ff.SensorModel, values: Any) -> None:
    with pytest.raises(InputError, match="Forces"):
        model.expose(values)
    with pytest.raises(InputError, match=r"Grey levels|Frames"):
        ff.calibrate(model.sensor, values, np.ones((8, 11, 2)))


@pytest.mark.parametrize(
    "same",
    [
        lambda forces: forces.astype(">f8"),
        lambda forces: forces.astype(object),
        lambda forces: forces.astype(str),
        lambda forces: forces[::-1][::-1],
        lambda forces: forces.tolist(),
    ],
    ids=["big-endian", "object", "text", "strides", "lists"],
)
def test_the_same_forces_in_another_form_give_the_same_phase(
    model: ff.SensorModel, same: Any
) -> None:
    forces = ff.polar(1.0, 10, n=11)
    np.testing.assert_array_equal(model.phase(same(forces)), model.phase(forces))


def test_what_a_masked_array_hides_is_not_taken(model: ff.SensorModel) -> None:
    hidden = np.ma.masked_less([1.0, 2.0, 3.0], 2.0)
    np.testing.assert_array_equal(numbers(hidden, "Numbers"), [np.nan, 2.0, 3.0])
    frame = model.expose(ff.polar(1.0, 10, n=11), rng=0)
    reading = ff.Reader(model).read(np.ma.masked_greater(frame, np.median(frame)))
    assert reading.status is ff.Status.BAD_FRAME
    with pytest.raises(InputError, match="finite"):
        model.expose(np.ma.masked_less(np.ones((11, 2)), 2.0))
    assert checked_loads(np.ma.masked_less(np.ones((11, 2)), 0.5), 11).all()


def test_frames_that_do_not_change_are_not_calibrated_with(model: ff.SensorModel) -> None:
    loads = np.random.default_rng(0).uniform(0.1, 1.5, (8, 11, 2)) * [1.0, 0.2]
    with pytest.raises(InputError, match="hardly change from frame to frame"):
        ff.calibrate(model.sensor, model.expose(loads, rng=1) > 0, loads)


def _any(value: Any) -> Any:
    """A value that a type checker takes for any."""
    return value


@pytest.mark.parametrize(
    ("called", "words"),
    [
        (lambda sensor, model: ff.Reader(sensor), ["takes a model", "characterize(sensor)"]),
        (lambda sensor, model: ff.characterize(model), ["made of a design", "load_sensor"]),
        (lambda sensor, model: ff.touch(model, _any(None)), ["touch(model.sensor, reading)"]),
        (lambda sensor, model: ff.Press(x=_any("2 mm"), normal=1.0), ["'2 mm'", "metres"]),
        (
            lambda sensor, model: model.expose([ff.Press(x=2.1, normal=1.0)]),
            ["2100 mm", "+-12.5 mm", "metres"],
        ),
        (
            lambda sensor, model: ff.model_from_influence(
                np.linspace(-10, 10, 11),
                np.ones((11, 1)),
                {"pixels": 64, "bits": 8, "amplitude": 200, "offset": 20, "noise": 5},
                {"wavelength": "546.1 nm"},
            ),
            ["-10 m to 10 m", "0.0127"],
        ),
        (
            lambda sensor, model: sensor.replace(**{"polariscope.wavelength": 632.8}),
            ["no wavelength of light", '"632.8 nm"'],
        ),
    ],
    ids=["reader", "characterize", "touch", "press", "beyond", "influence", "wavelength"],
)
def test_what_was_swapped_or_lacks_its_unit_is_named_with_its_remedy(
    model: ff.SensorModel, called: Any, words: list[str]
) -> None:
    with pytest.raises(ff.FringeforceError) as refusal:
        called(model.sensor, model)
    assert all(word in str(refusal.value) for word in words)
