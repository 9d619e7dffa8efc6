"""What a controller takes from a reading: contact patches, with force, place and slip ratio each.

A uniform pressure leaves hardly a trace in a pad that is wide against its thickness, so that the
sum over all tactels is far less certain than its parts.  Where nothing touches it is known: what
lies beyond the neighbours of touched tactels carries no force, if the reading does not contradict,
and Gauss's rule for conditional distributions tells what that says of the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import binary_dilation, label

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.contacts.force_estimate import ForceEstimate
from fringeforce.design.pad import Pad

TOUCH = 6.0
"""Deviations of a normal force beyond which a tactel is touched."""
CONTRADICTED = 6.0
"""Standard deviations by which silence may be too loud to be believed."""
_AROUND = np.ones((3, 3), dtype=bool)


@dataclass(frozen=True, eq=False)
class Wrench:
    """Sum of some forces.

    Attributes
    ----------
    force : ndarray, shape (3,)
        N, T_x, T_y [N].
    force_covariance : ndarray, shape (3, 3)
        [N^2].
    moment : ndarray, shape (3,)
        About the centre of the pad's surface; the force on the pad is (T_x, T_y, -N) [N m].
    moment_covariance : ndarray, shape (3, 3)
        [N^2 m^2].
    """

    force: Array
    force_covariance: Array
    moment: Array
    moment_covariance: Array

    @property
    def slip_ratio(self) -> float:
        """|T| / N, which friction limits."""
        return float(np.hypot(*self.force[1:]) / self.force[0])

    @property
    def slip_ratio_std(self) -> float:
        """Standard deviation of the quantity, to first order."""
        normal, tangential = self.force[0], self.force[1:]
        size = np.hypot(*tangential)
        direction = tangential / size if size > 0 else np.full(2, np.sqrt(0.5))
        slope = np.concatenate([[-size / normal], direction]) / normal
        return float(np.sqrt(slope @ self.force_covariance @ slope))


@dataclass(frozen=True, eq=False)
class Patch(Wrench):
    """Neighbouring tactels that are touched.

    Attributes
    ----------
    tactels : ndarray of int
        Numbers of the tactels.
    centre : ndarray, shape (2,)
        Centre of pressure along x and y [m].
    centre_covariance : ndarray, shape (2, 2)
        [m^2].
    """

    tactels: Index
    centre: Array
    centre_covariance: Array


@dataclass(frozen=True, eq=False)
class Touch:
    """All that touches the pad.

    Attributes
    ----------
    total : Wrench
        Wrench of all tactels.
    patches : tuple of Patch
        Single contacts, the strongest first.
    silent : ndarray of bool, shape (n,)
        Tactels that were taken to carry no force; none where the reading contradicts.
    forces : ndarray, shape (n, 3)
        Forces, given that those carry none [N].
    covariance : ndarray, shape (3n, 3n)
        Covariance of these forces [N^2].
    """

    total: Wrench
    patches: tuple[Patch, ...]
    silent: Mask
    forces: Array
    covariance: Array


def resultant_matrix(places: ArrayLike) -> Array:
    """From forces of tactels to their sum N, T_x, T_y and its moment about the origin.

    Parameters
    ----------
    places : array_like, shape (n, 1), or (n, 2) of a pad
        Of the tactels, along x and y [m].

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
        Of the tactels [m].

    Returns
    -------
    force : ndarray, shape (k, 3)
        [N].
    torque : ndarray, shape (k, 3)
        [N m].
    """
    sums = np.einsum("rnc,knc->kr", resultant_matrix(places), forces)
    return sums[:, [1, 2, 0]] * [1, 1, -1] + 0.0, sums[:, 3:] + 0.0  # no negative zeros


def touch(pad: Pad, reading: ForceEstimate) -> Touch:
    """Contact patches of a reading, and the sum of all forces.

    Parameters
    ----------
    pad : Pad
        The design.
    reading : fringeforce.Reading
        Forces and covariance are taken as they are; look at its status first.

    Examples
    --------
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
    silent = _silent(pad, reading)
    forces, covariance = _given_silence(reading, np.repeat(silent, 3))
    normal = forces.reshape(-1, 3)[:, 0]
    deviation = np.sqrt(np.diag(covariance)[::3])
    touched = ~silent & (normal > TOUCH * deviation)
    labels = np.empty(pad.tactels.count, dtype=int)
    label(touched.reshape(pad.tactels.count), structure=_AROUND, output=labels)
    patches = [
        _patch(pad, forces, covariance, np.flatnonzero(labels.ravel() == one + 1))
        for one in range(int(labels.max()))
    ]
    patches.sort(key=lambda patch: -patch.force[0])
    everything = np.arange(pad.tactels.total)
    total = Wrench(*_sums(pad, forces, covariance, everything))
    return Touch(total, tuple(patches), silent, forces.reshape(-1, 3), covariance)


def _silent(pad: Pad, reading: ForceEstimate) -> Mask:
    """Tactels away from all that are touched, if the reading agrees that they carry nothing."""
    deviations = np.abs(reading.forces) / reading.std
    touched = deviations.max(axis=1) > TOUCH
    near = np.asarray(binary_dilation(touched.reshape(pad.tactels.count), _AROUND), dtype=bool)
    far = ~near.ravel()
    rest = np.repeat(far, 3)
    if not rest.any():
        return far
    quiet = reading.forces.ravel()[rest]
    # the distance of a part from nothing, in units of its own covariance
    loud = quiet @ np.linalg.solve(reading.covariance[np.ix_(rest, rest)], quiet)
    if loud > len(quiet) + CONTRADICTED * np.sqrt(2 * len(quiet)):
        return np.zeros(pad.tactels.total, dtype=bool)
    return far


def _given_silence(reading: ForceEstimate, silent: Mask) -> tuple[Array, Array]:
    """Forces and covariance given that some are zero, shapes (3n,), (3n, 3n)."""
    loads, free = reading.forces.ravel(), np.flatnonzero(~silent)
    forces, covariance = np.zeros_like(loads), np.zeros((len(loads), len(loads)))
    if not len(free):
        return forces, covariance
    none = np.flatnonzero(silent)
    spread = reading.covariance
    # the mean and covariance of some of Gaussian variables, given the others
    gain = np.linalg.solve(spread[np.ix_(none, none)], spread[np.ix_(none, free)]).T
    forces[free] = loads[free] - gain @ loads[none]
    covariance[np.ix_(free, free)] = spread[np.ix_(free, free)] - gain @ spread[np.ix_(none, free)]
    return forces, covariance


def _patch(pad: Pad, forces: Array, covariance: Array, tactels: Index) -> Patch:
    places, numbers = pad.tactels.places[tactels], 3 * tactels
    normal = forces[numbers]
    centre = normal @ places / normal.sum()
    lever = (places - centre) / normal.sum()
    spread = lever.T @ covariance[np.ix_(numbers, numbers)] @ lever
    return Patch(*_sums(pad, forces, covariance, tactels), tactels, centre, spread)


def _sums(
    pad: Pad, forces: Array, covariance: Array, tactels: Index
) -> tuple[Array, Array, Array, Array]:
    """Force, its covariance, moment and its covariance of some tactels."""
    rows = resultant_matrix(pad.tactels.places[tactels]).reshape(6, -1)
    numbers = (3 * tactels[:, None] + np.arange(3)).ravel()
    loads, spread = forces[numbers], covariance[np.ix_(numbers, numbers)]
    add, lever = rows[:3], rows[3:]
    return add @ loads, add @ spread @ add.T, lever @ loads, lever @ spread @ lever.T
