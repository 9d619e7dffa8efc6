"""Loads of a bench in files, as people write them."""

import doctest
import math
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis.strategies import binary, lists, sampled_from

import fringeforce as ff
from fringeforce.calibration.bench_loads import BenchLoads, bench_loads, in_words
from fringeforce.calibration.load_log import LoadLog, load_log
from fringeforce.io.bench_loads import load_bench_loads, load_frame_times, save_bench_loads
from fringeforce.io.frames import save_frames


@pytest.fixture(scope="module")
def skin() -> ff.Sensor:
    return ff.load_sensor("skin")


@pytest.fixture(scope="module")
def strip() -> ff.Sensor:
    return ff.load_sensor("saad")


@pytest.fixture(scope="module")
def pad():
    return ff.load_sensor("pad-skin")


def of(path: Path, text: str | bytes, sensor, frames: int | None = None):
    file = path / "loads.csv"
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    return load_bench_loads(file, sensor, frames)


def table(path: Path, text: str | bytes, sensor, frames: int | None = None) -> BenchLoads:
    found = of(path, text, sensor, frames)
    assert isinstance(found, BenchLoads)
    return found


PLAIN = "frame,x_mm,normal_N,tangential_N\n0,3.25,2.5,-1.25\n"
WRITTEN = {
    "commas": PLAIN,
    "semicolons": PLAIN.replace(",", ";"),
    "semicolons and decimal commas": PLAIN.replace(",", ";").replace(".", ","),
    "tabs and decimal commas": PLAIN.replace(",", "\t").replace(".", ","),
    "quoted decimal commas": 'frame,x_mm,normal_N,tangential_N\n0,"3,25","2,5","-1,25"\n',
    "blanks": PLAIN.replace(",", "   "),
    "byte order mark": b"\xef\xbb\xbf" + PLAIN.encode(),
    "utf-16": PLAIN.encode("utf-16"),
    "ends of lines of another system": PLAIN.replace("\n", "\r\n"),
    "empty lines and remarks": "# of Monday\n\n" + PLAIN + "\n# the end\n",
    "header as numpy writes it": "# " + PLAIN,
    "brackets for units": "Frame;X [mm];Normal force [N];Shear (N)\n0;3.25;2.5;-1.25\n",
    "micrometres of an old spreadsheet": "frame;x_µm;Fn_N;Ft_mN\n0;3250;2,5;-1250\n".encode(
        "cp1252"
    ),
    "metres": "frame,x_m,normal_N,tangential_N\n0,3.25e-3,2.5,-1.25\n",
    "the force on the sensor": "frame,x_mm,fz_N,fx_N\n0,3.25,-2.5,-1.25\n",
    "what acts on the indenter": "frame,x_mm,reaction_fz_N,reaction_fx_N\n0,3.25,2.5,1.25\n",
    "no frame at all": "x_mm,normal_N,tangential_N\n3.25,2.5,-1.25\n",
    "size and angle": f"x_mm,magnitude_N,angle_deg\n3.25,{math.hypot(2.5, 1.25)!r},"
    f"{math.degrees(math.atan2(-1.25, 2.5))!r}\n",
    "other columns": "frame,x_mm,normal_N,tangential_N,operator\n0,3.25,2.5,-1.25,Ada\n",
    "a table that read wrote": "frame,contact,x_mm,normal_N,tangential_N,status\n"
    "0,0,3.0,9,9,OK\n0,1,3.25,2.5,-1.25,OK\n",
}


@pytest.mark.parametrize("text", WRITTEN.values(), ids=list(WRITTEN))
def test_one_load_is_the_same_however_it_is_written(
    tmp_path: Path, skin: ff.Sensor, text: str | bytes
) -> None:
    loads = table(tmp_path, text, skin)
    np.testing.assert_allclose(loads.places, [[3.25e-3]], rtol=1e-12)
    np.testing.assert_allclose(loads.forces, [[[2.5, -1.25]]], rtol=1e-12)
    assert loads.tactels is None
    assert np.isnan(loads.widths).all()


