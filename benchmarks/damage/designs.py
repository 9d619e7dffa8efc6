"""Design files with a line lost, doubled or changed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

import fringeforce as ff
from damage.counting import Case
from fringeforce.design.files import parse_sensor

DESIGNS = Path(__file__).parents[2] / "designs"
VALUES = ("nan", "inf", "-1", "0", "1e400", '""', "[]", '"text"', "true", "[1, 2]")


def changed_line(text: str, rng: np.random.Generator, how: int) -> tuple[str, str]:
    """A TOML text with one line deleted, doubled, misspelt or of another value; words for it."""
    lines = text.splitlines()
    place = int(rng.integers(len(lines)))
    line = lines[place]
    if how % 4 == 0:
        del lines[place]
    elif how % 4 == 1:
        lines.insert(place, line)
    elif how % 4 == 2 and line:
        at = int(rng.integers(len(line)))
        lines[place] = line[:at] + chr(rng.integers(32, 127)) + line[at + 1 :]
    elif "=" in line:
        lines[place] = f"{line.partition('=')[0]}= {rng.choice(VALUES)}"
    return "\n".join(lines), f"line {place + 1} as {lines[min(place, len(lines) - 1)]!r}"


def designs(folder: Path, rng: np.random.Generator, tries: int) -> Iterator[Case]:
    """Shipped designs with one line changed; what is taken reads back as itself."""
    texts = [path.read_text(encoding="utf-8") for path in sorted(DESIGNS.rglob("*.toml"))]
    for number in range(tries):
        text, words = changed_line(texts[number % len(texts)], rng, number)
        path = folder / f"design{number}.toml"
        path.write_text(text, encoding="utf-8")

        def attempt(path: Path = path) -> None:
            sensor = ff.load_sensor(path)
            assert parse_sensor(sensor.to_toml()) == sensor, "does not read back"

        yield words, attempt
