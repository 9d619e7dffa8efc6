"""A pad that is solved and read quickly."""

from fringeforce.design.files import load_sensor
from fringeforce.design.pad import Pad


def small_pad() -> Pad:
    """25 tactels, 96 x 96 pixels."""
    few = {"tactels.count": [5, 5], "tactels.pitch": "3 mm", "camera.pixels": [96, 96]}
    return load_sensor("pad").replace(**few)