def test_what_is_stated_beside_place_and_force_is_kept(tmp_path: Path, skin: ff.Sensor) -> None:
    text = (
        "frame;x_mm;normal_N;width_mm;diameter_mm;x_std_mm;force_std_N;width_std_mm\n"
        "1;3;2;0,4;;0,1;0,02;0,05\n1;-2;1;;5;;;\n4;0;1;;;;;\n"
    )
    loads = table(tmp_path, text, skin, 6)
    assert loads.present.sum(axis=1).tolist() == [0, 2, 0, 0, 1, 0]
    nan = np.nan
    np.testing.assert_allclose(loads.places[1], [3e-3, -2e-3])
    np.testing.assert_allclose(loads.forces[1], [[2, 0], [1, 0]])
    np.testing.assert_allclose(loads.widths[1], [0.4e-3, nan])
    np.testing.assert_allclose(loads.radii[1], [nan, 2.5e-3])
    np.testing.assert_allclose(loads.place_std[1], [0.1e-3, nan])
    np.testing.assert_allclose(loads.force_std[1], [[0.02, 0.02], [nan, nan]])
    np.testing.assert_allclose(loads.width_std[1], [0.05e-3, nan])


def test_tactels_have_their_numbers_and_their_places(tmp_path: Path, strip: ff.Sensor) -> None:
    text = "frame,tactel,normal_N,tangential_N\n0,1,2,0.5\n2,11,1,0\n2,3,1,-1\n"
    loads = table(tmp_path, text, strip)
    assert loads.tactels is not None
    assert loads.tactels.tolist() == [[0, -1], [-1, -1], [10, 2]]
    np.testing.assert_allclose(loads.places[2], [5e-3, -3e-3])
    dense = np.zeros((3, 11, 2))
    dense[0, 0], dense[2, 10], dense[2, 2] = (2, 0.5), (1, 0), (1, -1)
    np.testing.assert_array_equal(loads.on_tactels(11), dense)


def test_pads_have_two_axes(tmp_path: Path, pad) -> None:
    text = "frame,x_mm,y_mm,normal_N,tangential_x_N,tangential_y_N\n1,3,-2,4,1,-0.5\n"
    loads = table(tmp_path, text, pad)
    np.testing.assert_allclose(loads.places[1, 0], [3e-3, -2e-3])
    np.testing.assert_allclose(loads.forces[1, 0], [4, 1, -0.5])
    press = "press at x 3.0 mm, y -2.0 mm, 4 N down, 1 N towards +x, 0.5 N towards -y"
    assert in_words(loads) == ["no load", press]
    save_bench_loads(tmp_path / "again.csv", loads)
    again = load_bench_loads(tmp_path / "again.csv", pad)
    assert isinstance(again, BenchLoads)
    same(again, loads)


def same(one: BenchLoads, other: BenchLoads) -> None:
    for name in ("places", "forces", "place_std", "force_std", "widths", "radii", "width_std"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-11)


def test_loads_come_back_from_a_file(tmp_path: Path, strip: ff.Sensor) -> None:
    rng = np.random.default_rng(0)
    frames = [0, 0, 2, 3, 3, 3]
    loads = bench_loads(
        rng.uniform(-5e-3, 5e-3, 6),
        rng.uniform(0.5, 2, (6, 2)),
        frames,
        count=7,
        place_std=[1e-4, np.nan] * 3,
        force_std=0.01,
        widths=[np.nan, 4e-4] * 3,
        radii=[5e-3, np.nan] * 3,
        width_std=1e-4,
        tactels=[-1, 3, 2, -1, 0, 4],
    )
    save_bench_loads(tmp_path / "l.csv", loads)
    again = load_bench_loads(tmp_path / "l.csv", strip)
    assert isinstance(again, BenchLoads)
    assert again.tactels is not None
    assert loads.tactels is not None
    same(again, loads)
    np.testing.assert_array_equal(again.tactels, loads.tactels)


