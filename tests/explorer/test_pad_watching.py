"""A running pad as a page hears of it, and as a browser shows it."""

import colorsys
import math
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from local_server import LocalServer, unwarmed
from pages import expect_accessible, needs_browser, watched_page
from playwright.sync_api import Browser, expect
from small_pad import small_pad
from starlette.testclient import TestClient

from fringeforce.acquisition.cameras.camera import Settings
from fringeforce.acquisition.cameras.simulator import SimulatedCamera
from fringeforce.contacts.fingertip import fingertip_forces
from fringeforce.explorer.live import Source
from fringeforce.explorer.pads.solution import solved
from fringeforce.explorer.protocol import decoded, encoded
from fringeforce.explorer.server import application
from fringeforce.explorer.session import FirstDesign
from fringeforce.models.pad import PadModel

pytestmark = pytest.mark.slow

TOKEN = "t" * 32
HOST = "http://127.0.0.1:8000"
Message = tuple[dict[str, Any], dict[str, np.ndarray]]


def simulated(model: PadModel) -> SimulatedCamera:
    """A finger that slides: from the third second of its touch to the fourth, for ever."""
    places = model.sensor.tactels.places

    def sliding(times: np.ndarray) -> np.ndarray:
        return fingertip_forces(3 + np.minimum(times, 2 - times), places)

    return SimulatedCamera(model, Settings(20), script=sliding, period=2.0)


@contextmanager
def looking(client: TestClient) -> Iterator[Any]:
    address = f"ws://127.0.0.1:8000/{TOKEN}/socket"
    with client.websocket_connect(address, headers={"Origin": HOST}) as socket:
        assert decoded(socket.receive_bytes())[0]["camera"]

        def look(number: int) -> Message:
            socket.send_bytes(encoded({"type": "live", "id": number}))
            return decoded(socket.receive_bytes())

        yield look


def polarised(i0: float, i45: float, i135: float, i90: float) -> np.ndarray:
    """Colour of the grey levels behind four analysers, of 255: direction as hue, degree, mean."""
    stokes = (i0 + i45 + i90 + i135) / 2, i0 - i90, i45 - i135
    direction = math.degrees(math.atan2(stokes[2], stokes[1])) / 2 % 180
    degree = min(math.hypot(*stokes[1:]) / stokes[0], 1)
    return 255 * np.array(colorsys.hsv_to_rgb(direction / 180, degree, min(stokes[0] / 255, 1)))


def test_a_page_sees_the_pad_as_it_is() -> None:
    camera = simulated(solved(small_pad()))
    app = application(FirstDesign(small_pad()), TOKEN, camera=Source(simulated))
    found: list[Message] = []
    with unwarmed(), TestClient(app, base_url=HOST) as client, looking(client) as look:
        deadline, count = time.monotonic() + 100, 0
        while len(found) < 8 and time.monotonic() < deadline:
            count += 1
            message = look(count)
            assert not message[0]["ended"], message[0]["ended"]
            found += [message] if message[1] else []
    assert len(found) == 8
    for header, blocks in found:
        number = header["line"] % len(camera.lines)
        assert header["shape"] == [48, 48, 3]
        shown = blocks["image"].reshape(48, 48, 3)
        for row, column in ((10, 10), (24, 24), (30, 17)):
            four = camera.lines[number][2 * row :, 2 * column :][:2, :2].astype(float)
            assert np.abs(shown[row, column] - polarised(*four.ravel())).max() <= 1
        truth = camera.forces[number]
        assert header["status"] == "OK"
        assert (np.abs(blocks["forces"].reshape(-1, 3) - truth) < 6 * blocks["std"]).all()
        total = blocks["forces"].reshape(-1, 3).sum(axis=0)
        np.testing.assert_allclose(blocks["sums"][:3], total, atol=1e-4)
    assert found[-1][0]["counted"] == "images"
    lines = [header["line"] for header, _ in found]
    assert lines == sorted(set(lines))


@pytest.fixture
def watched() -> Iterator[LocalServer]:
    local = LocalServer(Source(simulated), small_pad(), warmed=False)
    local.start()
    yield local
    local.stop()


@needs_browser
def test_a_browser_shows_images_forces_and_sums_as_they_come(
    browser: Browser, watched: LocalServer
) -> None:
    with watched_page(browser, watched) as page:
        page.goto(watched.address)
        expect(page.locator("#watch-status")).to_have_text("OK")
        expect(page.locator("#watch-title")).to_have_text("simulated touch, 20 images/s")
        expect(page.locator("#watch-counts")).to_have_text(re.compile(r"\d images/s read, \d+"))
        expect(page.locator("#design")).to_be_hidden()
        normal = page.locator("#watch-sums dd").first
        shown, image = normal.inner_text(), page.locator("#watch-image canvas").screenshot()
        assert 4 < float(shown) < 6
        expect(normal).not_to_have_text(shown)
        assert page.locator("#watch-image canvas").screenshot() != image
        page.keyboard.press("Space")
        expect(page.locator("#pause")).to_have_text("Resume")
        expect_accessible(page)
        page.set_viewport_size({"width": 400, "height": 800})
        page.wait_for_function("() => document.documentElement.scrollWidth <= innerWidth")
        page.get_by_role("button", name="Live").click()
        expect(page.locator("#pad")).to_be_visible()
