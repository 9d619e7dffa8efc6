"""The scale of the light, which no frame tells: fewer forces under a stronger effect look alike."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.design.strip import Sensor

Array = np.ndarray
TOLERANCE = 0.03
EFFECT = "transducer.photoelastic.strain_optic_coefficient"


@pytest.fixture(scope="module")
def drawn() -> Sensor:
    return ff.load_sensor("saad").replace(**{"transducer.edges": "roller"})


def loads(sensor: Sensor, rng: np.random.Generator) -> Array:
    count = sensor.tactels.count
    return ff.polar(rng.uniform(0, 2, count), rng.uniform(-30, 30, count))


def along(reading: ff.Reading) -> float:
    """Relative deviation of all forces together."""
    forces = reading.forces.ravel()
    return float(np.sqrt(forces @ reading.covariance @ forces) / (forces @ forces))


@pytest.mark.parametrize(
    ("stated", "true"),
    [
        ({}, {}),
        ({"camera.shift": "0 +/- 0.1 mm"}, {"camera.shift": "0.15 mm"}),
        ({"camera.scale": "1 +/- 0.01"}, {"camera.scale": 1.015}),
        (
            {"transducer.compliant.thickness": "0.5 mm +/- 4 %"},
            {"transducer.compliant.thickness": "0.53 mm"},
        ),
        (
            {"tactels.contact_width": "0.4 +/- 0.1 mm"},
            {"tactels.contact_width": "0.55 mm"},
        ),
    ],
    ids=["alone", "shift", "registration", "cover", "width"],
)
def test_a_frame_does_not_tell_the_scale_whatever_else_is_off(drawn: Sensor, stated, true) -> None:
    """A sensor with the effect as drawn, and another value one and a half deviations off."""
    toleranced = drawn.replace(**{EFFECT: f"0.05 +/- {100 * TOLERANCE} %"}, **stated)
    reader = ff.Reader(ff.characterize(toleranced))
    built, rng = ff.characterize(drawn.replace(**true)), np.random.default_rng(1)
    for _ in range(4):
        reading = reader.search(built.expose(loads(drawn, rng), rng))
        assert reading.ok
        assert 0.98 * TOLERANCE < along(reading) < 1.1 * TOLERANCE


def test_contacts_beside_their_tactels_do_not_tell_the_scale(drawn: Sensor) -> None:
    toleranced = drawn.replace(
        **{EFFECT: f"0.05 +/- {100 * TOLERANCE} %", "tactels.placement": "0 +/- 0.1 mm"}
    )
    model = ff.characterize(toleranced)
    reader, rng = ff.Reader(model), np.random.default_rng(1)
    for _ in range(4):
        built = model.as_built(rng)
        forces, contacts = loads(drawn, rng), built.contacts((), rng)
        for _ in range(2):  # searched, and followed
            reading = reader.read(built.expose(forces, rng, contacts))
            assert reading.ok
            assert 0.98 * TOLERANCE < along(reading) < 1.1 * TOLERANCE
        reader.reset()