def test_frames_files_tell_the_forces_behind_them(tmp_path: Path, strip: ff.Sensor) -> None:
    forces = np.zeros((2, 11, 2))
    forces[1, 4] = 1.5, -0.5
    path = tmp_path / "f.h5"
    save_frames(path, np.zeros((2, 2048), np.uint8), strip.pixel_positions, forces)
    loads = load_bench_loads(path, strip)
    assert isinstance(loads, BenchLoads)
    np.testing.assert_array_equal(loads.on_tactels(11), forces)


@pytest.mark.parametrize("group", ["/", "loads"])
def test_hdf5_files_have_a_dataset_for_each_column(
    tmp_path: Path, skin: ff.Sensor, group: str
) -> None:
    with h5py.File(tmp_path / "l.h5", "w") as file:
        place = file.require_group(group)
        place["frame"] = [0, 2]
        place["x"] = [1.0, -2.0]
        place["x"].attrs["units"] = "mm"
        place["normal_N"] = [1.0, 2.0]
    loads = load_bench_loads(tmp_path / "l.h5", skin)
    assert isinstance(loads, BenchLoads)
    np.testing.assert_allclose(loads.places[[0, 2], 0], [1e-3, -2e-3])
    np.testing.assert_allclose(loads.forces[[0, 2], 0], [[1, 0], [2, 0]])


WRONG = {
    "frame,x_mm,normal_N\n0,13,1\n": ["line 2", "x = 13 mm", "12.5 mm"],
    "frame,x,normal_N\n0,13,1\n": ["column x", "no unit", "x_mm"],
    "frame,x_mm,normal_N,widht_mm\n0,1,1,1\n": ["widht_mm", "width_mm"],
    "frame,x_mm,tangential_N\n0,1,1\n": ["normal_N", "tactel"],
    "frame,normal_N\n0,1\n": ["x_mm", "tactel"],
    "frame,x_mm,normal_N\n0,,1\n": ["line 2", "no place", "x_mm"],
    "frame,x_mm,normal_N\n0,1,\n": ["line 2", "normal_N is empty"],
    "frame,x_mm,normal_N\n0,1,one\n": ["line 2", "'one'", "not a number"],
    "frame,x_mm,normal_N\n0,1,inf\n": ["line 2", "finite"],
    "frame;x_mm;normal_N\n0;1.234,5;1\n": ["line 2", "two decimal signs"],
    "frame,x_mm,normal_N\n0,1,5,1,2\n": ["line 2", "5 cells for 3 columns", "semicolons"],
    "frame,x_mm,normal_N\n0.5,1,1\n": ["line 2", "frame 0.5", "whole numbers"],
    "frame,x_mm,normal_N\n-1,1,1\n": ["line 2", "frame -1"],
    "frame,x_mm,normal_N\n9,1,1\n": ["line 2", "frame 9", "0 to 3"],
    "frame,x_mm,fz_N\n0,1,2\n": ["line 2", "fz_N", "pulls", "reaction_fz_N"],
    "frame,x_mm,normal_N,fz_N\n0,1,2,-2\n": ["normal_N and fz_N", "the same"],
    "frame,x_mm,normal_N,ft_N,fx_N\n0,1,2,1,1\n": ["ft_N and fx_N", "the same"],
    "frame,x_mm,normal_N,fy_N\n0,1,2,1\n": ["fy_N", "along x alone"],
    "frame,x_mm,normal_N,width_mm\n0,1,2,0\n": ["line 2", "width_mm", "greater than 0"],
    "frame,x_mm,normal_N,x_std_mm\n0,1,2,-1\n": ["line 2", "x_std_mm", "0 or more"],
    "frame,x_mm,normal_N,width_mm,radius_mm\n0,1,2,1,5\n": ["line 2", "both", "radius"],
    "frame,contact,x_mm,normal_N\n0,1.5,1,2\n": ["line 2", "contact 1.5"],
    "frame,x_mm,normal_N\n": ["no loads"],
    "time,x_mm,normal_N\n0.5,1,2\n": ["line 2", "'0.5'", "time_s"],
    "time_s,x_mm,normal_N\n1,1,2\n": ["two or more"],
    "time_s,x_mm,normal_N\n1,1,0\n2,,0\n": ["nothing presses"],
    "time_s,contact,x_mm,normal_N\n1,1,1,1\n2,2,,1\n": ["line 3", "no place"],
    "time_s,x_mm,normal_N\n1,1,2\n1,2,2\n2,2,2\n": ["two loads at 1 s", "contact"],
    "time_s,x_mm,normal_N\n1,1,2\n,2,2\n2,2,2\n": ["line 3", "no time"],
}


