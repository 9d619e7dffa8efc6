"""Frames of strips under large strain."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import fringeforce as ff
from fringeforce.base.errors import DesignError, InputError
from fringeforce.mechanics.finite_strain import finite_strip
from fringeforce.models.finite_strain import SkinStrain, beyond_second_order
from fringeforce.models.presses import tractions
from fringeforce.models.skin import GEOMETRY, MESH, PLACE, WIDTH, Contacts
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant
from fringeforce.reading.skin_reader import SkinReader
from fringeforce.reading.strip_reader import StripFrameReader


def _model(sensor: ff.Sensor) -> ff.SensorModel:
    changes = {"tactels.contact_width": "0.5 mm", "camera.pixels": 256}
    return ff.characterize(sensor.replace(**changes))


def test_forces_act_as_patches_and_presses_alike(sensor: ff.Sensor) -> None:
    model = _model(sensor)
    forces = np.zeros((11, 2))
    forces[5] = 1.0, 0.2
    press = ff.Press(x=0.0, normal=1.0, tangential=0.2, width=0.5e-3, profile="flat")
    phase = model.phase([press], strain="finite")
    peak = np.abs(phase).max()
    np.testing.assert_allclose(model.phase(forces, strain="finite"), phase, atol=2e-3 * peak)
    linear = model.phase(forces)
    assert 5e-3 * peak < np.abs(phase - linear).max() < 3e-2 * peak


@pytest.mark.parametrize(("width", "radius"), [(0.8e-3, None), (None, 5e-3)])
def test_gentle_presses_are_the_linear_ones(
    sensor: ff.Sensor, width: float | None, radius: float | None
) -> None:
    model = _model(sensor)
    touch = [ff.Press(x=1e-3, normal=0.02, tangential=0.004, width=width, radius=radius)]
    linear = model.phase(touch)
    finite = model.phase(touch, strain="finite")
    assert np.abs(finite - linear).max() < 1e-2 * np.abs(linear).max()


def test_a_design_says_which_strain(sensor: ff.Sensor) -> None:
    model = _model(sensor)
    finite = ff.characterize(model.sensor.replace(**{"transducer.strain": "finite"}))
    forces = ff.polar(0.5, 10, n=11)
    np.testing.assert_array_equal(
        finite.expose(forces, rng=0), model.expose(forces, rng=0, strain="finite")
    )
    np.testing.assert_array_equal(finite.phase(forces, strain="linear"), model.phase(forces))


def test_what_large_strain_does_not_know_is_refused(sensor: ff.Sensor) -> None:
    with pytest.raises(DesignError, match="contact_width"):
        sensor.replace(**{"transducer.strain": "finite"})
    with pytest.raises(DesignError, match='take strain = "finite", or leave loads out'):
        sensor.replace(**{"transducer.loads": "follower"})
    skin = ff.load_sensor("soft-skin")
    with pytest.raises(DesignError, match='solved in a plane, not with plane = "3d"'):
        skin.replace(**{"transducer.plane": "3d"})
    model = _model(sensor)
    with pytest.raises(InputError, match="width"):
        model.phase([ff.Press(x=0.0, normal=1.0)], strain="finite")
    with pytest.raises(InputError, match="as built"):
        model.expose(ff.polar(0.5, 10, n=11), as_built=0, strain="finite")


@pytest.mark.parametrize("loads", ["dead", "follower"])
def test_loads_beyond_the_last_stable_state_are_named_by_their_frame(loads: str) -> None:
    skin = ff.load_sensor("soft-skin").replace(**{"transducer.loads": loads})
    touches = [[ff.Press(x=0.0, normal=n, width=3e-4)] for n in (0.02, 1.0)]
    words = {"dead": "folds under them", "follower": r"beyond \d+% of these loads"}
    with pytest.raises(InputError, match=rf"Frame 1 \(the first is 0\): .*{words[loads]}"):
        ff.characterize(skin).phase(touches)


@pytest.fixture(scope="module", params=["dead", "follower"])
def strips(
    sensor: ff.Sensor, request: pytest.FixtureRequest
) -> tuple[ff.SensorModel, ff.SensorModel]:
    """The same strip of small and of large strain."""
    linear = _model(sensor)
    changes = {"transducer.strain": "finite", "transducer.loads": request.param}
    return linear, ff.characterize(linear.sensor.replace(**changes))


@pytest.fixture(scope="module")
def pressed(strips: tuple[ff.SensorModel, ff.SensorModel]) -> tuple[np.ndarray, np.ndarray]:
    """Forces up to a newton, and the phases that Newton steps find for each."""
    rng = np.random.default_rng(5)
    forces = rng.uniform(0, 1, (5, 11, 1)) * [1.0, 0.25]
    return forces, strips[1].phase(forces)


def test_the_second_order_leaves_a_tenth_of_what_the_linear_phase_does(
    strips: tuple[ff.SensorModel, ff.SensorModel], pressed: tuple[np.ndarray, np.ndarray]
) -> None:
    second = ff.Reader(strips[1])._single
    # the third order of loads that follow the surface is twice as large
    share = 0.2 if strips[1].sensor.transducer.loads == "dead" else 0.3
    for force, phase in zip(*pressed, strict=True):
        off = np.abs(strips[0].phase(force) - phase).max()
        assert np.abs(second.phase(force) - phase).max() < share * off
        assert off > 4e-3 * np.abs(phase).max()


def test_what_the_second_order_leaves_is_known_when_it_is_solved_for(
    strips: tuple[ff.SensorModel, ff.SensorModel], pressed: tuple[np.ndarray, np.ndarray]
) -> None:
    """Of coarser elements and splines, against the phase of finer ones along the very lines."""
    sensor = strips[1].sensor
    half = sensor.transducer.length / 2
    single = ff.Reader(strips[1])._single
    inner = np.abs(sensor.pixel_positions) < half - 1e-3  # corners have singular stresses
    for force, phase in zip(*pressed, strict=True):
        rest = beyond_second_order(sensor, sensor.pixel_positions, force)
        left = phase - single.phase(force)
        assert np.abs(left).max() > 2e-3
        # both orders of the two meshes differ by 2e-4 of the peak
        assert np.abs(rest - left)[inner].max() < 3e-4 * np.abs(phase).max()


def test_what_is_stated_of_higher_orders_is_as_large_as_what_is_left(
    strips: tuple[ff.SensorModel, ff.SensorModel], pressed: tuple[np.ndarray, np.ndarray]
) -> None:
    single = ff.Reader(strips[1])._single
    assert isinstance(single, StripFrameReader)
    known = single.higher_orders
    assert known is not None
    stated = [np.square(known.left(force.ravel(), None)).sum(axis=0).mean() for force in pressed[0]]
    left = [
        np.square(phase - single.phase(force)).mean() for force, phase in zip(*pressed, strict=True)
    ]
    assert 1 / 3 < np.sqrt(np.mean(stated) / np.mean(left)) < 3


def _frame(model: ff.SensorModel, phase: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    camera = model.sensor.camera
    level = camera.offset + camera.amplitude * (1 - np.cos(phase)) / 2
    noisy = level + rng.uniform(-camera.noise, camera.noise, level.shape)
    return np.clip(np.rint(noisy), 0, camera.full_scale)


def test_frames_of_large_strain_are_read_as_well_as_their_noise_allows(
    strips: tuple[ff.SensorModel, ff.SensorModel], pressed: tuple[np.ndarray, np.ndarray]
) -> None:
    rng = np.random.default_rng(6)
    reader, linear, squares, worst = ff.Reader(strips[1]), ff.Reader(strips[0]), [], [0.0, 0.0]
    for force, phase in zip(*pressed, strict=True):
        frame = _frame(strips[0], phase, rng)
        reading = reader.search(frame)
        assert reading.status is ff.Status.OK
        error = (reading.forces - force).ravel()
        squares.append(error @ np.linalg.solve(reading.covariance, error))
        old = (linear.search(frame).forces - force).ravel()
        worst = [max(worst[0], np.abs(error).max()), max(worst[1], np.abs(old).max())]
    # sums of 110 unit squares lie in 67 .. 164 in 99.9 of 100 cases (chi-square)
    assert 67 < np.sum(squares) < 164
    assert worst[0] < worst[1] / (1.5 if strips[1].sensor.transducer.loads == "dead" else 1.0)


@pytest.mark.slow
def test_a_strip_is_read_by_its_own_strain_energy(sensor: ff.Sensor) -> None:
    """Layers with a large second invariant, at strains of some per cent."""
    plain = sensor.replace(**{"tactels.contact_width": "0.8 mm", "transducer.strain": "finite"})
    law = {
        f"transducer.{layer}.mooney_rivlin": [0.4, 0.6] for layer in ("compliant", "photoelastic")
    }
    model = ff.characterize(plain.replace(**law))
    rng = np.random.default_rng(10)
    force = rng.uniform(0.5, 2, (11, 1)) * [1.0, 0.25]
    frame = _frame(model, model.phase(force), rng)
    own, other = (ff.Reader(one).search(frame) for one in (model, ff.characterize(plain)))
    assert own.status is ff.Status.OK
    squares = [
        (one.forces - force).ravel() @ np.linalg.solve(one.covariance, (one.forces - force).ravel())
        for one in (own, other)
    ]
    # sums of 22 unit squares lie in 6.4 .. 50.5 in 99.9 of 100 cases (chi-square)
    assert 6.4 < squares[0] < 50.5 < squares[1]


def test_loads_beyond_the_second_order_are_read_by_solving_the_strip_at_them(
    sensor: ff.Sensor,
) -> None:
    changes = {"tactels.contact_width": "0.8 mm", "transducer.strain": "finite"}
    model = ff.characterize(sensor.replace(**changes))
    reader, rng = ff.Reader(model), np.random.default_rng(8)
    squares = []
    for _ in range(2):
        force = rng.uniform(0, 4, (11, 1)) * [1.0, 0.25]
        reading = reader.search(_frame(model, model.phase(force), rng))
        assert reading.status is ff.Status.OK
        error = (reading.forces - force).ravel()
        squares.append(error @ np.linalg.solve(reading.covariance, error))
    # sums of 44 unit squares lie in 18 .. 82 in 99.9 of 100 cases (chi-square)
    assert 18 < np.sum(squares) < 82


def test_loads_that_grow_beyond_the_second_order_are_followed(
    strips: tuple[ff.SensorModel, ff.SensorModel],
) -> None:
    """From a newton, which the second order reads, to where it is far off."""
    reader, rng = ff.Reader(strips[1]), np.random.default_rng(9)
    single, ends = reader._single, rng.uniform(0.3, 1, (11, 1)) * [1.0, 0.2]
    share = np.linspace(1, 2.4, 40)[:, None, None]
    forces = share * ends
    at = strips[1].sensor.pixel_positions
    rest = [beyond_second_order(strips[1].sensor, at, force) for force in forces]
    phases = [single.phase(force) + more for force, more in zip(forces, rest, strict=True)]
    batch = reader.read_batch(np.stack([_frame(strips[1], phase, rng) for phase in phases]))
    assert batch.std is not None
    assert batch.tracked[1:].mean() > 0.9
    off = np.abs(batch.forces - forces) / batch.std
    assert 0.92 < (off < 1.96).mean() < 0.98
    assert off.max() < 6
    plain = [np.abs(single.phase(forces[-1]) - phases[-1]).max(), np.abs(rest[-1]).max()]
    assert min(plain) > 0.05  # two of its deviations


def test_a_slide_under_large_strain_is_followed(
    strips: tuple[ff.SensorModel, ff.SensorModel],
) -> None:
    """The compiled loop takes the tangent anew as the loads change."""
    reader, camera, rng = ff.Reader(strips[1]), strips[0].sensor.camera, np.random.default_rng(7)
    ends = rng.uniform(0.1, 1.5, (2, 11, 1)) * [[[1.0, 0.2]], [[1.0, -0.2]]]
    share = np.linspace(0, 1, 400)[:, None, None]
    forces = (1 - share) * ends[0] + share * ends[1]
    phases = np.stack([reader._single.phase(force) for force in forces])
    level = camera.offset + camera.amplitude * (1 - np.cos(phases)) / 2
    noisy = level + rng.uniform(-camera.noise, camera.noise, level.shape)
    batch = reader.read_batch(np.clip(np.rint(noisy), 0, camera.full_scale).astype(np.uint8))
    assert batch.std is not None
    inside = np.abs(batch.forces - forces) < 1.96 * batch.std
    assert 0.92 < inside.mean() < 0.98
    # a stretch that comes out of the dark may be ambiguous for some frames
    assert (batch.status == ff.Status.OK).mean() > 0.95


def _light(model: ff.SensorModel, presses: list[ff.Press], order: int, patches: int) -> np.ndarray:
    """Phase of presses as uniform patches side by side, on elements of their own."""
    centres, widths, forces = list[np.ndarray](), list[np.ndarray](), list[np.ndarray]()
    for press in presses:
        found = tractions(model.sensor, press)
        first, last = (found.places[[0, -1]] * 3 - found.places[[1, -2]]) / 2
        edges = np.linspace(first, last, patches + 1)
        sums = np.cumsum(found.forces, axis=0) - found.forces / 2
        reached = [np.interp(edges, found.places, part) for part in sums.T]
        shares = np.diff(np.column_stack(reached), axis=0)
        forces.append(shares * found.forces.sum(axis=0) / shares.sum(axis=0))
        centres.append((edges[1:] + edges[:-1]) / 2)
        widths.append(np.diff(edges))
    transducer, light = model.sensor.transducer, model.sensor.polariscope
    patched = np.concatenate(centres), np.concatenate(widths)
    strip = finite_strip(transducer, *patched, order=order)
    seen = strip.light.integrated_stress(
        strip.solved(np.concatenate(forces)), model.pixel_positions
    )
    constant = stress_optic_constant(transducer.photoelastic, light.wavelength)
    return phase_lead(seen, constant)


@pytest.fixture(scope="module")
def skin() -> ff.SensorModel:
    """The soft strip on which anything presses anywhere."""
    return ff.characterize(ff.load_sensor("soft-skin"))


SOFT = [
    [ff.Press(x=0.7e-3, normal=0.7, tangential=0.2, radius=8e-3)],
    [
        ff.Press(x=-3.1e-3, normal=0.32, tangential=-0.12, radius=12e-3),
        ff.Press(x=2.4e-3, normal=0.6, tangential=0.08, radius=7e-3),
    ],
]
"""Cylinders whose tractions are those of contact mechanics, not the reader's shapes."""


