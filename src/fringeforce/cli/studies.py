"""Commands that ask which sensor to build: study, sweep, optimise."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fringeforce.cli.arguments import (
    Design,
    Scheduler,
    Workers,
    quantity,
    usable_folder,
    writable,
)
from fringeforce.cli.progress import progress_bar

if TYPE_CHECKING:
    from fringeforce.studies.study_result import StudyResult

Study = Annotated[
    Path, typer.Argument(help="Study file, such as examples/studies/thin-or-soft.toml.")
]
Results = Annotated[
    Path,
    typer.Option(
        "-o",
        "--output",
        metavar="<file>",
        help="HDF5 file of results; resumed if it exists.",
    ),
]


class Question(StrEnum):
    """What a study answers."""

    range = "range"
    resolution = "resolution"
    convergence = "convergence"
    sensitivity = "sensitivity"
    width = "width"
    strain = "strain"
    creep = "creep"


OF_TACTELS = Question.range, Question.resolution, Question.sensitivity
"""Questions that a skin has other answers to."""
LOADED = Question.resolution, Question.creep
"""Questions about loads up to --load."""


def study(
    question: Annotated[
        Question,
        typer.Argument(
            help="range: the largest forces; resolution: the smallest; convergence: errors of "
            "meshes; sensitivity: which tolerances count; width: which plane model is right; "
            "strain: what linear theory misses; creep: what is read after a release."
        ),
    ],
    design: Design,
    out: Annotated[
        Path,
        typer.Option("--out", metavar="<folder>", help="Folder for figure, table and words."),
    ] = Path("study"),
    load: Annotated[
        float,
        typer.Option(
            metavar="<N>",
            help="Largest normal force of a tactel in newtons, for resolution and creep.",
        ),
    ] = 1.0,
    width: Annotated[
        str | None,
        typer.Option(
            metavar="<length>",
            help="Width of contacts to which the design gives none, such as '0.5 mm', for the "
            "question strain; the thickness of the cover if not given.",
        ),
    ] = None,
    seed: Annotated[
        int,
        typer.Option(
            metavar="<number>",
            help="Start of the random numbers of loads and noise: the same seed gives the same "
            "answer.",
        ),
    ] = 0,
    scheduler: Scheduler = None,
    workers: Workers = None,
) -> None:
    """Answer one question about a design.

    With a figure, a table and a paragraph of plain words.
    """
    from fringeforce.base.errors import InputError
    from fringeforce.design.files import load_strip
    from fringeforce.models.strain_limit import strain_words
    from fringeforce.models.strip import characterize
    from fringeforce.studies.convergence import convergence_study
    from fringeforce.studies.creep import creep_study
    from fringeforce.studies.execution import executor
    from fringeforce.studies.range import range_study
    from fringeforce.studies.resolution import resolution_study
    from fringeforce.studies.sensitivity import sensitivity_study
    from fringeforce.studies.strain import strain_study
    from fringeforce.studies.width import width_study

    usable_folder(out)
    if not 0 < load < float("inf"):
        raise InputError(f"--load {load:g}: must be a force above 0 N, such as 1.")
    if seed < 0:
        raise InputError(f"--seed {seed}: must be a whole number, 0 or more.")
    sensor = load_strip(design)
    if sensor.skin is not None and question in OF_TACTELS:
        raise InputError(
            f"{design} has a skin, and study {question} asks about tactels; take a design with "
            f"tactels, or fringeforce show {design}, which says how well a contact is read."
        )
    wide = None if width is None else quantity("--width", width, "meter")
    with executor(scheduler, workers) as pool, progress_bar() as advance:
        answers: dict[Question, Callable[[], StudyResult]] = {
            Question.range: lambda: range_study(sensor, pool, seed=seed, progress=advance),
            Question.resolution: lambda: resolution_study(characterize(sensor), load, seed),
            Question.convergence: lambda: convergence_study(sensor),
            Question.sensitivity: lambda: sensitivity_study(
                sensor, pool, seed=seed, progress=advance
            ),
            Question.width: lambda: width_study(sensor, pool, seed, advance),
            Question.strain: lambda: strain_study(sensor, advance, width=wide),
            Question.creep: lambda: creep_study(sensor, load, seed, advance),
        }
        found = answers[question]()
    _tell(found, out)
    words = strain_words(sensor, [[load, 0.0]]) if question in LOADED else ""
    if words:
        print(words)


def sweep(
    study: Study, output: Results, scheduler: Scheduler = None, workers: Workers = None
) -> None:
    """Evaluate the many designs of a study file."""
    from fringeforce.studies.execution import executor
    from fringeforce.studies.outcome import sweep_result
    from fringeforce.studies.study_file import load_study
    from fringeforce.studies.sweep import run_sweep

    writable(output, "results", study)
    plan, sensor = load_study(study)
    with executor(scheduler, workers) as pool, progress_bar() as advance:
        found = sweep_result(run_sweep(plan, sensor, output, pool, advance), output.stem)
    _tell(found, output.parent, output)


def optimise(
    study: Study, output: Results, scheduler: Scheduler = None, workers: Workers = None
) -> None:
    """Find the best design within the constraints.

    Noisy frames of it are read, and the design is written beside the results.
    """
    from fringeforce.studies.execution import executor
    from fringeforce.studies.optimise import optimise as best_of
    from fringeforce.studies.outcome import optimum_result
    from fringeforce.studies.study_file import load_study
    from fringeforce.studies.sweep import prepared
    from fringeforce.studies.verification import verified

    writable(output, "results", study)
    plan, sensor = load_study(study)
    with executor(scheduler, workers) as pool, progress_bar() as advance:
        best = best_of(plan, sensor, output, pool, advance)
        assert plan.search is not None
        advance("reading noisy frames", 0, 2)
        seed, frames = prepared(plan, sensor)[1].seed, plan.search.verify
        checks = [
            verified(one, plan.working_load, seed, frames, pool) for one in (sensor, best.sensor)
        ]
    found = optimum_result(best, checks, output.stem)
    drawing = output.with_suffix(".toml")
    drawing.write_text(best.sensor.to_toml(), encoding="utf-8")
    _tell(found, output.parent, drawing, output)


def _tell(found: StudyResult, folder: Path, *written: Path) -> None:
    """Print what a study says, save it, and name all files that there are of it."""
    print("\n".join(found.lines()))
    print("\n" + ", ".join(str(path) for path in [*written, *found.save(folder)]))
