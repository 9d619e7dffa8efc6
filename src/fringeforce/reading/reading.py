"""What a frame says: forces, how sure they are, and a verdict to act on."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.measured import measured
from fringeforce.contacts.resultant import Resultant

Array = NDArray[np.float64]


class Status(Enum):
    """The verdict on a reading; `advice` says what to do.

    Examples
    --------
    >>> ff.Status.NO_CONTACT.advice
    'Nothing touches the sensor, as far as this frame can tell.'
    """

    OK = "OK"
    NO_CONTACT = "NO_CONTACT"
    AMBIGUOUS = "AMBIGUOUS"
    MODEL_MISMATCH = "MODEL_MISMATCH"
    SATURATED = "SATURATED"
    FRINGES_TOO_DENSE = "FRINGES_TOO_DENSE"
    BAD_FRAME = "BAD_FRAME"

    @property
    def trusted(self) -> bool:
        """Whether forces with this verdict may be used: they explain the frame, or none act."""
        return self in (Status.OK, Status.NO_CONTACT)

    @property
    def usable(self) -> bool:
        """Whether some load explains the frame, or none acts."""
        return self.trusted or self is Status.AMBIGUOUS

    @property
    def advice(self) -> str:
        """What to do."""
        return _ADVICE[self]


_ADVICE = {
    Status.OK: "Use the forces with their deviations.",
    Status.NO_CONTACT: "Nothing touches the sensor, as far as this frame can tell.",
    Status.AMBIGUOUS: "Two loads explain this frame within its noise; both are in the reading. "
    "Use what you know of the contact to choose, or read again under a slightly different load.",
    Status.MODEL_MISMATCH: "No load explains this frame. Check that the camera looks at this "
    "sensor, its gain, offset and alignment; calibrate if they are right.",
    Status.SATURATED: "Bright fringes exceed the converter's range. Shorten the exposure or lower "
    "the gain.",
    Status.FRINGES_TOO_DENSE: "Fringes are finer than the pixels resolve. Reduce the load, or use "
    "more pixels, a stiffer cover or a longer wavelength.",
    Status.BAD_FRAME: "The frame cannot be used. Check the camera and the connection.",
}


NOT_FOUND_YET = (
    "What differs from the design had not been asked for when this reading was pickled; ask for "
    "its `findings` before, or read the frame again."
)
"""The findings of a pickled reading without any: they may take a minute, and a reader, to find."""


@dataclass(frozen=True, eq=False)
class Traction:
    """Force per area along a skin.

    Attributes
    ----------
    places : ndarray, shape (n,)
        Along the strip [m].
    values, std : ndarray, shape (n, 2)
        Pressure and shear towards +x, and their standard deviations [Pa].
    """

    places: Array
    values: Array
    std: Array

    def scaled(self, factor: float, relative: float = 0.0) -> Traction:
        """The same of other forces in proportion, as of `Reading.scaled`."""
        values = factor * self.values
        return Traction(self.places, values, np.hypot(factor * self.std, relative * values))


@dataclass(frozen=True, eq=False, repr=False)
class Reading:
    """Forces from one frame.

    Attributes
    ----------
    forces : ndarray, shape (n, components)
        Force on every tactel [N]: normal and tangential of a strip, normal and tangential along x
        and y of a pad; not a number for a bad frame.
    covariance : ndarray, shape (n * components, n * components)
        Of the forces in the order of `forces.ravel()` [N^2].
    phase : ndarray, shape (n_pixels,) or (2, rows, columns)
        Phase lead that the forces cause [rad]; of a pad the two parts of the retardance over both
        passes, as `PadModel.retardance` tells.
    chi2 : float
        Reduced chi-square; near one if the model explains the frame.
    status : Status
        The verdict.
    detail : str
        What exactly is the matter, where there is more to say than the advice.
    alternatives : ndarray, shape (k, n, components)
        Other forces that explain an ambiguous frame as well [N].
    limited : ndarray of bool, shape (n,)
        Tactels whose forces were limited to what a dry contact can exert; none unless asked for.
    tracked : bool
        Whether the frame was followed from the last one rather than searched.
    probability : float
        That the forces belong to the load that acts, and not to another that explains the frame.
    contacts : tuple of Resultant
        Single contacts on a skin, the strongest first; none of tactels, whose forces `touch` adds
        up.
    total : Resultant or None
        All contacts on a skin together.
    traction : Traction or None
        Of a skin: pressure and shear along it.
    findings : tuple of str
        What seems to differ from the design, where no load explains the frame, found when it is
        first asked for, which takes some tenths of a second, or seconds for a pad; of a pad also
        where loads explain it, but a departure shows beside them; or that nothing but creep shows.

    Notes
    -----
    Much is computed when it is first asked for.  Copies find later what the original would; pickles
    hold all numbers, and the findings if they were asked for before, or else a sentence that says
    so: only the reader, which they do not hold, can find them.

    Examples
    --------
    >>> model = ff.characterize(ff.load_sensor("saad"))
    >>> reading = ff.Reader(model).read(model.expose(ff.polar(1.0, angle=10, n=11), rng=0))
    >>> reading.status.name, reading.forces.shape, reading.covariance.shape
    ('OK', (11, 2), (22, 22))
    >>> bool((abs(reading.magnitude - 1) < 6 * reading.magnitude_std).all())
    True
    >>> reading
    <Reading OK, 11 loads, 10.8 N normal>
    """

    forces: Array
    covariance: Array
    phase: Array
    chi2: float
    status: Status
    detail: str
    alternatives: Array
    limited: NDArray[np.bool_]
    tracked: bool = False
    probability: float = 1.0
    # a default of the class would hide what is computed later
    findings: tuple[str, ...] = field(default_factory=tuple)
    contacts: tuple[Resultant, ...] = field(default_factory=tuple)
    total: Resultant | None = field(default_factory=lambda: None)
    traction: Traction | None = field(default_factory=lambda: None)

    @classmethod
    def of(
        cls,
        forces: Array | Callable[[], Array],
        chi2: float,
        status: Status,
        *,
        shape: tuple[int, ...] = (),
        covariance: Array | Callable[[], Array],
        phase: Array | Callable[[], Array],
        detail: str = "",
        alternatives: Array | None = None,
        limited: NDArray[np.bool_] | None = None,
        tracked: bool = False,
        probability: float = 1.0,
        findings: tuple[str, ...] | Callable[[], tuple[str, ...]] = (),
        contacts: tuple[Resultant, ...] | Callable[[], tuple[Resultant, ...]] = (),
        total: Resultant | Callable[[], Resultant] | None = None,
        traction: Traction | Callable[[], Traction] | None = None,
        std: Callable[[], Array] | None = None,
    ) -> Reading:
        """A reading, of which much may be computed when it is first asked for.

        Parameters
        ----------
        chi2, status, detail, tracked
            Attributes.
        forces, covariance, phase, findings, contacts, total, traction
            Attributes, or functions that return them.
        shape : tuple of int
            Of the forces, where a function returns them.
        alternatives, limited
            Attributes; none if not given.
        """
        shape = shape if callable(forces) else forces.shape
        later: dict[str, Any] = {
            "forces": forces,
            "covariance": covariance,
            "phase": phase,
            "findings": findings,
            "contacts": contacts,
            "total": total,
            "traction": traction,
        }
        if std is not None:
            later["deviations"] = std
        reading = object.__new__(cls)
        reading.__dict__.update(
            {name: value for name, value in later.items() if not callable(value)},
            chi2=chi2,
            status=status,
            detail=detail,
            alternatives=np.empty((0, *shape)) if alternatives is None else alternatives,
            limited=np.zeros(shape[0], dtype=bool) if limited is None else limited,
            tracked=tracked,
            probability=probability,
            _later={name: value for name, value in later.items() if callable(value)},
        )
        return reading

    def __repr__(self) -> str:
        """One line; `str` gives the forces with their deviations."""
        if not self.status.usable:
            return f"<Reading {self.status.name}>"
        normal = f"{self.forces[:, 0].sum():.3g} N normal"
        return f"<Reading {self.status.name}, {len(self.forces)} loads, {normal}>"

    def __str__(self) -> str:
        """Verdict, then contacts of a skin or forces of tactels, in lines."""
        if not self.status.usable:
            return f"{self.status.name}: {self.detail or self.status.advice}"
        head = f"{self.status.name} (probability {self.probability:.4g}, chi2 {self.chi2:.3g})"
        if self.total is not None:
            return "\n".join([head, *map(str, self.contacts)])
        names = ("normal", "tangential") if self.forces.shape[1] == 2 else ("normal", "x", "y")
        rows = [
            ", ".join(
                f"{name} {measured(value, error, 'N')}"
                for name, value, error in zip(names, force, std, strict=True)
            )
            for force, std in zip(self.forces.tolist(), self.std.tolist(), strict=True)
        ]
        return "\n".join([head, *(f"{number:4}  {row}" for number, row in enumerate(rows, 1))])

    def with_findings(self, findings: Callable[[], tuple[str, ...]]) -> Reading:
        """The same with findings that are computed when they are first asked for."""
        reading, known = object.__new__(type(self)), dict(self.__dict__)
        known.pop("findings", None)
        reading.__dict__.update(known, _later={**known.get("_later", {}), "findings": findings})
        return reading

    def scaled(self, factor: float, relative: float = 0.0) -> Reading:
        """The same of other loads in proportion; places and widths of contacts stay.

        Parameters
        ----------
        factor : float
            By which forces and tractions are larger.
        relative : float
            Standard deviation of the factor over it.
        """
        if not self.status.usable:
            return self
        felt = self.__dict__.get("total", True) is not None

        def covariance() -> Array:
            mode = factor * relative * self.forces.ravel()
            return factor**2 * self.covariance + np.outer(mode, mode)

        def total() -> Resultant:
            assert self.total is not None
            return self.total.scaled(factor, relative)

        def traction() -> Traction:
            assert self.traction is not None
            return self.traction.scaled(factor, relative)

        line = felt and self.__dict__.get("traction", True) is not None
        return Reading.of(
            forces=lambda: factor * self.forces,
            shape=self.alternatives.shape[1:],
            chi2=self.chi2,
            status=self.status,
            covariance=covariance,
            phase=lambda: self.phase,
            detail=self.detail,
            alternatives=factor * self.alternatives,
            limited=self.limited,
            tracked=self.tracked,
            probability=self.probability,
            findings=(lambda: self.findings) if self._undiagnosed else self.findings,
            contacts=lambda: tuple(one.scaled(factor, relative) for one in self.contacts),
            total=total if felt else None,
            traction=traction if line else None,
            std=lambda: np.hypot(factor * self.std, factor * relative * self.forces),
        )

    def saying(self, *findings: str) -> Reading:
        """The same with findings."""
        reading = object.__new__(type(self))
        reading.__dict__.update(self.__dict__, findings=findings)
        return reading

    def fading(self, words: str) -> Reading:
        """The same of a frame that shows nothing but what earlier loads left, with a finding."""
        reading = self.saying(words)
        reading.__dict__.update(status=Status.NO_CONTACT, detail=words, contacts=())
        return reading

    def departing(self, *findings: str) -> Reading:
        """The same of a frame that shows a departure from the design: forces are not to be used."""
        reading = self.saying(*findings)
        reading.__dict__.update(status=Status.MODEL_MISMATCH, probability=0.0, tracked=False)
        return reading

    def __getattr__(self, name: str) -> Array:
        """Compute what was deferred; Python comes here only for what is not there yet."""
        later = self.__dict__.get("_later", {})
        if name not in later:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return self.__dict__.setdefault(name, later[name]())

    def __getstate__(self) -> dict[str, Any]:
        """All numbers, for pickles: without the reader, which alone could find what differs."""
        values = dict(self.__dict__)
        for name in values.pop("_later", {}):
            skipped = name == "findings" and self._undiagnosed
            values[name] = (NOT_FOUND_YET,) if skipped else getattr(self, name)
        return values

    def __copy__(self) -> Reading:
        """The same arrays, and what was not asked for yet is computed when it is."""
        again = object.__new__(type(self))
        again.__dict__.update(self.__dict__)
        return again

    def __deepcopy__(self, memo: dict[int, Any]) -> Reading:
        """Arrays of its own; findings that were not asked for yet are found when they are."""
        again = object.__new__(type(self))
        again.__dict__.update(deepcopy(self.__getstate__(), memo))
        if not self._undiagnosed:
            return again
        return again.with_findings(self.__dict__["_later"]["findings"])

    @property
    def _undiagnosed(self) -> bool:
        """Whether the findings have to be computed, which has not been asked for."""
        return "findings" in self.__dict__.get("_later", {}) and "findings" not in self.__dict__

    @property
    def std(self) -> Array:
        """Standard deviations of the forces, shape (n, components) [N]."""
        if "deviations" in {*self.__dict__, *self.__dict__.get("_later", {})}:
            return self.deviations
        return np.sqrt(np.diag(self.covariance)).reshape(self.forces.shape)

    @property
    def ok(self) -> bool:
        """Whether one load explains the frame."""
        return self.status is Status.OK

    @property
    def trusted(self) -> bool:
        """Whether the forces may be used: they explain the frame, or nothing touches."""
        return self.status.trusted

    @property
    def advice(self) -> str:
        """What to do, in words."""
        said = (self.detail, self.status.advice, *self.findings[:1])
        return " ".join(part for part in said if part)

    @property
    def magnitude(self) -> Array:
        """Magnitude of the force on every tactel, shape (n,) [N]."""
        return np.asarray(np.linalg.norm(self.forces, axis=1))

    @property
    def angle(self) -> Array:
        """Angle from the surface normal, shape (n,) [degrees].

        Of a strip it is positive towards +x; of a pad it is the angle of the cone around the
        normal, from 0 to 180.
        """
        return np.degrees(np.arctan2(self._tangential[0], self.forces[:, 0]))

    @property
    def magnitude_std(self) -> Array:
        """Standard deviation of the magnitude to first order, shape (n,) [N].

        At no force, where there is no direction, it is that of the mean direction.
        """
        size = self.magnitude[:, None]
        somewhere = np.full_like(self.forces, self.forces.shape[1] ** -0.5)
        return self._propagated(np.divide(self.forces, size, out=somewhere, where=size > 0))

    @property
    def angle_std(self) -> Array:
        """Standard deviation of the angle to first order, at most 180, shape (n,) [degrees]."""
        size, direction = self._tangential
        turned = np.column_stack([-size, self.forces[:, :1] * direction])
        square = self.magnitude[:, None] ** 2
        anywhere = np.full_like(turned, np.inf)
        gradient = np.divide(turned, square, out=anywhere, where=square > 0)
        found = np.minimum(np.degrees(self._propagated(gradient)), 180)
        return np.where(square[:, 0] > 0, found, 180.0)

    @property
    def _tangential(self) -> tuple[Array, Array]:
        """Tangential force along its direction, shape (n,), and the direction (n, components - 1).

        The direction of a strip is always +x.
        """
        tangential = self.forces[:, 1:]
        if tangential.shape[1] == 1:
            return tangential[:, 0], np.ones_like(tangential)
        size = np.asarray(np.linalg.norm(tangential, axis=1))
        anywhere = np.full_like(tangential, tangential.shape[1] ** -0.5)
        direction = np.divide(tangential, size[:, None], out=anywhere, where=size[:, None] > 0)
        return size, direction

    def _propagated(self, gradient: Array) -> Array:
        n, components = gradient.shape
        blocks = self.covariance.reshape(n, components, n, components).diagonal(axis1=0, axis2=2)
        return np.sqrt(np.einsum("ni,ijn,nj->n", gradient, blocks, gradient))
