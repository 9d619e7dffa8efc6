"""Dirt, a hair or a glint hides a stretch of a strip: it is found, and loads are right without."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

import fringeforce as ff
from fringeforce.reading.hidden_stretches import HiddenStretches, hidden_stretches
from fringeforce.reading.strip_reader import StripFrameReader

Array = NDArray[np.float64]
FRAMES, IMPROBABLE = 4, 1e-4
TRACE = 3.0
"""Noise by which a frame differs where something surely hides it: three standard deviations."""


@pytest.fixture(scope="module")
def reader() -> ff.Reader:
    return ff.Reader(ff.characterize(ff.load_sensor("saad")))


def hair(light: Array, rng: np.random.Generator) -> Array:
    """Fifty pixels that are dark."""
    begin = int(rng.integers(100, 1900))
    light[begin : begin + 50] = 15
    return light


def dust(light: Array, rng: np.random.Generator) -> Array:
    """Three specks that let half of the light pass."""
    for place in rng.uniform(0, len(light), 3):
        light *= 1 - 0.5 * bell(len(light), place, 8.5)
    return light


def glint(light: Array, rng: np.random.Generator) -> Array:
    """The picture of a lamp, without sharp ends."""
    return light + 80 * bell(len(light), rng.uniform(200, 1850), 51)


def bell(count: int, place: float, wide: float) -> Array:
    return np.exp(-0.5 * np.square((np.arange(count) - place) / wide))


def loads(rng: np.random.Generator) -> Array:
    """On about half of the tactels."""
    normal = rng.uniform(0.2, 2, 11) * (rng.random(11) < 0.5)
    return np.stack([normal, normal * rng.uniform(-0.36, 0.36, 11)], axis=1)


def frames(
    model: ff.SensorModel, hidden_by: Callable[[Array, np.random.Generator], Array]
) -> list[tuple[Array, Array, NDArray[np.bool_]]]:
    """Loads, what a camera sees of them, and where that is surely something else."""
    camera, made = model.sensor.camera, []
    for seed in range(FRAMES):
        rng = np.random.default_rng([2, seed])
        forces = loads(rng)
        seen = model.expose(forces, rng=rng).astype(float)
        other = hidden_by(seen - camera.offset, rng) + camera.offset
        frame = np.clip(np.rint(other), 0, camera.full_scale)
        made.append((forces, frame, np.abs(frame - seen) > TRACE * camera.noise))
    return made


@pytest.mark.parametrize("hidden_by", [hair, dust, glint])
def test_loads_are_right_without_the_stretches_that_are_found(reader, hidden_by) -> None:
    single, model = reader._single, reader.model
    assert isinstance(single, StripFrameReader)
    assert isinstance(model, ff.SensorModel)
    for forces, frame, hides in frames(model, hidden_by):
        found = hidden_stretches(single, frame)
        assert isinstance(found, HiddenStretches)
        assert found.pixels[hides].all()
        assert found.pixels.mean() < 0.4
        reading = reader.search(frame, found.pixels)
        assert reading.status is ff.Status.OK
        off = (reading.forces - forces).ravel()
        square = off @ np.linalg.solve(reading.covariance, off)
        assert square < chi2.isf(IMPROBABLE / FRAMES, off.size)


def test_a_finding_says_where_something_hides_the_strip(reader) -> None:
    at, refused = 1e3 * reader.model.sensor.pixel_positions, 0
    for _, frame, hides in frames(reader.model, glint)[: FRAMES // 2]:
        reading = reader.search(frame)
        if reading.status is not ff.Status.MODEL_MISMATCH:
            continue
        words = re.search(r"from (\S+) to (\S+) mm: dirt, a hair", reading.findings[-1])
        assert words is not None, reading.findings
        first, last = map(float, words.groups())
        assert first - 0.01 < at[hides].min()
        assert last + 0.01 > at[hides].max()
        refused += 1
    assert refused


def test_a_good_frame_hides_nothing_whatever_pixels_are_broken(reader) -> None:
    rng = np.random.default_rng(4)
    frame = reader.model.expose(loads(rng), rng=rng).astype(float)
    frame[rng.choice(frame.size, 12, replace=False)] = 0
    assert hidden_stretches(reader._single, frame) is None


@pytest.mark.parametrize(
    "departure",
    [
        {"polariscope.visibility": 0.95},
        {"camera.blur": "0.05 mm"},
        {"transducer.compliant.thickness": "0.525 mm"},
        {"camera.gamma": 1.05},
    ],
)
def test_what_departs_from_the_design_is_not_taken_for_dirt(
    reader, departure: dict[str, Any]
) -> None:
    made = ff.characterize(reader.model.sensor.replace(**departure))
    for seed in range(2):
        rng = np.random.default_rng([5, seed])
        reading = reader.search(made.expose(ff.polar(rng.uniform(0.5, 2, 11), 10), rng=rng))
        assert reading.status is ff.Status.MODEL_MISMATCH
        assert "mask these pixels" not in reading.findings[0]
