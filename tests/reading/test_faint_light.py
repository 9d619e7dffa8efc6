"""The light of faint loads lies in a space of few dimensions, whatever loads they are."""

import numpy as np
import pytest
from exact_frames import Bench, drawing
from scipy.ndimage import gaussian_filter1d

import fringeforce as ff
from fringeforce.estimation.faint_light import faint_light
from fringeforce.models.uncertainty import uncertainty

TOLERANCES = {
    "tactels.placement": "0 +/- 0.05 mm",
    "tactels.contact_width": "0.4 +/- 0.1 mm",
    "polariscope.residual": "0 +/- 0.05 rad",
    "polariscope.visibility": "0.97 +/- 0.02",
    "camera.blur": "49 um +/- 24 um",
}


@pytest.mark.parametrize("tolerances", [{}, TOLERANCES])
def test_the_light_of_faint_loads_by_the_exact_series_lies_in_its_space(
    tolerances: dict[str, object],
) -> None:
    drawn = drawing(**tolerances)
    camera, rng, count = drawn.camera, np.random.default_rng(3), drawn.tactels.count
    model = uncertainty(ff.characterize(drawn)).frame
    rows = faint_light(model, 0.17)
    np.testing.assert_allclose(rows @ rows.T, np.eye(len(rows)), atol=1e-9)
    assert len(rows) < 60
    places, widths = drawn.tactels.positions, np.full(count, 1e-6)
    residual, clear, blur = np.zeros(camera.pixels), 1.0, 0.0
    if tolerances:
        places = places + rng.normal(0, 5e-5, count)
        widths = np.full(count, 4e-4) + rng.normal(0, 1e-4, count)
        along = np.linspace(0, 2 * np.pi, camera.pixels)
        residual, clear, blur = 0.05 * np.sin(along + rng.uniform(0, 6)), 0.96, 8.0
    influence = Bench(drawn, places, widths).influence()

    def light(forces: np.ndarray) -> np.ndarray:
        swing = clear * np.cos(np.einsum("mct,ct->m", influence, forces) + residual)
        if blur:
            swing = gaussian_filter1d(swing, blur, mode="nearest")
        return camera.amplitude * (1 - swing) / 2 / np.sqrt(model.variance)

    for _ in range(60):
        normal = rng.uniform(0, 1, count) * (rng.permutation(count) < rng.integers(1, count + 1))
        forces = np.stack([normal, normal * rng.uniform(-0.5, 0.5, count)], axis=1)
        forces *= 0.17 / np.abs(np.einsum("mct,ct->m", influence, forces)).max()
        added = light(forces) - light(np.zeros((count, 2)))
        left = added - rows.T @ (rows @ added)
        assert np.linalg.norm(added) > 3
        assert np.linalg.norm(left) < 1
