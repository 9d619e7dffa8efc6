"""Skins whose camera and layers have tolerances: frames of sensors that are off, read back."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

import fringeforce as ff
from fringeforce.estimation.frame_exposure import node_phase
from fringeforce.models.presses import tractions
from fringeforce.models.skin import GEOMETRY, Contacts, SkinModel
from fringeforce.reading.skin_reader import SkinReader

RARE = 1e-6
ROLLER = {"transducer.edges": "roller"}
SHIFT = ROLLER | {"camera.shift": "0 +/- 0.2 mm"}
LAYERS = {
    "transducer.compliant.thickness": "0.5 +/- 0.02 mm",
    "transducer.compliant.youngs_modulus": "2 MPa +/- 5 %",
    "transducer.photoelastic.youngs_modulus": "11 MPa +/- 5 %",
}


def off_by(total: ff.Resultant | None, sensor: ff.Sensor, presses: list[ff.Press]) -> float:
    """Mahalanobis distance, squared, of force and centre of pressure."""
    assert total is not None
    parts = [tractions(sensor, press) for press in presses]
    forces, places = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("forces", "places")
    )
    true = [*forces.sum(axis=0), forces[:, 0] @ places / forces[:, 0].sum()]
    off = np.array([*total.force, total.centre[0]]) - true
    known = total.covariance[np.ix_([0, 1, 5], [0, 1, 5])]
    return float(off @ np.linalg.solve(known, off))


@pytest.fixture(scope="module")
def uncertain() -> SkinModel:
    """A skin whose camera may look elsewhere, at another scale, and whose layers are uncertain."""
    tolerances = SHIFT | LAYERS | {"camera.scale": "1 +/- 0.01"}
    return SkinReader(ff.characterize(ff.load_sensor("skin").replace(**tolerances))).skin


@pytest.mark.parametrize("as_seen", [True, False])
def test_a_frame_is_linear_about_contacts_and_modes(uncertain: SkinModel, as_seen: bool) -> None:
    """Slopes of the phase, and of forces and geometry, are those of differences."""
    skin, rng = replace(uncertain, as_seen=as_seen), np.random.default_rng(3)
    spread = skin.units(2).reshape(2, GEOMETRY) / 2
    geometry = skin.limited(skin.drawn + rng.standard_normal((2, GEOMETRY)) * spread)
    contacts = Contacts(rng.uniform(0.5, 2, (2, 2)), geometry)
    drawn = skin.uncertain.frame.at
    others = rng.standard_normal(drawn.size - drawn.fields)
    frame, unknowns = skin.frame(contacts, others=others)
    again = skin.contacts(frame, unknowns)
    np.testing.assert_allclose(again.geometry, geometry, rtol=1e-12, atol=1e-15)
    slopes = skin.slopes(frame, unknowns)

    def anew(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        moved = skin.contacts(frame, at)
        phase = node_phase(*skin.frame(moved, others=at[-len(others) :]))
        return phase, np.concatenate(moved, axis=1)

    for number in range(len(unknowns)):
        step = 1e-4 * np.eye(len(unknowns))[number]
        ends = [anew(unknowns + sign * step) for sign in (1, -1)]
        change = (ends[0][0] - ends[1][0]) / 2e-4
        linear = [node_phase(frame, unknowns + sign * step) for sign in (1, -1)]
        found = (linear[0] - linear[1]) / 2e-4
        np.testing.assert_allclose(found, change, atol=1e-5 * max(np.abs(change).max(), 1e-3))
        expected = (ends[0][1] - ends[1][1]) / 2e-4
        np.testing.assert_allclose(slopes[:, :, number], expected, atol=1e-9)


@pytest.mark.parametrize("shift", [-0.35e-3, -0.12e-3, 0.21e-3, 0.3e-3])
def test_contacts_are_found_under_a_camera_that_is_shifted(shift: float) -> None:
    """Frames of the exact series: the centre is as uncertain as the ends leave the shift."""
    real = ff.characterize(ff.load_sensor("skin").replace(**(ROLLER | {"camera.shift": shift})))
    reader = ff.Reader(ff.characterize(ff.load_sensor("skin").replace(**SHIFT)))
    rng, squares = np.random.default_rng(1), list[float]()
    for _ in range(8):
        places = [rng.uniform(-4e-3, -1e-3), rng.uniform(1.2e-3, 4e-3)][: rng.integers(1, 3)]
        presses = []
        for x in places:
            normal, radius = rng.uniform(0.4, 2), rng.uniform(2e-3, 8e-3)
            shear = rng.uniform(-0.3, 0.3) * normal
            presses.append(ff.Press(x=x, normal=normal, tangential=shear, radius=radius))
        reading = reader.search(real.expose(presses, rng=rng))
        if reading.status is ff.Status.OK:
            squares.append(off_by(reading.total, real.sensor, presses))
    assert len(squares) >= 7
    # the shift is the same in all of them: any one, and not their sum, tells of a wrong one
    assert max(squares) < chi2.isf(RARE, 3)


@pytest.mark.parametrize("tolerances", [SHIFT, SHIFT | LAYERS], ids=["camera", "camera and layers"])
@pytest.mark.parametrize("seed", [2, 3])
def test_contacts_are_followed_within_their_covariance(
    tolerances: dict[str, str], seed: int
) -> None:
    """A touch that slides and shears on a sensor that is not as drawn."""
    model, rng = (
        ff.characterize(ff.load_sensor("skin").replace(**tolerances)),
        np.random.default_rng(seed),
    )
    built, reader, frames = model.as_built(rng), ff.Reader(model), 150
    squares, tracked = list[float](), 0
    for turn in np.linspace(0, 0.4, frames):
        normal = 0.9 + 0.6 * np.sin(3 * turn)
        shear = 0.4 * normal * np.sin(7 * turn)
        press = ff.Press(x=-3e-3 + 5e-3 * turn, normal=normal, tangential=shear, radius=4e-3)
        reading = reader.read(built.expose([press], rng=rng))
        assert reading.status is ff.Status.OK
        tracked += reading.tracked
        squares.append(off_by(reading.total, built.model.sensor, [press]))
    assert tracked > 0.9 * frames
    assert max(squares) < chi2.isf(RARE / frames, 3)
