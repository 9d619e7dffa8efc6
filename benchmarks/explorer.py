"""How the explorer's page feels: time to the first picture, dragging, design changes, bundle.

Runs Debian's chromium without a screen, on this machine.  Input-to-paint is from the time stamp of
a pointer's movement to the first moment after the frame that shows it; a painted frame is an
animation frame in which the page drew the fringes anew.  Live, it is one that shows another moment
of a simulated camera under a load that is read without a search.  On the pad, whose pictures come
from the server, a movement is shown by the first picture that was asked for after it.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import random
import shutil
import socket
import statistics
import time
from collections.abc import AsyncIterator, Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess

import numpy as np
from playwright.async_api import Browser, Locator, Page, ViewportSize, async_playwright

from fringeforce.acquisition.cameras.camera import Settings
from fringeforce.acquisition.cameras.simulator import SimulatedCamera
from fringeforce.base.child_process import end_with_parent
from fringeforce.contacts.loads import polar
from fringeforce.design.files import load_sensor
from fringeforce.explorer.live import Source
from fringeforce.explorer.server import STATIC, serve
from fringeforce.explorer.session import FirstDesign
from fringeforce.models.strip import SensorModel

FLAGS = [
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update",
]  # fmt: skip
TOKEN = "benchmark"
ARROW = "Tactel 6, normal force"
SECONDS, ACTIONS = 6.0, 200
PATIENCE = 180_000
"""Until the first reading, for which a new machine compiles the reader's loops [ms]."""
VIEWPORT: ViewportSize = {"width": 1440, "height": 1000}
Row = tuple[str, str, str]
Rows = Callable[[Browser, str], AsyncIterator[Row]]
WATCH = """() => {
  window.seen = { moved: [], delays: [], paints: 0 };
  const text = document.getElementById('fringe-count');
  const channel = new MessageChannel();
  channel.port1.onmessage = () => {
    const now = performance.now();
    for (const stamp of seen.moved.splice(0)) seen.delays.push(now - stamp);
  };
  addEventListener('pointermove', (event) => seen.moved.push(event.timeStamp), true);
  new MutationObserver(() => {
    seen.paints += 1;
    requestAnimationFrame(() => channel.port2.postMessage(0));
  }).observe(text, { childList: true, characterData: true, subtree: true });
}"""
LIVE = """(seconds) => new Promise((resolve) => {
  const [shown, counts] = ['moment', 'watch-counts'].map((id) => document.getElementById(id));
  const start = performance.now();
  let paints = 0;
  const observer = new MutationObserver(() => { paints += 1; });
  observer.observe(shown, { childList: true, characterData: true, subtree: true });
  setTimeout(() => {
    observer.disconnect();
    resolve([paints / (performance.now() - start) * 1000, counts.textContent]);
  }, 1000 * seconds);
})"""


ASKED = """() => {
  window.asked = {};
  const send = WebSocket.prototype.send;
  WebSocket.prototype.send = function (frame) {
    const header = JSON.parse(new TextDecoder().decode(frame.subarray(4)));
    if (header.type === 'press') asked[header.id] = performance.now();
    send.call(this, frame);
  };
}"""
WATCH_PAD = """() => {
  window.seen = { moved: [], delays: [], paints: 0 };
  const channel = new MessageChannel();
  channel.port1.onmessage = ({ data }) => {
    const now = performance.now();
    const shown = seen.moved.filter((stamp) => stamp <= asked[data]);
    seen.moved = seen.moved.filter((stamp) => stamp > asked[data]);
    seen.delays.push(...shown.map((stamp) => now - stamp));
  };
  let last = '';
  addEventListener('pointermove', (event) => seen.moved.push(event.timeStamp), true);
  new MutationObserver(() => {
    const { painted } = document.body.dataset;
    if (painted === last) return;
    last = painted;
    seen.paints += 1;
    requestAnimationFrame(() => channel.port2.postMessage(painted));
  }).observe(document.body, { attributeFilter: ['data-painted'] });
}"""


def _pressed(times: np.ndarray) -> np.ndarray:
    size = 1 + 0.1 * np.sin(np.pi * times)
    return size[:, None, None] * polar(1.0, 10, n=11)


