"""Every tactel's own place, and Poisson's ratio within its bounds."""

import numpy as np
import pytest
from benches import STRAIN_OPTIC, N, drawing, findings, lit, presses, shots
from scipy.stats import chi2 as chi_square

import fringeforce as ff
from fringeforce.calibration.design_entries import POSITIONS, units, values, varied
from fringeforce.calibration.design_jacobian import design_jacobian

pytestmark = pytest.mark.slow

NU = "transducer.compliant.poissons_ratio"


def test_all_places_are_differentiated_at_once_as_one_by_one() -> None:
    sensor, x = drawing(), np.linspace(-0.012, 0.012, 301)
    base = np.random.default_rng(51).normal(0, 0.05, N)
    jacobian = design_jacobian(sensor, (POSITIONS,), base)
    together = jacobian.at(x)[1:]
    step, size = 0.004, np.abs(together).max()
    for j in (0, 4, 10):
        ahead, behind = (
            ff.characterize(varied(sensor, (POSITIONS,), base + sign * step * np.eye(N)[j]))
            for sign in (1, -1)
        )
        alone = (ahead.influence(x) - behind.influence(x)).reshape(len(x), -1) / (2 * step)
        assert np.abs(alone - together[j]).max() < 0.01 * size
        elsewhere = np.delete(together[j].reshape(-1, N, 2), j, axis=1)
        assert not elsewhere.any()


def test_single_places_are_found_within_their_deviations() -> None:
    rng, sensor = np.random.default_rng(52), drawing()
    shifts = rng.normal(0, 0.08, N)
    true = lit(ff.characterize(varied(sensor, (POSITIONS,), shifts)), rng)
    forces = presses(rng, 8)
    model = ff.calibrate(sensor, shots(true, forces, rng), forces, [STRAIN_OPTIC, POSITIONS])
    found = findings(model)
    assert found.names[1] == "tactel 1 position"
    error = (found.values - np.r_[0.05, true.sensor.tactels.positions, 0.2e-3, 1.005])[1:12]
    np.testing.assert_array_equal(model.sensor.tactels.positions, found.values[1:12])
    # apart from the common shift, which is the camera's, places are known to micrometres
    assert np.abs(error - error.mean()).max() < 10e-6
    # presses may scatter by what frames do not tell: deviations may be too large, not too small
    square = error @ np.linalg.solve(found.covariance[1:12, 1:12], error)
    assert square < chi_square.ppf(1 - 1e-4, N)


def test_poisson_s_ratio_is_found_within_its_deviation() -> None:
    rng, sensor = np.random.default_rng(54), drawing()
    true = lit(ff.characterize(sensor.replace(**{NU: 0.46})), rng)
    forces = presses(rng, 8)
    found = findings(ff.calibrate(sensor, shots(true, forces, rng), forces, [STRAIN_OPTIC, NU]))
    assert abs(found.values[1] - 0.46) < 4 * found.std[1]
    assert found.std[1] < 0.01


@pytest.mark.parametrize("entry", [-9.0, -1.0, 0.3, 9.0])
@pytest.mark.parametrize("drawn", [-0.3, 0.2, 0.49])
def test_no_step_carries_poisson_s_ratio_out_of_its_bounds(entry: float, drawn: float) -> None:
    sensor = drawing().replace(**{NU: drawn})
    changed = varied(sensor, (NU,), np.array([entry]))
    ratio = changed.transducer.compliant.poissons_ratio
    assert -1 < ratio < 0.5
    assert (ratio > drawn) == (entry > 0)


def test_units_are_derivatives_of_values() -> None:
    sensor = drawing().replace(**{"transducer.photoelastic.poissons_ratio": -0.2})
    paths = (STRAIN_OPTIC, NU, "transducer.photoelastic.poissons_ratio", POSITIONS)
    at = np.random.default_rng(55).normal(0, 0.1, 3 + N)
    step = 1e-6 * np.eye(len(at))
    slopes = [(values(sensor, paths, at + s) - values(sensor, paths, at - s)) @ s for s in step]
    slopes = np.array(slopes) / 2e-12
    slopes[:3] /= values(sensor, paths, at)[:3]
    np.testing.assert_allclose(units(sensor, paths, at), slopes, rtol=1e-6)


def test_a_pitch_beside_single_places_is_refused() -> None:
    with pytest.raises(ff.FringeforceError, match="pitch"):
        ff.calibrate(
            drawing(), np.zeros((8, 512)), np.ones((8, N, 2)), [POSITIONS, "tactels.pitch"]
        )


def test_a_press_whose_force_was_written_wrongly_is_named() -> None:
    """One of 24 is a third too large; the others scatter by a hundredth, which nobody states."""
    rng, sensor = np.random.default_rng(56), drawing()
    model = ff.characterize(sensor.replace(**{STRAIN_OPTIC: 0.052}))
    places, normal = rng.uniform(-6e-3, 6e-3, 24), rng.uniform(1, 3, 24)
    shear = normal * rng.uniform(-0.4, 0.4, 24)
    pressed = [
        [
            ff.Press(
                x=x + rng.normal(0, 1e-4),
                normal=n * (1 + 0.01 * rng.standard_normal()),
                tangential=t,
                width=5e-4,
                profile="flat",
            )
        ]
        for x, n, t in zip(places, normal, shear, strict=True)
    ]
    normal[7] *= 1.33
    written = [
        [ff.Press(x=x, normal=n, tangential=t)]
        for x, n, t in zip(places, normal, shear, strict=True)
    ]
    # docs/gallery.md finds such a press while all usual parameters are estimated
    found = findings(ff.calibrate(sensor, model.expose(pressed, rng), written, [STRAIN_OPTIC]))
    assert found.outliers == (7,)
    assert abs(found.values[0] - 0.052) < 4 * found.std[0]
