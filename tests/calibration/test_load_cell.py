"""A load cell whose gain and zero are not exact: what is known of the sensor is no better."""

import numpy as np
import pytest
from benches import STRAIN_OPTIC, drawing, findings, lit, presses, shots

import fringeforce as ff
from fringeforce.base.errors import InputError

pytestmark = pytest.mark.slow

TRUE, GAIN, ZERO = 0.0527, 1.02, 0.03


@pytest.fixture(scope="module")
def bench() -> tuple[np.ndarray, np.ndarray]:
    """Frames, and what a cell says of their loads that reads 2 % and 30 mN too much."""
    rng = np.random.default_rng(3)
    forces = presses(rng, 8)
    true = lit(ff.characterize(drawing().replace(**{STRAIN_OPTIC: TRUE})), rng)
    written = forces * GAIN + np.where(forces[..., :1] != 0, [ZERO, 0.0], 0.0)
    return shots(true, forces, rng), written


def test_gain_and_zero_widen_what_they_are_not_told_from(bench) -> None:
    frames, written = bench
    sure = findings(ff.calibrate(drawing(), frames, written, [STRAIN_OPTIC]))
    cell = (0.02, 0.03)
    found = findings(ff.calibrate(drawing(), frames, written, [STRAIN_OPTIC], load_cell=cell))
    # 2 % of the cell in two components stand for a strength of the effect, 2 % / sqrt(2)
    assert found.std[0] / TRUE == pytest.approx(0.02 / np.sqrt(2), rel=0.1)
    assert abs(found.values[0] - TRUE) < 2 * found.std[0]
    assert abs(sure.values[0] - TRUE) > 10 * sure.std[0]
    # normal forces scatter no more than those of a good cell, once the zero is found
    assert found.scatter[0] < 0.4 * sure.scatter[0]


def test_a_negative_deviation_is_refused(bench) -> None:
    with pytest.raises(InputError, match="finite and not negative"):
        ff.calibrate(drawing(), *bench, load_cell=(-0.02, 0.0))
