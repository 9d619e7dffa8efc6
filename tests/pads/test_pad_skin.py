"""Contacts anywhere on a pad: frames of contact mechanics and the exact series, read back."""

import csv
from pathlib import Path

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.contacts.press import Tractions
from fringeforce.design.pad import Pad
from fringeforce.io.tables import save_contacts
from fringeforce.models import pad_skin
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_presses import pad_tractions, press_slices
from fringeforce.models.pad_skin import FIRST_SHAPE, PLACE, SHAPE, SIZE_OF, PadSkinModel, matrix_of
from fringeforce.reading.pads.search import factored
from fringeforce.reading.pads.skin_result import amounts, spin, tractions_at

FAR = 5.0
"""Deviations: beyond them lies one in two million."""
VALUES = [0, 1, 2, 6, 7]
"""Force and centre among the values of a resultant."""


@pytest.fixture(scope="module")
def model(small_skin: PadModel) -> PadModel:
    return small_skin


@pytest.fixture(scope="module")
def reader(model: PadModel) -> ff.Reader:
    return ff.Reader(model)


def contact(shapes: bool = False) -> np.ndarray:
    """Unknowns of an ellipse, with shapes or as of Hertz."""
    found = np.zeros(SIZE_OF)
    found[:PLACE], found[PLACE:SHAPE] = (5.0, 1.5, -0.7), (1.3e-3, -2.1e-3)
    found[SHAPE:FIRST_SHAPE] = np.log(1.2e-3), 0.3, 0.2
    if shapes:
        found[FIRST_SHAPE:] = 0.1 * np.random.default_rng(0).standard_normal(SIZE_OF - FIRST_SHAPE)
    return found


