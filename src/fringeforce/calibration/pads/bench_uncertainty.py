"""What is uncertain about a pad on a bench, as unknowns beside the forces of a frame's contacts.

They are those of `PadUncertainty`, but for two: values of the layers enter by their logarithms, and
contacts, which may be anywhere, have places and widths of their own in the place of the polynomials
of tactels.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np
from scipy.optimize import brentq
from scipy.sparse import csr_array, eye_array
from scipy.special import ndtr

from fringeforce.base.arrays import Array, Index, Mask, Single
from fringeforce.calibration.bench_expectation import BLUR as POINT_SPREAD
from fringeforce.calibration.bench_expectation import DOUBT, FIELDS, LAMP
from fringeforce.calibration.bench_expectation import GAMMA as POWER
from fringeforce.calibration.design_entries import DEVIATION, design_value
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import Tolerances, with_values
from fringeforce.models.as_built import PLACEMENT, RESIDUAL, SIZE
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_camera import SHARPEST_LENS, CameraUncertainty
from fringeforce.models.pad_contacts import ContactChanges, ContactInfluence
from fringeforce.models.pad_fields import PadResidual
from fringeforce.models.pad_influence import PadInfluence, Retardance
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.models.pad_unknowns import BLUR, EFFECTS, GAMMA, LAYERS, Group
from fringeforce.models.smooth_field import SmoothField
from fringeforce.optics.area_camera import FARTHEST, Lens

SHIFT, SCALE = 1e-3, 5e-2
"""Deviations, before any frame is seen, of the camera's shift [m] and scale."""
SHAPES = 4
"""Unknowns of a contact besides its forces."""
KEPT = 8
"""Lenses that are kept: one, and those a little sharper and less sharp."""
FAR = 3.0
"""Deviations of the blur's unknown over which it is not linear."""
STEP = 3e-3
"""Step of derivatives of the lens: some hundredths of a pixel, squared."""
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
        wide[path] = DEVIATION["value"] * design_value(pad, path)
    wide |= {
        "camera.amplitude": LAMP * camera.amplitude,
        "camera.offset": FIELDS["dark"] * camera.amplitude,
        "camera.shift_x": SHIFT,
        "camera.shift_y": SHIFT,
        "camera.scale": SCALE,
        "camera.blur": POINT_SPREAD / 2 * pixel,
        GAMMA: POWER,
        RESIDUAL: FIELDS["residual"],
    }
    stated = {path: std for path, std in pad.tolerances.items() if path not in OWN}
    stated.pop("polariscope.wavelength", None)  # like a stronger effect
    stated.pop("tactels.pitch", None)  # contacts lie where they are written down
    drift, uneven = camera.drift or DOUBT["gain"], camera.unevenness or FIELDS["bright"]
    return pad.model_copy(
        update={
            "tolerances": Tolerances({**wide, **stated}),
            "camera": camera.model_copy(update={"drift": drift, "unevenness": uneven}),
        }
    )


def is_layer(path: str) -> bool:
    """Whether a value enters by its logarithm."""
    return path in EFFECTS or path.startswith(LAYERS)


@dataclass(frozen=True, eq=False)
class ContactShapes:
    """What places, widths and exponents of contacts change of the light, as `ContactLight`.

    Attributes
    ----------
    units : tuple of float, length t
        Of each of them.
    shapes : tuple of ContactInfluence, length t
        Derivatives by them.
    """

    units: tuple[float, ...]
    shapes: tuple[ContactInfluence, ...]

    def forward(self, shares: Array, forces: Array) -> Single:
        """Spline coefficients, shape (2, modes, ny, nx) [rad]."""
        found = np.zeros(self.shapes[0].shapes[1], dtype=np.float32)
        for unit, influence, share in zip(self.units, self.shapes, shares, strict=True):
            if share.any():
                found += influence.forward((forces * (unit * share)[:, None]).ravel())
        return found

    def adjoint(self, grid: Single, tactels: Index) -> Array:
        """From derivatives by the coefficients to those by shares times forces, (t, l, 3)."""
        found = [
            unit * influence.adjoint(grid).reshape(-1, 3)[tactels]
            for unit, influence in zip(self.units, self.shapes, strict=True)
        ]
        return np.array(found)

    def matrices(self, x: Array, y: Array, begin: Index, end: Index) -> dict[int, Single]:
        """Retardance at all pairs of places, (3, 2, modes, r * c, l) of every contact."""
        each = [
            np.float32(unit) * influence.matrix(x, y)
            for unit, influence in zip(self.units, self.shapes, strict=True)
        ]
        found = np.moveaxis(np.array(each), (0, -1), (-1, 0))
        return {
            contact: np.ascontiguousarray(
                found[3 * contact : 3 * contact + 3, ..., begin[contact] : end[contact]]
            )
            for contact in np.flatnonzero(end > begin).tolist()
        }


