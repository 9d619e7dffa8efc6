"""The reproduction of the paper: its figures, its statements, and what we find, as one page."""

from __future__ import annotations

import base64
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

from fringeforce import plot
from fringeforce.design import Sensor
from fringeforce.errors import InputError
from fringeforce.figures import FIGURES
from fringeforce.findings import statements
from fringeforce.reproduction import Example


def reproduce(
    sensor: Sensor, folder: Path, progress: Callable[[str, int, int], None] | None = None
) -> Path:
    """Write the paper's figures as PNG files and one self-contained page.

    Parameters
    ----------
    sensor : Sensor
        The paper's design, or another to treat alike.
    folder : Path
        Where to write; made if missing.
    progress : callable, optional
        Called with a figure's title, its number and their count as the work goes on.

    Returns
    -------
    Path
        Of the page.

    Raises
    ------
    InputError
        If the folder cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder} cannot be made a folder: {error.strerror}.") from None
    example = Example(sensor)
    figures = []
    for number, (name, draw, size, title, text) in enumerate(FIGURES, start=1):
        if progress:
            progress(title, number, len(FIGURES))
        with plot.figure(*size) as (canvas, ax):
            draw(example, ax)
            buffer = BytesIO()
            canvas.savefig(buffer, format="png")
        (folder / f"{name}.png").write_bytes(buffer.getvalue())
        picture = base64.b64encode(buffer.getvalue()).decode()
        figures.append({"title": title, "text": text, "picture": picture})
    page = folder / "report.html"
    page.write_text(_page(sensor, figures, list(statements(example))), encoding="utf-8")
    return page


def _page(sensor: Sensor, figures: list[dict[str, str]], findings: list[tuple[str, ...]]) -> str:
    from jinja2 import Environment, PackageLoader

    environment = Environment(
        loader=PackageLoader("fringeforce"), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    template = environment.get_template("report.html")
    return template.render(
        sensor=sensor, figures=figures, findings=findings, design=sensor.to_toml()
    )
