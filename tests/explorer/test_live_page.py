"""A running sensor in a real browser: it moves, is held, and is looked at again."""

import csv
import re
from collections.abc import Iterator

import pytest
from local_server import LocalServer
from pages import needs_browser, watched_page
from playwright.sync_api import Browser, Page, expect
from pressed_camera import simulated

from fringeforce.explorer.live import Source

# one worker starts the server and the browser
pytestmark = [needs_browser, pytest.mark.slow, pytest.mark.xdist_group("live page")]
TOGETHER = re.compile(r"Together \S+ N normal, \S+ N tangential")
SPELLED = re.compile(r"normal (-?[\d.]+), tangential")


@pytest.fixture(scope="module")
def watched() -> Iterator[LocalServer]:
    local = LocalServer(Source(simulated), warmed=False)
    local.start()
    yield local
    local.stop()


@pytest.fixture
def page(browser: Browser, watched: LocalServer) -> Iterator[Page]:
    with watched_page(browser, watched) as found:
        found.goto(watched.address)
        forces = found.locator("#watch-forces svg")
        expect(forces).to_have_attribute("aria-label", SPELLED)
        yield found


def normal_forces(page: Page) -> list[float]:
    """As the page tells them to a screen reader."""
    label = page.locator("#watch-forces svg").get_attribute("aria-label") or ""
    return [float(force) for force in SPELLED.findall(label)]


def moment(page: Page) -> float:
    return float(page.locator("#moment").inner_text().split()[0])


def forces_change(page: Page) -> None:
    before = normal_forces(page)
    page.wait_for_function(
        "before => document.querySelector('#watch-forces svg').ariaLabel !== before",
        arg=page.locator("#watch-forces svg").get_attribute("aria-label"),
    )
    assert len(normal_forces(page)) == len(before) == 11


def later(page: Page, seconds: float) -> None:
    """Wait until the page has kept so many seconds, shown or not."""
    page.wait_for_function("s => document.getElementById('scrub').max > s", arg=seconds)


def test_what_was_recorded_can_be_taken_away_as_a_table(page: Page) -> None:
    record = page.get_by_role("button", name="Record")
    record.click()
    expect(record).to_have_attribute("aria-pressed", "true")
    # a recording begins with what comes, which need not have come yet
    later(page, moment(page))
    expect(page.locator("#watch-total")).to_have_text(TOGETHER)
    with page.expect_download() as taken:
        page.get_by_role("button", name="Export CSV").click()
    with open(taken.value.path(), newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["tactel"] for row in rows[:11]] == [str(tactel) for tactel in range(1, 12)]
    assert len(rows) % 11 == 0
    read = [row for row in rows if row["status"] == "OK"]
    assert all(float(row["normal_std_N"]) > 0 for row in read)
    times = [float(row["time_s"]) for row in rows[::11]]
    assert times == sorted(set(times))


def test_forces_fringes_and_history_move_with_the_sensor(page: Page) -> None:
    forces_change(page)
    expect(page.locator("#design")).to_be_hidden()
    expect(page.locator("#watch-fringes canvas")).to_have_attribute(
        "aria-label", re.compile("Fringes")
    )
    expect(page.locator("#watch-normal canvas")).to_be_visible()
    expect(page.locator("#watch-title")).to_have_text("simulated touch, 1000 lines/s")
    expect(page.locator("#watch-counts")).to_have_text(re.compile(r"\d+ lines/s read, \d+ lines"))
    expect(page.locator("#watch-events li")).not_to_have_count(0)


def test_space_holds_the_picture_and_arrows_look_back(page: Page) -> None:
    later(page, moment(page) + 1)
    page.keyboard.press("Space")
    expect(page.locator("#pause")).to_have_text("Resume")
    # what came last before the key is painted in the next frame
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
    held, shown = moment(page), normal_forces(page)
    later(page, held + 1)
    assert moment(page) == held
    assert normal_forces(page) == shown
    page.keyboard.press("ArrowLeft")
    expect(page.locator("#moment")).not_to_have_text(re.compile(rf"^{held:.2f} s"))
    earlier = moment(page)
    assert earlier < held
    page.keyboard.press("ArrowRight")
    expect(page.locator("#moment")).to_have_text(re.compile(rf"^{held:.2f} s"))
    page.keyboard.press("Space")
    page.wait_for_function("held => parseFloat(moment.innerText) > held", arg=held + 1)


def test_the_slider_shows_an_earlier_time(page: Page) -> None:
    later(page, moment(page) + 2)
    page.locator("#scrub").press("Home")
    expect(page.locator("#pause")).to_have_text("Resume")
    least = float(page.locator("#scrub").get_attribute("min") or "nan")
    page.wait_for_function("least => parseFloat(moment.innerText) <= least + 0.01", arg=least)
    expect(page.locator("#moment")).to_have_text(re.compile("s back"))
    expect(page.locator("#scrub")).to_have_attribute("aria-valuetext", re.compile("s back"))


def test_the_friction_that_is_typed_decides_what_is_near_slip(page: Page) -> None:
    picture = page.locator("#watch-slip svg")
    page.locator("#friction").fill("0.1")
    expect(picture).to_have_attribute("aria-label", re.compile("0.1[0-9], near slip"))
    page.locator("#friction").fill("0.9")
    expect(picture).to_have_attribute("aria-label", re.compile(r"friction 0.9\. tactel 1: 0.1\d;"))


def test_the_design_is_one_button_away_and_the_camera_goes_on(page: Page) -> None:
    page.get_by_role("button", name="Live").click()
    expect(page.locator("#status")).to_have_text(re.compile("OK"))
    expect(page.locator("#watch")).to_be_hidden()
    page.get_by_role("button", name="Live").click()
    forces_change(page)


def test_on_a_narrow_screen_nothing_sticks_out(page: Page) -> None:
    page.set_viewport_size({"width": 400, "height": 800})
    forces_change(page)
    # plots follow the width a moment later
    page.wait_for_function("document.documentElement.scrollWidth <= innerWidth")
