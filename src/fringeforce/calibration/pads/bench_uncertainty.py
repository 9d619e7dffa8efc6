"""What is uncertain about a pad on a bench, as unknowns beside the forces of a frame's contacts.

They are those of `PadUncertainty`, but for two: values of the layers enter by their logarithms, and
contacts, which may be anywhere, have places and widths of their own in the place of the polynomials
of tactels.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fringeforce.calibration.bench_expectation import BLUR as POINT_SPREAD
from fringeforce.calibration.bench_expectation import DOUBT, FIELDS, LAMP
from fringeforce.calibration.design_entries import DEVIATION
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import Tolerances, number_at, with_values
from fringeforce.models.as_built import PLACEMENT, RESIDUAL, SIZE
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_contacts import ContactChanges, ContactInfluence
from fringeforce.models.pad_influence import PadInfluence, Retardance
from fringeforce.models.pad_uncertainty import (
    BLUR,
    EFFECTS,
    LAYERS,
    SHARPEST,
    Group,
    PadUncertainty,
)
from fringeforce.optics.area_camera import Lens

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SHIFT, SCALE = 1e-3, 5e-2
"""Deviations, before any frame is seen, of the camera's shift [m] and scale."""
SHAPES = 4
"""Unknowns of a contact besides its forces."""
KEPT = 8
"""Lenses that are kept: one, and those a little sharper and less sharp."""
OWN = PLACEMENT, SIZE
"""Tolerances of contacts, which are new in every frame."""


def loosened_pad(pad: Pad, paths: tuple[str, ...]) -> Pad:
    """A drawing with all that a calibration looks for as tolerances.

    The visibility is one of them only if the drawing states one: light of less visibility is light
    of another amplitude and offset.

    Parameters
    ----------
    pad : Pad
        The drawing; what it states itself is taken.
    paths : tuple of str
        Values of the layers to estimate.
    """
    camera = pad.camera
    pixel = float(np.diff(pad.pixel_positions[0][:2])[0])
    wide = dict.fromkeys(paths, 0.0)
    for path in paths:
        found = number_at(pad, path)
        assert found is not None
        wide[path] = DEVIATION["value"] * found[0]
    wide |= {
        "camera.amplitude": LAMP * camera.amplitude,
        "camera.offset": FIELDS["dark"] * camera.amplitude,
        "camera.shift_x": SHIFT,
        "camera.shift_y": SHIFT,
        "camera.scale": SCALE,
        "camera.blur": POINT_SPREAD / 2 * pixel,
        RESIDUAL: FIELDS["residual"],
    }
    stated = {path: std for path, std in pad.tolerances.items() if path not in OWN}
    stated.pop("polariscope.wavelength", None)  # like a stronger effect
    stated.pop("tactels.pitch", None)  # contacts lie where they are written down
    drift = camera.drift or DOUBT["gain"]
    return pad.model_copy(
        update={
            "tolerances": Tolerances({**wide, **stated}),
            "camera": camera.model_copy(update={"drift": drift}),
        }
    )


def is_layer(path: str) -> bool:
    """Whether a value enters by its logarithm."""
    return path in EFFECTS or path.startswith(LAYERS)


