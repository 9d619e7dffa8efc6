"""The stress that light sees of a strip under large strain, to second order in the forces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

from fringeforce.base.arrays import Array
from fringeforce.design.strip import Transducer
from fringeforce.mechanics.finite_strain import FiniteStrip, finite_strip

SMALL = 0.05
"""Force from whose two signs the second order is taken [N]."""
TOLERANCE = 2e-3
"""Error of the second order over the peak of the light, under `PRESSED`: the whole solution errs
by a third to a quarter of it, 0.05 %, for higher orders take back a part."""
PRESSED, SHEARED = 0.3, 0.3
"""Pressure of the contact by whose light elements are chosen, over the modulus of the cover, and
its shear over that: a little more pressure folds the surface under dead loads."""
SHARES = (np.inf, 1 / 2, 1 / 4, 1 / 8, 1 / 16, 1 / 32)
"""Elements beside the ends of a contact, over its width, that are tried; the first are as large as
the cover is thick, nearly."""
FINER = 1 / 128
"""Those of the solution, one order higher, by which they are judged."""
STEEP = 6.0
"""Growth of elements beside ends, where the slope of the surface is logarithmic: there the first
ones count, not their number; of 4 there are more elements, of 10 errors are a third larger."""
KEPT = 256
"""Loads of whose stress an expansion remembers what is beyond it: some kilobytes each."""
PLACES = 400
"""Places over the middle half of the strip, without its corners, at which the light is compared."""


@dataclass(frozen=True, eq=False)
class Expansion:
    """The stress that the light sees as a power series in the forces about none.

    Attributes
    ----------
    strip : FiniteStrip
        Of n patches; forces run over (patch, component).
    units : ndarray, shape (2 n, ...)
        Coefficients of the displacements of small unit forces [m/N].
    first : ndarray, shape (M, 2 n)
        Psi of sum_i Psi_i f_i, at the mesh's stations [Pa m / N].
    second : ndarray, shape (M, 2 n, 2 n)
        H of sum_ij f_i f_j H_ij [Pa m / N^2].
    """

    strip: FiniteStrip
    units: Array
    first: Array
    second: Array

    @classmethod
    def of(cls, strip: FiniteStrip) -> Expansion:
        """Expand to second order.

        With u = e u_1 + e^2 u_2 forces of order e^2 balance: K u_2 = F_1(u_1) - R_2(u_1), of
        follower loads F_1 of first order in the displacements and internal forces R_2.  At
        the camera's x stands the material point x - u_1, so that the integral gains
        int (s_2 + s_1 du_1/dx) dz - d/dx int s_1 u_1 dz.  Pairs of forces follow from the sums of
        two.
        """
        count = 2 * len(strip.centres)
        forces = np.eye(count).reshape(count, -1, 2)
        unit_loads = np.array([strip.at_rest(strip.load(one)) for one in forces])
        units = strip.linear(strip.on_surface(unit_loads))
        first = np.zeros((len(strip.mesh.stations), count))
        found = np.zeros((*first.shape, count))
        for i in range(count):
            others = np.arange(i)  # a force alone comes last
            once, found[:, i, : i + 1] = orders(
                strip,
                np.concatenate([units[others] + units[i], units[i : i + 1]]),
                np.concatenate([forces[others] + forces[i], forces[i : i + 1]]),
            )
            first[:, i] = once[:, -1]
        own = np.einsum("mii->mi", found).copy()
        for i in range(count):
            for j in range(i):
                found[:, i, j] = (found[:, i, j] - own[:, i] - own[:, j]) / 2
                found[:, j, i] = found[:, i, j]
        return cls(strip, units, first, found)

    def rest(self, forces: Array) -> Array:
        """What the second order leaves of the stress under forces (n, 2), shape (M,) [Pa m].

        Raises
        ------
        InputError
            If no stable state is found.
        """
        key = np.asarray(forces, dtype=float).tobytes()
        found = self._rests.get(key)
        if found is None:
            found = self._rests[key] = self._rest(forces)
            for oldest in list(self._rests)[:-KEPT]:
                self._rests.pop(oldest, None)
        return found

    @cached_property
    def _rests(self) -> dict[bytes, Array]:
        """What `rest` found last, by forces: readers of one strip ask for the same ones."""
        return {}

    def _rest(self, forces: Array) -> Array:
        strip, flat = self.strip, forces.ravel()
        state = strip.near(strip.load(forces), np.tensordot(flat, self.units, axes=1))
        return strip.light.at_stations(state) - (self.first + self.second @ flat) @ flat


@lru_cache(maxsize=8)
def expansion(strip: FiniteStrip) -> Expansion:
    """First and second order of the stress that the light sees in the forces."""
    return Expansion.of(strip)


def orders(strip: FiniteStrip, units: Array, forces: Array) -> tuple[Array, Array]:
    """First and second order of the stress along directions of the forces.

    Parameters
    ----------
    strip : FiniteStrip
        Of n patches.
    units : ndarray, shape (k, ...)
        Displacements of small strain under the forces [m/N].
    forces : ndarray, shape (k, n, 2)
        The directions.

    Returns
    -------
    first, second : ndarray, shape (M, k)
        At the mesh's stations [Pa m / N, Pa m / N^2].
    """
    small, weights = SMALL * units, strip.light.weights
    left = [_unbalanced(strip, *one) for one in zip(small, forces, strict=True)]
    bent = strip.linear(np.array(left))
    first, second = np.empty((2, len(strip.mesh.stations), len(units)))
    for k, (one, twice) in enumerate(zip(small, bent, strict=True)):
        ends = one + twice, twice - one
        (plus, u, rise), (minus, _, _) = (strip.light.by_height(end) for end in ends)
        odd = (plus - minus) / 2
        direct = ((plus + minus) / 2 + odd * rise) @ weights
        carried = CubicSpline(strip.mesh.stations, (odd * u) @ weights).derivative()
        first[:, k] = odd @ weights / SMALL
        second[:, k] = (direct - carried(strip.mesh.stations)) / SMALL**2
    return first, second


def _unbalanced(strip: FiniteStrip, small: Array, forces: Array) -> Array:
    """Second order of what small displacements under forces leave out of balance [N]."""
    load, inside = strip.load(SMALL * forces), strip.quadratic_forces(small)
    if not load.follows:
        return -inside
    return strip.on_surface(load.changed(np.zeros(strip.shape[:2]), small[..., -1])) - inside


def resolved_share(transducer: Transducer, width: float, order: int) -> float:
    """Elements beside the ends of a contact that give its light as well as finer ones do.

    The largest of `SHARES` that leave less than `TOLERANCE` of the second order under one contact
    in the middle of the strip.

    Parameters
    ----------
    transducer : Transducer
        The strip.
    width : float
        Of the contact [m].
    order : int
        Polynomial order of the elements.
    """
    true, peak = _pressed(transducer, width, order + 1, FINER)
    for share in SHARES[:-1]:
        found, _ = _pressed(transducer, width, order, share)
        if np.abs(found - true).max() < TOLERANCE * peak:
            return share
    return SHARES[-1]


def _pressed(transducer: Transducer, width: float, order: int, share: float) -> tuple[Array, float]:
    """Second order of the stress over the middle of the strip, and the peak of the first."""
    strip = finite_strip(transducer, [0.0], [width], order=order, share=share, growth=STEEP)
    force = PRESSED * transducer.compliant.youngs_modulus * width * transducer.width
    forces = np.array([[force, SHEARED * force]])
    unit = strip.linear(strip.on_surface(strip.at_rest(strip.load(forces))))
    first, second = orders(strip, unit[None], forces[None])
    x = np.linspace(-0.25, 0.25, PLACES) * transducer.length
    return CubicSpline(strip.mesh.stations, second[:, 0])(x), float(np.abs(first).max())
