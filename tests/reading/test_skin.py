"""Contacts anywhere: frames of the exact series under tractions of contact mechanics, read back."""

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

import fringeforce as ff
from fringeforce.base.errors import DesignError, FringeforceError
from fringeforce.contacts.random_presses import PressRanges, random_presses
from fringeforce.design.files import parse_sensor
from fringeforce.explorer import limits
from fringeforce.io.tables import save_contacts
from fringeforce.models.presses import tractions
from fringeforce.models.skin import GEOMETRY, PLACE, WIDTH, Contacts
from fringeforce.reading.faint_contacts import faint_starts
from fringeforce.reading.skin_fit import Seen, climbed
from fringeforce.reading.skin_reader import SkinReader
from fringeforce.reading.skin_result import SkinResult
from fringeforce.studies.summary import summary

FAR = 5.0
"""Deviations: beyond them lies one in two million."""


@pytest.fixture(scope="module")
def model() -> ff.SensorModel:
    """A strip with roller edges, whose frames come from the exact series."""
    return ff.characterize(ff.load_sensor("skin").replace(**{"transducer.edges": "roller"}))


@pytest.fixture(scope="module")
def reader(model: ff.SensorModel) -> ff.Reader:
    return ff.Reader(model)


def expected(sensor: ff.Sensor, presses: list[ff.Press]) -> np.ndarray:
    """Force and centre of pressure, which shear moves beside the axis of a cylinder."""
    parts = [tractions(sensor, press) for press in presses]
    force, places = (
        np.concatenate(part) for part in ([p.forces for p in parts], [p.places for p in parts])
    )
    return np.array([*force.sum(axis=0), force[:, 0] @ places / force[:, 0].sum()])


def check(sensor: ff.Sensor, total: ff.Resultant, presses: list[ff.Press]) -> None:
    """The total is within its deviations, and they are small."""
    found, std = np.array([*total.force, total.centre[0]]), total.std[[0, 1, 5]]
    assert (np.abs(found - expected(sensor, presses)) < FAR * std).all()
    assert std[0] < 0.03 + 0.02 * total.force[0]


PRESSES = {
    "one": [ff.Press(x=0.37e-3, normal=1.5, tangential=0.4, radius=4e-3)],
    "between tactels": [ff.Press(x=0.5e-3, normal=2.0, tangential=-0.8, radius=2e-3)],
    "two": [
        ff.Press(x=-2.2e-3, normal=2.5, tangential=0.5, radius=8e-3),
        ff.Press(x=1.9e-3, normal=0.7, tangential=-0.2, radius=1.5e-3),
    ],
    "three": [
        ff.Press(x=-4.1e-3, normal=1.0, tangential=0.3, radius=3e-3),
        ff.Press(x=-0.3e-3, normal=3.0, tangential=-1.0, radius=5e-3),
        ff.Press(x=4.4e-3, normal=0.5, tangential=0.1, radius=2e-3),
    ],
    "a patch": [ff.Press(x=-1.1e-3, normal=2.0, tangential=0.5, width=0.8e-3, profile="flat")],
    "a wide one": [ff.Press(x=-1.1e-3, normal=2.0, tangential=0.6, width=1.56e-3)],
    "a punch": [ff.Press(x=1.1e-3, normal=2.0, tangential=0.5, width=0.6e-3, profile="punch")],
}


def test_contacts_do_what_line_loads_in_their_place_do(model: ff.SensorModel) -> None:
    skin = SkinReader(model).skin
    rng = np.random.default_rng(6)
    units = skin.units(4).reshape(4, GEOMETRY)
    geometry = skin.limited(skin.drawn + rng.standard_normal((4, GEOMETRY)) * units)
    geometry[0, PLACE] = skin.places[0] + geometry[0, WIDTH]
    forces = rng.uniform(0.5, 2, (4, 2))
    frame, _ = skin.frame(Contacts(forces, geometry))
    loads, change = skin.shares(geometry), skin.derivatives(geometry)
    for k, own in enumerate(forces):
        expected = [loads[k, c] @ skin.lines[c] for c in range(2)]
        np.testing.assert_allclose(frame.moments[k, :, 0], expected, atol=1e-12)
        moved = sum(own[c] * change[k, :, c] @ skin.lines[c] for c in range(2))
        fields = frame.fields[k * GEOMETRY : (k + 1) * GEOMETRY]
        np.testing.assert_allclose(fields, moved * units[k, :, None], atol=1e-12)


