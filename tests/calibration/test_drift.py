"""A lamp that drifts is noticed, allowed for, and does no harm where there is none."""

import numpy as np
import pytest
from benches import (
    PLACE,
    STRAIN_OPTIC,
    drawing,
    findings,
    held_out,
    is_plausible,
    lit,
    seen_by,
)

from benches import presses, shots  # isort: skip


import fringeforce as ff

pytestmark = pytest.mark.slow

GAIN, DARK = 0.02, 0.7


@pytest.fixture(scope="module")
def true() -> ff.SensorModel:
    made = drawing().replace(**{STRAIN_OPTIC: 0.054})
    return lit(ff.characterize(made), np.random.default_rng(0))


def calibrated(true, rng, gain: float, dark: float, count: int = 16) -> ff.SensorModel:
    forces = presses(rng, count)
    gains, darks = gain * rng.standard_normal(len(forces)), dark * rng.standard_normal(len(forces))
    frames = shots(true, forces, rng, gains, darks)
    return ff.calibrate(drawing(), frames, forces, [STRAIN_OPTIC])


def test_a_drift_is_measured_told_and_allowed_for(true) -> None:
    rng = np.random.default_rng(41)
    model = calibrated(true, rng, GAIN, DARK)
    assert seen_by(model).drift == pytest.approx((GAIN, DARK), rel=0.4)
    assert any("drifted" in text for text in findings(model).findings)
    assert findings(model).outliers == ()
    assert findings(model).chi2 == pytest.approx(1, abs=0.04)
    truth = np.array([0.054, *PLACE])
    assert (np.abs(findings(model).values - truth) < 4.5 * findings(model).std).all()
    found = held_out(model, true, rng, gain=GAIN, offset=DARK)
    assert found.efficiency < 1.4
    assert found.coverage > 0.93
    assert found.read > 0.85


def test_a_steady_lamp_is_called_steady_and_read_as_before(true) -> None:
    rng = np.random.default_rng(42)
    model = calibrated(true, rng, 0.0, 0.0)
    assert seen_by(model).drift == (0.0, 0.0)
    assert not any("drift" in text for text in findings(model).findings)
    found = held_out(model, true, rng)
    assert found.efficiency < 1.15
    assert 0.93 <= found.coverage <= 0.97


def test_estimates_under_a_drift_scatter_as_their_covariance_says(true) -> None:
    rng, total = np.random.default_rng(43), 0.0
    truth = np.array([np.log(1.08), *PLACE])
    for _ in range(5):
        found = findings(calibrated(true, rng, GAIN, DARK, count=0))
        reached = np.append(np.log(found.values[0] / found.drawing[0]), found.values[1:])
        total += (reached - truth) @ np.linalg.solve(found.covariance, reached - truth)
    assert is_plausible(float(total), 5 * 3)
