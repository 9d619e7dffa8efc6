"""LEDs by name: the design that they stand for, and the contrast that their spectra leave."""

import numpy as np
import pytest
from scipy.integrate import quad, quad_vec
from scipy.optimize import root_scalar
from typer.testing import CliRunner

import fringeforce as ff
from fringeforce.base.errors import DesignError
from fringeforce.cli import app
from fringeforce.design.files import parse_sensor
from fringeforce.design.light import Channel, Polariscope
from fringeforce.design.light_sources import light_sources
from fringeforce.optics.polariscope import pictures

PUBLISHED = {  # TAOS046, notes 4 to 7 on test light: peak and half-width [nm]
    "blue LED": (470, 35),
    "green LED": (524, 47),
    "yellow-green LED": (565, 28),
    "red LED": (635, 17),
}
PHASE = np.linspace(-6 * np.pi, 6 * np.pi, 97)
every = pytest.mark.parametrize(("name", "published"), PUBLISHED.items())


@pytest.fixture(scope="module")
def saad() -> ff.Sensor:
    return ff.load_sensor("saad")


def numbers(name: str) -> dict[str, str]:
    """What a person would write without the table."""
    peak, width = PUBLISHED[name]
    return {"wavelength": f"{peak} nm", "bandwidth": f"{width} nm"}


def test_the_table_has_the_published_lights_and_their_source() -> None:
    assert light_sources().keys() == PUBLISHED.keys()
    assert all("TAOS046" in one.source for one in light_sources().values())


@every
def test_a_design_with_a_name_equals_the_design_with_its_numbers(saad, name, published) -> None:
    text = saad.to_toml()
    line = 'wavelength = "632.8 nm"'
    assert line in text
    said = parse_sensor(text.replace(line, f'wavelength = "{name}"'))
    stated = "\n".join(f'{key} = "{value}"' for key, value in numbers(name).items())
    assert said == parse_sensor(text.replace(line, stated))
    assert said == saad.replace(**{"polariscope.wavelength": name})
    assert said == saad.replace(polariscope={"wavelength": name})
    assert (said.polariscope.wavelength, said.polariscope.bandwidth) == pytest.approx(
        np.array(published) * 1e-9
    )
    assert parse_sensor(said.to_toml()) == said


def test_each_channel_may_name_its_own_light(saad) -> None:
    names = list(PUBLISHED)
    made, same = (
        saad.replace(
            **{
                "polariscope.wavelength": "red LED",
                "polariscope.channels": [{**one, "bias": 90} for one in channels],
            }
        )
        for channels in ([{"wavelength": name} for name in names], map(numbers, names))
    )
    assert made == same
    assert parse_sensor(made.to_toml()) == made
    model, other = ff.characterize(made), ff.characterize(same)
    forces = ff.polar(1.0, angle=10, n=11)
    np.testing.assert_array_equal(model.intensity(forces), other.intensity(forces))
    for number, name in enumerate(names):
        alone = saad.replace(
            **{
                "polariscope.wavelength": name,
                "polariscope.channels": [{"bias": 90}],
            }
        )
        # the strain-optic coefficient is that of all wavelengths
        np.testing.assert_allclose(
            model.intensity(forces)[number],
            np.squeeze(ff.characterize(alone).intensity(forces)),
            atol=1e-9,
        )


def test_what_is_stated_counts_before_the_table(saad) -> None:
    filtered = {"polariscope.bandwidth": "10 nm", "polariscope.wavelength": "green LED"}
    assert saad.replace(**filtered).polariscope.bandwidth == pytest.approx(10e-9)
    ideal = Polariscope.model_validate({"wavelength": "green LED", "bandwidth": 0.0})
    assert ideal == Polariscope(wavelength=524e-9)
    # a name that is changed to brings its own bandwidth
    changed = saad.replace(**filtered).replace(**{"polariscope.wavelength": "red LED"})
    assert changed.polariscope.bandwidth == pytest.approx(17e-9)
    nested = saad.replace(**filtered).replace(polariscope={"wavelength": "red LED"})
    assert nested == changed