def small_forces(one: np.ndarray) -> Tractions:
    """Its tractions as small forces, by polar coordinates of the ellipse."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    r, turn = (nodes + 1) / 2, 2 * np.pi * np.arange(96) / 96
    matrix = matrix_of(one[SHAPE:FIRST_SHAPE])
    unit = r[:, None, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    places = one[PLACE:SHAPE] + unit.reshape(-1, 2) @ matrix
    area = np.repeat(weights / 2 * r, 96) * 2 * np.pi / 96 * np.linalg.det(matrix)
    return Tractions(places, tractions_at(one[None], places) * area[:, None])


@pytest.mark.parametrize("shapes", [False, True])
def test_light_of_a_contact_is_that_of_its_tractions(model: PadModel, shapes: bool) -> None:
    pad, one = model.sensor, contact(shapes)
    skin = PadSkinModel(pad)
    modes = skin.synthesis(*model.pixel_positions).modes(skin.loads(one[None]))
    found = 2 * np.einsum("sk,fkrc->frc", skin.profile, modes)
    exact = 2 * press_slices(pad, [small_forces(one)], *model.pixel_positions).sum(axis=0)
    assert np.abs(found - exact).max() < 3e-4 * np.abs(exact).max()


def test_polynomials_are_orthonormal_under_the_pressure_of_hertz() -> None:
    nodes, weights = np.polynomial.legendre.leggauss(400)
    r, turn = (nodes + 1) / 2, 2 * np.pi * np.arange(64) / 64
    share = np.repeat(weights / 2 * r * np.sqrt(1 - r**2) * 3 / 64, 64)
    values = np.stack([one.value(np.repeat(r, 64), np.tile(turn, 400)) for one in pad_skin.TERMS])
    np.testing.assert_allclose((share * values) @ values.T, np.eye(len(values)), atol=1e-4)


def test_derivatives_are_those_of_the_loads(model: PadModel) -> None:
    skin, one = PadSkinModel(model.sensor), contact(shapes=True)
    found = skin.derivatives(one, np.ones(SIZE_OF, dtype=bool))
    for k, (component, harmonics) in enumerate(found):
        step = np.zeros(SIZE_OF)
        step[k] = 2e-6 if PLACE <= k < SHAPE else 2e-3
        ahead, behind = (skin.loads((one + s * step)[None]).astype(float) for s in (1, -1))
        change = (ahead - behind) / (2 * step[k])
        # curvatures take the lowest alone
        change = change[:, : harmonics.shape[-2], : harmonics.shape[-1]]
        mine = np.zeros_like(change)
        mine[... if component is None else component] = harmonics
        assert np.abs(change - mine).max() < 5e-3 * np.abs(change).max(), k


def test_gradients_are_those_of_the_loads(model: PadModel) -> None:
    skin, one = PadSkinModel(model.sensor), contact(shapes=True)
    shape, generator = skin.loads(one[None]).shape, np.random.default_rng(0)
    pull = generator.standard_normal(shape).astype(np.float32)
    found = skin.gradient(one, pull)
    for k in range(SIZE_OF):
        step = np.zeros(SIZE_OF)
        step[k] = 2e-6 if PLACE <= k < SHAPE else 2e-3
        ahead, behind = (skin.loads((one + s * step)[None]).astype(float) for s in (1, -1))
        change = (ahead - behind) / (2 * step[k])
        noise = np.linalg.norm(change)  # of a sum with weights of one
        assert abs(found[k] - np.vdot(change, pull)) < 5e-3 * noise, k


def test_synthesis_sums_standing_waves_on_any_grid(model: PadModel) -> None:
    skin, (x, y) = PadSkinModel(model.sensor), model.pixel_positions
    loads = skin.loads(contact()[None])
    whole = skin.synthesis(x, y).modes(loads)
    few = skin.synthesis(x[3:40:5], y[7:90:11]).modes(loads)
    assert np.abs(whole[..., 7:90:11, 3:40:5] - few).max() < 1e-5 * np.abs(few).max()


def test_synthesis_and_its_adjoint_agree(model: PadModel) -> None:
    skin, generator = PadSkinModel(model.sensor), np.random.default_rng(0)
    both = skin.synthesis(*model.pixel_positions)
    loads = skin.loads(contact()[None])
    modes = both.modes(loads)
    other = generator.standard_normal(modes.shape).astype(np.float32)
    one, two = np.vdot(modes, other), np.vdot(loads, both.adjoint(other))
    assert np.isclose(one, two, rtol=1e-4)


def test_amounts_are_sums_over_the_tractions() -> None:
    one = contact(shapes=True)
    places, forces = small_forces(one)
    found = amounts(one[None])
    np.testing.assert_allclose(found[:3], forces.sum(axis=0), rtol=1e-3)
    centre = forces[:, 0] @ places / forces[:, 0].sum()
    np.testing.assert_allclose(found[6:8], centre, atol=1e-7)
    x, y = places.T
    moment = [-y @ forces[:, 0], x @ forces[:, 0], x @ forces[:, 2] - y @ forces[:, 1]]
    np.testing.assert_allclose(found[3:6], moment, rtol=2e-3)
    x, y = (places - centre).T
    assert np.isclose(spin(one), x @ forces[:, 2] - y @ forces[:, 1], rtol=1e-2)
    apart = places - centre
    spread = (forces[:, 0, None] * apart).T @ apart / forces[:, 0].sum()
    axes = 2 * np.sqrt(5 * np.linalg.eigvalsh(spread)[::-1])
    np.testing.assert_allclose(found[8:10], axes, rtol=2e-3)


def expected(pad: Pad, presses: list[ff.Press]) -> np.ndarray:
    """Force and centre of pressure."""
    parts = [pad_tractions(pad, press) for press in presses]
    force = np.concatenate([part.forces for part in parts])
    places = np.concatenate([part.places for part in parts])
    return np.concatenate([force.sum(axis=0), force[:, 0] @ places / force[:, 0].sum()])


PRESSES = {
    "a sphere": [ff.Press(x=1.37e-3, y=-2.1e-3, normal=3.0, tangential=(0.9, -0.5), radius=6e-3)],
    "a patch": [
        ff.Press(x=-2e-3, y=1e-3, normal=4.0, tangential=(1.0, 0.0), width=3e-3, profile="flat")
    ],
    "an ellipse": [ff.Press(x=0.4e-3, y=0.3e-3, normal=2.0, width=(2e-3, 1e-3), angle=30.0)],
    "two": [
        ff.Press(x=-3.4e-3, y=1e-3, normal=2.0, tangential=(0.0, 0.6), radius=5e-3),
        ff.Press(x=3.1e-3, y=-1.5e-3, normal=1.0, tangential=(-0.3, 0.0), radius=3e-3),
    ],
}  # fmt: skip


@pytest.mark.parametrize("name", list(PRESSES))
def test_contacts_are_read_where_and_as_strong_as_they_are(
    model: PadModel, reader: ff.Reader, name: str
) -> None:
    presses = PRESSES[name]
    reading = reader.search(model.expose(presses, rng=3))
    assert reading.status is ff.Status.OK
    total = reading.total
    assert total is not None
    found = np.concatenate([total.force, total.centre])
    off = found - expected(model.sensor, presses)
    assert (np.abs(off) < FAR * total.std[VALUES]).all()
    assert (total.std[:3] < 0.02 * total.force[0]).all()
    assert (total.std[6:8] < 0.02e-3).all()
    assert len(reading.contacts) == len(presses)
    for one, press in zip(reading.contacts, presses, strict=True):
        own = np.concatenate([one.force, one.centre]) - expected(model.sensor, [press])
        assert (np.abs(own) < FAR * one.std[VALUES]).all()
    # forces on squares add up to the total
    np.testing.assert_allclose(reading.forces.sum(axis=0), total.force, rtol=1e-2, atol=1e-2)
    assert reading.std.shape == reading.forces.shape


def test_axes_and_orientation_are_those_of_the_contact(model: PadModel, reader: ff.Reader) -> None:
    (one,) = reader.search(model.expose(PRESSES["an ellipse"], rng=4)).contacts
    assert one.axes is not None
    assert one.orientation is not None
    off = one.values[8:] - [2e-3, 1e-3, np.radians(30.0)]
    assert (np.abs(off) < FAR * one.std[8:]).all()
    assert (one.std[8:] < [0.2e-3, 0.2e-3, 0.2]).all()


def test_a_twist_is_read_as_a_moment(model: PadModel, reader: ff.Reader) -> None:
    ball = pad_tractions(model.sensor, ff.Press(x=0.5e-3, y=0.2e-3, normal=4.0, radius=8e-3))
    x, y = (ball.places - [0.5e-3, 0.2e-3]).T
    share = 0.1 * ball.forces[:, 0] / np.hypot(x, y).max()
    twisted = ball.forces + np.column_stack([0 * x, -share * y, share * x])
    slices = press_slices(model.sensor, [Tractions(ball.places, twisted)], *model.pixel_positions)
    light = model.seen(slices).reshape(model.frame_shape)
    noise = np.random.default_rng(1).uniform(-5, 5, light.shape)
    reading = reader.search(np.round(245 * light + 5 + noise).clip(0, 255))
    (one,) = reading.contacts
    moment = share @ (x**2 + y**2)
    assert abs(one.spin - moment) < FAR * one.spin_std
    assert one.spin_std < 0.5 * moment


def test_tractions_carry_the_force(model: PadModel, reader: ff.Reader) -> None:
    presses = PRESSES["a patch"]
    traction = reader.search(model.expose(presses, rng=5)).traction
    assert traction is not None
    area = np.diff(np.unique(traction.places[:, 0])).min() ** 2
    np.testing.assert_allclose(traction.values.sum(axis=0) * area, [4, 1, 0], atol=0.15)
    pressure = 4.0 / (np.pi * 1.5e-3**2)
    inside = np.hypot(*(traction.places - [-2e-3, 1e-3]).T) < 1.0e-3
    off = traction.values[inside, 0] - pressure
    assert np.sqrt(np.mean(np.square(off / traction.std[inside, 0]))) < 2.5
    assert np.abs(off).mean() < 0.15 * pressure


def test_contacts_push_within_the_friction_cone() -> None:
    pad = ff.characterize(ff.load_sensor("fingertip"))
    first = ff.Press(x=1.6e-3, y=-1e-3, radius=4e-3, normal=1.0, tangential=(0.2, 0.0))
    second = ff.Press(x=-2.5e-3, y=1.5e-3, radius=3e-3, normal=0.5, tangential=(0.0, -0.1))
    truth, reader = np.array([1.5, 0.2, -0.1]), ff.Reader(pad)
    for seed in (2, 3):
        frame = pad.expose([first, second], rng=seed)
        for found in (reader.search(frame), reader.read(frame)):  # alone, and from the last one
            assert found.ok
            assert found.total is not None
            assert (np.abs(found.total.force - truth) < FAR * found.total.force_std).all()
            for one in found.contacts:
                normal, *shear = one.force
                assert np.hypot(*shear) <= 1.000001 * pad.sensor.skin.friction * normal


def test_nothing_is_no_contact(model: PadModel, reader: ff.Reader) -> None:
    reading = reader.search(model.expose(np.zeros((model.sensor.tactels.total, 3)), rng=0))
    assert reading.status is ff.Status.NO_CONTACT
    assert not reading.contacts
    assert reading.total is not None
    assert not reading.total.force.any()
    traction = reading.traction
    assert traction is not None
    assert not traction.values.any()


def test_moving_contacts_are_followed_and_end_and_new_ones_are_searched(model: PadModel) -> None:
    rows = [
        [ff.Press(x=1e-3 + 0.05e-3 * t, y=0.0, normal=2 + 0.1 * t, radius=5e-3)] for t in range(3)
    ]
    other = [*rows[-1], ff.Press(x=-4e-3, y=2e-3, normal=1.5, radius=3e-3)]
    frames = model.expose([*rows, other, rows[-1], []], rng=6)
    readings = list(ff.Reader(model).stream(frames))
    assert [one.tracked for one in readings] == [False, True, True, False, True, False]
    assert [len(one.contacts) for one in readings] == [1, 1, 1, 2, 1, 0]
    assert readings[-1].status is ff.Status.NO_CONTACT
    total = readings[2].total
    assert total is not None
    off = np.concatenate([total.force, total.centre]) - expected(model.sensor, rows[2])
    assert (np.abs(off) < FAR * total.std[VALUES]).all()
    # an earlier matrix serves while it is nearly right
    searched = ff.Reader(model).search(frames[2]).total
    assert searched is not None
    np.testing.assert_allclose(total.std[VALUES], searched.std[VALUES], rtol=0.1)


def test_what_the_skin_of_a_pad_does_not_allow_for_is_told(model: PadModel) -> None:
    with pytest.raises(InputError, match="friction of a pad's skin"):
        ff.Reader(model, friction=0.5)


def test_contacts_are_written_as_a_table(
    model: PadModel, reader: ff.Reader, tmp_path: Path
) -> None:
    presses = PRESSES["an ellipse"]
    frames = model.expose([presses, presses], rng=7)
    readings = [reader.search(frames[0]), reader.search(frames[1][:, :3])]
    counts = save_contacts(tmp_path / "contacts.csv", readings, model.sensor.components)
    assert counts == {"OK": 1, "BAD_FRAME": 1}
    with open(tmp_path / "contacts.csv", newline="", encoding="utf-8") as file:
        whole, single, bad = csv.DictReader(file)
    assert [row["contact"] for row in (whole, single, bad)] == ["0", "1", "0"]
    assert abs(float(single["x_mm"]) - 0.4) < FAR * float(single["x_std_mm"]) < 0.1
    assert abs(float(single["orientation_deg"]) - 30) < FAR * float(single["orientation_std_deg"])
    assert abs(float(single["long_mm"]) - 2) < 0.2
    assert abs(float(whole["normal_N"]) - 2) < 0.05
    assert abs(float(single["spin_Nmm"])) < FAR * float(single["spin_std_Nmm"])
    assert bad["x_mm"] == "nan"


def test_searches_go_on_where_loads_leave_no_trace_but_that_of_rounding() -> None:
    """A uniform pressure on squares that cover a pad, in sums of single precision."""
    n, rows = 27, np.random.default_rng(0).standard_normal((400, 27))
    silent = np.ones((n, n)) / n
    seen = rows @ (np.eye(n) - silent)
    matrix = seen.T @ seen
    mean = np.trace(matrix) / n
    matrix -= 1e-7 * mean * silent
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(matrix)
    factor = factored(matrix)
    assert np.abs(factor @ factor.T - matrix).max() < 2e-6 * mean
    seen = seen + rows  # as they are where all loads show
    np.testing.assert_allclose(factored(seen.T @ seen), np.linalg.cholesky(seen.T @ seen))
