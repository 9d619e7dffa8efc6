"""Strain: up to which load the linear phase holds, and what goes beyond it.

On tactels that is its second order; a contact on a skin is solved where it is found.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.contacts.loads import PAPER_ANGLE, polar
from fringeforce.contacts.press import Press
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import Tolerances
from fringeforce.estimation.bounds import fisher_information
from fringeforce.estimation.frame_exposure import expose
from fringeforce.estimation.linearised_frame import (
    linearise,
    shared_information,
    spread_profiles,
)
from fringeforce.models.creep import without_creep
from fringeforce.models.finite_strain import second_order_influence
from fringeforce.models.node_splines import coefficients
from fringeforce.models.presses import tractions
from fringeforce.models.skin import GEOMETRY, PLACE, WIDTH, Contacts
from fringeforce.models.strip import SensorModel, characterize
from fringeforce.reading.skin_reader import SkinReader
from fringeforce.studies.study_result import StudyResult

LOADS = (0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0)
"""Forces on every tactel [N]."""
SQUASHED = (0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4)
"""Pressures of a contact on a skin over the modulus of the cover: the loads of the paper's tactels,
0.5 mm wide, are as much."""
SAME_SPREAD = 2 / np.sqrt(3)
"""Width of Hertz's pressure over that of an even one with the same standard deviation."""


@dataclass(frozen=True, eq=False)
class AtLoad:
    """What is left of the phase under one load: of linear theory, then of what goes beyond it.

    Attributes
    ----------
    load : float
        Force on every tactel, or of the contact [N].
    peak : float
        Largest phase [rad].
    off : ndarray, shape (2,)
        Largest error of the phase, over its largest value.
    forces : ndarray, shape (2,)
        Largest error of a force that follows from it [N].
    deviations : ndarray, shape (2,)
        The same in standard deviations of a single frame; of a contact the force's, or the place's
        if that is more.
    """

    load: float
    peak: float
    off: Array
    forces: Array
    deviations: Array


@dataclass(frozen=True)
class Loaded:
    """What is loaded, in the words of the study.

    Attributes
    ----------
    beyond : str
        What goes beyond linear theory.
    where : str
        Behind "force" and "under the same force".
    told : str
        What large strain moves by no more than a standard deviation, in a sentence of the width.
    rest : str
        What becomes of linear readings beyond, and of others.
    """

    beyond: str
    where: str
    told: str
    rest: str


TACTELS = Loaded(
    "second order",
    "on every tactel",
    "Under the same force at {angle:g} degrees on every tactel, contacts {width:.3g} mm wide, "
    "large strain moves no force by more than a standard deviation of a single frame",
    'Linear readings are off by the rest and do not know it; strain = "finite" in the design reads '
    "by the second order, and solves the strip anew where that is not enough.",
)
CONTACT = Loaded(
    "solved",
    "of the contact",
    "Under one contact in the middle of the skin, {width:.3g} mm wide, that presses evenly at "
    "{angle:g} degrees, and whose force, place, width and profile are sought, large strain moves "
    "neither force nor place by more than a standard deviation of a single frame",
    "Linear readings are off by the rest and do not know it, until no contacts explain a frame; "
    'strain = "finite" in the design solves the strip at the contacts that are found.',
)


def at_load(model: SensorModel, curvature: Array, load: float) -> AtLoad:
    """Solve one load with Newton's steps, and compare.

    Parameters
    ----------
    model : SensorModel
        Contacts of some width.
    curvature : ndarray, shape (P, 2n, 2n)
        Second order of the phase [rad/N^2].
    load : float
        Force on every tactel [N].
    """
    forces = polar(load, PAPER_ANGLE, model.sensor.tactels.count)
    flat, influence = forces.ravel(), model.frame_influence
    ratios = model.dispersions
    true = np.concatenate([ratio * model.phase(forces, strain="finite") for ratio in ratios])
    linear = influence @ flat
    bent = np.concatenate([ratio * (curvature @ flat) for ratio in ratios])
    error = np.stack([true - linear, true - linear - bent @ flat])
    # least squares of the grey levels take an error of the phase for these forces, to first order;
    # the second order is seen along its own tangent
    response, found, deviations = model.response, [], []
    for left, tangent in zip(error, (influence, influence + 2 * bent), strict=True):
        information = fisher_information(true, tangent, response)
        slopes, grey = response.jacobian(true, tangent), response.jacobian(true, left[:, None])
        moved = np.linalg.solve(information, slopes.T @ (grey[:, 0] / response.variance))
        spread = np.sqrt(np.diag(np.linalg.inv(information)))
        found.append(np.abs(moved).max())
        deviations.append(np.abs(moved / spread).max())
    peak = float(np.abs(true).max())
    off = np.abs(error).max(axis=1) / peak
    return AtLoad(load, peak, off, np.array(found), np.array(deviations))


