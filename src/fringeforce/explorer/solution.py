"""All that the page needs of one design, so that dragging a force asks nobody."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Single
from fringeforce.base.errors import InputError
from fringeforce.design.strip import Sensor, Tactels, Transducer
from fringeforce.explorer.figures import design_figures
from fringeforce.explorer.limits import check
from fringeforce.explorer.values import flat_values
from fringeforce.mechanics.elasticity import Displacement, unit_displacements
from fringeforce.mechanics.mesh import strip_mesh
from fringeforce.mechanics.stress import integrated_stress, stress_field
from fringeforce.models.creep import creeps
from fringeforce.models.strip import SensorModel, reduced
from fringeforce.optics.colour import light_colour

COLUMNS, COVER_ROWS, CLEAR_ROWS = 160, 8, 24
"""Cells of the stress picture: along the strip, and through either layer."""


def solved(sensor: Sensor, known: SensorModel | None = None) -> SensorModel:
    """The model of a strip; light and camera may change without solving again.

    Parameters
    ----------
    sensor : Sensor
        The design.
    known : SensorModel, optional
        Model of the design, where there is one already, such as a calibrated one.

    Raises
    ------
    InputError
        If the design cannot be explored.
    """
    check(sensor)
    if known is not None:
        return known
    displacement = _displacement(sensor)
    stations = displacement.mesh.stations
    return reduced(sensor, displacement.mesh, integrated_stress(displacement, stations))


def facts(model: SensorModel) -> Mapping[str, Any]:
    """What the page is told of a strip, as JSON values."""
    sensor = model.sensor
    strip, camera = sensor.transducer, sensor.camera
    return {
        "name": sensor.name,
        "values": flat_values(sensor),
        "light": light_colour(sensor.polariscope.wavelength).tolist(),
        "strip": strip.model_dump(include={"length", "width", "edges", "plane"}),
        "layers": [strip.compliant.thickness, strip.photoelastic.thickness],
        "camera": {
            **camera.model_dump(include={"amplitude", "offset", "noise"}),
            "full_scale": camera.full_scale,
        },
        "calibrated": model.calibration is not None,
        "creeps": creeps(strip),
    }


def blocks(model: SensorModel) -> Mapping[str, NDArray[Any]]:
    """Places of pixels and tactels and the influence matrix, loads first, float32.

    Raises
    ------
    InputError
        If the matrix is beyond single precision.
    """
    return _single(
        {
            "x": model.pixel_positions,
            "tactels": model.sensor.tactels.positions,
            "psi": model.frame_influence.T,
        }
    )


def inside(model: SensorModel) -> tuple[Mapping[str, Any], Mapping[str, NDArray[Any]]]:
    """Figures of a design, and its unit stresses and unit displacements, loads first, float32.

    Parameters
    ----------
    model : SensorModel
        Of the design; the elements are not solved again if that was done here.

    Raises
    ------
    InputError
        If the fields are beyond single precision.
    """
    displacement = _displacement(model.sensor)
    figures = [asdict(figure) for figure in design_figures(model)]
    return {"figures": figures}, _single({**_stresses(displacement), **_movement(displacement)})


def _single(blocks: Mapping[str, Array]) -> dict[str, Single]:
    with np.errstate(over="ignore"):
        small = {name: np.asarray(block, np.float32) for name, block in blocks.items()}
    if not all(np.isfinite(block).all() for block in small.values()):
        raise InputError("The fields of this design exceed what single precision can hold.")
    return small


def _displacement(sensor: Sensor) -> Displacement:
    return _unit_displacements(sensor.transducer, sensor.tactels)


@lru_cache(maxsize=8)
def _unit_displacements(strip: Transducer, tactels: Tactels) -> Displacement:
    """Unit displacements of a strip; light and camera may change without solving again."""
    positions = tactels.positions
    return unit_displacements(strip, positions, strip_mesh(strip, positions))


def _stresses(displacement: Displacement) -> dict[str, Array]:
    """Unit stresses in the cells of either layer, shape (2n, 3, rows, COLUMNS) [Pa/N].

    Rows count downwards from the layer's upper face, as those of a picture do.
    """
    strip = displacement.transducer
    a, b = strip.compliant.thickness, strip.photoelastic.thickness
    x = ((np.arange(COLUMNS) + 0.5) / COLUMNS - 0.5) * strip.length
    cover = -(np.arange(COVER_ROWS) + 0.5) / COVER_ROWS * a
    clear = -a - (np.arange(CLEAR_ROWS) + 0.5) / CLEAR_ROWS * b
    field = stress_field(displacement, x, np.concatenate([cover, clear]))
    rows = _loads_first(field).transpose(0, 1, 3, 2)
    return {"stress_cover": rows[:, :, :COVER_ROWS], "stress_clear": rows[:, :, COVER_ROWS:]}


def _movement(displacement: Displacement) -> dict[str, Array]:
    """Corners of the elements and their unit displacements, loads first [m], [m/N].

    The shape functions of vertices are the only ones that do not vanish there.
    """
    mesh = displacement.mesh
    corners = displacement.coefficients[:, :: mesh.order, :: mesh.order]
    return {"mesh_x": mesh.x, "mesh_z": mesh.z, "moved": _loads_first(corners)}


def _loads_first(values: Array) -> Array:
    """From (..., n, 2) to (2n, ...)."""
    return np.moveaxis(values.reshape(*values.shape[:-2], -1), -1, 0)
