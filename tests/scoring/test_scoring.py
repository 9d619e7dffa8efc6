"""The public benchmark: what is made, and scores of answers whose errors are known."""

import csv
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import fringeforce as ff
from fringeforce.cli import app
from fringeforce.mechanics import fourier
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant
from fringeforce.scoring.making import make_benchmark
from fringeforce.scoring.scores import score
from fringeforce.scoring.tracks import TRACKS, Scene

COUNT = 40


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("benchmark") / "frames"
    make_benchmark(folder, COUNT, tracks=("drawn", "touch"))
    return folder


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def _forces(path: Path) -> np.ndarray:
    rows = _rows(path)
    return np.array([[float(r["normal_N"]), float(r["tangential_N"])] for r in rows])


def _answer(path: Path, rows: list[dict[str, str]]) -> None:
    path.parent.mkdir(exist_ok=True)
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def test_frames_are_those_of_the_exact_series(made: Path) -> None:
    sensor = ff.load_sensor(made / "drawn" / "design.toml")
    strip, x = sensor.transducer, sensor.pixel_positions
    frames = np.load(made / "drawn" / "public.npy")
    forces = _forces(made / "drawn" / "public.csv").reshape(COUNT, -1, 2)
    nodes, weights = np.polynomial.legendre.leggauss(24)
    centres = sensor.tactels.positions[:, None] + sensor.tactels.contact_width / 2 * nodes
    lines = fourier.integrated_stress(strip, centres.ravel(), x, 600)
    psi = lines.reshape(len(x), *centres.shape, 2).transpose(0, 1, 3, 2) @ (weights / 2)
    constant = stress_optic_constant(strip.photoelastic, sensor.polariscope.wavelength)
    phase = np.einsum("mnt,fnt->fm", phase_lead(psi, constant), forces)
    camera = sensor.camera
    light = camera.offset + camera.amplitude * np.square(np.sin(phase / 2))
    left = frames - np.clip(np.rint(light), 0, camera.full_scale)
    assert np.abs(left.mean()) < 0.1
    assert left.std() < 1.2 * np.hypot(camera.noise, 0.3)


def test_the_hidden_frames_are_others_and_their_truth_is_apart(made: Path) -> None:
    assert sorted(path.name for path in made.iterdir()) == ["drawn", "touch", "truth"]
    assert sorted(path.name for path in (made / "drawn").iterdir()) == [
        "design.toml",
        "hidden.npy",
        "public.csv",
        "public.npy",
    ]
    public, hidden = (np.load(made / "drawn" / f"{part}.npy") for part in ("public", "hidden"))
    assert public.shape == hidden.shape == (COUNT, 2048)
    assert not (public == hidden).all(axis=1).any()
    assert tomllib.loads((made / "touch" / "design.toml").read_text())["skin"]


def test_our_reader_is_scored_from_the_command_line(made: Path, tmp_path: Path) -> None:
    runner = CliRunner()
    for track in ("drawn", "touch"):
        model, frames = tmp_path / f"{track}.h5", made / track / "hidden.npy"
        design = made / track / "design.toml"
        for words in (
            ["characterize", str(design), "-o", str(model)],
            ["read", str(model), str(frames), "-o", str(tmp_path / "answers" / f"{track}.csv")],
        ):
            (tmp_path / "answers").mkdir(exist_ok=True)
            assert runner.invoke(app, words).exit_code == 0
    said = runner.invoke(app, ["benchmark", "score", str(made), str(tmp_path / "answers")])
    assert said.exit_code == 0
    assert "drawn" in said.output
    for found in score(made, tmp_path / "answers"):
        assert found.answered > 0.8
        assert found.inside > 0.85
        assert found.wrong < 0.05
        assert found.rms < 0.1