def _serve(port: int, ready: Connection, design: str) -> None:
    def simulated(model: SensorModel) -> SimulatedCamera:
        return SimulatedCamera(model, Settings(1000, None, 16), script=_pressed)

    end_with_parent()
    camera = Source(simulated) if design == "saad" else None
    serve(FirstDesign(load_sensor(design)), TOKEN, "127.0.0.1", port, ready.send, camera)


async def watch(page: Page) -> tuple[float, str]:
    """Painted frames per second while the camera runs, and what the page says of the camera."""
    shown = "() => document.getElementById('moment').textContent !== ''"
    await page.wait_for_function(shown, timeout=PATIENCE)
    await page.wait_for_timeout(2000)
    return await page.evaluate(LIVE, SECONDS)


async def drag(page: Page, handle: Locator) -> tuple[float, float, float]:
    """Frames per second, median and 95th percentile of input-to-paint [ms] of one long drag."""
    await page.evaluate("() => { seen.moved = []; seen.delays = []; seen.paints = 0; }")
    box = await handle.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    await page.mouse.move(x, y)
    await page.mouse.down()
    start, step, moves = time.perf_counter(), 0, []
    while time.perf_counter() - start < SECONDS:
        # a mouse does not wait for the picture, so neither do these movements
        step += 1
        across, up = 12 * ((step % 40) / 20 - 1), 30 * ((step % 68) / 34 - 1)
        moves.append(asyncio.ensure_future(page.mouse.move(x + across, y - up)))
        await asyncio.sleep(1 / 100)
    await asyncio.gather(*moves)
    elapsed = time.perf_counter() - start
    await page.mouse.up()
    seen = await page.evaluate("() => seen")
    delays = sorted(seen["delays"])
    return seen["paints"] / elapsed, statistics.median(delays), delays[int(0.95 * len(delays))]


async def design_changes(page: Page) -> tuple[float, float]:
    """Median and longest time from a typed thickness to new fringes [ms]."""
    times = []
    for k in range(7):
        times.append(
            await page.evaluate(
                """(value) => new Promise((resolve) => {
                  const text = document.getElementById('fringe-count');
                  const field = document.querySelector(
                    '[data-path="transducer.compliant.thickness"]');
                  const start = performance.now();
                  new MutationObserver((_, observer) => {
                    observer.disconnect();
                    requestAnimationFrame(() => resolve(performance.now() - start));
                  }).observe(text, { childList: true, characterData: true, subtree: true });
                  field.value = value;
                  field.dispatchEvent(new Event('change'));
                })""",
                f"{0.3 + 0.05 * k:.2f} mm",
            )
        )
        await page.wait_for_timeout(400)
    return statistics.median(times), max(times)


async def wander(page: Page) -> None:
    """Random actions of an impatient person."""
    chance = random.Random(1)
    buttons = ["#presets button", "#components button", "#edges", "#noise", "#theme", "#undo"]
    texts = ["0.4 mm", "-3 mm", "apples", "12", "900 um", "1e99 m", "0.49"]
    for _ in range(ACTIONS):
        act = chance.random()
        if act < 0.5:
            found = page.locator(chance.choice(buttons))
            button = found.nth(chance.randrange(await found.count()))
            if await button.is_enabled():
                await button.click()
        elif act < 0.75:
            sliders = page.get_by_role("slider", name="Tactel")
            key = chance.choice(["ArrowUp", "PageUp", "PageDown", "End", "Home"])
            await sliders.nth(chance.randrange(await sliders.count())).press(key)
        else:
            fields = page.locator("#design input[type=text]")
            field = fields.nth(chance.randrange(await fields.count()))
            if await field.is_visible():
                await field.fill(chance.choice(texts))
                await field.press("Enter")
    await page.wait_for_timeout(1500)


