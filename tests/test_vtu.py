"""Files for ParaView hold the fields that the library computes otherwise."""

from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest

import fringeforce as ff
from fringeforce.io.vtu import write_vtu
from fringeforce.mechanics.solid.mesh import box_mesh
from fringeforce.mechanics.solid.strip import STRIP, strip_block, strip_integral, strip_loads

COARSE = replace(STRIP, order=5, corner=0.5)


@pytest.mark.slow
def test_a_file_read_back_balances_its_load_and_integrates_to_what_light_sees(
    sensor: ff.Sensor, tmp_path: Path
) -> None:
    strip, places = sensor.transducer, np.array([-1e-3, 2e-3])
    block, loads = strip_block(strip), strip_loads(strip, places)
    mesh = box_mesh(block, places, [], COARSE)
    forces = np.array([[1.0, 0.1], [0.5, -0.2]])
    write_vtu(tmp_path / "field.vtu", block, loads, mesh, forces)

    grid = meshio.read(tmp_path / "field.vtu")
    corners = grid.points[grid.cells_dict["hexahedron"]]
    size, middle = np.ptp(corners, axis=1), corners.mean(axis=1)
    assert size.prod(axis=1).sum() == pytest.approx(25e-3 * 2e-3 * 3.5e-3)
    tensor = grid.cell_data["stress"][0].reshape(-1, 3, 3)
    np.testing.assert_allclose(tensor, tensor.swapaxes(1, 2), rtol=1e-12)
    layer = grid.cell_data["layer"][0]
    np.testing.assert_array_equal(layer == 1, middle[:, 2] > -0.5e-3)

    # any horizontal cut of the free strip carries the whole load
    levels = np.unique(middle[:, 2].round(9))
    here = np.isclose(middle[:, 2], levels[len(levels) // 2], atol=1e-8)
    area = size[here, 0] * size[here, 1]
    np.testing.assert_allclose(area @ tensor[here, 2, 2], -1.5, rtol=0.02)
    np.testing.assert_allclose(area @ tensor[here, 0, 2], -0.1, atol=0.01)

    station = middle[np.abs(middle[:, 0] - 0.4e-3).argmin()]
    column = (layer == 2) & np.isclose(middle[:, :2], station[:2], atol=1e-9).all(axis=1)
    difference = tensor[column, 0, 0] - tensor[column, 1, 1]
    found = size[column, 2] @ difference
    exact = strip_integral(strip, places, station[1:2], COARSE)
    expected = np.interp(
        station[0],
        ff.SensorModel(sensor, exact.breaks, exact.difference[0]).x,
        np.tensordot(exact.difference[0], forces, axes=2),
    )
    assert found == pytest.approx(expected, rel=0.03)

    moved = grid.point_data["displacement"]
    np.testing.assert_array_equal(moved[grid.points[:, 2] == grid.points[:, 2].min()], 0)
    assert moved[:, 2].min() < 0


@pytest.mark.parametrize(("name", "text"), [("a.vtk", r"end in \.vtu"), ("no/a.vtu", "no folder")])
def test_a_file_that_cannot_be_written_is_refused_before_anything_is_solved(
    sensor: ff.Sensor, tmp_path: Path, name: str, text: str
) -> None:
    strip = sensor.transducer
    block, loads = strip_block(strip), strip_loads(strip, [0.0])
    mesh = box_mesh(block, [0.0], [], COARSE)
    with pytest.raises(ff.FringeforceError, match=text):
        write_vtu(tmp_path / name, block, loads, mesh, np.ones((1, 2)))
