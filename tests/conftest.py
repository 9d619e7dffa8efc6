"""What several tests share: the paper's sensor, characterised once."""

import pytest
from hypothesis import settings

import fringeforce as ff

# a busy machine may take long over an example without being wrong
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")


@pytest.fixture(scope="session")
def sensor() -> ff.Sensor:
    return ff.load_sensor("saad")


@pytest.fixture(scope="session")
def model(sensor: ff.Sensor) -> ff.SensorModel:
    return ff.characterize(sensor)


@pytest.fixture(scope="session")
def roller_model(sensor: ff.Sensor) -> ff.SensorModel:
    return ff.characterize(sensor.replace(**{"transducer.edges": "roller"}))
