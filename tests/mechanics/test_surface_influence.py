"""Contacts of any place and width, against the exact Fourier series of roller edges."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.design.strip import Transducer
from fringeforce.mechanics import fourier
from fringeforce.mechanics.elasticity import unit_displacements
from fringeforce.mechanics.mesh import strip_mesh
from fringeforce.mechanics.solid.strip import QUICK
from fringeforce.mechanics.stress import integrated_stress
from fringeforce.mechanics.surface_influence import surface_influence
from fringeforce.models.strip_width import light_line
from fringeforce.optics.photoelasticity import stress_optic_constant


def _exact(strip: Transducer, centres: np.ndarray, widths: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Uniform tractions from the series of line loads, by a quadrature of high order."""
    nodes, weights = np.polynomial.legendre.leggauss(30)
    places = centres[:, None] + widths[:, None] / 2 * nodes
    lines = fourier.integrated_stress(strip, places.ravel(), x, 600)
    return lines.reshape(len(x), *places.shape, 2).transpose(0, 1, 3, 2) @ (weights / 2)


@pytest.mark.parametrize("design", ["saad", "thin-cover", "stiff-cover"])
@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_any_contact_is_that_of_the_exact_series(design: str, plane: str) -> None:
    changes = {"transducer.edges": "roller", "transducer.plane": plane}
    sensor = ff.load_sensor(design).replace(**changes)
    strip, x = sensor.transducer, sensor.pixel_positions[::8]
    rng = np.random.default_rng()
    centres = rng.uniform(-3e-3, 3e-3, 12)
    widths = np.array([0, 1e-12, 1e-8, *rng.uniform(0, 2e-3, 9)])
    surface = surface_influence(strip, -4e-3, 4e-3, x)
    exact = _exact(strip, centres, widths, x)
    found = surface.under(centres, widths)
    assert np.abs(found - exact).max() < 3e-4 * np.abs(exact).max()


def test_loads_at_the_ends_of_the_strip_are_solved_as_well(sensor: ff.Sensor) -> None:
    strip = sensor.replace(**{"transducer.edges": "roller"}).transducer
    half, x = strip.length / 2, sensor.pixel_positions[::8]
    surface = surface_influence(strip, -half, half, x)
    centres, widths = np.array([-half + 0.3e-3, half - 0.6e-3]), np.array([0.2e-3, 0.6e-3])
    exact = _exact(strip, centres, widths, x)
    assert np.abs(surface.under(centres, widths) - exact).max() < 3e-4 * np.abs(exact).max()
    assert surface.covers(np.array([-half]), np.array([0.0]))


def test_with_free_edges_it_is_that_of_a_mesh_for_the_very_places(sensor: ff.Sensor) -> None:
    strip, x = sensor.transducer, sensor.pixel_positions[::8]
    places = np.array([-4.93e-3, -0.31e-3, 2.22e-3])
    direct = integrated_stress(unit_displacements(strip, places, strip_mesh(strip, places)), x)
    found = surface_influence(strip, -5e-3, 5e-3, x).under(places, np.zeros(3))
    assert np.abs(found - direct).max() < 3e-4 * np.abs(direct).max()


def test_a_force_that_is_spread_stays_the_same_force(sensor: ff.Sensor) -> None:
    surface = surface_influence(sensor.transducer, -5e-3, 5e-3, sensor.pixel_positions[::64])
    rng = np.random.default_rng()
    centres, widths = rng.uniform(-4e-3, 4e-3, 20), rng.uniform(0, 2e-3, 20)
    shares = surface.shares(centres, widths)
    np.testing.assert_allclose(shares.sum(axis=1), 1, rtol=1e-9)
    np.testing.assert_allclose(shares @ surface.places, centres, atol=1e-12)
    spread = shares @ surface.places**2 - centres**2
    np.testing.assert_allclose(spread, widths**2 / 12, atol=1e-14)


def test_a_design_with_wide_contacts_is_characterised_with_them(sensor: ff.Sensor) -> None:
    changes = {"tactels.contact_width": "0.8 mm", "tactels.placement": "0.1 mm"}
    wide = sensor.replace(**{"transducer.edges": "roller"}, **changes)
    model = ff.characterize(wide)
    width = np.full(11, 0.8e-3)
    exact = _exact(wide.transducer, wide.tactels.positions + 1e-4, width, model.pixel_positions)
    layer = wide.transducer.photoelastic
    scale = 2 * stress_optic_constant(layer, wide.polariscope.wavelength)
    lines = ff.characterize(sensor).pixel_influence
    off = np.abs(model.pixel_influence - scale * exact).max()
    assert off < 1e-3 * np.abs(lines).max()
    assert np.abs(model.pixel_influence - lines).max() > 100 * off
    with pytest.raises(ff.FringeforceError, match="contact_width"):
        ff.characterize(wide, mesh="paper")


def test_in_three_dimensions_a_wide_strip_is_that_of_plane_strain(sensor: ff.Sensor) -> None:
    solid = {"edges": "roller", "plane": "3d", "length": "7 mm", "width": "40 mm"}
    wide = sensor.replace(transducer=solid, tactels={"count": 3, "pitch": "1 mm"})
    strip, x = wide.transducer, np.linspace(-3.5e-3, 3.5e-3, 400)
    rng = np.random.default_rng()
    centres, widths = rng.uniform(-1e-3, 1e-3, 6), np.array([0.0, *rng.uniform(0, 0.8e-3, 5)])
    line = light_line(strip, wide.camera, mesh=QUICK)
    found = surface_influence(strip, -1.5e-3, 1.5e-3, x, line).under(centres, widths)
    plane = strip.model_copy(update={"plane": "strain"})
    exact = _exact(plane, centres, widths, x)
    assert np.abs(found - exact).max() < 0.06 * np.abs(exact).max()
    assert np.sqrt(np.square(found - exact).mean()) < 0.01 * np.abs(exact).max()


def test_in_three_dimensions_differences_between_strips_are_smooth(sensor: ff.Sensor) -> None:
    solid = {"plane": "3d", "length": "8 mm"}
    short = sensor.replace(transducer=solid, tactels={"count": 3, "pitch": "1 mm"})
    x, at = np.linspace(-4e-3, 4e-3, 400), (np.array([0.3e-3]), np.zeros(1))

    def difference(step: float) -> np.ndarray:
        found = []
        for sign in (1, -1):
            cover = {"thickness": 0.5e-3 * (1 + sign * step), "youngs_modulus": 11e6 * (1 + step)}
            strip = short.replace(**{"transducer.compliant": cover}).transducer
            line = light_line(strip, short.camera, short.transducer, QUICK)
            found.append(surface_influence(strip, 0.0, 0.5e-3, x, line).under(*at))
        return (found[0] - found[1]) / (2 * step)

    small, large = difference(1e-3), difference(0.05)
    assert np.abs(small - large).max() < 0.02 * np.abs(large).max()
