"""Lamps that are not as bright as drawn, and cameras with less noise than stated."""

import numpy as np
import pytest

import fringeforce as ff

FRAMES = 12


def loads(rng: np.random.Generator) -> np.ndarray:
    """On some tactels, of which fringes are slow elsewhere."""
    normal = rng.uniform(0.3, 2, 11) * (rng.random(11) < 0.6)
    return np.stack([normal, normal * rng.uniform(-0.36, 0.36, 11)], axis=1)


@pytest.mark.parametrize(("amplitude", "noise"), [(245.0, 1.0), (245.0, 3.0), (157.0, 2.0)])
def test_noise_that_is_stated_too_large_hides_no_load(sensor, amplitude, noise) -> None:
    stated = sensor.replace(**{"camera.amplitude": amplitude})
    made = ff.characterize(stated.replace(**{"camera.noise": noise}))
    reader = ff.Reader(ff.characterize(stated))
    for seed in range(18, 18 + FRAMES):
        rng = np.random.default_rng([seed, 9])
        forces = loads(rng)
        reading = reader.search(made.expose(forces, rng=rng))
        assert reading.status is ff.Status.OK
        assert (np.abs(reading.forces - forces) < 4.5 * reading.std).all()


@pytest.mark.parametrize("share", [0.7, 0.8, 0.9, 1.15])
def test_a_lamp_of_another_brightness_is_named(sensor, share: float) -> None:
    drawn = sensor.replace(**{"camera.amplitude": 196})
    made = ff.characterize(sensor.replace(**{"camera.amplitude": share * 196}))
    reader = ff.Reader(ff.characterize(drawn))
    for seed in range(3):
        rng = np.random.default_rng([seed, 9])
        reading = reader.search(made.expose(loads(rng), rng=rng))
        assert reading.status is ff.Status.MODEL_MISMATCH
        words = reading.findings[0].split()
        assert words[:3] == ["The", "light", "seems"]
        assert float(words[3]) == pytest.approx(100 * abs(share - 1), abs=0.02 * 100)
        assert words[5] == ("brighter" if share > 1 else "dimmer")
