"""Data sets are resumed only from their own, undamaged shards."""

import shutil
import subprocess
from pathlib import Path

import pytest

from fringeforce.base.errors import FileFormatError, InputError
from fringeforce.datasets.making import run_dataset
from fringeforce.datasets.study_file import DatasetStudy
from fringeforce.design.pad import Pad
from fringeforce.studies.execution import Inline

pytestmark = pytest.mark.slow
Touches = tuple[DatasetStudy, Pad]


@pytest.fixture(scope="module")
def small(touches: Touches) -> Touches:
    return touches[0].model_copy(update={"number": 4, "shard": 2, "format": "png"}), touches[1]


@pytest.fixture
def folder(small: Touches, whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "copy"))


@pytest.fixture(scope="module")
def whole(small: Touches, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run_dataset(*small, tmp_path_factory.mktemp("png"), Inline()).folder


def test_sums_are_those_that_other_programs_check(folder: Path) -> None:
    for shard in folder.glob("shard-*"):
        command = ["sha256sum", "--strict", "-c", "SHA256SUMS"]
        run = subprocess.run(command, cwd=shard, capture_output=True, text=True, check=True)
        assert run.stdout.count(": OK") == len(list(shard.iterdir())) - 1


@pytest.mark.parametrize("name", ["images.csv", "forces.csv", "000001.png", "SHA256SUMS"])
@pytest.mark.parametrize("how", ["cut", "flipped", "gone"])
def test_a_damaged_folder_is_refused(folder: Path, small: Touches, name: str, how: str) -> None:
    path = folder / "shard-00000" / name
    content = path.read_bytes()
    changes = {"cut": content[: len(content) // 2], "flipped": content[:-9] + b"?" + content[-8:]}
    path.unlink() if how == "gone" else path.write_bytes(changes[how])
    with pytest.raises(FileFormatError, match=r"shard-00000 is damaged .* remove it"):
        run_dataset(*small, folder, Inline())


def test_a_shard_in_the_place_of_another_is_refused(folder: Path, small: Touches) -> None:
    shutil.rmtree(folder / "shard-00000")
    shutil.move(folder / "shard-00001", folder / "shard-00000")
    with pytest.raises(InputError, match="holds other images than 0 to 1 of this study"):
        run_dataset(*small, folder, Inline())


@pytest.mark.parametrize("form", ["hdf5", "png"])
def test_a_shard_of_another_study_is_refused(
    folder: Path, small: Touches, tmp_path: Path, form: str
) -> None:
    study = small[0].model_copy(update={"format": form, "number": 2})
    other = study.model_copy(update={"seed": 1})
    for name, one in (("one", study), ("other", other)):
        run_dataset(one, small[1], tmp_path / name, Inline())
    shard = "shard-00000.h5" if form == "hdf5" else "shard-00000"
    place = tmp_path / "one" / shard
    shutil.rmtree(place) if place.is_dir() else place.unlink()
    shutil.move(tmp_path / "other" / shard, place)
    with pytest.raises(InputError, match="holds other images"):
        run_dataset(study, small[1], tmp_path / "one", Inline())


def test_folders_of_earlier_versions_are_resumed(folder: Path, small: Touches) -> None:
    for shard in folder.glob("shard-*"):
        (shard / "SHA256SUMS").unlink()
        (shard / "study.json").unlink()
    assert run_dataset(*small, folder, Inline()).made == 0
