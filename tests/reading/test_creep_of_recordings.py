"""Recordings of strips that relax: what later frames tell of earlier ones."""

import numpy as np
import pytest
from scipy.ndimage import binary_dilation
from scipy.stats import chi2

import fringeforce as ff
from fringeforce.models.creep import Creep
from fringeforce.reading import creep as filtering
from fringeforce.reading.batch import Batch

TERMS = [
    {"share": "0.06 +/- 20 %", "time": "0.4 s"},
    {"share": "0.08 +/- 20 %", "time": "15 s"},
]
CLOSE = [
    {"share": "0.05 +/- 20 %", "time": "0.4 s"},
    {"share": "0.04 +/- 20 %", "time": "2.5 s"},
    {"share": "0.05 +/- 20 %", "time": "15 s"},
]
"""Less than a decade apart, so that they miss little of any creep."""
SENSORS = 4
TIMES = np.arange(0.0, 60.0, 0.25)
SHAPE = np.exp(-np.square((np.arange(11) - 5) / 1.5))


def soft(terms: object = TERMS) -> ff.Sensor:
    light = {"camera.noise_model": "gaussian", "camera.noise": 1.0, "camera.pixels": 1024}
    return ff.load_sensor("saad").replace(**{"transducer.relaxation": terms, **light})


def held(force: float) -> np.ndarray:
    """A touch of three tactels, held for half a minute."""
    forces = np.zeros((len(TIMES), 11, 2))
    pressed = np.interp(TIMES, [2, 3, 33, 33.5], [0, 1, 1, 0])
    forces[..., 0] = force * pressed[:, None] * SHAPE
    return forces


def test_loads_are_those_of_a_dense_gaussian_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    """All loads and the history at once, numpy's normal equations, noise of lags included."""
    monkeypatch.setattr(Creep, "ripple", 0.0)
    monkeypatch.setattr(filtering, "CLEAR", 0.0)
    rng, history, size = np.random.default_rng(0), 2.0, 4
    sensor = soft([[0.06, 0.4], [0.08, 15.0]])
    creep, times = Creep.of(sensor.transducer), np.arange(0.0, 20.0, 0.5)
    acts = (times < 2) | ((times > 6) & (times < 12))
    root = 0.002 * rng.standard_normal((len(times), size, size)) + 0.003 * np.eye(size)
    spread = root @ root.transpose(0, 2, 1)
    loads = rng.normal(2.0, 0.3, (len(times), size)) * acts[:, None]
    before = history * rng.standard_normal(size)
    maybe = np.asarray(binary_dilation(acts, iterations=filtering.EDGE), dtype=bool)
    pulses = creep.added(times, np.eye(len(times)))
    pulses = pulses.reshape(len(times), -1) + np.eye(len(times))
    faded = np.exp(-np.outer(times, creep.rates)) @ creep.amounts
    noise = (root @ rng.standard_normal((len(times), size, 1)))[..., 0]
    shown = pulses @ loads + np.outer(faded, before) + noise

    columns = np.concatenate([pulses[:, maybe], faded[:, None]], axis=1)
    design = np.kron(columns, np.eye(size))
    weight = np.zeros((design.shape[0],) * 2)
    for t, one in enumerate(spread):
        weight[t * size : (t + 1) * size, t * size : (t + 1) * size] = np.linalg.inv(one)
    normal = design.T @ weight @ design
    normal[-size:, -size:] += np.eye(size) / history**2
    dense = np.linalg.solve(normal, design.T @ weight @ shown.ravel()).reshape(-1, size)[:-1]
    variance = np.diag(np.linalg.inv(normal)).reshape(-1, size)[:-1]

    batch = Batch.of(len(times), (2, 2), covariance=True)
    assert batch.covariance is not None
    batch.forces[:], batch.covariance[:] = shown.reshape(-1, 2, 2), spread
    batch.std[:] = np.sqrt(spread.diagonal(axis1=1, axis2=2)).reshape(-1, 2, 2)
    batch.status[:] = ff.Status.OK
    filtering.CreepFilter(sensor, history).smoothed(batch, times)
    found, std = (x.reshape(-1, size)[maybe] for x in (batch.forces, batch.std))
    # what is left out, noise that lags hold, shows in the frame after the contact most
    assert (np.abs(found - dense) < 0.2 * np.sqrt(variance)).all()
    np.testing.assert_allclose(std, np.sqrt(variance), rtol=0.05)
    assert not any(status is ff.Status.OK for status in batch.status[~maybe])


