"""Data sets are the same whoever makes them, and survive being stopped."""

import csv
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import fringeforce as ff
from fringeforce.base.errors import FileFormatError, InputError
from fringeforce.datasets.making import Dataset, run_dataset
from fringeforce.datasets.study_file import NAMES, DatasetStudy, Split, load_dataset_study
from fringeforce.design.pad import Pad
from fringeforce.studies.execution import Inline, executor

pytestmark = pytest.mark.slow

EXAMPLE = Path(__file__).parents[2] / "examples" / "dataset"
Touches = tuple[DatasetStudy, Pad]


def content(folder: Path) -> Mapping[str, NDArray[Any]]:
    """Everything in the shards of a folder, joined."""
    columns: dict[str, list[NDArray[Any]]] = {}
    for path in sorted(folder.glob("shard-*.h5")):
        with h5py.File(path) as file:
            for name, values in file.items():
                part = np.asarray(values)
                text = part.dtype.kind == "O"
                columns.setdefault(name, []).append(part.astype("S") if text else part)
    return {name: np.concatenate(parts) for name, parts in columns.items()}


def assert_same(one: Path, other: Path) -> None:
    found, expected = content(one), content(other)
    assert found.keys() == expected.keys()
    for name, values in found.items():
        assert_equal(values, expected[name])


def assert_equal(one: NDArray[Any], other: NDArray[Any]) -> None:
    """To the bit: rows of tables hold values that are not a number."""
    assert one.shape == other.shape
    assert one.tobytes() == other.tobytes()


def test_a_dask_cluster_makes_the_same_data_set(
    touches: Touches, made: Dataset, tmp_path: Path
) -> None:
    distributed = pytest.importorskip("distributed", reason="the extra 'cluster' is not installed")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
        ) as cluster,
        executor(cluster.scheduler_address) as pool,
    ):
        run_dataset(*touches, tmp_path, pool)
    assert_same(tmp_path, made.folder)


def test_shards_of_other_sizes_hold_the_same_images(
    touches: Touches, made: Dataset, tmp_path: Path
) -> None:
    study, pad = touches
    run_dataset(study.model_copy(update={"shard": 7}), pad, tmp_path, Inline())
    found, expected = content(tmp_path), content(made.folder)
    for name in ("image", "forces", "number", "split", "contacts", "optics", "dead"):
        assert_equal(found[name], expected[name])


def test_a_process_that_is_killed_leaves_whole_shards_that_two_others_go_on_with(
    touches: Touches, made: Dataset, tmp_path: Path
) -> None:
    study = (EXAMPLE / "touches.toml").read_text(encoding="utf-8")
    study = study.replace("number = 96", "number = 10").replace("shard = 48", "shard = 4")
    (tmp_path / "study.toml").write_text(study, encoding="utf-8")
    pad = (EXAMPLE / "small-pad.toml").read_text(encoding="utf-8")
    (tmp_path / "small-pad.toml").write_text(pad, encoding="utf-8")
    code = (
        "import os, signal, fringeforce as ff\n"
        "def stop(title, done, count):\n"
        "    if done == 4:\n"
        "        os.kill(os.getpid(), signal.SIGKILL)\n"
        "ff.make_dataset('study.toml', 'touches', workers=0, progress=stop)\n"
    )
    ended = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=False)
    assert ended.returncode == -signal.SIGKILL
    folder = tmp_path / "touches"
    assert [path.name for path in folder.glob("shard-*")] == ["shard-00000.h5"]
    # what a kill in the middle of writing leaves behind
    (folder / ".part-shard-00001.h5").write_bytes(b"half a shard")
    before = (folder / "shard-00000.h5").stat().st_mtime_ns
    told: list[int] = []
    done = ff.make_dataset(
        tmp_path / "study.toml", folder, workers=2, progress=lambda _, n, count: told.append(n)
    )
    assert done.made == 6
    assert (told[0], told[-1], len(told)) == (4, 10, 3)
    assert (folder / "shard-00000.h5").stat().st_mtime_ns == before
    assert sorted(path.name for path in folder.iterdir()) == sorted(
        ["dataset.json", *(f"shard-{number:05d}.h5" for number in range(3))]
    )
    assert_same(folder, made.folder)


