"""Benches of strips that are solved in three dimensions, with frames from finer bricks."""

from dataclasses import replace

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.mechanics.solid.strip import STRIP
from fringeforce.models.strip_width import strip_width

EFFECT = "transducer.photoelastic.strain_optic_coefficient"
FINER = replace(STRIP, load=0.8, surface=0.3)


@pytest.fixture(scope="module")
def drawing() -> ff.Sensor:
    """A short strip seen beside its middle, where either plane is far off."""
    solid = {"plane": "3d", "length": "4 mm", "width": "2 mm"}
    camera = {"pixels": 512, "line_position": "0.5 mm"}
    return ff.load_sensor("saad").replace(
        transducer=solid, tactels={"count": 2, "pitch": "2 mm"}, camera=camera
    )


@pytest.fixture(scope="module")
def bench(drawing: ff.Sensor) -> ff.SensorModel:
    """The sensor that is on the bench."""
    made = drawing.replace(**{EFFECT: 0.054})
    fine = strip_width(made, FINER)
    return ff.SensorModel(made, fine.breaks, fine.psi)


def test_a_strip_in_three_dimensions_is_calibrated(
    drawing: ff.Sensor, bench: ff.SensorModel
) -> None:
    # all forces share the errors of one calibration, so that the share inside is no binomial number
    rng = np.random.default_rng(0)
    loads = rng.uniform(0.5, 3.0, (16, 2, 2)) * [1.0, 0.3]
    model = ff.calibrate(drawing, bench.expose(loads, rng=rng), loads, [EFFECT])
    assert model.calibration is not None
    assert model.calibration.usable
    assert model.sensor.transducer.photoelastic.strain_optic_coefficient == pytest.approx(
        0.054, rel=0.02
    )
    forces = rng.uniform(0.2, 1.5, (40, 2, 2)) * [1.0, 0.3]
    batch = ff.Reader(model).read_batch(bench.expose(forces, rng=rng))
    assert (batch.status == ff.Status.OK).mean() > 0.9
    assert (np.abs(batch.forces - forces) < 1.96 * batch.std).mean() > 0.85
    assert (np.abs(batch.forces - forces) < 5 * batch.std).all()


def test_contacts_beside_their_tactels_are_read_in_three_dimensions(
    drawing: ff.Sensor, bench: ff.SensorModel
) -> None:
    rng = np.random.default_rng()
    made = bench.sensor
    stated = made.replace(**{"tactels.placement": "0 +/- 0.1 mm"})
    reader = ff.Reader(ff.characterize(stated))
    beside = rng.normal(0.0, 0.1e-3, 2)
    moved = made.replace(tactels={"positions": (made.tactels.positions + beside).tolist()})
    fine = strip_width(moved, FINER)
    forces = rng.uniform(0.5, 1.5, (20, 2, 2)) * [1.0, 0.3]
    batch = reader.read_batch(ff.SensorModel(moved, fine.breaks, fine.psi).expose(forces, rng=rng))
    assert set(batch.status) <= {ff.Status.OK, ff.Status.AMBIGUOUS}
    good = batch.status == ff.Status.OK
    assert good.mean() > 0.5
    off = np.abs((batch.forces - forces) / batch.std)[good]
    assert (off < 3).mean() > 0.9
    assert off.max() < 10  # the bricks of reader and frames differ


def test_a_skin_in_three_dimensions_reads_a_contact(drawing: ff.Sensor) -> None:
    skin = drawing.replace(skin={"extent": "3 mm"})
    model = ff.characterize(skin)
    press = ff.Press(x=0.6e-3, normal=1.5, tangential=0.2, width=0.5e-3)
    reading = ff.Reader(model).read(model.expose([press], rng=np.random.default_rng()))
    assert reading.status is ff.Status.OK
    total = reading.total
    assert total is not None
    assert np.abs(total.force - [1.5, 0.2]).max() < 0.06
    assert np.abs(np.subtract(total.centre, 0.6e-3)).max() < 0.05e-3
