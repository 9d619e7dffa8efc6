"""The command line: files in, files out, one line when the input is bad."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest
from typer.main import get_group

import fringeforce as ff
from commands import run, started
from fringeforce.calibration.bench_loads import BenchLoads, in_words
from fringeforce.cli import app
from fringeforce.design.shipped import shipped_designs, shipped_pads
from fringeforce.io.bench_loads import load_bench_loads
from fringeforce.io.frames import load_frames
from fringeforce.io.tables import load_forces, save_forces

pytestmark = pytest.mark.slow

COMMANDS = sorted(get_group(app).commands)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("place")
    assert run("new", "s.toml", cwd=folder).returncode == 0
    assert started("characterize", "s.toml", "-o", "m.h5", cwd=folder).returncode == 0
    np.save(folder / "lines.npy", np.zeros((3, 2048), np.uint8))
    return folder


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command: str, tmp_path: Path) -> None:
    result = run(command, "-h", cwd=tmp_path)
    assert result.returncode == 0
    assert "Usage" in result.stdout


@pytest.mark.parametrize("command", [*COMMANDS, "benchmark make", "benchmark score"])
def test_help_speaks_of_no_types_of_python_and_fits_a_terminal(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    said = run(*command.split(), "-h", cwd=tmp_path).stdout
    assert not re.search(r"<(str|int|float|path|list\[.*)>", said)
    assert max(map(len, said.splitlines())) <= 80
    assert said.isascii()
    assert not re.search(r"\w-\n", said)  # names are there to be copied


def test_help_names_every_shipped_design(tmp_path: Path) -> None:
    said = run("new", "-h", cwd=tmp_path).stdout.replace(",", " ").replace(".", " ").split()
    assert {*shipped_designs(), *shipped_pads()} <= set(said)


def test_the_list_of_commands_says_each_line_to_its_end(tmp_path: Path) -> None:
    listed = run("-h", cwd=tmp_path).stdout.partition("Commands:")[2]
    assert all(f"\n  {command} " in listed for command in COMMANDS)
    assert "..." not in listed


def test_a_new_design_is_the_shipped_one_with_its_comments(place: Path) -> None:
    assert ff.load_sensor(place / "s.toml") == ff.load_sensor("saad")
    assert "# nu_1" in (place / "s.toml").read_text()


def test_a_new_design_overwrites_nothing_by_accident(place: Path) -> None:
    before = (place / "s.toml").read_text()
    assert run("new", "s.toml", "--like", "thin-cover", cwd=place).returncode == 2
    assert (place / "s.toml").read_text() == before


def test_a_new_design_may_be_that_of_a_pad(tmp_path: Path) -> None:
    assert run("new", "p.toml", "--like", "fingertip", cwd=tmp_path).returncode == 0
    assert ff.load_sensor(tmp_path / "p.toml") == ff.load_sensor("fingertip")


def test_simulated_frames_are_those_of_the_library(place: Path) -> None:
    (place / "f.csv").write_text("tactel,magnitude_N,angle_deg\n6,1,10\n")
    result = run("simulate", "m.h5", "f.csv", "-o", "f.h5", "--seed", "3", cwd=place)
    assert result.returncode == 0, result.stderr
    model = ff.load_model(place / "m.h5")
    forces = np.zeros((1, 11, 2))
    forces[0, 5] = ff.polar(1.0, 10, n=1)[0]
    np.testing.assert_array_equal(load_frames(place / "f.h5"), model.expose(forces, rng=3))


def test_a_broken_frame_among_good_ones_costs_its_own_row_only(place: Path) -> None:
    model = ff.load_model(place / "m.h5")
    forces = ff.polar(1.0, 10, n=11)
    frames = np.stack([model.expose(forces, rng=i) for i in range(3)]).astype(float)
    frames[1, 77] = np.nan
    np.save(place / "frames.npy", frames)
    result = run("read", "m.h5", "frames.npy", "-o", "r.csv", "--plot", cwd=place)
    assert result.returncode == 0, result.stderr
    assert "r.csv: 3 frames, " in result.stdout
    assert "2 OK" in result.stdout
    assert "1 BAD_FRAME" in result.stdout
    with open(place / "r.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 33
    assert {row["status"] for row in rows if row["frame"] == "1"} == {"BAD_FRAME"}
    for row in rows:
        if row["frame"] != "1":
            off = float(row["normal_N"]) - forces[0, 0]
            assert abs(off) < 5 * float(row["normal_std_N"])
    assert (place / "r.png").stat().st_size > 5000


def test_read_says_once_what_seems_wrong_with_the_sensor(place: Path) -> None:
    design = ff.load_model(place / "m.h5").sensor
    dimmer = ff.characterize(design.replace(**{"camera.amplitude": 0.95 * design.camera.amplitude}))
    frames = [dimmer.expose(ff.polar(1.0, 10, n=11), rng=i) for i in range(2)]
    np.save(place / "dim.npy", np.stack(frames))
    result = run("read", "m.h5", "dim.npy", "-o", "dim.csv", "--plot", cwd=place)
    assert result.returncode == 1, result.stderr
    assert result.stdout.count("light seems 5 % dimmer") == 1
    assert "None of the frames can be used." in result.stdout
    assert not (place / "dim.png").exists()


def test_a_picture_is_not_read_as_so_many_broken_frames(place: Path) -> None:
    np.save(place / "picture.npy", np.zeros((300, 640), dtype=np.uint8))
    result = run("read", "m.h5", "picture.npy", "-o", "p.csv", cwd=place)
    assert result.returncode == 2
    assert "300 x 640 looks like a picture" in result.stderr
    assert "2048" in result.stderr
    assert not (place / "p.csv").exists()


@pytest.mark.parametrize("target", ["m.h5", "s.toml", "saad"])
def test_show_tells_what_a_designer_asks(place: Path, target: str) -> None:
    result = run("show", target, cwd=place)
    assert result.returncode == 0, result.stderr
    influence = ff.load_model(place / "m.h5").pixel_influence.reshape(-1, 22)
    condition = f"{np.linalg.cond(influence):.4g}"
    told = " ".join(result.stdout.split())  # a terminal's lines are wrapped
    # K_t by equation (2) of Saad et al., 0.006409 rad/(Pa m)
    plane = 'plane stress is 13 % off at a width of 2 mm, which is poor; take plane = "3d"'
    for words in (
        "K_t",
        "6.409 rad/(MPa mm)",
        "condition number",
        condition,
        "good, below the limit of 1000",
        "good, above the limit of 0.024 rad (noise of a pixel)",
        "standard deviation of a force, one frame",
        "good, below the limit of 0.5 (Nyquist)",
        "what linear theory misses",
        "bad, above the limit of 1 %, reached at 0.279 N",
        plane,
    ):
        assert words in told


def test_show_wraps_its_values_beside_their_names(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "72")
    name, *lines = run("show", "m.h5", cwd=place).stdout.splitlines()
    assert name == "Saad et al., two-layer photoelastic beam"
    start = lines[0].index("25 mm x 2 mm")
    assert max(map(len, lines)) <= 72
    assert {line[start - 2 : start] for line in lines} == {"  "}
    assert "bad, above the limit of 1 %" in " ".join(line[start:] for line in lines)


@pytest.mark.parametrize(
    "arguments",
    [
        ["show", "nope"],
        ["show", "nope.h5"],
        ["characterize", "saad", "-o", "no-such-folder/m.h5"],
        ["characterize", "saad", "-o", "m2.h5", "--mesh", "fine"],
        ["simulate", "m.h5", "nope.csv", "-o", "f.h5"],
        ["simulate", "s.toml", "s.toml", "-o", "f.h5"],
        ["read", "m.h5", "nope.npy", "-o", "r.csv"],
        ["read", "m.h5", "s.toml", "-o", "r.csv"],
        ["new", "no-such-folder/s.toml"],
        ["explore", "nope", "--no-browser"],
        ["explore", "saad", "--no-browser", "--bind", "203.0.113.1"],
        ["reproduce", "saad", "--out", "m.h5"],
        ["study", "resolution", "nope"],
        ["study", "resolution", "s.toml", "--out", "m.h5"],
        ["study", "resolution", "s.toml", "--load", "0"],
        ["study", "resolution", "s.toml", "--seed", "-1"],
        ["study", "range", "s.toml", "--workers", "-1"],
        ["sweep", "nope.toml", "-o", "r.h5"],
        ["sweep", "s.toml", "-o", "r.h5"],
        ["reproduce", "skin", "--out", "rep"],
        ["extract", "saad", "lines.npy", "-o", "f.h5"],
    ],
    ids=" ".join,
)
def test_bad_input_ends_with_status_2_and_no_traceback(place: Path, arguments: list[str]) -> None:
    before = {path: path.read_bytes() for path in place.iterdir()}
    result = run(*arguments, cwd=place)
    assert result.returncode == 2
    assert "Traceback" not in result.stderr
    assert result.stderr.startswith("fringeforce: ")
    assert len(result.stderr.strip().splitlines()) == 1
    assert {path: path.read_bytes() for path in place.iterdir()} == before


def test_the_program_in_a_process_of_its_own_says_and_ends_the_same(tmp_path: Path) -> None:
    for words in (["show", "nope"], ["materials"], ["read", "nope.h5", "f.npy", "-o", "r.csv"]):
        assert started(*words, cwd=tmp_path) == run(*words, cwd=tmp_path)


def test_a_calibrated_file_passes_the_check_that_the_drawing_fails(place: Path) -> None:
    rng = np.random.default_rng(2)
    coefficient = "transducer.photoelastic.strain_optic_coefficient"
    true = ff.characterize(ff.load_sensor("saad").replace(**{coefficient: 0.053}))
    forces = rng.uniform(0, 0.7, (10, 11, 2)) * [1.0, 0.2]
    save_forces(place / "loads.csv", forces)
    np.save(place / "bench.npy", true.expose(forces, rng=rng))
    np.save(place / "unseen.npy", true.expose(forces, rng=rng))
    np.save(place / "idle.npy", true.expose(np.zeros((4, 11, 2)), rng=rng))
    options = ["--frames", "bench.npy", "--loads", "loads.csv", "-o", "c.h5"]
    options += ["--unloaded", "idle.npy"]
    result = run("calibrate", "s.toml", *options, "--parameter", coefficient, cwd=place)
    assert result.returncode == 0, result.stderr
    assert "0.05 -> 0.05" in result.stdout
    assert "Readings are expected to err" in result.stdout
    assert ff.load_model(
        place / "c.h5"
    ).sensor.transducer.photoelastic.strain_optic_coefficient == (pytest.approx(0.053, rel=2e-3))
    passed = run("check", "c.h5", "unseen.npy", "loads.csv", cwd=place)
    assert (passed.returncode, passed.stdout.split()[-1]) == (0, "passed"), passed.stdout
    failed = run("check", "m.h5", "unseen.npy", "loads.csv", cwd=place)
    assert (failed.returncode, failed.stdout.split()[-1]) == (1, "failed"), failed.stderr


def test_planned_presses_are_loads_within_the_limits(tmp_path: Path) -> None:
    small = ff.load_sensor("saad").replace(**{"camera.pixels": 256})
    (tmp_path / "s.toml").write_text(small.to_toml())
    parameter = "transducer.photoelastic.strain_optic_coefficient"
    options = ["--largest", "1500 mN", "--friction", "0.5", "--parameter", parameter]
    result = run("plan", "s.toml", "--presses", "3", "-o", "p.csv", *options, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert parameter in result.stdout
    normal, tangential = np.moveaxis(load_forces(tmp_path / "p.csv", 11), 2, 0)
    assert normal.shape == (3, 11)
    assert np.hypot(normal, tangential).max() <= 1.5 * (1 + 1e-6)
    assert (np.abs(tangential) <= 0.5 * normal + 1e-9).all()


@pytest.mark.slow
def test_loads_by_place_are_simulated_as_wide_as_they_are(tmp_path: Path) -> None:
    model = ff.characterize(ff.load_sensor("skin").replace(**{"camera.pixels": 256}))
    model.save(tmp_path / "m.h5")
    table = "frame;x_mm;normal_N;tangential_N;width_mm\n0;-1,5;2,0;0,3;0,4\n2;3,0;1,2;0;\n"
    (tmp_path / "l.csv").write_text(table)
    result = run("simulate", "m.h5", "l.csv", "-o", "f.h5", "--seed", "3", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    wide = ff.Press(x=-1.5e-3, normal=2.0, tangential=0.3, width=0.4e-3)
    frames = model.expose([[wide], [], [ff.Press(x=3e-3, normal=1.2)]], rng=3)
    np.testing.assert_array_equal(load_frames(tmp_path / "f.h5"), frames)
    (tmp_path / "t.csv").write_text("time_s,x_mm,normal_N\n0,1,1\n1,1,2\n")
    result = run("simulate", "m.h5", "t.csv", "-o", "f.h5", cwd=tmp_path)
    assert result.returncode == 2
    assert "no frames" in result.stderr


@pytest.mark.slow
@pytest.mark.parametrize("plane", ["stress", "3d"])
def test_a_skin_is_planned_by_place_and_in_words(tmp_path: Path, plane: str) -> None:
    skin = ff.load_sensor("skin").replace(**{"camera.pixels": 256, "transducer.plane": plane})
    (tmp_path / "s.toml").write_text(skin.to_toml())
    parameter = "transducer.photoelastic.strain_optic_coefficient"
    options = ["--largest", "2 N", "--friction", "0.5", "--parameter", parameter]
    result = run("plan", "s.toml", "--presses", "4", "-o", "p.csv", *options, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "tactel" not in (tmp_path / "p.csv").read_text()
    loads = load_bench_loads(tmp_path / "p.csv", skin, 4)
    assert isinstance(loads, BenchLoads)
    half, pressed = skin.skin.extent / 2 if skin.skin else 0.0, loads.present[:, 0]
    assert pressed.any()
    assert np.abs(loads.places[pressed]).max() < half
    assert loads.magnitude.max() <= 2 * (1 + 1e-9)
    words = (tmp_path / "p.txt").read_text().splitlines()
    assert words == [f"frame {k}: {said}" for k, said in enumerate(in_words(loads))]
    assert " N down" in words[int(pressed.argmax())]


def test_a_solid_strip_is_refused_by_the_explorer_in_one_message(place: Path) -> None:
    drawn = ff.load_sensor("saad").replace(**{"transducer.plane": "3d"})
    (place / "solid.toml").write_text(drawn.to_toml(), encoding="utf-8")
    result = run("explore", "solid.toml", "--no-browser", cwd=place)
    assert result.returncode == 2
    assert result.stderr.count('take "stress" or "strain"') == 1
    assert "Traceback" not in result.stderr


def test_a_unit_in_the_wrong_case_gets_a_hint(place: Path) -> None:
    text = ff.load_sensor("saad").to_toml()
    assert '"11 MPa"' in text
    (place / "case.toml").write_text(text.replace('"11 MPa"', '"11 MPA"'), encoding="utf-8")
    result = run("show", "case.toml", cwd=place)
    assert result.returncode == 2
    assert "(did you mean MPa?)" in result.stderr