@pytest.mark.parametrize("name", list(PRESSES))
def test_contacts_are_read_where_and_as_strong_as_they_are(
    model: ff.SensorModel, reader: ff.Reader, name: str
) -> None:
    presses = PRESSES[name]
    reading = reader.search(model.expose(presses, rng=3))
    assert reading.status is ff.Status.OK
    assert reading.total is not None
    check(model.sensor, reading.total, presses)
    felt = sorted(reading.contacts, key=lambda one: one.centre[0])
    assert len(felt) == len(presses)
    for one, press in zip(felt, presses, strict=True):
        check(model.sensor, one, [press])
        assert one.width is not None
        assert one.width_std is not None
    # the line loads add up to the total
    np.testing.assert_allclose(reading.forces.sum(axis=0), reading.total.force, rtol=1e-6)
    summed = reading.covariance.reshape(len(reading.forces), 2, -1, 2).sum(axis=(0, 2))
    np.testing.assert_allclose(
        summed, reading.total.force_covariance, atol=1e-3 * reading.total.force_covariance.max()
    )


def test_widths_are_those_of_the_contacts(model: ff.SensorModel, reader: ff.Reader) -> None:
    for width in (0.5e-3, 1.2e-3):
        press = ff.Press(x=0.2e-3, normal=2.0, width=width)
        (one,) = reader.search(model.expose([press], rng=1)).contacts
        assert one.width is not None
        assert one.width_std is not None
        assert abs(one.width - width) < FAR * one.width_std
        assert one.width_std < 0.2 * width


@pytest.mark.parametrize(("radius", "normal", "tangential"), [(4e-3, 4.0, 0.2), (8e-3, 3.0, -1.2)])
def test_contacts_wider_than_a_thin_cover_are_described(
    radius: float, normal: float, tangential: float
) -> None:
    sensor = ff.load_sensor("skin").replace(
        **{
            "transducer.edges": "roller",
            "transducer.compliant.thickness": 0.25e-3,
            "transducer.compliant.youngs_modulus": 5e6,
        }
    )
    model = ff.characterize(sensor)
    press = ff.Press(x=0.3e-3, normal=normal, tangential=tangential, radius=radius)
    true = tractions(sensor, press)
    assert true.width > 2 * 2 * sensor.transducer.compliant.thickness
    single = SkinReader(model)
    geometry = single.skin.drawn[None].copy()
    geometry[0, [PLACE, WIDTH]] = true.centre, true.width / 2
    levels = model.expose([press], rng=5)
    seen = Seen(single.skin, levels.astype(float), normal)
    found = climbed(seen, Contacts(true.forces.sum(axis=0)[None], geometry))
    assert found.chance > 1e-3
    # what noise moves it by: as many squares as there are unknowns, or fewer, 1 in 10^6 beyond
    result = SkinResult(single.skin, found)
    off = result.phase(model) - model.phase([press])
    strength = model.sensor.camera.amplitude / 2 / model.sensor.camera.noise
    assert np.square(strength * off).sum() / 2 < chi2.isf(1e-6, 2 + GEOMETRY)
    total = result.total()
    assert total.width is not None
    assert total.width_std is not None
    assert abs(total.width - true.width) < FAR * total.width_std
    assert total.width_std < 0.02 * true.width


def test_tractions_carry_the_forces(model: ff.SensorModel, reader: ff.Reader) -> None:
    press = ff.Press(x=-0.7e-3, normal=1.5, tangential=0.4, radius=4e-3)
    reading = reader.search(model.expose([press], rng=2))
    traction = reading.traction
    assert traction is not None
    width, step = model.sensor.transducer.width, np.diff(traction.places)[0]
    sums = traction.values.sum(axis=0) * width * step
    np.testing.assert_allclose(sums, reading.forces.sum(axis=0))
    assert traction.std.shape == traction.values.shape == (len(traction.places), 2)
    assert abs(traction.places[traction.values[:, 0].argmax()] - press.x) < 0.3e-3


