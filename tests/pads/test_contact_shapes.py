"""Bodies that press: whole forces, pressures of contact mechanics, and friction's limit."""

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import dblquad, quad

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.contacts.indenters import Indenter
from fringeforce.contacts.random import ContactRanges, random_contacts
from fringeforce.contacts.shapes import Edge, Point, Punch, Ridges, Sphere, hertz_radius
from fringeforce.design.pad import Pad

Array = NDArray[np.float64]
PLACE = (0.7e-3, -1.3e-3)
PRESS: Any = {"place": PLACE, "normal": 1.5, "friction": 0.6}
BODIES = [
    Point(**PRESS),
    Sphere(**PRESS, radius=8e-3, modulus=1e6),
    Edge(**PRESS, length=7e-3, angle=0.4),
    Punch(**PRESS, radius=2.7e-3),
    Ridges(**PRESS, radius=9e-3, modulus=1e6, period=1.1e-3, angle=0.3, phase=0.5),
]
by_kind = pytest.mark.parametrize("body", BODIES, ids=lambda body: body.kind)


@pytest.fixture(scope="module")
def pad() -> Pad:
    return ff.load_sensor("pad")


def fine(pad: Pad) -> Pad:
    return pad.replace(tactels={"count": [50, 50], "pitch": "0.4 mm"})


def rubbed(body: Indenter, pad: Pad, share: float) -> Indenter:
    """With a share of its friction used, half of it by a moment where it can bear one."""
    arm = body.arm(pad)
    used = share * body.friction * body.normal
    if arm == 0:
        return body.rubbing((0.6 * used, 0.8 * used))
    return body.rubbing((0.3 * used, 0.4 * used), -0.5 * used * arm)


@by_kind
def test_tactels_carry_the_whole_force(body: Indenter, pad: Pad) -> None:
    found = rubbed(body, pad, 0.9).imprint(pad)
    np.testing.assert_allclose(found.forces.sum(axis=0), found.force, rtol=1e-12)


@by_kind
def test_tactels_carry_the_moments_as_well_as_their_size_allows(body: Indenter, pad: Pad) -> None:
    one = rubbed(body, pad, 0.9)
    for drawn in (pad, fine(pad)):
        found, places = one.imprint(drawn), drawn.tactels.places
        reach = drawn.tactels.pitch / 2
        centre = found.forces[:, 0] @ places / one.normal
        np.testing.assert_allclose(centre, found.centre, atol=reach)
        arms, drag = places - found.centre, found.forces[:, 1:]
        moment = float((arms[:, 0] * drag[:, 1] - arms[:, 1] * drag[:, 0]).sum())
        # no share of the drag moves by more than half a tactel's diagonal
        assert abs(moment - one.torsion) <= np.sqrt(2) * reach * np.hypot(*drag.T).sum()
    assert abs(moment - one.torsion) < 0.02 * one.normal * 1e-3


@by_kind
@pytest.mark.parametrize("share", [0.3, 1.0])
def test_no_tactel_is_dragged_beyond_friction(body: Indenter, share: float, pad: Pad) -> None:
    for drawn in (pad, fine(pad)):
        forces = rubbed(body, drawn, share).imprint(drawn).forces
        allowed = body.friction * forces[:, 0]
        assert (np.hypot(*forces[:, 1:].T) <= allowed + 1e-6 * body.normal).all()


def test_the_contact_of_a_sphere_is_hertzs(pad: Pad) -> None:
    normal, radius, modulus = 0.8, 6e-3, 5e6
    cover = pad.transducer.compliant
    joint = 1 / (1 / modulus + (1 - cover.poissons_ratio**2) / cover.youngs_modulus)
    highest = np.cbrt(6 * normal * joint**2 / (np.pi**3 * radius**2))  # Johnson (4.24)
    found = hertz_radius(pad, normal, radius, modulus)
    assert 3 * normal / (2 * np.pi * found**2) == pytest.approx(highest)


def test_pressure_is_integrated_over_every_square(pad: Pad) -> None:
    body = BODIES[1]
    a, forces = body.reach(pad), body.imprint(pad).forces[:, 0]
    pitch = pad.tactels.pitch

    def pressure(y: float, x: float) -> float:
        squared = (x - PLACE[0]) ** 2 + (y - PLACE[1]) ** 2
        return 3 / (2 * np.pi * a**2) * body.normal * max(1 - squared / a**2, 0.0) ** 0.5

    for tactel in np.argsort(forces)[-3:]:
        x, y = pad.tactels.places[tactel]
        limits = x - pitch / 2, x + pitch / 2, y - pitch / 2, y + pitch / 2
        whole = dblquad(pressure, *limits, epsabs=1e-4)[0]
        assert forces[tactel] == pytest.approx(whole, abs=1e-5)


def columns(forces: Array, pad: Pad) -> Array:
    return forces[:, 0].reshape(pad.tactels.count).sum(axis=1)


def shares(pad: Pad, density: Any, reach: float) -> Array:
    """Force on every column of tactels from a density along x, about the body's place."""
    nx, pitch = pad.tactels.count[0], pad.tactels.pitch
    borders = np.clip((np.arange(nx + 1) - nx / 2) * pitch - PLACE[0], -reach, reach)
    return np.array([quad(density, *ends)[0] for ends in itertools.pairwise(borders)])


