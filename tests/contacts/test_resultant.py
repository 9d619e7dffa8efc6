"""Resultants of strips and pads, against many forces drawn and many frames read."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.contacts.resultant import resultant

DRAWS = 20_000


def summed_up(places: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Force, moment and centre of pressure of drawn forces (k, n, components), by vectors."""
    k, n, components = forces.shape
    lever, pull = np.zeros((n, 3)), np.zeros((k, n, 3))
    lever[:, : places.shape[1]] = places
    pull[..., : components - 1], pull[..., 2] = forces[..., 1:], -forces[..., 0]
    moment = np.cross(lever, pull).sum(axis=1)
    centre = np.stack([np.average(places, axis=0, weights=one) for one in forces[..., 0]])
    return np.hstack([forces.sum(axis=1), moment, centre])


@pytest.mark.parametrize("dimensions", [1, 2])
def test_the_joint_covariance_is_that_of_forces_drawn(dimensions: int) -> None:
    rng, n, components = np.random.default_rng(5), 5, dimensions + 1
    places = rng.uniform(-5e-3, 5e-3, (n, dimensions))
    forces = np.column_stack([rng.uniform(1, 2, n), rng.normal(0, 0.5, (n, dimensions))])
    root = 0.01 * rng.normal(size=(forces.size, forces.size))
    tactels = np.array([0, 1, 3, 4])
    found = resultant(places, forces, tactels, root @ root.T)
    drawn = forces + (rng.normal(size=(DRAWS, forces.size)) @ root.T).reshape(DRAWS, n, components)
    values = summed_up(places[tactels], drawn[:, tactels])
    np.testing.assert_allclose(
        found.values, summed_up(places[tactels], forces[None, tactels])[0], rtol=1e-12
    )
    spread, unit = np.cov(values.T), np.where(found.std > 0, found.std, 1.0)
    # a correlation from k draws is sure to 1 / sqrt(k), a variance to sqrt(2 / k)
    off = (spread - found.covariance) / np.outer(unit, unit)
    assert np.abs(off).max() < 5 * np.sqrt(2 / DRAWS)
    slip = np.linalg.norm(drawn[:, tactels].sum(axis=1)[:, 1:], axis=1) / values[:, 0]
    assert found.slip_ratio_std == pytest.approx(slip.std(), rel=5 / np.sqrt(2 * DRAWS))


@pytest.mark.parametrize("dimensions", [1, 2])
def test_where_nothing_presses_there_is_no_centre(dimensions: int) -> None:
    size = 4 * (dimensions + 1)
    forces, places = np.zeros((4, dimensions + 1)), np.zeros((4, dimensions))
    found = resultant(places, forces, np.arange(4), np.eye(size))
    assert np.isnan(found.centre).all()
    assert np.isfinite(found.std[: dimensions + 4]).all()


def test_force_and_centre_on_a_strip_are_off_by_what_is_stated() -> None:
    model = ff.characterize(ff.load_sensor("saad"))
    places, forces = model.sensor.tactels.positions, np.zeros((11, 2))
    forces[[3, 4, 8]] = [0.8, 0.1], [0.5, -0.05], [1.0, 0.3]
    pressed = [3, 4]
    true = np.array([*forces[pressed].sum(axis=0), 0.0])
    true[2] = places[pressed] @ forces[pressed, 0] / true[0]
    reader, rng, count = ff.Reader(model), np.random.default_rng(0), 400
    distances = []
    for _ in range(count):
        felt = ff.touch(model.sensor, reader.search(model.expose(forces, rng=rng)))
        assert [patch.tactels.tolist() for patch in felt.patches] == [[3, 4], [8]]
        off = felt.patches[0].values[[0, 1, 5]] - true
        joint = felt.patches[0].covariance[np.ix_([0, 1, 5], [0, 1, 5])]
        distances.append(off @ np.linalg.solve(joint, off))
    # chi-square of three degrees of freedom has the mean 3 and the variance 6; five deviations
    # of the mean are left by chance once in a million seeds
    assert abs(np.mean(distances) - 3) < 5 * np.sqrt(6 / count)
