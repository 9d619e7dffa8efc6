"""What several tests share: the paper's sensor, characterised once."""

import pytest

import fringeforce as ff


@pytest.fixture(scope="session")
def sensor() -> ff.Sensor:
    return ff.load_sensor("saad")


@pytest.fixture(scope="session")
def model(sensor: ff.Sensor) -> ff.SensorModel:
    return ff.characterize(sensor)


@pytest.fixture(scope="session")
def roller_model(sensor: ff.Sensor) -> ff.SensorModel:
    return ff.characterize(sensor.replace(**{"transducer.edges": "roller"}))