def at_contact(reader: SkinReader, load: float, width: float) -> AtLoad:
    """Solve one contact in the middle of a skin, and compare.

    Parameters
    ----------
    reader : SkinReader
        Of a skin of finite strain.
    load : float
        Force at `PAPER_ANGLE` [N].
    width : float
        Of the contact, which presses evenly [m].
    """
    model, skin, uncertain = reader.model, reader.skin, reader.uncertain
    normal, tangential = polar(load, PAPER_ANGLE, 1)[0].tolist()
    press = [Press(x=0.0, normal=normal, tangential=tangential, width=width, profile="flat")]
    half = model.sensor.transducer.length / 2
    x, nodes = np.clip(uncertain.places, -half, half), len(uncertain.frame.fixed)
    true = model.phase(press, x, strain="finite")
    added = true - model.phase(press, x, strain="linear")
    added = coefficients(added * uncertain.shown, nodes)
    assert skin.strain is not None
    left = np.stack([added, added - skin.strain.under([tractions(model.sensor, press[0])])])
    geometry = np.zeros((1, GEOMETRY))
    geometry[0, WIDTH] = SAME_SPREAD * width / 2
    contacts = Contacts(np.array([[normal, tangential]]), geometry)
    found, deviations = [], []
    # either model about the fringes that are seen, as a reader finds contacts near them
    for (frame, unknowns), wave in zip(
        (skin.linear.frame(contacts, added), skin.frame(contacts)), left, strict=True
    ):
        prior = skin.prior(frame, normal)
        about = linearise(frame, prior, expose(frame, unknowns)[0], unknowns)
        shared = shared_information(frame, about, spread_profiles(frame, unknowns, wave[None]))
        moved = np.linalg.solve(about.hessian + about.cone, shared)[:, 0]
        spread = np.sqrt(np.diag(np.linalg.inv(about.hessian)))
        found.append(np.abs(moved[:2]).max())
        sought = [0, 1, frame.at.fields + PLACE]
        deviations.append(np.abs(moved[sought] / spread[sought]).max())
    peak = float(np.abs(true).max())
    off = np.array([np.abs(reader.at_pixels(one)).max() for one in left]) / peak
    return AtLoad(load, peak, off, np.array(found), np.array(deviations))