def test_a_channel_without_bandwidth_has_that_of_the_polariscope() -> None:
    light = Polariscope(
        wavelength=635e-9,
        bandwidth=17e-9,
        channels=(Channel(), Channel(bandwidth=0.0), Channel(bandwidth=34e-9)),
    )
    same, none, twice = (one.fringe.spread for one in pictures(light))
    assert none == 0
    assert twice / same == pytest.approx(2, rel=1e-3)


def test_fringe_values_count_at_the_wavelength_of_the_light(saad) -> None:
    stated = saad.replace(
        **{
            "polariscope.wavelength": "yellow-green LED",
            "transducer.photoelastic.fringe_value": "7 N/mm",
        }
    )
    assert stated.transducer.photoelastic.stress_optic == pytest.approx(565e-9 / 7e3)


def test_pads_take_the_wavelength() -> None:
    pad = ff.load_sensor("pad")
    made = pad.replace(**{"polariscope.wavelength": "red LED"})
    assert made == pad.replace(**{"polariscope.wavelength": "635 nm"})
    assert parse_sensor(made.to_toml()) == made


@pytest.mark.parametrize("kind", ["saad", "pad"])
def test_an_unknown_name_lists_those_that_are_known(kind) -> None:
    design = ff.load_sensor(kind)
    for change in (
        {"polariscope.wavelength": "rde LED"},
        {"polariscope.channels": [{"wavelength": "rde LED"}]},
        {"polariscope.wavelength": "rde LED", "transducer.photoelastic.fringe_value": "7 N/mm"},
    ):
        with pytest.raises(DesignError, match="'rde LED' is no light source") as caught:
            design.replace(**change)
        assert all(repr(name) in str(caught.value) for name in PUBLISHED)
        assert str(caught.value).count("\n") == 1


@every
def test_contrast_over_retardation_is_that_of_the_spectrum(name, published) -> None:
    """Integrated over a Gaussian of the wave number whose half-maxima lie the half-width apart."""
    peak, width = published
    centre = 1 / peak

    def excess(deviation: float) -> float:
        reach = np.sqrt(2 * np.log(2)) * deviation
        return 1 / (centre - reach) - 1 / (centre + reach) - width

    deviation = float(root_scalar(excess, bracket=(1e-6 * centre, 0.2 * centre)).root)
    ends = centre - 9 * deviation, centre + 9 * deviation

    def spectrum(k: float) -> float:
        return float(np.exp(-(((k - centre) / deviation) ** 2) / 2))

    lit, _ = quad_vec(lambda k: spectrum(k) * np.exp(1j * PHASE * k / centre), *ends)
    contrast = np.abs(lit) / quad(spectrum, *ends)[0]
    seen = pictures(Polariscope.model_validate({"wavelength": name}))[0].fringe
    np.testing.assert_allclose(seen.contrast(PHASE), contrast, atol=1e-8)
    np.testing.assert_allclose(seen.intensity(PHASE), (1 - contrast * np.cos(PHASE)) / 2, atol=1e-8)


@every
def test_a_spectrum_that_is_gaussian_in_wavelength_differs_little(name, published) -> None:
    """Data sheets do not state the shape; over three fringes it changes the light by below 1 %."""
    peak, width = published
    deviation = width / np.sqrt(8 * np.log(2))

    def lit(wavelength: float) -> np.ndarray:
        weight = np.exp(-(((wavelength - peak) / deviation) ** 2) / 2)
        return weight * np.sin(PHASE * peak / wavelength / 2) ** 2

    ends = peak - 7 * deviation, peak + 7 * deviation
    light = quad_vec(lit, *ends)[0] / (deviation * np.sqrt(2 * np.pi))
    seen = pictures(Polariscope.model_validate({"wavelength": name}))[0].fringe
    assert np.abs(seen.intensity(PHASE) - light).max() < 0.01


def test_the_command_lists_light_sources_with_their_source() -> None:
    told = CliRunner().invoke(app, ["materials"])
    assert told.exit_code == 0
    assert "red LED: AlInGaP\n  wavelength = 635 nm\n  bandwidth = 17 nm\n" in told.output
    assert told.output.count("TAOS046") == 4
