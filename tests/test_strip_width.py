"""The strip in three dimensions: its limits, its line camera, and who refuses it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.explorer.limits import check
from fringeforce.mechanics.solid.mesh import Grading
from fringeforce.mechanics.solid.strip import STRIP
from fringeforce.models.plane_check import plane_check
from fringeforce.models.strip_width import StripWidth, camera_line, strip_width
from fringeforce.optics.jones import fringe, passed, polariser, retarder
from fringeforce.studies.convergence import convergence_study
from fringeforce.studies.one_phase import contrast, one_phase

pytestmark = pytest.mark.slow

COARSE = replace(STRIP, order=3, corner=0.3)
SOLID = {"transducer.plane": "3d"}
HALVES = np.array([0.0, 0.45, 0.9])


def _largest_deviation(sensor: ff.Sensor, width: float, plane: str, mesh: Grading) -> float:
    """In mid-width, from a plane model under the same load per width, of all tactels."""
    half, n = sensor.transducer.length / 2, sensor.tactels.count
    wide = sensor.replace(**{"transducer.width": width})
    middle = np.zeros(1), np.ones(1)
    found = strip_width(wide, mesh, places=middle)
    forces = ff.polar(1.0, 10, n)
    x = np.linspace(-0.99, 0.99, 199) * half
    flat = ff.characterize(sensor.replace(**{"transducer.plane": plane})).phase(forces, x)
    lead, _ = found.phases(forces * width / sensor.transducer.width, x)
    return float(np.abs(lead - flat).max() / np.abs(flat).max())


@pytest.mark.parametrize("width", [1e-3, 6e-3])
def test_the_quick_check_of_the_plane_agrees_with_fine_elements(
    sensor: ff.Sensor, width: float
) -> None:
    wide = sensor.replace(**{"transducer.width": width})
    away = plane_check(wide).away["stress"]
    finer = replace(STRIP, order=4)
    assert away == pytest.approx(_largest_deviation(wide, width, "stress", finer), abs=0.024)


@pytest.mark.parametrize(
    ("design", "width", "plane", "words"),
    [
        ("saad", 0.3e-3, "stress", "good enough"),
        ("saad", 0.3e-3, "strain", 'take plane = "stress"'),
        ("saad", 6e-3, "stress", 'poor; take plane = "3d"'),
        ("saad", 6e-3, "3d", "good for any width"),
        ("skin", 200e-3, "stress", 'take plane = "strain"'),
        ("skin", 6e-3, "stress", 'poor; take plane = "3d"'),
        ("soft-skin", 12e-3, "stress", "poor; calibrate, for large strain is solved in a plane"),
    ],
)
def test_a_poor_plane_is_told_and_a_better_one(
    design: str, width: float, plane: str, words: str
) -> None:
    sensor = ff.load_sensor(design)
    found = plane_check(sensor.replace(**{"transducer.width": width, "transducer.plane": plane}))
    assert words in found.words
    assert found.good == ("good" in words)


def test_a_narrow_strip_is_in_plane_stress(sensor: ff.Sensor) -> None:
    assert _largest_deviation(sensor, 0.05e-3, "stress", STRIP) < 0.01


def test_the_middle_of_a_wide_strip_is_in_plane_strain(sensor: ff.Sensor) -> None:
    short = sensor.replace(**{"tactels.count": 1, "transducer.length": "8 mm"})
    assert _largest_deviation(short, 80e-3, "strain", replace(COARSE, order=5)) < 0.01


@pytest.fixture(scope="module")
def across(sensor: ff.Sensor) -> StripWidth:
    """Places from the middle to near one side face."""
    places = HALVES * sensor.transducer.width / 2, np.ones(3) / 3
    return strip_width(sensor.replace(**SOLID), COARSE, places=places)


def test_shear_turns_nothing_in_mid_width_and_something_beside_it(across: StripWidth) -> None:
    lead, cross = across.phases(ff.polar(1.0, 10, 11), across.sensor.pixel_positions)
    assert np.abs(cross[0]).max() < 1e-9 * np.abs(lead[0]).max()
    assert np.abs(cross[1]).max() > 0.02 * np.abs(lead[1]).max()


def test_mirrored_loads_have_mirrored_phases(across: StripWidth) -> None:
    x = np.linspace(-11.93e-3, 11.87e-3, 31)  # between the elements' boundaries
    forces = np.random.default_rng(1).uniform(-1, 1, (11, 2))
    mirrored = forces[::-1] * [1, -1]
    lead, cross = across.phases(forces, x)
    other_lead, other_cross = across.phases(mirrored, -x)
    np.testing.assert_allclose(lead, other_lead, atol=1e-9 * np.abs(lead).max())
    np.testing.assert_allclose(cross, -other_cross, atol=1e-9 * np.abs(lead).max())


def test_a_narrow_line_in_the_middle_sees_one_phase(sensor: ff.Sensor, across: StripWidth) -> None:
    solid = sensor.replace(**SOLID)
    middle = replace(
        across, weights=np.ones(1), y=across.y[:1], lead=across.lead[:1], cross=across.cross[:1]
    )
    model = ff.SensorModel(solid, middle.breaks, middle.psi)
    forces = ff.polar(0.7, -5, 11)
    np.testing.assert_allclose(middle.intensity(forces), model.intensity(forces), atol=1e-9)
    np.testing.assert_array_equal(middle.expose(forces, rng=3), model.expose(forces, rng=3))
    assert contrast(middle, forces) == pytest.approx(1.0)
    assert contrast(across, forces) < 0.9


def test_a_wide_line_is_seen_through_evenly_spread_points(sensor: ff.Sensor) -> None:
    line = sensor.replace(**SOLID, **{"camera.line_position": 0.2e-3, "camera.line_width": "1 mm"})
    y, weights = camera_line(line.camera)
    assert weights.sum() == pytest.approx(1)
    assert weights @ y == pytest.approx(0.2e-3)
    assert weights @ (y - 0.2e-3) ** 2 == pytest.approx(1e-6 / 12)
    assert ff.load_sensor("saad").replace(**line.model_dump(exclude_none=True)) == line


@pytest.mark.parametrize("bias", [0.0, 90.0, 180.0, 37.0])
def test_light_through_a_turned_retarder_is_that_of_jones(bias: float) -> None:
    before = [polariser(0.0), retarder(np.pi / 2, np.pi / 4)]
    behind = [retarder(np.pi / 2, -np.pi / 4), polariser(np.pi / 2 - np.radians(bias) / 2)]
    size, angle = np.random.default_rng(2).uniform(-7, 7, (2, 50))
    expected = [
        2 * passed([*before, retarder(d, a)], np.zeros(1), behind)[0]
        for d, a in zip(size, angle, strict=True)
    ]
    lead, cross = size * np.cos(2 * angle), size * np.sin(2 * angle)
    found = fringe(before, behind).turned(lead, cross)
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_averaged_light_is_read_like_one_phase_from_a_narrow_line_only(sensor: ff.Sensor) -> None:
    narrow, wide = one_phase(sensor, shares=(0.02, 0.6), loads=(1.5,), mesh=COARSE)
    assert narrow.contrast > 0.99
    assert narrow.error == pytest.approx(narrow.noise, rel=0.2)
    assert wide.contrast < 0.97
    assert wide.error > 3 * wide.noise


def test_a_model_in_three_dimensions_survives_a_file(
    sensor: ff.Sensor, across: StripWidth, tmp_path: Path
) -> None:
    solid = sensor.replace(**SOLID, **{"camera.line_width": "0.3 mm"})
    model = ff.SensorModel(solid, across.breaks, across.psi, {"order": across.order})
    model.save(tmp_path / "model.h5")
    again = ff.load_model(tmp_path / "model.h5")
    assert again.sensor == solid
    np.testing.assert_array_equal(again.psi, across.psi)


@pytest.mark.parametrize(
    ("changes", "remedy"),
    [
        ({"camera.line_width": 1e-3}, r'line_width = 1 mm.*take plane = "3d"'),
        ({"camera.line_position": 0.0}, r"line_position = 0 mm.*leave line_position out"),
        ({**SOLID, "camera.line_width": 3e-3}, "3 mm wide.*ends at 1 mm"),
        ({**SOLID, "camera.line_position": -1.1e-3}, "-1.1 mm.*move it"),
    ],
)
def test_a_line_that_no_model_can_see_is_refused(
    sensor: ff.Sensor, changes: dict[str, float], remedy: str
) -> None:
    with pytest.raises(ff.FringeforceError, match=remedy):
        sensor.replace(**changes)


def test_what_needs_a_plane_says_so(sensor: ff.Sensor) -> None:
    solid = sensor.replace(**SOLID)
    with pytest.raises(ff.FringeforceError, match='take plane = "stress"'):
        convergence_study(solid)
    with pytest.raises(ff.FringeforceError, match='take plane = "stress"'):
        ff.characterize(solid, "paper")
    with pytest.raises(ff.FringeforceError, match='take "stress" or "strain" here'):
        check(solid)


@pytest.mark.parametrize(
    "changes",
    [
        {"transducer.strain": "finite", "tactels.contact_width": "0.5 mm"},
        {"transducer.relaxation": [{"share": "0.06 +/- 20 %", "time": "0.4 s"}]},
        {"tactels.placement": "0 +/- 0.1 mm", "tactels.contact_width": "0.4 +/- 0.2 mm"},
    ],
)
def test_the_plane_of_every_design_is_checked(sensor: ff.Sensor, changes: dict[str, Any]) -> None:
    assert plane_check(sensor.replace(**changes)).nearest == "stress"