def test_soft_skins_are_read_where_linear_theory_is_wrong(skin: ff.SensorModel) -> None:
    """Frames of finer elements, read by both."""
    sensor, squares, far = skin.sensor, [], []
    plain = ff.characterize(sensor.replace(**{"transducer.strain": "linear"}))
    readers = ff.Reader(skin), ff.Reader(plain)
    for number, presses in enumerate(SOFT):
        parts = [tractions(sensor, press) for press in presses]
        places = np.concatenate([part.places for part in parts])
        force = np.concatenate([part.forces for part in parts])
        true = np.array([*force.sum(axis=0), force[:, 0] @ places / force[:, 0].sum()])
        frame = skin.delivered(_light(skin, presses, order=6, patches=12), rng=number)
        for reader, found in zip(readers, (squares, far), strict=True):
            reading = reader.search(frame)
            assert reading.total is not None
            total = reading.total
            error = np.array([*total.force, total.centre[0]]) - true
            found.append(np.abs(error) / total.std[[0, 1, 5]])
            if reader is readers[0]:
                assert reading.status is ff.Status.OK
                assert len(reading.contacts) == len(presses)
                assert total.std[0] < 0.01 * total.force[0]
    assert np.max(squares) < 4  # one in 16,000 is beyond
    assert np.min(np.max(far, axis=1)) > 6


