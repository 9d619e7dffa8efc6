"""Commands that were typed carelessly: one line that names value, limit and remedy, at once."""

import pkgutil
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fringeforce as ff
from commands import Said, run
from fringeforce.io.frames import save_frames

HEAD = "frame,tactel,normal_N,tangential_N\n"
READINGS = (
    "frame,tactel,normal_N,tangential_N,magnitude_N,angle_deg,"
    "normal_std_N,tangential_std_N,magnitude_std_N,angle_std_deg,status\n"
)


def refused(*words: str, cwd: Path) -> Said:
    """What a command says that refuses its arguments in one line."""
    before = {path: path.is_dir() or path.read_bytes() for path in cwd.iterdir()}
    said = run(*words, cwd=cwd)
    assert said.returncode == 2
    assert said.stdout == ""
    assert said.stderr.startswith("fringeforce: ")
    assert said.stderr.endswith("\n")
    assert said.stderr.count("\n") == 1
    assert {path: path.is_dir() or path.read_bytes() for path in cwd.iterdir()} == before
    return said


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of files, in which whoever starts to solve or to fit fails."""

    def never(*_: Any, **__: Any) -> None:
        raise AssertionError("it was solved before its inputs were looked at")

    # a module that is first imported while a name is replaced would keep the replacement
    for module in pkgutil.walk_packages(ff.__path__, "fringeforce."):
        import_module(module.name)
    for place in (
        "models.characterization.characterize",
        "models.strip.characterize",
        "calibration.calibrate.calibrate",
        "calibration.drift.update",
        "studies.sweep.run_sweep",
    ):
        monkeypatch.setattr(f"fringeforce.{place}", never)
    sensor = ff.load_sensor("saad")
    frames = np.full((8, 2048), 5, np.uint8)
    save_frames(tmp_path / "frames.h5", frames, sensor.pixel_positions)
    np.save(tmp_path / "short.npy", frames[:, :100])
    np.save(tmp_path / "pad.npy", np.full((1, *ff.load_sensor("pad").frame_shape), 5, np.uint8))
    (tmp_path / "own.toml").write_text(sensor.to_toml(), encoding="utf-8")
    creeping = sensor.replace(**{"transducer.photoelastic.optical_creep": [["3 %", "2 s"]]})
    (tmp_path / "creeping.toml").write_text(creeping.to_toml(), encoding="utf-8")
    (tmp_path / "loads.csv").write_text(HEAD + "0,6,1,0.1\n", encoding="utf-8")
    (tmp_path / "readings.csv").write_text(
        READINGS + "0,6,1,0,1,0,0.1,0.1,0.1,0.1,OK\n", encoding="utf-8"
    )
    (tmp_path / "words.csv").write_text("hello\n", encoding="utf-8")
    (tmp_path / "folder").mkdir()
    return tmp_path


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("study weight saad", ["'weight'", "'width'", "Usage: fringeforce study"]),
        ("study", ["question", "width", "Usage: fringeforce study"]),
        ("simulate saad loads.csv -o f.h5 --seed x", ["--seed", "'x' must be a whole number"]),
        ("live saad --line-rate fast", ["--line-rate", "'fast' must be a number"]),
        ("read saad frames.h5", ["--output", "CSV of forces to write"]),
        ("read", ["'model'", "Model file", "{model} {frames}"]),
        ("read saad frames.h5 again.h5 -o r.csv", ["again.h5", "{model} {frames}"]),
        ("read --colour", ["--colour", "-h"]),
        ("reed", ["'reed'", "'read'"]),
        ("benchmark fly", ["'fly'", "benchmark"]),
    ],
)
def test_what_is_typed_wrongly_is_named_with_what_may_be(
    desk: Path, line: str, words: list[str]
) -> None:
    said = refused(*line.split(), cwd=desk).stderr
    assert all(word in said for word in words), said
    assert "Value error" not in said
    assert "Input should" not in said


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("simulate saad readings.csv -o f.h5", ["holds readings", "frame, tactel", "normal_N"]),
        ("simulate saad words.csv -o f.h5", ["holds no loads", "frame, tactel"]),
        ("simulate loads.csv saad -o f.h5", ["loads.csv is neither a model", "first argument"]),
        ("simulate saad loads.csv -o loads.csv", ["loads.csv", "end in .h5"]),
        ("simulate saad loads.csv -o f.h5 --seed -1", ["--seed -1", "0 or more"]),
        ("read saad none.h5 -o r.csv", ["no file none.h5"]),
        ("extract saad none -o f.h5", ["no file none", "folder of them"]),
        ("extract saad words.csv --preview p.xyz", ["p.xyz", "'.xyz'", ".png"]),
        ("explore saad --line-rate 5 --no-browser", ["--line-rate", "--camera"]),
        ("explore saad --region r.toml --no-browser", ["--region", "--camera"]),
        ("dataset none.toml -o words.csv", ["words.csv", "it is a file"]),
        ("dataset none.toml -o d --sheet s.xyz", ["s.xyz", "'.xyz'", ".png"]),
        ("new design.h5", ["design.h5", ".toml"]),
        ("study resolution skin", ["has a skin", "tactels"]),
        ("study resolution saad --workers 100000", ["workers = 100000", "128"]),
        ("update none.h5 frames.h5 -o u.h5 --light -1", ["light = -1", "0 or more"]),
        (
            "read saad frames.h5 -o r.csv --tolerance camera.shift=0+/-5mm",
            ["0 +/- 5 mm", "12.5 mm", "smaller"],
        ),
        ("read saad short.npy -o r.csv", ["8 lines of 100 pixels", "2048"]),
        ("read saad folder -o r.csv", ["folder", "extract --region"]),
        ("read saad frames.h5 -o none/r.csv", ["no folder none", "another path"]),
        ("read saad frames.h5 -o folder", ["it is a folder"]),
        ("read saad frames.h5 -o r.h5", ["r.h5", "end in .csv"]),
        ("read saad frames.h5 -o r.csv --region none.toml", ["No such file", "extract --region"]),
        ("read saad frames.h5 -o r.csv --tolerance camera.shift", ["has no '='"]),
        ("read saad frames.h5 -o r.csv --tolerance camera.shiift=1", ["did you mean 'shift'"]),
        ("read saad frames.h5 -o r.csv --fps 0", ["0 frames per second"]),
        ("read saad frames.h5 -o r.csv --temperature warm", ["'warm'", "degrees Celsius"]),
        ("read saad frames.h5 -o r.csv --friction -1", ["friction = -1", "greater than 0"]),
        ("read pad pad.npy -o r.csv --friction 1", ["friction is for strips"]),
        ("read saad frames.h5 -o r.csv --temperature 25", ["temperature_coefficient"]),
        ("read creeping.toml frames.h5 -o r.csv", ["frames.h5 says nothing of when", "--fps"]),
        ("live saad --friction nan", ["friction = nan", "greater than 0"]),
        ("characterize frames.h5 -o m.h5", ["frames.h5 is no design: it holds frames", "'saad'"]),
        ("characterize short.npy -o m.h5", ["short.npy is no design", "(.toml)"]),
        ("reproduce frames.h5 --out out", ["frames.h5 is no design", "(.toml)"]),
        ("study resolution frames.h5 --out out", ["frames.h5 is no design", "(.toml)"]),
        ("extract short.npy folder -o f.h5", ["short.npy is no design", "(.toml)"]),
        ("check saad frames.h5 loads.csv", ["saad is a design", "characterize saad -o model.h5"]),
        ("update own.toml frames.h5 -o m.h5", ["own.toml is a design", "a model is needed"]),
        ("creep saad frames.h5 loads.csv -o m.h5", ["saad is a design", "a model is needed"]),
        ("read frames.h5 frames.h5 -o r.csv", ["holds frames, and a model must"]),
        ("live saad --camera file:none.h5", ["no file none.h5"]),
        ("live saad --camera usb", ["no camera 'usb'", "webcam:NUMBER"]),
        ("live saad --to touch.csv", ["no place 'touch.csv'", "csv:PATH"]),
        ("live saad --to csv:none/r.csv", ["no folder none"]),
        ("live saad --record r.csv", ["r.csv", "end in .h5"]),
        ("live saad --for 0", ["--for 0", "more than 0"]),
        ("live saad --region none.toml", ["none.toml", "extract --region"]),
        ("explore saad --no-browser --camera file:none.h5", ["no file none.h5"]),
        ("explore saad --no-browser --port 99999", ["99999", "from 0 to 65535. Choose"]),
        ("calibrate saad --frames none.h5 --loads loads.csv -o m.h5", ["no file none.h5"]),
        ("calibrate saad --frames frames.h5 --loads none.csv -o m.h5", ["none.csv"]),
        ("calibrate saad --frames frames.h5 --loads readings.csv -o m.h5", ["holds readings"]),
        ("calibrate saad --frames frames.h5 --loads loads.csv -o no/m.h5", ["no folder no"]),
        ("calibrate saad --frames frames.h5 --loads loads.csv -o m.csv", ["end in .h5"]),
        (
            "calibrate saad --frames frames.h5 --loads loads.csv -o m.h5 --cell-zero 20",
            ["--cell-zero '20'", "unit"],
        ),
        ("calibrate saad --frames frames.h5 --loads loads.csv -o m.h5 --dark d.h5", ["d.h5"]),
        ("calibrate saad --frames frames.h5 --loads loads.csv -o frames.h5", ["be replaced"]),
        ("characterize saad -o none/m.h5", ["no folder none"]),
        ("characterize saad -o m.toml", ["m.toml", "end in .h5"]),
        ("characterize saad -o m.h5 --vtu none/f.vtu", ["no folder none"]),
        ("plan saad --presses 4 -o none/p.csv", ["no folder none"]),
        ("extract saad none.png -o f.h5", ["no file none.png"]),
        ("extract saad folder -o f.h5", ["folder holds no pictures"]),
        ("extract saad folder -o f.csv", ["end in .h5"]),
        ("study resolution saad --out loads.csv", ["it is a file"]),
        ("reproduce saad --out loads.csv", ["it is a file"]),
        ("sweep none.toml -o r.h5", ["none.toml", "No such file"]),
        ("sweep none.toml -o r.csv", ["end in .h5"]),
    ],
)
def test_inputs_and_outputs_are_looked_at_before_anything_is_solved(
    desk: Path, line: str, words: list[str]
) -> None:
    said = refused(*line.split(), cwd=desk).stderr
    assert all(word in said for word in words), said
    assert "Errno" not in said


def test_update_looks_at_its_frames_before_it_fits(model: ff.SensorModel, desk: Path) -> None:
    model.save(desk / "model.h5")
    for line, word in {
        "update model.h5 none.h5 -o later.h5": "no file none.h5",
        "update model.h5 frames.h5 -o none/later.h5": "no folder none",
        "update frames.h5 model.h5 -o later.h5": "frames.h5 holds frames",
        "check model.h5 none.h5 loads.csv": "no file none.h5",
        "check model.h5 frames.h5 loads.csv": "1 of 8 frames have a load that is not zero; at "
        "least 4 are needed. Press in 3 more",
        "characterize model.h5 -o later.h5": "model.h5 is no design: it holds a model; give",
        "creep model.h5 none.h5 loads.csv -o later.h5": "no file none.h5",
    }.items():
        assert word in refused(*line.split(), cwd=desk).stderr


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("benchmark make b --track drawn --track drawn", ["drawn, drawn", "once"]),
        ("benchmark make b --seed -1", ["seed = -1", "0 or more"]),
    ],
)
def test_a_benchmark_is_refused_before_a_folder_is_made(
    line: str, words: list[str], tmp_path: Path
) -> None:
    said = refused(*line.split(), cwd=tmp_path).stderr
    assert all(word in said for word in words)
