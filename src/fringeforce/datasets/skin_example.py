"""One line of a skin and all that is known of it; a number and a study decide what it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array
from fringeforce.contacts.press import Press, Tractions
from fringeforce.contacts.random_presses import random_presses
from fringeforce.datasets.study_file import DatasetStudy
from fringeforce.models.presses import tractions
from fringeforce.models.strip import SensorModel

PRESS = np.dtype(
    [("image", "<i4")]
    + [
        (name, "<f4")
        for name in ("x", "width", "normal", "tangential", "axis", "radius", "friction")
    ]
)
"""A row of the table of contacts."""
Tables = dict[str, tuple[NDArray[np.void], str]]


@dataclass(frozen=True, eq=False)
class SkinExample:
    """One labelled line.

    Attributes
    ----------
    number : int
        In the data set, from 0.
    image : ndarray, shape frame_shape
        Grey levels.
    forces : ndarray, shape (n, 2)
        Normal and tangential force between neighbours of every line load of the skin [N].
    contacts : list of (Press, Tractions)
        What presses, and what it does to the surface, from which the light is computed.
    part : int
        0 train, 1 validation, 2 test.
    """

    number: int
    image: NDArray[np.unsignedinteger]
    forces: Array
    contacts: list[tuple[Press, Tractions]]
    part: int

    @property
    def tables(self) -> Tables:
        """Rows of the tables of a data set, and what these are."""
        rows = np.zeros(len(self.contacts), dtype=PRESS)
        for row, (press, found) in zip(rows, self.contacts, strict=True):
            row["image"], row["x"], row["width"] = self.number, found.centre, found.width
            row["normal"], row["tangential"] = found.forces.sum(axis=0)
            row["axis"], row["friction"] = press.x, press.friction
            row["radius"] = np.nan if press.radius is None else press.radius
        return {"contacts": (rows, "what pressed on the skin, SI; image is the number of the line")}


def skin_example(model: SensorModel, study: DatasetStudy, number: int) -> SkinExample:
    """A line of a data set, the same whoever computes it and whatever others there are.

    The sensor is drawn anew from the tolerances of the design for every line.

    Parameters
    ----------
    model : SensorModel
        Model of the study's skin.
    study : DatasetStudy
        What lines are drawn from.
    number : int
        Number of the line.
    """
    seeds = np.random.SeedSequence(study.seed, spawn_key=(number,)).spawn(3)
    touch, built, noise = (np.random.default_rng(seed) for seed in seeds)
    sensor = model.sensor
    assert sensor.skin is not None
    presses = random_presses(sensor.skin.extent, touch, study.presses)
    contacts = [(press, tractions(sensor, press)) for press in presses]
    places = sensor.tactels.positions
    forces = np.zeros((len(places), 2))
    for _, found in contacts:
        forces += found.between(places)
    image = model.expose(presses, noise, as_built=built if sensor.tolerances else None)
    return SkinExample(number, image, forces, contacts, study.split.part(number))
