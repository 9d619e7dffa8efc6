"""The page in a real browser: what a person does, and what follows."""

import re
from collections.abc import Iterator

import numpy as np
import pytest
from local_server import LocalServer
from pages import (
    expect_accessible_before_any_answer,
    expect_accessible_when_widened,
    expect_downloads,
    middle,
    needs_browser,
    sized_page,
    watched_page,
)
from playwright.sync_api import Browser, Locator, Page, expect

import fringeforce as ff

# one worker starts the server and the browser
pytestmark = [needs_browser, pytest.mark.slow, pytest.mark.xdist_group("page")]


@pytest.fixture
def page(browser: Browser, server: LocalServer) -> Iterator[Page]:
    with watched_page(browser, server) as found:
        yield found


def opened(page: Page, server: LocalServer, fragment: str = "") -> Page:
    page.goto(server.address + fragment)
    expect(page.locator("#status")).to_have_text(re.compile("[A-Z]{2}"))
    return page


def arrow(page: Page, tactel: int, direction: str = "normal") -> Locator:
    return page.get_by_role("slider", name=f"Tactel {tactel}, {direction} force")


def force(page: Page, tactel: int, direction: str = "normal") -> float:
    return float(arrow(page, tactel, direction).get_attribute("aria-valuenow") or "nan")


def expect_force(page: Page, tactel: int, newtons: str, direction: str = "normal") -> None:
    expect(arrow(page, tactel, direction)).to_have_attribute("aria-valuenow", newtons)


def read_forces(page: Page) -> np.ndarray:
    """Forces read, as the page tells them to a screen reader, shape (n, 2)."""
    label = page.locator(".readings").get_attribute("aria-label") or ""
    pairs = re.findall(r"normal (-?[\d.]+) of \S+, tangential (-?[\d.]+) of", label)
    return np.array(pairs, dtype=float)


def settled(page: Page, tactel: int, value: float) -> None:
    """Wait until the reading of a tactel has come near a value."""
    for _ in range(200):
        if abs(read_forces(page)[tactel - 1, 0] - value) < 0.15:
            return
        page.wait_for_timeout(50)
    raise AssertionError(f"tactel {tactel} reads {read_forces(page)[tactel - 1, 0]}, not {value}")


def fringes(page: Page) -> str:
    return page.locator("#fringe-count").inner_text()


def peak(page: Page) -> str:
    return page.locator("[data-key=peak]").inner_text()


def test_finite_strain_stands_beside_the_linear_one(page: Page, server: LocalServer) -> None:
    opened(page, server, "#load=paper&mesh=1")
    canvas = page.locator("#stress canvas").first
    before = canvas.evaluate("(canvas) => canvas.toDataURL()")
    page.locator("[data-strain=finite]").click()
    note = page.locator("#strain-note")
    # the process that solves leaves the processor to others, of which tests have many
    expect(note).to_contain_text("of its peak")
    expect(note).to_contain_text("0.50 mm wide")
    # the mesh moves by finite strain
    page.wait_for_function(
        "([canvas, before]) => canvas.toDataURL() !== before", arg=[canvas.element_handle(), before]
    )
    page.locator("[data-preset=none]").click()
    expect(note).to_contain_text("by 0.000 rad")


def test_dragging_an_arrow_moves_phase_fringes_and_forces_read(
    page: Page, server: LocalServer, model: ff.SensorModel
) -> None:
    opened(page, server, "#load=single")
    before = fringes(page)
    canvas = page.locator("#fringes canvas")
    picture = canvas.screenshot()
    x, y = middle(arrow(page, 6).locator(".dot"))
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 10, y - 20, steps=5)
    page.mouse.up()
    pushed, dragged = force(page, 6), force(page, 6, "tangential")
    assert pushed > 1.2
    assert dragged > 0.05
    expect(page.locator("#fringe-count")).not_to_have_text(before)
    assert canvas.screenshot() != picture
    settled(page, 6, pushed)
    forces = np.zeros((11, 2))
    forces[5] = pushed, dragged
    phase = model.phase(forces)
    low, high = re.findall(r"from (\S+) to (\S+) rad", fringes(page))[0]
    shown = [float(text.replace("\u2212", "-")) for text in (low, high)]
    np.testing.assert_allclose(shown, [phase.min(), phase.max()], atol=0.006)


def test_an_arrow_is_a_slider_for_the_keyboard(page: Page, server: LocalServer) -> None:
    opened(page, server, "#load=none")
    arrow(page, 3).focus()
    page.keyboard.press("PageUp")
    page.keyboard.press("ArrowUp")
    expect_force(page, 3, "0.55")
    arrow(page, 3, "tangential").focus()
    page.keyboard.press("ArrowLeft")
    expect_force(page, 3, "-0.05", "tangential")
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+z")
    expect_force(page, 3, "0.50")
    expect_force(page, 3, "0.00", "tangential")
    settled(page, 3, 0.5)


def test_another_thickness_shows_the_library_s_numbers(
    page: Page, server: LocalServer, sensor: ff.Sensor
) -> None:
    opened(page, server)
    field = page.locator("[data-path='transducer.compliant.thickness']")
    field.fill("300 um")
    field.press("Enter")
    thin = ff.characterize(sensor.replace(**{"transducer.compliant.thickness": "0.3 mm"}))
    phase = thin.phase(ff.polar(1.0, 10, n=11))
    expect(page.locator("[data-key=peak]")).to_have_text(f"{np.abs(phase).max():.4g} rad")
    condition = np.linalg.cond(thin.pixel_influence.reshape(2048, -1))
    expect(page.locator("[data-key=condition]")).to_have_text(f"{condition:.4g}")
    page.get_by_role("button", name="Undo").click()
    expect(page.locator("[data-key=condition]")).to_have_text("119.7")
    expect(field).to_have_value("0.5 mm")


