"""Skins of pads that relax: contacts are read without what earlier ones left."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.models.pad_presses import pad_tractions

SMALL = {
    "transducer.length": "15 mm",
    "transducer.width": "15 mm",
    "skin.extent": ["12 mm", "12 mm"],
    "camera.pixels": [96, 96],
}
LOOSE = [
    {"share": "6 % +/- 20 %", "time": "0.4 s"},
    {"share": "4 % +/- 20 %", "time": "15 s"},
]
TIMES = np.arange(0.0, 11.0, 0.5)
PUSH = 4.0 * np.interp(TIMES, [0, 0.5, 1, 6, 7.5, 8, 11], [0, 0, 1, 1, 1, 0, 0])
PLACE = np.interp(TIMES, [0, 6, 7.5, 11], [-1.5e-3, -1.5e-3, 1e-3, 1e-3])
FREE = TIMES > 8.1


def skin(terms: list) -> ff.Pad:
    return ff.load_sensor("pad-skin").replace(**SMALL, **{"transducer.relaxation": terms})


@pytest.fixture(scope="module")
def presses() -> list[list[ff.Press]]:
    """A sphere that is pressed, held, slid and let go."""
    return [
        [
            ff.Press(
                x=float(x), y=1e-3, normal=float(n), tangential=(0.2 * float(n), 0.0), radius=5e-3
            )
        ]
        if n > 0
        else []
        for n, x in zip(PUSH, PLACE, strict=True)
    ]


@pytest.fixture(scope="module")
def frames(presses) -> NDArray[np.unsignedinteger]:
    """Of a pad whose shares are 20 % off: contact mechanics, and exact lags of every slice."""
    real = ff.characterize(skin([["7.2 %", "0.4 s"], ["3.2 %", "15 s"]]))
    return real.expose(presses, rng=0, times=TIMES)


def test_contacts_are_read_without_creep_and_none_is_left(frames, presses) -> None:
    drawn = ff.characterize(skin(LOOSE))
    batch = ff.Reader(drawn).read_batch(frames, covariance=False, times=TIMES)
    assert batch.resultants is not None
    for status, felt, touching in zip(batch.status, batch.resultants, presses, strict=True):
        if not touching or touching[0].normal < 0.5:
            continue
        assert status is ff.Status.OK
        acting = pad_tractions(drawn.sensor, touching[0]).forces.sum(axis=0)
        off = felt[0].force - acting
        assert (np.abs(off) < 4 * felt[0].force_std).all()
    # shares that are uncertain by 1.2 % and, less developed, 0.8 %
    late = batch.resultants[np.flatnonzero(TIMES == 5.5)[0]][0]
    assert 0.04 < late.force_std[0] < 0.08
    assert all(status is ff.Status.NO_CONTACT for status in batch.status[FREE])
    last = np.flatnonzero(FREE)[0]
    left = ff.Reader(ff.characterize(skin([]))).search(frames[last])
    assert left.status is ff.Status.OK
    assert left.total is not None
    assert left.total.force[0] > 0.1


def test_what_fades_is_said(frames) -> None:
    reader = ff.Reader(ff.characterize(skin(LOOSE)))
    few = slice(1, None, 3)
    readings = list(reader.stream(frames[few], times=TIMES[few]))
    assert not readings[0].findings
    assert readings[-1].status is ff.Status.NO_CONTACT
    assert "fades" in readings[-1].findings[0]
    assert "fades" in readings[-1].advice


def test_a_skin_begins_at_rest() -> None:
    model = ff.characterize(skin(LOOSE))
    with pytest.raises(InputError, match="at rest"):
        ff.Reader(model, history=0.5)
    with pytest.raises(InputError, match="time of each frame"):
        ff.Reader(model).read(np.zeros(model.frame_shape, np.uint8))
