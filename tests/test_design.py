"""A design file says what it means, and a wrong one says what to change."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

import fringeforce as ff
from fringeforce.design.files import parse_sensor
from fringeforce.design.shipped import shipped_designs
from fringeforce.design.units import USUAL, _quantity, parse_quantity

SAAD = shipped_designs()["saad"].read_text(encoding="utf-8")


def _edited(*changes: tuple[str, str]) -> str:
    """The paper's design file with some of its text changed."""
    text = SAAD
    for old, new in changes:
        assert text.count(old) >= 1, old
        text = text.replace(old, new, 1)
    return text


def _problems(text: str) -> list[str]:
    """The lines of the one error that a design file raises, its heading apart."""
    with pytest.raises(ff.FringeforceError) as caught:
        parse_sensor(text, source="my.toml")
    assert isinstance(caught.value, ValueError)
    heading, *problems = str(caught.value).split("\n")
    assert heading.startswith("my.toml has ")
    return problems


@pytest.mark.parametrize(
    ("spelling", "unit", "si"),
    [
        ("0.5 mm", "meter", 5e-4),
        ("500 um", "meter", 5e-4),
        ("500 µm", "meter", 5e-4),
        ("11e6 Pa", "pascal", 11e6),
        ("5e-4 meter", "meter", 5e-4),
        ("632.8 nm", "meter", 6.328e-7),
        ("0.6328 micrometer", "meter", 6.328e-7),
        ("11 MPa", "pascal", 11e6),
        ("11 N/mm^2", "pascal", 11e6),
    ],
)
def test_every_usual_spelling_of_a_quantity_is_read(spelling: str, unit: str, si: float) -> None:
    assert parse_quantity(spelling, unit) == pytest.approx(si, rel=1e-14)


_USUAL = [(name, unit) for unit, names in USUAL.items() for name in names]


@given(st.floats(-1e12, 1e12), st.sampled_from(_USUAL))
def test_usual_units_are_read_as_pint_reads_them(number: float, usual: tuple[str, str]) -> None:
    name, unit = usual
    expected = _quantity(f"{number!r} {name}").to(unit).magnitude
    assert parse_quantity(f"{number!r} {name}", unit) == expected


_SCRAPS = ["0.5", "mm", "(", ")", "[", "'", '"', "\\", "%", "e", "1e", "/", "*", "if", "\n", "#"]


@given(st.lists(st.sampled_from(_SCRAPS) | st.characters(), max_size=8).map("".join))
@example("(5 mm")
def test_no_text_gets_past_the_reading_of_a_quantity(text: str) -> None:
    with suppress(ValueError):
        assert isinstance(parse_quantity(text, "meter"), float)


def test_the_papers_tables_are_in_si_units(sensor: ff.Sensor) -> None:
    strip = sensor.transducer
    soft, clear = strip.compliant, strip.photoelastic
    found = [strip.length, strip.width, soft.thickness, soft.youngs_modulus, soft.poissons_ratio]
    np.testing.assert_allclose(found, [25e-3, 2e-3, 0.5e-3, 11e6, 0.49], rtol=1e-15)
    found = [clear.thickness, clear.youngs_modulus, clear.poissons_ratio]
    np.testing.assert_allclose(found, [3e-3, 110e6, 0.42], rtol=1e-15)
    assert clear.strain_optic_coefficient == 0.05
    assert sensor.polariscope.wavelength == pytest.approx(632.8e-9, rel=1e-15)


def test_tactels_and_pixels_are_centred_on_the_strip(sensor: ff.Sensor) -> None:
    np.testing.assert_allclose(sensor.tactels.positions, np.arange(-5, 6) * 1e-3, atol=1e-18)
    pixels, pitch = sensor.pixel_positions, 25e-3 / 2048
    assert len(pixels) == 2048
    np.testing.assert_allclose(pixels[[0, -1]], [pitch / 2 - 12.5e-3, 12.5e-3 - pitch / 2])
    np.testing.assert_allclose(np.diff(pixels), pitch)