def test_deviations_cover_forces_of_sensors_drawn_from_the_tolerances() -> None:
    model, forces = ff.characterize(soft(CLOSE)), held(2.0)
    times = TIMES[TIMES < 45]
    before, forces = (times > 15) & (times < 32), forces[: len(times)]
    pulls, ratios, inside, false = [], [], [], []
    for seed in range(SENSORS):
        frames = model.as_built(seed).expose(forces, seed, times=times)
        reader = ff.Reader(model)
        forward = reader.read_on(frames, covariance=True, times=times)
        batch = reader.read_batch(frames, times=times)
        assert batch.covariance is not None
        error = (batch.forces - forces)[before]
        inside.append(np.mean(np.abs(error) < 1.96 * batch.std[before]))
        own = np.sqrt(batch.covariance[before][:, ::2, ::2].sum(axis=(1, 2)).mean())
        pulls.append(error[..., 0].sum(axis=1).mean() / own)
        assert forward.covariance is not None
        wide = np.sqrt(forward.covariance[before][:, ::2, ::2].sum(axis=(1, 2)).mean())
        ratios.append(own / wide)
        false.append(np.mean([status is ff.Status.OK for status in batch.status[times > 34]]))
    assert 0.93 < np.mean(inside) < 0.97
    assert np.max(ratios) < 0.25
    assert np.mean(false) < 0.005
    assert np.square(pulls).sum() < chi2.isf(1e-3, SENSORS)


@pytest.mark.parametrize("wrong", [0.8, 1.2])
def test_a_residual_indentation_is_no_contact(wrong: float) -> None:
    """Held for a minute, released, with terms that are a fifth off."""
    times = np.arange(0.0, 100.0, 0.5)
    forces = np.zeros((len(times), 11, 2))
    pressed = np.interp(times, [2, 3, 63, 64], [0, 2.0, 2.0, 0])
    forces[..., 0] = pressed[:, None] * SHAPE
    own = soft([[0.06 * wrong, 0.4], [0.08 * wrong, 15.0]])
    frames = ff.characterize(own).expose(forces, rng=0, times=times)
    reader, model = ff.Reader(ff.characterize(soft())), ff.characterize(soft([]))
    plain = ff.Reader(model).read_batch(frames)
    left = times > 64.2
    # without the terms the indentation is a load, in some frames for certain
    still = np.mean([status is ff.Status.NO_CONTACT for status in plain.status[left]])
    assert still < 0.5
    assert any(status is ff.Status.OK for status in plain.status[left])
    readings = list(reader.stream(frames, times=times))
    after = [reading for reading, free in zip(readings, left, strict=True) if free]
    assert not any(reading.ok for reading in after)
    assert after[0].detail.startswith("Residual indentation")
    assert after[0].findings == (after[0].detail,)
    assert not any(s is ff.Status.OK for s in reader.read_batch(frames, times=times).status[left])


@pytest.mark.parametrize(("stays", "told"), [(0.0, False), (0.1, True)])
def test_a_touch_that_stays_is_told_from_an_indentation_that_fades(
    stays: float, told: bool
) -> None:
    """A twentieth of what was pressed goes on; the terms by which creep fades are a quarter off."""
    times = np.arange(0.0, 120.0, 0.5)
    pressed = np.interp(times, [2, 3, 43, 44], [0, 2.0, 2.0, stays])
    forces = pressed[:, None, None] * np.stack([SHAPE, 0 * SHAPE], axis=1)
    own = ff.characterize(soft([[0.075, 0.4], [0.1, 15.0]]))
    readings = list(
        ff.Reader(ff.characterize(soft())).stream(own.expose(forces, 3, times=times), times=times)
    )
    late = [r for r, time in zip(readings, times, strict=True) if time > 60]
    free = np.mean([reading.status is ff.Status.NO_CONTACT for reading in late])
    assert free == (0.0 if told else 1.0)
    soon = [r for r, time in zip(readings, times, strict=True) if 44 < time < 50]
    named = np.mean([bool(reading.findings) for reading in soon])
    assert (named == 1.0) is not told
    total = np.mean([reading.forces[:, 0].sum() for reading in late])
    assert total == pytest.approx(stays * SHAPE.sum(), abs=0.05)


def test_a_touch_while_the_indentation_fades_is_a_contact() -> None:
    forces = held(2.0)
    forces[(TIMES > 36) & (TIMES < 50), 2, 0] = 0.5
    frames = ff.characterize(soft()).as_built(5).expose(forces, 5, times=TIMES)
    reader = ff.Reader(ff.characterize(soft()))
    batch, touched = reader.read_batch(frames, times=TIMES), (TIMES > 37) & (TIMES < 49)
    assert all(status.usable for status in batch.status[touched])
    assert not any(status is ff.Status.NO_CONTACT for status in batch.status[touched])
    error = (batch.forces - forces)[touched][:, 2, 0]
    assert abs(error.mean()) < 0.02