def test_a_data_set_grows_and_no_image_changes(
    touches: Touches, made: Dataset, tmp_path: Path
) -> None:
    study, pad = touches
    run_dataset(study.model_copy(update={"number": 6}), pad, tmp_path, Inline())
    grown = run_dataset(study, pad, tmp_path, Inline())
    assert grown.made == 6  # the second shard had two of four, the third is new
    assert grown.parts == made.parts
    assert_same(tmp_path, made.folder)
    assert run_dataset(study, pad, tmp_path, Inline()).made == 0


def test_the_data_set_of_another_study_is_not_touched(
    touches: Touches, made: Dataset, tmp_path: Path
) -> None:
    study, pad = touches
    before = content(made.folder)["image"]
    with pytest.raises(InputError, match="another study"):
        run_dataset(study.model_copy(update={"seed": 1}), pad, made.folder, Inline())
    np.testing.assert_array_equal(content(made.folder)["image"], before)
    (tmp_path / "shard-00000.h5").write_bytes(b"")
    with pytest.raises(InputError, match=r"without dataset\.json"):
        run_dataset(study, pad, tmp_path, Inline())
    (tmp_path / "dataset.json").write_text(study.canonical(pad))
    with pytest.raises(FileFormatError, match="shard-00000"):
        run_dataset(study, pad, tmp_path, Inline())
    (tmp_path / "file").write_text("")
    with pytest.raises(FileFormatError, match="cannot be written"):
        run_dataset(study, pad, tmp_path / "file", Inline())


def test_pictures_and_tables_say_the_same(touches: Touches, made: Dataset, tmp_path: Path) -> None:
    study, pad = touches
    few = study.model_copy(update={"number": 6, "format": "png"})
    run_dataset(few.model_copy(update={"number": 5}), pad, tmp_path, Inline())
    assert run_dataset(few, pad, tmp_path, Inline()).made == 2
    expected = content(made.folder)
    for number in range(6):
        shard = tmp_path / f"shard-{number // 4:05d}"
        with Image.open(shard / f"{number:06d}.png") as picture:
            np.testing.assert_array_equal(np.asarray(picture), expected["image"][number])
        rows = [row for row in table(shard / "forces.csv") if row["image"] == str(number)]
        names = ("normal_N", "tangential_x_N", "tangential_y_N")
        forces = [[float(row[name]) for name in names] for row in rows]
        np.testing.assert_allclose(forces, expected["forces"][number], rtol=1e-5, atol=1e-7)
    listed = table(tmp_path / "shard-00000" / "images.csv")
    assert [NAMES.index(row["split"]) for row in listed] == list(expected["split"][:4])
    first = table(tmp_path / "shard-00000" / "contacts.csv")[0]
    assert first["kind"] == expected["contacts"]["kind"][0].decode()
    assert float(first["normal"]) == pytest.approx(float(expected["contacts"]["normal"][0]))


def table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_every_run_of_numbers_is_split_as_asked() -> None:
    split = Split(train=0.7, validation=0.2, test=0.1)
    parts = np.array([split.part(number) for number in range(1000)])
    for number in (10, 100, 1000):
        shares = np.bincount(parts[:number], minlength=3) / number
        np.testing.assert_allclose(shares, (0.7, 0.2, 0.1), atol=2 / number + 2e-3)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("number = 96", "numbers = 96", ["numbers is not a key", "'number'"]),
        ('normal = ["0.05 N", "0.8 N"]', "normal = [0.05, 0.8]", ["contacts.normal", "unit"]),
        ("noise = [1.0, 3.0]", "noise = [3.0, 1.0]", ["optics.noise", "[1, 3]"]),
        ('["point", "sphere"', '["pin", "sphere"', ["contacts.kinds", "'point'"]),
        ('design = "small-pad.toml"', 'design = "saad"', ["strip", "'pad'"]),
        ("train = 0.75", "train = -1.0", ["split.train", "0"]),
    ],
)
def test_a_mistake_in_a_study_is_named(
    old: str, new: str, words: list[str], tmp_path: Path
) -> None:
    text = (EXAMPLE / "touches.toml").read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "study.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_dataset_study(tmp_path / "study.toml")
    assert all(word in str(caught.value) for word in words), str(caught.value)
