"""Whether a strip's plane is good for its width, from a quick solution in three dimensions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fringeforce.base.progress import Progress
from fringeforce.contacts.loads import paper_load
from fringeforce.design.strip import Sensor, Tactels
from fringeforce.mechanics.solid.strip import QUICK
from fringeforce.models.strip import characterize
from fringeforce.models.strip_width import strip_width

GOOD_PLANE = 0.05
"""Share of the largest phase up to which a plane counts as good: twice what those bricks leave, and
the larger level of the study of the width."""
LINE_LOADS = 11
"""Line loads at most, as on the paper's strip."""
PLACES = 501
"""Places along the strip at which phases are compared."""
PLANES = ("stress", "strain")


@dataclass(frozen=True)
class PlaneCheck:
    """How far either plane is from the strip as it is.

    Attributes
    ----------
    sensor : Sensor
        The design.
    away : dict
        By plane, the largest deviation of the phase in mid-width under 1 N at 10 degrees on every
        tactel, over its largest value in that plane.

    Examples
    --------
    >>> from fringeforce.models.plane_check import plane_check
    >>> found = plane_check(ff.load_sensor("saad"))
    >>> found.nearest, found.good
    ('stress', False)
    """

    sensor: Sensor
    away: dict[str, float]

    @property
    def nearest(self) -> str:
        """The plane that is less far away."""
        return min(self.away, key=lambda plane: self.away[plane])

    @property
    def good(self) -> bool:
        """Whether the design's own choice is good; three dimensions always are."""
        return self.away.get(self.sensor.transducer.plane, 0.0) <= GOOD_PLANE

    @property
    def words(self) -> str:
        """A sentence on the design's plane, and which to take where it is poor."""
        own, best = self.sensor.transducer.plane, self.nearest
        if own == "3d":
            return "solved in three dimensions, good for any width"
        width = f"{self.sensor.transducer.width * 1e3:.3g} mm"
        said = f"plane {own} is {_percent(self.away[own])} off at a width of {width}"
        if self.good:
            return f"{said}, good enough"
        if self.away[best] <= GOOD_PLANE:
            return f'{said}; take plane = "{best}", {_percent(self.away[best])} off'
        if self.sensor.transducer.strain == "finite":
            return (
                f"{said}, which is poor; calibrate, for large strain is solved in a plane, or take "
                'strain = "linear" and plane = "3d"'
            )
        return f'{said}, which is poor; take plane = "3d"'


def plane_check(sensor: Sensor, progress: Progress | None = None) -> PlaneCheck:
    """Compare both planes with a solution in three dimensions, in a second or two.

    Parameters
    ----------
    sensor : Sensor
        The design; of a skin, or of many tactels, 11 lines all over it stand for its loads.
    progress : callable, optional
        Told words, the steps done and their count.
    """
    drawn = sensor.tactels
    ends = np.abs(drawn.positions).max() if sensor.skin is None else sensor.skin.extent / 2
    lines = Tactels(count=min(drawn.total, LINE_LOADS), pitch=drawn.pitch)
    if drawn.total > LINE_LOADS:
        lines = Tactels(count=LINE_LOADS, pitch=2 * ends / (LINE_LOADS - 1))
    elif drawn.placed is not None:
        lines = drawn
    loads = paper_load(lines.count)
    x = np.linspace(-0.5, 0.5, PLACES) * sensor.transducer.length

    def variant(plane: str) -> Sensor:
        parts = sensor.small_strain.model_dump(
            by_alias=True, exclude={"skin", "tactels", "camera", "tolerances"}
        )
        parts["transducer"] |= {"plane": plane, "relaxation": ()}
        camera = sensor.camera.model_copy(update={"line_position": None, "line_width": None})
        return Sensor(**parts, tactels=lines, camera=camera)

    found = strip_width(variant("3d"), QUICK, progress, (np.zeros(1), np.ones(1)))
    solid = found.phases(loads, x)[0][0]
    phases = {plane: characterize(variant(plane)).phase(loads, x) for plane in PLANES}
    away = {p: float(np.abs(solid - v).max() / np.abs(v).max()) for p, v in phases.items()}
    return PlaneCheck(sensor, away)


def _percent(share: float) -> str:
    return f"{share:.0%}".replace("%", " %") if share >= 0.01 else "less than 1 %"
