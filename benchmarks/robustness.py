"""Damaged files and wrong arrays: each is refused with a clear error or taken rightly.

    python benchmarks/robustness.py [--tries 100] [--seed 0]

A failure is any other error, an input that takes longer than its limit, a reading that is
OK with a force that is not finite, or damaged content that loads as something else.  The first
failures are named below the table.
"""

from __future__ import annotations

import argparse
import logging
import signal
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tifffile
from PIL import Image
from rich.console import Console
from rich.table import Table

import fringeforce as ff
from fringeforce.io.frames import load_frames, save_frames

DESIGNS = Path(__file__).parents[1] / "designs"
LIMIT = 10
"""Seconds for one input."""
VALUES = ("nan", "inf", "-1", "0", "1e400", '""', "[]", '"text"', "true", "[1, 2]")
Case = tuple[str, Callable[[], Any]]


@dataclass
class Count:
    """What became of the inputs of a kind."""

    tried: int = 0
    refused: int = 0
    taken: int = 0
    failures: list[str] = field(default_factory=list)

    def add(self, name: str, attempt: Callable[[], Any]) -> None:
        """Try one input."""
        self.tried += 1
        try:
            with _time_limit(LIMIT):
                attempt()
        except ff.FringeforceError:
            self.refused += 1
        except Exception as error:
            self.failures.append(f"{name}: {type(error).__name__}: {error}"[:200])
        else:
            self.taken += 1


@contextmanager
def _time_limit(seconds: int) -> Iterator[None]:
    def over(*_: object) -> None:
        raise TimeoutError(f"longer than {seconds} s")

    before = signal.signal(signal.SIGALRM, over)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def designs(folder: Path, rng: np.random.Generator, tries: int) -> Iterator[Case]:
    """Shipped designs with lines lost, doubled or changed."""
    texts = [path.read_text(encoding="utf-8") for path in sorted(DESIGNS.rglob("*.toml"))]
    for number in range(tries):
        lines = texts[number % len(texts)].splitlines()
        place, how = int(rng.integers(len(lines))), number % 4
        line = lines[place]
        if how == 0:
            del lines[place]
        elif how == 1:
            lines.insert(place, line)
        elif how == 2 and line:
            at = int(rng.integers(len(line)))
            lines[place] = line[:at] + chr(rng.integers(32, 127)) + line[at + 1 :]
        elif "=" in line:
            lines[place] = f"{line.partition('=')[0]}= {rng.choice(VALUES)}"
        path = folder / f"design{number}.toml"
        path.write_text("\n".join(lines), encoding="utf-8")
        yield (
            f"line {place + 1} as {lines[min(place, len(lines) - 1)]!r}",
            lambda path=path: ff.load_sensor(path),
        )


def _damaged(content: bytes, rng: np.random.Generator, cut: bool) -> bytes:
    if cut:
        return content[: int(rng.integers(len(content)))]
    changed = bytearray(content)
    changed[rng.integers(len(content))] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def model_files(
    model: ff.SensorModel, folder: Path, rng: np.random.Generator, tries: int
) -> Iterator[Case]:
    """A model with one bit changed, or cut off."""
    path = folder / "model.h5"
    model.save(path)
    content = path.read_bytes()

    def same() -> None:
        loaded = ff.load_model(path)
        assert loaded.sensor == model.sensor, "another design"
        assert np.array_equal(loaded.psi, model.psi), "another influence matrix"

    for number in range(tries):
        path.write_bytes(_damaged(content, rng, number % 4 == 0))
        yield f"model {number}", same


