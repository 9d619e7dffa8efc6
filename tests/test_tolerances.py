"""Tolerances stand behind the values of a design, and survive whatever a design survives."""

import json
import pickle

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import fringeforce as ff
from fringeforce.design.files import parse_sensor
from fringeforce.design.shipped import shipped_designs
from fringeforce.design.tolerances import Tolerances, parse_tolerance
from fringeforce.design.units import parse_quantity

SAAD = shipped_designs()["saad"].read_text(encoding="utf-8")
THICKNESS, YOUNG = "transducer.compliant.thickness", "transducer.compliant.youngs_modulus"
REAL = {
    THICKNESS: "0.50 +/- 0.02 mm",
    YOUNG: "11 MPa ± 5 %",
    "tactels.placement": "0 +/- 0.1 mm",
    "tactels.contact_width": "0.4 +/- 0.2 mm",
    "polariscope.bandwidth": "20 nm",
    "polariscope.visibility": "0.97 +/- 0.02",
    "polariscope.residual": "0 +/- 0.1 rad",
    "camera.amplitude": "237 +/- 2 %",
    "camera.drift": "1 %",
    "camera.blur": "12 um +/- 4 um",
    "camera.response": "0.45",
}


@pytest.fixture(scope="module")
def real(sensor: ff.Sensor) -> ff.Sensor:
    """A design with every departure, and a tolerance in lists as well."""
    places = [f"{x} +/- 0.01 mm" for x in range(-5, 6)]
    channels = [{"bias": "0 +/- 2"}, {"bias": 90, "wavelength": "532 +/- 1 nm"}]
    lists = {"tactels.positions": places, "polariscope.channels": channels}
    return sensor.replace(**REAL, **lists)


@pytest.mark.parametrize(
    ("text", "unit", "value", "std"),
    [
        ("0.50 +/- 0.02 mm", "meter", 0.5e-3, 0.02e-3),
        ("0.50±0.02 mm", "meter", 0.5e-3, 0.02e-3),
        ("0.5 mm +/- 20 um", "meter", 0.5e-3, 20e-6),
        ("0.5mm +/- 20um", "meter", 0.5e-3, 20e-6),
        ("5e-4 +/- 2e-5 m", "meter", 0.5e-3, 20e-6),
        ("-5.02 +/- 0.01 mm", "meter", -5.02e-3, 0.01e-3),
        ("11 MPa +/- 5 %", "pascal", 11e6, 0.55e6),
        ("11 N/mm^2 ± 5%", "pascal", 11e6, 0.55e6),
        ("0 +/- 0.1 rad", "radian", 0.0, 0.1),
        ("1 +/- 0.5 deg", "radian", 0.017453292519943295, 0.008726646259971648),
        ("0.97 +/- 0.02", None, 0.97, 0.02),
        ("237 +/- 2 %", None, 237, 4.74),
        ("0.5 mm +/- 0 mm", "meter", 0.5e-3, 0.0),
        ("(0.50 +/- 0.02) mm", "meter", 0.5e-3, 0.02e-3),
        ("(6.0 ± 1.2) %", None, 0.06, 0.012),
        ("6 % +/- 20 %", None, 0.06, 0.012),
    ],
)
def test_every_spelling_of_a_tolerance_is_one_standard_deviation(
    text: str, unit: str | None, value: float, std: float
) -> None:
    nominal, found, deviation = parse_tolerance(text, unit)
    assert found == pytest.approx(value, rel=1e-14)
    assert deviation == pytest.approx(std, rel=1e-14)
    assert (nominal if unit is None else parse_quantity(str(nominal), unit)) == found


@given(
    value=st.floats(1e-9, 1e9),
    share=st.floats(0, 1),
    unit=st.sampled_from(["mm", "um", "nm", "m", ""]),
    sign=st.sampled_from(["+/-", "±", " +/- ", "  ± "]),
)
@example(value=1.0, share=0.0, unit="mm", sign="±")
def test_what_is_written_is_what_is_read(value: float, share: float, unit: str, sign: str) -> None:
    std = value * share
    kind = "meter" if unit else None
    text = f"{value!r}{sign}{std!r} {unit}".rstrip()
    _, found, deviation = parse_tolerance(text, kind)
    scale = {"mm": 1e-3, "um": 1e-6, "nm": 1e-9}.get(unit, 1.0)
    assert found == pytest.approx(value * scale, rel=1e-14)
    assert deviation == pytest.approx(std * scale, rel=1e-14)


