"""From the drawing of any sensor to its model."""

from __future__ import annotations

from typing import overload

from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.mechanics.mesh import Mesh
from fringeforce.models import strip as strips
from fringeforce.models.pad import PadModel, characterize_pad


@overload
def characterize(
    sensor: Sensor, mesh: Mesh | str | None = None, progress: Progress | None = None
) -> strips.SensorModel: ...


@overload
def characterize(
    sensor: Pad, mesh: Mesh | str | None = None, progress: Progress | None = None
) -> PadModel: ...


def characterize(
    sensor: Sensor | Pad, mesh: Mesh | str | None = None, progress: Progress | None = None
) -> strips.SensorModel | PadModel:
    """Reduce a design to its influence: a strip to its matrix, with finite elements (Section III).

    Parameters
    ----------
    sensor : Sensor or Pad
        The design.
    mesh : Mesh or str, optional
        The elements of a strip; those that the design asks for if not given.
    progress : callable, optional
        Told words, the steps done and their count where they take long, in three dimensions.

    Returns
    -------
    SensorModel or PadModel
        On the default mesh a strip's influence matrix is within 1e-4 of the exact one.

    Raises
    ------
    InputError
        If a mesh is given for a pad.

    Examples
    --------
    >>> ff.characterize(ff.load_sensor("saad")).psi.shape[1:]
    (11, 2)
    """
    if not isinstance(sensor, Sensor | Pad):
        raise InputError(
            f"A model is made of a design, and this is of the kind {type(sensor).__name__}; take a "
            "design from load_sensor(path)."
        )
    if not isinstance(sensor, Pad):
        return strips.characterize(sensor, mesh, progress)
    if mesh not in (None, "default"):
        raise InputError(f"mesh = {mesh!r} belongs to strips; leave it out for a pad.")
    return characterize_pad(sensor, progress=progress)
