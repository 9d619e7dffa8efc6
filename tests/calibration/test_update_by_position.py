"""Calibrated strips brought up to date with presses by position.

Frames are of the exact series, under flat contacts of widths that nobody writes down.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2
from typer.testing import CliRunner

import fringeforce as ff
from calibration.short_strips import calibrated, drifted, squared_distance, strip
from fringeforce.base.errors import InputError
from fringeforce.calibration.bench_loads import BenchLoads, bench_loads
from fringeforce.calibration.load_log import load_log
from fringeforce.cli import app
from fringeforce.io.bench_loads import save_bench_loads
from fringeforce.models.strip import SensorModel
from reading.exact_frames import Bench

pytestmark = pytest.mark.slow

PRESSES, READ, WRONG = 16, 6, 5
BESIDE, OFF = 0.05e-3, 0.01
"""What is written down of places is beside by so much [m], of forces wrong by such a share, rms."""
EDGE = 1.2e-3
"""Of the strip, on which nothing presses [m]."""
CHANCE = 1e-4
"""Of a false alarm, for each number of tactels and each side."""


def pressed(bench: Bench, rng: np.random.Generator, *wrong: int) -> tuple[np.ndarray, BenchLoads]:
    """Frames of single presses anywhere, and what is written down of them: some wrong by 40 %."""
    half = bench.sensor.transducer.length / 2 - EDGE
    places, widths = rng.uniform(-half, half, PRESSES), rng.uniform(0.2e-3, 0.6e-3, PRESSES)
    forces = ff.polar(rng.uniform(0.5, 2.5, PRESSES), rng.uniform(-30, 30, PRESSES))
    frames = [
        replace(bench, places=np.array([x]), widths=np.array([w])).frames(f[None, None], rng)[0]
        for x, w, f in zip(places, widths, forces, strict=True)
    ]
    said = forces * (1 + OFF * rng.standard_normal(forces.shape))
    said[list(wrong)] *= 1.4
    return np.array(frames), bench_loads(places + BESIDE * rng.standard_normal(PRESSES), said)


@pytest.mark.parametrize(
    ("tactels", "length", "strips"), [(3, "9 mm", 5), (5, "11 mm", 4), (11, "25 mm", 2)]
)
def test_readings_after_presses_by_position_err_as_they_say(tactels, length, strips) -> None:
    """Means of squared distances of the readings by one model scatter less than single ones."""
    bench, drift, total = strip(tactels, length), ff.Drift(), 0.0
    before = calibrated(bench)
    for number in range(strips):
        rng = np.random.default_rng([86, tactels, number])
        later = drifted(bench, rng, drift.shift, drift.light, drift.residual)
        frames, written = pressed(later, rng)
        model = ff.update(before, frames, loads=written)
        found = model.calibration
        assert found is not None
        assert found.usable
        total += squared_distance(model, later, rng, READ)
    freedom = 2 * tactels * strips
    assert chi2.ppf(CHANCE, freedom) < total < chi2.isf(CHANCE, freedom)


@pytest.fixture(scope="module")
def pushed() -> tuple[SensorModel, Bench, np.ndarray, BenchLoads]:
    """A strip of three tactels, the same under a pushed camera, and presses on it."""
    bench, rng = strip(3, "9 mm"), np.random.default_rng(87)
    later = replace(bench, shift=0.08e-3, gain=np.full(bench.gain.shape, 0.95))
    return calibrated(bench), later, *pressed(later, rng, WRONG)


def test_the_command_takes_presses_by_position(pushed, tmp_path) -> None:
    model, _, frames, written = pushed
    model.save(tmp_path / "m.h5")
    np.save(tmp_path / "f.npy", frames)
    save_bench_loads(tmp_path / "loads.csv", written)
    names = [str(tmp_path / name) for name in ("m.h5", "f.npy", "loads.csv", "n.h5")]
    ended = CliRunner().invoke(app, ["update", *names[:2], "--loads", names[2], "-o", names[3]])
    assert ended.exit_code == 0, ended.output
    assert "The light changed by -" in ended.output
    assert f"Frame {WRONG}, recorded as" in ended.output
    model = ff.load_model(tmp_path / "n.h5")
    found = model.calibration
    assert found is not None
    assert found.outliers == (WRONG,)
    shift = found.names.index("camera shift")
    assert abs(found.values[shift] - 0.08e-3) < 4 * found.std[shift]
    # readings estimate what presses leave uncertain of it
    assert model.sensor.tolerances["camera.shift"] == pytest.approx(found.std[shift])


def test_what_is_stated_of_places_and_widths_is_taken(pushed) -> None:
    """Places that are stated as exact leave less of the camera's shift uncertain."""
    model, _, frames, written = pushed
    stds = []
    for place in (np.nan, 1e-3):
        stated = replace(written, place_std=np.full(written.place_std.shape, place))
        found = ff.update(model, frames, loads=stated).calibration
        assert found is not None
        at = found.names.index("camera shift")
        stds.append(found.std[at])
        assert abs(found.values[at] - 0.08e-3) < 4 * found.std[at]
    assert stds[0] < stds[1]


def test_a_log_by_time_finds_its_delay(pushed) -> None:
    model, later, _, _ = pushed
    rng, rate, delay = np.random.default_rng(88), 50.0, 0.35
    times, when = np.arange(60) / rate, np.arange(-100, 200) / 100.0

    def force(moments: np.ndarray) -> np.ndarray:
        """A press that comes and goes twice, differently [N]."""
        first, second = (np.exp(-(((moments - at) / 0.12) ** 2)) for at in (0.3, 0.8))
        return 0.2 + 1.8 * first + 1.1 * second

    bench = replace(later, places=np.array([0.4e-3]), widths=np.array([0.3e-3]))
    frames = bench.frames(np.multiply.outer(force(times), [[1.0, 0.2]]), rng)
    late = np.multiply.outer(force(when - delay), [1.0, 0.2])
    log = load_log(when, np.full(len(when), 0.4e-3), late)
    found = ff.update(model, frames, loads=log, times=times).calibration
    assert found is not None
    assert found.usable
    assert found.delay == pytest.approx(delay, abs=5e-3)


def test_presses_of_other_frames_must_not_be_used(pushed) -> None:
    model, _, frames, written = pushed
    found = ff.update(model, frames[::-1], loads=written).calibration
    assert found is not None
    assert not found.usable
    assert found.findings[0].startswith("Do not use this model")


def test_corrected_columns_are_those_of_tactels(pushed) -> None:
    model, _, frames, written = pushed
    corrected = replace(model, provenance={**model.provenance, "column correction": "1 %"})
    with pytest.raises(InputError, match="columns of this model were corrected"):
        ff.update(corrected, frames, loads=written)
