"""Basler's own emulated camera, where pypylon is installed."""

import pytest

import fringeforce as ff
from fringeforce.acquisition.cameras.camera import Settings
from fringeforce.base.errors import CameraLost

# its compiled types warn when they are made, and crash where a warning is an error
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")


@pytest.fixture(autouse=True)
def _emulated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYLON_CAMEMU", "1")
    pytest.importorskip("pypylon", reason="pypylon is proprietary and large: an extra only")


def test_blocks_come_in_order_at_the_rate_that_is_set(model: ff.SensorModel) -> None:
    settings = Settings(line_rate=3200, exposure=1e-4, block=32)
    with ff.open_camera("pylon:", model, settings) as camera:
        blocks = [block for block, _ in zip(camera, range(5), strict=False)]
    assert {block.lines.shape for block in blocks} == {(32, 2048)}
    assert {block.lines.dtype.name for block in blocks} == {"uint8"}
    first = 0
    for block in blocks:
        assert block.first == first + block.dropped
        first = block.first + 32


def test_a_serial_number_that_nobody_has_is_said_to_be_missing(model: ff.SensorModel) -> None:
    with (
        pytest.raises(CameraLost, match="does not answer"),
        ff.open_camera("pylon:12345678", model),
    ):
        pass
