"""What earlier frames tell of explanations that one frame cannot tell apart."""

import numpy as np
import pytest
from exact_frames import Bench, drawing
from scipy.stats import chi2

import fringeforce as ff
from fringeforce.reading.strip_explanations import alike
from fringeforce.reading.strip_reader import Before, StripFrameReader

TOUCHES, FRAMES = 60, 9


@pytest.mark.parametrize("pace", [1.0, 0.97], ids=["held", "released"])
def test_earlier_frames_tell_more_of_what_they_saw_and_nothing_wrong(pace: float) -> None:
    """Weak fingers, held or let go; frames of the exact series."""
    sensor, rng = drawing(), np.random.default_rng()
    across = (np.arange(11) - rng.uniform(0, 10, (TOUCHES, 1))) / rng.uniform(1, 3, (TOUCHES, 1))
    normal = rng.uniform(0.2, 0.6, (TOUCHES, 1)) * np.maximum(1 - across**2, 0)
    forces = np.stack([normal, normal * rng.uniform(-0.5, 0.5, normal.shape)], axis=2)
    bench = Bench(sensor, sensor.tactels.positions, np.full(11, 1e-7))
    single = StripFrameReader(ff.characterize(sensor))
    used, sure = single.usable(None), 0
    # the last frame is of the touch itself
    motion = pace ** np.arange(1 - FRAMES, 1)[:, None, None]
    for touch in forces:
        *earlier, last = bench.frames(touch * motion, rng)
        reading, _ = single.followed(last, used, Before(frames=earlier))
        off = (reading.forces - touch).ravel()
        near = off @ np.linalg.solve(reading.covariance, off) < chi2.isf(1e-6, 22)
        sure += reading.ok
        assert near or not reading.ok
    assert sure > 0.75 * TOUCHES


def test_frames_of_a_touch_that_moves_are_not_taken_for_frames_of_one() -> None:
    """Forces that grow by a twentieth, and none."""
    model = ff.characterize(drawing())
    rng, touch = np.random.default_rng(), np.zeros((11, 2))
    touch[4:7, 0] = 0.3, 0.5, 0.3
    variance = StripFrameReader(model).uncertain.frame.variance
    told = np.zeros(2, int)
    for _ in range(50):
        for k, last in enumerate((1.0, 1.05)):
            sizes = np.repeat([1.0, last], 4)[:, None, None]
            told[k] += alike(np.asarray(model.expose(touch * sizes, rng), float), variance)
    assert told[0] > 40
    assert told[1] == 0
