"""`fringeforce live`: what a person sees, and how it ends."""

import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import fringeforce as ff
from commands import run
from fringeforce.acquisition.run_statistics import Delivery, Statistics
from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.cli.display import full_scale, picture, summary
from fringeforce.io.frames import load_frames

pytestmark = pytest.mark.slow

COMMAND = str(Path(sys.executable).parent / "fringeforce")
STATISTICS = Statistics(
    seconds=12.0,
    rate=19843.0,
    latency={50: 2.1e-3, 95: 3.4e-3, 99: 6e-3},
    lines=1000,
    dropped_camera=128,
    dropped_queue=640,
    statuses={"OK": 900, "AMBIGUOUS": 100},
    reconnects=2,
    camera_trouble="",
    deliveries=(Delivery("CSV r.csv", 400, 0, "The disk is full.", ""),),
)


@pytest.fixture(scope="module")
def saved(model: ff.SensorModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("model") / "m.h5"
    model.save(path)
    return path


def _readings(normal: float, tangential: float, status: ff.Status) -> Readings:
    forces = np.zeros((1, 3, 2))
    forces[0, 1] = normal, tangential
    std = np.full((1, 3, 2), 0.01)
    return Readings(0, np.zeros(1), forces, std, np.ones(1), (status,), np.zeros((1, 8)))


def _text(readings: Readings | None, scale: float = 1.0) -> str:
    console = Console(width=100, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    console.print(picture(ff.load_sensor("saad"), "a camera", STATISTICS, readings, scale))
    console.file.close()
    return console.export_text()


def test_bars_are_as_long_as_the_forces() -> None:
    text = _text(_readings(0.5, -0.3, ff.Status.OK))
    (row,) = [line for line in text.splitlines() if line.lstrip().startswith("2 ")]
    normal, tangential = row.split("+0.500")
    # half of 20 letters to the right, three tenths of 10 letters to the left of the middle
    assert normal.count("█") == 10
    assert tangential.split("│")[0].count("█") == 3
    assert tangential.split("│")[1].count("█") == 0


@pytest.mark.parametrize(
    "words",
    [
        "19843 lines/s",
        "half within 2.1 ms",
        "99 % within 6 ms",
        "The camera lost 128 lines",
        "640 lines came faster",
        "100 AMBIGUOUS",
        "CSV r.csv stopped after 400 lines: The disk is full.",
        "Use what you know of the contact",
    ],
)
def test_the_screen_tells_what_matters(words: str) -> None:
    text = _text(_readings(0.5, 0.0, ff.Status.AMBIGUOUS))
    assert words in " ".join(text.split())


def test_a_bad_frame_has_no_bars() -> None:
    text = _text(_readings(np.nan, np.nan, ff.Status.BAD_FRAME))
    assert "█" not in text
    assert "BAD_FRAME: The frame cannot be used" in text


def test_a_scale_is_round_and_holds_the_largest_force() -> None:
    assert full_scale(None) == 0.01
    assert full_scale(_readings(0.6, -1.2, ff.Status.OK)) == 2.0
    assert full_scale(_readings(np.nan, np.nan, ff.Status.BAD_FRAME)) == 0.01


def test_the_summary_accounts_for_every_line() -> None:
    text = "\n".join(summary(STATISTICS))
    for words in ("1000 lines in 12.0 s", "900 OK", "came back 2 times", "128", "640"):
        assert words in text


def test_what_is_one_is_told_as_one() -> None:
    one = replace(
        STATISTICS, lines=1, dropped_camera=1, dropped_queue=1, reconnects=1, counted="images"
    )
    text = "\n".join(summary(one))
    for words in ("1 image in 12.0 s", "came back 1 time", "lost 1 image.", "1 image came faster"):
        assert words in text
    assert "was dropped" in text


def test_the_latency_says_of_which_share_it_is() -> None:
    (told,) = [line for line in summary(STATISTICS) if "latency" in line]
    assert "from exposure to reading: half within 2.1 ms, 95 % within" in told


def test_an_interrupt_ends_with_everything_written(saved: Path, tmp_path: Path) -> None:
    run = subprocess.Popen(
        [COMMAND, "live", str(saved), "--line-rate", "40", "--block", "4", "--to", "csv:r.csv",
         "--record", "r.h5"],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert run.stderr
    # a line each second: the second when lines are being read
    seen = [line for line in (run.stderr.readline() for _ in range(3)) if "Compiling" not in line]
    assert all("lines/s" in line for line in seen)
    run.send_signal(signal.SIGINT)
    out, errors = run.communicate(timeout=60)
    assert run.returncode == 0, errors
    count = int(out.split()[0])
    assert out.splitlines()[0].startswith(f"{count} lines in")
    assert f"CSV r.csv: {count} lines" in out
    assert len((tmp_path / "r.csv").read_text().splitlines()) == 1 + 11 * count
    assert len(load_frames(tmp_path / "r.h5")) == count > 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--camera", "periscope"], "There is no camera"),
        (["--camera", "file:missing.npy"], "missing.npy"),
        (["--to", "ws://0.0.0.0:0"], "--token"),
        (["--to", "tape:x"], "There is no place"),
        (["--line-rate", "-1"], "line_rate = -1"),
        (["--camera", "webcam:0"], "a frame of this sensor is a line of 2048 pixels"),
    ],
)
def test_bad_input_ends_with_status_2_and_one_line(
    saved: Path, tmp_path: Path, arguments: list[str], words: str
) -> None:
    said = run("live", str(saved), *arguments, cwd=tmp_path)
    assert said.returncode == 2
    assert said.stderr.startswith("fringeforce: ")
    assert len(said.stderr.strip().splitlines()) == 1
    assert words in said.stderr


def test_a_camera_that_sends_nothing_ends_with_status_1(saved: Path, tmp_path: Path) -> None:
    slow = ["--line-rate", "0.1", "--block", "16", "--for", "0.2"]
    said = run("live", str(saved), *slow, cwd=tmp_path)
    assert said.returncode == 1
    assert "Nothing came from" in said.stdout
    assert "longer --for" in said.stdout


def test_a_recording_that_cannot_be_used_says_why_once_and_ends_with_status_1(
    saved: Path, tmp_path: Path
) -> None:
    frames = np.full((300, ff.load_model(saved).frame_shape[0]), 255, np.uint8)
    np.save(tmp_path / "bright.npy", frames)
    for command in (["live", str(saved), "--camera", "file:bright.npy"],
                    ["read", str(saved), "bright.npy", "-o", "r.csv", "--plot"]):  # fmt: skip
        said = run(*command, cwd=tmp_path)
        assert said.returncode == 1
        assert said.stdout.count("All pixels are 255.") == 1
        assert "None of the" in said.stdout
    assert not (tmp_path / "r.png").exists()
