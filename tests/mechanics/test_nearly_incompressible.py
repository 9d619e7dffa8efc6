"""Layers of rubber, which hardly change their volume, do not lock the elements."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.mechanics import fourier
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

TERMS = 4000


@pytest.mark.parametrize(("plane", "error"), [("stress", 5e-5), ("strain", 2e-3)])
def test_nearly_incompressible_layers_agree_with_the_exact_series(plane: str, error: float) -> None:
    values = {"compliant": {"poissons_ratio": 0.4999}, "photoelastic": {"poissons_ratio": 0.4999}}
    sensor = ff.load_sensor("saad").replace(
        transducer={"edges": "roller", "plane": plane, **values}
    )
    x, strip = sensor.pixel_positions[::64], sensor.transducer
    stress = fourier.integrated_stress(strip, sensor.tactels.positions, x, TERMS)
    constant = stress_optic_constant(strip.photoelastic, sensor.polariscope.wavelength)
    exact = phase_lead(stress, constant)
    found = ff.characterize(sensor).influence(x)
    assert np.abs(found - exact).max() < error * np.abs(exact).max()
