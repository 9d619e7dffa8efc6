"""Layers as data sheets state them: stress-optic coefficients, fringe values, materials by name."""

import numpy as np
import pytest
from typer.testing import CliRunner

import fringeforce as ff
from fringeforce.base.errors import DesignError, InputError
from fringeforce.cli import app
from fringeforce.design.files import parse_sensor
from fringeforce.design.materials import by_strain, materials
from fringeforce.optics.photoelasticity import stress_optic_constant

CLEAR = "transducer.photoelastic."
STRAIN, STRESS = CLEAR + "strain_optic_coefficient", CLEAR + "stress_optic_coefficient"
MODULI = "transducer.compliant.youngs_modulus", CLEAR + "youngs_modulus"


@pytest.fixture(scope="module")
def saad() -> ff.Sensor:
    return ff.load_sensor("saad")


def test_a_fringe_value_is_the_wavelength_over_the_stress_optic_coefficient(saad) -> None:
    """Polycarbonate, 7 N/mm in the green line of mercury, has 78 brewsters."""
    green = saad.replace(**{"polariscope.wavelength": "546.1 nm"})
    stated = green.replace(**{CLEAR + "fringe_value": "7.0 N/mm"})
    layer = stated.transducer.photoelastic
    assert layer.stress_optic_coefficient == pytest.approx(78.01e-12, rel=1e-4)
    # one fringe for 7 N/mm of stress times thickness: 7 MPa in a millimetre
    phase = stress_optic_constant(layer, 546.1e-9) * 7e6 * 1e-3
    assert phase == pytest.approx(2 * np.pi, rel=1e-12)


@pytest.mark.parametrize("text", ["72 TPa^-1", "72 brewster", "7.2e-11 / Pa", "72e-12 Pa^-1"])
def test_all_ways_to_write_a_coefficient_are_one(saad, text) -> None:
    layer = saad.replace(**{STRESS: text}).transducer.photoelastic
    assert layer.stress_optic == pytest.approx(72e-12, rel=1e-12)
    assert layer.strain_optic_coefficient is None


def test_both_coefficients_describe_the_same_sensor(saad) -> None:
    layer = saad.transducer.photoelastic
    c = (1 + 0.42) / 110e6 * 0.05  # equation (2)
    assert layer.stress_optic == pytest.approx(c, rel=1e-12)
    same = saad.replace(**{STRESS: c})
    np.testing.assert_allclose(ff.characterize(same).psi, ff.characterize(saad).psi, rtol=1e-12)
    assert by_strain(same).transducer.photoelastic.strain_optic_coefficient == pytest.approx(0.05)
    assert by_strain(saad) is saad


def test_moduli_matter_by_their_ratio_alone_where_stress_makes_the_light(saad) -> None:
    """Under given forces stresses depend on E_1 / E_2 alone; K_s / E_2 scales the light, C not."""
    stressed = saad.replace(**{STRESS: "72 TPa^-1"})
    values = {path: 1.3 * e for path, e in zip(MODULI, (11e6, 110e6), strict=True)}
    psi, stiffer = (ff.characterize(one).psi for one in (stressed, stressed.replace(**values)))
    np.testing.assert_allclose(stiffer, psi, rtol=1e-9, atol=1e-12 * np.abs(psi).max())
    plain, scaled = (ff.characterize(one).psi for one in (saad, saad.replace(**values)))
    np.testing.assert_allclose(1.3 * scaled, plain, rtol=1e-9, atol=1e-12 * np.abs(plain).max())


@pytest.mark.parametrize(
    "stated",
    [
        {STRESS: "72 +/- 2 TPa^-1"},
        {CLEAR + "fringe_value": "7.6 +/- 0.2 N/mm"},
        {CLEAR + "fringe_value": "7.6 N/mm +/- 3 %"},
    ],
)
def test_designs_are_written_and_read_back_with_their_tolerances(saad, stated) -> None:
    made = saad.replace(**{STRAIN: "0.05 +/- 5 %"}).replace(**stated)
    assert set(made.tolerances) == {STRESS}
    assert parse_sensor(made.to_toml()) == made


def test_a_fringe_value_keeps_its_relative_tolerance(saad) -> None:
    made = saad.replace(**{CLEAR + "fringe_value": "8 +/- 0.2 N/mm"})
    value = made.transducer.photoelastic.stress_optic_coefficient
    assert made.tolerances[STRESS] / value == pytest.approx(0.025)


