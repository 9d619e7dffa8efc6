"""What the page of a skin needs to know of a design."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.design.strip import Sensor
from fringeforce.explorer import solution
from fringeforce.explorer.limits import check_skin
from fringeforce.models.characterization import characterize
from fringeforce.models.strip import SensorModel


def solved(sensor: Sensor, known: SensorModel | None = None) -> SensorModel:
    """The model of a skin.

    Parameters
    ----------
    sensor : Sensor
        The design.
    known : SensorModel, optional
        Model of the design, where there is one already.

    Raises
    ------
    InputError
        If the design cannot be explored.
    """
    check_skin(sensor)
    return characterize(sensor) if known is None else known


def facts(model: SensorModel) -> Mapping[str, Any]:
    """What the page is told of a skin, as JSON values."""
    assert model.sensor.skin is not None
    strip = model.sensor.transducer
    return {
        **solution.facts(model),
        "extent": model.sensor.skin.extent,
        "finite": strip.strain == "finite",
    }


def blocks(model: SensorModel) -> Mapping[str, NDArray[Any]]:
    """Places of the pixels [m]."""
    return {"x": np.asarray(model.pixel_positions, np.float32)}