def test_values_are_nominal_and_tolerances_are_kept_apart(real: ff.Sensor) -> None:
    assert real.transducer.compliant.thickness == 0.5e-3
    assert type(real.transducer.compliant.thickness) is float
    assert real.tolerances[THICKNESS] == pytest.approx(0.02e-3)
    assert real.tolerances[YOUNG] == pytest.approx(0.55e6)
    assert real.tolerances["camera.amplitude"] == pytest.approx(4.74)
    assert real.tolerances["polariscope.residual"] == 0.1
    assert real.tolerances["tactels.positions.10"] == pytest.approx(0.01e-3)
    assert real.tolerances["polariscope.channels.1.wavelength"] == pytest.approx(1e-9)
    assert "camera.drift" not in real.tolerances
    assert real.camera.drift == 0.01
    with pytest.raises(TypeError):
        real.tolerances[THICKNESS] = 1.0  # pyrefly: ignore[unsupported-operation]


def test_a_file_and_python_say_the_same(sensor: ff.Sensor) -> None:
    text = SAAD.replace('thickness = "0.5 mm"', 'thickness = "0.50 +/- 0.02 mm"', 1)
    assert parse_sensor(text) == sensor.replace(**{THICKNESS: "0.5 mm ± 4 %"})
    assert parse_sensor(text) == sensor.replace(tolerances={THICKNESS: 0.02e-3})
    whole = ff.Sensor(**{**sensor.model_dump(by_alias=True, exclude_none=True), "name": "other"})
    assert whole == sensor.replace(name="other")


def test_numbers_without_a_unit_may_be_texts_as_they_are_with_tolerances() -> None:
    light = 'wavelength = "632.8 nm" '
    plain = parse_sensor(SAAD.replace(light, light + "\nvisibility = 0.95 ", 1))
    for text in ("0.95", " 95 % ", "9.5e-1"):
        assert parse_sensor(SAAD.replace(light, f'{light}\nvisibility = "{text}" ', 1)) == plain


def test_terms_of_relaxation_have_tolerances_in_pairs_as_in_tables(sensor: ff.Sensor) -> None:
    path = "transducer.relaxation"
    pairs = [["6 % +/- 20 %", "0.40 +/- 0.05 s"], ["(4 +/- 1) %", "15 s"]]
    creeping = sensor.replace(**{path: pairs})
    assert creeping == sensor.replace(
        **{path: [dict(zip(("share", "time"), pair, strict=True)) for pair in pairs]}
    )
    assert creeping.tolerances == pytest.approx(
        {f"{path}.0.share": 0.012, f"{path}.0.time": 0.05, f"{path}.1.share": 0.01}
    )
    assert [(term.share, term.time) for term in creeping.transducer.relaxation] == [
        (0.06, 0.4), (0.04, 15.0),
    ]  # fmt: skip
    assert parse_sensor(creeping.to_toml()) == creeping


def test_a_design_survives_every_round_trip(real: ff.Sensor) -> None:
    again = parse_sensor(real.to_toml())
    assert again == real
    assert again.tolerances == real.tolerances
    assert hash(again) == hash(real)
    assert pickle.loads(pickle.dumps(real)) == real
    text = real.model_dump_json(by_alias=True, exclude_none=True)
    assert ff.Sensor.model_validate(json.loads(text)) == real
    assert real != real.replace(**{THICKNESS: "0.5 +/- 0.03 mm"})


def test_a_model_keeps_the_tolerances_in_its_file(sensor: ff.Sensor, tmp_path) -> None:
    changes = {THICKNESS: "0.50 +/- 0.02 mm", "polariscope.residual": "0 +/- 0.1 rad"}
    model = ff.characterize(sensor.replace(**changes))
    model.save(tmp_path / "model.h5")
    assert ff.load_model(tmp_path / "model.h5").sensor == model.sensor


_shares = st.floats(1e-6, 0.3)


