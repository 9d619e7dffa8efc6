"""What the server answers about a pad."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from small_pad import small_pad
from starlette.testclient import TestClient

import fringeforce as ff
from fringeforce.explorer.pads.fingers import tactel_forces
from fringeforce.explorer.pads.pictures import COARSE, FINE, coarse
from fringeforce.explorer.pads.protocol import Finger
from fringeforce.explorer.pads.sketch import Sketch
from fringeforce.explorer.pads.solution import facts, solved
from fringeforce.explorer.protocol import decoded, encoded
from fringeforce.explorer.server import application
from fringeforce.explorer.session import FirstDesign
from fringeforce.io.tables import load_forces
from fringeforce.models.pad import PadModel, characterize_pad
from fringeforce.optics.colour import encoded as screen
from fringeforce.optics.colour import light_colour, white_light
from whole_numbers import in_whole_numbers

pytestmark = pytest.mark.slow

TOKEN = "t" * 32
HOST = "http://127.0.0.1:8000"
FINGER = {"x": 1e-3, "y": -0.5e-3, "radius": 4e-3, "normal": 20.0, "shear_x": 3.0, "twist": 0.01}
Ask = Callable[..., tuple[dict[str, Any], dict[str, np.ndarray]]]


@pytest.fixture(scope="module")
def model() -> PadModel:
    return characterize_pad(small_pad())


@pytest.fixture(scope="module")
def client() -> Iterator[TestClient]:
    with TestClient(application(FirstDesign(small_pad()), TOKEN), base_url=HOST) as found:
        yield found


@pytest.fixture
def ask(client: TestClient) -> Iterator[Ask]:
    address = f"ws://127.0.0.1:8000/{TOKEN}/socket"
    with client.websocket_connect(address, headers={"Origin": HOST}) as socket:
        designs = decoded(socket.receive_bytes())[0]["designs"]
        assert sorted(designs) == ["fingertip", "pad", "pad-skin"]

        def asked(**header: object) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
            socket.send_bytes(encoded(header))
            return decoded(socket.receive_bytes())

        assert asked(type="design", id=1)[0]["type"] == "model"
        yield asked


def truth(model: PadModel, *contacts: dict[str, float]) -> np.ndarray:
    return tactel_forces(model.sensor.tactels, [Finger(**contact) for contact in contacts])


def pressed(ask: Ask, view: str, fine: bool = True, seed: int = 0) -> dict[str, np.ndarray]:
    contacts = [FINGER]
    header, blocks = ask(
        type="press", id=2, design=1, contacts=contacts, view=view, fine=fine, seed=seed
    )
    assert header["type"] == "picture", header.get("text")
    return blocks


def seen(model: PadModel, **light: Any) -> np.ndarray:
    """Intensity of another picture of the same pad on the grid of the page."""
    camera = {"pixels": [FINE, FINE], "kind": "ordinary"}
    pad = model.sensor.replace(camera=camera, polariscope=light)
    return PadModel(pad, model.influence).intensity(truth(model, FINGER))


def test_the_page_of_a_pad_is_served_in_place_of_a_strip_s(client: TestClient) -> None:
    answer = client.get(f"/{TOKEN}/")
    assert answer.status_code == 200
    assert 'id="pad"' in answer.text
    assert client.get(f"/{TOKEN}/pad.js").status_code == 200


def test_the_camera_s_picture_is_the_library_s_frame(ask: Ask, model: PadModel) -> None:
    blocks = pressed(ask, "camera-0", seed=7)
    frame = model.expose(truth(model, FINGER), rng=7)
    np.testing.assert_array_equal(blocks["image"][..., 0], frame)
    np.testing.assert_allclose(blocks["forces"], truth(model, FINGER), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("degrees", [0, 45, 90, 135])
def test_the_picture_of_an_analyser_is_the_library_s(
    ask: Ask, model: PadModel, degrees: int
) -> None:
    number = {0: 0, 45: 1, 135: 2, 90: 3}[degrees]
    share = seen(model, channels=[{"arrangement": "analyser", "angle": float(degrees)}])
    expected = screen(share[..., None] * light_colour(632.8e-9))
    image = pressed(ask, f"picture-0-{number}")["image"]
    assert np.abs(image.astype(int) - expected).max() <= 1


def test_the_dark_field_in_the_light_s_colour_is_the_library_s(ask: Ask, model: PadModel) -> None:
    expected = screen(seen(model)[..., None] * light_colour(632.8e-9))
    image = pressed(ask, "light")["image"]
    assert expected.max() > 150
    assert np.abs(image.astype(int) - expected).max() <= 1


def test_white_light_is_the_sum_of_its_wavelengths(ask: Ask, model: PadModel) -> None:
    wavelengths = np.linspace(420e-9, 680e-9, 10)
    shares = [seen(model, channels=[{"wavelength": float(w)}]) for w in wavelengths]
    expected = screen(np.stack(shares, axis=-1) @ white_light(wavelengths))
    image = pressed(ask, "white")["image"]
    assert np.abs(image.astype(int) - expected).max() <= 1


def test_a_picture_is_coarse_while_something_moves(ask: Ask) -> None:
    coarse, fine = (pressed(ask, "white", fine)["image"] for fine in (False, True))
    assert len(coarse) < len(fine) == FINE
    step = FINE / len(coarse)
    middle = (np.arange(len(coarse)) * step + step / 2).astype(int)
    apart = coarse.astype(int) - fine[np.ix_(middle, middle)]
    assert np.abs(apart).mean() < 4


@pytest.mark.parametrize("contacts", [[], [FINGER], [FINGER, {**FINGER, "x": -4e-3, "shear_x": 0}]])
@pytest.mark.parametrize("sides", [{}, {"transducer.width": "20 mm", "tactels.count": [5, 4]}])
def test_a_sketch_is_the_library_s_retardance_on_its_pixels(
    sides: dict[str, Any], contacts: list[dict[str, float]]
) -> None:
    model = in_whole_numbers(characterize_pad(small_pad().replace(**sides), samples=32))
    seen = coarse(model, COARSE)
    sketch, forces = Sketch.of(seen), truth(model, *contacts)
    expected = seen.modes(forces)
    assert sketch.modes(forces).shape == expected.shape
    bound = 1e-5 * np.abs(expected).max()
    np.testing.assert_allclose(sketch.modes(forces), expected, atol=bound)
    np.testing.assert_allclose(sketch.slices(forces), seen.slices(forces), atol=5 * bound)


def test_while_something_moves_the_camera_has_fewer_pixels_of_the_same_kind(
    ask: Ask, model: PadModel
) -> None:
    image = pressed(ask, "camera-0", fine=False, seed=3)["image"]
    camera = model.sensor.replace(camera={"pixels": [COARSE, COARSE]})
    frame = PadModel(camera, model.influence).expose(truth(model, FINGER), rng=3)
    # single precision may round a level the other way
    assert np.abs(image[..., 0].astype(int) - frame).max() <= 1


def test_slices_add_up_to_the_retardance(ask: Ask, model: PadModel) -> None:
    header, blocks = ask(type="slices", id=3, design=1, contacts=[FINGER])
    assert header["shape"] == list(blocks["slices"].shape)
    block = model.sensor.transducer
    cover, heights = block.compliant.thickness, -np.array(header["heights"])
    assert (np.diff(heights) > 0).all()
    assert cover < heights[0] < heights[-1] < cover + block.photoelastic.thickness
    side = blocks["slices"].shape[-1]
    pad = model.sensor.replace(camera={"pixels": [side, side]})
    expected = PadModel(pad, model.influence).retardance(truth(model, FINGER))
    total = 2 * blocks["slices"].sum(axis=0)
    np.testing.assert_allclose(total, expected, atol=1e-4 * np.abs(expected).max())


def test_what_is_read_is_what_the_library_reads_and_agrees_with_the_truth(
    ask: Ask, model: PadModel
) -> None:
    header, blocks = ask(type="read", id=3, design=1, contacts=[FINGER], seed=4)
    forces = truth(model, FINGER)
    reading = ff.Reader(model).read(model.expose(forces, rng=4))
    assert header["status"] == reading.status.name == "OK"
    assert header["chi2"] == pytest.approx(1, abs=0.05)
    assert (np.abs(blocks["forces"] - reading.forces) < 0.5 * reading.std).all()
    assert (np.abs(blocks["forces"] - forces) < 6 * blocks["std"]).all()
    true, read, std = blocks["sums"][0]
    np.testing.assert_allclose(true[:3], forces.sum(axis=0), rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(true[4:], [1e-3, -0.5e-3], atol=1e-4)
    assert (np.abs(read - true) < 5 * std).all()


def test_light_and_camera_change_without_solving_again_and_rightly(ask: Ask) -> None:
    changes = {"polariscope.wavelength": "520 nm", "camera.pixels": [64, 64]}
    header, _ = ask(type="design", id=1, changes=changes)
    assert header["values"]["camera.pixels"] == [64, 64]
    fresh = characterize_pad(small_pad().replace(**changes))
    image = pressed(ask, "camera-0", seed=1)["image"][..., 0]
    frame = fresh.expose(truth(fresh, FINGER), rng=1)
    assert np.abs(image.astype(int) - frame).max() <= 1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"transducer.compliant.thickness": "0.5"}, "has no unit"),
        ({"transducer.photoelastic.poissons_ratio": 0.5}, "must be less than 0.5"),
        ({"tactels.pitch": "9 mm"}, "beyond the pad's"),
        ({"tactels.count": [30, 30], "tactels.pitch": "0.5 mm"}, "400 tactels or fewer"),
        ({"tactels.count": "many"}, "two whole numbers"),
        ({"camera.pixels": [4096, 4096]}, "must be 512 or less"),
        ({"transducer.length": "240 mm"}, "times the pad's thickness"),
        ({"transducer.length": "9 m"}, "less than 1/500 of the longest side, 9000 mm"),
        ({"transducer.sides": "free"}, "fringeforce characterize DESIGN -o model.h5"),
        ({"camera.bits": 6}, "lower the amplitude"),
    ],
)
def test_bad_designs_are_refused_in_the_library_s_words(
    ask: Ask, changes: dict[str, object], words: str
) -> None:
    header, _ = ask(type="design", id=1, changes=changes)
    assert header["type"] == "refused"
    assert words in header["text"]


def test_free_sides_that_are_solved_already_can_be_explored(model: PadModel) -> None:
    free = model.sensor.replace(**{"transducer.sides": "free"})
    known = PadModel(free, model.influence)
    assert solved(free, known) is known
    assert facts(known)["values"]["transducer.sides"] == "free"


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"contacts": [FINGER] * 13}, "contacts"),
        ({"contacts": [{**FINGER, "radius": 0}]}, "contacts.0.radius"),
        ({"contacts": [{**FINGER, "normal": -1}]}, "contacts.0.normal"),
        ({"contacts": [{**FINGER, "normal": 1e9}]}, "contacts.0.normal"),
        ({"contacts": [{**FINGER, "x": 2}]}, "contacts.0.x"),
        ({"contacts": [{**FINGER, "sharp": 1}]}, "contacts.0.sharp"),
        ({"contacts": [{"x": 0}]}, "contacts.0"),
        ({"contacts": 5}, "contacts"),
        ({"contacts": [], "view": "x" * 50}, "view"),
        ({"contacts": [], "view": "camera-5"}, "no view"),
        ({"contacts": [], "seed": -1}, "seed"),
        ({"type": "sing"}, "the message"),
    ],
)
def test_contacts_that_cannot_be_are_refused_by_their_place(
    ask: Ask, asked: dict[str, object], words: str
) -> None:
    header, _ = ask(**{"type": "press", "id": 2, "design": 1, **asked})
    assert header["type"] == "refused"
    assert words in header["text"]


def test_a_question_about_a_design_that_is_gone_is_stale(ask: Ask) -> None:
    assert ask(type="read", id=2, design=9, contacts=[])[0]["stale"]


def test_what_cannot_be_read_is_said(ask: Ask) -> None:
    ask(type="design", id=1, changes={"camera.kind": "ordinary"})
    header, _ = ask(type="read", id=2, design=1, contacts=[FINGER])
    assert (header["type"], header["of"]) == ("refused", "read")
    assert "polarisation camera" in header["text"]


def test_downloads_read_back_to_what_was_shown(ask: Ask, model: PadModel, tmp_path: Any) -> None:
    files = {}
    for kind in ("design", "model", "forces", "reading"):
        header, blocks = ask(type="download", id=2, kind=kind, design=1, contacts=[FINGER])
        files[kind] = tmp_path / header["name"]
        files[kind].write_bytes(blocks["content"].tobytes())
    assert ff.load_sensor(files["design"]) == model.sensor
    loaded: Any = ff.load_model(files["model"])
    forces = truth(model, FINGER)
    np.testing.assert_allclose(loaded.intensity(forces), model.intensity(forces), atol=1e-5)
    pad = model.sensor
    (table,) = load_forces(files["forces"], pad.tactels.total, pad.components)
    np.testing.assert_array_equal(table, forces)
    reading: Any = np.genfromtxt(files["reading"], delimiter=",", names=True, dtype=None)
    assert (np.abs(reading["normal_N"] - forces[:, 0]) < 6 * reading["normal_std_N"]).all()
