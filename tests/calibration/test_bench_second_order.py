"""The posterior of a strip's bench to second order, against derivatives of the levels by steps.

On a strip as short as that, what sums at the nodes leave of some unknowns is less than nothing.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.calibration.bench_loads import loads_on_tactels
from fringeforce.calibration.bench_posterior import BenchPosterior
from fringeforce.calibration.shared_unknowns import State
from fringeforce.calibration.strip_search import StripSearch
from fringeforce.estimation.frame_exposure import expose

STRAIN_OPTIC = "transducer.photoelastic.strain_optic_coefficient"
FRAMES, STEP = 8, 1e-5


@pytest.fixture(scope="module")
def explained() -> tuple[BenchPosterior, State]:
    """The posterior where a calibration begins, and values of all unknowns that explain all."""
    rng = np.random.default_rng(1)
    drawn = ff.load_sensor("saad").replace(
        transducer={"length": "4 mm", "width": "2 mm"},
        tactels={"count": 2, "pitch": "2 mm"},
        camera={"pixels": 512, "amplitude": 150.0, "offset": 50.0},
    )
    forces = rng.uniform(0.5, 3.0, (FRAMES, 2, 2)) * [1.0, 0.3]
    frames = ff.characterize(drawn).expose(forces, rng=rng).astype(float)
    loads = loads_on_tactels(forces, drawn.tactels.positions[:, None])
    search = StripSearch(drawn, frames, loads, (STRAIN_OPTIC,), {}, (0.01, 0.01))
    posterior, state = search.posterior(np.ones(FRAMES), 1.0), search.state
    models = posterior.models(state.shared)
    exact = [
        expose(models.of_frame(f), models.unknowns(f, own, state.shared))[0]
        for f, own in enumerate(state.own)
    ]
    return replace(posterior, bench=replace(posterior.bench, frames=np.array(exact))), state


def levels(posterior: BenchPosterior, state: State) -> Iterator[np.ndarray]:
    """Of every frame, over the noise, and what its own unknowns are off, over their deviations."""
    models = posterior.models(state.shared)
    for f, own in enumerate(state.own):
        model = models.of_frame(f)
        level = expose(model, models.unknowns(f, own, state.shared))[0] / np.sqrt(model.variance)
        off = own - posterior.mean(f, state.shared)
        yield np.append(level, np.sqrt(posterior.precision(f)) * off)


def differences(posterior: BenchPosterior, ahead: State, behind: State) -> list[np.ndarray]:
    both = zip(levels(posterior, ahead), levels(posterior, behind), strict=True)
    return [(after - before) / (2 * STEP) for after, before in both]


def by_steps(posterior: BenchPosterior, state: State) -> np.ndarray:
    """Information of the shared unknowns, the own ones of every frame eliminated."""
    by_shared = [
        differences(
            posterior,
            replace(state, shared=state.shared + step),
            replace(state, shared=state.shared - step),
        )
        for step in STEP * np.eye(len(state.shared))
    ]
    by_own = [
        differences(posterior, *(replace(state, own=[u + d for u in state.own]) for d in (s, -s)))
        for s in STEP * np.eye(len(state.own[0]))
    ]
    total = np.diag(posterior.expected.precision)
    for f in range(len(state.own)):
        shared, own = (np.stack([one[f] for one in by], axis=1) for by in (by_shared, by_own))
        left = shared - own @ np.linalg.lstsq(own, shared, rcond=None)[0]
        total += left.T @ left
    return total


def test_an_information_that_is_not_positive_is_summed_over_the_pixels(explained) -> None:
    posterior, state = explained
    models = posterior.models(state.shared)
    rough = posterior.normal(state, posterior.eliminated(state, models))[1]
    assert np.linalg.eigvalsh(rough)[0] < 0  # otherwise nothing is tested
    found = posterior.second_order(state, models)
    assert np.linalg.eigvalsh(found.information)[0] > 0
    expected = by_steps(posterior, state)
    unit = np.sqrt(np.diag(expected))
    off = (found.information - expected) / np.outer(unit, unit)
    # more blur is taken for diffusion, which a kernel of a few pixels is only nearly
    off = np.delete(np.delete(off, posterior.bench.at.blur, 0), posterior.bench.at.blur, 1)
    assert np.abs(off).max() < 1e-5


def test_sums_over_the_pixels_have_the_gradients_of_those_at_the_nodes(explained) -> None:
    posterior, state = explained
    models = posterior.models(state.shared)
    every = replace(posterior, exact=True).terms(state, models)
    for near, one in zip(posterior.terms(state, models), every, strict=True):
        np.testing.assert_array_equal(near.own_gradient, one.own_gradient)
        np.testing.assert_array_equal(near.gradient, one.gradient)
        unit = np.sqrt(np.diag(one.own))
        np.testing.assert_allclose(
            near.own / np.outer(unit, unit), one.own / np.outer(unit, unit), atol=0.01
        )
