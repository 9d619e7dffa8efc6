"""Loads that strain a sensor further than its model covers are named where they are simulated."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import fringeforce as ff
from commands import run
from fringeforce.base.errors import LargeStrainWarning
from fringeforce.models.strain_limit import strain_words

SAAD, MODULUS = ff.load_sensor("saad"), 11e6


def on_one(newtons: float) -> np.ndarray:
    forces = np.zeros((2, 11, 2))
    forces[1, 5, 0] = newtons
    return forces


def test_the_limit_is_a_tenth_of_the_modulus_over_the_area_of_a_tactel() -> None:
    limit = 0.1 * MODULUS * 1e-3 * 2e-3
    assert strain_words(SAAD, on_one(0.999 * limit)) == ""
    words = strain_words(SAAD, on_one(10 * limit))
    assert "22 N on tactel 6 strains the cover by about 100 %" in words
    assert "holds up to 10 %, or 2.2 N there" in words
    assert 'strain = "finite"' in words


def test_a_strip_of_finite_strain_has_no_such_limit() -> None:
    sensor = SAAD.replace(**{"transducer.strain": "finite", "tactels.contact_width": "0.5 mm"})
    assert strain_words(sensor, on_one(1000.0)) == ""


@pytest.mark.parametrize(
    ("press", "area"),
    [
        (ff.Press(x=0, normal=1, width=2e-3), 2e-3 * 2e-3),
        (ff.Press(x=0, normal=1, width=4e-4), 1e-3 * 2e-3),  # over one pitch
        (ff.Press(x=0, normal=1), 1e-3 * 2e-3),
        (ff.Press(x=0, normal=1, radius=4e-3), 8e-3 * 2e-3),
    ],
)
def test_a_contact_strains_what_is_below_it(press: ff.Press, area: float) -> None:
    limit = 0.1 * MODULUS * area
    below, above = (
        ff.Press(x=0, normal=share * limit, width=press.width, radius=press.radius)
        for share in (0.99, 1.01)
    )
    assert strain_words(SAAD, [[], [below]]) == ""
    assert "in a contact" in strain_words(SAAD, [[below], [above]])


def test_a_contact_on_a_pad_is_round_or_a_rectangle() -> None:
    pad = ff.load_sensor("pad")
    limit = 0.1 * pad.transducer.compliant.youngs_modulus * 4e-3 * 3e-3
    round_limit = np.pi / 4 * limit
    for outline, most in (("ellipse", round_limit), ("rectangle", limit)):
        for share, wrong in ((0.99, False), (1.01, True)):
            press = ff.Press(x=0, y=0, normal=share * most, width=(4e-3, 3e-3), outline=outline)
            assert bool(strain_words(pad, [press])) is wrong
    assert "finite" not in strain_words(pad, [ff.Press(x=0, y=0, normal=99, width=1e-3)])


def test_expose_warns_unless_small_strain_was_asked_for(model: ff.SensorModel) -> None:
    with pytest.warns(LargeStrainWarning, match="2000 N on tactel 6") as told:
        model.expose(on_one(2000.0), rng=0)
    assert len(told) == 1
    assert told[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model.expose(on_one(2000.0), rng=0, strain="linear")
        model.expose(on_one(1.0), rng=0)


def test_simulate_says_so_once_and_writes_its_frames(model: ff.SensorModel, tmp_path: Path) -> None:
    model.save(tmp_path / "m.h5")
    rows = "".join(f"{frame},6,2000,0\n" for frame in range(3))
    (tmp_path / "f.csv").write_text(f"frame,tactel,normal_N,tangential_N\n{rows}")
    said = run("simulate", "m.h5", "f.csv", "-o", "f.h5", cwd=tmp_path)
    assert said.returncode == 0
    assert said.stdout.count("strains the cover") == 1
    assert said.stderr == ""
    assert (tmp_path / "f.h5").exists()
