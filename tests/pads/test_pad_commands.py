"""A pad on the command line: forces in, images out, and back."""

import csv
from pathlib import Path

import h5py
import numpy as np
import pytest

import fringeforce as ff
from commands import run
from fringeforce.design.pad import Pad
from fringeforce.io.frames import load_frames, save_frames
from fringeforce.io.tables import load_forces
from fringeforce.models.pad import PadModel

pytestmark = pytest.mark.slow

LOADS = [(7, 2.0, 0.3, -0.1), (8, 1.0, 0.0, 0.2)]
"""Tactel, N, T_x, T_y of the first frame; the second has no load."""


@pytest.fixture(scope="module")
def place(model: PadModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pad")
    model.save(folder / "m.h5")
    rows = [f"0,{','.join(map(str, row))}" for row in LOADS] + ["1,1,0,0,0"]
    header = "frame,tactel,normal_N,tangential_x_N,tangential_y_N"
    (folder / "f.csv").write_text("\n".join([header, *rows]) + "\n")
    result = run("simulate", "m.h5", "f.csv", "-o", "i.h5", "--seed", "3", cwd=folder)
    assert result.returncode == 0, result.stderr
    return folder


@pytest.fixture(scope="module")
def loads(pad: Pad) -> np.ndarray:
    forces = np.zeros((2, pad.tactels.total, 3))
    for tactel, *values in LOADS:
        forces[0, tactel - 1] = values
    return forces


def test_simulated_images_are_those_of_the_library(place: Path, model: PadModel, loads) -> None:
    np.testing.assert_array_equal(load_frames(place / "i.h5", 2), model.expose(loads, rng=3))


def test_forces_of_images_come_back_within_their_deviations(place: Path, loads) -> None:
    result = run("read", "m.h5", "i.h5", "-o", "r.csv", "--plot", cwd=place)
    assert result.returncode == 0, result.stderr
    assert (place / "r.png").stat().st_size > 5000
    with open(place / "r.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == 20 * ["OK"] + 20 * ["NO_CONTACT"]
    names = ("normal", "tangential_x", "tangential_y")
    std = np.array([[float(row[f"{name}_std_N"]) for name in names] for row in rows])
    error = load_forces(place / "r.csv", 20, Pad.components) - loads
    assert (np.abs(error.reshape(-1, 3)) < 5 * std).all()


def test_show_tells_how_well_a_pad_reads(place: Path, model: PadModel) -> None:
    result = run("show", "m.h5", cwd=place)
    assert result.returncode == 0, result.stderr
    bound = ff.Reader(model).bound(np.zeros((20, 3)))
    assert f"{1e3 * np.median(bound[:, 0]):.3g} mN normal" in result.stdout


@pytest.mark.parametrize(
    ("option", "words"),
    [
        (("--friction", "0.5"), "friction"),
        (("--tolerance", "transducer.length = 20 mm +/- 1 mm"), "transducer.length"),
    ],
)
def test_what_pads_are_not_read_with_is_refused(
    place: Path, option: tuple[str, str], words: str
) -> None:
    result = run("read", "m.h5", "i.h5", "-o", "no.csv", *option, cwd=place)
    assert result.returncode == 2
    assert words in result.stderr
    assert not (place / "no.csv").exists()


@pytest.mark.parametrize("shape", [(80, 96), (2, 80, 96), (2, 3, 80, 96)])
def test_images_are_read_from_arrays_and_their_own_files(
    tmp_path: Path, pad: Pad, shape: tuple[int, ...]
) -> None:
    images = np.random.default_rng(0).integers(0, 255, shape, dtype=np.uint8)
    stack = images[None] if images.ndim == 2 else images
    np.save(tmp_path / "i.npy", images)
    np.testing.assert_array_equal(load_frames(tmp_path / "i.npy", 2), stack)
    save_frames(tmp_path / "i.h5", stack, pad.pixel_positions)
    np.testing.assert_array_equal(load_frames(tmp_path / "i.h5", 2), stack)


def test_images_that_an_earlier_version_wrote_are_read(tmp_path: Path, pad: Pad) -> None:
    images = np.random.default_rng(0).integers(0, 255, (2, 80, 96), dtype=np.uint8)
    save_frames(tmp_path / "i.h5", images, pad.pixel_positions)
    with h5py.File(tmp_path / "i.h5", "a") as file:
        file.attrs["format"] = "fringeforce-images"
    np.testing.assert_array_equal(load_frames(tmp_path / "i.h5", 2), images)


def test_images_are_not_taken_for_lines_nor_lines_for_images(tmp_path: Path, pad: Pad) -> None:
    save_frames(tmp_path / "i.h5", np.zeros((2, 80, 96), np.uint8), pad.pixel_positions)
    with pytest.raises(ff.FringeforceError, match=r"images of a pad.*are lines of a strip"):
        load_frames(tmp_path / "i.h5")
    save_frames(tmp_path / "l.h5", np.zeros((2, 96), np.uint8), pad.pixel_positions[0])
    with pytest.raises(ff.FringeforceError, match=r"lines of a strip.*are images of a pad"):
        load_frames(tmp_path / "l.h5", 2)


def test_images_of_a_data_set_are_read(pad: Pad) -> None:
    shard = next((Path(__file__).parents[2] / "examples" / "dataset").rglob("shard-*.h5"))
    images = load_frames(shard, 2)
    assert images.ndim == 3
    assert images.dtype == np.uint8


@pytest.mark.parametrize("shape", [(5,), (1, 1, 1, 2, 2)])
def test_an_array_that_is_no_images_is_refused(tmp_path: Path, shape: tuple[int, ...]) -> None:
    np.save(tmp_path / "i.npy", np.zeros(shape))
    with pytest.raises(ff.FringeforceError, match="images of a pad"):
        load_frames(tmp_path / "i.npy", 2)


def test_a_strip_s_table_is_no_table_of_a_pad(tmp_path: Path) -> None:
    (tmp_path / "f.csv").write_text("tactel,normal_N,tangential_N\n1,1,0\n")
    with pytest.raises(ff.FringeforceError, match="tangential_x_N and tangential_y_N"):
        load_forces(tmp_path / "f.csv", 20, Pad.components)


def test_a_command_for_strips_says_so(place: Path) -> None:
    result = run("study", "creep", "pad", cwd=place)
    assert result.returncode == 2
    assert "planar pad" in result.stderr
    assert len(result.stderr.splitlines()) == 1