@pytest.mark.parametrize(("text", "words"), WRONG.items())
def test_what_is_wrong_is_named(
    tmp_path: Path, skin: ff.Sensor, text: str, words: list[str]
) -> None:
    with pytest.raises(ff.FringeforceError) as caught:
        of(tmp_path, text, skin, 4)
    assert [word for word in words if word not in str(caught.value)] == [], str(caught.value)


@given(
    lists(
        sampled_from(["x_mm", "normal_N", "frame", "time_s", "tactel", "1", "-2", "0.5", "nan"])
        | sampled_from([",", ";", "\t", " ", "\n", '"', "#", ".", "e9", "\0", "ü", "="]),
        max_size=40,
    ).map("".join)
    | binary(max_size=60)
)
@example(b"\xff\xfe\x00")
@example("frame,x_mm,normal_N\n1e18,1,1\n")
@example("frame,x_mm,normal_N\n1e300,1,1\n")
@example("time_s,contact,x_mm,normal_N\n0,1e9,1,1\n1,1e9,,1\n")
@example("time_s,x_mm,normal_N\n0,,0\n1,,0\n")
@example("frame;frame;normal_N\n1;1;1\n")
def test_no_text_ends_in_anything_but_loads_or_a_reason(
    tmp_path_factory: pytest.TempPathFactory, content: str | bytes
) -> None:
    path = tmp_path_factory.mktemp("any")
    with suppress(ff.FringeforceError):
        found = of(path, content, ff.load_sensor("skin"))
        assert np.isfinite(found.places[np.isfinite(found.forces).all(axis=-1)]).all()


def test_a_file_that_is_missing_or_of_another_kind_is_refused(
    tmp_path: Path, skin: ff.Sensor
) -> None:
    for name in ("none.csv", "none.h5"):
        with pytest.raises(ff.FringeforceError, match=name):
            load_bench_loads(tmp_path / name, skin)
    save_frames(tmp_path / "f.h5", np.zeros((2, 2048), np.uint8), skin.pixel_positions)
    with pytest.raises(ff.FringeforceError, match="without"):
        load_bench_loads(tmp_path / "f.h5", skin)


def test_loads_say_in_words_what_to_press() -> None:
    loads = bench_loads(
        [3e-3, -1.5e-3, 0, 1e-3], [(2.7, -1.3), (0.5, 0), (1, 0.25), (0, 1)], [0, 1, 1, 3], 5
    )
    assert in_words(loads) == [
        "press at 3.0 mm, 2.7 N down, 1.3 N left",
        "press at -1.5 mm, 0.5 N down; press at 0.0 mm, 1 N down, 0.25 N right",
        "no load",
        "push at 1.0 mm, 1 N right",
        "no load",
    ]
    (said,) = in_words(bench_loads([-3e-3], [(2, 0)], tactels=[2]))
    assert said == "press on tactel 3 at -3.0 mm, 2 N down"


