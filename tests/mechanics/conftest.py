"""The paper's strip, which the tests of its mechanics share."""

import pytest

import fringeforce as ff
from fringeforce.design.strip import Transducer


@pytest.fixture(scope="session")
def strip(sensor: ff.Sensor) -> Transducer:
    """Case 1: free edges."""
    return sensor.transducer


@pytest.fixture(scope="session")
def roller_strip(sensor: ff.Sensor) -> Transducer:
    """Case 2: roller edges."""
    return sensor.replace(**{"transducer.edges": "roller"}).transducer
