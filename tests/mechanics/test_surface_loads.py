"""Loads that follow the surface, against closed forms and finite differences."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.mechanics.elements import interpolation
from fringeforce.mechanics.finite_strain import FiniteStrip, finite_strip
from fringeforce.mechanics.surface_loads import (
    ComplexArray,
    FollowerLoad,
    Patches,
    SurfacePlaces,
    Together,
    TurningForces,
)

Array = NDArray[np.float64]
FORCES = np.array([[0.8, 0.2], [0.5, -0.3]])
ORDER = 4


@pytest.fixture(scope="module")
def load() -> FollowerLoad:
    """On two patches of some elements each."""
    x = np.array([0.0, 0.7, 1.0, 1.4, 2.1, 2.3, 3.0]) * 1e-3
    return FollowerLoad(Patches(ORDER, x, np.array([1, 4]), np.array([3, 6])), FORCES)


@pytest.fixture(scope="module")
def moved(load: FollowerLoad) -> Array:
    """A rough displacement of the surface [m]."""
    shape = 2, load.patches.shares.shape[1]
    return np.random.default_rng(0).standard_normal(shape) * 5e-5


def _strip(sensor: ff.Sensor, loads: str, **changes: Any) -> FiniteStrip:
    paths = {f"transducer.{key}": value for key, value in changes.items()}
    follows = {"tactels.contact_width": 5e-4, "transducer.strain": "finite"}
    design = sensor.replace(**paths, **follows, **{"transducer.loads": loads})
    return finite_strip(design.transducer, [-1e-3, 2e-3], [5e-4, 5e-4], order=3)


def test_loads_of_a_strip_that_turns_as_a_whole_turn_with_it(load: FollowerLoad) -> None:
    """The patch test of follower loads."""
    still = load.nodal(np.zeros((2, load.patches.shares.shape[1])))
    np.testing.assert_allclose(still, load.patches.dead(FORCES).nodal(still), atol=1e-15)
    angle, x = 0.7, load.patches.x
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = np.zeros_like(still)
    moved[:, ::ORDER] = (turn - np.eye(2)) @ np.stack([x, np.zeros_like(x)]) + [[2e-3], [1e-3]]
    np.testing.assert_allclose(load.nodal(moved), turn @ still, atol=1e-15)


def test_a_force_is_the_resultant_normal_and_tangential_to_the_chord(
    load: FollowerLoad, moved: Array
) -> None:
    """That of a uniform pressure on any curve is normal to the chord, and proportional to it."""
    total, expected = load.nodal(moved)[:, ::ORDER].sum(axis=1), np.zeros(2)
    place = np.stack([load.patches.x, 0 * load.patches.x]) + moved[:, ::ORDER]
    for (normal, tangential), first, last in zip(FORCES, [1, 4], [3, 6], strict=True):
        along = place[:, last] - place[:, first]
        along /= np.linalg.norm(along)
        expected += tangential * along + normal * np.array([along[1], -along[0]])
    np.testing.assert_allclose(total, expected, atol=1e-14)


def test_pressure_works_on_the_area_below_the_surface(load: FollowerLoad, moved: Array) -> None:
    """Between ends of a patch that stay: its pressure times the change of the area."""
    nodes, weights = leggauss(ORDER + 2)
    x = load.patches.x
    at = (x[1:3, None] + np.diff(x)[1:3, None] * (nodes + 1) / 2).ravel()
    length = (np.diff(x)[1:3, None] * weights / 2).ravel()
    value, slope = interpolation(ORDER, x, at)

    def area(surface: Array) -> float:
        return float((value @ surface[1]) * (1 + slope @ surface[0]) @ length)

    way, step = np.zeros_like(moved), 1e-7
    inside = slice(ORDER + 1, 3 * ORDER)
    way[:, inside] = np.random.default_rng(1).standard_normal((2, 2 * ORDER - 1))
    change = (area(moved + step * way) - area(moved - step * way)) / (2 * step)
    ends = load.patches.chords(1.0, moved)
    pressing = replace(load, forces=FORCES * [1, 0])
    work = (pressing.nodal(moved) * way).sum()
    assert work == pytest.approx(-FORCES[0, 0] / abs(ends[0]) * change, rel=1e-6)


def test_the_change_of_a_load_is_its_derivative(load: FollowerLoad, moved: Array) -> None:
    way, step = np.random.default_rng(2).standard_normal(moved.shape) * 1e-5, 1e-3
    ahead, behind = (load.nodal(moved + s * step * way) for s in (1, -1))
    found = load.changed(moved, way)
    np.testing.assert_allclose((ahead - behind) / (2 * step), found, atol=1e-6 * found.max())


def _small_forces(load: FollowerLoad, at: Array) -> TurningForces:
    forces = np.random.default_rng(3).standard_normal((len(at), 2))
    return TurningForces(SurfacePlaces(ORDER, load.patches.x, at), forces)


AT = np.array([0.31, 0.8, 1.15, 1.33, 2.2, 2.47]) * 1e-3


def test_small_forces_turn_as_narrow_patches_do(load: FollowerLoad) -> None:
    """A force on an ever narrower patch, along and across the curve that the surface becomes."""
    bent, middle, width = 400.0, 1.2e-3, 2e-5
    force = np.array([[0.8, 0.3]])
    x = np.array([0.0, middle - width / 2, middle + width / 2, 3e-3])
    moved = np.zeros((2, ORDER * 3 + 1))
    # w = bent x^2 / 2 - bent x l / 2 by its values at vertices and the first bubble
    moved[1, ::ORDER] = bent / 2 * x * (x - 3e-3)
    length = np.diff(x)
    # a bubble of order 2 is (P_2 - P_0) / sqrt(6) = -sqrt(6) s (1 - s)
    moved[1, 1::ORDER] = bent / 2 * length**2 / np.sqrt(6)
    patch = FollowerLoad(Patches(ORDER, x, np.array([1]), np.array([2])), force)
    small = TurningForces(SurfacePlaces(ORDER, x, np.array([middle])), force)
    found = [one.nodal(moved)[:, ::ORDER].sum(axis=1) for one in (patch, small)]
    angle = np.arctan(bent * (middle - 1.5e-3))
    expected = 0.3 * np.array([np.cos(angle), np.sin(angle)])
    expected += 0.8 * np.array([np.sin(angle), -np.cos(angle)])
    np.testing.assert_allclose(found, [expected, expected], rtol=1e-7)


def test_the_change_of_small_forces_is_their_derivative(load: FollowerLoad, moved: Array) -> None:
    small, way = _small_forces(load, AT), np.random.default_rng(4).standard_normal(moved.shape)
    both, step = Together((small, load)), 1e-8
    ahead, behind = (both.nodal(moved + s * step * way) for s in (1, -1))
    found = both.changed(moved, way)
    np.testing.assert_allclose((ahead - behind) / (2 * step), found, atol=1e-6 * found.max())
    np.testing.assert_allclose(both.scaled(2.0).nodal(moved), 2 * both.nodal(moved), rtol=1e-12)


def test_small_forces_move_along_the_surface_as_differences_tell(
    load: FollowerLoad, moved: Array
) -> None:
    step = 1e-9

    def spread(at: Array) -> tuple[ComplexArray, ComplexArray]:
        return SurfacePlaces(ORDER, load.patches.x, at).spread(moved)

    own, rising = spread(AT)
    (ahead, _), (behind, _) = spread(AT + step), spread(AT - step)
    change = (ahead - behind) / (2 * step)
    np.testing.assert_allclose(change, rising, atol=1e-5 * np.abs(rising).max())
    small = _small_forces(load, AT)
    nodal = (small.forces[:, 1] - 1j * small.forces[:, 0]) @ own
    np.testing.assert_allclose(small.nodal(moved), [nodal.real, nodal.imag], atol=1e-14)


@pytest.mark.parametrize("loads", ["dead", "follower"])
def test_pressure_on_a_block_between_rollers_is_the_closed_form(
    sensor: ff.Sensor, loads: str
) -> None:
    """Of a neo-Hookean solid that is squashed by a stretch across its sides."""
    whole = _strip(sensor, loads, plane="strain", edges="roller")
    rubber, length = whole.photoelastic, whole.transducer.length
    strip = finite_strip(whole.transducer, [0.0], [length], (rubber, rubber), order=3)
    stretch, (c,) = 0.9, rubber.coefficients
    first = stretch ** (-2 / 3) * (stretch**2 + 2)
    by_stretch = 2 * stretch ** (1 / 3) - 2 / 3 * first / stretch
    pressure = -(c * by_stretch + rubber.bulk * (stretch - 1))
    moved = strip.solved([[pressure * length * whole.transducer.width, 0.0]])
    depth = strip.mesh.z[-1] - strip.mesh.z[0]
    np.testing.assert_allclose(moved[1, ::3, -1], (stretch - 1) * depth, rtol=1e-9)


def test_the_base_carries_what_turned_with_the_surface(sensor: ff.Sensor) -> None:
    strip, forces = _strip(sensor, "follower"), np.array([[6.0, 1.5], [4.0, -1.0]])
    state = strip.solved(forces)
    chords = strip.patches.chords(1.0, state[..., -1])
    assert np.abs(np.angle(chords)).max() > 0.02
    carried = ((forces[:, 1] - 1j * forces[:, 0]) * chords / np.abs(chords)).sum()
    # only vertices carry the shapes whose sum is one
    reaction = strip.internal_forces(state)[:, ::3, 0].sum(axis=1)
    np.testing.assert_allclose(reaction, [-carried.real, -carried.imag], rtol=1e-8)


def test_a_surface_that_dead_loads_fold_carries_those_that_follow(sensor: ff.Sensor) -> None:
    """A pressure of two thirds of the modulus on narrow contacts."""
    rng, found = np.random.default_rng(0), []
    forces = 3.0 * rng.uniform(0.3, 1, (11, 1)) * [1.0, 0.2]
    for loads in ("dead", "follower"):
        block = _strip(sensor, loads).transducer
        strip = finite_strip(block, sensor.tactels.positions, np.full(11, 2e-4), order=4)
        try:
            found.append(f"{np.abs(strip.solved(forces)).max() * 1e3:.1f} mm")
        except InputError as error:
            found.append(str(error))
    assert "folds" in found[0]
    assert found[1] == "0.1 mm"
