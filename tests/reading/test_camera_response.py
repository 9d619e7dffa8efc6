"""Frames of cameras that encode light as webcams do, of sensors of every kind."""

import numpy as np
import pytest
from numpy.typing import NDArray

import fringeforce as ff
from fringeforce.optics.camera import decoded, encoded, encoded_slope
from fringeforce.reading.frame_order import ENCODED
from fringeforce.reading.pads.light import Curve

GREY = 255.0
PRESSES = [
    ff.Press(x=-2e-3, y=1e-3, normal=1.2, tangential=(0.2, -0.1), radius=1e-3),
    ff.Press(x=3e-3, y=-2e-3, normal=0.8, radius=1e-3),
]


def srgb(levels: NDArray[np.floating]) -> NDArray[np.float64]:
    """IEC 61966-2-1 from a table of 8 bits: of which code light is the nearest, between codes."""
    code = np.arange(256) / 255
    light = np.where(code < 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
    return GREY * np.interp(np.clip(levels / GREY, 0, 1), light, code)


def exposed(model, loads, rng) -> NDArray[np.float64]:
    """A frame that a webcam makes of the light, with noise behind the encoding."""
    camera = model.sensor.camera
    light = camera.amplitude * np.asarray(model.intensity(loads)) + camera.offset
    noisy = srgb(light) + rng.uniform(-camera.noise, camera.noise, light.shape)
    return np.clip(np.round(noisy), 0, GREY)


@pytest.mark.parametrize("response", ["linear", "sRGB", "0.45"])
def test_light_is_found_from_levels_and_slopes_are_those_of_differences(response: str) -> None:
    light = np.geomspace(1e-4, 1, 300)
    light = light[np.abs(light / 0.0031308 - 1) > 0.01]  # sRGB has an edge there
    np.testing.assert_allclose(decoded(encoded(light, response), response), light, rtol=1e-7)
    step = 1e-6 * light
    steep = (encoded(light + step, response) - encoded(light - step, response)) / (2 * step)
    np.testing.assert_allclose(encoded_slope(light, response), steep, rtol=1e-6)


def test_levels_are_those_of_the_standard() -> None:
    """Codes of a linear share of 0.18, 0.5 and 0.214 as tables of sRGB state them."""
    np.testing.assert_allclose(
        encoded([0.18, 0.5, 0.21404114], "sRGB"), [0.46135613, 0.73535698, 0.5], atol=1e-7
    )


@pytest.mark.parametrize("power", [1.0, 0.9])
def test_a_curve_knows_its_derivatives_and_its_inverse(power: float) -> None:
    curve, other = Curve("sRGB", power, GREY), Curve("sRGB", power + 1e-6, GREY)
    linear = np.linspace(3, 250, 200)
    steep = (curve.level(linear + 1e-4) - curve.level(linear - 1e-4)) / 2e-4
    np.testing.assert_allclose(curve.slope(linear), steep, rtol=1e-5)
    by_power = (other.level(linear) - curve.level(linear)) / 1e-6
    np.testing.assert_allclose(curve.by_power(linear), by_power, rtol=1e-4)
    np.testing.assert_allclose(curve.linear(curve.level(linear)), linear, rtol=1e-9)


@pytest.mark.parametrize("name", ["saad", "pad", "pad-skin"])
def test_frames_of_a_webcam_are_read_or_the_response_is_named(name: str) -> None:
    """The gamma of which a tolerance allows is that behind the response."""
    rng, drawn = np.random.default_rng(3), ff.load_sensor(name)
    right = {"camera.response": "sRGB", "camera.gamma": "1 +/- 0.02"}
    webcam, linear = ff.characterize(drawn.replace(**right)), ff.characterize(drawn)
    forces = np.zeros((drawn.tactels.total, len(drawn.components)))
    forces[:, 0] = rng.uniform(0.2, 1, len(forces))
    forces[:, 1] = 0.2 * forces[:, 0]
    of_skin = drawn.skin is not None
    frame = exposed(linear, PRESSES if of_skin else forces, rng)
    reading = ff.Reader(webcam).search(frame)
    assert reading.ok
    if of_skin:
        truth = np.array([press.normal for press in PRESSES])
        found = np.array([contact.force[0] for contact in reading.contacts])
        deviations = np.array([np.sqrt(contact.covariance[0, 0]) for contact in reading.contacts])
        assert (np.abs(found - truth) < 5 * deviations).all()
    else:
        off = (reading.forces - forces).ravel()
        distance = off @ np.linalg.solve(reading.covariance, off) / off.size
        assert 0.5 < distance < 1.6
    refused = ff.Reader(linear).search(frame)
    assert refused.status is ff.Status.MODEL_MISMATCH
    assert refused.findings == (ENCODED.format(response="sRGB"),)


@pytest.mark.parametrize("name", ["saad", "pad"])
def test_frames_of_a_linear_camera_that_is_drawn_as_a_webcam_are_named(name: str) -> None:
    drawn = ff.load_sensor(name)
    loads = np.zeros((drawn.tactels.total, len(drawn.components)))
    loads[3, 0] = 1.0
    frame = ff.characterize(drawn).expose(loads, rng=0)
    webcam = ff.Reader(ff.characterize(drawn.replace(**{"camera.response": "sRGB"})))
    reading = webcam.search(frame)
    assert reading.status is ff.Status.MODEL_MISMATCH
    assert reading.findings == (ENCODED.format(response="linear"),)