def test_columns_carry_what_closed_forms_say(pad: Pad) -> None:
    for drawn in (pad, fine(pad)):
        _, sphere, edge, punch, _ = BODIES
        a = sphere.reach(drawn)
        hertz = shares(drawn, lambda x, a=a: 1.125 * (a**2 - x**2) / a**3, a)
        np.testing.assert_allclose(columns(sphere.imprint(drawn).forces, drawn), hertz, atol=1e-6)
        # as slices of a hemisphere have the areas of slices of a cylinder
        b = punch.reach(drawn)
        flat = shares(drawn, lambda x, b=b: 1.5 / (2 * b), b)
        np.testing.assert_allclose(columns(punch.imprint(drawn).forces, drawn), flat, atol=1e-4)
        half = edge.reach(drawn) * np.cos(0.4)
        even = shares(drawn, lambda x, half=half: 1.5 / (2 * half), half)
        np.testing.assert_allclose(columns(edge.imprint(drawn).forces, drawn), even, atol=1e-12)


def test_ridges_modulate_the_pressure_of_a_sphere(pad: Pad) -> None:
    sphere: Any = {**PRESS, "radius": 9e-3, "modulus": 1e6}
    smooth = Ridges(**sphere, period=1e-3, depth=0.0).imprint(pad)
    np.testing.assert_allclose(smooth.forces, Sphere(**sphere).imprint(pad).forces, atol=1e-6)
    ridged = Ridges(**sphere, period=0.7e-3, depth=0.8)
    a, wave = ridged.reach(pad), 2 * np.pi / 0.7e-3

    def density(x: float) -> float:
        return (a**2 - x**2) * (1 + 0.8 * np.cos(wave * x))

    expected = ridged.normal * shares(fine(pad), density, a) / quad(density, -a, a, limit=200)[0]
    found = columns(ridged.imprint(fine(pad)).forces, fine(pad))
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_a_sphere_slips_in_a_ring_and_sticks_inside(pad: Pad) -> None:
    drawn = fine(pad)
    body = BODIES[1].rubbing((0.7 * 0.6 * 1.5, 0.0))
    found, places = body.imprint(drawn), drawn.tactels.places - PLACE
    stuck = body.reach(drawn) * np.cbrt(0.3)
    ratio = found.forces[:, 1] / np.maximum(found.forces[:, 0], 1e-9)
    corner = drawn.tactels.pitch / np.sqrt(2)
    ring = (np.hypot(*places.T) - corner > stuck) & (found.forces[:, 0] > 1e-4)
    np.testing.assert_allclose(ratio[ring], 0.6, rtol=1e-3)
    middle = int(np.argmin(np.hypot(*places.T)))
    # at the centre, friction times (1 - c / a)
    assert ratio[middle] == pytest.approx(0.6 * (1 - np.cbrt(0.3)), rel=0.02)


@by_kind
def test_a_mirrored_body_makes_mirrored_forces(body: Indenter, pad: Pad) -> None:
    if isinstance(body, Edge | Ridges):
        body = replace(body, angle=0.0)
    x, y = body.place
    one = body.rubbing((0.2, 0.1)).imprint(pad).forces.reshape(11, 11, 3)
    two = body.at((x, -y)).rubbing((0.2, -0.1)).imprint(pad).forces.reshape(11, 11, 3)
    np.testing.assert_allclose(two[:, ::-1] * (1, 1, -1), one, atol=1e-12)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (Point(place=(12e-3, 0), normal=1.0), "beyond the tactels"),
        (Punch(place=(10e-3, 0), normal=1.0, radius=3e-3), "beyond the tactels"),
        (Point(place=(0, 0), normal=-1.0), "cannot press"),
        (Point(place=(0, 0), normal=1.0, torsion=1e-3), "no moment"),
        (Edge(place=(0, 0), normal=1.0, length=4e-3, shear=(0.6, 0)), "friction of 0.5"),
        (Sphere(place=(0, 0), normal=50.0, radius=2e-3, modulus=1e5), "Hertz"),
        (Ridges(place=(0, 0), normal=1.0, radius=5e-3, period=0.0), "period above zero"),
    ],
)
def test_what_no_body_does_is_refused(body: Indenter, words: str, pad: Pad) -> None:
    with pytest.raises(InputError, match=words):
        body.imprint(pad)


def test_random_contacts_fit_lie_apart_and_follow_their_seed(pad: Pad) -> None:
    kinds, counts = set(), set()
    for seed in range(60):
        contacts = random_contacts(pad, seed, count=(2, 4))
        assert contacts == random_contacts(pad, seed, count=(2, 4))
        kinds |= {body.kind for body in contacts}
        counts.add(len(contacts))
        for number, one in enumerate(contacts):
            assert 0.1 <= one.normal <= 3
            for other in contacts[:number]:
                apart = np.hypot(*np.subtract(one.place, other.place))
                assert apart > one.reach(pad) + other.reach(pad)
        forces = np.sum([contact.imprint(pad).forces for contact in contacts], axis=0)
        assert forces[:, 0].sum() == pytest.approx(sum(body.normal for body in contacts))
        assert (np.hypot(*forces[:, 1:].T) <= 0.9 * forces[:, 0] + 1e-6).all()
    assert kinds == {"point", "sphere", "edge", "punch", "ridges"}
    assert {2, 3, 4} <= counts


def test_bodies_that_never_fit_are_told(pad: Pad) -> None:
    ranges = ContactRanges(kinds=("edge",), edge=(0.1, 0.2))
    with pytest.raises(InputError, match="larger pad"):
        random_contacts(pad, 0, ranges)


def test_the_pad_of_the_example_takes_every_kind() -> None:
    folder = Path(__file__).parents[2] / "examples" / "dataset"
    pad = ff.load_sensor(folder / "small-pad.toml")
    assert isinstance(pad, Pad)
    random_contacts(pad, 0, ContactRanges(edge=(1e-3, 4e-3), punch=(0.5e-3, 1.5e-3)))
