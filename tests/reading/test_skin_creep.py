"""Skins that relax: contacts are read without the creep of those before, which leaves none."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import fringeforce as ff
from fringeforce.base.errors import InputError

TERMS = [["6 %", "0.4 s"], ["4 %", "15 s"]]
LOOSE = [
    {"share": "6 % +/- 20 %", "time": "0.4 s"},
    {"share": "4 % +/- 20 %", "time": "15 s"},
]
TIMES = np.arange(0.0, 60.0, 0.1)
PUSH = 2.0 * np.interp(TIMES, [0, 1, 2, 30, 33, 33.5, 60], [0, 0, 1, 1, 1, 0, 0])
PLACE = np.interp(TIMES, [0, 30, 33, 60], [-2e-3, -2e-3, 0.5e-3, 0.5e-3])


def skin(terms: list, **values: object) -> ff.SensorModel:
    return ff.characterize(
        ff.load_sensor("skin").replace(**{"transducer.relaxation": terms, **values})
    )


@pytest.fixture(scope="module")
def creeping() -> ff.SensorModel:
    return skin(TERMS)


@pytest.fixture(scope="module")
def presses() -> list[list[ff.Press]]:
    """A cylinder that is pressed, held, slid and let go."""
    return [
        [ff.Press(x=float(x), normal=float(n), tangential=float(0.2 * n), radius=4e-3)]
        if n > 0
        else []
        for n, x in zip(PUSH, PLACE, strict=True)
    ]


@pytest.fixture(scope="module")
def frames(creeping, presses) -> NDArray[np.unsignedinteger]:
    """Its light is that of contact mechanics, its creep integrated exactly between frames."""
    return creeping.expose(presses, rng=0, times=TIMES)


def totals(batch: ff.Batch) -> tuple[NDArray, NDArray]:
    """Normal forces and their deviations; zero where nothing touches."""
    assert batch.resultants is not None
    felt = [
        (one[0].force[0], one[0].force_std[0]) if status is ff.Status.OK else (0.0, 0.0)
        for one, status in zip(batch.resultants, batch.status, strict=True)
    ]
    normal, std = np.array(felt).T
    return normal, std


@pytest.mark.slow
def test_contacts_are_read_without_creep_and_none_is_left_behind(creeping, frames) -> None:
    batch = ff.Reader(creeping).read_batch(frames, covariance=False, times=TIMES)
    normal, std = totals(batch)
    held = PUSH > 0.2
    assert all(status is ff.Status.OK for status in batch.status[held])
    # a reader that knows nothing of creep is off by 0.16 to 0.24 N
    assert np.abs(normal - PUSH)[held].max() < 0.02
    assert (np.abs(normal - PUSH) < 6 * std)[held].all()
    assert all(status is ff.Status.NO_CONTACT for status in batch.status[TIMES > 33.6])


@pytest.mark.slow
def test_uncertain_terms_widen_deviations_by_what_they_do(presses) -> None:
    """Shares that are 20 % off, one up and one down, leave 1 % of what is pressed."""
    real = skin([["7.2 %", "0.4 s"], ["3.2 %", "15 s"]])
    frames = real.expose(presses, rng=1, times=TIMES)
    drawn = skin(LOOSE)
    batch = ff.Reader(drawn).read_batch(frames, covariance=False, times=TIMES)
    normal, std = totals(batch)
    held = PUSH > 0.2
    assert all(status is ff.Status.OK for status in batch.status[held])
    assert (np.abs(normal - PUSH) < 3 * std)[held].all()
    late = (TIMES > 10) & (TIMES < 30)
    # 1.2 % and 0.8 % of 2 N together, which 1 / m makes a seventh larger
    assert std[late].mean() == pytest.approx(2.0 * np.hypot(0.012, 0.007) * 1.1, rel=0.25)
    assert all(status is ff.Status.NO_CONTACT for status in batch.status[TIMES > 33.6])


def test_frames_one_by_one_are_read_like_a_recording(creeping, frames) -> None:
    some = slice(0, 60)
    reader = ff.Reader(creeping)
    assert reader.needs_times
    batch = ff.Reader(creeping).read_batch(frames[some], covariance=False, times=TIMES[some])
    singles = list(reader.stream(frames[some], times=TIMES[some]))
    assert [one.status for one in singles] == list(batch.status)
    for one, forces in zip(singles, batch.forces, strict=True):
        np.testing.assert_allclose(one.forces, forces, atol=1e-9)
    # a bad frame is skipped, with its time
    spoilt = frames[some].copy()
    spoilt[40] = 7
    again = ff.Reader(creeping).read_on(spoilt, times=TIMES[some])
    assert again.status[40] is ff.Status.BAD_FRAME
    normal, std = totals(again)
    assert (np.abs(normal - PUSH[some])[45:] < 6 * std[45:]).all()


def test_what_fades_after_a_release_is_said_to_be_no_contact(creeping, presses) -> None:
    """An indentation of 10 % of 4 N shows; as drawn without creep it would be a contact."""
    strong = [
        [ff.Press(x=0.0, normal=2 * one.normal, width=1.2e-3) for one in frame]
        for frame in presses[:360]
    ]
    times = TIMES[:360]
    frames = creeping.expose(strong, rng=2, times=times)
    readings = list(ff.Reader(creeping).stream(frames, times=times))
    released = readings[337]
    assert released.status is ff.Status.NO_CONTACT
    assert "fades" in released.findings[0]
    plain = ff.Reader(skin([])).search(frames[337])
    assert plain.status is not ff.Status.NO_CONTACT
    assert not readings[5].findings  # before anything pressed


def test_warm_skins_creep_in_proportion(presses) -> None:
    """At another temperature the phase of what creeps is scaled as well."""
    warm = "transducer.photoelastic.temperature_coefficient"
    model = skin(TERMS, **{warm: "-0.2 %/K"})
    some, kelvin = slice(0, 100), 293.15 + np.linspace(0, 20, 100)
    frames = model.expose(presses[some], rng=3, times=TIMES[some], temperature=kelvin)
    batch = ff.Reader(model).read_on(frames, times=TIMES[some], temperatures=kelvin)
    normal, std = totals(batch)
    held = PUSH[some] > 0.2
    assert (np.abs(normal - PUSH[some]) < 6 * std)[held].all()
    assert np.abs(normal - PUSH[some])[held].max() < 0.02


@pytest.mark.slow
def test_terms_are_found_from_a_skin_that_is_pressed_and_held(creeping, frames, presses) -> None:
    found = ff.find_relaxation(skin([]), frames, presses, TIMES)
    terms, stds = found.sensor.transducer.relaxation, found.sensor.tolerances
    assert len(terms) == 2
    for number, (term, share, time) in enumerate(
        zip(terms, (0.06, 0.04), (0.4, 15.0), strict=True)
    ):
        path = f"transducer.relaxation.{number}"
        assert abs(term.share - share) < 4 * stds[f"{path}.share"]
        assert abs(term.time - time) < 4 * stds[f"{path}.time"]
    with pytest.raises(InputError, match="list of presses for each"):
        ff.find_relaxation(skin([]), frames[:1], presses[300], TIMES[:1])


def test_what_a_skin_cannot_allow_for_is_refused(creeping, frames) -> None:
    with pytest.raises(InputError, match="time of each frame"):
        ff.Reader(creeping).read(frames[0])
    with pytest.raises(InputError, match="at rest"):
        ff.Reader(creeping, history=0.1)
    reader = ff.Reader(creeping)
    reader.read(frames[0], time=1.0)
    with pytest.raises(InputError, match="must not descend"):
        reader.read(frames[1], time=0.5)
    with pytest.raises(InputError, match="small strain"):
        ff.Reader(skin(TERMS, **{"transducer.strain": "finite"}))
