"""Meshes follow the design: boundaries where they must be, small elements where they pay."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray

import fringeforce as ff
from fringeforce.design.shipped import shipped_designs
from fringeforce.design.strip import Transducer
from fringeforce.mechanics.mesh import Mesh, paper_mesh, strip_mesh

Array = NDArray[np.float64]
MESHES = {"default": strip_mesh, "paper": paper_mesh}
TACTELS = [name for name in shipped_designs() if ff.load_sensor(name).skin is None]
"""Designs whose meshes have the places of their tactels; a skin has several meshes."""


def _holds(breaks: Array, marks: ArrayLike) -> bool:
    """Whether every mark is, to the last bit, one of the boundaries."""
    return bool(np.isin(marks, breaks).all())


def _variant(sensor: ff.Sensor, length: float, a: float, b: float, edges: str) -> Transducer:
    layers = {"compliant": {"thickness": a}, "photoelastic": {"thickness": b}}
    return sensor.replace(
        transducer={"length": length, "edges": edges, **layers}, tactels={"count": 1}
    ).transducer


def test_the_papers_mesh_has_its_201_by_25_nodes(strip: Transducer, sensor: ff.Sensor) -> None:
    mesh = paper_mesh(strip, sensor.tactels.positions)
    assert (len(mesh.x), len(mesh.z), mesh.order) == (201, 25, 1)
    assert len(mesh.x) * len(mesh.z) == 5025
    under_tactels = (mesh.x[:-1] >= -5e-3) & (mesh.x[1:] <= 5e-3)
    assert under_tactels.sum() == 100
    widths = np.diff(mesh.x)
    np.testing.assert_allclose(widths[under_tactels], 10e-3 / 100)
    np.testing.assert_allclose(widths[~under_tactels], 15e-3 / 100)


@pytest.mark.parametrize("count", [1, 2, 4, 7, 16, 32, 101])
def test_the_papers_mesh_keeps_its_size_for_any_tactels(strip: Transducer, count: int) -> None:
    positions = (np.arange(count) - (count - 1) / 2) * 0.2e-3
    mesh = paper_mesh(strip, positions)
    assert (len(mesh.x), len(mesh.z)) == (201, 25)
    assert (np.diff(mesh.x) > 0).all()
    assert _holds(mesh.x, positions)


@pytest.mark.parametrize("kind", MESHES)
@pytest.mark.parametrize("name", TACTELS)
def test_tactels_interface_and_ends_are_element_boundaries(name: str, kind: str) -> None:
    sensor = ff.load_sensor(name)
    a, b = sensor.transducer.compliant.thickness, sensor.transducer.photoelastic.thickness
    mesh = MESHES[kind](sensor.transducer, sensor.tactels.positions)
    half = sensor.transducer.length / 2
    assert _holds(mesh.x, sensor.tactels.positions)
    assert _holds(mesh.z, np.array([-a - b, -a, 0.0]))
    np.testing.assert_allclose(mesh.x[[0, -1]], [-half, half], rtol=1e-15)
    assert (np.diff(mesh.x) > 0).all()
    assert (np.diff(mesh.z) > 0).all()


def test_an_odd_pitch_is_met_exactly(strip: Transducer) -> None:
    positions = (np.arange(16) - 7.5) * 1.25e-3
    for build in MESHES.values():
        assert _holds(build(strip, positions).x, positions)


@settings(max_examples=60, deadline=None)
@given(
    length=st.floats(1e-3, 1.0),
    a=st.floats(1e-4, 5e-3),
    b=st.floats(2e-4, 2e-2),
    edges=st.sampled_from(["free", "roller"]),
    places=st.lists(st.integers(-99, 99), min_size=1, max_size=9, unique=True),
)
def test_any_strip_gets_an_ascending_mesh_through_its_marks(
    sensor: ff.Sensor, length: float, a: float, b: float, edges: str, places: list[int]
) -> None:
    strip, positions = _variant(sensor, length, a, b, edges), np.sort(places) * length / 200
    mesh = strip_mesh(strip, positions)
    assert (np.diff(mesh.x) > 0).all()
    assert (np.diff(mesh.z) > 0).all()
    assert _holds(mesh.x, np.concatenate([[-length / 2], positions, [length / 2]]))
    assert _holds(mesh.z, np.array([-a - b, -a, 0.0]))
    assert np.diff(mesh.x).max() <= a + b
    beside = np.abs(mesh.x[:, None] - positions).argmin(axis=0)
    assert np.diff(mesh.x)[beside].max() <= a * (1 + 1e-9)


def test_a_strip_thousands_of_times_longer_than_thick_gets_a_mesh(sensor: ff.Sensor) -> None:
    strip = _variant(sensor, 2.0, 5e-5, 5e-4, "roller")
    widths = np.diff(strip_mesh(strip, [0.0]).x)
    assert 2.0 / 5.5e-4 < len(widths) < 10_000


@pytest.mark.parametrize("name", TACTELS)
def test_elements_are_finest_beside_loads_and_corners(name: str) -> None:
    sensor = ff.load_sensor(name)
    tactels, strip = sensor.tactels.positions, sensor.transducer
    mesh = strip_mesh(strip, tactels)
    columns, rows = np.diff(mesh.x), np.diff(mesh.z)
    for left, right in pairwise(tactels):
        gap = columns[(mesh.x[:-1] >= left) & (mesh.x[1:] <= right)]
        assert gap.min() == pytest.approx(min(gap[0], gap[-1]))
    margin = columns[mesh.x[1:] <= tactels[0]]
    assert margin[0] == margin.min() < margin[-1] < margin.max()
    cover = rows[mesh.z[:-1] >= -strip.compliant.thickness]
    assert max(cover[0], cover[-1]) < cover.max()  # the corner below, the loads above
    assert rows[0] == pytest.approx(rows[mesh.z[1:] <= -strip.compliant.thickness].min())


def test_roller_edges_have_no_corners_to_refine(
    strip: Transducer, roller_strip: Transducer
) -> None:
    free, roller = strip_mesh(strip, [0.0]), strip_mesh(roller_strip, [0.0])
    assert np.diff(roller.x)[0] > 10 * np.diff(free.x)[0]
    assert roller.unknowns < free.unknowns


def test_refinement_cuts_every_element_evenly() -> None:
    mesh = Mesh(np.array([0.0, 1.0, 4.0]), np.array([-2.0, 0.0]), 3).refined(2)
    np.testing.assert_allclose(mesh.x, [0, 0.5, 1, 2.5, 4])
    np.testing.assert_allclose(mesh.z, [-2, -1, 0])
    assert mesh.order == 3
    assert mesh.unknowns == 2 * (3 * 4 + 1) * 3 * 2


def test_stations_are_the_gauss_points_of_the_columns() -> None:
    stations = Mesh(np.array([0.0, 2.0, 6.0]), np.array([-1.0, 0.0]), 2).stations
    offset = 1 / np.sqrt(3)
    np.testing.assert_allclose(stations, [1 - offset, 1 + offset, 4 - 2 * offset, 4 + 2 * offset])


def test_meshes_that_cannot_be_are_refused_with_a_remedy(strip: Transducer) -> None:
    mesh = strip_mesh(strip, [0.0])
    with pytest.raises(ff.FringeforceError, match=r"order = 0.*take 1 or more"):
        strip_mesh(strip, [0.0], order=0)
    with pytest.raises(ff.FringeforceError, match=r"refined by 0.*1 or more"):
        mesh.refined(0)
    with pytest.raises(ff.FringeforceError, match=r"101 tactels, not 102.*default mesh"):
        paper_mesh(strip, np.linspace(-10e-3, 10e-3, 102))
