"""Stress to phase to light to grey levels, each against its law."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fringeforce as ff
from fringeforce.design import Camera
from fringeforce.optics.camera import expose, noise_variance
from fringeforce.optics.photoelasticity import stress_optic_constant
from fringeforce.optics.polariscope import intensity


def camera(**changes: object) -> Camera:
    plain = {"pixels": 8, "bits": 8, "amplitude": 200.0, "offset": 20.0, "noise": 5.0}
    return Camera.model_validate(plain | changes)


def test_the_stress_optic_constant_of_the_paper(sensor: ff.Sensor) -> None:
    found = stress_optic_constant(sensor.transducer.photoelastic, sensor.polariscope.wavelength)
    assert found == pytest.approx(6.409e-3, rel=1e-4)


@given(st.floats(-100, 100))
def test_intensity_is_even_and_periodic(phase: float) -> None:
    assert intensity(phase) == pytest.approx(intensity(-phase), abs=1e-12)
    assert intensity(phase) == pytest.approx(intensity(phase + 2 * np.pi), abs=1e-12)
    assert 0 <= intensity(phase) <= 1


def test_intensity_is_dark_at_even_and_bright_at_odd_multiples() -> None:
    np.testing.assert_allclose(
        intensity(np.pi * np.arange(-3, 4)), [1, 0, 1, 0, 1, 0, 1], atol=1e-15
    )


@pytest.mark.parametrize("bits", range(1, 17))
def test_grey_levels_stay_within_the_converter(bits: int) -> None:
    full = 2**bits - 1
    silent = camera(bits=bits, amplitude=float(full), offset=0.0, noise=0.0)
    frame = expose(silent, np.linspace(0, 1, 501), rng=0)
    assert frame.dtype == (np.uint8 if bits <= 8 else np.uint16)
    assert (frame.min(), frame.max()) == (0, full)


def test_noise_beyond_the_converter_is_clipped() -> None:
    loud = camera(amplitude=235.0, offset=20.0, noise=20.0, noise_model="gaussian")
    frame = expose(loud, np.array([[0.0, 1.0]] * 2000), rng=0)
    assert (frame[:, 0] == 0).mean() == pytest.approx(0.16, abs=0.04)
    assert (frame[:, 1] == 255).mean() == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("model", ["uniform", "gaussian"])
@pytest.mark.parametrize("noise", [0.7, 5.0])
def test_the_variance_is_that_of_noise_and_rounding(model: str, noise: float) -> None:
    loud = camera(noise=noise, noise_model=model)
    light = np.random.default_rng(0).uniform(0.2, 0.8, 200_000)
    frame = expose(loud, light, rng=1)
    found = np.var(frame - (200 * light + 20))
    assert found == pytest.approx(noise_variance(loud), rel=0.02)
    width = noise / np.sqrt(3) if model == "uniform" else noise
    assert noise_variance(loud) == pytest.approx(width**2 + 1 / 12)


def test_uniform_noise_has_its_half_width_and_no_bias() -> None:
    frame = expose(camera(), np.full(100_000, 0.5), rng=2).astype(float)
    assert (frame.min(), frame.max()) == (115, 125)
    assert frame.mean() == pytest.approx(120, abs=0.05)


def test_light_that_is_no_number_is_refused() -> None:
    with pytest.raises(ff.FringeforceError, match="not finite"):
        expose(camera(), [0.5, np.nan])