@pytest.mark.parametrize("side", [-1, 1])
def test_contacts_that_lie_across_an_end_of_the_skin_are_read(
    model: ff.SensorModel, reader: ff.Reader, side: int
) -> None:
    skin, ends = SkinReader(model).skin, list[float]()
    for number, beside in enumerate((0.0, 0.2e-3, 0.5e-3)):
        press = ff.Press(x=side * (skin.half - beside), normal=2.0, tangential=0.5, radius=8e-3)
        ends.append(max(side * end for end in tractions(model.sensor, press).ends))
        reading = reader.search(model.expose([press], rng=number))
        assert reading.status is ff.Status.OK
        assert reading.total is not None
        check(model.sensor, reading.total, [press])
    assert min(ends) > skin.half


def test_nothing_is_no_contact(model: ff.SensorModel, reader: ff.Reader) -> None:
    reading = reader.search(model.expose(np.zeros((model.sensor.tactels.count, 2)), rng=0))
    assert reading.status is ff.Status.NO_CONTACT
    assert not reading.contacts


def test_moving_contacts_are_followed(model: ff.SensorModel) -> None:
    t = np.linspace(0, 1, 120)
    rows = [
        [
            ff.Press(
                x=float(-1e-3 + 1.5e-3 * s),
                normal=float(1 + 0.8 * s),
                tangential=float(0.3 * np.sin(6 * s)),
                width=0.8e-3,
            ),
            ff.Press(x=4e-3, normal=0.8, width=0.5e-3),
        ]
        for s in t
    ]
    frames = model.expose(rows, rng=5)
    readings = list(ff.Reader(model).stream(frames))
    assert np.mean([reading.tracked for reading in readings]) > 0.95
    totals = [reading.total for reading in readings]
    off = np.array(
        [
            (np.array([*total.force, total.centre[0]]) - expected(model.sensor, row))
            / total.std[[0, 1, 5]]
            for total, row in zip(totals, rows, strict=True)
            if total is not None
        ]
    )
    assert len(off) == len(t)
    assert np.abs(off).max() < FAR
    assert 0.7 < np.sqrt(np.square(off).mean()) < 1.3
    batch = ff.Reader(model).read_on(frames[:20])
    np.testing.assert_allclose(batch.forces[-1], readings[19].forces)


def test_a_new_contact_is_searched(model: ff.SensorModel) -> None:
    one = [ff.Press(x=-2e-3, normal=1.0, width=0.6e-3)]
    two = [*one, ff.Press(x=3e-3, normal=1.0, width=0.6e-3)]
    reader = ff.Reader(model)
    readings = [reader.read(frame) for frame in model.expose([one, one, two, two], rng=0)]
    assert [len(reading.contacts) for reading in readings] == [1, 1, 2, 2]
    assert [reading.tracked for reading in readings] == [False, True, False, True]


def test_frames_that_have_nothing_in_common_are_not_followed(model: ff.SensorModel) -> None:
    rng = np.random.default_rng()
    skin = model.sensor.skin
    assert skin is not None
    rows = [random_presses(skin.extent, rng, PressRanges(count=(1, 2))) for _ in range(30)]
    readings = list(ff.Reader(model).stream(np.array([model.expose(row, rng) for row in rows])))
    good = [number for number, one in enumerate(readings) if one.status is ff.Status.OK]
    assert len(good) > 20
    for number in good:
        total = readings[number].total
        assert total is not None
        true = sum(press.normal for press in rows[number])
        assert abs(total.force[0] - true) < 6 * total.std[0], number


