"""Limited loads are the likeliest that a dry contact can exert."""

import numpy as np
import pytest
from scipy.optimize import nnls

from fringeforce.contacts.friction_cone import within_friction_cone

FRICTION = 0.4


@pytest.mark.parametrize("seed", range(20))
def test_limited_loads_are_the_optimum_that_nonnegative_least_squares_finds(seed: int) -> None:
    """Loads in a cone are sums of its two edges, none of them negative."""
    rng = np.random.default_rng(seed)
    n = 4
    root = rng.normal(size=(2 * n, 2 * n)) + 2 * np.eye(2 * n)
    loads = rng.normal(0.5, 1.5, 2 * n)
    found, _ = within_friction_cone(loads, root @ root.T, FRICTION)
    edges = np.kron(np.eye(n), [[1, 1], [FRICTION, -FRICTION]])
    white = np.linalg.inv(root)
    shares, _ = nnls(white @ edges, white @ loads)
    np.testing.assert_allclose(found, edges @ shares, atol=1e-6)


def test_loads_within_the_limits_stay_and_those_beyond_are_named() -> None:
    normal = np.array([1.0, 1.0, 1.0, -0.2, 0.0, 2.0])
    tangential = np.array([0.39, 0.41, -0.41, 0.0, 0.0, -0.79])
    loads = np.stack([normal, tangential], axis=1).ravel()
    found, active = within_friction_cone(loads, 0.01 * np.eye(12), FRICTION)
    assert active.tolist() == [False, True, True, True, False, False]
    kept = np.repeat(~active, 2)
    np.testing.assert_allclose(found[kept], loads[kept], atol=1e-12)
    # without correlation the nearest point of a cone's edge is the projection on it
    edge = np.array([1, FRICTION]) / np.hypot(1, FRICTION)
    np.testing.assert_allclose(found[[2, 3]], edge * (edge @ [1.0, 0.41]), atol=1e-12)
    np.testing.assert_allclose(found[[6, 7]], 0, atol=1e-12)
