"""The page of a pad in a real browser: press, drag, read."""

import re
from collections.abc import Iterator

import pytest
from local_server import LocalServer
from pages import (
    expect_accessible,
    expect_accessible_before_any_answer,
    expect_downloads,
    middle,
    needs_browser,
    sized_page,
    watched_page,
)
from playwright.sync_api import Browser, Locator, Page, expect
from small_pad import small_pad

# one worker starts the server and the browser
pytestmark = [needs_browser, pytest.mark.slow, pytest.mark.xdist_group("pad page")]


@pytest.fixture(scope="module")
def pad_server() -> Iterator[LocalServer]:
    local = LocalServer(sensor=small_pad())
    local.start()
    yield local
    local.stop()


@pytest.fixture
def page(browser: Browser, pad_server: LocalServer) -> Iterator[Page]:
    with watched_page(browser, pad_server) as found:
        yield found


def opened(page: Page, server: LocalServer, fragment: str = "") -> Page:
    page.goto(server.address + fragment)
    read(page)
    return page


def read(page: Page) -> None:
    """Wait until what is pressed now has been read."""
    page.wait_for_function(
        """() => document.getElementById('status').dataset.status
            && document.getElementById('behind').hidden"""
    )


def contact(page: Page, number: int) -> Locator:
    return page.get_by_role("slider", name=f"Contact {number}", exact=True)


def total(page: Page, column: int) -> tuple[float, float, float]:
    """Read, deviation and truth of all contacts together, as the table shows them."""
    text = page.locator("#sums tr").nth(1).locator("td").nth(column).inner_text()
    value, spread, truth = re.findall(r"[\d.]+", text.replace("\u2212", "-"))
    return float(value), float(spread), float(truth)


def test_a_press_shows_fringes_and_the_forces_follow(page: Page, pad_server: LocalServer) -> None:
    opened(page, pad_server, "#touch=none")
    expect(page.locator("#status")).to_have_text("NO CONTACT")
    canvas = page.locator("#pad canvas")
    dark = canvas.screenshot()
    box = canvas.bounding_box()
    assert box is not None
    x, y = box["x"] + 0.4 * box["width"], box["y"] + 0.55 * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 30, y, steps=4)
    page.mouse.up()
    expect(contact(page, 1)).to_have_attribute("aria-valuenow", "15.00")
    expect(contact(page, 1)).to_have_attribute("aria-valuetext", re.compile("towards 0 degrees"))
    sheared = page.locator("#sums tr").nth(1).locator("td").nth(1).locator("small")
    expect(sheared).not_to_have_text(re.compile(r"^0[.0]*$"))
    expect(page.locator("#status")).to_have_text("OK")
    read(page)
    assert canvas.screenshot() != dark
    value, spread, truth = total(page, 0)
    assert truth == pytest.approx(15, abs=spread)
    assert abs(value - truth) < 5 * spread
    value, spread, truth = total(page, 1)
    assert truth > 1
    assert abs(value - truth) < 5 * spread


def test_the_key_of_the_map_shows_a_disc_and_an_arrow_as_large_as_they_are_on_it(
    page: Page, pad_server: LocalServer
) -> None:
    opened(page, pad_server, "#touch=five")
    disc, arrow = (page.locator("#scale").get_by_role("img").nth(number) for number in (0, 1))
    expect(page.locator("#scale")).to_have_text(re.compile(r"^ [\d.]+ N\s+[\d.]+ N\."))
    places, across, shaft = (
        one.bounding_box() for one in (page.locator("#map canvas"), disc, arrow)
    )
    assert places
    assert across
    assert shaft
    sensor = small_pad()
    cell = sensor.tactels.pitch / sensor.transducer.length * places["width"]
    assert across["width"] == pytest.approx(cell, rel=0.02)
    assert 1.5 * cell <= shaft["width"] <= 1.5 * cell + 5  # with the head


def test_friction_holds_what_is_dragged(page: Page, pad_server: LocalServer) -> None:
    opened(page, pad_server, "#c=0,0,4,10,0,0,0&friction=0.5")
    box = contact(page, 1).locator(".patch").bounding_box()
    assert box is not None
    x, y = box["x"] + 0.25 * box["width"], box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y - 400, steps=4)
    page.mouse.up()
    expect(contact(page, 1)).to_have_attribute(
        "aria-valuetext", re.compile("shear 5.00 newtons towards 90 degrees")
    )
    page.get_by_label("Friction of all", exact=True).fill("0.2")
    page.get_by_label("Friction of all", exact=True).press("Enter")
    expect(contact(page, 1)).to_have_attribute("aria-valuetext", re.compile("shear 2.00 newtons"))


def test_a_contact_is_moved_by_its_dot_and_pressed_by_the_wheel(
    page: Page, pad_server: LocalServer
) -> None:
    opened(page, pad_server, "#c=0,0,4,10,0,0,0")
    x, y = middle(contact(page, 1).locator(".centre"))
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 40, y + 20, steps=3)
    page.mouse.up()
    words = contact(page, 1).get_attribute("aria-valuetext") or ""
    moved = re.search(r"x ([\d.]+), y (-[\d.]+) millimetres", words)
    assert moved is not None
    assert float(moved[1]) == pytest.approx(-2 * float(moved[2]), rel=0.2)
    page.mouse.wheel(0, -100)
    expect(contact(page, 1)).to_have_attribute("aria-valuenow", "10.50")


