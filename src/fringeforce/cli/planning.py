"""The command that says what to press: plan."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fringeforce.cli.arguments import is_model


def plan(
    source: Annotated[
        str, typer.Argument(help="Design file, shipped design, or a calibrated model to improve.")
    ],
    presses: Annotated[int, typer.Option(help="Number of presses, a frame each.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="CSV of loads to write.")],
    largest: Annotated[str, typer.Option(help="Largest force of one press.")] = "3 N",
    friction: Annotated[
        float | None,
        typer.Option(help="Presses slip beyond |T| = friction N; without it T can act alone."),
    ] = None,
    density: Annotated[float, typer.Option(help="Largest fringe density, per pixel.")] = 0.2,
    together: Annotated[
        int, typer.Option(help="Tactels that can be pressed at a time, 1 or 2.")
    ] = 1,
    parameter: Annotated[
        list[str] | None, typer.Option(help="Design value to estimate, a dotted path; repeatable.")
    ] = None,
    plot: Annotated[bool, typer.Option("--plot", help="Draw the gain beside the CSV.")] = False,
) -> None:
    """Propose the loads to calibrate with: those after which readings err least."""
    from fringeforce.calibration.planning.candidates import Limits
    from fringeforce.calibration.planning.plan import plan_presses
    from fringeforce.design.files import load_strip
    from fringeforce.io.tables import save_forces
    from fringeforce.models.files import load_strip_model
    from fringeforce.plotting.figures import draw_plan
    from fringeforce.studies.summary import plan_summary

    known = load_strip_model(Path(source)) if is_model(source) else load_strip(source)
    limits = Limits(_newtons(largest), friction, density, together)
    found = plan_presses(known, presses, parameter, limits)
    save_forces(output, found.loads)
    print(f"{output}: {presses} presses, the most worthwhile first")
    print("\n".join(plan_summary(found)))
    if plot:
        picture = output.with_suffix(".png")
        draw_plan(found.ratio, picture)
        print(f"{picture}: the gain drawn")


def _newtons(text: str) -> float:
    from fringeforce.base.errors import InputError
    from fringeforce.design.units import parse_quantity

    try:
        return parse_quantity(text, "newton")
    except ValueError as error:
        raise InputError(f"--largest {text!r} {error}.") from None