def test_shear_that_grows_is_followed(model: ff.SensorModel) -> None:
    shear = np.linspace(0, 0.6, 40)
    rows = [[ff.Press(x=0.0, normal=2.0, tangential=float(t), width=1.5e-3)] for t in shear]
    readings = list(ff.Reader(model).stream(model.expose(rows, rng=0)))
    assert all(reading.tracked for reading in readings[1:])
    for reading, row in zip(readings, rows, strict=True):
        assert reading.total is not None
        check(model.sensor, reading.total, row)


def test_what_lets_go_is_gone(model: ff.SensorModel) -> None:
    steps = [1.0, 0.4, 0.1, 0.0, 0.0]
    stays = ff.Press(x=-2e-3, normal=1.5, width=0.8e-3)
    for others in ([], [stays]):
        rows = [
            [*others, *([ff.Press(x=2e-3, normal=n, width=0.5e-3)] if n else [])] for n in steps
        ]
        readings = list(ff.Reader(model).stream(model.expose(rows, rng=2)))
        assert [len(reading.contacts) for reading in readings[3:]] == [len(others)] * 2
        verdict = ff.Status.OK if others else ff.Status.NO_CONTACT
        assert [reading.status for reading in readings[3:]] == [verdict] * 2


def test_nothing_is_followed_until_something_shows(model: ff.SensorModel) -> None:
    light = ff.Press(x=-3e-3, normal=0.2, width=0.5e-3)
    frames = model.expose([*[[]] * 30, [light], [light]], rng=1)
    readings = list(ff.Reader(model).stream(frames))
    assert [reading.tracked for reading in readings] == [False] + [True] * 29 + [False, True]
    assert [reading.status for reading in readings[:30]] == [ff.Status.NO_CONTACT] * 30
    assert [len(reading.contacts) for reading in readings[30:]] == [1, 1]


def test_a_touch_too_weak_to_tell_is_never_read_for_certain_as_nothing(
    model: ff.SensorModel, reader: ff.Reader
) -> None:
    for normal in (0.02, 0.05, 0.08, 0.12, 0.2):
        press = ff.Press(x=-3.25e-3, normal=normal, width=0.2e-3)
        for seed in range(4):
            reading = reader.search(model.expose([press], rng=seed))
            assert bool(reading.contacts) or not reading.ok


def test_a_faint_contact_is_ambiguous_or_right(model: ff.SensorModel, reader: ff.Reader) -> None:
    """Light beside no phase has either sign: a push is like a pull, or like shear beside it."""
    rng, sure = np.random.default_rng(), 0
    for normal in (0.1, 0.15, 0.2, 0.4):
        press = ff.Press(x=rng.uniform(-5e-3, 5e-3), normal=normal, radius=6e-3)
        for _ in range(15):
            reading = reader.search(model.expose([press], rng))
            if reading.ok:
                total = reading.total
                assert total is not None
                off = (np.array(total.force) - [normal, 0.0]) / total.force_std
                assert np.abs(off).max() < FAR
                sure += 1
    assert sure > 10


def test_a_faint_contact_is_found_by_its_light_from_anywhere_else(
    model: ff.SensorModel, reader: ff.Reader
) -> None:
    """Its phase is a mirror image of itself, which tells nothing of its place."""
    rng, inner = np.random.default_rng(0), reader._single
    assert isinstance(inner, SkinReader)
    cover = model.sensor.transducer.compliant.thickness
    for normal in (0.15, 0.2, 0.3, 0.4):
        place, share = rng.uniform(-3e-3, 3e-3), rng.uniform(-0.4, 0.4)
        press = ff.Press(x=place, normal=normal, tangential=share * normal, radius=4e-3)
        levels = model.expose([press], rng).ravel()
        seen, _, _ = inner._seen(levels, np.ones(levels.shape, bool))
        geometry = inner.skin.drawn[None].copy()
        geometry[0, PLACE] = place + 2e-3
        elsewhere = climbed(seen, Contacts(np.array([[normal, 0.0]]), geometry))
        reached = [
            climbed(seen, contacts, elsewhere.others).contacts
            for contacts in faint_starts(seen, elsewhere)
        ]
        found = [
            len(one.forces) == 1
            and abs(one.geometry[0, PLACE] - place) < cover / 2
            and abs(one.forces[0, 0] / normal - 1) < 0.2
            for one in reached
        ]
        assert any(found)


