"""Tables of loads and study files as people and programs spoil them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import fringeforce as ff
from damage.counting import Case, damaged, refused
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.load_log import LoadLog
from fringeforce.datasets.study_file import load_dataset_study
from fringeforce.io.bench_loads import load_bench_loads
from fringeforce.io.tables import load_forces
from fringeforce.studies.study_file import load_study

EXAMPLES = Path(__file__).parents[2] / "examples"
CELLS = ("", "nan", "inf", "-inf", "1e308", "1e400", "1_0", "x", "1,5", "-1", "0x10", "1 N", "2\0")
"""What a cell is replaced by."""
FRAMES = 6
Loads = tuple[np.ndarray, ...]


def tables() -> dict[str, str]:
    """Good tables of each kind: of tactels, by place, and by time."""
    rng = np.random.default_rng(0)
    force = rng.uniform(0.1, 2.0, (FRAMES, 2)).round(3).tolist()
    loads = [f"{n},{t}" for n, t in force]
    return {
        "tactels": "frame,tactel,normal_N,tangential_N\n"
        + "".join(f"{k},{k + 2},{load}\n" for k, load in enumerate(loads)),
        "places": "frame,x_mm,normal_N,tangential_N,width_mm\n"
        + "".join(f"{k},{k - 3.5},{load},0.4\n" for k, load in enumerate(loads)),
        "times": "time_s,x_mm,normal_N,tangential_N\n"
        + "".join(f"{k / 10},{k - 3.5},{load}\n" for k, load in enumerate(loads)),
    }


def _values(path: Path, sensor: ff.Sensor, kind: str) -> Loads:
    """Numbers of a table, those of tactels read in both ways that there are."""
    found = load_bench_loads(path, sensor, FRAMES if kind != "times" else None)
    values: Loads = (found.places, found.forces, found.widths)
    if isinstance(found, LoadLog):
        assert (np.diff(found.times) > 0).all(), "times do not ascend"
        values += (found.times,)
    if isinstance(found, BenchLoads) and kind == "tactels":
        forces = load_forces(path, sensor.tactels.count)
        assert np.array_equal(forces, found.on_tactels(sensor.tactels.count)[: len(forces)])
    return values


def _in_range(values: Loads, sensor: ff.Sensor) -> None:
    places, forces, _, *_ = values
    there = np.isfinite(places)
    half = sensor.transducer.length / 2
    assert (np.abs(places[there]) <= half).all(), "places beside the strip"
    assert np.isfinite(forces[there]).all(), "forces that are not finite"
    assert (np.abs(forces[there]) < 1e6).all(), "forces of no bench"


def _same(values: Loads, good: Loads) -> None:
    for ours, theirs in zip(values, good, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, err_msg="another load")


def _rewritten(text: str) -> dict[str, bytes]:
    """The same table as other programs write it."""
    plain = text.encode()
    semicolons = text.replace(",", ";")
    quoted = "\n".join(",".join(f'"{c}"' for c in row.split(",")) for row in text.splitlines())
    return {
        "BOM": b"\xef\xbb\xbf" + plain,
        "UTF-16": text.encode("utf-16"),
        "semicolons": semicolons.encode(),
        "decimal commas": semicolons.replace(".", ",").encode(),
        "tabs": text.replace(",", "\t").encode(),
        "blanks": text.replace(",", "  ").encode(),
        "CRLF": text.replace("\n", "\r\n").encode(),
        "old Macintosh": text.replace("\n", "\r").encode(),
        "quoted": quoted.encode(),
        "remarks": b"# a bench\n" + plain + b"# the end\n",
        "capitals": text.partition("\n")[0].upper().encode() + plain[plain.index(b"\n") :],
        "no last line end": plain.rstrip(),
        "empty lines": text.replace("\n", "\n\n").encode(),
    }


def _unusable(text: str) -> dict[str, bytes]:
    """Tables that say nothing that could be right."""
    plain, (head, _, body) = text.encode(), text.partition("\n")
    first = body.splitlines()[0]
    return {
        "empty": b"",
        "header alone": head.encode(),
        "no header": body.encode(),
        "only NUL": bytes(4096),
        "NUL in a number": plain.replace(b".", b"\0", 1) + b"0,1,x\n",
        "binary": np.random.default_rng(1).bytes(4096),
        "a huge field": plain + b"9" * 10**6 + b"x" + b",1" * 3 + b"\n",
        "a huge header": b"x" * 10**6 + b"," + plain,
        "a huge quoted field": plain + b'"' + b"9" * 10**6 + b'"\n',
        "more cells": plain + first.encode() + b",1,1,1\n",
        "a row twice": plain + first.encode() + b"\n",
        "columns twice": "\n".join(f"{row},{row}" for row in text.splitlines()).encode(),
        "a million columns": b",".join([b"a"] * 10**6) + b"\n" + plain,
        "words": b"Dear colleague,\nthe forces were one newton, about.\n",
        "a web page": b"<!DOCTYPE html>\n<html><body>404</body></html>\n",
    }


def table_files(
    sensor: ff.Sensor, folder: Path, rng: np.random.Generator, tries: int
) -> Iterator[Case]:
    """Tables of loads in other dialects, unusable ones, and ones with something changed."""
    for kind, text in tables().items():
        path = folder / f"{kind}.csv"
        path.write_text(text, encoding="utf-8")
        good = _values(path, sensor, kind)

        def equal(path: Path = path, kind: str = kind, good: Loads = good) -> None:
            _same(_values(path, sensor, kind), good)

        def sane(path: Path = path, kind: str = kind) -> None:
            _in_range(_values(path, sensor, kind), sensor)

        for name, content in _rewritten(text).items():
            path.write_bytes(content)
            yield f"{kind}: {name}", equal
        for name, content in _unusable(text).items():
            path.write_bytes(content)
            yield f"{kind}: {name}", lambda sane=sane: refused(sane)
        for number in range(tries):
            content = text.encode()
            if number % 3:
                rows = [row.split(",") for row in text.splitlines()]
                row = rows[int(rng.integers(1, len(rows)))]
                place, cell = int(rng.integers(len(row))), str(rng.choice(CELLS))
                name = f"{row[place]!r} as {cell!r}"
                row[place] = cell
                content = "\n".join(map(",".join, rows)).encode()
            else:
                content, name = damaged(content, rng, number % 2 == 0), "a bit or the end"
            path.write_bytes(content)
            yield f"{kind} {number}: {name}", sane


def study_files(folder: Path, rng: np.random.Generator, tries: int) -> Iterator[Case]:
    """Study files of sweeps and data sets with lines lost, doubled or changed."""
    from damage.designs import changed_line

    for path in EXAMPLES.glob("dataset/small-pad.toml"):
        (folder / path.name).write_bytes(path.read_bytes())
    kinds: tuple[tuple[Path, Callable[[Path], tuple[Any, Any]]], ...] = (
        (EXAMPLES / "studies/thin-or-soft.toml", load_study),
        (EXAMPLES / "dataset/touches.toml", load_dataset_study),
        (EXAMPLES / "dataset/fingers.toml", load_dataset_study),
    )
    for number in range(tries):
        source, load = kinds[number % len(kinds)]
        text, words = changed_line(source.read_text(encoding="utf-8"), rng, number // len(kinds))
        path = folder / f"study{number}.toml"
        path.write_text(text, encoding="utf-8")

        def attempt(path: Path = path, load: Callable[[Path], tuple[Any, Any]] = load) -> None:
            study, sensor = load(path)
            again = type(study).model_validate(study.model_dump())
            assert again.canonical(sensor) == study.canonical(sensor), "does not read back"

        yield f"{source.name}, {words}", attempt