@dataclass(frozen=True, eq=False)
class BenchCamera(CameraUncertainty):
    """Light and camera, where the blur's unknown is the second moment of what it spreads.

    That is how a blur acts.
    """

    def blur(self, extra: Array, std: float) -> tuple[float, float]:
        """Blur under unknowns, and what it changes at most over FAR deviations of its own [m].

        A little spread is that of no blur or of a fifth of a pixel: the slope there says nothing.
        """
        group = self.group(BLUR)
        assert group is not None
        first, unit = self._drawn_moment
        unknown = float(extra[group.begin])
        low, here, high = (
            self.pixel * _of_moment(first + unit * (unknown + way * FAR * std))
            for way in (-1, 0, 1)
        )
        return here, max(high - here, here - low) / (FAR * std)

    def lens_change(self, extra: Array) -> tuple[Lens, Lens, float]:
        """Lenses a little sharper and a little less sharp, and how far apart the unknowns are."""
        group = self.group(BLUR)
        assert group is not None
        here = float(extra[group.begin])
        return self.lens_at(here - STEP), self.lens_at(here + STEP), 2 * STEP

    def lens_at(self, unknown: float) -> Lens:
        """The lens under an unknown; what would be less than no blur sharpens as much."""
        if unknown not in self._lenses:
            if len(self._lenses) > KEPT:
                self._lenses.clear()
            first, unit = self._drawn_moment
            moment = first + unit * unknown
            blur = self.pixel * max(_of_moment(abs(moment)), SHARPEST_LENS)
            lens = Lens.of(with_values(self.model.sensor, {BLUR: float(blur)}))
            assert lens is not None
            if moment < 0:
                rows, columns = (
                    csr_array(2 * eye_array(spread.shape[0]) - spread)
                    for spread in (lens.rows.toarray(), lens.columns.toarray())
                )
                lens = Lens(rows, columns)
            self._lenses[unknown] = lens
        return self._lenses[unknown]

    @cached_property
    def _lenses(self) -> dict[float, Lens]:
        return {}

    @cached_property
    def _drawn_moment(self) -> tuple[float, float]:
        """Second moment of the lens as drawn, and its standard deviation [pixels^2]."""
        group = self.group(BLUR)
        assert group is not None
        drawn = (self.model.sensor.camera.blur or 0.0) / self.pixel
        first = _moment(drawn)
        return first, _moment(drawn + group.std / self.pixel) - first


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
        That of the same pad, whose camera and smooth fields are taken.
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
        shared = super().groups if self.shared is None else self.shared.groups
        begin = shared[-1].end
        own = Group(PLACEMENT, begin, begin + SHAPES * self.count, 1.0)
        return (*shared, own) if self.count else shared

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

    @property
    def turning(self) -> tuple[Group, ...]:
        """None: values of layers enter by powers of their logarithms."""
        return ()

    @property
    def seen_turning(self) -> tuple[Group, ...]:
        """None: matrices are made anew where the camera looks."""
        return ()

    @property
    def scaling(self) -> tuple[Group, ...]:
        """None, either."""
        return ()

    def logarithmic(self, group: Group) -> float:
        """Standard deviation of the logarithm of a value."""
        return group.std / design_value((self.shared or self).model.sensor, group.path)

    @cached_property
    def contacts(self) -> ContactShapes | None:
        """Light of places along x and along y, widths, and exponents."""
        if self.changes is None or not self.count:
            return None
        return ContactShapes((self.units[0], *self.units, 1.0), self.changes.shapes)

    def shown(self, forces: Array) -> Mask:
        """All unknowns show: forces and places are known beforehand."""
        return np.ones(self.size, dtype=bool)

    # what all frames share

    @cached_property
    def camera(self) -> BenchCamera:
        """Light and camera with what is uncertain about them."""
        return BenchCamera(self.model, self.groups) if self.shared is None else self.shared.camera

    @cached_property
    def shades(self) -> SmoothField:
        """Share by which every pixel is brighter."""
        return super().shades if self.shared is None else self.shared.shades

    @cached_property
    def residual(self) -> PadResidual:
        """Retardance without forces."""
        return super().residual if self.shared is None else self.shared.residual

    def retarding(self, extra: Array) -> Retardance:
        """From spline coefficients to the pixels, where they look under unknowns."""
        if self.shared is not None:
            found = self.shared.retarding(extra)
            return replace(found, influence=self.model.influence)
        key = tuple(extra[group.begin] for group in self.camera.registration)
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


def _moment(blur: float) -> float:
    """Second moment of what a Gaussian spreads over pixels [pixels^2].

    Of its values k at the pixels, with the shares of the Gaussian from k - 1/2 to k + 1/2.
    """
    if blur < SHARPEST_LENS:
        return 0.0
    k = np.arange(int(FARTHEST * blur) + 2)
    return float(2 * ((2 * k + 1) * ndtr(-(k + 0.5) / blur)).sum())


def _of_moment(moment: float) -> float:
    """Standard deviation of the Gaussian with a second moment [pixels]; none below zero."""
    if moment <= 0.0:
        return 0.0
    most = 1.0 + np.sqrt(moment)
    root = brentq(lambda blur: _moment(blur) - moment, 0.0, most)
    return float(cast(float, root))


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
