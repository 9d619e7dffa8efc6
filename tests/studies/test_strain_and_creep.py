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
    return np.array([float(row[number]) for row in rows])


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


def test_two_equal_channels_halve_the_variance_and_leave_the_error(short: ff.Sensor) -> None:
    """They see the same fringes, so that light of the one in the other changes nothing either."""
    twice = short.replace(
        **{"polariscope.channels": [{"bias": 0}, {"bias": 0}], "polariscope.crosstalk": "20 %"}
    )
    one, two = (strain_study(each, loads=(1.0,)) for each in (short, twice))
    for column in (2, 3, 4, 5):
        assert _column(two.rows, column) == pytest.approx(_column(one.rows, column), rel=0.05)
    for column in (6, 7):
        ratio = _column(two.rows, column) / _column(one.rows, column)
        assert ratio == pytest.approx(np.sqrt(2), rel=0.1)  # of figures of two digits


@pytest.fixture(scope="module")
def soft() -> ff.Sensor:
    """A soft skin under a small camera."""
    return ff.load_sensor("soft-skin").replace(camera={"pixels": 512})


def test_linear_theory_of_a_contact_errs_by_the_load_and_the_solution_hardly(
    soft: ff.Sensor,
) -> None:
    found = strain_study(soft, loads=(0.1, 0.2), width=1e-3)
    load, linear, solved, forces = (_column(found.rows, k) for k in (0, 2, 3, 4))
    slope = np.polyfit(np.log(load), np.log(linear), 1)[0]
    assert slope == pytest.approx(1.0, abs=0.2)
    # elements of the fourth order, CELL wide, leave 2 % of what strain adds
    assert (solved < 0.03 * linear).all()
    assert (np.diff(forces) > 0).all()
    assert "1 mm wide" in found.text
    assert "solved up to 0.2 N" in found.text


@pytest.mark.slow
def test_a_linear_reader_of_a_contact_is_off_by_what_the_study_says(soft: ff.Sensor) -> None:
    load, width = 0.2, 1e-3
    told = _column(strain_study(soft, loads=(load,), width=width).rows, 6)[0]
    small = ff.characterize(soft.replace(**{"transducer.strain": "linear"}))
    normal, tangential = ff.polar(load, 10, n=1)[0].tolist()
    press = ff.Press(x=0.0, normal=normal, tangential=tangential, width=width, profile="flat")
    reader, moved = ff.Reader(small), list[float]()
    for seed in range(6):
        places = list[float]()
        for strain in ("finite", "linear"):
            total = reader.search(small.expose([press], rng=seed, strain=strain)).total
            assert total is not None
            places.append(total.centre[0] / total.std[5])
        moved.append(places[0] - places[1])  # the same noise in both
    # to first order in the error of the phase, which is 3 % of some radians here
    assert abs(np.mean(moved)) == pytest.approx(told, rel=0.25)


def test_a_contact_that_folds_the_skin_or_has_no_width_is_refused(soft: ff.Sensor) -> None:
    with pytest.raises(ff.FringeforceError, match="Not even 5 N of the contact"):
        strain_study(soft, loads=(5.0,))
    with pytest.raises(ff.FringeforceError, match="must be above zero"):
        strain_study(soft, width=0.0)


def test_a_strip_that_creeps_is_read_with_its_relaxation(short: ff.Sensor) -> None:
    stated = [{"share": share, "time": time} for share, time in TERMS]
    found = creep_study(short.replace(**{"transducer.relaxation": stated}))
    rows = {row[0]: row[1:] for row in found.rows}
    # Maxwell's body holds a modulus of 1 - g: strain grows by 1 / (1 - sum g) under a load that
    # lasts (Tschoegl, The Phenomenological Theory of Linear Viscoelastic Behavior, 1989)
    true, without, compensated = (float(value) for value in rows["60"])
    assert without / true == pytest.approx(1 / (1 - 0.1), rel=0.02)
    assert compensated / true == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize(
    ("path", "ratio"),
    [
        # a factor 1 + o of the effect, whatever the moduli do
        ("transducer.photoelastic.optical_creep", 1.1),
        # K_s / (1 - g) of the clear layer, whose stresses a cover of other stiffness spreads anew
        ("transducer.photoelastic.relaxation", 1 / 0.9),
    ],
)
def test_a_strip_of_which_one_layer_creeps_is_read_with_it(
    short: ff.Sensor, path: str, ratio: float
) -> None:
    stated = [{"share": f"{share} +/- 1e-9", "time": time} for share, time in TERMS]
    rows = {row[0]: row[1:] for row in creep_study(short.replace(**{path: stated})).rows}
    true, without, compensated = (float(value) for value in rows["60"])
    assert without / true == pytest.approx(ratio, rel=0.03)
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
