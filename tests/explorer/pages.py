"""A page of the explorer in a browser, watched for what it should not do."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from local_server import CHROMIUM, LocalServer
from playwright.sync_api import Browser, BrowserContext, Locator, Page, ViewportSize, expect

needs_browser = pytest.mark.skipif(
    CHROMIUM is None, reason="needs a browser; on Debian: apt-get install chromium-headless-shell"
)
WAIT = 180_000
"""Until whatever is expected of a page [ms].

A new machine compiles loops for the first reading, and the process that leaves the processor to
others was seen to take more than 30 s over an answer of 2 s beside four workers on two cores.
"""
expect.set_options(timeout=WAIT)
DESKTOP: ViewportSize = {"width": 1280, "height": 900}


@contextmanager
def watched_page(browser: Browser, server: LocalServer) -> Iterator[Page]:
    """A page that writes nothing to the console, and asks no other machine for anything."""
    complaints: list[str] = []

    def foreign(url: str) -> None:
        if not url.startswith((server.address, "data:", "blob:")):
            complaints.append(url)

    with sized_page(browser, "light", DESKTOP["width"]) as page:
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("request", lambda request: foreign(request.url))
        yield page
    assert not complaints, complaints


@contextmanager
def sized_page(browser: Browser, scheme: Any, width: int) -> Iterator[Page]:
    """A page of a width, in light or dark colours."""
    page = _visitor(browser).new_page()
    if width != DESKTOP["width"]:
        page.set_viewport_size({"width": width, "height": DESKTOP["height"]})
    if scheme != "light":
        page.emulate_media(color_scheme=scheme)
    yield page
    if page.url.startswith("http"):
        page.evaluate("localStorage.clear()")
    page.close()


def _visitor(browser: Browser) -> BrowserContext:
    """Who opens all pages, one after the other: a new visitor costs as much as a test.

    A page that stays open keeps the process alive in which the others are shown.
    """
    if not browser.contexts:
        context = browser.new_context(viewport=DESKTOP, accept_downloads=True)
        context.set_default_timeout(WAIT)
        context.new_page()
    return browser.contexts[0]


def expect_accessible(page: Page) -> None:
    """Axe finds nothing serious, and nothing is wider than the page."""
    grave = [
        (rule["id"], rule["nodes"][0]["html"][:200], rule["nodes"][0]["failureSummary"])
        for rule in Axe().run(page).response["violations"]
        if rule["impact"] in ("serious", "critical")
    ]
    assert not grave, grave
    assert page.evaluate("() => document.documentElement.scrollWidth <= window.innerWidth")


def expect_accessible_when_widened(page: Page, width: int) -> None:
    """Nothing is found at the width at which the page was loaded, nor at a larger one."""
    expect_accessible(page)
    page.set_viewport_size({"width": width, "height": DESKTOP["height"]})
    # pictures are painted anew in the next frame
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
    expect_accessible(page)


def expect_accessible_before_any_answer(page: Page, server: LocalServer) -> None:
    """Whoever comes before the first answer finds a page that names all that it will show."""
    page.route_web_socket(re.compile("/socket$"), lambda _: None)
    page.goto(server.address)
    expect(page.locator("canvas").first).to_be_attached()
    expect_accessible(page)


def expect_downloads(page: Page, starts: dict[str, bytes]) -> None:
    """Files to take away begin as files of their kind do."""
    for kind, start in starts.items():
        page.locator("#download summary").click()
        with page.expect_download() as download:
            page.locator(f"[data-file={kind}]").click()
        assert download.value.path().read_bytes().startswith(start)


def middle(target: Locator) -> tuple[float, float]:
    """Of an element on the screen."""
    box = target.bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
