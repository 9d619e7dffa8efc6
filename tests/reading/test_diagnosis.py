"""Findings about frames that depart from the drawing, made by the exact Fourier series."""

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import fringeforce as ff

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "departures.py"


@pytest.fixture(scope="module")
def exact() -> ModuleType:
    """The benchmark of departures, which makes frames without the reader's matrix."""
    spec = importlib.util.spec_from_file_location("exact_departures", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def reader(roller_model: ff.SensorModel) -> ff.Reader:
    return ff.Reader(roller_model)


def frame(exact: ModuleType, reader: ff.Reader, name: str, seed: int = 0) -> np.ndarray:
    rng, sensor = np.random.default_rng(seed), reader.model.sensor
    forces = exact.loads(1, sensor.tactels.count, rng)
    return exact.exposed(exact.BENCHES[name], sensor, forces, rng)[0]


@pytest.mark.parametrize(
    ("name", "words", "size", "off"),
    [
        ("camera shifted by 0.05 mm", r"camera seems shifted by ([\d.-]+) mm", 0.05, 0.005),
        ("lamp 3 % dim", r"light seems ([\d.]+) % dimmer", 3.0, 0.3),
        ("fringe visibility 0.95", r"visibility of the fringes seems ([\d.]+), not 1", 0.95, 0.01),
        ("contacts 0.8 mm wide in the place of points", r"contacts seem ([\d.]+) mm", 0.8, 0.1),
        ("blur of 12 px", r"blurred by [\d.]+ mm \((\d+) pixels\)", 12, 1),
        ("residual retardance 0.1 rad", r"residual retardance of ([\d.]+) rad", 0.1, 0.07),
    ],
)
def test_the_departure_is_named_with_its_size(
    exact, reader, name: str, words: str, size: float, off: float
) -> None:
    reading = reader.search(frame(exact, reader, name))
    assert reading.status is ff.Status.MODEL_MISMATCH
    (finding,) = reading.findings
    found = re.search(words, finding)
    assert found is not None, finding
    assert float(found[1]) == pytest.approx(size, abs=off)
    assert "standard deviations" in finding
    assert finding in reading.advice


def test_a_departure_is_named_beside_tolerances_that_do_not_allow_for_it(exact, reader) -> None:
    drawn = reader.model.sensor.replace(**{"camera.amplitude": "245 +/- 1 %"})
    careful = ff.Reader(ff.characterize(drawn))
    reading = careful.search(frame(exact, reader, "fringe visibility 0.95"))
    assert reading.status is ff.Status.MODEL_MISMATCH
    assert "visibility of the fringes" in reading.findings[0]
    assert "give polariscope.visibility" in reading.findings[0]


def test_a_tolerance_that_is_too_tight_is_to_be_widened(exact, reader) -> None:
    drawn = reader.model.sensor.replace(**{"camera.blur": "6 +/- 1 um"})
    careful = ff.Reader(ff.characterize(drawn))
    reading = careful.search(frame(exact, reader, "blur of 12 px"))
    assert reading.status is ff.Status.MODEL_MISMATCH
    assert "widen the tolerance of camera.blur" in reading.findings[0]


def test_what_no_departure_explains_is_said_plainly(reader) -> None:
    x = np.linspace(0, 60, 2048)
    other = np.rint(125 + 60 * np.sin(x) + 50 * np.sin(2.7 * x + 1)).astype(np.uint8)
    reading = reader.search(other)
    assert reading.status is ff.Status.MODEL_MISMATCH
    assert "No departure" in reading.findings[0]


def test_readings_that_are_explained_have_no_findings(reader) -> None:
    good = reader.search(reader.model.expose(ff.polar(1.0, 10, n=11), rng=0))
    assert good.findings == ()
    assert good.advice == good.status.advice


def test_findings_are_made_when_they_are_asked_for(exact, reader) -> None:
    reading = reader.read(frame(exact, reader, "lamp 3 % dim", seed=1))
    assert "findings" not in vars(reading)
    assert reading.findings is reading.findings


def test_departures_that_explain_a_frame_only_together_are_all_named(exact, reader) -> None:
    rng, sensor = np.random.default_rng(3), reader.model.sensor
    bench = exact.Bench(shift=0.05e-3, visibility=0.95)
    forces = exact.loads(1, sensor.tactels.count, rng)
    finding = reader.search(exact.exposed(bench, sensor, forces, rng)[0]).findings[0]
    assert finding.startswith("Several departures together")
    assert re.search(r"shifted by 0.0[45]\d* mm|-0.0[45]\d* mm beside their tactels", finding)
    found = re.search(r"visibility of the fringes seems ([\d.]+), not 1", finding)
    assert found is not None
    assert float(found[1]) == pytest.approx(0.95, abs=0.01)
