"""Layers that relax unlike each other, and a photoelastic effect that creeps."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.base.errors import DesignError, InputError
from fringeforce.models.creep import Creep

COVER, CLEAR = [["8 %", "2 s"], ["4 %", "30 s"]], [["3 %", "5 s"]]
OPTICAL = [["2 %", "10 s"]]
STRESS_OPTIC = {
    "transducer.photoelastic.strain_optic_coefficient": None,
    "transducer.photoelastic.stress_optic_coefficient": 645e-12,
}


def sensor(cover: object = COVER, clear: object = CLEAR, **more: object) -> ff.Sensor:
    own = {"transducer.compliant.relaxation": cover, "transducer.photoelastic.relaxation": clear}
    return ff.load_sensor("saad").replace(**own, **more)


def test_layers_that_relax_alike_are_as_those_of_one_relaxation() -> None:
    whole = ff.load_sensor("saad").replace(**{"transducer.relaxation": COVER}).transducer
    own = sensor(COVER, COVER).transducer
    assert not len(Creep.of_ratio(own).rates)
    np.testing.assert_array_equal(Creep.of(own).amounts, Creep.of(whole).amounts)


@pytest.mark.parametrize("s", [0.0, 0.03, 0.2, 1.0, 7.0])
def test_lags_are_the_partial_fractions_of_what_relaxes(s: float) -> None:
    """At Laplace's s, with one time in both layers, where poles would fall together."""
    strip = sensor(COVER, [["3 %", "2 s"]], **{"transducer.photoelastic.optical_creep": OPTICAL})
    one = 1 - 0.08 / (1 + 2 * s) - 0.04 / (1 + 30 * s)
    other = 1 - 0.03 / (1 + 2 * s)
    light = 1 + 0.02 / (1 + 10 * s)
    for creep, value in (
        (Creep.of_ratio(strip.transducer), one / other),
        (Creep.of(strip.transducer), light / other),
    ):
        lagging = creep.amounts / (1 + s / creep.rates)
        assert 1 + lagging.sum() == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize("law", [{}, STRESS_OPTIC])
def test_a_load_that_lasts_ends_at_the_strip_of_the_relaxed_moduli(law: dict) -> None:
    cover = [["50 %", "2 s"]]
    model = ff.characterize(sensor(cover, **law, **{"camera.pixels": 512, "camera.noise": 0.5}))
    forces = np.tile(ff.polar(1.0, 20, n=11), (3, 1, 1))
    times = np.array([0.0, 1.0, 1e4])
    frames = model.expose(forces, rng=0, times=times).astype(float)
    relaxed = {
        "transducer.compliant.youngs_modulus": 0.5 * 11e6,
        "transducer.photoelastic.youngs_modulus": 0.97 * 110e6,
    }
    end = ff.characterize(sensor((), (), **law, **relaxed, **{"camera.pixels": 512}))
    for frame, phase in ((frames[0], model.phase(forces[0])), (frames[2], end.phase(forces[0]))):
        camera = model.sensor.camera
        level = camera.offset + camera.amplitude * np.square(np.sin(phase / 2))
        assert np.abs(frame - level).max() < 1.5  # noise and rounding reach one
    assert np.abs(end.phase(forces[0]) - model.phase(forces[0])).max() > 0.05


def test_readings_allow_for_a_cover_that_relaxes_alone() -> None:
    light = {"camera.noise_model": "gaussian", "camera.noise": 1.0, "camera.pixels": 1024}
    cover = [["40 %", "2 s"]]
    times = np.arange(0.0, 41.0, 2.0)
    forces = np.zeros((len(times), 11, 2))
    forces[1:] = ff.polar(1.0, 10, n=11) * np.random.default_rng(1).uniform(0.3, 1, (11, 1))
    model = ff.characterize(sensor(cover, (), **light))
    assert not ff.Reader(model).needs_times
    frames = model.expose(forces, rng=0, times=times)
    plain = ff.Reader(ff.characterize(sensor((), (), **light))).read_batch(frames)
    batch = ff.Reader(model).read_batch(frames)
    held = times > 10
    assert all(status is ff.Status.OK for status in np.array(batch.status)[held])
    off, before = (np.abs(b.forces - forces)[held] / b.std[held] for b in (batch, plain))
    assert np.mean(off < 1.96) > 0.92
    assert np.mean(before < 1.96) < 0.7


def test_what_does_not_go_together_is_refused() -> None:
    with pytest.raises(DesignError, match="of both layers and one of a single"):
        sensor(**{"transducer.relaxation": COVER})
    with pytest.raises(DesignError, match="of strips"):
        ff.load_sensor("pad").replace(**{"transducer.compliant.relaxation": COVER})
    model = ff.characterize(sensor())
    times = np.array([0.0, 1.0])
    with pytest.raises(InputError, match="forces on tactels"):
        model.expose([[ff.Press(x=0.0, normal=1.0)]] * 2, times=times)
    scattered = ff.characterize(sensor(**{"tactels.placement": "0 +/- 0.1 mm"}))
    with pytest.raises(InputError, match="contacts and columns as drawn"):
        scattered.expose(np.zeros((2, 11, 2)), as_built=0, times=times)


def test_a_sensor_that_is_built_as_drawn_creeps_as_the_drawing() -> None:
    model, times = ff.characterize(sensor()), np.array([0.0, 1.0, 30.0])
    forces = np.array([0.0, 1.0, 1.0])[:, None, None] * ff.polar(1.0, 10, n=11)
    own, drawn = (model.expose(forces, rng=1, as_built=built, times=times) for built in (0, None))
    np.testing.assert_array_equal(own, drawn)
    assert (own[2] != model.expose(forces, rng=1)[2]).any()
    with pytest.raises(InputError, match="both layers together"):
        ff.find_relaxation(model, np.zeros((2, 2048)), np.zeros((2, 11, 2)), times)
