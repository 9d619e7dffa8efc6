"""Searches of a pad's frame that took some tactels for the wrong fold, and begin again."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.reading.pads.single_frame import BESIDE, PadFrameReader


@pytest.fixture(scope="module")
def reader() -> PadFrameReader:
    """Of a camera whose noise is four times that of the drawing."""
    noisy = {"camera.noise": 20.0, "camera.amplitude": 213.0, "camera.offset": 21.0}
    return PadFrameReader(ff.characterize(ff.load_sensor("pad").replace(**noisy)))


def loads(reader: PadFrameReader, rng: np.random.Generator) -> np.ndarray:
    forces = np.zeros(reader.forces_shape)
    forces[:, 0] = rng.uniform(0, 1.5, len(forces))
    forces[:, 1:] = forces[:, :1] * rng.uniform(-0.4, 0.4, (len(forces), 2))
    return forces


def test_a_search_begins_again_from_what_it_explains(reader: PadFrameReader) -> None:
    """Two newtons more on nine tactels are other folds, from which a climb does not return."""
    rng, used = np.random.default_rng(0), reader.usable_pixels
    forces = loads(reader, rng)
    classifier = reader.classifier(used)
    levels = classifier.filled(reader.model.expose(forces, rng).ravel())
    fit = reader._fit(levels, reader.stepping, classifier)
    wrong = forces.copy()
    across = reader.model.sensor.tactels.count[1]
    block = (np.arange(4, 7)[:, None] * across + np.arange(4, 7)).ravel()
    wrong[block, 0] += 2.0
    stuck = reader._climbed(fit, wrong.ravel())
    assert not classifier.explained(stuck)
    grown = reader._search.again(levels, None, stuck.forces, BESIDE[0])
    assert grown is not None
    found = reader._climbed(fit, grown)
    assert classifier.explained(found)
    off = found.forces - forces.ravel()
    std = reader.bound(forces).ravel()
    assert np.square(off / std).mean() == pytest.approx(1, abs=0.4)


def test_a_search_does_not_begin_again_where_little_is_explained(reader: PadFrameReader) -> None:
    rng = np.random.default_rng(1)
    frame = reader.model.expose(loads(reader, rng), rng).ravel().astype(float)
    nothing = np.zeros(3 * len(loads(reader, rng)))
    assert reader._search.again(frame, None, nothing, BESIDE[0]) is None
