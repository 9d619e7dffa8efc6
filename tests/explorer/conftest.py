"""What the explorer's tests share."""

from collections.abc import Iterator

import pytest
from local_server import LocalServer


@pytest.fixture(scope="session")
def server() -> Iterator[LocalServer]:
    local = LocalServer()
    local.start()
    yield local
    local.stop()
