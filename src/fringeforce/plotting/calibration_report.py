"""A calibration as one page that holds all it shows: verdict, findings, values and pictures."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from fringeforce.base.errors import InputError
from fringeforce.base.measured import INTERVAL
from fringeforce.base.storage import whole_file
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.design.text import unit_at
from fringeforce.design.units import READABLE
from fringeforce.models.bench_record import BenchRecord
from fringeforce.models.imaging import Calibration
from fringeforce.models.pad import PadModel
from fringeforce.models.strip import SensorModel
from fringeforce.plotting.calibration import (
    LENGTHS,
    draw_aside,
    draw_contacts,
    draw_fields,
    draw_misfit,
    draw_values,
)
from fringeforce.plotting.pad_calibration import draw_pad_contacts, draw_residual

DIGITS = 4
"""Digits of values in the table."""
LONG = re.compile(r"\d+\.\d{6,}(e[-+]?\d+)?")
"""Numbers with more digits than a person reads."""


def calibration_report(model: SensorModel | PadModel, path: Path) -> None:
    """Write what a calibration found as one self-contained page.

    Parameters
    ----------
    model : SensorModel or PadModel
        Calibrated.  Models of older files lack the record of their bench; their pages show the
        fields and the values alone.
    path : Path
        Of the page, HTML.

    Raises
    ------
    InputError
        If the model is not calibrated.
    FileFormatError
        If the page cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from fringeforce.plotting.calibration_report import calibration_report
    >>> drawing = ff.load_sensor("saad")
    >>> calibration_report(ff.characterize(drawing), Path("report.html"))
    Traceback (most recent call last):
    fringeforce.base.errors.InputError: This model was never calibrated; calibrate it first.
    """
    found = model.calibration
    if found is None:
        raise InputError("This model was never calibrated; calibrate it first.")
    from jinja2 import Environment, PackageLoader

    environment = Environment(
        loader=PackageLoader("fringeforce.plotting"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page = environment.get_template("calibration.html").render(
        sensor=model.sensor,
        found=found,
        frames=model.provenance.get("calibration frames", "-"),
        rows=list(_rows(found, model.sensor)),
        figures=[_shown(*one) for one in _figures(model, found)],
        design=_rounded(model.sensor.to_toml()),
    )
    with whole_file(path) as place:
        Path(place).write_text(page, encoding="utf-8")


Shown = tuple[str, str, Callable[[], Figure]]


def _figures(model: Any, found: Calibration) -> Iterator[Shown]:
    """Titles, texts and pictures."""
    record = found.record
    own = _OWN[model.sensor.kind]
    if record is not None:
        yield (
            "What the model leaves of the frames",
            f"Residuals by frame and pixel. Noise alone gives pale speckle; {own.residuals} The "
            "misfit is near 1 where a frame is explained.",
            lambda: draw_misfit(record, found.outliers),
        )
        yield (
            "Contacts as written and as found",
            "Open circles are contacts as written down, dots where the frames show them. Frames "
            f"that contradict the others are marked{own.left_out}: differences of the frames that "
            "were kept, with 95 % intervals.",
            lambda: own.contacts(model, record),
        )
        if len(record.aside):
            frames, explained, inside, forces = found.checked
            share = f"{inside} of {forces}" if forces else "none"
            yield (
                "Frames that were put aside",
                f"{frames} frames were put aside, {explained} of them are explained, and {share} "
                "forces lie within 95 % intervals: found without being told less written. A cross "
                "is a frame that no force explains.",
                lambda: draw_aside(record),
            )
    yield "Fields found", own.fields, lambda: own.draw_fields(model)
    yield (
        "Values beside the drawing",
        "What was found less what was drawn, with 95 % intervals.",
        lambda: draw_values(found),
    )


def _strip_fields(model: SensorModel) -> Figure:
    imaging = model.imaging
    assert imaging is not None
    drawn = np.full(len(imaging.positions), model.sensor.polariscope.residual)
    return draw_fields(imaging, drawn if imaging.residual is None else imaging.residual)


class _Own(NamedTuple):
    """What pages of one kind of sensor say and show."""

    residuals: str
    left_out: str
    fields: str
    contacts: Callable[[Any, BenchRecord], Figure]
    draw_fields: Callable[[Any], Figure]


_OWN = {
    "strip": _Own(
        "stripes from top to bottom are errors of light or residual, patches in one row a wrong "
        "load.",
        "; their dots are readings that know nothing of what was written. Below",
        "Light and phase without load along the strip, with 95 % bands.",
        lambda model, record: draw_contacts(record, model.calibration.outliers),
        _strip_fields,
    ),
    "pad": _Own(
        "a patch in one image is a wrong load, the same patch in all an error of the residual or "
        "of the light. Each image has the number of its frame and its misfit.",
        ". Beside",
        "The retardance without load that was found, from the two parts that light tells apart.",
        lambda model, record: draw_pad_contacts(record, model.calibration.outliers, model),
        draw_residual,
    ),
}


def _shown(title: str, text: str, draw: Callable[[], Figure]) -> dict[str, str]:
    buffer = BytesIO()
    draw().savefig(buffer, format="png", dpi=130)
    picture = base64.b64encode(buffer.getvalue()).decode()
    return {"title": title, "text": text, "picture": picture}


def _rows(found: Calibration, sensor: Sensor | Pad) -> Iterator[tuple[str, ...]]:
    """Name, value drawn, value found, and 95 % interval."""
    columns = found.names, found.drawing, found.values, INTERVAL * found.std
    for name, drawn, value, reach in zip(*columns, strict=True):
        unit = "meter" if name.startswith(LENGTHS) else None
        if name.startswith("transducer."):
            unit = unit_at(sensor, name)
        factor, symbol = READABLE.get(unit, (1.0, ""))
        there, here, far = (factor * one for one in (drawn, value, reach))
        texts = f"{there:.{DIGITS}g}", f"{here:.{DIGITS}g}", f"± {far:.2g}"
        yield name, *(f"{text} {symbol}".rstrip() for text in texts)


def _rounded(design: str) -> str:
    """A design with numbers of six digits, as many as a person reads; the model has all of them."""
    return LONG.sub(lambda number: f"{float(number[0]):.6g}", design)
