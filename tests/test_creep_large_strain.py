"""Strips whose layers relax alike under large strain, against steps in time."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2 as chi_square

import fringeforce as ff
from fringeforce.base.errors import DesignError, InputError
from fringeforce.mechanics.finite_strain import FiniteStrip
from fringeforce.models.creep import Creep
from fringeforce.models.finite_strain import phase_of, strip_of_tactels

Array = NDArray[np.float64]
TERMS = [["6 %", "0.4 s"], ["4 %", "15 s"]]
COUNT = 3


def sensor(loads: str = "dead", more: dict[str, object] | None = None) -> ff.Sensor:
    return ff.load_sensor("saad").replace(
        **{
            "transducer.length": "9 mm",
            "transducer.strain": "finite",
            "transducer.loads": loads,
            "transducer.relaxation": TERMS,
            "tactels.count": COUNT,
            "tactels.contact_width": "0.5 mm",
            "camera.pixels": 256,
            **(more or {}),
        }
    )


def stepped(strip: FiniteStrip, times: Array, forces: Array) -> list[Array]:
    """Displacements of a strip whose second Piola-Kirchhoff stresses relax (Fung), step by step.

    Stresses S are (1 - sum_k g_k) S_e + sum_k g_k q_k, dq_k/dt = dS_e/dt - q_k / tau_k, with those
    S_e of the energy, which are linear in time within a step.
    """
    terms = strip.transducer.relaxation
    share = np.array([term.share for term in terms])[:, None, None, None, None]
    tau = np.array([term.time for term in terms])[:, None, None, None, None]
    now, free = np.zeros(strip.shape), strip._free
    lasting = elastic = 0.0
    found = [now]

    def of_energy(f: Array) -> Array:
        parts = strip._responses(f)
        stress = np.concatenate([part.stress for part in parts], axis=-1)
        inverse = np.linalg.inv(np.moveaxis(f, (0, 1), (-2, -1)))
        return np.einsum("xzij,jkxz->ikxz", inverse, stress)

    def carried(f: Array, stress: Array) -> Array:
        first = np.einsum("ijxz,jkxz->ikxz", f, stress) * strip._weights
        vx, sx, vz, sz = strip._onto_coefficients
        return np.array(
            [
                (vz @ (sx @ part[0]).T).T + (sz @ (vx @ part[1]).T).T
                for part in first
            ]
        )  # fmt: skip

    for step, force in zip(np.diff(times), forces[1:], strict=True):
        kept = np.exp(-step / tau)
        rising = tau / step * (1 - kept)
        load, tangent = strip.load(force), strip.tangent(now)
        for _ in range(60):
            f = strip.gradients(now)
            new = of_energy(f)
            held = kept * lasting + rising * (new - elastic)
            stress = (1 - share.sum()) * new + (share * held).sum(axis=0)
            nodal = load.nodal(now[..., -1])
            left = (strip.on_surface(nodal) - carried(f, stress)).ravel()[free]
            if np.linalg.norm(left) < 1e-8 * max(float(np.linalg.norm(nodal)), 1e-3):
                break
            moved = np.zeros(now.size)
            moved[free] = tangent.solve(left)
            now = now + moved.reshape(now.shape)
        else:
            raise AssertionError("no balance")
        lasting, elastic = held, new
        found.append(now)
    return found


@pytest.mark.parametrize("loads", ["dead", "follower"])
def test_phases_are_those_of_steps_in_time(loads: str) -> None:
    """Whose stresses turn with the material: the rest is of second order in the strain."""
    model, half = ff.characterize(sensor(loads)), 4e-3
    times = np.array([0.0, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0])
    final = np.array([[1.5, 0.3], [0.4, -0.1], [1.0, 0.2]])
    forces = np.minimum(times / 0.2, 1.0)[:, None, None] * final
    strip = strip_of_tactels(model.sensor)
    x = model.pixel_positions
    true = np.array(
        [phase_of(model.sensor, strip, x, one) for one in stepped(strip, times, forces)]
    )
    found = model.loaded_phase(forces, times=times)
    inner, peak = np.abs(x) < half, np.abs(true).max()
    crept = np.abs(true[-1] - true[2])[inner].max()
    assert crept > 0.05 * peak
    off = np.abs(found - true)[:, inner].max()
    assert off < 3e-4 * peak
    # lags of the light itself, as of small strain, would be wrong
    once = model.phase(forces)
    lagging = once + Creep.of(model.sensor.transducer).added(times, once)
    assert np.abs(lagging - true)[:, inner].max() > 3 * off


def test_a_press_that_lasts_is_read_under_large_strain() -> None:
    """Each frame shows loads with their lags, which the filter takes out."""
    times = np.array([0.0, 0.2, 0.4, 0.8, 1.5, 3.0, 6.0, 12.0, 20.0, 30.0])
    model = ff.characterize(sensor())
    final = np.array([[1.5, 0.3], [0.8, -0.1], [1.0, 0.2]])
    forces = np.minimum(times / 0.4, 1.0)[:, None, None] * final
    frames = model.expose(forces, rng=3, times=times)
    batch = ff.Reader(model).read_batch(frames, times=times)
    plain = ff.Reader(ff.characterize(sensor(more={"transducer.relaxation": []}))).read_batch(
        frames
    )
    held = times >= 0.4
    assert all(batch.status[k] is ff.Status.OK for k in np.flatnonzero(held))
    assert batch.covariance is not None
    squares = []
    for error, own in zip((batch.forces - forces)[held], batch.covariance[held], strict=True):
        squares.append(error.ravel() @ np.linalg.solve(own, error.ravel()))
    size = 2 * COUNT
    assert max(squares) < chi_square.isf(1e-4, size)
    assert (plain.forces - forces)[-1, :, 0].sum() > 0.2


def test_creep_that_large_strain_does_not_know_is_refused() -> None:
    known: list[dict[str, object]] = [
        {"transducer.relaxation": [], "transducer.compliant.relaxation": TERMS},
        {"transducer.photoelastic.optical_creep": TERMS},
        {
            "transducer.photoelastic.strain_optic_coefficient": None,
            "transducer.photoelastic.stress_optic_coefficient": 70e-12,
        },
    ]
    for changes in known:
        with pytest.raises(DesignError, match="the same terms of both layers"):
            sensor(more=changes)
        linear = sensor(more={"transducer.strain": "linear"}).replace(**changes)
        with pytest.raises(InputError, match="the same terms of both layers"):
            ff.characterize(linear).expose(np.zeros((2, COUNT, 2)), strain="finite", times=[0, 1])
    with pytest.raises(InputError, match="forces on tactels"):
        ff.characterize(sensor()).expose(
            [[ff.Press(x=0.0, normal=0.1, width=5e-4)]] * 2, times=[0, 1]
        )
