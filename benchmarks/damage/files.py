"""Models, frames and shards with one bit changed, or cut off."""

from __future__ import annotations

import pickle
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import tifffile
from PIL import Image

import fringeforce as ff
from damage.arrays import PATH
from damage.counting import Case, damaged, refused
from damage.designs import changed_line
from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.datasets.making import DESCRIPTION
from fringeforce.io.frames import load_frames, load_times, save_frames
from fringeforce.pictures.extraction import extract_frames
from fringeforce.studies.performance import NAMES, Performance
from fringeforce.studies.result_store import open_store, read_results
from fringeforce.studies.study_file import load_study
from fringeforce.studies.sweep import prepared, start

EXAMPLES = Path(__file__).parents[2] / "examples"


def model_files(
    model: ff.SensorModel, folder: Path, rng: np.random.Generator, tries: int
) -> Iterator[Case]:
    """A model with one bit changed, or cut off."""
    path = folder / "model.h5"
    model.save(path)
    content = path.read_bytes()

    def same() -> None:
        loaded = ff.load_model(path)
        assert loaded.sensor == model.sensor, "another design"
        assert np.array_equal(loaded.psi, model.psi), "another influence matrix"

    for number in range(tries):
        path.write_bytes(damaged(content, rng, number % 4 == 0))
        yield f"model {number}", same


def calibration_files(
    model: ff.SensorModel, folder: Path, rng: np.random.Generator, tries: int
) -> Iterator[Case]:
    """Calibrated models of strip and pad with one bit changed, or cut off."""
    drawn = model.sensor.replace(**{"camera.pixels": 512})
    small = ff.characterize(drawn)
    loads = rng.uniform(0.1, 1.5, (8, 11, 2)) * [1.0, 0.2]
    strip = ff.calibrate(drawn, small.expose(loads, rng=1), loads, [PATH], aside=0)
    pad = ff.characterize(
        ff.load_sensor("pad").replace(tactels={"count": [3, 3]}, camera={"pixels": [64, 64]})
    )
    presses = np.zeros((18, 9, 3))
    presses[np.arange(18), np.arange(18) % 9] = rng.uniform(0.5, 2.0, (18, 3)) * [1.0, 0.2, 0.2]
    known = ff.calibrate(pad.sensor, pad.expose(presses, rng=1), presses, aside=0)
    made: list[tuple[Path, bytes, Any]] = []
    for name, one in (("strip", strip), ("pad", known)):
        path = folder / f"calibrated-{name}.h5"
        one.save(path)
        made.append((path, path.read_bytes(), pickle.dumps(ff.load_model(path))))

    def same(path: Path, good: bytes) -> None:
        assert pickle.dumps(ff.load_model(path)) == good, "another model"

    for number in range(tries):
        path, content, good = made[number % 2]
        path.write_bytes(damaged(content, rng, number % 4 == 0))
        yield f"{path.name} {number}", lambda path=path, good=good: same(path, good)


def recordings(
    model: ff.SensorModel, folder: Path, rng: np.random.Generator, tries: int
) -> Iterator[Case]:
    """Recordings of `live`, closed and killed, and their readings, with a bit changed, or cut off.

    What is taken of a cut recording are its first frames.
    """
    frames = model.expose(np.stack([ff.polar(1.0, 10, n=11)] * 40), rng=0)
    times = 1.7e9 + np.arange(40) / 100
    forces = rng.normal(size=(40, 11, 2))
    block = Readings(
        first=0,
        timestamps=times,
        forces=forces,
        std=np.abs(forces),
        chi2=np.ones(40),
        status=(ff.Status.OK,) * 40,
        lines=frames,
    )
    made: list[tuple[Path, bytes]] = []
    for target in ("record", "h5"):
        path = folder / f"{target}.h5"
        sink = ff.open_sink(f"{target}:{path}", model)
        sink.write(block)
        killed = folder / f"killed-{target}.h5"
        killed.write_bytes(path.read_bytes())
        sink.close()
        made += [(path, path.read_bytes()), (killed, killed.read_bytes())]

    def same(path: Path) -> None:
        if "record" in path.name:
            found = load_frames(path)
            np.testing.assert_array_equal(found, frames[: len(found)], err_msg="other frames")
        when = load_times(path)
        assert when is not None, "no times"
        np.testing.assert_array_equal(when, times[: len(when)], err_msg="other times")

    for path, _ in made:
        yield f"{path.name} whole", lambda path=path: same(path)
    for number in range(tries):
        path, content = made[number % len(made)]
        path.write_bytes(damaged(content, rng, number % 5 == 0))
        yield f"{path.name} {number}", lambda path=path: same(path)


