"""What the explorer takes on: designs that are solved while a person waits."""

from __future__ import annotations

from fringeforce.base.errors import DesignError
from fringeforce.design.strip import Sensor

PIXELS, TACTELS = 8192, 64
STUBBY, SLENDER = 1.0, 200.0
"""Length of the strip over its thickness, least and most."""


def check(sensor: Sensor) -> None:
    """Refuse a design that is too large, or of a shape that no page can show.

    Raises
    ------
    DesignError
        In the words of a design file's problems, so that the page finds the control.
    """
    strip = sensor.transducer
    slenderness = strip.length / (strip.compliant.thickness + strip.photoelastic.thickness)
    problems = []
    if strip.plane == "3d":
        problems.append(
            'transducer.plane = "3d" takes too long while a person waits, and the page draws a '
            'plane; take "stress" or "strain" here.'
        )
    if sensor.camera.pixels > PIXELS:
        problems.append(f"camera.pixels = {sensor.camera.pixels}: must be {PIXELS} or less here.")
    if sensor.tactels.count > TACTELS:
        problems.append(f"tactels.count = {sensor.tactels.count}: must be {TACTELS} or less here.")
    if not STUBBY <= slenderness <= SLENDER:
        problems.append(
            f"transducer.length = {strip.length * 1e3:g} mm is {slenderness:.3g} times the strip's "
            f"thickness; from {STUBBY:g} to {SLENDER:g} times can be explored."
        )
    if problems:
        raise DesignError("\n  ".join(["This design cannot be explored:", *problems]))
