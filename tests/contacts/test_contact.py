"""Contact events: where they happened and only there, and friction with an honest deviation."""

from collections.abc import Callable

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.contacts.contact import Contact, Event, EventKind, Friction

N, SIGMA = 11, 0.02


def reading(forces: np.ndarray, status: ff.Status = ff.Status.OK) -> ff.Reading:
    covariance = SIGMA**2 * (0.8 * np.eye(2 * N) + 0.2)
    nothing, none = np.empty(0), np.zeros(N, dtype=bool)
    return ff.Reading(forces, covariance, nothing, 1.0, status, "", np.empty((0, N, 2)), none)


@pytest.fixture
def noisy() -> Callable[[np.ndarray], ff.Reading]:
    rng = np.random.default_rng(3)

    def read(forces: np.ndarray) -> ff.Reading:
        sure = reading(forces)
        noise = rng.multivariate_normal(np.zeros(2 * N), sure.covariance).reshape(N, 2)
        return reading(forces + noise)

    return read


def test_a_slow_press_touches_once_and_releases_once(noisy) -> None:
    contact, seen = Contact.none(N), []
    forces = np.zeros((N, 2))
    for normal in 0.3 * np.sin(np.linspace(0, np.pi, 2000)):
        forces[4, 0] = normal
        contact, events = contact.follow(noisy(forces))
        seen += events
    assert seen == [Event(EventKind.TOUCH, 4), Event(EventKind.RELEASE, 4)]


def test_slip_is_announced_where_the_drag_nears_friction_and_only_there(noisy) -> None:
    contact, seen = Contact.none(N, Friction(0.6, 0.01**2)), []
    forces = np.tile([1.0, 0.0], (N, 1))
    for drag in [*np.linspace(0, 0.6, 300), *np.linspace(0.6, 0, 300)]:
        forces[7, 1] = -drag
        contact, events = contact.follow(noisy(forces))
        seen += [event for event in events if event.kind in (EventKind.SLIP, EventKind.STICK)]
    assert seen == [Event(EventKind.SLIP, 7), Event(EventKind.STICK, 7)]


def test_no_slip_is_announced_while_friction_is_unknown(noisy) -> None:
    contact, _ = Contact.none(N).follow(noisy(np.ones((N, 2))))
    assert contact.touching.all()
    assert not contact.slipping.any()


def test_friction_is_learned_with_the_deviation_it_claims() -> None:
    true, off = 0.45, []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        friction = Friction()
        for _ in range(10):
            normal = rng.uniform(0.5, 2, N)
            forces = np.stack([normal, true * normal], axis=1)
            noise = rng.multivariate_normal(np.zeros(2 * N), reading(forces).covariance)
            friction = friction.slid(reading(forces + noise.reshape(N, 2)), np.ones(N, bool))
        off.append((friction.coefficient - true) / np.sqrt(friction.variance))
    assert abs(np.mean(off)) < 0.3
    assert np.std(off) == pytest.approx(1, abs=0.2)


def test_a_bad_reading_changes_nothing(noisy) -> None:
    contact, _ = Contact.none(N).follow(noisy(np.ones((N, 2))))
    after, events = contact.follow(reading(np.full((N, 2), np.nan), ff.Status.BAD_FRAME))
    assert after is contact
    assert events == ()
    known = Friction(0.5, 0.1)
    assert known.slid(reading(np.ones((N, 2)), ff.Status.AMBIGUOUS), np.ones(N, bool)) is known
    with pytest.raises(ff.FringeforceError, match="must be greater"):
        Friction(-0.1)