def test_errors_and_deviations_that_are_known_are_scored_as_such(
    made: Path, tmp_path: Path
) -> None:
    rng = np.random.default_rng()
    rows = _rows(made / "truth" / "drawn.csv")
    for row in rows:
        for name in ("normal", "tangential"):
            row[f"{name}_N"] = str(float(row[f"{name}_N"]) + rng.normal(0, 0.02))
            row[f"{name}_std_N"] = "0.02"
        row["status"] = "AMBIGUOUS" if int(row["frame"]) < COUNT // 4 else "OK"
    rows[-1]["normal_N"] = str(float(rows[-1]["normal_N"]) + 0.5)  # one wrong reading
    _answer(tmp_path / "answers" / "drawn.csv", rows)
    (found,) = score(made, tmp_path / "answers")
    standing = COUNT - COUNT // 4
    assert found.answered == pytest.approx(standing / COUNT)
    assert found.wrong == pytest.approx(1 / standing)
    noise = np.hypot(0.02, 0.5 / np.sqrt(standing * 22))
    assert found.rms == pytest.approx(noise, rel=0.15)
    assert found.inside == pytest.approx(0.95, abs=0.04)


def test_answers_without_deviations_have_no_coverage(made: Path, tmp_path: Path) -> None:
    _answer(tmp_path / "answers" / "touch.csv", _rows(made / "truth" / "touch.csv"))
    (found,) = score(made, tmp_path / "answers")
    assert (found.answered, found.rms, found.worst) == (1.0, 0.0, 0.0)
    assert np.isnan(found.inside)
    assert np.isnan(found.wrong)


def test_seeds_make_the_same_frames(tmp_path: Path) -> None:
    for name in ("one", "other"):
        make_benchmark(tmp_path / name, 3, seed=5, tracks=("held",))
    one, other = (np.load(tmp_path / name / "held" / "hidden.npy") for name in ("one", "other"))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("name", sorted(TRACKS))
def test_every_track_says_what_it_is(name: str) -> None:
    assert TRACKS[name].about
    assert name in CliRunner().invoke(app, ["benchmark", "make", "--help"]).output


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("normal_N", "force"), "no column 'normal_N'"),
        (lambda text: text.replace("\n0,1,", "\n0,1,much", 1), "line 2"),
        (lambda text: text.replace("\n0,2,", "\n99,2,", 1), "frame 99"),
        (lambda text: text.replace("\n0,1,", "\n1,1,", 1), "stands by frame|lacks"),
        (lambda text: "", "no column"),
    ],
)
def test_answers_that_cannot_be_scored_say_where(
    made: Path, tmp_path: Path, change: Callable[[str], str], words: str
) -> None:
    answer = tmp_path / "drawn.csv"
    answer.write_text(change((made / "truth" / "drawn.csv").read_text()))
    with pytest.raises(ff.FringeforceError, match=words):
        score(made, tmp_path)


def test_bad_requests_are_refused_and_leave_nothing(tmp_path: Path) -> None:
    with pytest.raises(ff.FringeforceError, match="no track 'drown'"):
        make_benchmark(tmp_path / "new", tracks=("drown",))
    with pytest.raises(ff.FringeforceError, match="count = 0"):
        make_benchmark(tmp_path / "new", count=0)
    with pytest.raises(ff.FringeforceError, match="exists"):
        make_benchmark(tmp_path)
    with pytest.raises(ff.FringeforceError, match="no folder truth"):
        score(tmp_path, tmp_path)
    assert not (tmp_path / "new").exists()


def test_what_is_interrupted_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> Scene:
        raise KeyboardInterrupt

    monkeypatch.setitem(TRACKS, "drawn", replace(TRACKS["drawn"], take=interrupted))
    with pytest.raises(KeyboardInterrupt):
        make_benchmark(tmp_path / "frames", 2, tracks=("held", "drawn"))
    assert not list(tmp_path.iterdir())


def test_negative_deviations_are_refused(made: Path, tmp_path: Path) -> None:
    rows = [row | {"normal_std_N": "-1"} for row in _rows(made / "truth" / "drawn.csv")]
    _answer(tmp_path / "answers" / "drawn.csv", rows)
    with pytest.raises(ff.FringeforceError, match="line 2: a standard deviation is negative"):
        score(made, tmp_path / "answers")
