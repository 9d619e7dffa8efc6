"""Phase of contacts at given places, as a function of the design and of the camera's place.

A contact enters through the moments of its traction about its place (`frame_model`).  The influence
of every moment is solved at one design and a step to both sides of each value, and a parabola goes
through them; along the strip it is a spline, so that the camera may move.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property, lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.sparse import csr_array

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.calibration.design_entries import EFFECTS, POSITIONS, varied
from fringeforce.design.light import Camera
from fringeforce.design.strip import Sensor, Transducer
from fringeforce.mechanics.solid.mesh import Grading
from fringeforce.mechanics.solid.strip import QUICK, STRIP
from fringeforce.mechanics.surface_influence import SurfaceInfluence, surface_influence
from fringeforce.models.line_moments import line_moments, mixtures, moments_within
from fringeforce.models.node_splines import fitted, sampled
from fringeforce.models.strip_width import light_line
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

SOLVED = 16
"""Solved designs that are kept, some megabytes: other loads of the same bench need them again."""
CARRIED = 0.1
"""Change of an entry, mostly a logarithm, over which curvatures are carried: slopes err by half of
its square there, and values by that share of what is left to the design that was solved."""
PER_COVER = 10
"""Places along the strip per thickness of the cover, between which influence is a spline."""


@dataclass(frozen=True, eq=False)
class ContactSize:
    """How far contacts may lie from their places, and how wide they are.

    Attributes
    ----------
    place : float
        Unit of the unknown places [m].
    width, width_std : float
        Width that is expected if nobody states one, and unit of the unknown widths [m].
    widest : float
        Likely width at most [m].
    profile : float
        Of their tractions, as in `FrameModel`.
    reach : float
        Unit of length of the moments, as far as a contact reaches [m].
    """

    place: float
    width: float
    width_std: float
    widest: float
    profile: float
    reach: float


@dataclass(frozen=True, eq=False)
class ContactPhases:
    """Phase per force of contacts at C places, about one design.

    Attributes
    ----------
    centre : ndarray, shape (d,)
        Entries of the design, as in `design_entries`.
    half : float
        Half the length of the strip [m].
    grid : ndarray, shape (G,)
        Places along the strip between which the phase is a cubic [m].
    lead : ndarray, shape (1 + 2d, 4, G - 1, C, 2, k)
        Coefficients of these cubics: of k mixtures of moments, then of its slopes and of its half
        curvatures by the entries [rad/N].
    mixing : ndarray, shape (k, K)
        The mixtures from the moments.
    size : ContactSize
        Of the contacts.
    fine : ndarray, shape (C, 2, K, G)
        What fine bricks add to the moments that coarse ones give [rad/N]: it hardly changes with
        the design.  Zero in a plane, whose elements are fine.
    places : ndarray, shape (C,)
        Of the contacts [m].
    shapes : ndarray, shape (C, 2, K)
        Moments of their tractions less those of the profile.
    step : float
        Of the entries, to both sides of the design at which the curvatures were solved.
    origin : ndarray, shape (d,)
        That design.
    bends : ndarray, shape (2, d, C, 2, K, G)
        Slopes and half curvatures of the moments there [rad/N]; zero by what the phase is
        proportional to.
    """

    centre: Array
    half: float
    grid: Array
    lead: Array
    mixing: Array
    size: ContactSize
    fine: Array
    places: Array
    shapes: Array
    step: float
    origin: Array
    bends: Array

    def profiles(self, design: Array, x: Array, nodes: int) -> Array:
        """Coefficients at the nodes of the phase of every contact, shape (C, 2, k, m) [rad/N].

        Parameters
        ----------
        design : ndarray, shape (d,)
            Entries near the centre.
        x : ndarray, shape (s,)
            Places of the samples between the nodes [m].
        nodes : int
            Their number m.
        """
        return self._evaluated(design, x, nodes).profiles

    def slopes(self, design: Array, x: Array, drawn: Array, nodes: int) -> Array:
        """Changes of the profiles with every entry, with the camera's shift [m] and with its scale.

        Parameters
        ----------
        design, x, nodes
            As of `profiles`.
        drawn : ndarray, shape (s,)
            Where the samples lie for a camera as drawn [m].

        Returns
        -------
        ndarray, shape (d + 2, C, 2, k, m)
        """
        here, t = self._evaluated(design, x, nodes), design - self.centre
        onto = sampled(len(x), nodes)
        value, slope = onto @ here.values, onto @ here.slopes
        wide = onto @ (here.slopes * drawn[:, None]).tocsr()
        leads = (self.lead[1 + i] + 2 * t[i] * self.lead[1 + len(t) + i] for i in range(len(t)))
        changes = [self._fitted(value, lead, len(x)) for lead in leads]
        changes += [self._fitted(moved, here.lead, len(x)) for moved in (slope, wide)]
        return np.array(changes)

    def carried(self, values: Array, x: Array, nodes: int) -> Array:
        """Coefficients at the nodes, shape (q, F, m), of values at the grid, shape (q, F, G)."""
        return self._of_cubics(self._along(x)[0], values, len(x), nodes)

    def carried_slopes(
        self, values: Array, x: Array, drawn: Array, nodes: int
    ) -> tuple[Array, Array]:
        """Their changes with the camera's shift [1/m] and with its scale, shape (F, m) each.

        Of values of shape (F, G); other parameters as of `slopes`.
        """
        slopes = self._along(x)[1]
        wide = (slopes * drawn[:, None]).tocsr()
        shift, scale = (
            self._of_cubics(part, values[None], len(x), nodes)[0] for part in (slopes, wide)
        )
        return shift, scale

    def _of_cubics(self, onto: csr_array, values: Array, samples: int, nodes: int) -> Array:
        lead = np.moveaxis(_cubics(self.grid, np.moveaxis(values, 2, 1)), 0, 2)
        sides = sampled(samples, nodes) @ (onto @ lead.reshape(onto.shape[1], -1))
        return fitted(sides, samples).reshape(*lead.shape[2:], nodes)

    def reaches(self, design: Array, effect: Mask, step: float) -> bool:
        """Whether curvatures hold at another design, as well as a search needs them.

        Parameters
        ----------
        design : ndarray, shape (d,)
            Entries.
        effect : ndarray of bool, shape (d,)
            Which of them the phase is proportional to.
        step : float
            Of an entry.
        """
        far = np.abs(design - self.origin)[~effect].max(initial=0.0)
        return bool(self.step <= step and far <= CARRIED)

    def _evaluated(self, design: Array, x: Array, nodes: int) -> _Evaluated:
        where = design.tobytes(), x.tobytes(), nodes
        if where not in self._last:
            t = design - self.centre
            weights = np.concatenate([[1.0], t, np.square(t)])
            lead = weights @ self.lead.reshape(len(weights), -1)
            values, slopes = self._along(x)
            profiles = self._fitted(sampled(len(x), nodes) @ values, lead, len(x))
            self._last.clear()
            self._last[where] = _Evaluated(lead, values, slopes, profiles)
        return self._last[where]

    @cached_property
    def _last(self) -> dict[tuple[bytes, bytes, int], _Evaluated]:
        """What was evaluated last: a step is taken from where the one before it ended."""
        return {}

    def _fitted(self, sides: csr_array, lead: Array, samples: int) -> Array:
        """Coefficients at the nodes, shape (C, 2, k, m), from those of cubics along the strip."""
        shape = self.lead.shape[3:]
        return fitted(sides @ lead.reshape(-1, np.prod(shape)), samples).reshape(*shape, -1)

    def _along(self, x: Array) -> tuple[csr_array, csr_array]:
        """From coefficients of cubics to their values and slopes at places, shape (s, 4 (G - 1)).

        A tangent goes on beyond the ends, where no pixel counts: a step there would ring in the
        splines of the nodes, and make the loss jump where the camera moves.
        """
        count, near = len(self.grid) - 1, np.clip(x, -self.half, self.half)
        interval = np.clip(np.searchsorted(self.grid, near, side="right") - 1, 0, count - 1)
        u, one, beyond = near - self.grid[interval], np.ones(len(x)), (x - near)[:, None]
        slopes = np.stack([3 * u**2, 2 * u, one, 0 * u], axis=1)
        values = np.stack([u**3, u**2, u, one], axis=1) + beyond * slopes
        which = interval[:, None] + count * np.arange(4)
        begins, shape = 4 * np.arange(len(x) + 1), (len(x), 4 * count)
        return (
            csr_array((values.ravel(), which.ravel(), begins), shape=shape),
            csr_array((slopes.ravel(), which.ravel(), begins), shape=shape),
        )


@dataclass(frozen=True, eq=False)
class _Evaluated:
    """Phases of a design at places.

    Attributes
    ----------
    lead : ndarray
        Coefficients of its cubics, as a row of `ContactPhases.lead`.
    values, slopes : sparse array, shape (s, 4 (G - 1))
        From these to values at the places, and to slopes there.
    profiles : ndarray, shape (C, 2, k, m)
        As of `ContactPhases.profiles`.
    """

    lead: Array
    values: csr_array
    slopes: csr_array
    profiles: Array


def contact_phases(
    sensor: Sensor,
    paths: tuple[str, ...],
    centre: Array,
    places: Array,
    size: ContactSize,
    step: float,
    near: ContactPhases | None = None,
    shapes: Array | None = None,
) -> ContactPhases:
    """Solve a varied design, and a step of every entry to both sides.

    Of a design near an earlier one only the middle is solved: curvatures change little between.

    Parameters
    ----------
    sensor : Sensor
        The drawing.
    paths : tuple of str, length d
        Values of the design that are unknown, without those of the tactels.
    centre : ndarray, shape (d,)
        Entries about which to solve.
    places : ndarray, shape (C,)
        Of contacts [m].
    size : ContactSize
        Of the contacts.
    step : float
        Of an entry.
    near : ContactPhases, optional
        About another design.
    shapes : ndarray, shape (C, 2, K or more), optional
        Moments of the tractions less those of the profile, per force [powers of m]; zero if not
        given.
    """
    assert POSITIONS not in paths
    half, grid = sensor.transducer.length / 2, places_along(sensor.transducer)
    farthest = min(float(np.abs(places).max()) + size.reach, half)
    effect = np.array([path in EFFECTS for path in paths], dtype=bool)
    stiff = tuple(path for path in paths if path not in EFFECTS)
    order = moments_within(size.reach, sensor.transducer)
    shapes = np.zeros((len(places), 2, order)) if shapes is None else shapes[..., :order]

    def solved(design: Array, mesh: Grading = QUICK) -> Array:
        made = varied(sensor, paths, design)
        # strips that differ by what the phase is proportional to alone are solved once
        strip = varied(sensor, stiff, design[~effect]).transducer
        surface = _surface(strip, made.camera, sensor.transducer, mesh, farthest)
        constant = stress_optic_constant(made.transducer.photoelastic, made.polariscope.wavelength)
        moments = line_moments(surface, places, size.reach, order)
        moments += _excess(moments, shapes / size.reach ** np.arange(order))
        return np.asarray(phase_lead(moments, constant))

    middle = solved(centre)
    alike = near is not None and np.array_equal(near.places, places)
    if near is not None and not (alike and np.array_equal(near.shapes, shapes)):
        near = None
    if near is not None and near.reaches(centre, effect, step):
        step, origin, bends = near.step, near.origin, near.bends
    else:
        origin, bends = centre, np.zeros((2, len(paths), *middle.shape))
        for number in np.flatnonzero(~effect):
            unit = step * np.eye(len(paths))[number]
            ahead, behind = solved(centre + unit), solved(centre - unit)
            bends[0, number] = (ahead - behind) / (2 * step)
            bends[1, number] = ((ahead + behind) / 2 - middle) / step**2
    if near is not None:
        fine = near.fine
    elif sensor.transducer.solved_in_a_plane:
        fine = np.zeros_like(middle)
    else:
        fine = solved(centre, STRIP) - middle
    middle = middle + fine
    off = centre - origin
    slopes, curves = bends * np.exp(off[effect].sum())
    slopes = slopes + 2 * curves * off[:, None, None, None, None]
    slopes[effect], curves[effect] = middle, middle / 2  # the phase is proportional to it
    mixing, spread = mixtures(middle, size.reach, size.place, (0.0, size.widest), size.profile)
    parts = np.concatenate([middle[None], slopes, curves])
    mixed = np.einsum("kr,ictkg->igctr", spread, parts, optimize=True)
    lead = _cubics(grid, mixed)
    known = fine, places, shapes, step, origin, bends
    return ContactPhases(centre, half, grid, lead, mixing, size, *known)


def _excess(moments: Array, shapes: Array) -> Array:
    """What shapes add to the zeroth moment, and to the first one, which is a contact's place.

    Parameters
    ----------
    moments : ndarray, shape (C, 2, K, G)
        Influence of moments.
    shapes : ndarray, shape (C, 2, K)
        Moments that are added for each unit of force.
    """
    found = np.zeros_like(moments)
    found[:, :, 0] = np.einsum("ctk,ctkg->ctg", shapes, moments)
    after = np.arange(1, shapes.shape[2])
    found[:, :, 1] = np.einsum("ctk,ctkg->ctg", after * shapes[..., :-1], moments[:, :, 1:])
    return found


def _cubics(grid: Array, values: Array) -> Array:
    """Coefficients of cubic splines through values on an even grid.

    Parameters
    ----------
    grid : ndarray, shape (G,)
        Places [m].
    values : ndarray, shape (q, G, ...)
        At them.

    Returns
    -------
    ndarray, shape (q, 4, G - 1, ...)
        As of `scipy.interpolate.PPoly`.
    """
    count, step = len(grid), (grid[-1] - grid[0]) / (len(grid) - 1)
    slopes = (_slopes(count) @ values.reshape(len(values), count, -1)).reshape(values.shape) / step
    first, last, at = slopes[:, :-1], slopes[:, 1:], values[:, :-1]
    rise = np.diff(values, axis=1) / step
    bend = (first + last - 2 * rise) / step
    return np.stack([bend / step, (rise - first) / step - bend, first, at], axis=1)


@cache
def _slopes(count: int) -> Array:
    """From values at whole numbers to slopes of the cubic spline through them, shape (n, n)."""
    whole = np.arange(float(count))
    return np.asarray(CubicSpline(whole, np.eye(count))(whole, 1))


def places_along(drawn: Transducer) -> Array:
    """Places between which influence is a spline [m]."""
    half, cover = drawn.length / 2, drawn.compliant.thickness
    return np.linspace(-half, half, int(np.ceil(2 * half / cover * PER_COVER)) + 1)


@lru_cache(maxsize=SOLVED)
def _surface(
    made: Transducer, camera: Camera, drawn: Transducer, mesh: Grading, farthest: float
) -> SurfaceInfluence:
    """What loads on a varied strip do, as far from its middle as contacts lie [m]."""
    line = light_line(made, camera, drawn, mesh)
    return surface_influence(made, -farthest, farthest, places_along(drawn), line)


def distinct(places: Array, step: float, shapes: Array) -> tuple[Array, Index, Array, Array]:
    """Evenly spaced places next to contacts, which of them each has, and how far it lies beside.

    Parameters
    ----------
    places : ndarray, shape (F, k)
        Of contacts [m]; not a number where a frame has fewer.
    step : float
        Between the places [m].
    shapes : ndarray, shape (F, k, ...)
        Of the contacts; those that differ have places of their own.

    Returns
    -------
    found : ndarray, shape (C,)
        Places that are needed [m].
    which : ndarray of int, shape (F, k)
        Numbers of these; -1 where there is no contact.
    beside : ndarray, shape (F, k)
        Contacts less these places [m]; zero where there is no contact.
    shapes : ndarray, shape (C, ...)
        Of the contacts there.
    """
    there = np.isfinite(places)
    own = shapes[there].reshape(int(there.sum()), -1)
    near = np.round(places[there] / step) * step
    _, first, number = np.unique(
        np.column_stack([near, own]), axis=0, return_index=True, return_inverse=True
    )
    which, beside = np.full(places.shape, -1), np.zeros(places.shape)
    which[there] = number.ravel()
    beside[there] = places[there] - near
    return near[first], which, beside, shapes[there][first]
