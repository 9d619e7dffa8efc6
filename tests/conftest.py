"""What several tests share: the paper's sensor, characterised once; loops, compiled once."""

import atexit
import gc
import os
import signal
import subprocess
import sys
from collections.abc import Generator

import pytest
from hypothesis import settings

import fringeforce as ff
import prepared
import turns

# a busy machine may take long over an example without being wrong
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")

# each of the many processes that tests start would compile what it imports, for a second or two
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # a shell starts what it runs in the background so, and commands that tests interrupt inherit it
    signal.signal(signal.SIGINT, signal.default_int_handler)
atexit.register(gc.freeze)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection() -> Generator[None, object, object]:
    """Look for garbage only in what tests make: what is imported and collected lasts to the end.

    And look seldom: most of what tests make goes by itself.
    """
    gc.disable()
    result = yield
    gc.freeze()
    gc.set_threshold(20_000, 20, 50)
    gc.enable()
    return result


def pytest_configure(config: pytest.Config) -> None:
    """Workers take long turns, of which there are more than cores."""
    if hasattr(config, "workerinput"):
        turns.take_long_turns()


preparing: list[subprocess.Popen[bytes]] = []


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile the loops that most tests need, on two cores, while workers import the tests.

    Workers that all begin on a new machine would each compile the same modules to bytecode.
    """
    config = session.config
    if hasattr(config, "workerinput") or config.getoption("dist", "no") == "no":
        return
    preparing.append(prepared.begin("strips"))
    if not any(session.path.glob("tests/__pycache__/test_*.pyc")):
        command = [sys.executable, "-m", "pytest", "--collect-only", "-q"]
        subprocess.run(command, cwd=session.path, stdout=subprocess.DEVNULL, check=False)
    preparing.append(prepared.begin("others"))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_node_collection_finished() -> None:
    """Before the first test is handed out, wait for the loops: workers would compile them again."""
    for one in preparing:
        one.wait()


@pytest.hookimpl(tryfirst=True)  # before pytest-xdist reads the groups
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Share tests out among workers: a fixture is made once, and long tests do not come last.

    Tests that use a fixture of their file's make one group, which one worker runs.  pytest-xdist
    begins with groups of many tests; of what follows, tests that are not marked slow come last.
    """
    if not hasattr(config, "workerinput"):
        return
    for item in items:
        if item.get_closest_marker("xdist_group") is None and _shares_a_fixture(item):
            item.add_marker(pytest.mark.xdist_group(item.path.stem))
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)


def _shares_a_fixture(item: pytest.Item) -> bool:
    """Whether a test uses a fixture that its file makes once."""
    if not isinstance(item, pytest.Function):
        return False
    found = item._fixtureinfo.name2fixturedefs.values()
    return any(one.scope == "module" for fixtures in found for one in fixtures)


@pytest.fixture(scope="session")
def sensor() -> ff.Sensor:
    return ff.load_sensor("saad")


@pytest.fixture(scope="session")
def model(sensor: ff.Sensor) -> ff.SensorModel:
    return ff.characterize(sensor)


@pytest.fixture(scope="session")
def roller_model(sensor: ff.Sensor) -> ff.SensorModel:
    return ff.characterize(sensor.replace(**{"transducer.edges": "roller"}))
