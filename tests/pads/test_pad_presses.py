"""Presses on pads: contact mechanics against closed forms, and light against that of tactels."""

from typing import Any

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.contacts.elastic_contact import Compliance, body_forces, pressed
from fringeforce.contacts.press import Press, Profile
from fringeforce.mechanics.solid.block import Block
from fringeforce.mechanics.solid.surface import contact_modulus, patch_displacement
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_presses import grid_of, pad_tractions, press_slices, surface_of
from fringeforce.models.pad_slices import block_of

STEP, COUNT = 10e-6, 60
RADIUS, NORMAL, FRICTION = 5e-3, 0.5, 0.5


@pytest.fixture(scope="module")
def deep() -> Block:
    """A cover much thicker than the contacts are wide."""
    pad = ff.load_sensor("pad").replace(
        **{"transducer.compliant.thickness": "30 mm", "transducer.length": "80 mm"}
    )
    return block_of(pad)


@pytest.fixture(scope="module")
def surface(deep: Block) -> Compliance:
    return Compliance(STEP, patch_displacement(deep, STEP, 2 * COUNT))


def radius_of(block: Block, normal: float) -> float:
    """K. L. Johnson, Contact Mechanics, 1985, equation (4.22)."""
    return float(np.cbrt(3 * normal * RADIUS / (4 * contact_modulus(block))))


def hertz(r: np.ndarray, half: float, normal: float) -> np.ndarray:
    """Johnson's equation (3.39), as forces of the grid's squares."""
    peak = 3 * normal / (2 * np.pi * half**2) * STEP**2
    return peak * np.sqrt(np.maximum(1 - (r / half) ** 2, 0))


def test_pressure_under_a_sphere_is_that_of_hertz(deep: Block, surface: Compliance) -> None:
    x, y = grid_of(surface)
    r = np.hypot(x, y)
    found = pressed(surface, r**2 / (2 * RADIUS), NORMAL)
    half = radius_of(deep, NORMAL)
    assert 20 * STEP < half < 55 * STEP
    assert np.isclose(found.sum(), NORMAL)
    assert abs(np.sqrt((found > 0).sum() / np.pi) * STEP - half) < STEP
    inner = r < 0.9 * half
    theory = hertz(r, half, NORMAL)
    assert np.abs(found - theory)[inner].max() < 0.01 * theory.max()


def test_a_round_edge_presses_the_surface_flat() -> None:
    """A half-space sinks by the sum of forces over distances, Johnson's equation (3.22)."""
    press = Press(x=0.0, y=0.0, normal=1.0, width=2.0, profile="edge", angle=90.0)
    places, forces = press.distributed_on_pad()
    assert np.isclose(forces[:, 0].sum(), 1.0)
    np.testing.assert_allclose(forces[:, 0] @ places, [0.0, 1 / 3], atol=1e-12)
    # beside the plane of the forces, where sums are smooth, and back to it
    at = np.array([[0.0, -0.4], [0.3, -0.1], [-0.2, 0.2], [0.1, 0.5], [0.4, 0.3], [-0.5, -0.2]])
    heights = np.array([0.16, 0.2, 0.24, 0.28])
    away = np.linalg.norm(at[:, None] - places, axis=2)
    sinking = np.array([(forces[:, 0] / np.hypot(away, h)).sum(axis=1) for h in heights])
    sinking = np.polynomial.polynomial.polyfit(heights, sinking, 3)[0]
    plane = np.column_stack([np.ones(len(at)), at])
    found, *_ = np.linalg.lstsq(plane, sinking)
    np.testing.assert_allclose(plane @ found, sinking, rtol=3e-3)
    # as deep in its middle as a punch that is not tilted, equation (3.36)
    np.testing.assert_allclose(found[:2], [np.pi / 2, 0.0], atol=0.02)
    assert found[2] > 0.1


def test_a_long_edge_presses_along_one_side() -> None:
    press = Press(
        x=0.0, y=0.0, normal=3.0, width=(1e-3, 4e-3), profile="edge", outline="rectangle", angle=90
    )
    places, forces = press.distributed_on_pad()
    centre = forces[:, 0] @ places / 3.0
    np.testing.assert_allclose(centre, [0.0, 0.25e-3], atol=1e-9)
    beyond = forces[places[:, 1] > 0.4e-3, 0].sum()
    before = forces[places[:, 1] < -0.4e-3, 0].sum()
    assert beyond > 20 * before