def test_presses_of_loads_make_the_same_light_as_their_tactels(strip: ff.Sensor) -> None:
    model = ff.characterize(strip.replace(**{"camera.pixels": 256}))
    forces = np.zeros((2, 11, 2))
    forces[0, 3], forces[0, 7], forces[1, 5] = (1.5, -0.5), (0.5, 0), (1, 0.2)
    places = strip.tactels.positions
    loads = bench_loads(places[[3, 7, 5]], [(1.5, -0.5), (0.5, 0), (1, 0.2)], [0, 0, 1])
    found = model.phase(forces)
    pressed = np.array([model.phase(presses) for presses in loads.presses()])
    assert np.abs(pressed - found).max() < 1e-2 * np.abs(found).max()
    with pytest.raises(ff.FringeforceError, match="Frame 1: a contact with 0 N"):
        bench_loads([0, 0], [(1, 0), (0, 1)]).presses()


def test_a_log_is_linear_between_its_moments(tmp_path: Path, skin: ff.Sensor) -> None:
    text = "time_ms;x_mm;fz_N;fx_N\n1000;;0;0\n1100;2,0;-1,0;0,1\n1200;3,0;-2,0;0,3\n1300;;0;0\n"
    log = of(tmp_path, text, skin)
    assert isinstance(log, LoadLog)
    found = log.at([0.75, 0.8, 1.6], delay=0.4)
    np.testing.assert_allclose(found.places[:2, 0], [2.5e-3, 3e-3])
    np.testing.assert_allclose(found.forces[:, 0], [[1.5, 0.2], [2, 0.3], [0, 0]], atol=1e-12)
    with pytest.raises(
        ff.FringeforceError, match=r"2\.3 s beyond the log, which goes from 1 to 1\.3"
    ):
        log.at([0.75, 3.6], delay=0.0)


def test_dates_are_times(tmp_path: Path, skin: ff.Sensor) -> None:
    text = "timestamp,x_mm,normal_N\n"
    text += "2026-05-01T12:00:00+00:00,1,1\n2026-05-01T12:00:00.5+00:00,1,2\n"
    log = of(tmp_path, text, skin)
    assert isinstance(log, LoadLog)
    np.testing.assert_allclose(log.times, 1777636800 + np.array([0, 0.5]), atol=1e-6, rtol=0)


def test_several_contacts_of_a_log_have_times_of_their_own() -> None:
    log = load_log(
        [0, 1, 2, 0.5, 1.5], [0, 1, 2, 5, 6], np.outer([1, 2, 3, 4, 6], [1, 0]), [0, 0, 0, 1, 1]
    )
    found = log.at([0.25, 1.0, 1.75], delay=0)
    np.testing.assert_allclose(found.forces[..., 0], [[1.25, np.nan], [2, 5], [2.75, np.nan]])
    np.testing.assert_allclose(found.places, [[0.25, np.nan], [1, 5.5], [1.75, np.nan]])


def test_frames_that_were_not_recorded_need_a_rate(tmp_path: Path, strip: ff.Sensor) -> None:
    path = tmp_path / "f.h5"
    save_frames(path, np.zeros((3, 2048), np.uint8), strip.pixel_positions)
    with pytest.raises(ff.FringeforceError, match="--fps"):
        load_frame_times(path, 3)
    with pytest.raises(ff.FringeforceError, match="above 0"):
        load_frame_times(path, 3, 0.0)
    np.testing.assert_allclose(load_frame_times(path, 3, 25.0), [0, 0.04, 0.08])


@pytest.mark.parametrize("thing", [BenchLoads, LoadLog, load_bench_loads, save_bench_loads])
def test_their_examples_hold(thing, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (found, *_) = doctest.DocTestFinder().find(thing, globs={"ff": ff, "np": np})
    assert found.examples
    said: list[str] = []
    assert doctest.DocTestRunner().run(found, out=said.append).failed == 0, "".join(said)