def test_a_material_gives_what_a_layer_does_not_state(saad) -> None:
    text = saad.to_toml()
    own = 'youngs_modulus = "110 MPa"\npoissons_ratio = 0.42\nstrain_optic_coefficient = 0.05'
    assert own in text
    sheet = parse_sensor(text.replace(own, 'material = "polycarbonate"'))
    layer = sheet.transducer.photoelastic
    assert (layer.youngs_modulus, layer.poissons_ratio) == (2.48e9, 0.38)
    assert layer.stress_optic_coefficient == pytest.approx(546.1e-9 / 7e3)
    assert sheet.tolerances[CLEAR + "youngs_modulus"] == pytest.approx(0.05 * 2.48e9)
    assert parse_sensor(sheet.to_toml()) == sheet
    stated = 'material = "polycarbonate"\nyoungs_modulus = "2.3 GPa"\nfringe_value = "7.6 N/mm"'
    sheet = parse_sensor(text.replace(own, stated))
    layer = sheet.transducer.photoelastic
    assert layer.youngs_modulus == 2.3e9
    assert layer.stress_optic_coefficient == pytest.approx(632.8e-9 / 7.6e3)
    assert CLEAR + "youngs_modulus" not in sheet.tolerances


def test_every_material_is_a_valid_layer_with_a_source(saad) -> None:
    for material in materials().values():
        assert len(material.source) > 20
        clear = "fringe_value" in material.values
        own = "photoelastic" if clear else "compliant"
        layer = saad.model_dump()["transducer"][own] | {"material": material.name}
        for key in (*material.values, "strain_optic_coefficient", "stress_optic_coefficient"):
            layer.pop(key, None)
        values = saad.model_dump(by_alias=True, exclude_none=True)
        values["transducer"][own] = {k: v for k, v in layer.items() if v is not None}
        made = ff.Sensor.model_validate(values, context={"units_required": False})
        assert getattr(made.transducer, own).material == material.name


@pytest.mark.parametrize(
    ("layer", "said"),
    [
        ("", "none is stated"),
        ('strain_optic_coefficient = 0.05\nfringe_value = "7 N/mm"', "two are stated"),
        ('fringe_value = "7 MPa"', 'as in "7 N/mm"'),
        ('fringe_value = "-7 N/mm"', "greater than zero"),
        ("stress_optic_coefficient = 72", "bare number"),
        ('stress_optic_coefficient = "72 MPa"', 'as in "72 TPa^-1"'),
        ('stress_optic_coefficient = "72 +/- 30 TPa^-1"', "tolerance that is too large"),
        ('material = "polycarbonat"', "did you mean 'polycarbonate'?"),
    ],
)
def test_what_is_wrong_is_named(saad, layer, said) -> None:
    text = saad.to_toml().replace("strain_optic_coefficient = 0.05", layer)
    with pytest.raises(DesignError) as caught:
        parse_sensor(text)
    assert said in str(caught.value)
    assert "transducer.photoelastic" in str(caught.value)


def test_calibration_finds_the_coefficient_that_is_stated(saad) -> None:
    drawing = saad.replace(**{STRESS: "600 TPa^-1"})
    made = ff.characterize(drawing.replace(**{STRESS: "648 TPa^-1"}))
    forces = np.random.default_rng(0).uniform(0.1, 1.5, (6, 11, 2)) * [1.0, 0.2]
    model = ff.calibrate(drawing, made.expose(forces, rng=0), forces, [STRESS])
    assert model.sensor.transducer.photoelastic.stress_optic == pytest.approx(648e-12, rel=3e-3)
    with pytest.raises(InputError, match="does not state"):
        ff.calibrate(drawing, made.expose(forces, rng=0), forces, [STRAIN])


def test_readings_allow_for_the_tolerance_of_the_coefficient(saad) -> None:
    loose = ff.characterize(saad.replace(**{STRESS: "600 +/- 12 TPa^-1"}))
    forces = ff.polar(1.0, angle=10, n=11)
    reading = ff.Reader(loose).read(loose.expose(forces, rng=0))
    # all forces are uncertain by the 2 % of the coefficient together
    total = reading.forces[:, 0].sum()
    normal = reading.covariance[::2, ::2].sum()
    assert np.sqrt(normal) / total == pytest.approx(0.02, rel=0.1)


def test_pads_take_coefficients_too() -> None:
    pad = ff.load_sensor("pad")
    layer = pad.transducer.photoelastic
    same = pad.replace(**{STRESS: layer.stress_optic})
    assert same.transducer.photoelastic.stress_optic == layer.stress_optic


def test_the_command_lists_materials_with_their_sources() -> None:
    told = CliRunner().invoke(app, ["materials"])
    assert told.exit_code == 0
    assert "fringe_value = 7.0 N/mm +/- 5 %" in told.output
    assert told.output.count("Dally") == 4