@settings(max_examples=30, deadline=None)  # spelling quantities takes pint a while
@given(
    shares=st.tuples(*[_shares] * 4),
    sizes=st.tuples(*[st.floats(1e-6, 1.0)] * 3),
    nu=st.floats(0, 0.4),
)
def test_any_tolerances_survive_the_round_trip(
    shares: tuple[float, ...], sizes: tuple[float, ...], nu: float
) -> None:
    thickness, width, angle = sizes
    sensor = ff.load_sensor("saad").replace(
        **{
            THICKNESS: f"{thickness / 4!r} m +/- {100 * shares[0]!r} %",
            YOUNG: f"{1e6 * shares[1]!r} +/- {1e5 * shares[1]!r} Pa",
            "transducer.compliant.poissons_ratio": f"{nu!r} +/- {0.03 * shares[2]!r}",
            "tactels.placement": f"0 m ± {width!r} mm",
            "polariscope.residual": f"{-angle!r} +/- {shares[3]!r} rad",
        }
    )
    assert len(sensor.tolerances) == 5
    assert parse_sensor(sensor.to_toml()) == sensor


def test_a_design_without_tolerances_says_nothing_of_them(sensor: ff.Sensor) -> None:
    assert sensor.tolerances == Tolerances()
    new = ("tolerance", "visibility", "bandwidth", "residual", "drift", "response", "blur")
    assert not any(word in sensor.to_toml() for word in new)


def test_replace_keeps_sets_and_removes_tolerances(real: ff.Sensor) -> None:
    thinner = real.replace(**{THICKNESS: "0.4 mm"})
    assert thinner.tolerances == real.tolerances
    none = real.replace(**{THICKNESS: "0.4 +/- 0 mm"})
    assert set(real.tolerances) - set(none.tolerances) == {THICKNESS}
    looser = real.replace(transducer={"compliant": {"thickness": "0.5 +/- 0.1 mm"}})
    assert looser.tolerances[THICKNESS] == pytest.approx(0.1e-3)
    even = real.replace(**{"tactels.positions": None, "polariscope.channels": []})
    gone = {path for path in real.tolerances if "positions" in path or "channels" in path}
    assert set(even.tolerances) == set(real.tolerances) - gone


def test_a_pad_has_tolerances_too() -> None:
    pad = ff.load_sensor("pad").replace(
        **{"transducer.compliant.thickness": "1 mm +/- 5 %", "camera.blur": "30 +/- 5 um"}
    )
    assert pad.tolerances["camera.blur"] == pytest.approx(5e-6)
    assert parse_sensor(pad.to_toml()) == pad


