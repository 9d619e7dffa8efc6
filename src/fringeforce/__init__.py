"""From the drawing of a photoelastic tactile sensor to forces read from its fringes."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fringeforce.acquisition.live import live
    from fringeforce.calibration.calibrate import calibrate
    from fringeforce.calibration.candidates import Limits
    from fringeforce.calibration.planning import Plan, assess_presses, plan_presses
    from fringeforce.calibration.references import References
    from fringeforce.cameras.choice import open_camera
    from fringeforce.characterization import characterize
    from fringeforce.datasets.making import make_dataset
    from fringeforce.design import Sensor, load_sensor
    from fringeforce.errors import FringeforceError
    from fringeforce.files import load_model
    from fringeforce.loads import polar
    from fringeforce.model import SensorModel
    from fringeforce.pads.patches import touch
    from fringeforce.pads.reader import PadReader
    from fringeforce.phase.noise_free import recover_phase
    from fringeforce.reading.batch import Batch
    from fringeforce.reading.contact import Contact, Friction
    from fringeforce.reading.reader import Reader
    from fringeforce.reading.reading import Reading, Status
    from fringeforce.sinks.choice import open_sink

__all__ = [
    "Batch",
    "Contact",
    "Friction",
    "FringeforceError",
    "Limits",
    "PadReader",
    "Plan",
    "Reader",
    "Reading",
    "References",
    "Sensor",
    "SensorModel",
    "Status",
    "assess_presses",
    "calibrate",
    "characterize",
    "live",
    "load_model",
    "load_sensor",
    "make_dataset",
    "open_camera",
    "open_sink",
    "plan_presses",
    "polar",
    "recover_phase",
    "touch",
]

_HOME = {
    "Batch": "reading.batch",
    "Contact": "reading.contact",
    "Friction": "reading.contact",
    "FringeforceError": "errors",
    "Limits": "calibration.candidates",
    "PadReader": "pads.reader",
    "Plan": "calibration.planning",
    "Reader": "reading.reader",
    "Reading": "reading.reading",
    "References": "calibration.references",
    "Status": "reading.reading",
    "Sensor": "design",
    "SensorModel": "model",
    "assess_presses": "calibration.planning",
    "calibrate": "calibration.calibrate",
    "plan_presses": "calibration.planning",
    "characterize": "characterization",
    "live": "acquisition.live",
    "load_model": "files",
    "load_sensor": "design",
    "make_dataset": "datasets.making",
    "open_camera": "cameras.choice",
    "open_sink": "sinks.choice",
    "polar": "loads",
    "recover_phase": "phase.noise_free",
    "touch": "pads.patches",
}


def __getattr__(name: str) -> Any:
    """Import a public name's module on its first use, so that `import fringeforce` is instant."""
    if name == "__version__":
        from importlib.metadata import version

        return version("fringeforce")
    if name not in _HOME:
        raise AttributeError(f"module 'fringeforce' has no attribute {name!r}")
    return getattr(import_module(f"fringeforce.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