def test_the_keyboard_does_all_that_the_pointer_does(page: Page, pad_server: LocalServer) -> None:
    opened(page, pad_server, "#c=0,0,4,10,0,0,0")
    page.get_by_role("button", name="Add").click()
    contact(page, 2).focus()
    for key in ("ArrowRight", "ArrowUp", "ArrowUp", "+", "PageUp", "Shift+ArrowLeft"):
        page.keyboard.press(key)
    words = re.compile(
        "20.50 newtons at x 0.5, y 1.0 millimetres, .* shear 0.6. newtons towards 180 degrees"
    )
    expect(contact(page, 2)).to_have_attribute("aria-valuetext", words)
    page.keyboard.press("Delete")
    expect(contact(page, 2)).to_have_count(0)
    expect(contact(page, 1)).to_be_focused()
    page.keyboard.press("Control+z")
    expect(contact(page, 2)).to_have_attribute("aria-valuetext", words)


def test_a_bad_value_is_refused_beside_its_control_and_the_old_design_stays(
    page: Page, pad_server: LocalServer
) -> None:
    opened(page, pad_server)
    count = page.locator("[data-path='tactels.count']")
    expect(count).to_have_value("5 \u00d7 5")
    count.fill("9 x 9")
    count.press("Enter")
    expect(page.locator("#tactels-count-problem")).to_contain_text("beyond the pad's")
    expect(page.locator("[data-key=tactels]")).to_have_text("25")
    field = page.locator("[data-path='polariscope.wavelength']")
    page.get_by_role("button", name="Undo").click()
    field.fill("blue")
    field.press("Enter")
    expect(page.locator("#polariscope-wavelength-problem")).to_contain_text(
        "no light source of the table"
    )
    field.fill("450 nm")
    field.press("Enter")
    expect(page.locator("#polariscope-wavelength-problem")).to_be_hidden()
    expect(page.locator("#view option").nth(1)).to_have_text("Light of 450 nm")


def test_a_link_restores_contacts_view_and_design(
    page: Page, browser: Browser, pad_server: LocalServer
) -> None:
    opened(page, pad_server, "#touch=pinch&view=light&stress=shear&depth=4")
    contact(page, 1).press("PageUp")
    page.get_by_label("seen in").select_option("camera-0")
    field = page.locator("[data-path='camera.noise']")
    field.fill("3")
    field.press("Enter")
    read(page)
    page.wait_for_timeout(400)
    context = browser.new_context()
    other = context.new_page()
    other.goto(page.url)
    expect(contact(other, 1)).to_have_attribute("aria-valuenow", "20.00")
    expect(contact(other, 2)).to_have_attribute("aria-valuenow", "15.00")
    expect(other.get_by_label("seen in")).to_have_value("camera-0")
    expect(other.locator("[data-path='camera.noise']")).to_have_value("3")
    expect(other.get_by_role("button", name="2 \u03c4xy")).to_have_attribute("aria-pressed", "true")
    expect(other.get_by_label("Slice shown large")).to_have_value("5")
    context.close()


def test_files_can_be_taken_away(page: Page, pad_server: LocalServer) -> None:
    opened(page, pad_server)
    starts = {
        "design": b"kind", "model": b"\x89HDF", "png": b"\x89PNG",
        "forces": b"frame,tactel", "reading": b"frame,tactel",
    }  # fmt: skip
    expect_downloads(page, starts)


def test_every_preset_is_read(page: Page, pad_server: LocalServer) -> None:
    opened(page, pad_server)
    for name, count in {"Pinch": 2, "Five fingers": 5, "Edge": 6, "Twist": 1, "Nothing": 0}.items():
        button = page.get_by_role("button", name=name)
        button.click()
        expect(button).to_have_attribute("aria-pressed", "true")
        expect(page.locator(".contact")).to_have_count(count)
        read(page)
        expect(page.locator("#sums tr")).to_have_count(2 + count)
        expect(page.locator("#status")).to_have_text("OK" if count else "NO CONTACT")


def test_a_skin_is_pressed_by_spheres(page: Page, pad_server: LocalServer) -> None:
    page.goto(f"{pad_server.address}#start=fingertip&c=1.6,-1,4,1,0.2,0,0")
    read(page)
    expect(page.locator("#status")).to_have_text("OK")
    expect(page.locator("#sums tr")).to_have_count(3)
    force = page.locator("#sums tr").nth(2).locator("td span").first
    expect(force).to_have_text(re.compile("(1[.]00|0[.]99)"))
    expect(page.locator("label[for=contact-radius]")).to_contain_text("of the fingertip")
    expect(page.locator("#contact-twist")).to_be_hidden()
    expect(page.locator("[data-path='tactels.pitch']")).to_be_hidden()
    expect_accessible(page)


def test_presets_press_a_soft_pad_gently(page: Page, pad_server: LocalServer) -> None:
    page.goto(f"{pad_server.address}#start=fingertip")
    read(page)
    expect(page.locator("#status")).to_have_text("OK")
    _, _, acts = total(page, 0)
    assert acts == pytest.approx(4.0)  # a fifth of what presses stiff pads


@pytest.mark.parametrize(("scheme", "width"), [("light", 1400), ("light", 1280), ("dark", 390)])
def test_axe_finds_nothing_serious_and_nothing_overflows(
    browser: Browser, pad_server: LocalServer, scheme: str, width: int
) -> None:
    with sized_page(browser, scheme, width) as page:
        expect_accessible(opened(page, pad_server, "#touch=five&stress=size"))
        table = page.locator("#sums")
        assert table.evaluate("(region) => region.scrollWidth <= region.clientWidth")


def test_all_pictures_have_names_before_anything_is_known(
    page: Page, pad_server: LocalServer
) -> None:
    expect_accessible_before_any_answer(page, pad_server)
