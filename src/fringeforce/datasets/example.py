"""One image and all that is known of it; a number and a study decide what it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array
from fringeforce.contacts.indenters import Imprint, Indenter
from fringeforce.contacts.random import random_contacts
from fringeforce.datasets.optics import Optics, drawn_optics, image_of
from fringeforce.datasets.study_file import DatasetStudy
from fringeforce.models.pad import PadModel

_NUMBERS = ("x", "y", "normal", "shear_x", "shear_y", "torsion", "centre_x", "centre_y")
_SHAPE = ("radius", "modulus", "length", "angle", "period", "depth", "phase")
CONTACT = np.dtype(
    [("image", "<i4"), ("kind", "S8")]
    + [(name, "<f4") for name in (*_NUMBERS, "friction", "reach", *_SHAPE)]
)
"""A row of the table of contacts; values that a kind does not have are not a number."""
OPTICS = np.dtype(
    [("image", "<i4"), ("light", "<f4"), ("gradient_x", "<f4"), ("gradient_y", "<f4")]
    + [(name, "<f4") for name in ("vignetting", "noise", "blur", "wavelength_error")]
    + [(name, "<f4") for name in ("extinction_ratio", "shift_x", "shift_y")]
)
"""A row of the table of optics."""
DEAD = np.dtype([("image", "<i4"), ("row", "<i4"), ("column", "<i4"), ("level", "<u2")])
"""A row of the table of dead pixels."""


@dataclass(frozen=True, eq=False)
class Example:
    """One labelled image.

    Attributes
    ----------
    number : int
        In the data set, from 0.
    image : ndarray, shape frame_shape
        Grey levels.
    forces : ndarray, shape (n, 3)
        N, T_x, T_y of every tactel [N].
    contacts : list of (Indenter, Imprint)
        What presses, and what it does.
    optics : Optics
        How the image was taken.
    part : int
        0 train, 1 validation, 2 test.
    """

    number: int
    image: NDArray[np.unsignedinteger]
    forces: Array
    contacts: list[tuple[Indenter, Imprint]]
    optics: Optics
    part: int

    @property
    def tables(self) -> dict[str, tuple[NDArray[np.void], str]]:
        """Rows of the tables of a data set, and what these are."""
        return {
            "contacts": (
                self.contact_rows,
                "what pressed on the pad, SI; image is the number of the image",
            ),
            "optics": (self.optics_row, "light and camera of every image, SI and grey levels"),
            "dead": (self.dead_rows, "pixels that always show one grey level"),
        }

    @property
    def contact_rows(self) -> NDArray[np.void]:
        """Rows of the table of contacts."""
        rows = np.zeros(len(self.contacts), dtype=CONTACT)
        for row, (body, imprint) in zip(rows, self.contacts, strict=True):
            row["image"], row["kind"] = self.number, body.kind
            row["x"], row["y"] = body.place
            row["normal"], row["shear_x"], row["shear_y"] = imprint.force
            row["centre_x"], row["centre_y"] = imprint.centre
            row["torsion"], row["reach"] = imprint.torsion, imprint.reach
            row["friction"] = body.friction
            for name in _SHAPE:
                value: Any = getattr(body, name, None)
                row[name] = np.nan if value is None else value
        return rows

    @property
    def optics_row(self) -> NDArray[np.void]:
        """Row of the table of optics."""
        o = self.optics
        numbers = o.vignetting, o.noise, o.blur, o.wavelength_error, o.extinction_ratio
        return np.array([(self.number, o.light, *o.gradient, *numbers, *o.shift)], dtype=OPTICS)

    @property
    def dead_rows(self) -> NDArray[np.void]:
        """Rows of the table of dead pixels."""
        return np.array([(self.number, *pixel) for pixel in self.optics.dead.tolist()], dtype=DEAD)


def example(model: PadModel, study: DatasetStudy, number: int) -> Example:
    """An image of a data set, the same whoever computes it and whatever others there are.

    Parameters
    ----------
    model : PadModel
        Model of the study's pad.
    study : DatasetStudy
        What images are drawn from.
    number : int
        Number of the image.
    """
    # what SeedSequence(seed).spawn(...) would have at this place
    seeds = np.random.SeedSequence(study.seed, spawn_key=(number,)).spawn(3)
    touch, light, noise = (np.random.default_rng(seed) for seed in seeds)
    pad = model.sensor
    contacts = [(body, body.imprint(pad)) for body in random_contacts(pad, touch, study.contacts)]
    forces = np.sum([imprint.forces for _, imprint in contacts], axis=0)
    optics = drawn_optics(study.optics, pad, light)
    acting = [imprint.tractions for _, imprint in contacts]
    exact = pad.transducer.sides == "roller"
    image = image_of(model, acting if exact else forces, optics, noise)
    return Example(number, image, forces, contacts, optics, study.split.part(number))
