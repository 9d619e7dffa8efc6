"""Contacts on a skin keep their numbers, and tell when they touch, let go and are about to slip."""

from dataclasses import dataclass

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.contacts.contact import Event, EventKind, Friction
from fringeforce.contacts.resultant import Resultant
from fringeforce.contacts.skin_contacts import SkinContacts

SIGMA = 0.01


@dataclass(frozen=True)
class Felt:
    """What a frame says."""

    contacts: tuple[Resultant, ...]
    trusted: bool = True


def contact(x: float, normal: float, tangential: float = 0.0, width: float = 1e-3) -> Resultant:
    covariance = np.diag([SIGMA**2, SIGMA**2, 0, 0, 0, 1e-12, 1e-12])
    nothing = np.zeros(0, dtype=np.intp)
    return Resultant(
        nothing, np.array([normal, tangential]), np.zeros(3), np.array([x]), covariance, width
    )


def followed(
    contacts: SkinContacts, readings: list[Felt]
) -> tuple[SkinContacts, list[tuple[int, Event]]]:
    seen = []
    for number, reading in enumerate(readings):
        contacts, events = contacts.follow(reading)
        seen += [(number, event) for event in events]
    return contacts, seen


def test_contacts_keep_their_numbers_while_they_move_and_change_places_in_strength() -> None:
    left = [
        contact(x, n)
        for x, n in zip(np.linspace(-3e-3, -1e-3, 9), np.linspace(1, 2, 9), strict=True)
    ]
    right = [contact(x, 1.5) for x in np.linspace(2e-3, 1e-3, 9)]
    readings = [
        Felt(tuple(sorted(both, key=lambda one: -one.force[0])))
        for both in zip(left, right, strict=True)
    ]
    contacts, seen = followed(SkinContacts(), [Felt((left[0],)), *readings])
    assert seen == [(0, Event(EventKind.TOUCH, 0)), (1, Event(EventKind.TOUCH, 1))]
    assert contacts.touching[0] is left[-1]
    assert contacts.touching[1] is right[-1]


def test_what_lets_go_is_released_once_and_what_comes_next_is_new() -> None:
    one, other = contact(0.0, 1.0), contact(3e-3, 1.0)
    steps = [Felt((one,)), Felt((one, other)), Felt((other,)), Felt(()), Felt((one,))]
    contacts, seen = followed(SkinContacts(), steps)
    assert seen == [
        (0, Event(EventKind.TOUCH, 0)),
        (1, Event(EventKind.TOUCH, 1)),
        (2, Event(EventKind.RELEASE, 0)),
        (3, Event(EventKind.RELEASE, 1)),
        (4, Event(EventKind.TOUCH, 2)),
    ]
    assert contacts.count == 3


def test_noise_neither_touches_nor_lets_go() -> None:
    rng = np.random.default_rng(0)
    weak = [Felt((contact(0.0, 5 * SIGMA + SIGMA * z),)) for z in rng.normal(size=500)]
    assert followed(SkinContacts(), weak)[1] == []
    begun = SkinContacts().follow(Felt((contact(0.0, 1.0),)))[0]
    assert followed(begun, weak)[1] == []


def test_readings_that_are_not_trusted_change_nothing() -> None:
    begun = SkinContacts().follow(Felt((contact(0.0, 1.0),)))[0]
    assert begun.follow(Felt((), trusted=False)) == (begun, ())


def test_slip_is_announced_near_the_limit_of_friction_of_that_contact() -> None:
    friction = ff.Friction(0.6, 0.01**2)
    drags = [*np.linspace(0, 0.6, 100), *np.linspace(0.6, 0, 100)]
    steps = [Felt((contact(-2e-3, 1.2), contact(2e-3, 1.0, -drag))) for drag in drags]
    _, seen = followed(SkinContacts(friction=friction), steps)
    kinds = [(event.kind, event.tactel) for _, event in seen]
    assert kinds == [
        (EventKind.TOUCH, 0),
        (EventKind.TOUCH, 1),
        (EventKind.SLIP, 1),
        (EventKind.STICK, 1),
    ]
    slips = drags[seen[2][0]]
    # one deviation from 0.6, where |T|, N and the coefficient are each known to 0.01
    assert slips == pytest.approx(0.6 - 0.01 * np.sqrt(1 + 0.36 + 1), abs=0.01)
    assert followed(SkinContacts(), steps)[1] == seen[:2]  # nothing is known of friction


def test_friction_is_learned_from_a_stroke() -> None:
    rng, true, off = np.random.default_rng(1), 0.45, []
    for _ in range(300):
        normal = 1.0 + SIGMA * rng.normal()
        one = contact(0.0, normal, true + SIGMA * rng.normal())
        contacts = SkinContacts().follow(Felt((one,)))[0].slid(Felt((one,)))
        off.append((contacts.friction.coefficient - true) / np.sqrt(contacts.friction.variance))
    assert abs(np.mean(off)) < 0.25
    assert 0.85 < np.std(off) < 1.15


def on_pad(x: float, y: float, normal: float, along_y: float = 0.0) -> Resultant:
    covariance = np.diag([*[SIGMA**2] * 3, *[0.0] * 3, *[1e-12] * 4, 1e-4])
    nothing, axes = np.zeros(0, dtype=np.intp), np.array([1.5e-3, 0.5e-3])
    return Resultant(
        nothing,
        np.array([normal, 0.0, along_y]),
        np.zeros(3),
        np.array([x, y]),
        covariance,
        axes=axes,
        orientation=0.0,
    )


def test_contacts_on_a_pad_are_told_apart_across_it_and_slip_in_any_direction() -> None:
    rows = [Felt((on_pad(0.0, 2e-3, 1.0, t), on_pad(0.0, -2e-3, 0.9))) for t in (0.0, -0.45, -0.55)]
    contacts, seen = followed(SkinContacts(friction=Friction(0.5, 1e-6)), rows)
    touched = [(0, Event(EventKind.TOUCH, 0)), (0, Event(EventKind.TOUCH, 1))]
    assert seen == [*touched, (2, Event(EventKind.SLIP, 0))]
    assert contacts.touching[1] is rows[-1].contacts[1]