def test_sure_readings_of_faint_contacts_are_as_sure_as_they_say() -> None:
    """Squared distances from what pressed, by contact mechanics, against chi-square."""
    model = ff.characterize(ff.load_sensor("skin"))
    reader, rng, squares = ff.Reader(model), np.random.default_rng(0), []
    for normal in np.repeat([0.15, 0.2], 20):
        press = ff.Press(x=rng.uniform(-5e-3, 5e-3), normal=normal, radius=6e-3)
        reading = reader.search(model.expose([press], rng))
        if reading.ok:
            total = reading.total
            assert total is not None
            off = np.array(total.force) - [normal, 0.0]
            squares.append(off @ np.linalg.solve(total.force_covariance, off))
    assert len(squares) > 20
    assert sum(squares) < chi2.ppf(1 - 1e-6, 2 * len(squares))
    assert max(squares) < chi2.ppf(1 - 1e-6 / len(squares), 2)


def test_a_frame_of_something_else_is_refused(model: ff.SensorModel, reader: ff.Reader) -> None:
    pixels = np.arange(2048)
    wrong = 125 + 110 * np.cos(pixels / 40.0) * np.sign(np.sin(pixels / 333.0))
    assert reader.search(np.round(wrong)).status is ff.Status.MODEL_MISMATCH


def test_light_that_is_uncertain_is_allowed_for() -> None:
    drawing = ff.load_sensor("skin").replace(
        **{
            "transducer.edges": "roller",
            "camera.amplitude": "237 +/- 3 %",
            "polariscope.visibility": "0.97 +/- 0.02",
            "polariscope.residual": "0 +/- 0.05 rad",
        }
    )
    model = ff.characterize(drawing)
    presses = PRESSES["two"]
    reading = ff.Reader(model).read(model.expose(presses, rng=4, as_built=2))
    assert reading.status is ff.Status.OK
    assert reading.total is not None
    check(model.sensor, reading.total, presses)


def test_designs_of_skins_are_written_and_changed() -> None:
    skin = ff.load_sensor("skin")
    assert skin.tactels.count == 131 + 2 * 10  # two covers beyond each end
    assert "[tactels]" not in skin.to_toml()
    assert parse_sensor(skin.to_toml()) == skin
    assert skin.replace(**{"skin.resolution": "0.2 mm"}).tactels.count == 66 + 2 * 5
    pins = skin.replace(tactels={"count": 5, "pitch": "1 mm"})
    assert pins.skin is None
    assert pins.replace(skin={"extent": "10 mm"}).tactels.count == 101 + 2 * 10
    assert skin.replace(**{"skin.extent": "24 mm"}).tactels.positions[-1] < 12.5e-3


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"skin": {"extent": "30 mm"}}, "beyond the strip"),
        ({"skin": {"extent": "13 mm"}, "tactels": {"count": 5, "pitch": "1 mm"}}, "both tactels"),
        ({"skin.friction": 0.0}, "friction"),
        ({"skin.extent": "-3 mm"}, "extent"),
    ],
)
def test_designs_that_are_no_skins_are_told(change: dict[str, object], words: str) -> None:
    with pytest.raises(DesignError, match=words) as told:
        ff.load_sensor("skin").replace(**change)
    assert "has a problem:" in str(told.value)  # and none that only follows from it


def test_a_design_without_tactels_and_skin_is_told() -> None:
    text = ff.load_sensor("saad").to_toml()
    begin, end = text.index("[tactels]"), text.index("[polariscope]")
    with pytest.raises(DesignError, match="a table of tactels, or a skin"):
        parse_sensor(text[:begin] + text[end:])


def test_touch_gives_the_contacts_that_the_reading_tells(
    model: ff.SensorModel, reader: ff.Reader
) -> None:
    reading = reader.search(model.expose(PRESSES["two"], rng=3))
    felt = ff.touch(model.sensor, reading)
    assert felt.total is reading.total
    assert felt.patches == reading.contacts


