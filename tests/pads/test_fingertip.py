"""The shipped soft fingertip: presses of 0.05 to 2 N anywhere, by contact mechanics, read back."""

from pathlib import Path

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.design.materials import materials
from fringeforce.io.bench_loads import load_bench_loads
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_presses import pad_tractions
from fringeforce.studies.summary import summary

FAR = 5.0
"""Deviations: beyond them lies one in two million."""


@pytest.fixture(scope="module")
def model() -> PadModel:
    found = ff.characterize(ff.load_sensor("fingertip"))
    assert isinstance(found, PadModel)
    return found


@pytest.fixture(scope="module")
def reader(model: PadModel) -> ff.Reader:
    return ff.Reader(model)


def test_its_numbers_are_those_of_the_table_of_materials() -> None:
    block, known = ff.load_sensor("fingertip").transducer, materials()
    silicone, urethane = known["rtv615"].values, known["urethane-rubber"].values
    assert silicone["youngs_modulus"].startswith(f"{block.compliant.youngs_modulus / 1e6:g} MPa")
    assert urethane["youngs_modulus"].startswith(f"{block.photoelastic.youngs_modulus / 1e6:g} MPa")
    assert urethane["fringe_value"].startswith("0.175 N/mm")
    assert urethane["wavelength"] == "546.1 nm"
    # f = wavelength / C
    assert block.photoelastic.stress_optic == pytest.approx(546.1e-9 / 175, rel=2e-3)


PRESSES = {
    "a touch": ff.Press(x=1.7e-3, y=-2.2e-3, normal=0.05, tangential=(0.01, 0.01), radius=4e-3),
    "a ball": ff.Press(x=-1.1e-3, y=0.6e-3, normal=0.4, tangential=(0.0, -0.2), radius=2e-3),
    # which leaves no place that is far from it
    "a push in the middle": ff.Press(x=0, y=0, normal=2.0, tangential=(0.8, 0.3), radius=8e-3),
    "an edge": ff.Press(x=0.3e-3, y=1e-3, normal=1.0, width=(3e-3, 1e-3), angle=70.0),
}


@pytest.mark.parametrize("name", list(PRESSES))
def test_soft_presses_are_read_to_a_hundredth(
    model: PadModel, reader: ff.Reader, name: str
) -> None:
    press = PRESSES[name]
    places, forces = pad_tractions(model.sensor, press)
    reading = reader.search(model.expose([press], rng=5))
    assert reading.status is ff.Status.OK
    (one,) = reading.contacts
    centre = forces[:, 0] @ places / forces[:, 0].sum()
    off = np.concatenate([one.force - forces.sum(axis=0), one.centre - centre])
    std = one.std[[0, 1, 2, 6, 7]]
    assert (np.abs(off) < FAR * std).all()
    assert (std[:3] < 0.01 * press.normal).all()
    assert (std[3:] < 0.02e-3).all()


def test_a_summary_says_how_well_contacts_are_read(model: PadModel) -> None:
    facts = dict(summary(model))
    assert facts["skin"] == "10.5 mm x 10.5 mm, forces also on 5 x 5 squares of 2.1 mm"
    words = facts["standard deviation of a contact of 1 N, one frame"]
    normal = float(words.split(" mN")[0])
    assert 0.1 < normal < 10


def test_nothing_bounds_the_deviations_of_a_skin_that_nothing_touches(reader: ff.Reader) -> None:
    assert np.isinf(reader.bound(np.zeros((25, 3)))).all()


def test_presses_come_from_a_table_by_place(
    model: PadModel, reader: ff.Reader, tmp_path: Path
) -> None:
    rows = (
        "frame,x_mm,y_mm,normal_N,tangential_x_N,tangential_y_N,radius_mm,width_mm",
        "0,1.2,-0.7,0.5,0.1,0,5,",
        "0,-2.5,1.5,0.3,0,-0.05,,1.5",
        "2,0.3,0.2,1.0,0.2,0.1,,2",
    )
    (tmp_path / "presses.csv").write_text("\n".join(rows))
    loads = load_bench_loads(tmp_path / "presses.csv", model.sensor)
    assert isinstance(loads, BenchLoads)
    first, nothing, last = loads.presses()
    ball, patch = first
    assert (ball.radius, ball.width, patch.radius, patch.width) == (5e-3, None, None, 1.5e-3)
    assert not nothing
    assert last == [ff.Press(x=3e-4, y=2e-4, normal=1.0, tangential=(0.2, 0.1), width=2e-3)]
    (strong, weak) = reader.search(model.expose(first, rng=0)).contacts
    for one, (*place, normal, along, across) in (
        (strong, (1.2e-3, -0.7e-3, 0.5, 0.1, 0.0)),
        (weak, (-2.5e-3, 1.5e-3, 0.3, 0.0, -0.05)),
    ):
        assert (np.abs(one.force - [normal, along, across]) < FAR * one.std[:3]).all()
        assert (np.abs(one.centre - place) < FAR * one.std[6:8]).all()