@pytest.mark.parametrize("width", [0.3e-3, 0.5e-3, 0.8e-3, 1.2e-3])
def test_contacts_narrower_than_the_cover_are_read_as_finer_elements_have_them(
    skin: ff.SensorModel, width: float
) -> None:
    """Of a camera that shows more of what the reader's elements miss."""
    quiet = skin.sensor.replace(**{"camera.noise": 1.5})
    model = ff.characterize(quiet)
    force = 0.2 * quiet.transducer.compliant.youngs_modulus * width * quiet.transducer.width
    true = np.array([force, -0.25 * force, 0.83e-3])
    press = ff.Press(x=true[2], normal=force, tangential=true[1], width=width, profile="flat")
    strip = finite_strip(quiet.transducer, [true[2]], [width], order=6, share=1 / 8)
    constant = stress_optic_constant(quiet.transducer.photoelastic, quiet.polariscope.wavelength)
    seen = strip.light.integrated_stress(strip.solved([true[:2]]), model.pixel_positions)
    phase = phase_lead(seen, constant)
    added = phase - model.phase([press], strain="linear")
    assert np.abs(added).max() > 0.03 * np.abs(phase).max()
    known = SkinStrain(quiet, model.pixel_positions).under([tractions(quiet, press)])
    # a quarter of what readings allow for what elements miss
    assert np.abs(known - added).max() < 0.25 * MESH * np.abs(added).max()
    reading = ff.Reader(model).search(model.delivered(phase, rng=1))
    assert reading.status is ff.Status.OK
    assert reading.total is not None
    error = np.array([*reading.total.force, reading.total.centre[0]]) - true
    own = np.ix_([0, 1, 5], [0, 1, 5])
    square = error @ np.linalg.solve(reading.total.covariance[own], error)
    assert square < 21.1  # beyond with a chance of 1e-4 (chi-square)


