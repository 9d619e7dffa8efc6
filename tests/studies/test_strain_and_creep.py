"""Studies of large strain and creep: orders of what is left, and what a held load leaves."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import fringeforce as ff
from fringeforce.cli import app
from fringeforce.studies.creep import creep_study
from fringeforce.studies.strain import strain_study

TERMS = [(0.06, 0.4), (0.04, 15.0)]


@pytest.fixture(scope="module")
def short() -> ff.Sensor:
    """A short strip of three tactels under a small camera."""
    return ff.load_sensor("saad").replace(
        transducer={"length": "9 mm"},
        tactels={"count": 3, "pitch": "1.5 mm"},
        camera={"pixels": 512},
    )


def _column(rows: tuple[tuple[str, ...], ...], number: int) -> np.ndarray:
    return np.array([float(row[number].rstrip("%")) for row in rows])


def test_what_the_orders_leave_grows_by_their_power(short: ff.Sensor) -> None:
    found = strain_study(short, loads=(1.0, 2.0))
    load, linear, second = (_column(found.rows, k) for k in (0, 2, 3))
    # relative to the peak, linear theory leaves the first power of the load, its second order the
    # second
    for off, power in ((linear, 1.0), (second, 2.0)):
        slope = np.polyfit(np.log(load), np.log(off), 1)[0]
        assert slope == pytest.approx(power, abs=0.4)
    assert (second < linear).all()
    assert "second order up to" in found.text


def test_a_strip_that_creeps_is_read_with_its_relaxation(short: ff.Sensor) -> None:
    stated = [{"share": share, "time": time} for share, time in TERMS]
    found = creep_study(short.replace(**{"transducer.relaxation": stated}))
    rows = {row[0]: row[1:] for row in found.rows}
    # Maxwell's body holds a modulus of 1 - g: strain grows by 1 / (1 - sum g) under a load that
    # lasts (Tschoegl, The Phenomenological Theory of Linear Viscoelastic Behavior, 1989)
    true, without, compensated = (float(value) for value in rows["60"])
    assert without / true == pytest.approx(1 / (1 - 0.1), rel=0.02)
    assert compensated / true == pytest.approx(1.0, rel=0.01)


def test_studies_need_what_they_ask_about(sensor: ff.Sensor) -> None:
    with pytest.raises(ff.FringeforceError, match="relaxation ="):
        creep_study(sensor)
    with pytest.raises(ff.FringeforceError, match='plane = "stress"'):
        strain_study(sensor.replace(**{"transducer.plane": "3d"}))


def test_the_command_draws_what_creep_leaves(short: ff.Sensor, tmp_path: Path) -> None:
    stated = short.replace(**{"transducer.relaxation": [["6 %", "0.4 s"]]})
    design = tmp_path / "soft.toml"
    design.write_text(stated.to_toml())
    words = ["study", "creep", str(design), "--out", str(tmp_path / "out"), "--workers", "0"]
    assert CliRunner().invoke(app, words).exit_code == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "creep.csv",
        "creep.png",
        "creep.txt",
    ]
