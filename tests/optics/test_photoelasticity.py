"""Stress to phase to light, against the tables of the paper and a textbook's disc."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fringeforce as ff
from fringeforce.optics.photoelasticity import (
    phase_lead,
    phase_lead_rectangle_rule,
    stress_optic_constant,
)
from fringeforce.optics.polariscope import intensity

phases = st.floats(-60, 60)


def test_the_papers_design_has_the_published_constant(sensor: ff.Sensor) -> None:
    constant = stress_optic_constant(sensor.transducer.photoelastic, 632.8e-9)
    # equation (2) of Saad et al. with Tables I and II: 1.42 / 110 MPa * 0.05 * 2 pi / 632.8 nm
    assert constant == pytest.approx(6.409e-3, abs=0.5e-6)


def test_a_disc_under_diametral_load_shows_its_textbook_fringes(sensor: ff.Sensor) -> None:
    # calibration of a model material (Ramesh, Digital Photoelasticity, Springer 2000):
    # N = 8 P / (pi D f) at the centre of a disc, with the material
    # fringe value f = wavelength / C and the stress-optic coefficient C = (1 + nu) K_s / E
    load, radius = 7.0, 20e-3
    coefficient = 1.42 * 0.05 / 110e6
    order = 8 * load / (np.pi * 2 * radius * 632.8e-9 / coefficient)
    constant = stress_optic_constant(sensor.transducer.photoelastic, 632.8e-9)
    integral = 4 * load / (np.pi * radius)  # of sigma_1 - sigma_2 along the light's way
    twice_through = 2
    assert phase_lead(integral, constant) == pytest.approx(twice_through * 2 * np.pi * order)


def test_tension_along_the_strip_leads(sensor: ff.Sensor) -> None:
    constant = stress_optic_constant(sensor.transducer.photoelastic, 632.8e-9)
    assert phase_lead([-1.0, 0.0, 1.0], constant).tolist() == [-2 * constant, 0, 2 * constant]


@pytest.mark.parametrize("nodes", [2, 3, 21])
def test_equation_3_overrates_a_uniform_stress_by_one_node(nodes: int) -> None:
    depth, stress, constant = 3e-3, 2e5, 6.4e-3
    rule = phase_lead_rectangle_rule(np.full((4, nodes), stress), depth / (nodes - 1), constant)
    consistent = phase_lead(stress * depth, constant)
    np.testing.assert_allclose(rule, consistent * nodes / (nodes - 1))


def test_equation_3_converges_to_the_integral_at_first_order() -> None:
    errors = []
    for cells in (20, 40, 80):
        z = np.linspace(0, 1, cells + 1)
        rule = phase_lead_rectangle_rule(np.exp(z)[None], 1 / cells, 0.5)
        errors.append(rule[0] - (np.e - 1))
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 1, atol=0.02)


@given(phases)
def test_intensity_is_blind_to_sign_and_whole_turns(phase: float) -> None:
    light = intensity([phase, -phase, phase + 2 * np.pi, phase - 14 * np.pi])
    np.testing.assert_allclose(light, light[0], atol=1e-12)
    assert 0 <= light[0] <= 1


def test_a_dark_field_is_dark_unloaded_and_bright_at_half_orders() -> None:
    np.testing.assert_allclose(intensity(np.pi * np.arange(5)), [0, 1, 0, 1, 0], atol=1e-30)
    assert intensity(np.pi / 2) == pytest.approx(0.5)


@given(phases)
def test_intensity_is_a_cosine_fringe(phase: float) -> None:
    assert intensity(phase) == pytest.approx((1 - np.cos(phase)) / 2, abs=1e-12)