LENGTH, NU = 'length = "25 mm"', "poissons_ratio = 0.49"
YOUNG = 'youngs_modulus = "11 MPa"'
COVER_NU = "transducer.compliant.poissons_ratio"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (LENGTH, "", ["transducer.length", "missing", "full length c"]),
        (LENGTH, "length = 25", ["transducer.length", "25", "bare number", '"0.5 mm"']),
        (LENGTH, 'length = "25"', ["transducer.length", "'25'", "no unit", '"0.5 mm"']),
        (LENGTH, 'length = "25 MPa"', ["transducer.length", "'25 MPa'", "meters", '"0.5 mm"']),
        (LENGTH, 'length = "25 mn"', ["transducer.length", "'25 mn'", "meters", '"0.5 mm"']),
        (LENGTH, 'length = "2,5 cm"', ["transducer.length", "'2,5 cm'", "comma", '"0.5 mm"']),
        ('= "0.5 mm"', '= "0.5 m"', ["transducer", "compliant.thickness", "500 mm", "10", "25 mm"]),
        (LENGTH, 'length = "(25 mm"', ["transducer.length", "'(25 mm'", "meters", '"0.5 mm"']),
        (LENGTH, 'length = "-25 mm"', ["transducer.length", "-25 mm", "greater than 0"]),
        (LENGTH, 'length = "nan mm"', ["transducer.length", "nan", "finite"]),
        (LENGTH, 'length = "1e400 mm"', ["transducer.length", "1e400 mm", "finite"]),
        (LENGTH, "length = true", ["transducer.length", "True", "number"]),
        (LENGTH, LENGTH + "\ncolour = 3", ["transducer.colour", "not a key", "'width'"]),
        (
            YOUNG,
            'youngs_modulus = "11 mm"',
            ["transducer.compliant.youngs_modulus", "'11 mm'", "pascals", '"11 MPa"'],
        ),
        (
            YOUNG,
            'youngs_modulus = "-1 Pa"',
            ["transducer.compliant.youngs_modulus", "-1", "greater than 0"],
        ),
        (NU, "poissons_ratio = 0.5", [COVER_NU, "0.5", "less than 0.5"]),
        (NU, "poissons_ratio = -1", [COVER_NU, "-1", "greater than -1"]),
        (NU, "poissons_ratio = nan", [COVER_NU, "nan", "finite"]),
        ('"free" ', '"fixed" ', ["transducer.edges", "'fixed'", "'free'", "'roller'"]),
        ("count = 11", "count = 26", ["tactels", "26", "1 mm", "12.5 mm", "fewer tactels"]),
        ('"1 mm"', '"2.5 mm"', ["tactels", "11", "2.5 mm", "12.5 mm", "smaller pitch"]),
        ("count = 11", "count = 11.5", ["tactels.count", "11.5", "whole number"]),
        ("count = 11", "count = 0", ["tactels.count", "0", "1 or more"]),
        ("bits = 8 ", "bits = 17 ", ["camera.bits", "17", "16 or less"]),
        ("noise = 5 ", "noise = -1 ", ["camera.noise", "-1", "0"]),
        ("noise = 5 ", "noise = 6 ", ["camera", "256", "255", "lower the amplitude by 1"]),
        ("offset = 5 ", "offset = 4 ", ["camera", "4", "5", "raise the offset to 5"]),
        ('"uniform" ', '"poisson" ', ["camera.noise_model", "'poisson'", "'gaussian'"]),
        ('name = "', 'name = 3 # "', ["name", "3", "text"]),
    ],
)
def test_a_wrong_key_is_one_line_with_path_value_limit_and_remedy(
    old: str, new: str, words: list[str]
) -> None:
    (problem,) = _problems(_edited((old, new)))
    assert problem.split()[0].rstrip(":") == words[0]
    assert all(word in problem for word in words[1:]), problem


def test_a_misspelt_key_is_named_with_the_right_spelling() -> None:
    lost, unknown = _problems(_edited((LENGTH, 'lengthe = "25 mm"')))
    assert "transducer.length is missing" in lost
    assert "'lengthe'" in lost
    assert "transducer.lengthe" in unknown
    assert "did you mean 'length'" in unknown


def test_gaussian_noise_counts_its_mean_only_against_the_converter() -> None:
    gaussian = ('noise_model = "uniform"', 'noise_model = "gaussian"')
    sensor = parse_sensor(_edited(gaussian, ("noise = 5 ", "noise = 9 ")))
    assert sensor.camera.noise == 9
    (problem,) = _problems(_edited(gaussian, ("amplitude = 245", "amplitude = 253")))
    assert "258 exceeds" in problem