@pytest.mark.parametrize("loads", ["dead", "follower"])
def test_contacts_under_large_strain_change_the_phase_as_differences_tell(
    skin: ff.SensorModel, loads: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On the same elements, which else move with the contacts."""
    single = ff.Reader(ff.characterize(skin.sensor.replace(**{"transducer.loads": loads})))._single
    assert isinstance(single, SkinReader)
    model = single.skin
    geometry = model.drawn[None].copy()
    geometry[0, :2] = 0.7e-3, 1.4e-3
    about = np.concatenate([[[0.6, 0.16]], geometry], axis=1)
    frame, _ = model.frame(Contacts(about[:, :2], geometry))
    tangents = [*frame.moments[0, :, 0], *(frame.fields[:GEOMETRY] / model.units(1)[:, None])]
    steps = [0.01, 0.01, 2e-6, 2e-6, *[0.01] * (GEOMETRY - 2)]
    peak = np.abs(model.strained(Contacts(about[:, :2], geometry))).max()
    assert peak > 0.1
    assert model.strain is not None
    strip = model.strain.strip(geometry[:, PLACE], 2 * geometry[:, WIDTH])
    monkeypatch.setattr(SkinStrain, "strip", lambda *_: strip)
    for k, (step, tangent) in enumerate(zip(steps, tangents, strict=True)):
        ahead, behind = about.copy(), about.copy()
        ahead[0, k] += step
        behind[0, k] -= step
        one, other = (model.phase(Contacts(at[:, :2], at[:, 2:])) for at in (ahead, behind))
        difference = (one - other) / (2 * step)
        # the slope of the surface jumps a little from one element to the next
        most = 2e-3 if loads == "dead" else 5e-3
        assert np.abs(difference - tangent).max() < most * np.abs(difference).max()


@pytest.fixture(scope="module")
def following(skin: ff.SensorModel) -> ff.SensorModel:
    """The soft strip under loads that follow its surface."""
    return ff.characterize(skin.sensor.replace(**{"transducer.loads": "follower"}))


@pytest.mark.parametrize("presses", SOFT)
def test_loads_that_follow_a_skin_shine_as_narrow_patches_do(
    following: ff.SensorModel, presses: list[ff.Press]
) -> None:
    """Each of which is turned with the line between its own ends."""
    true = _light(following, presses, order=6, patches=24)
    peak, inner = np.abs(true).max(), np.abs(following.pixel_positions) < 11e-3
    dead = following.sensor.replace(**{"transducer.loads": "dead"})
    off = np.abs(ff.characterize(dead).phase(presses) - true)[inner].max()
    assert np.abs(following.phase(presses) - true)[inner].max() < min(2e-3 * peak, off / 5)


def test_line_loads_that_follow_a_skin_act_as_the_press_that_they_stand_for(
    following: ff.SensorModel,
) -> None:
    press = ff.Press(x=0.5e-3, normal=0.6, tangential=0.15, width=4e-3)
    places = following.sensor.tactels.positions
    edges = np.append(places, 2 * places[-1] - places[-2]) - (places[1] - places[0]) / 2
    t = np.clip((edges - press.x) / 2e-3, -1, 1)
    shares = np.diff((t * np.sqrt(1 - t**2) + np.arcsin(t)) / np.pi)  # of Hertz's pressure
    forces = shares[:, None] * [0.6, 0.15]
    phase, linear = following.phase([press]), following.phase([press], strain="linear")
    off = following.phase(forces) - following.phase(forces, strain="linear") - (phase - linear)
    inner = np.abs(following.pixel_positions) < 11e-3
    assert np.abs(off)[inner].max() < 0.05 * np.abs(phase - linear).max()


def test_loads_that_follow_a_skin_are_read(following: ff.SensorModel) -> None:
    """And not by who takes them for dead, whose forces are off or who refuses."""
    squares = []
    dead = ff.characterize(following.sensor.replace(**{"transducer.loads": "dead"}))
    presses = SOFT[0]
    part = tractions(following.sensor, presses[0])
    true = np.array([*part.forces.sum(axis=0), part.centre])
    frame = following.delivered(_light(following, presses, order=6, patches=24), rng=0)
    for model in (following, dead):
        reading = ff.Reader(model)._single.read(frame)
        if model is following:
            assert reading.status is ff.Status.OK
        if reading.status is not ff.Status.OK:
            continue
        assert reading.total is not None
        error = np.array([*reading.total.force, reading.total.centre[0]]) - true
        own = np.ix_([0, 1, 5], [0, 1, 5])
        squares.append(error @ np.linalg.solve(reading.total.covariance[own], error))
    assert squares[0] < 21.1  # beyond with a chance of 1e-4 (chi-square)
    assert np.min(squares[1:], initial=np.inf) > 21.1


def test_a_skin_whose_surface_folds_is_refused(skin: ff.SensorModel) -> None:
    """Small strain would find contacts, and be wrong."""
    linear = ff.characterize(skin.sensor.replace(**{"transducer.strain": "linear"}))
    press = ff.Press(x=0.0, normal=1.0, width=0.8e-3)
    reading = ff.Reader(skin)._single.read(linear.expose([press], rng=0))
    assert not reading.ok
    assert np.isfinite(reading.phase).all()


def test_pressed_harder_a_soft_skin_is_followed(skin: ff.SensorModel) -> None:
    """Between solutions at five loads, which a spline in time joins."""
    rows = [
        [ff.Press(x=-1e-3, normal=float(n), tangential=float(0.2 * n), width=2.6e-3)]
        for n in np.linspace(0.25, 0.7, 5)
    ]
    phases = CubicSpline(range(5), skin.phase(rows))(np.linspace(0, 4, 40))
    readings = list(ff.Reader(skin).stream(skin.delivered(phases, rng=3)))
    assert all(reading.status is ff.Status.OK for reading in readings)
    assert np.mean([reading.tracked for reading in readings]) > 0.9
    normal = np.linspace(0.25, 0.7, 40)
    off = [
        (one.total.force - np.array([n, 0.2 * n])) / one.total.std[:2]
        for one, n in zip(readings, normal, strict=True)
        if one.total is not None
    ]
    assert np.shape(off) == (40, 2)
    assert np.abs(off).max() < 5