def test_a_bad_value_is_refused_beside_its_control_and_the_old_design_stays(
    page: Page, server: LocalServer
) -> None:
    opened(page, server)
    before = peak(page)
    field = page.locator("[data-path='transducer.photoelastic.thickness']")
    field.fill("3 apples")
    field.press("Enter")
    problem = page.locator("#transducer-photoelastic-thickness-problem")
    expect(problem).to_contain_text("'3 apples' is not a quantity in meters")
    expect(field).to_have_attribute("aria-invalid", "true")
    assert peak(page) == before
    field.fill("3")
    field.press("Enter")
    expect(problem).to_contain_text("'3' has no unit")
    field.fill("2 mm")
    field.press("Enter")
    expect(problem).to_be_hidden()
    expect(page.locator("[data-key=peak]")).not_to_have_text(before)


def test_a_rule_that_binds_several_values_speaks_beside_the_one_that_broke_it(
    page: Page, server: LocalServer
) -> None:
    opened(page, server)
    field = page.locator("[data-path='camera.bits']")
    field.fill("6")
    field.press("Enter")
    expect(page.locator("#camera-bits-problem")).to_contain_text("lower the amplitude")


def test_a_link_restores_the_state(page: Page, browser: Browser, server: LocalServer) -> None:
    opened(page, server, "#load=pinch&stress=tau_xz&mesh=1")
    page.get_by_label("Edges", exact=True).select_option("roller")
    arrow(page, 6).press("PageUp")
    expect(page.locator("[data-key=condition]")).not_to_have_text("119.7")
    shown = fringes(page), peak(page)
    page.wait_for_timeout(400)
    context = browser.new_context()
    other = context.new_page()
    other.goto(page.url)
    expect(other.locator("#fringe-count")).to_have_text(shown[0])
    expect(other.locator("[data-key=peak]")).to_have_text(shown[1])
    expect(other.locator("[data-component=tau_xz]")).to_have_attribute("aria-pressed", "true")
    context.close()


def test_edges_stand_side_by_side_in_one_click(page: Page, server: LocalServer) -> None:
    opened(page, server)
    page.get_by_role("button", name="Compare edges").click()
    expect(page.locator("#compare canvas[aria-label^='Fringes']")).to_have_count(2)
    free, rollers = page.locator("#compare canvas[aria-label^='Fringes']").all()
    assert free.get_attribute("aria-label") != rollers.get_attribute("aria-label")


def test_files_can_be_taken_away(page: Page, server: LocalServer) -> None:
    opened(page, server)
    starts = {
        "design": b"name", "model": b"\x89HDF", "forces": b"frame,", "reading": b"frame,",
        "svg": b"<svg", "png": b"\x89PNG",
    }  # fmt: skip
    expect_downloads(page, starts)


def test_the_tour_leads_from_force_to_force(page: Page, server: LocalServer) -> None:
    opened(page, server)
    tail = page.get_by_role("slider", name="Tactel 2, normal force")
    tail.press("End")
    expect(tail).to_have_attribute("aria-valuenow", "2.00")
    page.get_by_role("button", name="Tour").click()
    tour = page.get_by_role("dialog")
    titles = []
    while tour.is_visible():
        titles.append(tour.locator("h2").inner_text())
        tour.locator("button.primary").click()
    assert titles[0].startswith("1. A force")
    assert titles[-1].startswith("7.")
    expect(page.get_by_role("button", name="Tour")).to_be_focused()
    expect(tail).to_have_attribute("aria-valuenow", "2.00")  # the forces come back


def test_a_drag_says_what_it_does_and_leaves_the_scale(page: Page, server: LocalServer) -> None:
    opened(page, server)
    hint, value = page.locator("#strip text.hint"), page.locator("#strip text.value")
    expect(hint).to_contain_text("Drag a dot")
    scale = page.locator("#strip .measure text")
    before = scale.text_content() or ""
    dot = page.locator("#strip .handle.normal .dot").nth(4).bounding_box()
    assert dot is not None
    x, y = dot["x"] + dot["width"] / 2, dot["y"] + dot["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 25, y + 15, steps=4)
    expect(value).to_contain_text(re.compile(r"\d\.\d\d N down, \d\.\d\d N left"))
    expect(hint).to_be_empty()
    page.mouse.up()
    expect(value).to_be_empty()
    expect(scale).to_have_text(before)


def test_the_page_survives_a_server_that_dies_and_comes_back(browser: Browser) -> None:
    local = LocalServer(warmed=False)
    local.start()
    try:
        # its console may well say that nobody answers
        with sized_page(browser, "light", 1280) as page:
            opened(page, local, "#load=single")
            local.stop()
            expect(page.locator("#link")).to_contain_text("trying again")
            arrow(page, 6).press("PageUp")  # pictures need no server
            expect_force(page, 6, "1.50")
            local.start()
            expect(page.locator("#link")).to_have_text("")
            settled(page, 6, 1.5)
    finally:
        local.stop()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_serious_and_nothing_overflows(
    browser: Browser, server: LocalServer, scheme: str
) -> None:
    with sized_page(browser, scheme, 390) as page:
        opened(page, server, "#load=slip&mesh=1&edges=1")
        page.locator(".typed summary").click()
        page.get_by_role("button", name="Tour").click()
        expect_accessible_when_widened(page, 1280)


def test_all_pictures_have_names_before_anything_is_known(page: Page, server: LocalServer) -> None:
    expect_accessible_before_any_answer(page, server)
