"""Channels with noise of their own, such as colours that the white balance amplifies."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binom, chi2

import fringeforce as ff
from fringeforce.base.errors import DesignError
from reading.exact_frames import Bench, drawing, loads

Array = NDArray[np.float64]

WAVES = "635 nm", "525 nm", "470 nm"
OWN = 3.0, 6.0, 12.0
"""Noise of the channels, grey levels."""
LIGHT = 200.0, 160.0, 205.0
SHARES = np.array([[0.92, 0.06, 0.02], [0.04, 0.90, 0.06], [0.03, 0.05, 0.92]])
FRAMES, CHANCE = 24, 1e-3


def design(*noise: float) -> ff.Sensor:
    """A strip under three LEDs, whose channels have this noise."""
    lights = [
        {"wavelength": wave, "amplitude": bright, "noise": own}
        for wave, bright, own in zip(WAVES, LIGHT, noise, strict=True)
    ]
    return drawing(
        **{
            "camera.pixels": 512,
            "camera.amplitude": 200.0,
            "camera.offset": 14.0,
            "tactels.contact_width": "0.2 mm",
            "polariscope.channels": lights,
            "polariscope.crosstalk": "5 +/- 2 %",
        }
    )


@pytest.fixture(scope="module")
def strip() -> Bench:
    """The same strip by the exact series."""
    sensor = design(*OWN)
    dark = np.full(3, sensor.camera.offset)
    places, widths = sensor.tactels.positions, np.full(11, 0.2e-3)
    return Bench(sensor, places, widths, shares=SHARES, light=(np.array(LIGHT), dark))


def distances(forces: Array, found: Array, covariance: Array) -> Array:
    """Squared distance of readings from the true forces in their covariances."""
    off = (found - forces).reshape(len(forces), -1, 1)
    return np.einsum("kij,kij->k", off, np.linalg.solve(covariance, off))


@pytest.mark.slow
def test_searched_frames_are_read_with_the_noise_of_every_channel(strip: Bench) -> None:
    rng = np.random.default_rng(3)
    forces = loads(rng, FRAMES)
    frames = strip.frames(forces, rng)
    low, high = chi2.ppf([CHANCE, 1 - CHANCE], forces.size)
    fewest, most = binom.ppf([CHANCE, 1 - CHANCE], forces.size, 0.95)
    for noise in (OWN, (6.0, 6.0, 6.0)):
        reader = ff.Reader(ff.characterize(design(*noise)))
        readings = [reader.search(frame) for frame in frames]
        found, covariance = (
            np.array([getattr(one, name) for one in readings]) for name in ("forces", "covariance")
        )
        total = distances(forces, found, covariance).sum()
        std = np.array([one.std for one in readings])
        inside = np.sum(np.abs(found - forces) < 1.96 * std)
        if noise == OWN:
            assert sum(one.ok for one in readings) >= FRAMES - binom.ppf(1 - CHANCE, FRAMES, 0.02)
            assert low < total < high
            assert fewest <= inside <= most
        else:  # one noise for all is too much for one channel and too little for another
            assert total > high
            assert inside < fewest
            assert not any(one.ok for one in readings)


def test_followed_frames_are_read_with_the_noise_of_every_channel(strip: Bench) -> None:
    rng = np.random.default_rng(9)
    forces = loads(rng, 1) * (1 + 0.2 * np.sin(np.linspace(0, 2, 20)))[:, None, None]
    reader = ff.Reader(ff.characterize(design(*OWN)))
    batch = reader.read_on(strip.frames(forces, rng), covariance=True)
    assert batch.tracked[1:].all()
    assert batch.covariance is not None
    far = distances(forces, batch.forces, batch.covariance)
    assert far.max() < chi2.ppf(1 - CHANCE / len(forces), forces[0].size)
    alone = reader.search(strip.frames(forces[-1:], rng)[0])
    np.testing.assert_allclose(batch.std[-1], alone.std, rtol=0.1)


@pytest.mark.slow
def test_a_skin_is_read_with_the_noise_of_every_channel() -> None:
    skin = design(*OWN).replace(**{"skin": {"extent": "11 mm"}})
    model, rng = ff.characterize(skin), np.random.default_rng(4)
    count, squared, contacts = 12, 0.0, 0
    for _ in range(count):
        press = ff.Press(x=rng.uniform(-3e-3, 3e-3), normal=rng.uniform(1, 2), width=1e-3)
        reading = ff.Reader(model).search(model.expose([press], rng=rng))
        (one,) = reading.contacts
        off = one.force - [press.normal, press.tangential]
        squared += off @ np.linalg.solve(one.force_covariance, off)
        contacts += 2
    low, high = chi2.ppf([CHANCE, 1 - CHANCE], contacts)
    assert low < squared < high


def test_frames_vary_by_the_noise_of_their_channel() -> None:
    model = ff.characterize(design(*OWN))
    frames = model.expose(np.zeros((200, 11, 2)), rng=1)
    expected = np.sqrt(np.square(OWN) / 3 + 1 / 12)
    np.testing.assert_allclose(frames.std(axis=0).mean(axis=1), expected, rtol=0.01)
    np.testing.assert_allclose(np.sqrt(np.unique(model.response.variance)), expected)


@pytest.mark.parametrize("noise", [0, -1, "loud"])
def test_a_channel_with_no_noise_is_refused_by_its_place(noise: object) -> None:
    with pytest.raises(DesignError, match=r"polariscope\.channels\.1\.noise"):
        design(*OWN).replace(**{"polariscope.channels.1.noise": noise})


def test_darkness_below_the_noise_of_its_channel_is_refused() -> None:
    with pytest.raises(DesignError, match="channel 2: offset = 14 is below the noise of 20"):
        design(*OWN).replace(**{"polariscope.channels.1.noise": 20.0})
