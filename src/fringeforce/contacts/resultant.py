"""What a controller takes from a reading: contact patches, with force, place and slip ratio each.

A uniform pressure leaves hardly a trace in a pad that is wide against its thickness, so that the
sum over all tactels is far less certain than its parts.  Where nothing touches it is known: what
lies beyond the neighbours of touched tactels carries no force, if the reading does not contradict,
and Gauss's rule for conditional distributions tells what that says of the others.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import binary_dilation, label

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.base.errors import InputError
from fringeforce.base.measured import measured
from fringeforce.contacts.force_estimate import ForceEstimate
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor

TOUCHED = 6.0
"""Deviations of a normal force beyond which a tactel is touched."""
CONTRADICTED = 6.0
"""Standard deviations by which forces where nothing touches may differ from zero."""


@dataclass(frozen=True, eq=False, repr=False)
class Resultant:
    """What the forces of some tactels amount to.

    Attributes
    ----------
    tactels : ndarray of int
        Numbers of the tactels.
    force : ndarray, shape (components,)
        Sum of the forces: N and T of a strip; N, T_x and T_y of a pad [N].
    moment : ndarray, shape (3,)
        Moment about the centre of the loaded surface; the force on it is (T_x, T_y, -N) [N m].
    centre : ndarray, shape (dimensions,)
        Centre of pressure along x, and y of a pad [m]; not a number where nothing presses.  A
        single contact on a skin has one however little it presses.
    covariance : ndarray, shape (m, m), m = components + 3 + dimensions + 1 or 3 of a skin
        Joint covariance of force, moment, centre and width, or axes and orientation [rad], in this
        order, to first order.
    width : float or None
        Of a contact on a skin [m]: four standard deviations of its pressure, which is the whole
        width of a Hertz contact; not a number where the centre is none; None of tactels.
    axes : ndarray, shape (2,), or None
        Of a contact on a pad's skin [m]: 2 sqrt(5) standard deviations of its pressure along its
        axes, the longer one first, which are the whole widths of a Hertz contact.
    orientation : float or None
        Of the longer axis, from x towards y, -90 to 90 [degrees]; of no meaning where both are
        alike.

    Examples
    --------
    >>> model = ff.characterize(ff.load_sensor("skin"))
    >>> frame = model.expose([ff.Press(x=1e-3, normal=2.0, tangential=0.4, width=0.8e-3)], rng=0)
    >>> total = ff.Reader(model).read(frame).total
    >>> bool(abs(total.force - [2.0, 0.4]).max() < 0.02)
    True
    >>> bool(abs(total.place[0] - 1e-3) < 6 * total.place_std[0])
    True
    """

    tactels: Index
    force: Array
    moment: Array
    centre: Array
    covariance: Array
    width: float | None = None
    axes: Array | None = None
    orientation: float | None = None

    def __repr__(self) -> str:
        """Force, centre of pressure and widths with their standard deviations."""
        components, std = len(self.force), self.std
        names = ("normal", "tangential") if components == 2 else ("normal", "x", "y")
        parts = [
            f"{name} {measured(float(value), float(error), 'N')}"
            for name, value, error in zip(names, self.force, std, strict=False)
        ]
        errors = std[components + 3 :] * 1e3
        for value, error in zip(self.centre * 1e3, errors, strict=False):
            parts.append(f"at {measured(float(value), float(error), 'mm')}")
        wide = [] if self.width is None else [self.width]
        for value, error in zip(wide, errors[len(self.centre) :], strict=False):
            parts.append(f"width {measured(value * 1e3, float(error), 'mm')}")
        return ", ".join(parts)

    @property
    def values(self) -> Array:
        """What the covariance is of, in its order, shape (m,)."""
        wide = [] if self.width is None else [self.width]
        if self.axes is not None and self.orientation is not None:
            wide = [*self.axes, np.radians(self.orientation)]
        return np.concatenate([self.force, self.moment, self.centre, wide])

    @property
    def spin(self) -> float:
        """Moment about z through the centre of pressure, of a pad [N m]."""
        x, y = self.centre
        return float(self.moment[2] - x * self.force[2] + y * self.force[1])

    @property
    def spin_std(self) -> float:
        """Standard deviation of the spin, to first order [N m]."""
        x, y = self.centre
        slope = np.zeros(len(self.covariance))
        slope[[1, 2, 5, 6, 7]] = y, -x, 1.0, -self.force[2], self.force[1]
        return float(np.sqrt(slope @ self.covariance @ slope))

    @property
    def std(self) -> Array:
        """Standard deviations of the values, shape (m,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0))

    @property
    def place(self) -> Array:
        """Where it acts, as of a `Press`: its centre of pressure, shape (dimensions,) [m]."""
        return self.centre

    @property
    def force_std(self) -> Array:
        """Standard deviations of the force, shape (components,) [N]."""
        return np.sqrt(np.diag(self.force_covariance))

    @property
    def place_std(self) -> Array:
        """Standard deviations of the place, shape (dimensions,) [m]."""
        return np.sqrt(np.diag(self.centre_covariance))

    @property
    def force_covariance(self) -> Array:
        """Covariance of the force [N^2]."""
        return self.covariance[: len(self.force), : len(self.force)]

    @property
    def moment_covariance(self) -> Array:
        """Covariance of the moment, shape (3, 3) [N^2 m^2]."""
        part = slice(len(self.force), len(self.force) + 3)
        return self.covariance[part, part]

    @property
    def centre_covariance(self) -> Array:
        """Covariance of the centre of pressure [m^2]."""
        begin = len(self.force) + 3
        part = slice(begin, begin + len(self.centre))
        return self.covariance[part, part]

    @property
    def width_std(self) -> float | None:
        """Standard deviation of the width [m]."""
        return None if self.width is None else float(self.std[-1])

    @property
    def slip_ratio(self) -> float:
        """|T| / N, which friction limits."""
        return float(np.linalg.norm(self.force[1:]) / self.force[0])

    @property
    def slip_ratio_std(self) -> float:
        """Standard deviation of the slip ratio, to first order."""
        normal, tangential = self.force[0], self.force[1:]
        size = np.linalg.norm(tangential)
        anywhere = np.full(len(tangential), len(tangential) ** -0.5)
        direction = tangential / size if size > 0 else anywhere
        slope = np.concatenate([[-size / normal], direction]) / normal
        return float(np.sqrt(slope @ self.force_covariance @ slope))

    def scaled(self, factor: float, relative: float = 0.0) -> Resultant:
        """The same of other forces in proportion; centre and width stay.

        Parameters
        ----------
        factor : float
            By which force and moment are larger.
        relative : float
            Standard deviation of the factor over it.
        """
        ends, factors = len(self.force) + 3, np.ones(len(self.covariance))
        factors[:ends] = factor
        mode = np.zeros_like(factors)
        mode[:ends] = factor * relative * np.concatenate([self.force, self.moment])
        covariance = np.outer(factors, factors) * self.covariance + np.outer(mode, mode)
        force, moment = factor * self.force, factor * self.moment
        return replace(self, force=force, moment=moment, covariance=covariance)


