"""Commands from a drawing to a model: new, characterize, show."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fringeforce.cli.arguments import Design, is_model


def new(
    path: Annotated[Path, typer.Argument(help="Design file to write.")] = Path("sensor.toml"),
    like: Annotated[str, typer.Option(help="Shipped design to start from.")] = "saad",
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Write a commented design file to start from."""
    from fringeforce.design import new_design

    new_design(path, like, overwrite=force)
    print(f"{path}: edit it, then run  fringeforce characterize {path} -o model.h5")


def characterize(
    design: Design,
    output: Annotated[Path, typer.Option("-o", "--output", help="Model file to write.")],
    mesh: Annotated[
        str, typer.Option(help="'default', or 'paper' for the 201 x 25 linear nodes of the paper.")
    ] = "default",
) -> None:
    """Reduce a design to its influence matrix, with finite elements."""
    from fringeforce.characterization import characterize
    from fringeforce.design import load_sensor

    sensor = load_sensor(design)
    model = characterize(sensor, mesh)
    model.save(output)
    facts = ", ".join(f"{name}: {value}" for name, value in model.provenance.items())
    print(f"{output}: {sensor.name}; {facts}")


def show(
    model: Annotated[str, typer.Argument(help="Model file, design file or shipped design.")],
) -> None:
    """Summarise a sensor: sizes, sensitivity, conditioning, fringe density, strain."""
    from fringeforce.design import load_strip
    from fringeforce.files import load_strip_model
    from fringeforce.model import characterize
    from fringeforce.summary import summary

    found = load_strip_model(model) if is_model(model) else characterize(load_strip(model))
    facts = summary(found)
    width = max(len(name) for name, _ in facts)
    print(found.sensor.name)
    for name, value in facts:
        print(f"  {name:<{width}}  {value}")
