"""Small benches of pads: what is drawn, what was built, and frames of presses on it."""

import numpy as np

import fringeforce as ff
from fringeforce.calibration.bench_loads import BenchLoads, bench_loads
from fringeforce.contacts.press import Press, Profile
from fringeforce.design.pad import Pad
from fringeforce.models.pad import PadModel, characterize_pad

COVER = "transducer.compliant.thickness"
EFFECT = "transducer.photoelastic.strain_optic_coefficient"
TRUE = {COVER: 0.54e-3, EFFECT: 0.053, "camera.shift_x": 0.15e-3, "camera.amplitude": 228.0}
DARK, PRESSES, PIXELS = 2, 10, 32
PROFILES: tuple[Profile, ...] = "hertz", "flat", "punch"
WRONG, DEAD = 5, (7, 600, 911)


def drawing(**changes) -> Pad:
    return ff.load_sensor("pad").replace(
        **{
            "transducer.length": "7 mm",
            "transducer.width": "7 mm",
            "tactels.count": [2, 2],
            "camera.pixels": [PIXELS, PIXELS],
            "camera.amplitude": 235.0,
            **changes,
        }
    )


def built(**changes) -> PadModel:
    """The pad that was made."""
    made = drawing(**{**TRUE, "camera.drift": 0.01, **changes})
    return characterize_pad(made, None, 48, 8)


def measured() -> tuple[np.ndarray, BenchLoads]:
    """Frames of single presses, 0.05 mm rms beside what is written down; one is wrong."""
    return bench()[:2]


def bench() -> tuple[np.ndarray, BenchLoads, np.ndarray]:
    """The same, and the places where presses were."""
    rng, model, presses = np.random.default_rng(11), built(), []
    for number in range(PRESSES):
        x, y = rng.uniform(-1.5e-3, 1.5e-3, 2)
        normal, angle = rng.uniform(0.8, 2.5), rng.uniform(0, 2 * np.pi)
        shear = 0.3 * normal * np.array([np.cos(angle), np.sin(angle)])
        width, profile = rng.uniform(1.4e-3, 2.2e-3), PROFILES[number % 3]
        tangential = shear[0], shear[1]
        presses.append(
            Press(x=x, y=y, normal=normal, tangential=tangential, width=width, profile=profile)
        )
    silent = model.expose(np.zeros((DARK, 4, 3)), rng)
    pressed = model.expose([[one] for one in presses], rng)
    frames = np.concatenate([silent, pressed]).reshape(DARK + PRESSES, -1)
    frames[:, DEAD] = 0
    true = np.array([[one.x, one.y] for one in presses])
    places = true + 0.05e-3 * rng.standard_normal(true.shape)
    forces = np.array([[one.normal, *one.shear] for one in presses])
    forces *= 1 + 0.01 * rng.standard_normal(forces.shape)
    forces[WRONG - DARK] *= 1.4
    loads = bench_loads(places, forces, np.arange(DARK, DARK + PRESSES), DARK + PRESSES)
    return frames.reshape(-1, PIXELS, PIXELS), loads, true
