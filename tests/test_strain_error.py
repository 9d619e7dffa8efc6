"""What linear theory misses of forces, against strips that are solved under large strain."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.base.errors import DesignError
from fringeforce.design.pad import Pad
from fringeforce.mechanics.finite_strain import finite_strip
from fringeforce.models.strain_error import strain_deviation, strain_error


def test_forces_of_the_linear_phase_are_off_by_as_much_as_stated(sensor: ff.Sensor) -> None:
    strip = sensor.replace(**{"tactels.contact_width": "0.8 mm", "tactels.count": 5})
    found = finite_strip(strip.transducer, strip.tactels.positions, np.full(5, 8e-4), order=4)
    x, small = np.linspace(-0.012, 0.012, 200), 1e-3
    linear = np.empty((len(x), 10))
    for k in range(10):
        one = np.eye(10)[k].reshape(5, 2) * small
        both = [found.light.integrated_stress(found.solved(sign * one), x) for sign in (1, -1)]
        linear[:, k] = (both[0] - both[1]) / (2 * small)
    rng, missed = np.random.default_rng(3), []
    for _ in range(6):
        normal = rng.uniform(0, 0.5, 5)
        forces = np.stack([normal, normal * rng.uniform(-0.3, 0.3, 5)], axis=1)
        left = found.light.integrated_stress(found.solved(forces), x) - linear @ forces.ravel()
        error = np.linalg.lstsq(linear, left, rcond=None)[0].reshape(5, 2)
        missed.append(error / normal.max() ** 2)
    # errors of one pattern go together, so that six patterns tell a mean square to a half
    ratio = np.sqrt(np.square(missed).mean(axis=(0, 1))) / strain_error(strip)
    assert (np.abs(np.log(ratio)) < np.log(1.6)).all()


@pytest.fixture(scope="module")
def pad() -> Pad:
    changes = {"transducer.length": "13 mm", "transducer.width": "11 mm"}
    return ff.load_sensor("pad").replace(
        **changes, **{"tactels.count": [5, 4], "camera.pixels": [96, 80]}
    )


def test_deviations_of_pads_grow_with_the_square_of_the_forces_near_a_tactel(pad: Pad) -> None:
    forces = np.zeros((20, 3))
    forces[0, 0] = 1.0
    one, two = (strain_deviation(pad, scale * forces).reshape(5, 4, 3) for scale in (1, 2))
    np.testing.assert_allclose(two, 4 * one)
    np.testing.assert_allclose(one[0, 0], strain_error(pad)[[0, 1, 1]])
    assert one[2, 2].all()
    assert not one[3:].any()
    assert not one[:, 3].any()


def test_readings_of_pads_allow_for_large_strain_where_the_design_says_so(pad: Pad) -> None:
    forces = np.zeros((20, 3))
    forces[9] = 2.0, 0.3, 0.0
    bent = pad.replace(**{"transducer.strain": "finite"})
    frame = ff.characterize(pad).expose(forces, rng=0)
    one, other = (ff.Reader(ff.characterize(design)).read(frame) for design in (pad, bent))
    np.testing.assert_allclose(other.forces, one.forces)
    added = np.sqrt(np.square(other.std) - np.square(one.std))
    np.testing.assert_allclose(added, strain_deviation(pad, one.forces), rtol=1e-4)
    assert other.status is ff.Status.OK


def test_skins_of_pads_are_of_small_strain() -> None:
    with pytest.raises(DesignError, match="small strain"):
        ff.load_sensor("pad-skin").replace(**{"transducer.strain": "finite"})
