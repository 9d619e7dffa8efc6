"""A design file is read exactly, and every mistake in it is named with its remedy."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

import fringeforce as ff
from fringeforce.design import parse_sensor, shipped_designs

TEXT = shipped_designs()["saad"].read_text(encoding="utf-8")


def changed(key: str, value: str | None) -> str:
    """The paper's design with one line changed, or dropped."""
    pattern = rf"^{key} = .*$"
    assert re.search(pattern, TEXT, flags=re.MULTILINE)
    line = "" if value is None else f"{key} = {value}"
    return re.sub(pattern, line, TEXT, count=1, flags=re.MULTILINE)


def test_the_papers_design_has_the_papers_tables(sensor: ff.Sensor) -> None:
    strip = sensor.transducer
    assert (strip.length, strip.width) == (25e-3, 2e-3)
    assert (strip.compliant.thickness, strip.photoelastic.thickness) == (0.5e-3, 3e-3)
    assert (strip.compliant.youngs_modulus, strip.photoelastic.youngs_modulus) == (11e6, 110e6)
    assert (strip.compliant.poissons_ratio, strip.photoelastic.poissons_ratio) == (0.49, 0.42)
    assert sensor.tactels.positions[[0, 5, 10]] == pytest.approx([-5e-3, 0, 5e-3])
    assert sensor.pixel_positions[[0, -1]] == pytest.approx([-12.493896e-3, 12.493896e-3])


@pytest.mark.parametrize("text", ["0.5 mm", "500 um", "500 µm", "0.05 cm", "5e-4 m", "0.5mm"])
def test_lengths_in_any_spelling_are_one(text: str) -> None:
    sensor = parse_sensor(changed("thickness", f'"{text}"'))
    assert sensor.transducer.compliant.thickness == pytest.approx(0.5e-3, rel=1e-12)


@pytest.mark.parametrize("text", ["11 MPa", "11e6 Pa", "0.011 GPa", "110 bar", "11 N/mm^2"])
def test_moduli_in_any_spelling_are_one(text: str) -> None:
    sensor = parse_sensor(changed("youngs_modulus", f'"{text}"'))
    assert sensor.transducer.compliant.youngs_modulus == pytest.approx(11e6, rel=1e-12)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("pitch", None, ["tactels.pitch", "missing"]),
        ("pitch", '"1 mm"\npich = 3', ["tactels.pich", "did you mean 'pitch'"]),
        ("length", "25", ["transducer.length", "25", "bare number", '"0.5 mm"']),
        ("length", '"25 MPa"', ["transducer.length", "25 MPa", "meters"]),
        ("length", '"-25 mm"', ["transducer.length", "-25 mm", "greater than 0"]),
        ("length", '"nan mm"', ["transducer.length", "nan"]),
        ("length", '"inf mm"', ["transducer.length", "inf", "finite"]),
        ("youngs_modulus", '"11 mm"', ["compliant.youngs_modulus", "11 mm", "pascals"]),
        ("poissons_ratio", "0.5", ["compliant.poissons_ratio", "0.5", "less than 0.5"]),
        ("poissons_ratio", "-1.0", ["compliant.poissons_ratio", "greater than -1"]),
        ("edges", '"glued"', ["transducer.edges", "glued", "'free' or 'roller'"]),
        ("count", "0", ["tactels.count", "0", "1 or more"]),
        ("count", "26", ["tactels", "26", "12.5 mm", "fewer tactels"]),
        ("noise", "9", ["camera", "259", "255", "lower the amplitude"]),
        ("offset", "2", ["camera", "offset = 2", "raise the offset"]),
        ("bits", "17", ["camera.bits", "17", "16"]),
    ],
)
def test_a_mistake_is_named_with_its_limit(key: str, value: str | None, words: list[str]) -> None:
    with pytest.raises(ff.FringeforceError) as caught:
        parse_sensor(changed(key, value))
    assert isinstance(caught.value, ValueError)
    message = str(caught.value)
    assert all(word in message for word in words), message
    assert "has a problem" in message


def test_all_mistakes_come_in_one_message() -> None:
    text = TEXT.replace('"25 mm"', "25").replace("0.49", "0.7").replace("count = 11", "count = -1")
    with pytest.raises(ff.FringeforceError) as caught:
        parse_sensor(text)
    assert "3 problems" in str(caught.value)
    assert len(str(caught.value).splitlines()) == 4


def test_text_that_is_no_toml_is_named_by_its_place() -> None:
    with pytest.raises(ff.FringeforceError, match="line 2"):
        parse_sensor('name = "x"\nlength = = 3')


@pytest.mark.parametrize("name", sorted(shipped_designs()))
def test_designs_come_back_from_their_own_text(name: str) -> None:
    sensor = ff.load_sensor(name)
    assert parse_sensor(sensor.to_toml()) == sensor


@given(st.floats(1e-6, 1e3), st.floats(1.0, 1e12), st.floats(-0.99, 0.49), st.floats(1e-9, 1e-3))
def test_any_number_comes_back_bit_by_bit(sensor, length, modulus, ratio, wavelength) -> None:
    made = sensor.replace(
        transducer={"width": length, "compliant": {"youngs_modulus": modulus}},
        polariscope={"wavelength": wavelength},
        **{"transducer.photoelastic.poissons_ratio": ratio},
    )
    assert parse_sensor(made.to_toml()) == made


def test_dotted_and_nested_changes_are_the_same(sensor: ff.Sensor) -> None:
    dotted = sensor.replace(**{"transducer.compliant.thickness": "1 mm", "tactels.count": 5})
    nested = sensor.replace(transducer={"compliant": {"thickness": 1e-3}}, tactels={"count": 5})
    assert dotted == nested != sensor


def test_a_change_of_nothing_that_exists_is_refused(sensor: ff.Sensor) -> None:
    with pytest.raises(ff.FringeforceError, match="did you mean 'transducer'"):
        sensor.replace(**{"transduce.length": "1 mm"})
    with pytest.raises(ff.FringeforceError, match="not a key"):
        sensor.replace(**{"transducer.lenght": "1 mm"})


def test_a_design_is_frozen(sensor: ff.Sensor) -> None:
    with pytest.raises(ValueError, match="frozen"):
        sensor.name = "other"


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(ff.FringeforceError, match="'saad'"):
        ff.load_sensor("sad")
