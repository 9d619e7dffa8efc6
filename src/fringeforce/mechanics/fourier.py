"""The exact solution for roller edges, as a Fourier series along the strip.

Roller edges are mirror planes, so with x' = x + c/2 and alpha_k = k pi / c the fields

    u, tau_xz ~ sin(alpha_k x'),      w, sigma_x, sigma_z ~ cos(alpha_k x')

separate, and each k leaves an ordinary differential equation in z with the state
y = (alpha u, alpha w, tau_xz, sigma_z).  In the variable zeta = alpha z its matrix has the double
eigenvalues +1 and -1, so a layer's general solution is

    y = e^{zeta} [c_1 v_1 + c_2 (v_2 + zeta v_1)] + e^{-zeta} [c_3 w_1 + c_4 (w_2 - zeta w_1)].

It shares no code with the finite elements and serves as their oracle.
See Timoshenko and Goodier, Theory of Elasticity, 3rd ed., section 24, for the single layer.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.design.strip import Layer, Plane, Transducer
from fringeforce.mechanics.moduli import PlaneModuli, plane_moduli

_ALPHA_U, _ALPHA_W, _TAU, _SIGMA_Z = range(4)


@dataclass(frozen=True)
class _Layer(PlaneModuli):
    """One layer of the strip and the vectors that span its general solution."""

    bottom: float
    top: float

    def basis(self, alpha: Array, z: Array) -> Array:
        """State vectors of the four basis solutions, shape (terms, len(z), 4 states, 4 solutions).

        Growing exponentials are scaled to one at the top face and decaying ones at the bottom face.
        """
        ratio = self.c12 / self.c11
        g2 = 2 * self.shear
        slip = (3 - ratio) / (1 + ratio)
        pull = g2 * (1 - ratio) / (1 + ratio)
        push = 2 * g2 / (1 + ratio)
        v1, v2 = np.array([1, -1, g2, -g2]), np.array([0, slip, -pull, push])
        w1, w2 = np.array([1, 1, -g2, -g2]), np.array([0, -slip, pull, push])
        down = alpha[:, None] * (z - self.top)
        up = alpha[:, None] * (z - self.bottom)
        grow, decay = np.exp(down)[..., None], np.exp(-up)[..., None]
        return np.stack(
            [
                grow * v1,
                grow * (v2 + down[..., None] * v1),
                decay * w1,
                decay * (w2 - up[..., None] * w1),
            ],
            axis=-1,
        )


def _layers(compliant: Layer, photoelastic: Layer, plane: Plane) -> tuple[_Layer, _Layer]:
    a, b = compliant.thickness, photoelastic.thickness
    soft, clear = plane_moduli(compliant, plane), plane_moduli(photoelastic, plane)
    return (
        _Layer(bottom=-a, top=0.0, c11=soft.c11, c12=soft.c12),
        _Layer(bottom=-a - b, top=-a, c11=clear.c11, c12=clear.c12),
    )


def _strip_layers(transducer: Transducer) -> tuple[_Layer, _Layer]:
    return _layers(transducer.compliant, transducer.photoelastic, transducer.plane)


def _coefficients(layers: tuple[_Layer, _Layer], alpha: Array) -> Array:
    """Basis coefficients for unit harmonic tractions, shape (terms, 8, 2): normal, tangential."""
    soft, clear = layers
    top, joint, bottom = np.array([0.0]), np.array([soft.bottom]), np.array([clear.bottom])
    scale = np.array([2 * clear.shear, 2 * clear.shear, 1.0, 1.0])[:, None]
    system = np.zeros((len(alpha), 8, 8))
    system[:, 0, :4] = soft.basis(alpha, top)[:, 0, _SIGMA_Z]
    system[:, 1, :4] = soft.basis(alpha, top)[:, 0, _TAU]
    system[:, 2:6, :4] = scale * soft.basis(alpha, joint)[:, 0]
    system[:, 2:6, 4:] = -scale * clear.basis(alpha, joint)[:, 0]
    system[:, 6:, 4:] = (scale * clear.basis(alpha, bottom)[:, 0])[:, [_ALPHA_U, _ALPHA_W]]
    tractions = np.zeros((8, 2))
    tractions[0, 0] = -1.0
    tractions[1, 1] = 1.0
    solution = np.linalg.solve(system, np.broadcast_to(tractions, (len(alpha), 8, 2)))
    return np.asarray(solution, dtype=np.float64)


def harmonic_displacement(
    compliant: Layer, photoelastic: Layer, alpha: Array, heights: Array
) -> Array:
    """Displacement along a wave on the top surface, in plane strain.

    Parameters
    ----------
    compliant, photoelastic : Layer
        The cover, and what it lies on; the bottom is bonded.
    alpha : ndarray, shape (k,)
        Wave numbers [1/m].
    heights : ndarray, shape (q,)
        Places in the photoelastic layer [m].

    Returns
    -------
    ndarray, shape (k, q, 2)
        Amplitude of u [m/Pa] for a unit pressure and for a unit traction along the wave.
    """
    layers = _layers(compliant, photoelastic, "strain")
    state = layers[1].basis(alpha, heights) @ _coefficients(layers, alpha)[:, None, 4:]
    return state[:, :, _ALPHA_U] / alpha[:, None, None]


def surface_compliance(compliant: Layer, photoelastic: Layer, kappa: Array) -> Array:
    """Displacement into the top surface per unit harmonic pressure, in plane strain.

    Parameters
    ----------
    compliant, photoelastic
        As for `harmonic_displacement`.
    kappa : ndarray, shape (k,)
        Wave numbers [1/m].

    Returns
    -------
    ndarray, shape (k,)
        [m/Pa].
    """
    layers = _layers(compliant, photoelastic, "strain")
    state = layers[0].basis(kappa, np.array([0.0]))[:, 0] @ _coefficients(layers, kappa)[:, :4]
    return np.asarray(-state[:, _ALPHA_W, 0] / kappa)


def _harmonics(transducer: Transducer, positions: ArrayLike, terms: int) -> tuple[Array, Array]:
    """Wave numbers, shape (terms,), and line-load amplitudes per newton, shape (terms, n, 2)."""
    length, width = transducer.length, transducer.width
    alpha = np.arange(1, terms + 1, dtype=np.float64) * np.pi / length
    phase = np.outer(alpha, np.asarray(positions) + length / 2)
    return alpha, 2 / (length * width) * np.stack([np.cos(phase), np.sin(phase)], axis=2)


def integrated_stress(
    transducer: Transducer, positions: ArrayLike, x: ArrayLike, terms: int = 400
) -> Array:
    """Depth integral of the stress difference that the light sees, per unit tactel force.

    Parameters
    ----------
    transducer : Transducer
        The strip; its edges are taken to be rollers, whatever it says.
    positions : array_like, shape (n,)
        Where the tactels' line loads act [m].
    x : array_like, shape (m,)
        Where to evaluate [m].
    terms : int
        Harmonics; 400 give ten digits for a cover of a fiftieth of the length or thicker.

    Returns
    -------
    ndarray, shape (m, n, 2)
        Integral of sigma_x - sigma_y over the photoelastic layer [Pa m / N], for normal and
        tangential unit forces.
    """
    alpha, amplitude = _harmonics(transducer, positions, terms)
    stress, mean = harmonic_stress(transducer, alpha)
    x_edge = np.asarray(x, dtype=float) + transducer.length / 2
    cosines = np.cos(np.outer(x_edge, alpha))
    spectrum = stress[:, None, :] * amplitude
    result = np.tensordot(cosines, spectrum, axes=1)
    result[..., 0] += mean
    return result


def stress_under_forces(
    transducer: Transducer, positions: ArrayLike, forces: ArrayLike, x: Array, terms: int = 400
) -> Array:
    """As `integrated_stress`, of line loads that act together: their waves are added up first.

    Parameters
    ----------
    transducer : Transducer
        As there.
    positions : array_like, shape (n,)
        Where the line loads act [m].
    forces : array_like, shape (n, 2)
        Normal and tangential force of each [N].
    x : ndarray, shape (m,)
        Where to evaluate [m].
    terms : int
        Harmonics.

    Returns
    -------
    ndarray, shape (m,)
        Integral of sigma_x - sigma_y over the photoelastic layer [Pa m].
    """
    loads = np.asarray(forces, dtype=float)
    alpha, amplitude = _harmonics(transducer, positions, terms)
    stress, mean = harmonic_stress(transducer, alpha)
    waves = np.sum(stress * np.einsum("knc,nc->kc", amplitude, loads), axis=1)
    at = np.asarray(x, dtype=float).tobytes()
    return np.asarray(_cosines(at, transducer.length, terms) @ waves + mean * loads[:, 0].sum())


@lru_cache(maxsize=2)  # many frames are seen by the same pixels
def _cosines(x: bytes, length: float, terms: int) -> Array:
    """Waves along a strip at places [m], shape (m, terms)."""
    alpha = np.arange(1, terms + 1, dtype=np.float64) * np.pi / length
    found = np.cos(np.outer(np.frombuffer(x) + length / 2, alpha))
    found.setflags(write=False)
    return found


def harmonic_stress(transducer: Transducer, alpha: Array) -> tuple[Array, float]:
    """Depth integral of the stress difference that the light sees, under waves of traction.

    Parameters
    ----------
    transducer : Transducer
        The strip.
    alpha : ndarray, shape (k,)
        Wave numbers [1/m].

    Returns
    -------
    waves : ndarray, shape (k, 2)
        Amplitude of cos(alpha x') for a pressure cos(alpha x') and for a traction sin(alpha x')
        of unit amplitude, x' = x + c/2 [m].
    mean : float
        What a normal force adds everywhere [Pa m / N].
    """
    layers = _strip_layers(transducer)
    clear = layers[1]
    faces = clear.basis(alpha, np.array([clear.top, clear.bottom]))
    state = faces @ _coefficients(layers, alpha)[:, None, 4:]
    jump = state[:, 0] - state[:, 1]
    stress = jump[:, _TAU] / alpha[:, None]
    depth = clear.top - clear.bottom
    mean = -1 / (transducer.length * transducer.width) * (clear.c12 / clear.c11) * depth
    if transducer.plane == "strain":
        strain = (stress - clear.c12 * jump[:, _ALPHA_W] / alpha[:, None]) / clear.c11
        return 2 * clear.shear * strain, 0.0
    return stress, mean


def stress_field(
    transducer: Transducer, positions: ArrayLike, x: ArrayLike, z: ArrayLike, terms: int = 400
) -> Array:
    """Stresses on a grid, per unit tactel force.

    Parameters
    ----------
    transducer, positions, terms
        As for `integrated_stress`.  The series diverges on the loaded surface itself and converges
        like exp(-k pi |z| / c) below it.
    x : array_like, shape (m,)
        Positions along the strip [m].
    z : array_like, shape (q,)
        Heights [m], -(a + b) <= z < 0; the interface counts to the photoelastic layer.

    Returns
    -------
    ndarray, shape (3, m, q, n, 2)
        sigma_x, sigma_z and tau_xz [Pa/N] for normal and tangential unit forces.
    """
    layers = _strip_layers(transducer)
    soft, clear = layers
    alpha, amplitude = _harmonics(transducer, positions, terms)
    coefficients = _coefficients(layers, alpha)
    heights = np.asarray(z, dtype=float)
    x_edge = np.asarray(x, dtype=float) + transducer.length / 2
    phase = np.outer(x_edge, alpha)
    cosines, sines = np.cos(phase), np.sin(phase)
    pressure = -1 / (transducer.length * transducer.width)
    field = np.empty((3, len(x_edge), len(heights), *amplitude.shape[1:]))
    for layer, used, part in (
        (soft, heights > soft.bottom, slice(0, 4)),
        (clear, heights <= soft.bottom, slice(4, 8)),
    ):
        state = layer.basis(alpha, heights[used]) @ coefficients[:, None, part]
        ratio = layer.c12 / layer.c11
        sigma_x = (layer.c11 - ratio * layer.c12) * state[:, :, _ALPHA_U] + ratio * state[
            :, :, _SIGMA_Z
        ]
        components = (
            (sigma_x, cosines, ratio * pressure),
            (state[:, :, _SIGMA_Z], cosines, pressure),
            (state[:, :, _TAU], sines, 0.0),
        )
        for index, (profile, waves, mean) in enumerate(components):
            values = np.einsum("mk,kqd,knd->mqnd", waves, profile, amplitude, optimize=True)
            values[..., 0] += mean
            field[index][:, used] = values
    return field


def surface_displacement(
    transducer: Transducer, step: float, count: int, terms: int = 4000
) -> tuple[Array, Array, Array]:
    """Displacement of the loaded surface beside a small force far from the edges, but a constant.

    Parameters
    ----------
    transducer : Transducer
        The strip.
    step : float
        Width of the force under uniform tractions, and distance of the places [m].
    count : int
        Places on either side.
    terms : int
        Harmonics; forces must be wider than the length over their number.

    Returns
    -------
    tuple of ndarray, shape (2 count + 1,)
        Into the surface under a normal force, along x under a tangential one, and into the surface
        under a tangential one [m/N].
    """
    layers = _strip_layers(transducer)
    alpha = np.arange(1, terms + 1, dtype=np.float64) * np.pi / transducer.length
    coefficients = _coefficients(layers, alpha)
    state = layers[0].basis(alpha, np.array([0.0]))[:, 0] @ coefficients[:, :4]
    # a force and its mirror images beyond the edges have twice the amplitude of the force alone
    patch = np.sinc(alpha * step / 2 / np.pi) / (transducer.length * transducer.width * alpha)
    along, up = (patch[:, None] * state[:, row] for row in (_ALPHA_U, _ALPHA_W))
    phase = np.outer(np.arange(-count, count + 1) * step, alpha)
    even, odd = np.cos(phase), np.sin(phase)
    return -even @ up[:, 0], even @ along[:, 1], odd @ up[:, 1]
