"""Pads of one tactel, and of one row of them."""

from pathlib import Path

import numpy as np
import pytest

import fringeforce as ff


@pytest.mark.parametrize("count", [[1, 1], [1, 3], [2, 1]])
def test_a_single_tactel_or_row_is_characterised_saved_and_read(
    count: list[int], tmp_path: Path
) -> None:
    pad = ff.load_sensor("pad").replace(
        transducer={"length": "6 mm", "width": "6.5 mm", "sides": "roller"},
        tactels={"count": count},
        camera={"pixels": [40, 32]},
    )
    made = ff.characterize(pad)
    made.save(tmp_path / "pad.h5")
    model = ff.load_model(tmp_path / "pad.h5")
    forces = np.zeros((pad.tactels.total, 3))
    forces[-1] = 1.0, 0.3, -0.2
    reader = ff.Reader(model)
    frames = [model.expose(forces * (1 + 0.02 * k), k) for k in range(2)]
    first, second = reader.stream(frames)
    for reading, size in ((first, 1.0), (second, 1.02)):
        assert reading.status is ff.Status.OK
        assert (np.abs(reading.forces - size * forces) < 5 * reading.std).all()
    assert second.tracked