LAYER = 'thickness = "0.5 mm"'


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (LAYER, 'thickness = "0.5 mm +/- 0.02"', [THICKNESS, "+/- 0.02'", "without a unit", "5 %"]),
        (LAYER, 'thickness = "0.5 +/- 0.02"', [THICKNESS, "no unit", '"0.5 mm"']),
        (LAYER, 'thickness = "0.5 +/- -0.02 mm"', [THICKNESS, "-0.02 mm", "not negative", "5 %"]),
        (LAYER, 'thickness = "0.5 mm +/- -4 %"', [THICKNESS, "-4 %", "not negative", "5 %"]),
        (LAYER, 'thickness = "0.5 mm +/- nan mm"', [THICKNESS, "nan mm", "finite"]),
        (LAYER, 'thickness = "0.5 mm +/- 3 MPa"', [THICKNESS, "3 MPa", "meters"]),
        (LAYER, 'thickness = "0.5 mm +/- "', [THICKNESS, "0.5 mm"]),
        (LAYER, 'thickness = "+/- 0.1 mm"', [THICKNESS, "0.5 mm"]),
        (
            LAYER,
            'thickness = "0.5 +/- 0.2 mm"',
            [THICKNESS, "too large", "-0.1 mm", "greater than 0", "165 um"],
        ),
        (LAYER, 'thickness = "-0.5 +/- 0.02 mm"', [THICKNESS, "-0.5", "greater than 0"]),
        (
            "poissons_ratio = 0.49",
            'poissons_ratio = "0.49 +/- 0.02"',
            ["transducer.compliant.poissons_ratio", "too large", "0.55", "less than 0.5", "0.0033"],
        ),
        ("noise = 5 ", 'noise = "five +/- 1" ', ["camera.noise", "no number", "0.97 +/- 0.02"]),
        ("count = 11", 'count = "11 +/- 1"', ["tactels.count", "11 +/- 1", "whole number"]),
        (
            'wavelength = "632.8 nm" ',
            'wavelength = "632.8 nm"\nresidual = "0 rad +/- 5 %" ',
            ["polariscope.residual", "share of zero", "0.1 rad"],
        ),
        (
            'wavelength = "632.8 nm" ',
            'wavelength = "632.8 nm"\nresidual = "10 %" ',
            ["polariscope.residual", "10 %", "0.1 rad"],
        ),
        (
            'wavelength = "632.8 nm" ',
            'wavelength = "632.8 nm"\nvisibility = 1.2 ',
            ["polariscope.visibility", "1.2", "or less"],
        ),
        (
            'wavelength = "632.8 nm" ',
            'wavelength = "632.8 nm"\nvisibility = "95 +/- 2 %" ',
            ["polariscope.visibility", "95 with a tolerance of 2 % of it", '"(95 +/- 2) %"'],
        ),
        (
            LAYER,
            LAYER + '\nrelaxation = [["6 +/- 1 %", "0.4 s"]]',
            ["transducer.compliant.relaxation.0.share", "6 with", '"(6 +/- 1) %"'],
        ),
        (
            LAYER,
            LAYER + '\nrelaxation = ["6 %", "0.4 s"]',
            ["transducer.compliant.relaxation", "pairs", '[["6 %", "0.4 s"], ["4 %", "15 s"]]'],
        ),
        ("bits = 8 ", 'bits = 8\nresponse = "gamma" ', ["camera.response", "'gamma'", "sRGB"]),
        ("bits = 8 ", 'bits = 8\ndrift = "much" ', ["camera.drift", "'much'", '"1 %"']),
        (
            'pitch = "1 mm"',
            'pitch = "1 mm"\ncontact_width = "20 mm"',
            ["tactels", "20 mm", "15 mm", "12.5 mm", "narrower"],
        ),
    ],
)
def test_a_wrong_tolerance_is_one_line_with_key_value_and_remedy(
    old: str, new: str, words: list[str]
) -> None:
    assert old in SAAD
    with pytest.raises(ff.FringeforceError) as caught:
        parse_sensor(SAAD.replace(old, new, 1), source="my.toml")
    heading, *problems = str(caught.value).split("\n")
    assert heading == "my.toml has a problem:"
    (problem,) = problems
    assert problem.split()[0].rstrip(":") == words[0]
    assert all(word in problem for word in words[1:]), problem


def test_problems_of_tolerances_come_with_all_others() -> None:
    text = SAAD.replace(LAYER, 'thickness = "0.5 mm +/- 0.02"', 1).replace(
        "bits = 8 ", "bits = 99 "
    )
    with pytest.raises(ff.FringeforceError, match="2 problems") as caught:
        parse_sensor(text)
    places = [line.split()[0] for line in str(caught.value).split("\n")[1:]]
    assert places == [THICKNESS, "camera.bits"]


def test_a_table_of_tolerances_has_no_place_in_a_file() -> None:
    with pytest.raises(ff.FringeforceError, match="behind its value"):
        parse_sensor(SAAD + '\n[tolerances]\n"camera.amplitude" = 3\n')


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"transducer.cover.thickness": 1e-5}, ["transducer.cover", "no number"]),
        ({"camera.pixels": 3.0}, ["camera.pixels", "no number"]),
        ({THICKNESS: -1e-5}, [THICKNESS, "not negative"]),
        ({THICKNESS: 1e-3}, [THICKNESS, "too large"]),
    ],
)
def test_a_tolerance_that_belongs_to_nothing_is_refused(
    sensor: ff.Sensor, stated: dict[str, float], words: list[str]
) -> None:
    with pytest.raises(ff.FringeforceError) as caught:
        sensor.replace(tolerances=stated)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_a_value_that_no_longer_bears_its_tolerance_is_named(real: ff.Sensor) -> None:
    with pytest.raises(ff.FringeforceError, match=rf"{THICKNESS}.*too large"):
        real.replace(**{THICKNESS: "0.05 mm"})


def test_contacts_of_some_width_need_layers(sensor: ff.Sensor) -> None:
    with pytest.raises(ff.FringeforceError, match='plane = "given"'):
        sensor.replace(**{"transducer.plane": "given", "tactels.contact_width": "0.4 mm"})