@dataclass(frozen=True, eq=False)
class Touch:
    """All that touches a sensor.

    Attributes
    ----------
    total : Resultant
        Resultant of all tactels.
    patches : tuple of Resultant
        Single contacts, each of neighbouring tactels that are touched, the strongest first.
    silent : ndarray of bool, shape (n,)
        Tactels that were taken to carry no force; none where the reading contradicts.
    forces : ndarray, shape (n, components)
        Forces, given that those carry none [N].
    covariance : ndarray, shape (n components, n components)
        Covariance of `forces.ravel()` [N^2].
    """

    total: Resultant
    patches: tuple[Resultant, ...]
    silent: Mask
    forces: Array
    covariance: Array


def resultant_matrix(places: ArrayLike) -> Array:
    """From forces of tactels to their sum N, T_x, T_y and its moment about the origin.

    Parameters
    ----------
    places : array_like, shape (n, 1), or (n, 2) of a pad
        Places of the tactels, along x and y [m].

    Returns
    -------
    ndarray, shape (6, n, 2), or (6, n, 3) of a pad
        Sums by the components of each tactel's force; the moment is r x (T_x, T_y, -N) at z = 0.
    """
    where = np.asarray(places, dtype=float)
    n, dimensions = where.shape
    x, y = np.pad(where, ((0, 0), (0, 2 - dimensions))).T
    rows = np.zeros((6, n, 3))
    rows[0, :, 0] = rows[1, :, 1] = rows[2, :, 2] = 1
    rows[3, :, 0], rows[4, :, 0] = -y, x
    rows[5, :, 1], rows[5, :, 2] = -y, x
    return rows[:, :, : dimensions + 1]