async def pad(browser: Browser, address: str) -> AsyncIterator[Row]:
    """Rows of the pad's page."""
    page = await browser.new_page(viewport=VIEWPORT)
    await page.add_init_script(f"({ASKED})()")
    start = time.perf_counter()
    await page.goto(address)
    await page.wait_for_selector("body[data-painted]:not([data-painted=''])")
    yield "first picture", f"{time.perf_counter() - start:.2f} s", "2 s"
    await page.locator("#status[data-status=OK]").wait_for(timeout=PATIENCE)
    await page.evaluate(WATCH_PAD)
    for view in ("white", "light", "camera-0"):
        await page.get_by_label("seen in").select_option(view)
        await page.wait_for_timeout(3000)
        rate, median, late = await drag(page, page.locator(".centre"))
        yield f"painted frames per second, dragging, {view}", f"{rate:.0f}", "30"
        yield f"input to paint, median (95 %), {view}", f"{median:.0f} ({late:.0f}) ms", "50 ms"
    start = time.perf_counter()
    await page.get_by_role("button", name="Five fingers").click()
    await page.locator("#behind").wait_for(state="visible")
    await page.locator("#behind").wait_for(state="hidden", timeout=PATIENCE)
    yield "five new fingers read", f"{time.perf_counter() - start:.1f} s", ""


def started(design: str) -> tuple[BaseProcess, str, float]:
    """A server's process, its address, and how long it took to be ready [s]."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    context = multiprocessing.get_context("spawn")
    told, tell = context.Pipe(duplex=False)
    start = time.perf_counter()
    server = context.Process(target=_serve, args=(port, tell, design))
    server.start()
    return server, told.recv(), time.perf_counter() - start


async def strip(browser: Browser, address: str) -> AsyncIterator[Row]:
    """Rows of the strip's page."""
    errors: list[str] = []
    foreign: list[str] = []
    own = address, "data:", "blob:"
    page = await browser.new_page(viewport=VIEWPORT)
    page.on("console", lambda message: errors.append(message.text))
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("request", lambda r: None if r.url.startswith(own) else foreign.append(r.url))
    start = time.perf_counter()
    await page.goto(address)
    await page.get_by_role("button", name="Live").click()
    await page.wait_for_selector("#fringes canvas[aria-label^=Fringes]")
    yield "first picture", f"{time.perf_counter() - start:.2f} s", "2 s"
    await page.locator("#status[data-status=OK]").wait_for(timeout=PATIENCE)
    await page.evaluate(WATCH)
    for _ in range(2):
        rate, median, late = await drag(page, page.get_by_role("slider", name=ARROW))
        yield "painted frames per second, dragging", f"{rate:.0f}", "30"
        yield "input to paint, median (95 %)", f"{median:.0f} ({late:.0f}) ms", "50 ms"
    median, late = await design_changes(page)
    yield "thickness to new fringes, median (largest)", f"{median:.0f} ({late:.0f}) ms", "300 ms"
    await page.get_by_role("button", name="Live").click()
    shown, counts = await watch(page)
    yield "painted frames per second, live", f"{shown:.0f}", "20"
    yield f"live: {counts}", "", ""
    await page.get_by_role("button", name="Live").click()
    await wander(page)
    yield f"console messages in {ACTIONS} random actions", f"{len(errors)}", "0"
    yield "requests to other machines", f"{len(foreign)}", "0"
    print(*sorted({*errors, *foreign})[:5], sep="\n", end="")


async def measured(browser: Browser, design: str, rows: Rows) -> AsyncIterator[Row]:
    """Rows of a design's page, on a server of its own."""
    server, address, ready = started(design)
    try:
        yield f"{design}: server ready", f"{ready:.1f} s", ""
        async for name, value, wanted in rows(browser, address):
            yield f"{design}: {name}", value, wanted
    finally:
        server.terminate()


def tell(name: str, value: str, wanted: str) -> None:
    """Print what was measured and what is wanted, and the load average of this machine."""
    row = value, wanted, f"load {os.getloadavg()[0]:.1f}"
    print(f"{name:70}", *(f"{text:>14}" for text in row), flush=True)


async def main() -> None:
    async with async_playwright() as playwright:
        chromium = shutil.which("chromium")
        browser = await playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        for design, rows in (("saad", strip), ("pad", pad)):
            async for name, value, wanted in measured(browser, design, rows):
                tell(name, value, wanted)
        await browser.close()
    size = sum(path.stat().st_size for path in STATIC.iterdir())
    tell("bundle", f"{size / 1e3:.0f} kB", "200 kB")


if __name__ == "__main__":
    asyncio.run(main())
