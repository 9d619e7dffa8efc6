"""Sensors that are drawn from tolerances scatter as the tolerances say."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import fringeforce as ff
from fringeforce.design.tolerances import number_at
from fringeforce.mechanics import fourier
from fringeforce.models.as_built import Contacts, drawn, smooth_field
from fringeforce.models.imaging import Imaging
from fringeforce.models.pad import characterize_pad
from fringeforce.optics.photoelasticity import stress_optic_constant

DRAWS = 400
RARE = 1e-6
"""Chance at which a test of a distribution fails although it is right."""


@pytest.fixture(scope="module")
def drawing(sensor: ff.Sensor) -> ff.Sensor:
    return sensor.replace(
        **{
            "transducer.edges": "roller",
            "transducer.compliant.thickness": "0.50 +/- 0.02 mm",
            "transducer.compliant.youngs_modulus": "11 MPa +/- 5 %",
            "transducer.photoelastic.poissons_ratio": "0.42 +/- 0.01",
            "tactels.placement": "0.02 +/- 0.1 mm",
            "tactels.contact_width": "0.4 +/- 0.2 mm",
            "polariscope.wavelength": "632.8 +/- 1 nm",
            "polariscope.visibility": "0.97 +/- 0.02",
            "polariscope.residual": "0.03 +/- 0.1 rad",
            "camera.amplitude": "237 +/- 2 %",
            "camera.blur": "12 +/- 4 um",
            "camera.noise": 2.0,
        }
    )


@pytest.fixture(scope="module")
def real(drawing: ff.Sensor) -> ff.BuiltSensor:
    return ff.characterize(drawing).as_built()


def _is_normal(values: np.ndarray, mean: float, std: float) -> bool:
    return stats.kstest(values, stats.norm(mean, std).cdf).pvalue > RARE


def _value(design: ff.Sensor, path: str) -> float:
    found = number_at(design, path)
    assert found is not None
    return found[0]


@pytest.mark.parametrize(
    "path",
    [
        "transducer.compliant.thickness",
        "transducer.compliant.youngs_modulus",
        "transducer.photoelastic.poissons_ratio",
        "polariscope.wavelength",
        "camera.amplitude",
    ],
)
def test_drawn_values_are_normal_about_the_drawing(drawing: ff.Sensor, path: str) -> None:
    generator = np.random.default_rng()
    values = np.array([_value(drawn(drawing, generator), path) for _ in range(DRAWS)])
    assert _is_normal(values, _value(drawing, path), drawing.tolerances[path])


def test_a_value_at_its_limit_is_drawn_within(drawing: ff.Sensor) -> None:
    generator = np.random.default_rng()
    values = [drawn(drawing, generator).polariscope.visibility for _ in range(DRAWS)]
    cut = stats.truncnorm((0 - 0.97) / 0.02, (1 - 0.97) / 0.02, 0.97, 0.02)
    assert stats.kstest(values, cut.cdf).pvalue > RARE
    assert max(values) <= 1


def test_values_are_drawn_independently_and_others_stay(drawing: ff.Sensor) -> None:
    generator = np.random.default_rng()
    designs = [drawn(drawing, generator) for _ in range(DRAWS)]
    thickness = [design.transducer.compliant.thickness for design in designs]
    modulus = [design.transducer.compliant.youngs_modulus for design in designs]
    # Fisher's transform of the correlation of independent draws is normal
    together = np.arctanh(np.corrcoef(thickness, modulus)[0, 1]) * np.sqrt(DRAWS - 3)
    assert 2 * stats.norm.sf(abs(together)) > RARE
    assert all(design.transducer.length == drawing.transducer.length for design in designs)
    assert not any(design.tolerances for design in designs)


def test_list_entries_are_drawn_one_by_one(sensor: ff.Sensor) -> None:
    places = [f"{x} +/- 0.01 mm" for x in range(-5, 6)]
    design = sensor.replace(
        **{"tactels.positions": places, "polariscope.channels": [{}, {"bias": "90 +/- 2"}]}
    )
    generator = np.random.default_rng()
    made = [drawn(design, generator) for _ in range(100)]
    moved = np.array([one.tactels.positions for one in made]) - design.tactels.positions
    assert _is_normal(moved.ravel(), 0, 0.01e-3)
    biases = np.array([one.polariscope.channels[1].bias for one in made])
    assert _is_normal(biases, 90, 2)


def test_the_residual_is_a_smooth_field_of_the_stated_size() -> None:
    generator, length = np.random.default_rng(), 5e-3
    x = np.linspace(-12.5e-3, 12.5e-3, 51)
    fields = np.array([smooth_field(x, length, generator) for _ in range(4000)])
    wanted = np.exp(-(((x[:, None] - x) / length) ** 2) / 2)
    # standard error of a covariance of unit variances, at most sqrt(2 / n)
    assert np.abs(fields.T @ fields / len(fields) - wanted).max() < 6 * np.sqrt(2 / len(fields))
    assert np.abs(fields.mean(axis=0)).max() < 6 / np.sqrt(len(fields))


def test_contacts_scatter_anew_about_every_tactel(real: ff.BuiltSensor) -> None:
    contacts = real.contacts(500)
    assert contacts.centres.shape == contacts.widths.shape == (500, 11)
    beside = contacts.centres - real.model.sensor.tactels.positions
    assert _is_normal(beside.ravel(), 0.02e-3, 0.1e-3)
    cut = stats.truncnorm(-2, np.inf, 0.4e-3, 0.2e-3)
    assert stats.kstest(contacts.widths.ravel(), cut.cdf).pvalue > RARE


def test_the_phase_of_drawn_contacts_is_that_of_the_exact_series(real: ff.BuiltSensor) -> None:
    rng = np.random.default_rng()
    forces, contacts = rng.normal(size=(4, 11, 2)), real.contacts(4, rng)
    strip, x = real.model.sensor.transducer, real.model.pixel_positions
    nodes, weights = np.polynomial.legendre.leggauss(16)
    constant = stress_optic_constant(strip.photoelastic, real.model.sensor.polariscope.wavelength)
    found = real.phase(forces, contacts)
    for number, load in enumerate(forces):
        centres, widths = contacts.centres[number], contacts.widths[number]
        places = centres[:, None] + widths[:, None] / 2 * nodes
        lines = fourier.integrated_stress(strip, places.ravel(), x, 400)
        each = lines.reshape(len(x), 11, 16, 2)
        exact = 2 * constant * np.einsum("mcqt,q,ct->m", each, weights / 2, load)
        off = np.abs(found[number] - real.residual - exact).max()
        assert off < 2e-4 * np.abs(exact).max()


def test_contacts_of_ones_own_may_lie_anywhere_on_the_strip(sensor: ff.Sensor) -> None:
    model = ff.characterize(sensor.replace(**{"camera.noise": 2.0}))
    real = model.as_built(0)
    tactels, line = sensor.tactels.positions, np.zeros(11)
    forces = ff.polar(1.0, angle=10, n=11)
    same = real.phase(forces, Contacts(tactels, line))
    np.testing.assert_allclose(same, model.phase(forces), atol=2e-3)
    elsewhere = ff.characterize(sensor.replace(**{"tactels.positions": tactels + 5e-3}))
    moved = real.phase(forces, Contacts(tactels + 5e-3, line))
    np.testing.assert_allclose(moved, elsewhere.phase(forces), atol=2e-3)


def test_a_sensor_without_tolerances_is_built_as_drawn(model: ff.SensorModel) -> None:
    forces = [ff.polar(1.0, angle=10, n=11)] * 3
    expected = model.expose(forces, rng=7)
    np.testing.assert_array_equal(model.as_built(1).expose(forces, rng=7), expected)
    np.testing.assert_array_equal(model.expose(forces, rng=7, as_built=1), expected)


def test_one_seed_is_one_sensor_and_the_noise_is_apart(drawing: ff.Sensor) -> None:
    model, forces = ff.characterize(drawing), ff.polar(1.0, angle=10, n=11)
    first = model.as_built(5)
    np.testing.assert_array_equal(model.expose(forces, 1, as_built=5), first.expose(forces, 1))
    assert (first.expose(forces, 1) != first.expose(forces, 2)).any()
    other = model.as_built(6)
    assert first.model.sensor != other.model.sensor
    assert np.abs(first.residual - other.residual).max() > 0.01
    known = first.contacts(rng=3)
    frames = [first.expose(forces, rng, contacts=known).astype(float) for rng in (1, 2)]
    # uniform noise of a half width of 2, twice, and rounding
    assert np.abs(frames[0] - frames[1]).max() <= 5


def test_frames_of_a_built_sensor_follow_its_own_design(sensor: ff.Sensor) -> None:
    design = sensor.replace(
        **{
            "camera.noise": 0.0,
            "camera.amplitude": "200 +/- 5 %",
            "polariscope.visibility": "0.9 +/- 0.02",
            "transducer.photoelastic.strain_optic_coefficient": "0.05 +/- 3 %",
        }
    )
    real = ff.characterize(design).as_built()
    own, forces = real.model.sensor, ff.polar(1.0, angle=10, n=11)
    ratio = own.transducer.photoelastic.strain_optic_coefficient / 0.05
    phase = ratio * ff.characterize(design).phase(forces)
    visibility = own.polariscope.visibility
    level = own.camera.amplitude * (1 - visibility * np.cos(phase)) / 2 + 5
    assert np.abs(real.expose(forces) - level).max() < 0.5 + 1e-6


def test_a_built_sensor_looks_elsewhere_than_a_drawing_that_was_used(sensor: ff.Sensor) -> None:
    model = ff.characterize(
        sensor.replace(**{"camera.shift": "0 +/- 0.1 mm", "camera.scale": "1 +/- 1 %"})
    )
    before, real = model.sensor.pixel_positions, model.as_built(rng=3).model
    camera = real.sensor.camera
    assert camera.shift != 0.0
    assert camera.scale != 1.0
    wanted = camera.scale * before + camera.shift
    np.testing.assert_allclose(real.sensor.pixel_positions, wanted, atol=1e-12)
    moved = ff.characterize(sensor.replace(camera=camera))
    forces = ff.polar(1.0, 10.0, n=sensor.tactels.count)
    np.testing.assert_allclose(real.phase(forces), moved.phase(forces), atol=1e-9)


def test_readings_know_the_width_and_the_place_of_contacts(sensor: ff.Sensor) -> None:
    changes = {"tactels.contact_width": "0.8 mm", "tactels.placement": "0.05 mm"}
    wide = sensor.replace(**{"transducer.edges": "roller"}, **changes)
    model, forces = ff.characterize(wide), ff.polar(1.0, angle=10, n=11)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    places = wide.tactels.positions[:, None] + 0.05e-3 + 0.4e-3 * nodes
    lines = fourier.integrated_stress(wide.transducer, places.ravel(), wide.pixel_positions)
    constant = stress_optic_constant(wide.transducer.photoelastic, wide.polariscope.wavelength)
    each = lines.reshape(-1, 11, 20, 2)
    phase = 2 * constant * np.einsum("mcqt,q,ct->m", each, weights / 2, forces)
    reading = ff.Reader(model).read(model.delivered(phase, rng=0))
    assert reading.status is ff.Status.OK
    off = (reading.forces - forces).ravel()
    assert off @ np.linalg.solve(reading.covariance, off) < stats.chi2(22).isf(RARE)


def test_a_residual_shows_without_load(sensor: ff.Sensor) -> None:
    design = sensor.replace(**{"camera.noise": 0.0, "polariscope.residual": "0.5 rad"})
    frame = ff.characterize(design).expose(np.zeros((11, 2)))
    assert (frame == round(245 * np.sin(0.25) ** 2 + 5)).all()


def test_several_channels_share_the_residual_by_their_wavelength(sensor: ff.Sensor) -> None:
    channels = [{"bias": 0}, {"bias": 90, "wavelength": "316.4 nm"}]
    changes = {"polariscope.channels": channels, "polariscope.residual": "0.5 +/- 0.1 rad"}
    real = ff.characterize(sensor.replace(**changes, **{"camera.noise": 0.0})).as_built(2)
    frame = real.expose(np.zeros((11, 2)))
    second = 245 * np.sin((2 * real.residual + np.pi / 2) / 2) ** 2 + 5
    assert np.abs(frame[1] - second).max() < 0.5 + 1e-6


def test_a_calibrated_model_is_of_one_sensor_already(model: ff.SensorModel) -> None:
    pixels = len(model.pixel_positions)
    seen = Imaging.known(model.pixel_positions, np.full(pixels, 245.0), np.full(pixels, 5.0))
    with pytest.raises(ff.FringeforceError, match="one sensor already"):
        replace(model, imaging=seen).as_built(0)


@pytest.mark.slow
def test_a_pads_light_and_lens_are_drawn() -> None:
    pad = ff.load_sensor("pad").replace(
        **{
            "tactels.count": [2, 2],
            "transducer.sides": "roller",
            "camera.pixels": [24, 24],
            "camera.blur": "100 +/- 20 um",
            "camera.amplitude": "200 +/- 3",
        }
    )
    model = characterize_pad(pad, samples=8, slices=4)
    real = model.as_built(0)
    np.testing.assert_array_equal(real.model.slices(np.ones((4, 3))), model.slices(np.ones((4, 3))))
    assert real.model.sensor.camera.blur != pad.camera.blur
    forces = np.tile([1.0, 0.1, 0.0], (4, 1))
    np.testing.assert_array_equal(
        real.expose(forces, rng=1), model.expose(forces, rng=1, as_built=0)
    )