def wrenches(forces: Array, places: ArrayLike) -> tuple[Array, Array]:
    """Resultant force and its moment about the middle of the loaded surface, as robots state them.

    Axes are those of the sensor: x along it, z upwards from the loaded surface, so that a pressing
    force points to -z.

    Parameters
    ----------
    forces : ndarray, shape (k, n, components)
        Forces of the tactels [N].
    places : array_like, shape (n, dimensions)
        Places of the tactels [m].

    Returns
    -------
    force : ndarray, shape (k, 3)
        [N].
    torque : ndarray, shape (k, 3)
        [N m].
    """
    sums = np.einsum("rnc,knc->kr", resultant_matrix(places), forces)
    return sums[:, [1, 2, 0]] * [1, 1, -1] + 0.0, sums[:, 3:] + 0.0  # no negative zeros


def resultant(
    places: Array, forces: Array, tactels: Index, covariance: Array | None = None
) -> Resultant:
    """Resultant of some tactels.

    Parameters
    ----------
    places : ndarray, shape (n, dimensions)
        Places of all tactels [m].
    forces : ndarray, shape (n, components)
        Forces of all tactels [N].
    tactels : ndarray of int
        Numbers of the tactels that count.
    covariance : ndarray, shape (n components, n components), optional
        Covariance of `forces.ravel()` [N^2]; the forces are exact if not given.
    """
    where, loads, components = places[tactels], forces[tactels], forces.shape[1]
    push = loads[:, 0].sum()
    centre = loads[:, 0] @ where / push if push > 0 else np.full(components - 1, np.nan)
    sums = resultant_matrix(where)[[*range(components), 3, 4, 5]]
    # how the centre moves as a tactel presses more
    moves = np.zeros((components - 1, *loads.shape))
    moves[:, :, 0] = ((where - centre) / push).T if push > 0 else np.nan
    rows = np.concatenate([sums, moves]).reshape(2 * components + 2, -1)
    force, moment = np.split(rows[: components + 3] @ loads.ravel(), [components])
    spread = np.zeros((loads.size, loads.size))
    if covariance is not None:
        numbers = (components * tactels[:, None] + np.arange(components)).ravel()
        spread = covariance[np.ix_(numbers, numbers)]
    return Resultant(tactels, force, moment, centre, rows @ spread @ rows.T)


