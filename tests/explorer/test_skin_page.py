"""The page of a skin in a real browser: press anywhere, drag, read."""

import re
from collections.abc import Iterator

import pytest
from local_server import LocalServer
from pages import (
    expect_accessible,
    expect_accessible_before_any_answer,
    expect_downloads,
    needs_browser,
    sized_page,
    watched_page,
)
from playwright.sync_api import Browser, Page, expect

from fringeforce.design.files import load_sensor

pytestmark = [needs_browser, pytest.mark.slow]

ONE = "#f=-2.1,6,2.5,0.9"


@pytest.fixture(scope="module")
def skin_server() -> Iterator[LocalServer]:
    local = LocalServer(sensor=load_sensor("skin"))
    local.start()
    yield local
    local.stop()


@pytest.fixture
def page(browser: Browser, skin_server: LocalServer) -> Iterator[Page]:
    with watched_page(browser, skin_server) as found:
        yield found


def opened(page: Page, server: LocalServer, fragment: str = "") -> Page:
    page.goto(server.address + fragment)
    page.wait_for_selector("#status[data-status=OK]")
    return page


def contacts(page: Page, count: int) -> list[list[str]]:
    """Texts of the cells of so many contacts, once they are there."""
    rows = page.locator("#sums tr")
    expect(rows).to_have_count(count + 2)
    return [rows.nth(2 + k).locator("td span").all_inner_texts() for k in range(count)]


def number(text: str) -> float:
    return float(text.split(" ")[0].replace("\N{MINUS SIGN}", "-"))


def test_a_press_beside_a_finger_is_a_second_contact(page: Page, skin_server: LocalServer) -> None:
    opened(page, skin_server, ONE)
    (first,) = contacts(page, 1)
    assert number(first[2]) == pytest.approx(2.5, abs=0.05)
    box = page.locator("#strip svg").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 0.62 * box["width"], box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.62 * box["width"], box["y"] + 45, steps=4)
    page.mouse.up()
    expect(page.locator("#strip [data-finger]")).to_have_count(2)
    # 25 pixels down are half a newton more than it begins with; readings come while it is drawn
    assert page.locator("#finger-normal").input_value() == "2"
    force = page.locator("#sums tr").nth(3).locator("td span").nth(2)
    expect(force).to_have_text(re.compile("(1[.]9[5-9]|2[.]0[0-4])"))
    second = contacts(page, 2)[1]
    assert number(second[2]) == pytest.approx(2.0, abs=0.05)
    place = float(page.locator("#finger-x").input_value())
    assert 1 < place < 5
    assert number(second[0]) == pytest.approx(place, abs=0.05)
    page.locator("#undo").click()
    expect(page.locator("#strip [data-finger]")).to_have_count(1)
    contacts(page, 1)


def test_keys_move_press_shear_and_remove(page: Page, skin_server: LocalServer) -> None:
    opened(page, skin_server, ONE)
    finger = page.locator("#strip [data-finger='0']")
    finger.focus()
    for key in ("ArrowRight", "+", "Shift+ArrowLeft"):
        page.keyboard.press(key)
    expect(page.locator("#finger-x")).to_have_value("-2")
    expect(page.locator("#finger-normal")).to_have_value("2.6")
    expect(page.locator("#finger-tangential")).to_have_value("0.84")
    expect(finger).to_be_focused()
    page.keyboard.press("Delete")
    expect(page.locator("#status")).to_have_text("NO CONTACT")


def test_a_link_restores_the_fingers(page: Page, skin_server: LocalServer) -> None:
    opened(page, skin_server, "#f=1,3,1.5,0;4,2,0.7,0.1")
    page.locator("#finger-radius").fill("5")
    page.locator("#finger-radius").press("Enter")
    page.wait_for_url(re.compile("f=1%2C5%2C1.5%2C0%3B4"))
    page.reload()
    expect(page.locator("#finger-radius")).to_have_value("5")


def test_a_design_that_cannot_be_is_told_beside_its_control(
    page: Page, skin_server: LocalServer
) -> None:
    opened(page, skin_server, ONE)
    extent = page.locator("#skin-extent")
    extent.fill("-3 mm")
    extent.press("Enter")
    expect(page.locator("#skin-extent-problem")).to_contain_text("greater than 0")
    extent.fill("10 mm")
    extent.press("Enter")
    expect(page.locator("#skin-extent-problem")).to_be_hidden()


def test_finite_strain_stands_beside_the_linear_one(page: Page, skin_server: LocalServer) -> None:
    opened(page, skin_server, ONE)
    expect(page.locator("#finite")).to_be_hidden()
    page.locator("[data-strain=finite]").click()
    note = page.locator("#strain-note")
    expect(note).to_contain_text("of its peak")
    expect(page.locator("#finite-fringes canvas")).to_have_count(2)
    before = note.inner_text()
    page.locator("#finger-normal").fill("4")
    page.locator("#finger-normal").press("Enter")
    expect(note).not_to_have_text(before)
    page.wait_for_url(re.compile("finite=1"))
    page.locator("[data-strain=linear]").click()
    expect(page.locator("#finite")).to_be_hidden()


def test_files_can_be_taken_away(page: Page, skin_server: LocalServer) -> None:
    opened(page, skin_server, ONE)
    expect_downloads(page, {"design": b"name", "reading": b"frame,contact", "png": b"\x89PNG"})


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 400)])
def test_anybody_can_use_it(
    browser: Browser, skin_server: LocalServer, scheme: str, width: int
) -> None:
    with sized_page(browser, scheme, width) as page:
        opened(page, skin_server, f"{ONE}&finite=1")
        expect(page.locator("#finite")).to_be_visible()
        expect_accessible(page)


def test_what_is_not_there_yet_has_a_name(page: Page, skin_server: LocalServer) -> None:
    expect_accessible_before_any_answer(page, skin_server)