def frame_files(
    model: ff.SensorModel, folder: Path, rng: np.random.Generator, tries: int
) -> Iterator[Case]:
    """Frames of every kind of file with one bit changed, or cut off.

    Only HDF5 files carry a checksum of their content: of the others a changed grey level is taken.
    """
    frames = model.expose(np.stack([ff.polar(1.0, 10, n=11)] * 3), rng=0)
    paths = [folder / f"frames{ending}" for ending in (".h5", ".npy", ".png", ".tiff")]
    save_frames(paths[0], frames, model.pixel_positions)
    np.save(paths[1], frames)
    Image.fromarray(frames).save(paths[2])
    tifffile.imwrite(paths[3], frames)
    contents = [path.read_bytes() for path in paths]

    def load(path: Path) -> None:
        loaded = load_frames(path)
        assert path.suffix != ".h5" or np.array_equal(loaded, frames), "other frames"

    for number in range(tries):
        path, content = paths[number % 4], contents[number % 4]
        # half of the damage is to the first 128 bytes, where headers are
        head = 128 if number % 8 < 4 else len(content)
        path.write_bytes(_damaged(content[:head], rng, number % 12 < 4) + content[head:])
        yield f"{path.name} {number}", lambda path=path: load(path)


def arrays(model: ff.SensorModel) -> Iterator[Case]:
    """Arrays of every kind in the place of a frame and of forces."""
    frame, forces = model.expose(ff.polar(1.0, 10, n=11), rng=0), ff.polar(1.0, 10, n=11)
    reader = ff.Reader(model)
    reader.read(frame)  # compiles its loops, which takes longer than an input may

    def read(values: Any) -> None:
        reading = reader.read(values)
        finite = np.isfinite(reading.forces).all()
        assert finite or reading.status is not ff.Status.OK, "OK, but forces are not finite"

    def batch(values: Any) -> None:
        reader.read_batch(values)

    def phase(values: Any) -> None:
        assert np.isfinite(model.phase(values)).all(), "phase is not finite"

    def expose(values: Any) -> None:
        model.expose(values, rng=0)

    for call, good in ((read, frame), (batch, frame[None]), (phase, forces), (expose, forces)):
        for name, values in _kinds(np.asarray(good)).items():
            yield f"{call.__name__}({name})", lambda call=call, values=values: call(values)


def _kinds(good: np.ndarray[Any, Any]) -> dict[str, Any]:
    real, fixed = good.astype(float), good.copy()
    fixed.flags.writeable = False
    mixed = {"nan": np.nan, "inf": np.inf, "-inf": -np.inf, "1e300": 1e300, "-1": -1.0}
    return {
        **{name: np.full(good.shape, value) for name, value in mixed.items()},
        "object": real.astype(object),
        "None": None,
        "complex": real + 1j,
        "strings": real.astype(str),
        "bytes": b"frame",
        "dates": np.full(good.shape, np.datetime64("2020-01-01")),
        "bool": real > 0,
        "empty": np.empty(0),
        "scalar": 1.0,
        "one more axis": good[None, None, None],
        "cut": good[..., :-1],
        "ragged": [[1, 2], [3]],
        "negative strides": good[..., ::-1],
        "read only": fixed,
        "big-endian": real.astype(">f8"),
        "float16": real.astype(np.float16),
        "masked": np.ma.masked_less(real, np.median(real)),
    }


def main() -> None:
    """Try everything and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tries", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    logging.disable()  # of tifffile, on every tag that is wrong
    model = ff.characterize(ff.load_sensor("saad"))
    rng = np.random.default_rng(options.seed)
    table = Table("input", "tried", "clear errors", "taken rightly", "failures")
    failures: list[str] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        kinds = {
            "design files, lines changed": designs(folder, rng, options.tries),
            "model files, bits and ends": model_files(model, folder, rng, options.tries),
            "frame files, bits and ends": frame_files(model, folder, rng, options.tries),
            "arrays to read, read_batch, phase, expose": arrays(model),
        }
        for kind, cases in kinds.items():
            count = Count()
            for case in cases:
                count.add(*case)
            failed = len(count.failures)
            table.add_row(kind, *map(str, (count.tried, count.refused, count.taken, failed)))
            failures += count.failures
    console = Console()
    console.print(table)
    for failure in failures[:20]:
        console.print(failure, markup=False, highlight=False)


if __name__ == "__main__":
    main()
