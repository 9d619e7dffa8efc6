"""Basler's own emulated camera, where pypylon is installed."""

import numpy as np
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


def test_images_are_sampled_along_the_strip_of_a_region(sensor: ff.Sensor) -> None:
    region = ff.Region([(20, 30), (619, 30), (619, 69), (20, 69)], size=(640, 96))
    model = ff.characterize(sensor.replace(**{"camera.pixels": 300}))
    with ff.open_camera("pylon:", model, Settings(line_rate=30), region) as camera:
        blocks = [block for block, _ in zip(camera, range(3), strict=False)]
    assert {block.lines.shape for block in blocks} == {(1, 300)}
    # the emulated camera shows a ramp along its rows, of one level a pixel up to 255
    steps = np.diff(blocks[0].lines[0].astype(float))
    assert np.median(steps) == pytest.approx(2.0)
