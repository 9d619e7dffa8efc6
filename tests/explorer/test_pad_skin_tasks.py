"""What the page of a pad tells of a skin: light and sums of the fingers' own tractions."""

from typing import Any

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.explorer.pads.fingers import SHOWN
from fringeforce.explorer.pads.pictures import SLICE, eye
from fringeforce.explorer.pads.presses import acting, sums
from fringeforce.explorer.pads.protocol import PadReadRequest, PressRequest, SlicesRequest
from fringeforce.explorer.pads.solution import facts, solved
from fringeforce.explorer.pads.tasks import press, read, slices
from fringeforce.explorer.page import PAD_PAGE, page_of
from fringeforce.explorer.protocol import encoded
from fringeforce.explorer.tasks import stored
from fringeforce.models.pad import PadModel

pytestmark = pytest.mark.slow

FINGERS = [
    {"x": 1.6e-3, "y": -1e-3, "radius": 4e-3, "normal": 1.0, "shear_x": 0.2},
    {"x": -2.5e-3, "y": 1.5e-3, "radius": 3e-3, "normal": 0.5, "shear_y": -0.1},
]
PRESSES = [
    ff.Press(x=1.6e-3, y=-1e-3, radius=4e-3, normal=1.0, tangential=(0.2, 0.0)),
    ff.Press(x=-2.5e-3, y=1.5e-3, radius=3e-3, normal=0.5, tangential=(0.0, -0.1)),
]
FAR = 5.0
"""Deviations: beyond them lies one in two million."""


@pytest.fixture(scope="module")
def model() -> PadModel:
    return solved(ff.load_sensor("fingertip"))


@pytest.fixture(scope="module")
def path(model: PadModel, tmp_path_factory: pytest.TempPathFactory) -> str:
    return stored(model, str(tmp_path_factory.mktemp("model")))


def asked(kind: str, fingers: list[dict[str, float]] = FINGERS, **more: Any) -> dict[str, Any]:
    return {"type": kind, "id": 1, "design": 1, "contacts": fingers, "seed": 3, **more}


def test_skins_of_pads_have_the_page_of_pads(model: PadModel) -> None:
    assert page_of(model.sensor) is PAD_PAGE
    assert {"pad", "pad-skin", "fingertip"} <= set(PAD_PAGE.shipped())
    told = facts(model)
    assert told["skin"] == [10.5e-3, 10.5e-3]
    assert "tactels" not in [figure["key"] for figure in told["figures"]]


def test_the_camera_sees_the_fingers_own_tractions(path: str, model: PadModel) -> None:
    wish = PressRequest.model_validate(asked("press", view="camera-0"))
    header, blocks = press(path, wish)
    np.testing.assert_array_equal(blocks["image"][..., 0], model.expose(PRESSES, rng=3))
    np.testing.assert_allclose(blocks["forces"].sum(axis=0), [1.5, 0.2, -0.1], atol=1e-9)
    coarse, _ = press(path, wish.model_copy(update={"fine": False}))
    assert coarse["shape"][0] < header["shape"][0]


def test_slices_of_a_skin_add_up_to_the_retardance(path: str, model: PadModel) -> None:
    _, blocks = slices(path, SlicesRequest.model_validate(asked("slices")))
    seen = eye(model, SLICE)
    expected = seen.retardance(PRESSES)
    away = 2 * blocks["slices"].sum(axis=0) - expected
    # an equivalent retarder of a stack is its sum to second order in what it turns by
    assert np.abs(away).max() < 0.03 * np.abs(expected).max()


def test_what_is_read_of_a_finger_is_what_is_true(path: str, model: PadModel) -> None:
    header, blocks = read(path, PadReadRequest.model_validate(asked("read", FINGERS[:1])))
    assert header["status"] == "OK"
    truth, found, std = np.moveaxis(blocks["sums"], 1, 0)
    np.testing.assert_allclose(truth[:, :3], [[1.0, 0.2, 0.0]] * 2, atol=1e-9)
    assert (np.abs(found - truth) < FAR * std).all()
    reading = ff.Reader(model).read(model.expose(PRESSES[:1], rng=3))
    assert reading.total is not None
    np.testing.assert_allclose(found[0], reading.total.values[SHOWN], rtol=1e-9)
    assert encoded(header, blocks)


def test_contacts_stand_beside_their_fingers(model: PadModel) -> None:
    wish = PadReadRequest.model_validate(asked("read"))
    parts, reader = acting(model.sensor, wish), ff.Reader(model)
    first, second = (reader.read(model.expose([one], rng=0)).contacts[0] for one in PRESSES)
    rows = sums(parts, None, [second, first])
    assert np.isnan(rows[0, 1:]).all()
    np.testing.assert_allclose(rows[:, 0, 0], [1.5, 0.5, 1.0], atol=1e-9)
    # fewer than the fingers: nothing tells whose they are
    assert np.isnan(sums(parts, None, [first])[1, 0]).all()


def test_nothing_presses(path: str) -> None:
    none = {**FINGERS[0], "normal": 0.0, "shear_x": 0.0}
    header, blocks = read(path, PadReadRequest.model_validate(asked("read", [none])))
    assert header["status"] == "NO_CONTACT"
    assert blocks["sums"].shape == (1, 3, 6)


@pytest.mark.parametrize(
    ("part", "words"), [({"twist": 0.01}, "twist"), ({"x": 5.9e-3}, "beyond the pad")]
)
def test_what_no_sphere_does_is_refused(path: str, part: dict[str, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        read(path, PadReadRequest.model_validate(asked("read", [{**FINGERS[0], **part}])))


def test_a_skin_that_relaxes_is_read_as_it_is_pressed(model: PadModel, tmp_path) -> None:
    """The page presses for no time, so that nothing creeps."""
    soft = model.sensor.replace(**{"transducer.relaxation": [["6 %", "0.4 s"]]})
    path = stored(solved(soft), str(tmp_path))
    header, _ = read(path, PadReadRequest.model_validate(asked("read")))
    assert header["status"] == "OK"
