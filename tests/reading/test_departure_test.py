"""Departures that loads hide from the residual test, shown one by one beside them."""

from typing import Any

import numpy as np
import pytest
from chi_squares import expect_chi_squares
from exact_frames import Bench, drawing, loads

import fringeforce as ff
from fringeforce.reading.strip_reader import StripFrameReader

PLACES, POINTS = drawing().tactels.positions, np.zeros(11)
PIXEL = drawing().transducer.length / drawing().camera.pixels
FAR = 6.0
"""Stated standard deviations."""


@pytest.fixture(scope="module")
def single() -> StripFrameReader:
    return StripFrameReader(ff.characterize(drawing()))


def test_squares_of_frames_as_drawn_are_chi_square(single: StripFrameReader) -> None:
    rng = np.random.default_rng(5)
    frames = Bench(drawing(), PLACES, POINTS).frames(loads(rng, 40), rng)
    test = single._departures
    told = []
    for frame in frames:
        reading, located = single.followed(frame, single.usable(None), None)
        assert reading.ok
        assert located is not None
        told.append(test.scores(located.posterior, located.top))
    expect_chi_squares(told)


@pytest.mark.parametrize(
    ("path", "changes", "size"),
    [
        ("camera.shift", {"shift": 4e-6}, 4e-6),
        ("camera.amplitude", {"gain": np.array([0.995])}, -0.005),
        ("camera.blur", {"blur": 3.0}, 3.0 * PIXEL),
        ("camera.gamma", {"gamma": 1.02}, 0.02),
        ("polariscope.visibility", {"visibility": 0.992}, -0.008),
    ],
)
def test_frames_that_loads_explain_are_refused_by_name(
    single: StripFrameReader, path: str, changes: dict[str, Any], size: float
) -> None:
    """Departures of which the residual test finds two frames in three at most."""
    rng = np.random.default_rng(6)
    forces = loads(rng, 24)
    frames = Bench(drawing(), PLACES, POINTS, **changes).frames(forces, rng)
    shown = list[tuple[str, float, float]]()
    for frame, truth in zip(frames, forces, strict=True):
        reading = single.read(frame)
        if reading.ok:
            assert (np.abs(reading.forces - truth) / reading.std).max() < FAR
        elif reading.findings and reading.status is ff.Status.MODEL_MISMATCH:
            assert reading.probability == 0.0
            found = _shown(single, frame)
            shown.append((found.departure.path, found.size, found.size / found.significance))
    right = [each for each in shown if each[0] == path]
    assert len(right) >= 6
    assert len(right) > 0.7 * len(shown)
    assert np.median([each[1] for each in right]) == pytest.approx(size, rel=0.25)


def _shown(single: StripFrameReader, frame: np.ndarray) -> Any:
    """The likeliest departure of a frame, from the explanation that was refused."""
    posterior = single.own_posterior(frame.astype(float))
    top = posterior.climbed(single.read(frame).forces.ravel(), heats=(), steps=(0, 15))
    return single._departures.shown(posterior, top)[0]


def test_what_the_design_allows_for_is_fitted_in_place_of_being_tested() -> None:
    stated = {"camera.shift": "0 +/- 0.05 mm", "camera.amplitude": "237 +/- 3 %"}
    single = StripFrameReader(ff.characterize(drawing(**stated)))
    tested = [one.path for one in single._departures.tested]
    assert "polariscope.visibility" in tested
    assert not {*stated} & {*tested}
    rng = np.random.default_rng(7)
    forces = loads(rng, 6)
    frames = Bench(drawing(), PLACES, POINTS, shift=5e-5, gain=np.array([0.98])).frames(forces, rng)
    readings = [single.read(frame) for frame in frames]
    assert sum(reading.ok for reading in readings) >= 5


def test_what_shows_when_loads_grow_is_refused_where_frames_follow() -> None:
    """A faint touch hides a camera that looks 6 micrometres aside; a strong one shows it."""
    rng, reader = np.random.default_rng(8), ff.Reader(ff.characterize(drawing()))
    growing = np.linspace(0.3, 1.0, 192)[:, None, None] * loads(rng, 1)
    as_drawn = reader.read_on(Bench(drawing(), PLACES, POINTS).frames(growing, rng))
    assert as_drawn.tracked.mean() > 0.9
    assert all(status is ff.Status.OK for status in as_drawn.status)
    reader.reset()
    aside = reader.read_on(Bench(drawing(), PLACES, POINTS, shift=6e-6).frames(growing, rng))
    assert aside.status[-1] is ff.Status.MODEL_MISMATCH
