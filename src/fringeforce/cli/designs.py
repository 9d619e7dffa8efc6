"""Commands from a drawing to a model: new, characterize, show."""

from __future__ import annotations

import shutil
import textwrap
from pathlib import Path
from typing import Annotated

import typer

from fringeforce.cli.arguments import SHIPPED, Design, ModelOrDesign, model_of, writable
from fringeforce.cli.progress import compiling, progress_bar

LEAST_COLUMNS = 24
"""Columns of the values of a table, however narrow the terminal is."""


def new(
    path: Annotated[Path, typer.Argument(help="Design file to write.")] = Path("sensor.toml"),
    like: Annotated[
        str, typer.Option(metavar="<name>", help=f"Shipped design to start from, one of {SHIPPED}.")
    ] = "saad",
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Write a commented design file to start from."""
    from fringeforce.design.files import new_design

    writable(path, "designs")
    new_design(path, like, overwrite=force)
    print(f"{path}: edit it, then run  fringeforce characterize {path} -o model.h5")


def materials() -> None:
    """List the materials and light sources that a design can name.

    Each with its values and where they come from.
    """
    from fringeforce.design.light_sources import light_sources
    from fringeforce.design.materials import materials as listed

    for material in listed().values():
        print(f"{material.name}: {material.about}")
        for key, value in material.values.items():
            print(f"  {key} = {value if isinstance(value, str) else ', '.join(value)}")
        print(f"  ({material.source})\n")
    print('In a design: material = "polycarbonate" under [transducer.photoelastic]; what the layer')
    print("itself states counts before it.\n")
    for light in light_sources().values():
        print(f"{light.name}: {light.about}")
        print(f"  wavelength = {light.wavelength}\n  bandwidth = {light.bandwidth}")
        print(f"  ({light.source})\n")
    print(
        'In a design: wavelength = "red LED" under [polariscope], or of a channel; a bandwidth that'
    )
    print("is stated beside it counts before that of the light source.")


def characterize(
    design: Design,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="<file>", help="Model file to write (HDF5).")
    ],
    mesh: Annotated[
        str,
        typer.Option(
            metavar="<default|paper>",
            help="Finite elements: 'paper' takes the 201 x 25 linear nodes of the paper.",
        ),
    ] = "default",
    vtu: Annotated[
        Path | None,
        typer.Option(
            metavar="<file>",
            help="Also write displacement and stress under 1 N at 10 degrees, in 3-D, for "
            "ParaView (.vtu).",
        ),
    ] = None,
) -> None:
    """Solve a design by finite elements, and write its model.

    The model file holds the influence matrix: what each force does to the fringes. The command also
    says how good the plane model is for the width of the strip.
    """
    from fringeforce.contacts.loads import paper_load
    from fringeforce.design.files import load_sensor, load_strip
    from fringeforce.io.vtu import write_strip_vtu
    from fringeforce.models.characterization import characterize
    from fringeforce.models.plane_check import plane_check
    from fringeforce.studies.summary import provenance_words

    writable(output, "models", design)
    writable(vtu, "files", design)
    sensor = load_sensor(design)
    with progress_bar() as advance:
        model = characterize(sensor, mesh, advance)
        plane = None
        if sensor.transducer.solved_in_a_plane:
            plane = plane_check(sensor, advance)
        if vtu is not None:
            strip = load_strip(design)
            write_strip_vtu(vtu, strip, paper_load(strip.tactels.count), advance)
    model.save(output)
    print(f"{output}: {sensor.name}; {provenance_words(model)}")
    if plane is not None and not plane.good:
        print(f"  {plane.words}")


def show(
    model: ModelOrDesign,
) -> None:
    """Summarise a sensor: sizes, sensitivity, fringes and strain.

    Behind each number that has a limit stands whether it is good, and the limit.
    """
    from fringeforce.models.plane_check import plane_check
    from fringeforce.studies.summary import summary

    found = model_of(model)
    with compiling():
        facts = summary(found)
    if found.sensor.transducer.solved_in_a_plane:
        facts.append(("plane", plane_check(found.sensor).words))
    print(found.sensor.name)
    print(_table(facts))


def _table(facts: list[tuple[str, str]]) -> str:
    """Names beside values, which are wrapped on a terminal, and are a line each elsewhere."""
    names = max(len(name) for name, _ in facts) + 4
    terminal = shutil.get_terminal_size(fallback=(10_000, 24)).columns
    room = max(terminal - names, LEAST_COLUMNS)
    return "\n".join(
        textwrap.fill(
            value,
            names + room,
            initial_indent=f"  {name:<{names - 2}}",
            subsequent_indent=" " * names,
            break_on_hyphens=False,
        )
        for name, value in facts
    )
