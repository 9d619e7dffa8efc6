"""One design in a few numbers, by which designs are compared."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import Tolerances
from fringeforce.mechanics.mesh import strip_mesh
from fringeforce.models.strip import SensorModel, characterize
from fringeforce.reading.strip_reader import StripFrameReader
from fringeforce.studies.limits import (
    SIGN_BY_CONTACT,
    border_influence,
    densest_fringes,
    edge_limit,
    largest_phase,
    nyquist_limit,
    strain_limit,
    strain_per_newton,
)
from fringeforce.studies.loads import load_maps

MESH_ORDER = 5
"""Order of the elements where many designs are compared; within 1e-3 of the exact influence."""


def _in(unit: str) -> Any:
    return field(metadata={"unit": unit})


@dataclass(frozen=True)
class Performance:
    """What a design does under loads up to a working load.

    Attributes
    ----------
    worst_uncertainty, mean_uncertainty : float
        Largest and mean standard deviation of a force read from one frame [N], with tolerances of
        light and camera, layers and contacts as drawn.
    largest_load : float
        Normal force on a tactel up to which camera and linear elasticity follow any load [N].
    edge_load : float
        The same for the paper's start, with the sign from contact [N].
    nyquist_load, strain_load : float
        The two limits behind `largest_load` [N].
    peak_phase : float
        Largest phase under the worst load [rad].
    fringes_per_pixel, strain : float
        At the working load.
    condition : float
        Condition number of the influence matrix.
    thickness, volume : float
        Thickness and volume of the strip [m], [m^3].
    """

    worst_uncertainty: float = _in("N")
    mean_uncertainty: float = _in("N")
    largest_load: float = _in("N")
    edge_load: float = _in("N")
    nyquist_load: float = _in("N")
    strain_load: float = _in("N")
    peak_phase: float = _in("rad")
    fringes_per_pixel: float = _in("")
    strain: float = _in("")
    condition: float = _in("")
    thickness: float = _in("m")
    volume: float = _in("m^3")


UNITS: dict[str, str] = {one.name: one.metadata["unit"] for one in fields(Performance)}
"""Unit of every number."""
NAMES = tuple(UNITS)


def coarse_model(sensor: Sensor, order: int = MESH_ORDER) -> SensorModel:
    """A design characterised on elements of a given order; in three dimensions on its own."""
    if sensor.transducer.plane == "3d":
        return characterize(sensor)
    return characterize(sensor, strip_mesh(sensor.transducer, sensor.tactels.positions, order))


def performance(
    model: SensorModel, working_load: float, seed: np.random.SeedSequence
) -> Performance:
    """Compute what a design does.

    Parameters
    ----------
    model : SensorModel
        Characterised.
    working_load : float
        Largest normal force on a tactel that it is to read [N].
    seed : SeedSequence
        Seed of the scattered loads among those that it is judged by.
    """
    strip = model.sensor.transducer
    loads = load_maps(seed, model.sensor.tactels.count, working_load)
    std = uncertainties(model, loads)
    nyquist, strain = nyquist_limit(model), strain_limit(model)
    psi = model.pixel_influence
    thickness = strip.compliant.thickness + strip.photoelastic.thickness
    return Performance(
        worst_uncertainty=float(std.max()),
        mean_uncertainty=float(std.mean()),
        largest_load=min(nyquist, strain),
        edge_load=edge_limit(border_influence(model), interval=SIGN_BY_CONTACT),
        nyquist_load=nyquist,
        strain_load=strain,
        peak_phase=working_load * float(largest_phase(psi).max()),
        fringes_per_pixel=working_load * densest_fringes(model),
        strain=working_load * strain_per_newton(model),
        condition=float(np.linalg.cond(psi.reshape(len(psi), -1))),
        thickness=thickness,
        volume=thickness * strip.length * strip.width,
    )


def light_reader(model: SensorModel) -> StripFrameReader:
    """What reads a strip of small strain with tolerances of light and camera alone.

    Those of layers and contacts would cost solutions of each of many designs.
    """
    sensor, mine = model.sensor, ("camera.", "polariscope.")
    kept = {path: std for path, std in sensor.tolerances.items() if path.startswith(mine)}
    small = sensor.transducer.small_strain.model_copy(update={"influence_error": 0.0})
    alone = sensor.model_copy(update={"tolerances": Tolerances(kept), "transducer": small})
    return StripFrameReader(replace(model, sensor=alone))


def uncertainties(model: SensorModel, loads: np.ndarray) -> np.ndarray:
    """Standard deviations of one frame's forces under loads (k, n, 2), shape (k, n, 2) [N]."""
    spreads = covariances(light_reader(model), loads)
    return np.sqrt(np.diagonal(spreads, axis1=1, axis2=2)).reshape(loads.shape)


def covariances(reader: StripFrameReader, loads: np.ndarray) -> np.ndarray:
    """Covariances that readings of loads (k, n, 2) state, shape (k, 2n, 2n) [N^2]."""
    return np.array([reader.expected_covariance(load) for load in loads])
