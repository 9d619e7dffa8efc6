"""Meshes follow the design."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fringeforce as ff
from fringeforce.design import shipped_designs
from fringeforce.mechanics.mesh import Mesh, paper_mesh, strip_mesh


def test_the_papers_mesh_has_the_papers_nodes(sensor: ff.Sensor) -> None:
    mesh = paper_mesh(sensor.transducer, sensor.tactels.positions)
    assert (len(mesh.x), len(mesh.z)) == (201, 25)
    widths = np.diff(mesh.x)
    assert widths[100] < widths[0]


def on_boundaries(mesh: Mesh, marks: np.ndarray, axis: np.ndarray) -> bool:
    return bool((np.abs(axis[:, None] - marks).min(axis=0) < 1e-12).all())


@given(
    count=st.integers(1, 40),
    pitch=st.floats(0.2e-3, 1.4e-3),
    cover=st.floats(0.05e-3, 2e-3),
    edges=st.sampled_from(["free", "roller"]),
)
def test_tactels_and_interface_lie_between_elements(count, pitch, cover, edges) -> None:
    sensor = ff.load_sensor("saad").replace(
        transducer={"length": 60e-3, "edges": edges, "compliant": {"thickness": cover}},
        tactels={"count": count, "pitch": pitch},
    )
    strip, tactels = sensor.transducer, sensor.tactels.positions
    mesh = strip_mesh(strip, tactels)
    assert (np.diff(mesh.x) > 0).all()
    assert (np.diff(mesh.z) > 0).all()
    assert on_boundaries(mesh, tactels, mesh.x)
    assert on_boundaries(mesh, np.array([-strip.compliant.thickness, 0.0]), mesh.z)
    assert mesh.x[[0, -1]] == pytest.approx([-30e-3, 30e-3])
    assert len(mesh.x) < 700


@pytest.mark.parametrize("name", sorted(shipped_designs()))
def test_elements_are_finest_at_the_loads_and_the_surface(name: str) -> None:
    sensor = ff.load_sensor(name)
    mesh = strip_mesh(sensor.transducer, sensor.tactels.positions)
    under = np.abs(mesh.x - sensor.tactels.positions[0]).argmin()
    widths, heights = np.diff(mesh.x), np.diff(mesh.z)
    assert widths[under] < np.median(widths) * 1.01 + 1e-12
    assert heights[-1] < heights.max() / 3


def test_refinement_cuts_every_element(sensor: ff.Sensor) -> None:
    mesh = Mesh(np.array([0.0, 1.0, 3.0]), np.array([-1.0, 0.0]), 2).refined(2)
    np.testing.assert_allclose(mesh.x, [0, 0.5, 1, 2, 3])
    np.testing.assert_allclose(mesh.z, [-1, -0.5, 0])


@pytest.mark.parametrize("call", [lambda m: m.refined(0), lambda m: Mesh(m.x, m.z, 0)])
def test_senseless_meshes_are_refused(call) -> None:
    with pytest.raises(ff.FringeforceError, match="1 or more"):
        call(Mesh(np.array([0.0, 1.0]), np.array([-1.0, 0.0]), 2))