def sweep_files(folder: Path, rng: np.random.Generator, tries: int) -> Iterator[Case]:
    """Results of a sweep, finished or killed, with one bit changed, or cut off: read, resumed."""
    text = (EXAMPLES / "studies/thin-or-soft.toml").read_text(encoding="utf-8")
    study = folder / "sweep.toml"
    study.write_text(text, encoding="utf-8")
    loaded, sensor = load_study(study)
    path = folder / "sweep.h5"
    axes, _, _ = prepared(loaded, sensor)
    told = loaded.canonical(sensor)
    with open_store(path, told, axes, 40) as store:
        for number in range(40):
            values = dict(zip(NAMES, rng.uniform(size=len(NAMES)).tolist(), strict=True))
            changes = start(axes, sensor)
            store.record(number, changes, Performance(**values))
        killed = path.read_bytes()
    contents, good = (path.read_bytes(), killed), read_results(path)

    def same() -> None:
        found = read_results(path)
        assert found.keys() == good.keys(), "other columns"
        for name, values in good.items():
            np.testing.assert_array_equal(found[name], values, err_msg=f"another {name}")
        with open_store(path, told, axes, 40) as store:
            assert store.outcome(7) is not None, "a result is lost"

    for content, words in zip(contents, ("finished", "killed"), strict=True):
        path.write_bytes(content)
        yield words, same
    for number in range(tries):
        path.write_bytes(damaged(contents[number // 4 % 2], rng, number % 4 == 0))
        yield f"sweep {number}", same


def frame_files(
    model: ff.SensorModel, folder: Path, rng: np.random.Generator, tries: int
) -> Iterator[Case]:
    """Frames of every kind of file with one bit changed, or cut off.

    Only HDF5 files carry a checksum of their content: of the others a changed grey level is taken.
    """
    frames = model.expose(np.stack([ff.polar(1.0, 10, n=11)] * 3), rng=0)
    paths = [folder / f"frames{ending}" for ending in (".h5", ".npy", ".png", ".tiff")]
    save_frames(paths[0], frames, model.pixel_positions)
    np.save(paths[1], frames)
    Image.fromarray(frames).save(paths[2])
    tifffile.imwrite(paths[3], frames)
    contents = [path.read_bytes() for path in paths]

    def load(path: Path) -> None:
        loaded = load_frames(path)
        assert path.suffix != ".h5" or np.array_equal(loaded, frames), "other frames"

    for number in range(tries):
        path, content = paths[number % 4], contents[number % 4]
        # half of the damage is to the first 128 bytes, where headers are
        head = 128 if number % 8 < 4 else len(content)
        path.write_bytes(damaged(content[:head], rng, number % 12 < 4) + content[head:])
        yield f"{path.name} {number}", lambda path=path: load(path)


def picture_files(folder: Path, rng: np.random.Generator, tries: int) -> Iterator[Case]:
    """Photographs and videos with one bit changed, or cut off, and regions with a line changed.

    None carries a checksum: what is taken has the shape of frames.
    """
    import av

    sensor = ff.load_sensor("saad").replace(**{"camera.pixels": 250})
    region = ff.Region([(10, 20), (309, 24), (308, 60), (9, 56)], (320, 80))
    shot = rng.integers(0, 256, (80, 320), dtype=np.uint8)
    paths = [folder / f"shot{ending}" for ending in (".png", ".jpg", ".bmp", ".tif", ".npy")]
    for path in paths[:3]:
        Image.fromarray(shot).save(path)
    tifffile.imwrite(paths[3], np.stack([shot] * 2), compression="zlib", photometric="minisblack")
    np.save(paths[4], np.stack([shot] * 2))
    for name, codec, form in (("a.mp4", "libx264", "yuv420p"), ("b.avi", "mjpeg", "yuvj420p")):
        paths.append(folder / name)
        with av.open(str(paths[-1]), "w") as container:
            stream: Any = container.add_stream(codec, rate=25)
            stream.width, stream.height, stream.pix_fmt = 320, 80, form
            for _ in range(5):
                colour = np.repeat(shot[..., None], 3, axis=2)
                container.mux(stream.encode(av.VideoFrame.from_ndarray(colour, "rgb24")))
            container.mux(stream.encode())
    stated = folder / "region.toml"
    region.save(stated)
    paths.append(stated)
    contents = [path.read_bytes() for path in paths]

    def load(path: Path) -> None:
        frames, _ = extract_frames([path], sensor, region)
        assert frames.shape[1:] == (250,), "no frames"

    def again(path: Path) -> None:
        found = ff.Region.load(path)
        found.save(folder / "again.toml")
        assert ff.Region.load(folder / "again.toml") == found, "does not read back"

    for number in range(tries):
        path, content = paths[number % len(paths)], contents[number % len(paths)]
        if path is stated:
            text, words = changed_line(content.decode(), rng, number // len(paths))
            path.write_text(text, encoding="utf-8")
            yield words, lambda path=path: again(path)
        else:
            head = 256 if number % 3 else len(content)
            path.write_bytes(damaged(content[:head], rng, number % 4 == 0) + content[head:])
            yield f"{path.name} {number}", lambda path=path: load(path)


def _study(folder: Path, form: str, seed: int = 0, contacts: int = 3) -> Path:
    """A study of twelve small lines in three shards."""
    text = (EXAMPLES / "dataset/fingers.toml").read_text(encoding="utf-8")
    changes = {
        "number = 96": "number = 12",
        "shard = 48": "shard = 4",
        "seed = 0": f"seed = {seed}",
        'format = "hdf5"': f'format = "{form}"',
        "count = [1, 3]": f"count = [1, {contacts}]",
    }
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / f"{form}-{seed}-{contacts}.toml"
    path.write_text(text, encoding="utf-8")
    return path


def _content(folder: Path) -> dict[str, bytes]:
    """Pictures and tables of a data set, or all arrays of its files but their dates."""
    import h5py

    found: dict[str, bytes] = {}
    for path in sorted(folder.rglob("*")):
        if path.suffix == ".h5":
            with h5py.File(path) as file:
                for name, values in file.items():
                    found[f"{path.name}/{name}"] = values[()].tobytes()
        elif path.is_file():
            found[str(path.relative_to(folder))] = path.read_bytes()
    return found


def shards(folder: Path, rng: np.random.Generator, tries: int) -> Iterator[Case]:
    """Data sets with a shard damaged, missing or of another data set, which are then resumed.

    What resumes has the content of what was made in one go; all else is refused.
    """
    for form in ("hdf5", "png"):
        study, whole = _study(folder, form), folder / f"{form}-whole"
        ff.make_dataset(study, whole, workers=0)
        good = _content(whole)
        others = {
            "seed": folder / f"{form}-seed",
            "contacts": folder / f"{form}-contacts",
        }
        ff.make_dataset(_study(folder, form, seed=1), others["seed"], workers=0)
        ff.make_dataset(_study(folder, form, contacts=2), others["contacts"], workers=0)
        copy = folder / f"{form}-copy"

        def resumed(study: Path = study, copy: Path = copy, good: dict[str, bytes] = good) -> None:
            ff.make_dataset(study, copy, workers=0)
            assert _content(copy) == good, "another data set"

        def fresh(copy: Path = copy, whole: Path = whole) -> list[Path]:
            shutil.rmtree(copy, ignore_errors=True)
            shutil.copytree(whole, copy)
            return sorted(copy.glob("shard-*"))

        place = fresh()
        _remove(place[1])
        yield f"{form}: a shard missing", resumed
        place = fresh()
        (copy / DESCRIPTION).unlink()
        yield f"{form}: no description", lambda resumed=resumed: refused(resumed)
        place = fresh()
        (copy / f".part-{place[0].name}").mkdir()
        _remove(place[0])
        yield f"{form}: the rest of a run that was killed", resumed
        place = fresh()
        _remove(place[0])
        shutil.move(place[1], place[0])
        yield f"{form}: a shard in the place of another", lambda resumed=resumed: refused(resumed)
        for name, other in others.items():
            place = fresh()
            _remove(place[0])
            (shutil.copytree if form == "png" else shutil.copy)(other / place[0].name, place[0])
            yield f"{form}: a shard of other {name}", lambda resumed=resumed: refused(resumed)
        for number in range(tries):
            place = fresh()[number % 3]
            inside = sorted(place.iterdir()) if place.is_dir() else [place]
            one = inside[number % len(inside)]
            if place.is_dir() and number % 5 == 4:
                one.unlink()
            else:
                one.write_bytes(damaged(one.read_bytes(), rng, number % 3 == 0))
            yield f"{form}: {place.name}/{one.name}", resumed


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink()
