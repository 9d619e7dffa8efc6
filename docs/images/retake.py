"""Take the pictures of the explorer anew.

    python docs/images/retake.py [explorer] [gif] [pad] [skin] [live]

Needs the development environment and Debian's chromium.  Look at each one afterwards.
"""

from __future__ import annotations

import io
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Page, ViewportSize, sync_playwright

HERE = Path(__file__).parent
COMMAND = "import sys; from fringeforce.cli import main; sys.exit(main())"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
SLOW = 300_000
"""Until a page shows its first reading: the first use compiles loops [ms]."""
COLOURS, METHOD = 128, Image.Quantize.MAXCOVERAGE
"""Of the moving picture, chosen to cover all that occur: most of a page is grey."""
STEPS, STEP_TIME, WIDE = 16, 110, 720
"""Of the moving picture: positions of the pointer on its way out, time of each [ms], pixels."""


@contextmanager
def explorer(*arguments: str, hash_: str = "", size: tuple[int, int]) -> Iterator[Page]:
    """A page of the explorer, in light colours, once it has read its first frame."""
    run = subprocess.Popen(
        [sys.executable, "-c", COMMAND, "explore", *arguments, "--no-browser"],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert run.stdout is not None
        found = re.search(r"http\S+", run.stdout.readline())
        assert found, "the explorer did not start"
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(
                executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"]
            )
            viewport: ViewportSize = {"width": size[0], "height": size[1]}
            page = browser.new_context(viewport=viewport, color_scheme="light").new_page()
            page.set_default_timeout(SLOW)
            page.goto(found[0] + hash_)
            yield page
            browser.close()
    finally:
        run.terminate()
        run.wait()


def settle(page: Page) -> None:
    """Wait until what is pressed now has been read and painted."""
    page.wait_for_function(
        """() => document.getElementById('status').dataset.status
            && (document.getElementById('behind')?.hidden ?? true)"""
    )
    page.wait_for_timeout(1500)


def keep(page: Page, name: str, width: int | None = None) -> None:
    """Write what the page shows."""
    picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    if width is not None:
        height = round(picture.height * width / picture.width)
        picture = picture.resize((width, height), Image.Resampling.LANCZOS)
    picture.save(HERE / name, optimize=True)


def strip() -> None:
    """Loads that slip, with the mesh as it deforms."""
    with explorer(hash_="#load=slip&mesh=1&stress=principal", size=(1280, 1000)) as page:
        settle(page)
        keep(page, "explorer.png")


def moving() -> None:
    """One force that is dragged, with stress and fringes."""
    with explorer(hash_="#load=single", size=(1100, 1000)) as page:
        settle(page)
        panels = page.locator("#panel-forces"), page.locator("#panel-fringes")
        first, last = (panel.bounding_box() for panel in panels)
        assert first is not None
        assert last is not None
        bottom = last["y"] + last["height"]
        clip: Any = {**first, "height": bottom - first["y"]}
        dot = page.get_by_role("slider", name="Tactel 6, normal force").locator(".dot")
        box = dot.bounding_box()
        assert box is not None
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        shots = []
        way = [k / STEPS for k in range(STEPS + 1)]
        for share in (*way, *way[-2:0:-1]):
            page.mouse.move(x + 90 * (share - 0.35), y - 12 + 40 * (share - 0.5) ** 2 - 20 * share)
            page.wait_for_timeout(STEP_TIME)
            shots.append(Image.open(io.BytesIO(page.screenshot(clip=clip))).convert("RGB"))
        page.mouse.up()
        height = round(shots[0].height * WIDE / shots[0].width)
        small = [one.resize((WIDE, height), Image.Resampling.LANCZOS) for one in shots]
        stack = Image.new("RGB", (WIDE, height * len(small)))
        for number, one in enumerate(small):
            stack.paste(one, (0, number * height))
        palette = stack.quantize(COLOURS, METHOD)
        frames = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in small]
        frames[0].save(
            HERE / "explorer.gif",
            save_all=True,
            append_images=frames[1:],
            duration=STEP_TIME,
            loop=0,
        )


def pad() -> None:
    """Five fingers on a pad."""
    with explorer("pad", hash_="#touch=five", size=(1400, 1800)) as page:
        settle(page)
        keep(page, "explorer-pad.png", 800)


def skin() -> None:
    """Two fingers on a skin."""
    with explorer("skin", hash_="#f=-2.1,6,2.5,0.9;2.4,3,0.8,-0.2", size=(1280, 1340)) as page:
        settle(page)
        keep(page, "explorer-skin.png", 960)


def live() -> None:
    """A running sensor, held while somebody presses it; slow enough that no line is dropped."""
    with explorer("--camera", "sim", "--line-rate", "10", "--block", "1", size=(1200, 800)) as page:
        page.get_by_text(re.compile("[1-9][0-9]* lines/s read")).wait_for()
        page.wait_for_timeout(15_000)
        page.wait_for_function("/OK Use/.test(document.getElementById('watch').innerText)")
        page.keyboard.press("Space")
        page.mouse.click(5, 790)  # no button looks as if it were chosen
        page.wait_for_timeout(1000)
        keep(page, "explorer-live.png")


PICTURES = {"explorer": strip, "gif": moving, "pad": pad, "skin": skin, "live": live}

if __name__ == "__main__":
    for wanted in sys.argv[1:] or PICTURES:
        PICTURES[wanted]()
