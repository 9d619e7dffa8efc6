"""Frames of pads that follow each other, where light does not tell what scales the forces."""

from functools import partial

import numpy as np
import pytest
from scipy.stats import chi2

import fringeforce as ff
from fringeforce.models.pad import PadModel

pytestmark = pytest.mark.slow

EFFECT = {"transducer.photoelastic.strain_optic_coefficient": "0.05 +/- 3 %"}
COVER = EFFECT | {"transducer.compliant.thickness": "0.5 mm +/- 3 %"}
RARE, FRAMES = 1e-6, 24


def along(turn: float) -> tuple[float, float]:
    """Normal and tangential force of a touch that presses and shears."""
    normal = 0.9 + 0.6 * np.sin(3 * turn)
    return normal, 0.4 * normal * np.sin(7 * turn)


def squares_of(model: PadModel, seed: int) -> list[float]:
    """Mahalanobis' squared distances of the forces of touched tactels, of frames in turn."""
    rng = np.random.default_rng(seed)
    built, reader, found = model.as_built(rng), ff.Reader(model), list[float]()
    count = model.sensor.tactels.total
    touched = [count // 2, count // 3]
    for turn in np.linspace(0, 0.3, FRAMES):
        normal, shear = along(turn)
        forces = np.zeros((count, 3))
        forces[touched] = [[normal, shear, 0], [0.5, -0.1 * normal, 0.2 * np.sin(4 * turn)]]
        reading = reader.read(built.expose(forces, rng))
        assert reading.ok
        assert reading.tracked or not found
        off = (reading.forces - forces)[touched].ravel()
        known = reading.covariance.reshape(count, 3, count, 3)[touched][:, :, touched]
        found.append(float(off @ np.linalg.solve(known.reshape(6, 6), off)))
    return found


@pytest.mark.parametrize("stated", [EFFECT, COVER], ids=["effect", "effect and cover"])
def test_forces_on_tactels_keep_the_scale_while_they_change(stated: dict[str, str]) -> None:
    """Steps that mistook a change of forces for one of the scale added up, from frame to frame."""
    drawn = ff.load_sensor("pad").replace(
        **{
            "tactels.count": [4, 3],
            "camera.pixels": [128, 96],
            "transducer.length": "14 mm",
            "transducer.width": "11 mm",
        }
    )
    model = ff.characterize(drawn.replace(**stated))
    assert isinstance(model, PadModel)
    for seed in (1, 2):
        assert max(squares_of(model, seed)) < chi2.isf(RARE / FRAMES, 6)


def test_contacts_on_a_skin_keep_the_scale_while_they_change(small_skin: PadModel) -> None:
    model = small_skin.with_tolerances(**COVER)
    rng = np.random.default_rng(1)
    built, reader = model.as_built(rng), ff.Reader(model)
    press, scales = partial(ff.Press, y=0.3e-3, radius=4e-3), list[float]()
    for turn in np.linspace(0, 0.3, FRAMES):
        normal, shear = along(turn)
        one = press(x=-1e-3 + 2e-3 * turn, normal=normal, tangential=shear)
        reading = reader.read(built.expose([one], rng=rng))
        assert reading.ok
        assert reading.total is not None
        true = np.array([normal, shear, 0.0])
        off = reading.total.force - true
        distance = off @ np.linalg.solve(reading.total.force_covariance, off)
        assert distance < chi2.isf(RARE / FRAMES, 3)
        scales.append(float(off @ true / (true @ true)))
    # a third of the tolerance, several times what noise makes of a force
    assert np.ptp(scales) < 0.01
