"""The paper's single presses, against matrices that are known."""

import importlib.util
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.models.imaging import Imaging

pytestmark = pytest.mark.slow

N, PIXELS = 5, 1024
SCRIPT = Path(__file__).parents[2] / "benchmarks" / "single_press.py"
Measure = Callable[..., ff.SensorModel]


@pytest.fixture(scope="module")
def single_press_matrix() -> Measure:
    """The procedure, as the benchmark of calibrations uses it."""
    spec = importlib.util.spec_from_file_location("single_press", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.single_press_matrix


@pytest.fixture(scope="module")
def small(sensor: ff.Sensor) -> ff.Sensor:
    return sensor.replace(**{"tactels.count": N, "tactels.pitch": 2e-3, "camera.pixels": PIXELS})


@pytest.fixture(scope="module")
def made(small: ff.Sensor) -> ff.SensorModel:
    factor = 1.05 * small.transducer.photoelastic.strain_optic_coefficient
    return ff.characterize(
        small.replace(**{"transducer.photoelastic.strain_optic_coefficient": factor})
    )


def test_single_presses_measure_the_matrix_of_a_bench_without_noise(
    small, made, single_press_matrix: Measure
) -> None:
    still = small.replace(**{"camera.noise": 0.0, "camera.bits": 16, "camera.amplitude": 6e4})
    quiet = replace(made, sensor=still)
    loads = np.eye(2 * N).reshape(2 * N, N, 2) * [0.4, 0.2]
    model = single_press_matrix(still, quiet.expose(loads), loads)
    found, truth = model.pixel_influence, made.pixel_influence
    np.testing.assert_allclose(np.abs(found), np.abs(truth), atol=0.03)
    # the least intensity places a change of sign to some pixels
    assert (np.sign(found) * np.sign(truth))[np.abs(truth) > 0.03].mean() > 0.99


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: p + 0.1, ["Frame 0", "several loads"]),
        (lambda p: p * (np.arange(2 * N) != 3)[:, None, None], ["Tactel 2", "both ways"]),
        (lambda p: p * 40, ["folds", "stay below"]),
    ],
)
def test_presses_that_the_arcsine_cannot_use_are_named(
    small, change, words, single_press_matrix: Measure
) -> None:
    loads = np.eye(2 * N).reshape(2 * N, N, 2) * [0.4, 0.2]
    with pytest.raises(ff.FringeforceError) as caught:
        single_press_matrix(small, np.full((2 * N, PIXELS), 9.0), change(loads))
    assert all(word in str(caught.value) for word in words)


def test_weak_presses_measure_more_bias_than_signal_far_from_the_tactel(
    small, made, single_press_matrix: Measure
) -> None:
    """The arcsine of an intensity that noise has spread is not zero where the phase is."""
    loads = np.eye(2 * N).reshape(2 * N, N, 2) * [0.4, 0.2]
    forces = np.repeat(loads, 4, axis=0)
    model = single_press_matrix(small, made.expose(forces, rng=5), forces)
    assert isinstance(model.imaging, Imaging)
    off = model.pixel_influence - made.pixel_influence
    quiet = np.abs(made.pixel_influence) < 0.02
    assert np.abs(off[quiet]).mean() > 2 * np.abs(made.pixel_influence[quiet]).mean()
