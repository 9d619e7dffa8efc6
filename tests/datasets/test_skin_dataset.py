"""Data sets of skins: labels are those of the presses, and readings agree with them."""

import csv
from pathlib import Path

import h5py
import numpy as np
import pytest
from PIL import Image

import fringeforce as ff
from fringeforce.base.errors import DesignError, InputError
from fringeforce.contacts.random_presses import PressRanges, random_presses
from fringeforce.datasets.making import Dataset, run_dataset
from fringeforce.datasets.shard import Shard, examples
from fringeforce.datasets.sheet import draw_sheet
from fringeforce.datasets.study_file import DatasetStudy, load_dataset_study
from fringeforce.studies.execution import Inline

EXAMPLE = Path(__file__).parents[2] / "examples" / "dataset" / "fingers.toml"
FAR = 5.0
"""Deviations: beyond them lies one in two million."""


@pytest.fixture(scope="module")
def fingers() -> tuple[DatasetStudy, ff.Sensor]:
    """The study of the example, with fewer lines, on a strip that has an exact series."""
    study, sensor = load_dataset_study(EXAMPLE)
    assert isinstance(sensor, ff.Sensor)
    sensor = sensor.replace(**{"transducer.edges": "roller"})
    return study.model_copy(update={"number": 7, "shard": 4}), sensor


@pytest.fixture(scope="module")
def made(
    fingers: tuple[DatasetStudy, ff.Sensor], tmp_path_factory: pytest.TempPathFactory
) -> Dataset:
    return run_dataset(*fingers, tmp_path_factory.mktemp("fingers"), Inline())


def test_labels_are_what_is_read(made: Dataset, fingers: tuple[DatasetStudy, ff.Sensor]) -> None:
    reader = ff.Reader(ff.characterize(fingers[1]))
    lines = 0
    for shard in made.shards:
        with h5py.File(shard) as file:
            images, forces = np.asarray(file["image"]), np.asarray(file["forces"])
            table, numbers = np.asarray(file["contacts"]), np.asarray(file["number"])
            places = np.asarray(file["tactel_x"])
        for number, image, load in zip(numbers, images, forces, strict=True):
            own = table[table["image"] == number]
            np.testing.assert_allclose(load.sum(axis=0)[0], own["normal"].sum(), rtol=1e-4)
            moment = own["normal"] @ own["x"]
            np.testing.assert_allclose(load[:, 0] @ places, moment, atol=1e-6)
            reading = reader.search(image)
            if not reading.ok or len(reading.contacts) != len(own):
                continue
            lines += 1
            felt = sorted(reading.contacts, key=lambda one: one.centre[0])
            for one, row in zip(felt, own, strict=True):
                values = np.array([*one.force, one.centre[0], one.width or 0.0])
                label = np.array([row["normal"], row["tangential"], row["x"], row["width"]])
                assert (np.abs(values - label) < FAR * one.std[[0, 1, 5, 6]]).all()
    assert lines >= 5  # of seven


def test_a_line_depends_on_its_number_alone(
    made: Dataset, fingers: tuple[DatasetStudy, ff.Sensor]
) -> None:
    (last,) = examples(Shard(*fingers, 5, 1))
    with h5py.File(made.shards[1]) as file:
        np.testing.assert_array_equal(np.asarray(file["image"])[1], last.image)


def test_pictures_and_tables_say_the_same(
    made: Dataset, fingers: tuple[DatasetStudy, ff.Sensor], tmp_path: Path
) -> None:
    study = fingers[0].model_copy(update={"format": "png", "number": 2})
    png = run_dataset(study, fingers[1], tmp_path / "png", Inline())
    with h5py.File(made.shards[0]) as file:
        first, rows = np.asarray(file["image"])[0], np.asarray(file["contacts"])
    shown = np.asarray(Image.open(png.shards[0] / "000000.png"))
    np.testing.assert_array_equal(shown, first[None])
    with open(png.shards[0] / "contacts.csv", newline="") as file:
        found = list(csv.DictReader(file))
    assert float(found[0]["normal"]) == pytest.approx(float(rows["normal"][0]), rel=1e-5)
    assert float(found[0]["width"]) == pytest.approx(float(rows["width"][0]), rel=1e-5)


def test_tolerances_of_the_design_vary_from_line_to_line(
    fingers: tuple[DatasetStudy, ff.Sensor],
) -> None:
    sensor = fingers[1].replace(**{"camera.amplitude": "200 +/- 10 %", "camera.noise": 0})
    quiet = fingers[0].model_copy(update={"presses": PressRanges(count=(1, 1), normal=(3.0, 4.0))})
    brightest = [one.image.max() for one in examples(Shard(quiet, sensor, 0, 6))]
    assert np.ptp(brightest) > 20


def test_a_sheet_shows_lines(fingers: tuple[DatasetStudy, ff.Sensor], tmp_path: Path) -> None:
    draw_sheet(fingers[1], examples(Shard(*fingers, 0, 3)), tmp_path / "sheet.png")
    assert np.asarray(Image.open(tmp_path / "sheet.png")).std() > 10


def test_presses_keep_their_distance_and_their_ranges() -> None:
    ranges = PressRanges(count=(3, 3), friction=(0.5, 0.6), sliding=(0.2, 0.4))
    for seed in range(50):
        presses = random_presses(13e-3, seed, ranges)
        places = np.array([press.x for press in presses])
        assert (np.diff(places) > ranges.apart).all()
        assert np.abs(places).max() < 6.5e-3
        for press in presses:
            assert ranges.normal[0] <= press.normal <= ranges.normal[1]
            assert 0.2 * 0.5 <= np.abs(press.tangential) / press.normal <= 0.4 * 0.6
    with pytest.raises(InputError, match="find no room"):
        random_presses(6e-3, 0, ranges)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('design = "saad"\nnumber = 3\n', "strip with tactels"),
        ('design = "skin"\nnumber = 3\n[optics]\nblur = ["0 um", "1 um"]\n', "tolerances"),
        ('design = "pad"\nnumber = 3\n[presses]\ncount = [1, 2]\n', r"\[contacts\]"),
    ],
)
def test_studies_that_do_not_fit_are_told(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises((InputError, DesignError), match=words):
        load_dataset_study(path)
