"""A speck of dirt on a pad: findings say where, and loads are right without it."""

import re

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

import fringeforce as ff
from fringeforce.design.pad import Pad
from fringeforce.models.pad import characterize_pad
from fringeforce.reading.pads.diagnosis import PadSkinDiagnosis
from fringeforce.reading.pads.skin_reader import PadSkinReader

FEW = {"tactels.count": [5, 4], "tactels.pitch": "3 mm", "camera.pixels": [96, 80]}
IMPROBABLE = 1e-4


def specked(frame: NDArray[np.uint8], row: int, column: int) -> NDArray[np.float64]:
    """With a speck of nine pixels that lets half of the light pass."""
    rows, columns = np.mgrid[: frame.shape[-2], : frame.shape[-1]]
    return np.where(np.hypot(rows - row, columns - column) < 4.5, 0.5 * frame, frame)


def named(words: str, pad: Pad) -> NDArray[np.bool_]:
    """The pixels that a finding says to mask."""
    ends = re.search(r"x = (\S+) to (\S+) mm, y = (\S+) to (\S+) mm: dirt", words)
    assert ends is not None, words
    left, right, low, high = (float(end) for end in ends.groups())
    x, y = (1e3 * at for at in pad.pixel_positions)
    margin = 0.05  # what a tenth of a millimetre is rounded by
    across = (x > left - margin) & (x < right + margin)
    return np.outer((y > low - margin) & (y < high + margin), across)


@pytest.mark.slow
def test_a_speck_on_squares_is_named_and_masked() -> None:
    drawing = ff.load_sensor("pad").replace(**FEW)
    model, rng = characterize_pad(drawing, samples=48, slices=6), np.random.default_rng(3)
    forces = np.zeros((20, 3))
    forces[[6, 7, 12]] = [[1.0, 0.1, 0.0], [0.8, 0.0, 0.2], [0.5, -0.1, 0.1]]
    frame, reader = specked(model.expose(forces, rng=rng), 34, 52), ff.Reader(model)
    refused = reader.search(frame)
    assert refused.status is ff.Status.MODEL_MISMATCH
    mask = named(refused.findings[0], drawing)
    assert mask[34, 52]
    assert mask.mean() < 0.1
    reading = reader.search(frame, np.broadcast_to(mask, model.frame_shape))
    assert reading.status is ff.Status.OK
    off = (reading.forces - forces).ravel()
    assert off @ np.linalg.solve(reading.covariance, off) < chi2.isf(IMPROBABLE, off.size)


@pytest.mark.slow
def test_a_speck_on_a_skin_is_found_and_masked() -> None:
    """Departures, which a finding compares with the speck, take half a minute."""
    model = ff.characterize(ff.load_sensor("fingertip"))
    press = ff.Press(x=0.8e-3, y=-0.5e-3, normal=0.5, radius=5e-3)
    middle = np.array(model.frame_shape[-2:]) // 2
    reader, frame = ff.Reader(model), model.expose([press], rng=1)
    dirty = specked(frame, *middle)
    assert reader.search(dirty).status is ff.Status.MODEL_MISMATCH
    single = reader._single
    assert isinstance(single, PadSkinReader)
    found = PadSkinDiagnosis(single).hidden(dirty.ravel(), single.usable(None))
    assert found is not None
    mask = found.pixels.reshape(model.frame_shape)
    assert mask[..., *middle].all()
    assert mask.mean() < 0.1
    reading = reader.search(dirty, mask)
    assert reading.ok
    total = reading.total
    assert total is not None
    assert abs(total.force[0] - 0.5) < 4.5 * total.force_std[0]