@pytest.mark.parametrize("used", [0.3, 0.8])
def test_shear_under_a_sphere_is_that_of_cattaneo_and_mindlin(
    deep: Block, surface: Compliance, used: float
) -> None:
    x, y = grid_of(surface)
    r = np.hypot(x, y)
    shear = used * FRICTION * NORMAL
    found = body_forces(surface, r**2 / (2 * RADIUS), NORMAL, (0.6 * shear, -0.8 * shear), FRICTION)
    np.testing.assert_allclose(found.sum(axis=(0, 1)), [NORMAL, 0.6 * shear, -0.8 * shear])
    size = np.hypot(found[..., 1], found[..., 2])
    assert (size <= FRICTION * found[..., 0] * (1 + 1e-6)).all()
    # Johnson's equations (7.41) and (7.44)
    half = radius_of(deep, NORMAL)
    stuck = half * np.cbrt(1 - used)
    full, less = hertz(r, half, NORMAL), hertz(r, stuck, NORMAL * (1 - used))
    # the edges of contact and of the stick zone, where both are steep, fall between squares
    theory, inner = FRICTION * (full - less), (r < 0.9 * half) & (np.abs(r - stuck) > 2 * STEP)
    assert np.abs(size - theory)[inner].max() < 0.03 * theory.max()


def test_a_flat_punch_has_the_singular_pressure_of_a_rigid_one(surface: Compliance) -> None:
    x, y = grid_of(surface)
    r, half = np.hypot(x, y), 40.5 * STEP
    found = pressed(surface, np.where(r < half, 0.0, np.inf), 1.0)
    # Johnson's equation (3.34)
    inner = r < 0.8 * half
    theory = STEP**2 / (2 * np.pi * half * np.sqrt(half**2 - r[inner] ** 2))
    np.testing.assert_allclose(found[inner], theory, rtol=0.03)


def test_a_surface_on_stiff_layers_gives_way_less(deep: Block) -> None:
    thin = block_of(ff.load_sensor("pad"))
    near, far = (patch_displacement(one, 50e-6, 60) for one in (thin, deep))
    assert 0.8 < near[60, 60] / far[60, 60] < 1.0
    assert abs(near[60, -1]) < 0.1 * far[60, -1]  # six covers away


def test_a_sphere_on_a_pad_touches_less_than_on_its_cover_alone() -> None:
    pad = ff.load_sensor("pad")
    press = Press(x=1e-3, y=-2e-3, normal=4.0, tangential=(0.8, -0.5), radius=8e-3)
    places, forces = pad_tractions(pad, press)
    np.testing.assert_allclose(forces.sum(axis=0), [4.0, 0.8, -0.5])
    np.testing.assert_allclose(forces[:, 0] @ places / 4.0, [1e-3, -2e-3], atol=1e-6)
    half = np.cbrt(3 * 4.0 * 8e-3 / (4 * contact_modulus(block_of(pad))))
    assert 0.4 * half < np.ptp(places[:, 0]) / 2 < half


@pytest.mark.parametrize(
    ("profile", "second"), [("flat", 1 / 4), ("hertz", 1 / 5), ("punch", 1 / 3)]
)
def test_profiles_have_the_moments_of_their_weight(profile: Profile, second: float) -> None:
    press = Press(
        x=1e-3, y=2e-3, normal=2.0, tangential=(0.5, 0.1), width=(3e-3, 1e-3), angle=90.0,
        profile=profile,
    )  # fmt: skip
    places, forces = press.distributed_on_pad()
    np.testing.assert_allclose(forces.sum(axis=0), [2.0, 0.5, 0.1])
    np.testing.assert_allclose(forces[:, 0] @ places / 2.0, [1e-3, 2e-3])
    spread = forces[:, 0] @ np.square(places - [1e-3, 2e-3]) / 2.0
    np.testing.assert_allclose(spread, second * np.square([0.5e-3, 1.5e-3]))


@pytest.fixture(scope="module")
def model() -> PadModel:
    pad = ff.load_sensor("pad").replace(camera={"pixels": [64, 64]})
    model = ff.characterize(pad)
    assert isinstance(model, PadModel)
    return model


