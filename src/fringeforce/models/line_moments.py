"""What a camera sees of contacts anywhere near their tactels: moments of their tractions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.design.strip import Sensor, Transducer
from fringeforce.estimation.frame_model import (
    EVEN,
    LEAST_PROFILE,
    contacts_scatter,
    moment_table,
    moments_about,
)
from fringeforce.mechanics.surface_influence import SurfaceInfluence, surface_influence
from fringeforce.models.as_built import PLACEMENT, WIDTH
from fringeforce.models.strip_width import light_line
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

Array = NDArray[np.float64]

MOMENTS, FEWEST_MOMENTS, MOST_MOMENTS = 8, 14, 40
"""Moments of a contact, for as far as it reaches in thicknesses of the cover: polynomials in its
place follow a line load to 2e-3 of its peak at the farthest place and a patch as wide as the cover
is thick to 1e-4; with more than 40, rounding of the powers is as large."""
FOLLOWED_STDS = 3.5
"""Standard deviations of place, width and light up to which frames are followed."""
REGISTRATION = "camera.shift", "camera.scale"
"""Paths of values that say where the camera looks."""
PITCH = "tactels.pitch"
"""Path of the value that moves all contacts."""


@dataclass(frozen=True, eq=False)
class LineMoments:
    """Influence of the moments of the contacts' tractions, but for its zeroth moment.

    Attributes
    ----------
    moments : ndarray, shape (n, 2, K, s)
        Along the strip about the tactels, least squares of line loads [rad/N].
    reach : float
        Unit of length of the moments [m].
    half : float
        Half the width of the contacts, as drawn, in units of the reach.
    moving : mapping
        How far a deviation of each value moves the contacts in what the camera sees, by path, shape
        (n,) [m].
    """

    moments: Array
    reach: float = 1.0
    half: float = 0.0
    moving: Mapping[str, Array] = field(default_factory=dict)

    @classmethod
    def of(
        cls, sensor: Sensor, std: Mapping[str, float], x: Array, shown: NDArray[np.bool_]
    ) -> LineMoments:
        """Of a strip whose contacts have tolerances of their own; of others there is one moment.

        A camera that looks further along the strip sees contacts that moved back, and a pitch moves
        them.  Where that leads beyond the strip, or so far that polynomials do not follow, they are
        taken to stay.

        Parameters
        ----------
        sensor : Sensor
            As built.
        std : mapping
            Its tolerances.
        x : ndarray, shape (s,)
            Where the camera looks [m].
        shown : ndarray of bool, shape (s,)
            As of `Uncertainty`.
        """
        tactels, strip = sensor.tactels, sensor.transducer
        if PLACEMENT not in std and WIDTH not in std:
            return cls(np.zeros((tactels.count, 2, 1, len(x))))
        width = tactels.contact_width + FOLLOWED_STDS * std.get(WIDTH, 0.0)
        centres = tactels.positions + tactels.placement
        steps = {
            REGISTRATION[0]: -np.ones_like(centres),
            REGISTRATION[1]: -centres,
            PITCH: tactels.positions / tactels.pitch,
        }
        moving = {path: std[path] * step for path, step in steps.items() if std.get(path)}
        end = strip.length / 2
        most = min(end - np.abs(centres).max(), MOST_MOMENTS / MOMENTS * strip.compliant.thickness)

        def reached() -> float:
            steps = np.array(list(moving.values())).reshape(-1, len(centres))
            return FOLLOWED_STDS * contacts_scatter(std.get(PLACEMENT, 0.0), steps) + width / 2

        if reached() > most:
            moving = {}
        reach = float(min(reached(), end - np.abs(centres).max()))
        surface = surface_influence(
            strip,
            max(centres[0] - reach, -end),
            min(centres[-1] + reach, end),
            np.clip(x, -end, end),
            light_line(strip, sensor.camera),
        )
        constant = stress_optic_constant(strip.photoelastic, sensor.polariscope.wavelength)
        order = moments_within(reach, strip)
        moments = phase_lead(line_moments(surface, centres, reach, order), constant)
        return cls(np.asarray(moments * shown), reach, tactels.contact_width / 2 / reach, moving)

    @property
    def still(self) -> Array:
        """How far a value moves contacts that moves none, shape (n,)."""
        return np.zeros(len(self.moments))

    @cached_property
    def nominal(self) -> Array:
        """Moments of contacts as drawn, shape (K,)."""
        order = self.moments.shape[2]
        table, even = moment_table(order, EVEN), np.arange(0, order, 2)
        found = np.zeros(order)
        found[even] = table[even, even // 2] * self.half**even
        return found

    def about(self, psi: Array) -> Array:
        """All moments, so that contacts as drawn have an influence (s, n, 2), (n, 2, K, s)."""
        out = self.moments.copy()
        out[:, :, 0] += np.moveaxis(psi, 0, 2) - np.einsum("k,ntkm->ntm", self.nominal, out)
        return np.ascontiguousarray(out)

    def moved(self, path: str, by: float) -> Array:
        """Change of the influence matrix by moving contacts as drawn, shape (s, n, 2) [rad/N].

        Parameters
        ----------
        path : str
            Of a value.
        by : float
            Its deviations.
        """
        step = self.moving.get(path, self.still) * by / self.reach
        change = moments_about(self.moments, step) - self.moments
        return np.moveaxis(np.einsum("k,ntkm->ntm", self.nominal, change), 2, 0)


def moments_within(reach: float, transducer: Transducer) -> int:
    """How many moments contacts need that reach so far [m]."""
    wanted = int(np.ceil(MOMENTS * reach / transducer.compliant.thickness))
    return min(max(wanted, FEWEST_MOMENTS), MOST_MOMENTS)


def line_moments(surface: SurfaceInfluence, centres: Array, reach: float, order: int) -> Array:
    """Influence of the moments of tractions about places, shape (c, 2, K, m) [Pa m / N].

    Least squares of the influence of line loads over their place, of equal weight at the angles of
    Chebyshev's points.

    Parameters
    ----------
    surface : SurfaceInfluence
        Line loads as far as contacts reach.
    centres : ndarray, shape (c,)
        Places [m].
    reach : float
        Unit of length of the moments [m].
    order : int
        Number K of the moments.
    """
    t = np.polynomial.chebyshev.chebpts1(4 * order)
    basis = np.linalg.pinv(np.polynomial.chebyshev.chebvander(t, order - 1))
    powers = np.array(
        [
            np.pad(np.polynomial.chebyshev.cheb2poly(row), (0, order - 1 - k))
            for k, row in enumerate(np.eye(order))
        ]
    )
    to_moments = powers.T @ basis
    found = np.empty((len(centres), 2, order, len(surface.stress)))
    for own, centre in zip(found, centres, strict=True):
        shares = to_moments @ surface.shares(centre + reach * t, np.zeros(len(t)))
        own[:] = np.einsum("ks,mst->tkm", shares, surface.stress, optimize=True)
    return found


def mixed(moments: Array, reach: float, place: float, width: tuple[float, float]) -> dict[str, Any]:
    """Moments of a `FrameModel`, mixtures of them and their profiles.

    Parameters
    ----------
    moments : ndarray, shape (n, 2, K, m)
        Phase lead per force and moment of its traction [rad/N].
    reach : float
        Unit of length of the moments [m].
    place : float
        Standard deviation of where contacts are seen beside their tactels [m].
    width : tuple of float
        Of contacts, and its standard deviation [m].
    """
    far = FOLLOWED_STDS * width[1]
    mixing, spread = mixtures(moments, reach, place, (width[0] - far, width[0] + far))
    profiles = np.ascontiguousarray(np.einsum("kr,ntkm->ntrm", spread, moments))
    return {"moments": moments, "profiles": profiles, "mixing": mixing}


def mixtures(
    moments: Array,
    reach: float,
    place: float,
    widths: tuple[float, float],
    profile: float = EVEN,
) -> tuple[Array, Array]:
    """Mixtures of moments that are all that likely contacts need, and moments from them.

    Principal components of the phase of a unit force over places and widths of contacts, from and
    to [m]; what is left out is below `LEAST_PROFILE` of it.

    Returns
    -------
    mixing, spread : ndarray, shapes (k, K) and (K, k)
    """
    order = moments.shape[2]
    if order == 1:
        return np.eye(1), np.eye(1)
    table, steps = moment_table(order, profile), np.linspace(-FOLLOWED_STDS, FOLLOWED_STDS, 15)
    d, h = (
        grid.ravel() / reach
        for grid in np.meshgrid(place * steps, np.maximum(np.linspace(*widths, 15), 0.0) / 2)
    )
    k, i = np.arange(order)[:, None], np.arange(table.shape[1])
    powers = np.power(d[:, None, None], np.maximum(k - 2 * i, 0))
    means = np.einsum("ki,ski->sk", table, powers * h[:, None, None] ** (2 * i))
    size = np.sqrt(np.einsum("ntkm,ntkm->k", moments, moments))
    gram = np.einsum("ntkm,ntlm->kl", moments / size[:, None], moments / size[:, None])
    values, vectors = np.linalg.eigh(gram)
    root = (vectors * np.sqrt(np.maximum(values, 1e-12 * values[-1]))).T * size
    _, share, rows = np.linalg.svd(means @ root.T, full_matrices=False)
    kept = rows[share > LEAST_PROFILE * share[0]]
    return np.ascontiguousarray(kept @ root), np.linalg.solve(root, kept.T)
