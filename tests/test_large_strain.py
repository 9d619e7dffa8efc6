"""Frames of strips under large strain."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.base.errors import DesignError, InputError


def _model(sensor: ff.Sensor) -> ff.SensorModel:
    changes = {"tactels.contact_width": "0.5 mm", "camera.pixels": 256}
    return ff.characterize(sensor.replace(**changes))


def test_forces_act_as_patches_and_presses_alike(sensor: ff.Sensor) -> None:
    model = _model(sensor)
    forces = np.zeros((11, 2))
    forces[5] = 1.0, 0.2
    press = ff.Press(x=0.0, normal=1.0, tangential=0.2, width=0.5e-3, profile="flat")
    phase = model.phase([press], strain="finite")
    peak = np.abs(phase).max()
    np.testing.assert_allclose(model.phase(forces, strain="finite"), phase, atol=2e-3 * peak)
    linear = model.phase(forces)
    assert 5e-3 * peak < np.abs(phase - linear).max() < 3e-2 * peak


@pytest.mark.parametrize(("width", "radius"), [(0.8e-3, None), (None, 5e-3)])
def test_gentle_presses_are_the_linear_ones(
    sensor: ff.Sensor, width: float | None, radius: float | None
) -> None:
    model = _model(sensor)
    touch = [ff.Press(x=1e-3, normal=0.02, tangential=0.004, width=width, radius=radius)]
    linear = model.phase(touch)
    finite = model.phase(touch, strain="finite")
    assert np.abs(finite - linear).max() < 1e-2 * np.abs(linear).max()


def test_a_design_says_which_strain(sensor: ff.Sensor) -> None:
    model = _model(sensor)
    finite = ff.characterize(model.sensor.replace(**{"transducer.strain": "finite"}))
    forces = ff.polar(0.5, 10, n=11)
    np.testing.assert_array_equal(
        finite.expose(forces, rng=0), model.expose(forces, rng=0, strain="finite")
    )
    np.testing.assert_array_equal(finite.phase(forces, strain="linear"), model.phase(forces))


def test_what_large_strain_does_not_know_is_refused(sensor: ff.Sensor) -> None:
    with pytest.raises(DesignError, match="contact_width"):
        sensor.replace(**{"transducer.strain": "finite"})
    model = _model(sensor)
    with pytest.raises(InputError, match="width"):
        model.phase([ff.Press(x=0.0, normal=1.0)], strain="finite")
    with pytest.raises(InputError, match="as built"):
        model.expose(ff.polar(0.5, 10, n=11), as_built=0, strain="finite")


def test_readings_refuse_what_they_cannot_follow(sensor: ff.Sensor) -> None:
    """Small strain would be off by many deviations and say OK."""
    finite = ff.characterize(
        sensor.replace(**{"tactels.contact_width": "0.5 mm", "transducer.strain": "finite"})
    )
    with pytest.raises(InputError, match="readings are of small strain"):
        ff.Reader(finite)
