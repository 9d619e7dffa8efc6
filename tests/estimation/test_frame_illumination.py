"""A frame's own light is what a joint fit of loads and light finds."""

import numpy as np

from fringeforce.estimation.frame_illumination import frame_illumination
from fringeforce.estimation.likelihood import Response

DRIFT = (0.05, 3.0)


def test_light_and_its_price_are_those_of_a_joint_least_squares_fit() -> None:
    rng = np.random.default_rng(0)
    x = np.linspace(-1, 1, 300)[:, None]
    influence = 5 * np.exp(-(((x - np.array([-0.5, 0.0, 0.5])) / 0.4) ** 2))
    loads, response = np.array([1.0, 1.7, -0.8]), Response(200.0, 20.0, 9.0)
    phase = influence @ loads
    level = response.level(phase)
    frame = 1.04 * (level - 20) + 18 + rng.normal(0, 3, 300)

    unit = influence * (100 * np.sin(phase) / 3)[:, None]
    spread = np.asarray(np.linalg.inv(unit.T @ unit), dtype=np.float64)
    found = frame_illumination(frame, loads, influence, response, spread, DRIFT)

    # five unknowns at once; what is known of the light before are two rows more
    gain, offset = DRIFT[0] * (level - 20) / 3, np.full(300, DRIFT[1] / 3)
    rows = np.block([[unit, gain[:, None], offset[:, None]], [np.zeros((2, 3)), np.eye(2)]])
    right = np.append((frame - level) / 3, [0, 0])
    best, *_ = np.linalg.lstsq(rows, right, rcond=None)
    joint = np.linalg.inv(rows.T @ rows)
    np.testing.assert_allclose(found.shifts, best[3:], rtol=1e-9)
    np.testing.assert_allclose(found.covariance, joint[:3, :3] - spread, rtol=1e-7)
