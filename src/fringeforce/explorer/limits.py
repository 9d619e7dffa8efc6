"""What the explorer takes on: designs that are solved while a person waits."""

from __future__ import annotations

from fringeforce.base.errors import DesignError
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor

PIXELS, TACTELS, LINES = 8192, 64, 400
PAD_PIXELS, PAD_TACTELS = 512, 400
"""Most pixels, along either side of a pad's image, tactels, and line loads of a skin."""
SLENDERNESS, PAD_SLENDERNESS = (1.0, 200.0), (2.0, 50.0)
"""Side of a sensor over its thickness, least and most."""


def check(sensor: Sensor) -> None:
    """Refuse a strip that is too large, or of a shape that no page can show.

    Raises
    ------
    DesignError
        In the words of a design file's problems, so that the page finds the control.
    """
    problems = []
    if sensor.skin is not None:
        problems.append("skin: this page shows forces of tactels; open the design of the skin.")
    if sensor.tactels.count > TACTELS:
        problems.append(f"tactels.count = {sensor.tactels.count}: must be {TACTELS} or less here.")
    _refuse([*problems, *_of_line(sensor)])


def check_skin(sensor: Sensor) -> None:
    """Refuse a skin that is too large, or of a shape that no page can show.

    Raises
    ------
    DesignError
        As of `check`.
    """
    problems = []
    if sensor.skin is None:
        problems.append(
            "tactels: this page shows contacts on a skin; open the design of the strip."
        )
    if sensor.tactels.count > LINES:
        problems.append(
            f"skin.resolution makes {sensor.tactels.count} line loads of this skin; {LINES} or "
            "fewer can be explored here."
        )
    _refuse([*problems, *_of_line(sensor)])


def check_pad(pad: Pad, solved: bool = False) -> None:
    """Refuse a pad that is too large, or that takes too long unless it is solved already.

    Raises
    ------
    DesignError
        In the words of a design file's problems, so that the page finds the control.
    """
    problems = []
    if pad.tactels.total > PAD_TACTELS:
        problems.append(
            f"tactels.count = {list(pad.tactels.count)}: {PAD_TACTELS} tactels or fewer can be "
            "explored here."
        )
    if max(pad.camera.pixels) > PAD_PIXELS:
        problems.append(
            f"camera.pixels = {list(pad.camera.pixels)}: must be {PAD_PIXELS} or less here."
        )
    if pad.transducer.sides != "roller" and not solved:
        problems.append(
            f'transducer.sides = "{pad.transducer.sides}" takes finite elements and minutes. Solve '
            "it once with  fringeforce characterize DESIGN -o model.h5  and explore model.h5, or "
            'take "roller" here.'
        )
    _refuse([*problems, *_slenderness(pad, ("length", "width"), "pad", PAD_SLENDERNESS)])


def _of_line(sensor: Sensor) -> list[str]:
    """What is wrong with any strip that is seen by a line camera."""
    problems = []
    if sensor.transducer.plane == "3d":
        problems.append(
            'transducer.plane = "3d" takes too long while a person waits, and the page draws a '
            'plane; take "stress" or "strain" here.'
        )
    if sensor.camera.pixels > PIXELS:
        problems.append(f"camera.pixels = {sensor.camera.pixels}: must be {PIXELS} or less here.")
    return [*problems, *_slenderness(sensor, ("length",), "strip", SLENDERNESS)]


def _slenderness(
    sensor: Sensor | Pad, sides: tuple[str, ...], what: str, limits: tuple[float, float]
) -> list[str]:
    block, (least, most) = sensor.transducer, limits
    thickness = block.compliant.thickness + block.photoelastic.thickness
    return [
        f"transducer.{name} = {getattr(block, name) * 1e3:g} mm is "
        f"{getattr(block, name) / thickness:.3g} times the {what}'s thickness; from {least:g} to "
        f"{most:g} times can be explored."
        for name in sides
        if not least <= getattr(block, name) / thickness <= most
    ]


def _refuse(problems: list[str]) -> None:
    if problems:
        raise DesignError("\n  ".join(["This design cannot be explored:", *problems]))
