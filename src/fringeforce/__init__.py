"""From the drawing of a photoelastic tactile sensor to forces read from its fringes."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from fringeforce.base.loop_cache import keep_loops

if TYPE_CHECKING:
    from fringeforce.acquisition.cameras.choice import open_camera
    from fringeforce.acquisition.loop import live
    from fringeforce.acquisition.sinks.choice import open_sink
    from fringeforce.base.errors import FringeforceError
    from fringeforce.calibration.calibrate import calibrate
    from fringeforce.calibration.drift import update
    from fringeforce.calibration.drift_report import Drift
    from fringeforce.calibration.light.references import References
    from fringeforce.calibration.planning.candidates import Limits
    from fringeforce.calibration.planning.plan import Plan, assess_presses, plan_presses
    from fringeforce.calibration.relaxation import find_relaxation
    from fringeforce.contacts.contact import Contact, Friction
    from fringeforce.contacts.loads import polar
    from fringeforce.contacts.press import Press
    from fringeforce.contacts.resultant import Resultant, touch
    from fringeforce.contacts.skin_contacts import SkinContacts
    from fringeforce.datasets.making import make_dataset
    from fringeforce.design.files import load_sensor
    from fringeforce.design.strip import Sensor
    from fringeforce.estimation.phase.noise_free import recover_phase
    from fringeforce.models.as_built import BuiltSensor
    from fringeforce.models.characterization import characterize
    from fringeforce.models.files import load_model
    from fringeforce.models.given import model_from_influence
    from fringeforce.models.strip import SensorModel
    from fringeforce.pictures.finding import find_region
    from fringeforce.pictures.region import Region
    from fringeforce.pictures.sampling import Sampler
    from fringeforce.reading.batch import Batch
    from fringeforce.reading.reader import Reader
    from fringeforce.reading.reading import Reading, Status

__all__ = [
    "Batch",
    "BuiltSensor",
    "Contact",
    "Drift",
    "Friction",
    "FringeforceError",
    "Limits",
    "Plan",
    "Press",
    "Reader",
    "Reading",
    "References",
    "Region",
    "Resultant",
    "Sampler",
    "Sensor",
    "SensorModel",
    "SkinContacts",
    "Status",
    "assess_presses",
    "calibrate",
    "characterize",
    "find_region",
    "find_relaxation",
    "live",
    "load_model",
    "load_sensor",
    "make_dataset",
    "model_from_influence",
    "open_camera",
    "open_sink",
    "plan_presses",
    "polar",
    "recover_phase",
    "touch",
    "update",
]

_HOME = {
    "Batch": "reading.batch",
    "BuiltSensor": "models.as_built",
    "Contact": "contacts.contact",
    "Drift": "calibration.drift_report",
    "Friction": "contacts.contact",
    "FringeforceError": "base.errors",
    "Limits": "calibration.planning.candidates",
    "Plan": "calibration.planning.plan",
    "Press": "contacts.press",
    "Reader": "reading.reader",
    "Reading": "reading.reading",
    "References": "calibration.light.references",
    "Region": "pictures.region",
    "Resultant": "contacts.resultant",
    "Sampler": "pictures.sampling",
    "SkinContacts": "contacts.skin_contacts",
    "Status": "reading.reading",
    "Sensor": "design.strip",
    "SensorModel": "models.strip",
    "assess_presses": "calibration.planning.plan",
    "calibrate": "calibration.calibrate",
    "plan_presses": "calibration.planning.plan",
    "characterize": "models.characterization",
    "find_region": "pictures.finding",
    "find_relaxation": "calibration.relaxation",
    "live": "acquisition.loop",
    "load_model": "models.files",
    "model_from_influence": "models.given",
    "load_sensor": "design.files",
    "make_dataset": "datasets.making",
    "open_camera": "acquisition.cameras.choice",
    "open_sink": "acquisition.sinks.choice",
    "polar": "contacts.loads",
    "recover_phase": "estimation.phase.noise_free",
    "touch": "contacts.resultant",
    "update": "calibration.drift",
}

keep_loops()


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