def test_single_places_take_the_place_of_the_pitch_and_survive_the_round_trip() -> None:
    places = ", ".join(f'"{x} mm"' for x in (-5.1, -4, -3, -2, -1.02, 0, 1, 2, 3, 4.05, 5))
    sensor = parse_sensor(_edited(('pitch = "1 mm"', f'pitch = "1 mm"\npositions = [{places}]')))
    assert sensor.tactels.positions[[0, 4, 9]] == pytest.approx([-5.1e-3, -1.02e-3, 4.05e-3])
    assert parse_sensor(sensor.to_toml()) == sensor
    moved = sensor.replace(**{"tactels.positions": sensor.tactels.positions + 1e-4})
    np.testing.assert_array_equal(moved.tactels.positions, sensor.tactels.positions + 1e-4)


@pytest.mark.parametrize(
    ("places", "words"),
    [
        ('"0 mm"', ["tactels", "1 positions", "count = 11", "one for every tactel"]),
        (", ".join(['"1 mm"'] * 11), ["tactels", "ascend", "tactel 2", "1 mm", "sort"]),
        (", ".join(f'"{x} mm"' for x in range(5, 16)), ["tactels", "15 mm", "12.5 mm", "nearer"]),
        ('"0 mm", 3', ["tactels.positions.1", "3", "bare number", '"0.5 mm"']),
    ],
)
def test_wrong_places_are_named_with_their_remedy(places: str, words: list[str]) -> None:
    (problem,) = _problems(_edited(('pitch = "1 mm"', f'pitch = "1 mm"\npositions = [{places}]')))
    assert all(word in problem for word in words), problem


def test_all_problems_come_in_one_message() -> None:
    problems = _problems(
        _edited((LENGTH, "length = 25"), (NU, "poissons_ratio = 0.7"), ("bits = 8 ", "bits = 99 "))
    )
    assert [line.split()[0] for line in problems] == ["transducer.length", COVER_NU, "camera.bits"]


def test_text_that_is_no_toml_is_named_with_its_line() -> None:
    with pytest.raises(ff.FringeforceError, match=r"my.toml is not a TOML file.*line 1"):
        parse_sensor("name = \n", source="my.toml")


def test_a_design_that_does_not_exist_is_named_with_its_nearest() -> None:
    with pytest.raises(ff.FringeforceError, match=r"'sad'.*did you mean 'saad'"):
        ff.load_sensor("sad")


@pytest.mark.parametrize("name", shipped_designs())
def test_a_shipped_design_survives_the_round_trip(name: str) -> None:
    sensor = ff.load_sensor(name)
    assert parse_sensor(sensor.to_toml()) == sensor
    awkward = sensor.replace(name='"\\\x7f\n\x00µ')
    assert parse_sensor(awkward.to_toml()) == awkward


_sizes = st.floats(1e-12, 1e12)


@settings(max_examples=30, deadline=None)  # spelling eight quantities takes pint a while
@given(
    name=st.text(),
    sizes=st.tuples(*[_sizes] * 8),
    nu=st.floats(-1, 0.5, exclude_min=True, exclude_max=True),
    count=st.integers(1, 1000),
    bits=st.integers(1, 16),
    share=st.floats(0.01, 0.49),
)
def test_any_design_survives_the_round_trip(
    name: str, sizes: tuple[float, ...], nu: float, count: int, bits: int, share: float
) -> None:
    length, width, a, e1, b, e2, strain_optic, wavelength = sizes
    length = max(length, a, b)  # a layer much thicker than the strip is long is refused
    wavelength = min(wavelength, 1e-3)  # so is light that is none
    full = 2**bits - 1
    soft = {"thickness": a, "youngs_modulus": e1, "poissons_ratio": nu}
    clear = {"thickness": b, "youngs_modulus": e2, "poissons_ratio": -nu / 2}
    sensor = ff.load_sensor("saad").replace(
        name=name,
        transducer={
            "length": length,
            "width": width,
            "compliant": soft,
            "photoelastic": clear | {"strain_optic_coefficient": strain_optic},
        },
        tactels={"count": count, "pitch": length / (count + 1)},
        polariscope={"wavelength": wavelength},
        camera={
            "bits": bits,
            "amplitude": full * (1 - 2 * share),
            "offset": full * share,
            "noise": full * share / 2,
        },
    )
    assert parse_sensor(sensor.to_toml()) == sensor