@dataclass(frozen=True, eq=False)
class BenchUncertainty(PadUncertainty):
    """A pad on a bench and the contacts of one frame, with all that is uncertain about them.

    Attributes
    ----------
    count : int
        Number of contacts k.
    units : (float, float)
        Of places and widths of contacts [m].
    changes : ContactChanges, optional
        Influence of the contacts and what changes of it.
    shared : BenchUncertainty, optional
        That of the same pad, whose fields, forms and lenses are taken.
    """

    count: int = 0
    units: tuple[float, float] = (DOUBT["place"], DOUBT["width"])
    changes: ContactChanges | None = None
    shared: BenchUncertainty | None = None

    def of_frame(self, changes: ContactChanges) -> BenchUncertainty:
        """That of a frame with contacts."""
        count = changes.influence.count[0]
        model = replace(self.model, influence=changes.influence)
        return BenchUncertainty(model, None, count, self.units, changes, self.shared or self)

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """Unknowns by kind, those of contacts last."""
        shared = PadUncertainty(self.model).groups if self.shared is None else self.shared.groups
        begin = shared[-1].end
        own = Group(PLACEMENT, begin, begin + SHAPES * self.count, 1.0)
        return (*shared, own) if self.count else shared

    @cached_property
    def _spread(self) -> Array:
        return np.zeros(1)

    @cached_property
    def layers(self) -> tuple[str, ...]:
        """Paths of the values that enter by their logarithms and change more than the size."""
        return tuple(
            group.path
            for group in self.groups
            if is_layer(group.path) and group.path not in EFFECTS
        )

    @cached_property
    def values(self) -> tuple[tuple[Group, tuple[PadInfluence, ...]], ...]:
        """Unknowns of sizes and materials, and the change of the influence with their powers."""
        found = []
        changes = self.changes
        assert changes is not None
        for group in self.groups:
            if not is_layer(group.path):
                continue
            std = self.logarithmic(group)
            if group.path in EFFECTS:
                # exp(s) = 1 + s + s^2 / 2
                powers = tuple(_scaled(changes.influence, share) for share in (std, std**2 / 2))
            else:
                both = changes.layers[self.layers.index(group.path)]
                powers = _scaled(both[0], std), _scaled(both[1], std**2)
            found.append((group, powers))
        return tuple(found)

    def logarithmic(self, group: Group) -> float:
        """Standard deviation of the logarithm of a value."""
        drawn = (self.shared or self).model.sensor
        found = number_at(drawn, group.path)
        assert found is not None
        return group.std / found[0]

    @cached_property
    def contacts(self) -> tuple[tuple[float, slice, PadInfluence], ...]:
        """Unit, unknowns and influence of places along x and along y, widths, and profiles."""
        if self.changes is None or not self.count:
            return ()
        begin = self.groups[-1].begin
        units = self.units[0], *self.units, 1.0
        ends = (begin + n * self.count for n in range(SHAPES + 1))
        places = (slice(*both) for both in pairwise(ends))
        return tuple(zip(units, places, self.changes.shapes, strict=True))

    def shown(self, forces: Array) -> Mask:
        """All unknowns show: forces and places are known beforehand."""
        return np.ones(self.size, dtype=bool)

    # what all frames share

    @cached_property
    def forms(self) -> list[tuple[int, list[Array]]]:
        """As of `PadUncertainty`."""
        return super().forms if self.shared is None else self.shared.forms

    @cached_property
    def _fields(self) -> tuple[Array, Array, NDArray[np.intp], Array]:
        return super()._fields if self.shared is None else self.shared._fields

    @cached_property
    def _slopes(self) -> tuple[csr_array, csr_array]:
        return super()._slopes if self.shared is None else self.shared._slopes

    # of the blur its square enters, which is how it acts

    @property
    def _sharpest(self) -> float:
        group = self.group(BLUR)
        assert group is not None
        pad = self.model.sensor
        pixel = float(np.diff(pad.pixel_positions[0][:2])[0])
        blur = pad.camera.blur or 0.0
        return ((SHARPEST * pixel) ** 2 - blur**2) / self._blur_unit

    @cached_property
    def _blur_unit(self) -> float:
        """Standard deviation of the square of the blur [m^2]."""
        group = self.group(BLUR)
        assert group is not None
        return 2 * (self.model.sensor.camera.blur or 0.0) * group.std + group.std**2

    def blur(self, extra: Array) -> tuple[float, float]:
        """Blur under unknowns, and its derivative by its own [m]."""
        group, drawn = self.group(BLUR), self.model.sensor.camera.blur or 0.0
        assert group is not None
        unknown = max(float(extra[group.begin]), self._sharpest)
        blur = float(np.sqrt(drawn**2 + self._blur_unit * unknown))
        return blur, self._blur_unit / (2 * blur)

    def _lens(self, unknown: float) -> Lens:
        if self.shared is not None:
            return self.shared._lens(unknown)
        if unknown not in self._lenses:
            if len(self._lenses) > KEPT:
                self._lenses.clear()
            pad = self.model.sensor
            blur = np.sqrt(
                (pad.camera.blur or 0.0) ** 2 + self._blur_unit * max(unknown, self._sharpest)
            )
            lens = Lens.of(with_values(pad, {BLUR: float(blur)}))
            assert lens is not None
            self._lenses[unknown] = lens
        return self._lenses[unknown]

    @cached_property
    def _lenses(self) -> dict[float, Lens]:
        return {}

    def retarding(self, extra: Array) -> Retardance:
        """From spline coefficients to the pixels, where they look under unknowns."""
        if self.shared is not None:
            found = self.shared.retarding(extra)
            return replace(found, influence=self.model.influence)
        key = tuple(extra[group.begin] for group in self.registration)
        if key not in self._looks:
            self._looks.clear()
            self._looks[key] = super().retarding(extra)
        return self._looks[key]

    @cached_property
    def _looks(self) -> dict[tuple[float, ...], Retardance]:
        return {}


def _scaled(influence: ContactInfluence, share: float) -> ContactInfluence:
    loads = influence.directions
    return replace(
        influence, directions=share * (np.eye(influence.shapes[0][0]) if loads is None else loads)
    )


def bench_uncertainty(model: PadModel, paths: tuple[str, ...]) -> BenchUncertainty:
    """What is uncertain about a pad on a bench, without contacts.

    Parameters
    ----------
    model : PadModel
        Of the drawing.
    paths : tuple of str
        Values of the layers to estimate.
    """
    loose = replace(model, sensor=loosened_pad(model.sensor, paths))
    return BenchUncertainty(PadUncertainty.of(loose).model)
