"""The reproduction of the paper: its figures, its statements, and what we find, as one page."""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

from markupsafe import Markup, escape

from fringeforce.base.progress import Progress
from fringeforce.base.storage import writing
from fringeforce.design.strip import Sensor
from fringeforce.plotting import axes as plot
from fringeforce.reproduction.example import PaperExample
from fringeforce.reproduction.figures import EQUATIONS, FIGURES
from fringeforce.reproduction.findings import statements
from fringeforce.reproduction.recovery import (
    PAPER_ANGLES,
    PAPER_MAGNITUDES,
    SEEDS,
    Recovery,
    recovered,
)


def reproduce(sensor: Sensor, folder: Path, progress: Progress | None = None) -> Path:
    """Write the paper's figures as PNG files and one self-contained page.

    Parameters
    ----------
    sensor : Sensor
        The paper's design, or another to treat alike.
    folder : Path
        Where to write; made if missing.
    progress : callable, optional
        Called with what is done next, the steps that are done and their count.

    Returns
    -------
    Path
        Path of the page.

    Raises
    ------
    FileFormatError
        If the folder cannot be made.
    """
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    example = PaperExample(sensor)
    report = progress or (lambda words, done, count: None)
    steps = len(FIGURES) + 2
    report(f"Reading {SEEDS} noisy frames", 0, steps)
    recovery = recovered(example)
    figures = []
    for number, (name, draw, size, title, text) in enumerate(FIGURES, start=1):
        report(title, number, steps)
        with plot.figure(*size) as (canvas, ax):
            draw(example, ax)
            buffer = BytesIO()
            canvas.savefig(buffer, format="png")
        (folder / f"{name}.png").write_bytes(buffer.getvalue())
        picture = base64.b64encode(buffer.getvalue()).decode()
        figures.append(
            {"title": title, "text": text, "picture": picture, "equations": EQUATIONS.get(name, ())}
        )
    report("Comparing with the paper", steps - 1, steps)
    findings = list(statements(example, recovery))
    page = folder / "report.html"
    page.write_text(_page(sensor, figures, findings, recovery), encoding="utf-8")
    report("Done", steps, steps)
    return page


def _page(
    sensor: Sensor,
    figures: list[dict[str, Any]],
    findings: Sequence[tuple[str, ...]],
    recovery: Recovery,
) -> str:
    from jinja2 import Environment, PackageLoader

    environment = Environment(
        loader=PackageLoader("fringeforce.reproduction"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["typeset"] = _typeset
    template = environment.get_template("report.html")
    return template.render(
        sensor=sensor,
        figures=figures,
        findings=findings,
        forces=_force_rows(recovery),
        verdict=recovery.reading.status.name,
        design=sensor.to_toml(),
    )


def _typeset(text: str) -> Markup:
    """Symbols of a sentence as MathML: sigma_x, tau_xz, I_o, n_o, 2^B, pi, >=, <=."""
    found = str(escape(text)).replace("&gt;=", "≥").replace("&lt;=", "≤")
    found = re.sub(r"\bpi\b", "π", found)
    for word, letter in (("sigma", "&sigma;"), ("tau", "&tau;"), ("I", "I"), ("n", "n")):
        symbol = rf"<math><msub><mi>{letter}</mi><mi>\1</mi></msub></math>"
        found = re.sub(rf"\b{word}_(xz|x|o)\b", symbol, found)
    return Markup(found.replace("2^B", "<math><msup><mn>2</mn><mi>B</mi></msup></math>"))


def _force_rows(recovery: Recovery) -> list[tuple[str, str, str, str]]:
    """Tactel, the paper's reading where it printed one, ours with deviations, the bound."""
    reading = recovery.reading
    rows = []
    for i in range(len(reading.forces)):
        printed = len(reading.forces) == len(PAPER_ANGLES)
        paper = f"{PAPER_MAGNITUDES[i]:.3f} N, {PAPER_ANGLES[i]:.1f}°" if printed else "-"
        ours = (
            f"{reading.magnitude[i]:.3f} ± {reading.magnitude_std[i]:.3f} N, "
            f"{reading.angle[i]:.1f} ± {reading.angle_std[i]:.1f}°"
        )
        bound = f"{recovery.bound[i, 0]:.3f} N, {recovery.bound[i, 1]:.3f} N"
        rows.append((str(i + 1), paper, ours, bound))
    return rows