def test_a_sensor_cannot_be_changed_in_place(sensor: ff.Sensor) -> None:
    for part, key in ((sensor, "name"), (sensor.transducer, "length"), (sensor.camera, "bits")):
        with pytest.raises(ValidationError, match="frozen"):
            setattr(part, key, getattr(part, key))


def test_replace_takes_dotted_and_nested_values_in_si_or_text(sensor: ff.Sensor) -> None:
    dotted = sensor.replace(**{"transducer.compliant.thickness": 4e-4, "tactels.count": 9})
    nested = sensor.replace(
        transducer={"compliant": {"thickness": "0.4 mm"}}, tactels={"count": np.int64(9)}
    )
    assert dotted == nested
    assert dotted.transducer.compliant.thickness == 4e-4
    assert dotted.transducer.compliant.youngs_modulus == 11e6
    assert sensor.transducer.compliant.thickness == 5e-4


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"transduser.edges": "roller"}, ["transduser.edges", "did you mean 'transducer'"]),
        ({"transducer.edgez": "roller"}, ["transducer.edgez", "did you mean 'edges'"]),
        ({"transducer": {"edges": "glued"}}, ["transducer.edges", "'glued'", "'roller'"]),
        ({"transducer": 3}, ["transducer = 3", "table"]),
        ({"transducer.length": "5 mm"}, ["tactels", "2.5 mm", "longer strip"]),
        ({"transducer.length": float("nan")}, ["transducer.length", "nan", "finite"]),
    ],
)
def test_a_change_that_makes_no_sensor_is_refused(
    sensor: ff.Sensor, changes: dict, words: list[str]
) -> None:
    with pytest.raises(ff.FringeforceError) as caught:
        sensor.replace(**changes)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_replace_reaches_into_lists_by_number(sensor: ff.Sensor) -> None:
    lights = [{"wavelength": "635 nm"}, {"wavelength": "525 nm", "amplitude": 150.0}]
    colours = sensor.replace(
        **{"polariscope.channels": lights, "polariscope.crosstalk": "5 +/- 2 %"}
    )
    path, share = "polariscope.channels.1.amplitude", "polariscope.crosstalk.0.1"
    changed = colours.replace(**{path: "140 +/- 3 %", share: "0.03 +/- 0.01"})
    assert [one.amplitude for one in changed.polariscope.channels] == [None, 140.0]
    assert changed.polariscope.crosstalk == ((0.0, 0.03), (0.05, 0.0))
    assert changed.tolerances == {path: 0.03 * 140, share: 0.01, "polariscope.crosstalk.1.0": 0.02}
    assert colours.polariscope.channels[1].amplitude == 150.0
    with pytest.raises(ff.FringeforceError, match="no '2' in a list of 2"):
        colours.replace(**{"polariscope.channels.2.amplitude": 100.0})
    with pytest.raises(ff.FringeforceError, match="1 of the list is a number"):
        colours.replace(**{"polariscope.crosstalk.0.1.2": 0.1})


@pytest.mark.parametrize(
    ("name", "changes", "text"),
    [
        ("saad", {"camera.shift": "30 mm"}, r"beside the strip.* 17\.\d+ mm to 42\.\d+ mm"),
        ("saad", {"camera.shift": "0 +/- 5 mm"}, r"0 \+/- 5 mm.* no pixel surely sees"),
        ("pad", {"camera.shift_x": "-26 mm"}, r"shift_x = -26 mm.* 12\.5 mm from its middle"),
    ],
)
def test_a_camera_looks_at_its_sensor(name: str, changes: dict[str, str], text: str) -> None:
    with pytest.raises(ff.FringeforceError, match=text):
        ff.load_sensor(name).replace(**changes)
    nearer = dict.fromkeys(changes, "3 mm")
    assert ff.load_sensor(name).replace(**nearer)
