"""What real light and real cameras do, against spectra, standards and closed forms."""

import numpy as np
import pytest
from scipy.integrate import quad, quad_vec
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import root_scalar

import fringeforce as ff
from fringeforce.design.light import Channel, Plates, Polariscope
from fringeforce.models.imaging import designed_response
from fringeforce.optics.area_camera import pictures as pad_pictures
from fringeforce.optics.camera import blurred, encoded, expose
from fringeforce.optics.jones import Fringe
from fringeforce.optics.polariscope import pictures, wave_number_spread

WAVELENGTH = 632.8e-9


@pytest.mark.parametrize("bandwidth", [2e-9, 20e-9, 60e-9])
@pytest.mark.parametrize("bias", [0.0, 90.0])
def test_a_spectrum_takes_the_contrast_that_its_integral_takes(
    bandwidth: float, bias: float
) -> None:
    light = Polariscope(wavelength=WAVELENGTH, bandwidth=bandwidth, channels=(Channel(bias=bias),))
    phase = np.linspace(-40, 40, 81)
    found = pictures(light)[0].fringe.intensity(phase)
    # a Gaussian of 1 / wavelength whose width at half maximum is measured in wavelength
    centre = 1 / WAVELENGTH

    def half_width(deviation: float) -> float:
        reach = np.sqrt(2 * np.log(2)) * deviation
        return 1 / (centre - reach) - 1 / (centre + reach) - bandwidth

    deviation = float(root_scalar(half_width, bracket=(1e-6 * centre, 0.3 * centre)).root)

    def spectrum(k: float) -> float:
        return float(np.exp(-(((k - centre) / deviation) ** 2) / 2))

    ends = centre - 9 * deviation, centre + 9 * deviation
    lit, _ = quad_vec(
        lambda k: spectrum(k) * np.sin((phase * k / centre + np.radians(bias)) / 2) ** 2, *ends
    )
    whole, _ = quad(spectrum, *ends)
    np.testing.assert_allclose(found, lit / whole, atol=1e-8)


def test_a_spectrum_that_is_gaussian_in_wavelength_differs_little() -> None:
    bandwidth, phase = 20e-9, np.linspace(0, 20, 41)
    deviation = bandwidth / np.sqrt(8 * np.log(2))
    wavelengths = WAVELENGTH + deviation * np.linspace(-8, 8, 4001)
    weight = np.exp(-(((wavelengths - WAVELENGTH) / deviation) ** 2) / 2)
    lit = np.sin(phase[:, None] * WAVELENGTH / wavelengths / 2) ** 2 @ weight / weight.sum()
    found = Fringe(spread=wave_number_spread(bandwidth, WAVELENGTH)).intensity(phase)
    assert np.abs(found - lit).max() < 0.002


def test_light_of_a_band_that_meets_a_turned_retarder_is_the_mean_over_the_band() -> None:
    fringe = Fringe(bias=0.7, spread=0.02)
    lead, cross = np.linspace(-20, 20, 41), np.linspace(3, -5, 41)
    share, weight = np.polynomial.hermite_e.hermegauss(60)
    single = Fringe(bias=0.7)
    each = [single.turned(lead * (1 + 0.02 * s), cross * (1 + 0.02 * s)) for s in share]
    expected = np.tensordot(weight / weight.sum(), each, axes=1)
    np.testing.assert_allclose(fringe.turned(lead, cross), expected, atol=1e-10)


@pytest.mark.parametrize("plates", [None, Plates(retardance_error=4.0, extinction_ratio=0.01)])
def test_visibility_is_that_of_brightest_and_darkest(plates: Plates | None) -> None:
    phase = np.linspace(0, 4 * np.pi, 100_001)
    full, part = (
        pictures(Polariscope(wavelength=WAVELENGTH, visibility=v, plates=plates))[
            0
        ].fringe.intensity(phase)
        for v in (1.0, 0.9)
    )

    def michelson(light: np.ndarray) -> float:
        return (light.max() - light.min()) / (light.max() + light.min())

    assert michelson(part) == pytest.approx(0.9 * michelson(full), abs=1e-6)
    assert part.mean() == pytest.approx(full.mean(), abs=1e-6)


def test_readings_know_the_visibility(sensor: ff.Sensor, model: ff.SensorModel) -> None:
    dull = sensor.replace(**{"polariscope.visibility": 0.8})
    phase = np.linspace(0, 7, dull.camera.pixels)
    level = designed_response(dull, pictures(dull.polariscope)).level(phase)
    np.testing.assert_allclose(level, 245 * (1 - 0.8 * np.cos(phase)) / 2 + 5, rtol=1e-12)
    known = ff.characterize(dull)
    forces = ff.polar(1.0, angle=10, n=11)
    frame = known.expose(forces, rng=3)
    reading = ff.Reader(known).read(frame)
    assert reading.status is ff.Status.OK
    off = (reading.forces - forces).ravel()
    assert off @ np.linalg.solve(reading.covariance, off) < 61  # chi-square, 22: one in 2e5
    assert ff.Reader(model).read(frame).status is not ff.Status.OK


