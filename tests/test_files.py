"""Files are whole or absent, and other programs can read them."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import tifffile
import xarray
from PIL import Image

import fringeforce as ff
from fringeforce.io import frames as files
from fringeforce.models import strip
from fringeforce.models.imaging import Imaging


@pytest.fixture
def saved(model: ff.SensorModel, tmp_path: Path) -> Path:
    path = tmp_path / "m.h5"
    model.save(path)
    return path


def test_a_model_comes_back_as_it_was(model: ff.SensorModel, saved: Path) -> None:
    back = ff.load_model(saved)
    assert back.sensor == model.sensor
    assert back.provenance == model.provenance
    np.testing.assert_array_equal(back.psi, model.psi)
    np.testing.assert_array_equal(back.pixel_influence, model.pixel_influence)


def test_xarray_shows_a_model_with_labels_and_units(model: ff.SensorModel, saved: Path) -> None:
    with xarray.open_dataset(saved, engine="h5netcdf") as dataset:
        assert dataset["psi"].dims == ("x", "tactel", "component")
        assert dataset["psi"].attrs["units"] == "rad/N"
        assert list(dataset["component"].values) == ["normal", "tangential"]
        np.testing.assert_allclose(dataset["tactel"], model.sensor.tactels.positions)
        np.testing.assert_allclose(dataset["psi"], model.psi)


def test_xarray_shows_frames_beside_their_forces(model: ff.SensorModel, tmp_path: Path) -> None:
    forces = np.stack([ff.polar(1.0, 10, n=11), ff.polar(2.0, -5, n=11)])
    frames = model.expose(forces, rng=0)
    files.save_frames(tmp_path / "f.h5", frames, model.sensor.pixel_positions, forces)
    with xarray.open_dataset(tmp_path / "f.h5", engine="h5netcdf") as dataset:
        assert dataset["grey"].dims == ("frame", "x")
        np.testing.assert_array_equal(dataset["grey"], frames)
        np.testing.assert_allclose(dataset["forces"], forces)


@pytest.mark.parametrize("ending", [".h5", ".npy", ".png", ".tiff"])
def test_frames_come_back_from_every_kind_of_file(
    model: ff.SensorModel, tmp_path: Path, ending: str
) -> None:
    frames = model.expose(np.stack([ff.polar(1.0, 10, n=11)] * 3), rng=0)
    path = tmp_path / f"frames{ending}"
    if ending == ".h5":
        files.save_frames(path, frames, model.sensor.pixel_positions)
    elif ending == ".npy":
        np.save(path, frames)
    elif ending == ".png":
        Image.fromarray(frames).save(path)
    else:
        tifffile.imwrite(path, frames.astype(np.uint16))
    np.testing.assert_array_equal(files.load_frames(path), frames)


@pytest.mark.parametrize("kept", [0.1, 0.5, 0.9, 0.999])
def test_a_truncated_model_is_refused(saved: Path, kept: float) -> None:
    whole = saved.read_bytes()
    saved.write_bytes(whole[: int(kept * len(whole))])
    with pytest.raises(ff.FringeforceError, match=r"m\.h5.*truncated"):
        ff.load_model(saved)


def test_a_foreign_file_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["psi"] = np.zeros(3)
    with pytest.raises(ff.FringeforceError, match="foreign"):
        ff.load_model(tmp_path / "other.h5")
    (tmp_path / "text.h5").write_text("no HDF5 at all")
    with pytest.raises(ff.FringeforceError, match=r"text\.h5"):
        ff.load_model(tmp_path / "text.h5")
    with pytest.raises(ff.FringeforceError, match="There is no file"):
        ff.load_model(tmp_path / "missing.h5")


def test_a_file_of_a_newer_format_asks_for_an_update(saved: Path) -> None:
    with h5py.File(saved, "a") as file:
        file.attrs["format_version"] = 99
    with pytest.raises(ff.FringeforceError, match=r"99.*Update"):
        ff.load_model(saved)


def test_a_model_of_the_first_format_is_read_with_its_components_turned(
    model: ff.SensorModel, tmp_path: Path
) -> None:
    modes = np.random.default_rng(1).normal(size=(2, *model.pixel_influence.shape))
    known = Imaging.known(model.sensor.pixel_positions, np.ones(2048), np.zeros(2048))
    calibrated = replace(model, imaging=replace(known, influence_modes=modes))
    calibrated.save(tmp_path / "m.h5")
    with h5py.File(tmp_path / "m.h5", "a") as file:
        # as version 1 wrote them: (x, component, tactel) and (modes, pixels, components, tactels)
        for name, values in (("psi", model.psi), ("imaging/influence_modes", modes)):
            del file[name]
            file[name] = np.swapaxes(values, -1, -2)
        file.attrs["format_version"] = 1
    back = ff.load_model(tmp_path / "m.h5")
    np.testing.assert_array_equal(back.psi, model.psi)
    np.testing.assert_array_equal(back.imaging.influence_modes, modes)


def test_frames_are_not_taken_for_a_model(model: ff.SensorModel, tmp_path: Path) -> None:
    files.save_frames(tmp_path / "f.h5", np.zeros((1, 2048)), model.sensor.pixel_positions)
    with pytest.raises(ff.FringeforceError, match="frames"):
        ff.load_model(tmp_path / "f.h5")


def test_a_failed_write_leaves_the_old_file_and_no_scrap(
    model: ff.SensorModel, saved: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = saved.read_bytes()

    def fail(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(strip, "write", fail)
    with pytest.raises(OSError, match="disk full"):
        model.save(saved)
    assert saved.read_bytes() == before
    assert [path.name for path in saved.parent.iterdir()] == ["m.h5"]


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.bmp", b"", "not from '.bmp'"),
        ("a.png", b"nothing", "cannot be read"),
        ("a.npy", b"nothing", "cannot be read"),
    ],
)
def test_frames_of_another_kind_are_refused(
    tmp_path: Path, name: str, content: bytes, words: str
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ff.FringeforceError, match=words):
        files.load_frames(tmp_path / name)


def _flipped(content: bytes, rng: np.random.Generator) -> bytes:
    damaged = bytearray(content)
    damaged[rng.integers(len(content))] ^= 1 << int(rng.integers(8))
    return bytes(damaged)


def _values(path: Path) -> dict[str, Any]:
    """Everything in an HDF5 file, read without the package."""
    found: dict[str, Any] = {}

    def visit(name: str, item: Any) -> None:
        found[name] = item[()].tolist() if isinstance(item, h5py.Dataset) else None
        found.update({f"{name}@{key}": str(value) for key, value in item.attrs.items()})

    with h5py.File(path, "r") as file:
        visit("", file)
        file.visititems(visit)
    return {name: value for name, value in found.items() if "_LIST" not in name}


@pytest.mark.parametrize("kind", ["model", "calibrated", "frames"])
def test_a_flipped_bit_is_reported_or_changes_nothing(
    model: ff.SensorModel, tmp_path: Path, kind: str
) -> None:
    path, load = tmp_path / f"{kind}.h5", ff.load_model
    if kind == "frames":
        load = files.load_frames
        frames = model.expose(np.stack([ff.polar(1.0, 10, n=11)] * 3), rng=0)
        files.save_frames(path, frames, model.sensor.pixel_positions)
    elif kind == "calibrated":
        places, rng = model.sensor.pixel_positions, np.random.default_rng(19)
        size, tactels = places.size, model.sensor.tactels.total
        imaging = Imaging(
            positions=places,
            amplitude=rng.uniform(90, 110, size),
            offset=rng.uniform(1, 3, size),
            usable=rng.random(size) > 0.01,
            influence_modes=rng.normal(size=(1, size, tactels, 2)),
            amplitude_modes=rng.normal(size=(2, size)),
            offset_modes=rng.normal(size=(2, size)),
        )
        replace(model, imaging=imaging).save(path)
    else:
        model.save(path)
    whole, rng = path.read_bytes(), np.random.default_rng(20)
    expected, refused = _values(path), 0
    for _ in range(150):
        path.write_bytes(_flipped(whole, rng))
        try:
            load(path)
        except ff.FringeforceError as error:
            refused += "does not match its checksum" in str(error)
        else:
            assert _values(path) == expected
    assert refused > 140


def test_a_file_without_checksum_loads_as_before(model: ff.SensorModel, saved: Path) -> None:
    content = saved.read_bytes()
    saved.write_bytes(content[: content.rindex(b"\nfringeforce-sha256:")])
    np.testing.assert_array_equal(ff.load_model(saved).psi, model.psi)


def test_a_pipe_in_the_place_of_a_file_does_not_block(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "m.h5")
    with pytest.raises(ff.FringeforceError, match="no regular file"):
        ff.load_model(tmp_path / "m.h5")


def test_an_array_whose_header_is_damaged_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "f.npy"
    np.save(path, np.zeros((3, 2048), np.uint8))
    content = path.read_bytes()
    for place in range(128):
        for bit in range(8):
            damaged = bytearray(content)
            damaged[place] ^= 1 << bit
            path.write_bytes(damaged)
            try:
                assert files.load_frames(path).ndim == 2
            except ff.FringeforceError as error:
                assert "f.npy" in str(error)  # noqa: PT017
