"""Models from an influence matrix that another program or a formula gave."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.design.strip import Sensor
from fringeforce.design.validation import validated
from fringeforce.mechanics.mesh import Mesh
from fringeforce.models.strip import SensorModel
from fringeforce.models.strip_nodes import NODES

GAUSS_POINTS = 4
"""Gauss points between stations: they hold the cubic spline through the stations exactly."""
MATRIX_ERROR = 1e-4
"""Largest error of the matrix between nodes of the reader, over its peak; as of finite elements."""


def model_from_influence(
    x: ArrayLike,
    psi: ArrayLike,
    camera: Mapping[str, Any],
    polariscope: Mapping[str, Any],
    *,
    length: float | None = None,
    positions: ArrayLike | None = None,
    scale_error: float | str = 0.0,
    influence_error: float | str = 0.0,
    name: str = "Given influence matrix",
) -> SensorModel:
    """A model of any instrument whose phase is linear in its forces: p = Psi f.

    Parameters
    ----------
    x : array_like, shape (M,)
        Stations along the camera's line, ascending, from the middle of what it sees [m]; at least
        four.  Between them the phase is a cubic spline.
    psi : array_like, shape (M, n), (M, n, 1) or (M, n, 2)
        Phase lead per force at the stations [rad/N], for light of the polariscope's wavelength: of
        n single forces, or of n pairs, normal and tangential.  Single forces are the normal ones of
        pairs whose tangential force is known to be zero.
    camera, polariscope : mapping
        Tables of a design, with tolerances if there are any: ``{"pixels": 512, "bits": 8, ...}``
        and ``{"wavelength": "546 nm", "residual": "0 +/- 0.1 rad"}``.
    length : float, optional
        What the camera sees [m]; as far as the stations reach on both sides if not given.
    positions : array_like, shape (n,), optional
        Where the forces act [m], for messages and resultants; evenly spaced if not given.
    scale_error : float or str, optional
        Relative standard deviation of the scale of Psi, such as "3 %" for a fringe value.
    influence_error : float or str, optional
        That of smooth errors of its shape, as of a design.
    name : str, optional
        What to call the instrument.

    Returns
    -------
    SensorModel
        To be read by `Reader`, simulated by `expose`, saved and loaded.  Its tactels are the
        forces; contacts elsewhere and calibrations, which solve the mechanics anew, are refused.

    Raises
    ------
    InputError
        If stations or matrix do not fit each other, are not finite, or do not reach the ends.

    Examples
    --------
    A beam in bending, whose phase is proportional to the distance from the neutral axis:

    >>> y = np.linspace(-12.7e-3, 12.7e-3, 101)
    >>> camera = {"pixels": 512, "bits": 8, "amplitude": 200, "offset": 20, "noise": 5}
    >>> beam = ff.model_from_influence(y, 20 * y[:, None], camera, {"wavelength": "546 nm"})
    >>> frame = beam.expose([[80.0, 0.0]], rng=0)
    >>> abs(ff.Reader(beam).read(frame).forces[0, 0] - 80) < 0.5
    np.True_
    """
    stations, pairs = _checked(np.asarray(x, dtype=float), np.asarray(psi, dtype=float))
    reach = float(min(-stations[0], stations[-1]))
    if length is None:
        length = 2 * reach
    step = float(np.diff(stations).max())
    if not 0 < length <= 2 * (reach + step):
        raise InputError(
            f"length = {length!r} m is not within the stations, which reach from "
            f"{stations[0]:g} to {stations[-1]:g} m, by more than one of their spacings; x counts "
            "from the middle of what the camera sees."
        )
    count, half = pairs.shape[1], length / 2
    if positions is None:
        positions = (np.arange(count) + 0.5) / count * length - half
    places = np.asarray(positions, dtype=float)
    if places.shape != (count,):
        raise InputError(
            f"positions have the shape {places.shape}, but psi is of {count} forces; give one for "
            "each, or none."
        )
    sensor = validated(
        Sensor,
        {
            "name": name,
            "transducer": {
                "length": float(length),
                "influence_error": influence_error,
                **_placeholders(scale_error),
            },
            "tactels": {"count": count, "pitch": length / count, "positions": places.tolist()},
            "polariscope": dict(polariscope),
            "camera": dict(camera),
        },
        "The instrument",
        from_file=False,
    )
    spline = CubicSpline(stations, pairs, axis=0)
    thickness = NODES * _spacing(spline, stations, length, sensor.polariscope.residual_length)
    sensor = sensor.replace(**{"transducer.compliant.thickness": thickness})
    inner = stations[np.abs(stations) < half * (1 - 1e-9)]
    mesh = Mesh(np.concatenate([[-half], inner, [half]]), np.empty(0), GAUSS_POINTS)
    facts: dict[str, str | int] = {"method": "given influence matrix", "stations": len(stations)}
    return SensorModel(sensor, mesh.x, np.asarray(spline(mesh.stations)), facts)


def _spacing(spline: CubicSpline, x: Array, length: float, correlation: float) -> float:
    """Distance of nodes whose cubic splines are good to `MATRIX_ERROR` of the peak, and a residual.

    Readings take the cover's thickness for it, of which a given matrix says nothing.
    """
    seen = np.clip(x, -length / 2, length / 2)
    exact, count = spline(seen), max(int(np.ceil(NODES * length / correlation)), 8)
    while count < len(x):
        nodes = np.linspace(-length / 2, length / 2, count + 1)
        error = np.abs(CubicSpline(nodes, spline(nodes), axis=0)(seen) - exact).max()
        if error <= MATRIX_ERROR * np.abs(exact).max():
            break
        count *= 2
    return length / count


def _placeholders(scale_error: float | str) -> dict[str, Any]:
    """A strip that says that nothing is known of its mechanics, but for the scale of Psi."""
    if isinstance(scale_error, str) and not scale_error.strip().endswith("%"):
        raise InputError(f'scale_error = {scale_error!r} is no share; write it as in "3 %".')
    share = scale_error if isinstance(scale_error, str) else f"{100 * scale_error!r} %"
    layer = {"thickness": 1e-3, "youngs_modulus": 1.0, "poissons_ratio": 0.0}
    return {
        "width": 1e-3,
        "edges": "free",
        "plane": "given",
        "compliant": layer,
        "photoelastic": {**layer, "strain_optic_coefficient": f"1.0 +/- {share}"},
    }


WIDEST = 2.0
"""Longest stretch of stations [m]; beyond it they are millimetres."""


def _checked(x: Array, psi: Array) -> tuple[Array, Array]:
    """Stations, and the matrix with two components of every force."""
    if x.ndim != 1 or len(x) < 4 or not np.isfinite(x).all() or (np.diff(x) <= 0).any():
        raise InputError(
            f"x of shape {x.shape} is no list of stations; give at least four, finite and "
            "ascending."
        )
    if x[-1] - x[0] > WIDEST:
        raise InputError(
            f"x reaches from {x[0]:g} m to {x[-1]:g} m; give stations in metres, such as "
            "0.0127 for 12.7 mm."
        )
    if psi.ndim == 2:
        psi = psi[..., None]
    if psi.ndim != 3 or len(psi) != len(x) or not psi.shape[1] or psi.shape[2] not in (1, 2):
        raise InputError(
            f"psi of shape {psi.shape} does not fit {len(x)} stations; give (M, n) for single "
            "forces, or (M, n, 2) for normal and tangential ones.  A force of three components is "
            "three single forces."
        )
    if not np.isfinite(psi).all() or not psi[..., 0].any(axis=0).all():
        raise InputError(
            "psi has entries that are not finite, or a force that changes no phase; leave such a "
            "force out."
        )
    if psi.shape[2] == 1:
        psi = np.concatenate([psi, np.zeros_like(psi)], axis=2)
    return x, psi
