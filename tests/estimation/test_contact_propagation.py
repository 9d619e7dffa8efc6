"""Propagated loads have the moments of the exact posterior, summed by other means."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import logsumexp

import fringeforce as ff
from fringeforce.estimation.contact_marginals import among_others
from fringeforce.estimation.contact_propagation import propagated_loads
from fringeforce.estimation.frame_exposure import (
    expose,
    node_phase,
)
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.frame_model import as_seen
from fringeforce.estimation.linearised_frame import Linearised, banded
from fringeforce.estimation.posterior import Posterior, Top, products
from fringeforce.estimation.uncertain_contacts import (
    Contacts,
    contacts_about,
    influence,
    moments_of,
    profile_basis,
)
from fringeforce.models.uncertainty import uncertainty

Array = NDArray[np.float64]

TACTELS = 2
LOADS = np.array([0.5, 0.1, 0.35, -0.05])


class Case:
    """Two contacts of uncertain place and width, pressed weakly, and what they show."""

    def __init__(self, sensor: ff.Sensor, **values: str) -> None:
        drawing = {
            "transducer.edges": "roller",
            "tactels.count": TACTELS,
            "tactels.placement": "0 +/- 0.1 mm",
            "tactels.contact_width": "0.4 +/- 0.2 mm",
            "polariscope.visibility": "0.97 +/- 0.02",
            "camera.pixels": 400,
        } | values
        model = uncertainty(ff.characterize(sensor.replace(**drawing))).frame
        at, rng = model.at, np.random.default_rng(7)
        truth = np.zeros(at.size)
        truth[: at.loads] = LOADS
        truth[at.place : at.fields] = rng.standard_normal(2 * TACTELS)
        levels = expose(model, truth)[0]
        frame = np.round(levels + rng.uniform(-5, 5, len(levels)))
        precision = np.ones(at.size)
        precision[: at.loads] = 1 / 0.6**2
        prior = Prior(np.zeros(at.size), precision, -1.0, 0.02)
        self.posterior = Posterior(model, prior, frame)
        self.top: Top = self.posterior.climbed(truth, heats=(), steps=(0, 50), tolerance=1e-6)
        self.about: Linearised = self.posterior.linearised(self.top)
        self.contacts: Contacts = contacts_about(
            model, prior, self.top.unknowns, self.about, profile_basis(model)
        )
        self.place = slice(at.place, at.fields)
        self.z = self.top.unknowns[self.place]
        inverse = np.linalg.inv(self.about.hessian)
        self.laplace: Array = np.asarray(inverse[self.place, self.place], dtype=float)
        self.scale: Array = np.asarray(np.linalg.cholesky(self.laplace), dtype=float)


@pytest.fixture(scope="module")
def case(sensor: ff.Sensor) -> Case:
    return Case(sensor)


def _conditional(case: Case, z: Array, modes: Array | tuple[()] = ()) -> tuple[float, Array, Array]:
    """Minus the logarithm of the density of z, and loads and light given it, from all nodes.

    And of modes of the influence matrix.
    """
    model, prior, about = case.posterior.model, case.posterior.prior, case.about
    at, unknowns = model.at, case.top.unknowns.copy()
    shown = node_phase(model, unknowns)
    unknowns[case.place], unknowns[: at.loads] = z, 0.0
    unknowns[at.modes : at.modes + len(modes)] = modes
    columns = np.empty((at.loads, len(shown)))
    for x in range(at.loads):
        columns[x] = node_phase(model, unknowns + np.eye(at.size)[x]) - node_phase(model, unknowns)
    target = shown - node_phase(model, unknowns)
    # unknowns: loads, and the visibility about that of the top
    weights, pulls = about.weights, about.pulls
    normal = np.empty((at.loads + 1, at.loads + 1))
    known = banded(about, np.eye(len(shown)))
    normal[:-1, :-1] = columns @ known @ columns.T
    normal[:-1, -1] = normal[-1, :-1] = columns @ weights[0, 3]
    normal[-1, -1] = weights[3, 3].sum()
    seen = unknowns[at.visibility]
    right = np.append(columns @ (known @ target - pulls[0]), -pulls[3].sum())
    right[-1] += weights[0, 3] @ target - prior.precision[at.visibility] * seen
    constant = target @ known @ target - 2 * pulls[0] @ target
    normal += np.diag(np.append(prior.precision[: at.loads], prior.precision[at.visibility]))
    mean = np.linalg.solve(normal, right)
    loss = constant - right @ mean + np.linalg.slogdet(normal)[1] + z @ z + np.square(modes).sum()
    return float(loss) / 2, np.asarray(mean, float), np.asarray(np.linalg.inv(normal), float)


def _density(contacts: Contacts, z: Array) -> tuple[float, Array, Array]:
    """Minus the logarithm of the density of z, and loads given it, without the friction cone."""
    shown, off = influence(contacts, z), z - contacts.mean
    target = contacts.target + (off @ contacts.follows if len(contacts.follows) else 0.0)
    normal = shown @ shown.T + np.diag(contacts.precision.ravel())
    loads = np.linalg.solve(normal, shown @ target)
    loss = target @ target - loads @ shown @ target + off @ contacts.known @ off
    loss += np.linalg.slogdet(normal)[1]
    return float(loss) / 2, np.asarray(loads, float), np.asarray(np.linalg.inv(normal), float)


def test_the_density_is_the_gaussian_integral_over_loads_and_light(case: Case) -> None:
    rng = np.random.default_rng(0)
    draws = case.z + 0.7 * rng.standard_normal((12, len(case.z))) @ case.scale.T
    found = [_density(case.contacts, z) for z in draws]
    wanted = [_conditional(case, z) for z in draws]
    values = np.array([one[0] for one in found])
    expected = np.array([one[0] for one in wanted])
    assert np.ptp(expected) > 1
    np.testing.assert_allclose(values - values[0], expected - expected[0], atol=0.02)
    for own, other in zip(found, wanted, strict=True):
        spread = np.sqrt(np.diag(other[2])[:-1])
        np.testing.assert_allclose(own[1], other[1][:-1], atol=0.02 * spread.max())
        np.testing.assert_allclose(np.diag(own[2]), np.diag(other[2])[:-1], rtol=0.02)


def test_a_shift_of_the_camera_is_integrated_out_with_the_places_it_looks_like(
    sensor: ff.Sensor,
) -> None:
    """Places as seen: those of the contacts, moved back by as much as the camera is shifted.

    With the prior of the contacts alone some would be off by more than 1.
    """
    case = Case(sensor, **{"camera.shift": "0 +/- 0.1 mm"})
    at = case.posterior.model.at
    top, shifts = case.top.unknowns[at.modes], np.linspace(-4, 4, 81)
    seen = as_seen(case.posterior.model)[case.place]
    scale = np.linalg.cholesky(seen @ np.linalg.inv(case.about.hessian) @ seen.T)
    rng, found, expected = np.random.default_rng(0), list[float](), list[float]()
    for _ in range(8):
        z = case.z + 0.7 * scale @ rng.standard_normal(len(case.z))
        z[:TACTELS] += rng.uniform(-1.5, 1.5)
        found.append(_density(case.contacts, z)[0])
        energies = []
        for shift in shifts:
            own = z.copy()
            own[:TACTELS] += shift - top
            energies.append(_conditional(case, own, np.array([shift]))[0])
        expected.append(-float(logsumexp(-np.array(energies))))
    assert np.ptp(expected) > 1
    np.testing.assert_allclose(
        np.array(found) - found[0], np.array(expected) - expected[0], atol=0.06
    )


def test_derivatives_of_moments_are_their_changes(case: Case) -> None:
    z = np.random.default_rng(1).standard_normal((TACTELS, 2))
    for k, step in enumerate(1e-5 * np.eye(2)):
        change = moments_of(case.contacts, z + step)[0] - moments_of(case.contacts, z - step)[0]
        np.testing.assert_allclose(moments_of(case.contacts, z)[1 + k], change / 2e-5, atol=1e-8)


@pytest.mark.parametrize("friction", [-1.0, 0.3])
@pytest.mark.parametrize("pull", [(5.0, 1.0), (-3.0, 0.5), (2.0, 4.0), (-1.0, -6.0)])
def test_loads_of_a_known_contact_are_the_least_of_frame_and_cone(
    case: Case, friction: float, pull: tuple[float, float]
) -> None:
    """By a search that knows no sides of the cone."""
    contacts = case.contacts._replace(friction=friction, stiff=40.0)
    profiles = np.zeros((TACTELS, 2, contacts.profiles.shape[2], 2))
    profiles[:, 0, 0, 0], profiles[:, 1, 0] = 1.0, (0.4, 1.0)
    known, one = np.zeros((1, 3, 3)), np.zeros(1)
    known[0, :2, :2] = [[9.0, 2.0], [2.0, 4.0]]
    right = np.array([[*pull, 0.0]])
    found = among_others(
        contacts,
        profiles,
        np.zeros(1, np.int64),
        known,
        right,
        *np.zeros((1, 1, 2)),
        np.zeros((1, 2, 2)),
        one,
        one,
    )

    def loss(loads: Array) -> float:
        x = profiles[0, :, 0].T @ loads
        miss = loads[0] if friction < 0 else friction * loads[0] - np.abs(loads[1])
        cone = np.square(min(miss, 0.0))
        if friction >= 0:
            other = friction * loads[0] + np.abs(loads[1])
            cone += np.square(min(other, 0.0))
        value = x @ known[0, :2, :2] @ x + contacts.precision[0] @ np.square(loads)
        return float(value / 2 - right[0, :2] @ x + contacts.stiff * cone / 2)

    least = minimize(
        loss, np.zeros(2), method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12}
    )
    np.testing.assert_allclose(found.loads[0], least.x, atol=1e-6)
    np.testing.assert_allclose(found.mean[0, :2], profiles[0, :, 0].T @ least.x, atol=1e-6)


def _importance(case: Case, count: int) -> tuple[Array, Array, float]:
    """Mean and covariance of the loads under the exact posterior, and the effective sample."""
    posterior, rng = case.posterior, np.random.default_rng(2)
    model, prior = posterior.model, posterior.prior
    at, sigma = model.at, np.sqrt(model.variance)
    logs, loads = np.empty(count), np.empty((count, at.loads))
    root = 1.5 * case.scale
    for k in range(count):
        normal, scale = rng.standard_normal(len(case.z)), np.sqrt(5 / rng.chisquare(5))
        z = case.z + scale * root @ normal
        _, mean, covariance = _conditional(case, z)
        own = rng.standard_normal(len(mean))
        drawn = mean + np.linalg.cholesky(covariance) @ own
        unknowns = np.append(np.append(drawn[:-1], z), drawn[-1])
        left = (expose(model, unknowns)[0] - posterior.frame) / sigma
        loss = left @ left + unknowns**2 @ prior.precision
        loss += np.square(np.minimum(drawn[:-1:2], 0) / prior.yielding).sum()
        proposal = -own @ own / 2 - np.linalg.slogdet(covariance)[1] / 2
        proposal -= (5 + len(z)) / 2 * np.log1p(scale**2 * normal @ normal / 5)
        logs[k], loads[k] = -loss / 2 - proposal, drawn[:-1]
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    mean = weights @ loads
    return mean, ((loads - mean).T * weights) @ (loads - mean), float(1 / (weights @ weights))


def test_propagated_loads_have_mean_and_covariance_of_the_exact_posterior(case: Case) -> None:
    mean, covariance, effective = _importance(case, 4000)
    assert effective > 300
    given = case.z, case.laplace, case.top.unknowns[: 2 * TACTELS]
    found, spread = propagated_loads(case.contacts, *given, heat=1.0)
    std = np.sqrt(np.diag(covariance))
    # the importance sample errs, and the contacts are more bent than normal distributions
    error = 4 / np.sqrt(effective)
    np.testing.assert_allclose(found, mean, atol=error * std.max())
    np.testing.assert_allclose(np.sqrt(np.diag(spread)), std, rtol=error / np.sqrt(2))
    # half of what Laplace's approximation is off
    off = np.abs(given[2] - mean).max()
    assert np.abs(found - mean).max() < 0.5 * off
    again = propagated_loads(case.contacts, *given, heat=1.0)
    np.testing.assert_allclose(again[0], found, rtol=1e-9)
    np.testing.assert_allclose(again[1], spread, rtol=1e-9, atol=1e-12)


def test_products_of_errors_are_the_second_order_of_the_phase(case: Case) -> None:
    model, unknowns = case.posterior.model, case.top.unknowns
    waves, one, other = products(model, unknowns)
    contacts = slice(0, model.at.fields)
    rng, bent = np.random.default_rng(3), []
    for _ in range(4):
        error = np.zeros(len(unknowns))
        error[contacts] = 1e-2 * rng.standard_normal(model.at.fields)
        both = node_phase(model, unknowns + error) + node_phase(model, unknowns - error)
        second = both / 2 - node_phase(model, unknowns)
        told = (error[one] * error[other]) @ waves
        bent.append(np.abs(second).max())
        np.testing.assert_allclose(told, second, atol=0.01 * bent[-1])
    assert min(bent) > 1e-6


def test_contacts_that_are_nearly_known_have_the_covariance_of_laplace(sensor: ff.Sensor) -> None:
    known = {"tactels.placement": "0 +/- 0.001 mm", "tactels.contact_width": "0.4 +/- 0.001 mm"}
    case = Case(sensor, **known)
    loads = case.top.unknowns[: 2 * TACTELS]
    laplace = np.linalg.inv(case.about.hessian)[: 2 * TACTELS, : 2 * TACTELS]
    mean, covariance = propagated_loads(case.contacts, case.z, case.laplace, loads)
    np.testing.assert_allclose(mean, loads, atol=0.02 * np.sqrt(np.diag(laplace)).min())
    np.testing.assert_allclose(covariance, laplace, atol=0.02 * np.diag(laplace).max())


def test_a_dark_frame_bounds_loads_by_the_curvature_of_its_fringes(case: Case) -> None:
    posterior = case.posterior
    model, at = posterior.model, posterior.model.at
    levels = expose(model, np.zeros(at.size))[0]
    dark = Posterior(model, posterior.prior, levels)
    top = Top(np.zeros(at.size), 0.0, 0.0, float(len(levels)))
    covariance = dark.covariance(top)
    # the exact posterior along one normal load, all else as it is
    along = np.linspace(-1, 1, 2001)
    unit = np.zeros(at.size)
    unit[0] = 1.0
    left = [expose(model, f * unit)[0] - levels for f in along]
    loss = np.square(left / np.sqrt(model.variance)).sum(axis=1)
    loss += posterior.prior.precision[0] * along**2
    weights = np.exp(-loss / 2)
    exact = np.sqrt(weights @ along**2 / weights.sum())
    given = 1 / np.sqrt(np.linalg.inv(covariance)[0, 0])
    assert exact < 0.3 / np.sqrt(posterior.prior.precision[0])
    assert 0.5 * exact < given < 2 * exact
