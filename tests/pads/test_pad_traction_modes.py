"""Tractions beside their tactels: functions that are like them, and readings within deviations."""

import numpy as np
import pytest
from scipy import stats

import fringeforce as ff
from fringeforce.contacts.press import Outline, Profile
from fringeforce.design.pad import Pad
from fringeforce.mechanics.solid.block import Patches, Shape
from fringeforce.models import splines
from fringeforce.models.imaging import camera_response
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_series import PadSeries
from fringeforce.models.pad_slices import block_of, profile_waves, slice_retardance
from fringeforce.models.pad_traction_influence import TractionInfluence
from fringeforce.models.pad_traction_modes import (
    MOST_FUNCTIONS,
    TractionMode,
    traction_modes,
)
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.optics import camera as camera_optics
from fringeforce.reading.reading import Status

Array = np.ndarray
RARE = 1e-5
STATED = {"tactels.placement": "0 +/- 0.1 mm", "tactels.size": "2 +/- 0.2 mm"}

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def beside(pad: Pad) -> PadModel:
    return ff.characterize(
        pad.replace(**{"tactels.size": "2 mm", "camera.amplitude": 240.0, **STATED})
    )


def first(count: int, *tactels: int) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the first functions of some of twenty tactels."""
    return np.zeros(20, dtype=int), np.where(np.isin(np.arange(20), tactels), count, 0)


def test_few_functions_are_like_any_rectangle_beside_its_tactel(beside: PadModel) -> None:
    """Of a push of a newton, what least squares leave of the light is no more than noise."""
    pad, rng, known = beside.sensor, np.random.default_rng(4), PadUncertainty.of(beside)
    tactel, force = 6, np.zeros((20, 3))
    force[tactel] = [1.0, 0.3, -0.2]
    x, y = (places[::2] for places in pad.pixel_positions)
    whole = 2 * known.model.influence.profile.sum(axis=0)

    def seen(load: tuple[Patches, Array]) -> Array:
        return 2 * slice_retardance(pad, [load], x, y, 16).sum(axis=0).ravel()

    assert known.contacts is not None
    under = known.contacts.matrices(x, y, *first(len(known.tractions), tactel))[tactel]
    columns = np.concatenate(
        [
            np.einsum("k,fkpn,n->fp", whole, beside.influence.matrix(x, y), force.ravel())[None],
            np.einsum("k,cfkpl,c->lfp", whole, under, force[tactel]),
        ]
    ).reshape(len(known.tractions) + 1, -1)
    response = camera_response(pad.camera)
    # light is half of the amplitude times one of two parts of the retardance, of one pixel in four
    unit = 4 * np.mean(response.amplitude**2 / response.variance) / 8
    left = []
    for _ in range(10):
        place = pad.tactels.places[tactel] + 0.1e-3 * rng.standard_normal(2)
        sides = 2e-3 + 0.2e-3 * rng.standard_normal(2)
        light = seen((Patches(place[None], sides[None]), force[tactel][None]))
        found = np.linalg.lstsq(columns.T, light, rcond=None)[0]
        left.append(unit * np.square(light - found @ columns).sum())
    # a function counts that adds as much as noise in one number, of which thousands are seen
    assert np.mean(left) < 3
    assert max(left) < 20


@pytest.mark.parametrize("odd", [(0, 0), (1, 0), (0, 1), (1, 1)])
def test_light_of_a_function_is_the_sum_of_the_points_in_it(
    beside: PadModel, odd: tuple[int, int]
) -> None:
    pad, base = beside.sensor, beside.influence
    points, weights = np.polynomial.legendre.leggauss(16)
    nodes = 1e-3 * np.stack(np.meshgrid(points, points, indexing="ij"), axis=-1).reshape(-1, 2)
    share = np.outer(weights * points ** odd[0], weights * points ** odd[1]).ravel() / 4
    depths = block_of(pad).depths(len(base.profile))[1]
    waves = profile_waves(pad, base.profile, depths)[:2]
    along, across = (
        (np.sin if n else np.cos)(np.outer(wave, place))
        for n, wave, place in zip(odd, waves, nodes.T, strict=True)
    )
    function = TractionMode(Shape(odd, (along * share) @ across.T), 1.0)
    influence = TractionInfluence(PadSeries(pad, base), (function,))
    (x, y), force, tactel = (places[::8] for places in pad.pixel_positions), [1.0, 0.3, -0.2], 6
    found = influence.matrices(x, y, *first(1, tactel))[tactel][..., 0]
    light = np.einsum("k,cfkp,c->fp", 2 * base.profile.sum(axis=0), found, force)
    loads = [(Patches(pad.tactels.places[tactel] + nodes), share[:, None] * force)]
    exact = 2 * slice_retardance(pad, loads, x, y, len(base.profile)).sum(axis=0)
    # profiles leave out 2e-3
    np.testing.assert_allclose(light, exact.reshape(2, -1), atol=5e-3 * np.abs(exact).max())


def test_light_of_functions_goes_forward_and_back(beside: PadModel) -> None:
    rng, known = np.random.default_rng(3), PadUncertainty.of(beside)
    influence, base, tactels = known.contacts, beside.influence, np.array([2, 6])
    assert influence is not None
    shares, forces = np.zeros((2, len(known.tractions), 20)), rng.normal(size=(20, 3))
    shares[..., tactels] = rng.normal(size=(2, len(known.tractions), 2))
    grid, other = (influence.forward(one, forces) for one in shares)
    back = np.einsum("tlc,lc->tl", influence.adjoint(other, tactels), forces[tactels])
    assert np.vdot(back, shares[0][:, tactels]) == pytest.approx(np.vdot(grid, other), rel=1e-4)
    x, y = (places[::16] for places in beside.sensor.pixel_positions)
    along, across = splines.basis(base.x, x), splines.basis(base.y, y)
    summed = np.zeros((*grid.shape[:2], len(y) * len(x)))
    begin, end = first(len(known.tractions), *tactels)
    split = np.where(end, np.arange(20), 0)  # tactels beside each other need other functions
    for ends in ((begin, split), (split, end)):
        for k, parts in influence.matrices(x, y, *ends).items():
            own = shares[0, ends[0][k] : ends[1][k], k]
            summed += np.einsum("cfkpt,c,t->fkp", parts, forces[k], own)
    expected = (across @ grid @ along.T).reshape(summed.shape)
    np.testing.assert_allclose(summed, expected, atol=1e-4 * np.abs(expected).max())


def test_readings_allow_for_rectangles_beside_their_tactels(beside: PadModel) -> None:
    pad, reader = beside.sensor, ff.Reader(beside)
    count, rng, distances, off = 2, np.random.default_rng(8), [], []
    for _ in range(count):
        forces = np.zeros((pad.tactels.total, 3))
        touched = rng.choice(len(forces), 2, replace=False)
        push, angle = rng.uniform(0.4, 2.0, 2), rng.uniform(0, 2 * np.pi, 2)
        shear = rng.uniform(0, 0.4, 2)
        forces[touched] = (push * [np.ones(2), shear * np.cos(angle), shear * np.sin(angle)]).T
        places = pad.tactels.places + 0.1e-3 * rng.standard_normal((len(forces), 2))
        sides = 1.9e-3 + 0.1e-3 * rng.standard_normal((len(forces), 2))
        slices = slice_retardance(pad, [(Patches(places, sides), forces)], *pad.pixel_positions, 16)
        light = beside.seen(slices).reshape(beside.frame_shape)
        reading = reader.search(camera_optics.expose(pad.camera, light, rng))
        assert reading.status is Status.OK
        apart = (reading.forces - forces).ravel()
        distances.append(apart @ np.linalg.solve(reading.covariance, apart))
        off.append(np.abs(reading.forces - forces)[touched] / reading.std[touched])
    low, high = stats.chi2(count * 60).ppf([RARE, 1 - RARE])
    assert low < np.sum(distances) < high
    # of six forces a frame
    assert np.max(off) < stats.norm.isf(RARE / 2)
    assert np.mean(np.square(off)) < stats.chi2(6 * count).isf(RARE) / (6 * count)


@pytest.mark.parametrize(
    ("profile", "outline"),
    [
        ("flat", "ellipse"),
        ("hertz", "ellipse"),
        ("punch", "ellipse"),
        ("edge", "ellipse"),
        ("hertz", "rectangle"),
        ("punch", "rectangle"),
        ("edge", "rectangle"),
    ],
)
def test_contacts_as_wide_as_their_tactel_are_read_whatever_presses(
    beside: PadModel, profile: Profile, outline: Outline
) -> None:
    pad, rng = beside.sensor, np.random.default_rng(5)
    tactel, force = 6, np.array([1.0, 0.3, -0.2])
    x, y = pad.tactels.places[tactel] + [0.04e-3, -0.03e-3]
    press = ff.Press(
        x=x,
        y=y,
        normal=force[0],
        tangential=(force[1], force[2]),
        width=1.9e-3,
        profile=profile,
        outline=outline,
    )
    reading = ff.Reader(beside).search(beside.expose([press], rng))
    assert reading.status is Status.OK
    apart = (reading.forces - force * (np.arange(len(reading.forces)) == tactel)[:, None]).ravel()
    distance = apart @ np.linalg.solve(reading.covariance, apart)
    assert distance < stats.chi2(apart.size).isf(RARE)


@pytest.mark.parametrize("along", [1e-3, 0.6e-3])
def test_a_contact_beyond_its_tolerance_is_never_sure_and_a_skin_is_named(
    beside: PadModel, along: float
) -> None:
    """All pixels together do not show it, and forces would be wrong by tenths of a newton."""
    x, y = beside.sensor.tactels.places[6] + [0, along]
    press = ff.Press(x=x, y=y, normal=1.2, width=1.8e-3, profile="flat")
    frame = beside.expose([press], rng=1)
    reading = ff.Reader(beside).search(frame)
    assert reading.status in {Status.MODEL_MISMATCH, Status.AMBIGUOUS}
    assert "skin" in reading.advice
    assert ff.Reader(beside.as_skin()).search(frame).status is Status.OK


def test_wide_tolerances_take_the_functions_that_show_most(beside: PadModel) -> None:
    wide = {"tactels.placement": "0 +/- 0.3 mm", "tactels.size": "2 +/- 0.4 mm"}
    profile = beside.influence.profile
    found = traction_modes(beside.sensor.replace(**wide), profile)
    assert len(found) == MOST_FUNCTIONS
    assert len(traction_modes(beside.sensor, profile)) < MOST_FUNCTIONS
    squares = [one.square for one in found]
    assert squares == sorted(squares, reverse=True)


def test_a_size_that_is_nearly_certain_leaves_tractions_uniform(beside: PadModel) -> None:
    """Other pressures are as rare as the square of the tolerance, and stop to show."""
    profile = beside.influence.profile
    counts = [
        len(traction_modes(beside.sensor.replace(**{"tactels.size": f"2 +/- {std} mm"}), profile))
        for std in (0.2, 0.05, 0.001)
    ]
    placed = beside.sensor.replace(tolerances={"tactels.size": 0.0})
    assert counts[0] > counts[1] > counts[2] >= len(traction_modes(placed, profile))
    assert counts[2] <= len(traction_modes(placed, profile)) + 2


def test_functions_of_tactels_that_are_hardly_touched_do_not_show(beside: PadModel) -> None:
    known = PadUncertainty.of(beside)
    forces = np.zeros((beside.sensor.tactels.total, 3))
    forces[3], forces[7] = [1.0, 0, 0], [0.02, 0, 0]
    shown = known.shown(forces.ravel()).reshape(len(known.tractions), -1)
    assert shown[:, 3].all()
    assert 0 < shown[:, 7].sum() < len(known.tractions) / 2
    assert not np.delete(shown, [3, 7], axis=1).any()