def test_contacts_are_written_as_a_table(
    model: ff.SensorModel, reader: ff.Reader, tmp_path: Path
) -> None:
    readings = [reader.search(model.expose(PRESSES[name], rng=3)) for name in ("one", "two")]
    statuses = save_contacts(tmp_path / "contacts.csv", readings)
    assert statuses == {"OK": 2}
    with open(tmp_path / "contacts.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["frame"], row["contact"]) for row in rows] == [
        ("0", "0"), ("0", "1"), ("1", "0"), ("1", "1"), ("1", "2")
    ]  # fmt: skip
    strongest = rows[3]
    assert abs(float(strongest["normal_N"]) - 2.5) < FAR * float(strongest["normal_std_N"])
    assert abs(float(strongest["x_mm"]) + 2.2) < 0.05


def test_skins_are_not_calibrated_nor_shown_as_tactels() -> None:
    skin = ff.load_sensor("skin")
    with pytest.raises(FringeforceError, match="no tactels to press"):
        ff.calibrate(skin, np.zeros((8, 2048)), np.zeros((8, skin.tactels.count, 2)))
    with pytest.raises(FringeforceError, match="forces of tactels"):
        limits.check(skin)


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("polariscope.visibility", 0.85, "visibility of the fringes seems 0.85"),
        ("camera.gamma", 0.8, "gamma of 0.8"),
        ("camera.blur", "120 um", "blurred by 0.1"),
    ],
)
def test_what_departs_from_the_design_is_named(
    model: ff.SensorModel, path: str, value: object, words: str
) -> None:
    built = ff.characterize(model.sensor.replace(**{path: value}))
    presses = [
        ff.Press(x=-2.1e-3, normal=2.5, tangential=0.9, width=1.4e-3),
        ff.Press(x=2.4e-3, normal=0.8, tangential=-0.2, width=0.5e-3),
    ]
    reading = ff.Reader(model).read(built.expose(presses, rng=1))
    assert reading.status is ff.Status.MODEL_MISMATCH
    (finding,) = reading.findings
    assert words in finding
    assert f"give {path} a tolerance" in finding
    assert finding in reading.advice


def test_what_a_skin_does_not_allow_for_is_told(model: ff.SensorModel) -> None:
    with pytest.raises(FringeforceError, match="influence_error"):
        ff.Reader(model.with_tolerances(**{"transducer.influence_error": "2 %"}))


def test_contacts_beside_tactels_are_told_of_skins() -> None:
    model = ff.characterize(ff.load_sensor("saad"))
    places = model.sensor.tactels.positions + 0.1e-3
    frame = model.expose([ff.Press(x=float(x), normal=1.0, tangential=0.2) for x in places], rng=0)
    reading = ff.Reader(model).read(frame)
    assert reading.status is ff.Status.MODEL_MISMATCH
    assert any("skin" in finding for finding in reading.findings)


def test_a_summary_says_how_well_a_contact_is_read(
    model: ff.SensorModel, reader: ff.Reader
) -> None:
    facts = dict(summary(model))
    assert "condition number" not in facts
    assert facts["skin"].startswith("13 mm long")
    # 10 % of 11 MPa on 0.5 mm x 2 mm
    words = facts["standard deviation of a contact of 1.1 N, one frame"]
    press = ff.Press(x=0.0, normal=1.1, width=0.5e-3)
    total = reader.search(model.expose([press], rng=1)).total
    assert total is not None
    assert float(words.split()[0]) == pytest.approx(1e3 * total.force_std[0], rel=0.2)
    assert words.endswith("good, below the limit of 110 mN")


def test_a_press_beside_the_skin_is_named() -> None:
    model = ff.characterize(ff.load_sensor("skin"))
    reading = ff.Reader(model).search(
        model.expose([ff.Press(x=11e-3, normal=0.5, radius=3e-3)], rng=0)
    )
    assert reading.status is ff.Status.MODEL_MISMATCH
    (said,) = reading.findings
    assert said.startswith("A contact at 11 mm explains this frame, beside the skin, which ends at")