def test_a_pads_light_that_lost_its_polarisation_is_grey() -> None:
    pad = ff.load_sensor("pad")
    sharp, dull = pad_pictures(pad), pad_pictures(pad.replace(**{"polariscope.visibility": 0.9}))
    rng = np.random.default_rng()
    light = rng.normal(size=(3, 50))
    light /= np.linalg.norm(light, axis=0)
    for one, other in zip(sharp, dull, strict=True):
        before = np.einsum("ip,kij,jp->kp", light, one.forms, light)
        after = np.einsum("ip,kij,jp->kp", light, other.forms, light)
        np.testing.assert_allclose(after, 0.9 * before + 0.05, rtol=1e-12)


def test_srgb_is_that_of_the_standard() -> None:
    # IEC 61966-2-1: the linear part ends at 0.0031308, encoded 0.04045; decoding is its inverse,
    # ((v + 0.055) / 1.055)^2.4, and well-known pairs of 8 bits: 188 is half the light,
    # 118 the grey card's 18 %
    assert encoded(0.0031308, "sRGB") == pytest.approx(0.04045, abs=1e-6)
    assert (255 * encoded([0.5, 0.18, 0.0, 1.0], "sRGB")).round().tolist() == [188, 118, 0, 255]
    value = np.linspace(0, 1, 1001)
    decoded = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(encoded(decoded, "sRGB"), value, atol=1e-6)


def test_a_gamma_is_a_power_of_the_share_of_full_scale(sensor: ff.Sensor) -> None:
    camera = sensor.camera.model_copy(update={"response": "0.45", "noise": 0.0})
    light = np.linspace(0, 1, 501)
    expected = 255 * ((245 * light + 5) / 255) ** 0.45
    assert np.abs(expose(camera, light) - expected).max() <= 0.5 + 1e-9
    linear = camera.model_copy(update={"response": "1"})
    plain = camera.model_copy(update={"response": "linear"})
    np.testing.assert_array_equal(expose(linear, light), expose(plain, light))


@pytest.mark.parametrize("deviation", [0.2, 0.7, 1.0, 4.0, 12.0])
@pytest.mark.parametrize("period", [30.0, 80.0])
def test_blur_damps_a_wave_as_the_transform_of_a_gaussian_says(
    deviation: float, period: float
) -> None:
    k = 2 * np.pi / period
    wave = 0.5 + 0.5 * np.sin(k * np.arange(1000))
    found = blurred(wave, deviation)[200:-200]
    expected = 0.5 + 0.5 * np.exp(-((k * deviation) ** 2) / 2) * np.sin(k * np.arange(1000))
    np.testing.assert_allclose(found, expected[200:-200], atol=1e-4 if deviation < 1 else 1e-8)


def test_blur_is_that_of_another_library() -> None:
    light = np.random.default_rng().uniform(size=(3, 2, 400))
    expected = gaussian_filter1d(light, 5.0, mode="nearest", truncate=8)
    np.testing.assert_allclose(blurred(light, 5.0), expected, atol=1e-12)


def test_a_sensors_blur_is_in_metres_on_the_strip(sensor: ff.Sensor) -> None:
    pitch = 25e-3 / 2048
    model = ff.characterize(sensor.replace(**{"camera.blur": 8 * pitch}))
    sharp = ff.characterize(sensor)
    forces = ff.polar(1.0, angle=10, n=11)
    expected = gaussian_filter1d(sharp.intensity(forces), 8.0, mode="nearest", truncate=8)
    np.testing.assert_allclose(model.intensity(forces), expected, atol=1e-12)


def test_light_drifts_from_frame_to_frame_and_not_within(sensor: ff.Sensor) -> None:
    changes = {"camera.drift": "2 %", "camera.noise": 0.0, "camera.bits": 16}
    camera = sensor.replace(**changes, **{"camera.amplitude": 50_000, "camera.offset": 0}).camera
    frames = expose(camera, np.ones((4000, 2, 3)), frame_axes=2).astype(float)
    assert np.ptp(frames, axis=(1, 2)).max() == 0
    gain = frames[:, 0, 0] / 50_000 - 1
    # standard error of a mean is s / sqrt(n), that of a deviation s / sqrt(2 n)
    assert abs(gain.mean()) < 5 * 0.02 / np.sqrt(4000)
    assert abs(gain.std() - 0.02) < 5 * 0.02 / np.sqrt(8000)
    one = expose(camera, np.ones((2, 3)))
    assert np.ptp(one) == 0