def strain_study(
    sensor: Sensor,
    progress: Progress | None = None,
    loads: Sequence[float] | None = None,
    width: float | None = None,
) -> StudyResult:
    """Errors of the linear phase, and of what goes beyond it, against load.

    Of a skin one contact in its middle is loaded, of other strips all tactels.

    Parameters
    ----------
    sensor : Sensor
        The design.
    progress : callable, optional
        Told words, the loads done and their number.
    loads : sequence of float, optional
        Forces on every tactel, or of the contact [N]; `LOADS`, or those that squash the cover of a
        skin by `SQUASHED`, if not given.
    width : float, optional
        Of contacts to which the design gives none [m]; the thickness of the cover if not given.

    Raises
    ------
    InputError
        If the strip is not solved in a plane, the width is not above zero, or the surface folds
        under the least load.
    """
    transducer, skin = sensor.transducer, sensor.skin
    if not transducer.solved_in_a_plane:
        raise InputError('This study takes plane = "stress" or "strain"; give such a design.')
    cover = transducer.compliant
    wide = sensor.tactels.contact_width if skin is None else 0.0
    wide = wide or (cover.thickness if width is None else width)
    if not 0 < wide < np.inf:
        raise InputError(f"width = {wide * 1e3:g} mm of a contact must be above zero.")
    if loads is None:
        full = cover.youngs_modulus * wide * transducer.width
        loads = LOADS if skin is None else [float(f"{share * full:.2g}") for share in SQUASHED]
    report = progress or (lambda title, done, total: None)
    plain = without_creep(sensor.model_copy(update={"tolerances": Tolerances()}))
    loaded = TACTELS if skin is None else CONTACT
    report(loaded.beyond, 0, len(loads) + 1)
    compare = _tactels(plain, wide) if skin is None else _contact(plain, wide)
    found = list[AtLoad]()
    for number, load in enumerate(loads, 1):
        report(f"{load:g} N {loaded.where}", number, len(loads) + 1)
        try:
            found.append(compare(load))
        except InputError as error:  # the surface folds
            if not found:
                raise InputError(f"Not even {load:g} N {loaded.where}: {error}") from None
            break
    report("done", len(loads) + 1, len(loads) + 1)
    rows = tuple(
        (
            f"{one.load:g}",
            f"{one.peak:.2f}",
            *(f"{1e2 * value:.2f}" for value in one.off),
            *(_short(1e3 * value) for value in one.forces),
            *(_short(value) for value in one.deviations),
        )
        for one in found
    )
    beyond = loaded.beyond
    header = (
        "load [N]", "peak phase [rad]", "phase off, linear [%]", f"{beyond} [%]",
        "force off, linear [mN]", f"{beyond} [mN]", "in deviations, linear", beyond,
    )  # fmt: skip
    return StudyResult(
        "strain",
        header,
        rows,
        _words(found, loaded, wide, len(found) < len(loads)),
        lambda ax: _draw(ax, found, loaded),
        (10.0, 4.2),
    )


def _tactels(sensor: Sensor, width: float) -> Callable[[float], AtLoad]:
    """What compares loads of tactels whose contacts are so wide."""
    drawn = sensor.replace(**{"tactels.contact_width": width, "transducer.strain": "finite"})
    model = characterize(drawn)
    curvature = second_order_influence(drawn, drawn.pixel_positions)
    return lambda load: at_load(model, curvature, load)


def _contact(sensor: Sensor, width: float) -> Callable[[float], AtLoad]:
    """What compares loads of a contact on a skin that is so wide."""
    reader = SkinReader(characterize(sensor.replace(**{"transducer.strain": "finite"})))
    return lambda load: at_contact(reader, load, width)


def _short(value: float) -> str:
    return f"{value:.2g}" if value < 100 else f"{value:.0f}"


def _words(found: list[AtLoad], loaded: Loaded, width: float, folds: bool) -> str:
    said = []
    for k, way in enumerate(("linear", loaded.beyond)):
        bad = [one.load for one in found if one.deviations[k] > 1]
        good = [one.load for one in found if not bad or one.load < bad[0]]
        reach = f"up to {good[-1]:g} N" if good else f"not even at {found[0].load:g} N"
        said.append(f"{way} {reach}")
    last = f" Above {found[-1].load:g} N the surface folds." if folds else ""
    told = loaded.told.format(angle=PAPER_ANGLE, width=width * 1e3)
    return f"{told}: {', '.join(said)}, of the loads in the table.{last} {loaded.rest}"


def _draw(ax: Axes, found: list[AtLoad], loaded: Loaded) -> None:
    ax.axis("off")
    left, right = ax.inset_axes((0, 0, 0.43, 1)), ax.inset_axes((0.57, 0, 0.43, 1))
    loads = [one.load for one in found]
    for k, way in enumerate(("linear", loaded.beyond)):
        left.plot(loads, [1e2 * one.off[k] for one in found], "o-", label=way)
        right.plot(loads, [one.deviations[k] for one in found], "o-", label=way)
    right.axhline(1, color="0.5", linewidth=0.8)
    left.set(ylabel="error of the phase [% of its peak]")
    what = "a force" if loaded is TACTELS else "force or place"
    right.set(ylabel=f"largest error of {what} [standard deviations]")
    for part in (left, right):
        part.set(xscale="log", yscale="log", xlabel=f"force {loaded.where} [N]")
        part.set_xticks(loads, [f"{load:.2g}" for load in loads])
        part.set_xticks([], minor=True)
        part.legend(fontsize=8)