def touch(sensor: Sensor | Pad, reading: ForceEstimate) -> Touch:
    """Contact patches of a reading, and the resultant of all forces; of a skin its contacts.

    Parameters
    ----------
    sensor : Sensor or Pad
        The design of the strip or pad.
    reading : fringeforce.Reading
        Forces and covariance are taken as they are; look at its status first.

    Examples
    --------
    >>> model = ff.characterize(ff.load_sensor("saad"))
    >>> forces = np.zeros((11, 2))
    >>> forces[4:6, 0] = 1.0  # two neighbours, pressed alike
    >>> reading = ff.Reader(model).read(model.expose(forces, rng=0))
    >>> (patch,) = ff.touch(model.sensor, reading).patches
    >>> between = model.sensor.tactels.positions[4:6].mean()
    >>> bool(abs(patch.centre[0] - between) < 5 * patch.std[-1] < 1e-4)
    True
    >>> pad = ff.load_sensor("pad").replace(
    ...     tactels={"count": [3, 3]}, camera={"pixels": [64, 64]}
    ... )
    >>> model = ff.characterize(pad)
    >>> forces = np.zeros((9, 3))
    >>> forces[4, 0] = 2.0  # the middle one, pressed
    >>> reading = ff.Reader(model).read(model.expose(forces, rng=0))
    >>> felt = ff.touch(pad, reading)
    >>> len(felt.patches), round(float(felt.total.force[0]), 1)
    (1, 2.0)
    """
    if not isinstance(sensor, Sensor | Pad):
        raise InputError(
            f"Touch is of a design, and this is of the kind {type(sensor).__name__}; of a model "
            "give touch(model.sensor, reading)."
        )
    places, grid = sensor.tactels.places, np.atleast_1d(sensor.tactels.count)
    total = getattr(reading, "total", None)
    if total is not None:  # of a skin, which tells contacts apart itself
        silent = (reading.forces == 0).all(axis=1)
        contacts = getattr(reading, "contacts", ())
        return Touch(total, contacts, silent, reading.forces, reading.covariance)
    around = np.ones((3,) * len(grid), dtype=bool)
    silent = _silent(reading, grid, around)
    forces, covariance = _given_silence(reading, silent)
    deviation = np.sqrt(np.diag(covariance)).reshape(forces.shape)
    touched = ~silent & (forces[:, 0] > TOUCHED * deviation[:, 0])
    labels = np.empty(grid, dtype=int)
    label(touched.reshape(grid), structure=around, output=labels)
    members = [np.flatnonzero(labels.ravel() == one) for one in range(1, labels.max() + 1)]
    patches = [resultant(places, forces, tactels, covariance) for tactels in members]
    patches.sort(key=lambda patch: -patch.force[0])
    total = resultant(places, forces, np.arange(len(places)), covariance)
    return Touch(total, tuple(patches), silent, forces, covariance)


def _silent(reading: ForceEstimate, grid: Index, around: Mask) -> Mask:
    """Tactels away from all that are touched, if the reading agrees that they carry nothing."""
    touched = (np.abs(reading.forces) / reading.std).max(axis=1) > TOUCHED
    far = ~np.asarray(binary_dilation(touched.reshape(grid), around), dtype=bool).ravel()
    rest = np.repeat(far, reading.forces.shape[1])
    if not rest.any():
        return far
    quiet = reading.forces.ravel()[rest]
    # the distance of a part from nothing, in units of its own covariance
    loud = quiet @ np.linalg.solve(reading.covariance[np.ix_(rest, rest)], quiet)
    contradicted = loud > len(quiet) + CONTRADICTED * np.sqrt(2 * len(quiet))
    return far & (not contradicted)


def _given_silence(reading: ForceEstimate, silent: Mask) -> tuple[Array, Array]:
    """Forces (n, components) and their covariance, given that some tactels carry nothing."""
    loads, spread = reading.forces.ravel(), reading.covariance
    zero = np.repeat(silent, reading.forces.shape[1])
    none, free = np.flatnonzero(zero), np.flatnonzero(~zero)
    forces, covariance = np.zeros_like(loads), np.zeros_like(spread)
    # the mean and covariance of some of Gaussian variables, given the others
    gain = np.linalg.solve(spread[np.ix_(none, none)], spread[np.ix_(none, free)]).T
    forces[free] = loads[free] - gain @ loads[none]
    covariance[np.ix_(free, free)] = spread[np.ix_(free, free)] - gain @ spread[np.ix_(none, free)]
    return forces.reshape(reading.forces.shape), covariance
