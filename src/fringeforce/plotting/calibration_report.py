"""A calibration as one page that holds all it shows: verdict, findings, values and pictures."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.base.measured import INTERVAL
from fringeforce.base.storage import whole_file
from fringeforce.models.imaging import Calibration, Imaging
from fringeforce.models.strip import SensorModel
from fringeforce.plotting.calibration import (
    draw_aside,
    draw_contacts,
    draw_fields,
    draw_misfit,
    draw_values,
)

DIGITS = 4
"""Digits of values in the table."""


def calibration_report(model: SensorModel, path: Path) -> None:
    """Write what a calibration found as one self-contained page.

    Parameters
    ----------
    model : SensorModel
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
    if found is None or model.imaging is None:
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
        rows=list(_rows(found)),
        figures=[_shown(*one) for one in _figures(model, found)],
        design=model.sensor.to_toml(),
    )
    with whole_file(path) as place:
        Path(place).write_text(page, encoding="utf-8")


Shown = tuple[str, str, Callable[[], Figure]]


def _figures(model: SensorModel, found: Calibration) -> Iterator[Shown]:
    """Titles, texts and pictures."""
    record, imaging = found.record, model.imaging
    if record is not None:
        yield (
            "What the model leaves of the frames",
            "Residuals by frame and pixel. Noise alone gives pale speckle; stripes from top to "
            "bottom are errors of light or residual, patches in one row a wrong load. The misfit "
            "is near 1 where a frame is explained.",
            lambda: draw_misfit(record, found.outliers),
        )
        yield (
            "Contacts as written and as found",
            "Open circles are contacts as written down, dots where the frames show them. Frames "
            "that contradict the others are marked; their dots are readings that know "
            "nothing of what was written. Below: "
            "differences of the frames that were kept, with 95 % intervals.",
            lambda: draw_contacts(record, found.outliers),
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
    if imaging is not None:
        yield (
            "Fields found",
            "Light and phase without load along the strip, with 95 % bands.",
            lambda: draw_fields(imaging, _residual(model, imaging)),
        )
    yield (
        "Values beside the drawing",
        "What was found less what was drawn, with 95 % intervals.",
        lambda: draw_values(found),
    )


def _residual(model: SensorModel, imaging: Imaging) -> Array:
    drawn = np.full(len(imaging.positions), model.sensor.polariscope.residual)
    return drawn if imaging.residual is None else imaging.residual


def _shown(title: str, text: str, draw: Callable[[], Figure]) -> dict[str, str]:
    buffer = BytesIO()
    draw().savefig(buffer, format="png", dpi=130)
    picture = base64.b64encode(buffer.getvalue()).decode()
    return {"title": title, "text": text, "picture": picture}


def _rows(found: Calibration) -> Iterator[tuple[str, ...]]:
    """Name, value drawn, value found, and 95 % interval."""
    columns = found.names, found.drawing, found.values, INTERVAL * found.std
    for name, drawn, value, reach in zip(*columns, strict=True):
        unit = " m" if name == "camera shift" or name.startswith("tactel ") else ""
        yield (
            name,
            f"{drawn:.{DIGITS}g}{unit}",
            f"{value:.{DIGITS}g}{unit}",
            f"± {reach:.2g}{unit}",
        )