def test_light_of_a_uniform_press_on_a_tactel_is_that_of_the_tactel(model: PadModel) -> None:
    pad = model.sensor
    forces = np.zeros((121, 3))
    forces[47] = 3.0, 1.0, -0.5
    x, y = pad.tactels.places[47]
    press = Press(
        x=x, y=y, normal=3.0, tangential=(1.0, -0.5), width=(2e-3, 2e-3), profile="flat",
        outline="rectangle",
    )  # fmt: skip
    of_tactel, of_press = model.retardance(forces), model.retardance([press])
    # the model leaves out 0.2 % in its depth profiles
    assert np.abs(of_press - of_tactel).max() < 4e-3 * np.abs(of_tactel).max()
    assert np.abs(model.intensity([press]) - model.intensity(forces)).max() < 4e-3


def test_slices_are_as_fine_as_need_be(model: PadModel, monkeypatch: pytest.MonkeyPatch) -> None:
    press = [Press(x=0.3e-3, y=1.1e-3, normal=5.0, tangential=(1.5, 0.0), radius=4e-3)]
    coarse = model.seen(press_slices(model.sensor, press, *model.pixel_positions))
    monkeypatch.setattr("fringeforce.models.pad_presses.SLICES", 48)
    fine = model.seen(press_slices(model.sensor, press, *model.pixel_positions))
    assert np.abs(coarse - fine).max() * model.sensor.camera.amplitude < 0.1


def test_frames_of_presses_come_singly_and_in_rows(model: PadModel) -> None:
    one = [Press(x=0.0, y=0.0, normal=1.0, radius=3e-3)]
    other = [*one, Press(x=3e-3, y=-4e-3, normal=0.5)]
    assert model.expose(one, rng=0).shape == (64, 64)
    frames = model.expose([one, other], rng=0)
    assert frames.shape == (2, 64, 64)
    assert model.retardance([one, other]).shape == (2, 2, 64, 64)
    built = model.with_tolerances(**{"tactels.placement": "0 +/- 0.1 mm"}).as_built(rng=1)
    np.testing.assert_allclose(built.intensity(one), model.intensity(one), atol=1e-6)
    assert built.expose([one, other], rng=0).shape == (2, 64, 64)
    # where nothing touches, nothing acts on the tactels
    untouched = built.intensity(np.zeros((model.sensor.tactels.total, 3)))
    np.testing.assert_allclose(built.intensity([[], one])[0], untouched, atol=1e-6)
    np.testing.assert_allclose(built.intensity([]), untouched, atol=1e-6)


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        ({"y": np.inf}, "y = inf"),
        ({"tangential": (0.5, 0.5)}, "friction of 0.6"),
        ({"width": (1e-3, 0.0)}, "width = "),
        ({"width": (1e-3, 1e-3, 1e-3)}, "two on a pad"),
        ({"outline": "star", "width": 1e-3}, "'star'"),
    ],
)
def test_what_cannot_press_a_pad_is_told(numbers: dict[str, Any], words: str) -> None:
    given: dict[str, Any] = {"x": 0.0, "y": 0.0, "normal": 1.0, **numbers}
    with pytest.raises(InputError, match=words):
        Press(**given)


def test_presses_of_the_other_kind_of_sensor_are_told(model: PadModel) -> None:
    with pytest.raises(InputError, match="needs its y"):
        model.expose([Press(x=0.0, normal=1.0)])
    with pytest.raises(InputError, match="is one on a pad"):
        ff.characterize(ff.load_sensor("saad")).expose([Press(x=0.0, y=0.0, normal=1.0)])
    with pytest.raises(InputError, match="one on a pad; give its y"):
        Press(x=0.0, normal=1.0, tangential=(0.1, 0.1))
    with pytest.raises(InputError, match="along y, beyond the pad"):
        model.expose([Press(x=0.0, y=12.4e-3, normal=1.0, width=1e-3)])
    free = model.sensor.replace(**{"transducer.sides": "free"})
    with pytest.raises(InputError, match='sides = "free"'):
        press_slices(free, [Press(x=0.0, y=0.0, normal=1.0)], *model.pixel_positions)


def test_surfaces_are_computed_once() -> None:
    pad = ff.load_sensor("pad")
    assert surface_of(pad, 50e-6, 10) is surface_of(pad, 50e-6, 10)


def test_hardly_any_shear_under_a_sphere_changes_nothing(model: PadModel) -> None:
    sphere = {"x": 0.5e-3, "y": 0.2e-3, "normal": 0.02, "radius": 20e-3}
    light = model.intensity([ff.Press(**sphere)])
    np.testing.assert_allclose(
        model.intensity([ff.Press(**sphere, tangential=(1e-30, 0.0))]), light, atol=1e-6
    )
