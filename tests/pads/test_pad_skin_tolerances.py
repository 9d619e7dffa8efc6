"""Skins of pads that are not as drawn: presses on sensors drawn from tolerances, read back."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.models import as_built
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_as_built import built_pad
from fringeforce.models.pad_presses import pad_tractions
from fringeforce.models.pad_skin import FIRST_SHAPE, PLACE, SHAPE, SIZE_OF
from fringeforce.models.pad_skin_uncertainty import PadSkinUncertainty
from fringeforce.reading.pads.departure_record import RETESTED
from fringeforce.reading.pads.skin_reader import PadSkinReader
from fringeforce.reading.reading import Status

pytestmark = pytest.mark.slow

RARE = 1e-5
VALUES = [0, 1, 2, 6, 7]
"""Force and centre among the values of a resultant."""
LIGHT = {
    "camera.amplitude": "230 +/- 3 %",
    "camera.drift": "2 %",
    "polariscope.visibility": "0.96 +/- 0.02",
}
EVERYTHING = {
    **LIGHT,
    "camera.blur": "0.12 +/- 0.03 mm",
    "camera.gamma": "1.05 +/- 0.03",
    "camera.unevenness": "3 %",
    "camera.shift_x": "0 +/- 0.05 mm",
    "polariscope.residual": "0 +/- 0.1 rad",
    "transducer.compliant.thickness": "0.5 mm +/- 3 %",
    "transducer.photoelastic.strain_optic_coefficient": "0.05 +/- 3 %",
}
PRESSES = [
    [ff.Press(x=1.37e-3, y=-2.1e-3, normal=3.0, tangential=(0.9, -0.5), radius=6e-3)],
    [
        ff.Press(x=-3.4e-3, y=1e-3, normal=2.0, tangential=(0.0, 0.6), radius=5e-3),
        ff.Press(x=3.1e-3, y=-1.5e-3, normal=1.0, tangential=(-0.3, 0.0), radius=3e-3),
    ],
]


@pytest.fixture(scope="module")
def drawn(small_skin: PadModel) -> PadModel:
    return small_skin


@pytest.fixture(scope="module")
def reader(drawn: PadModel) -> ff.Reader:
    return ff.Reader(drawn)


def loosened(model: PadModel, **stated: object) -> PadModel:
    return replace(model, sensor=model.sensor.replace(**stated))


def truth(model: PadModel, presses: list[ff.Press]) -> np.ndarray:
    """Force and centre of pressure on the layers of a pad."""
    parts = [pad_tractions(model.sensor, press) for press in presses]
    force = np.concatenate([part.forces for part in parts])
    places = np.concatenate([part.places for part in parts])
    return np.concatenate([force.sum(axis=0), force[:, 0] @ places / force[:, 0].sum()])


def distance(reading: ff.Reading, expected: np.ndarray) -> float:
    """Square of the distance of force and centre from the truth, in what is stated of them."""
    total = reading.total
    assert total is not None
    off = np.concatenate([total.force, total.centre]) - expected
    return float(off @ np.linalg.solve(total.covariance[np.ix_(VALUES, VALUES)], off))


def test_slopes_and_curvature_are_those_of_differences(drawn: PadModel) -> None:
    stated = {**EVERYTHING, "camera.offset": "8 +/- 0.5", "camera.scale": "1 +/- 0.01"}
    reader = PadSkinReader(loosened(drawn, **stated))
    known, generator = reader.uncertain, np.random.default_rng(0)
    assert isinstance(known, PadSkinUncertainty)
    frame = generator.integers(0, 255, drawn.frame_shape).ravel().astype(float)
    fit = reader.fit(frame, reader.classifier(reader.usable(None)))
    one, free = np.zeros(SIZE_OF), np.ones((1, SIZE_OF), dtype=bool)
    one[:PLACE], one[PLACE:SHAPE] = (3.0, 0.5, 0.2), (1e-3, -1e-3)
    one[SHAPE:FIRST_SHAPE] = np.log(1.2e-3), 0.1, 0.2
    extra = 0.5 * generator.standard_normal(known.size)
    here = fit.at(one[None], extra)
    slope, curvature = fit.gradient(here, free), np.diag(fit.information(here, free))
    point = np.concatenate([one, extra])
    chosen = {group.path: SIZE_OF + group.begin for group in known.groups}
    for path, number in {"force": 0, "size": SHAPE, **chosen}.items():
        step = 0.02 * np.eye(len(point))[number]
        ends = [fit.at((point + s)[None, :SIZE_OF], (point + s)[SIZE_OF:]) for s in (step, -step)]
        rise = (ends[0].left.loss - ends[1].left.loss) / 0.08
        # the frame is nothing but noise
        allowed = 3e-3 * np.sqrt(curvature[number]) * 60
        assert slope[number] == pytest.approx(rise, rel=0.05, abs=allowed), path
        change = (ends[0].level - ends[1].level) / 0.04
        expected = change @ change / fit.response.variance + (number >= SIZE_OF)
        assert curvature[number] == pytest.approx(expected, rel=0.1), path


@pytest.mark.parametrize(
    ("stated", "frames"),
    [(LIGHT, [*PRESSES, PRESSES[0]]), (EVERYTHING, PRESSES[:1])],
    ids=["light", "everything"],
)
def test_skins_of_drawn_pads_are_read_within_what_is_stated(
    drawn: PadModel, stated: dict[str, str], frames: list[list[ff.Press]]
) -> None:
    model = loosened(drawn, **stated)
    reader, squares = ff.Reader(model), list[float]()
    for seed, presses in enumerate(frames):
        generator = np.random.default_rng(seed)
        own = replace(model, sensor=as_built.drawn(model.sensor, generator))
        # as `PadModel.as_built`, without the influence of squares, which presses do not need
        frame = built_pad(model.sensor, own, generator).expose(presses, generator)
        reading = reader.search(frame)
        assert reading.status is Status.OK
        assert len(reading.contacts) == len(presses)
        squares.append(distance(reading, truth(own, presses)))
    low, high = stats.chi2(len(frames) * len(VALUES)).ppf([RARE, 1 - RARE])
    assert low < np.sum(squares) < high


def test_what_is_uncertain_widens_what_is_stated_and_is_refused_where_it_is_not(
    drawn: PadModel,
) -> None:
    model = loosened(drawn, **LIGHT)
    dim = loosened(drawn, **{"camera.amplitude": 222.0, "polariscope.visibility": 0.95})
    frame = dim.expose(PRESSES[0], rng=1)
    exact = loosened(drawn, **{"camera.amplitude": 230.0, "polariscope.visibility": 0.96})
    plain = ff.Reader(exact)
    assert plain.search(frame).status is Status.MODEL_MISMATCH
    reading, sure = ff.Reader(model).search(frame), plain.search(exact.expose(PRESSES[0], rng=1))
    assert reading.status is Status.OK
    assert reading.total is not None
    assert sure.total is not None
    assert (reading.total.std[:3] > sure.total.std[:3]).all()


def test_no_contact_is_seen_as_none_under_another_light(drawn: PadModel) -> None:
    dim = loosened(drawn, **{"camera.amplitude": 222.0})
    reading = ff.Reader(loosened(drawn, **LIGHT)).search(dim.expose([], rng=0))
    assert reading.status is Status.NO_CONTACT


def test_frames_that_follow_carry_on_what_lasts(drawn: PadModel) -> None:
    model = loosened(drawn, **LIGHT)
    generator = np.random.default_rng(3)
    built = model.as_built(generator)
    steps = [[replace(PRESSES[0][0], normal=3 + 0.1 * k)] for k in range(4)]
    frames = [built.expose(one, generator) for one in steps]
    readings = list(ff.Reader(model).stream(frames))
    assert [one.tracked for one in readings] == [False, True, True, True]
    assert all(one.status is Status.OK for one in readings)
    alone, last = ff.Reader(model).search(frames[-1]).total, readings[-1].total
    assert alone is not None
    assert last is not None
    # the last is the angle of the axes, which a round contact does not have
    assert (last.std[:-1] < 1.02 * alone.std[:-1]).all()
    assert distance(readings[-1], truth(model, steps[-1])) < stats.chi2(5).ppf(1 - RARE)


def test_tolerances_that_skins_of_pads_do_not_allow_for_are_told(drawn: PadModel) -> None:
    with pytest.raises(InputError, match=r"transducer\.length has a tolerance"):
        ff.Reader(loosened(drawn, **{"transducer.length": "16 +/- 0.1 mm"}))


@pytest.mark.parametrize(
    ("departs", "words"),
    [
        ({"camera.amplitude": 232.0}, "dimmer than drawn"),
        ({"camera.blur": 0.15e-3}, "blurred by 0.15 mm"),
    ],
)
def test_a_finding_names_what_departs(
    drawn: PadModel, reader: ff.Reader, departs: dict[str, float], words: str
) -> None:
    made = loosened(drawn, **departs)
    reading = reader.search(made.expose(PRESSES[0], rng=3))
    assert reading.status is Status.MODEL_MISMATCH
    (finding,) = reading.findings
    assert words in finding
    assert "standard deviations" in finding
    assert next(iter(departs)) in finding


@pytest.mark.parametrize(
    ("departs", "words"),
    [
        ({"camera.shift_x": 0.1e-3}, "shifted along x by 0."),
        ({"camera.scale": 1.01}, "% larger than drawn"),
    ],
)
def test_what_the_residual_of_all_pixels_hides_is_refused_and_named(
    drawn: PadModel, reader: ff.Reader, departs: dict[str, float], words: str
) -> None:
    # as faint as this the sum of all squares is that of noise
    faint = [replace(press, normal=press.normal / 2, tangential=(0.0, 0.0)) for press in PRESSES[1]]
    made, single = loosened(drawn, **departs), PadSkinReader(drawn)
    frame = made.expose(faint, rng=3)
    used = single.usable(None)
    classifier = single.classifier(used)
    levels = frame.ravel().astype(float)
    best = single.likeliest(levels, used)
    assert best is not None
    assert single.explains(single.fit(classifier.filled(levels), classifier), classifier, best)
    reading = reader.search(frame)
    assert reading.status is Status.MODEL_MISMATCH
    (finding,) = reading.findings
    assert words in finding
    assert next(iter(departs)) in finding
    assert reader.search(drawn.expose(faint, rng=3)).ok


@pytest.mark.slow
def test_frames_that_follow_are_tested_for_what_the_residual_hides(drawn: PadModel) -> None:
    faint = [replace(press, normal=press.normal / 2, tangential=(0.0, 0.0)) for press in PRESSES[1]]
    reader, rng = ff.Reader(drawn), np.random.default_rng(3)
    readings = []
    for scale in (*np.linspace(1.0, 1.01, 9), *[1.01] * RETESTED):
        made = loosened(drawn, **{"camera.scale": scale})
        readings.append(reader.read(made.expose(faint, rng)))
        if not readings[-1].ok:
            break
    assert readings[1].tracked
    assert readings[-1].status is Status.MODEL_MISMATCH
    assert "camera.scale" in readings[-1].findings[0]
