"""What the page of a skin is told: forces that are kept, light of the fingers' own tractions."""

from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.base.errors import DesignError, InputError
from fringeforce.contacts.press import Tractions
from fringeforce.explorer import limits
from fringeforce.explorer.page import PAD_PAGE, SKIN_PAGE, STRIP_PAGE, page_of
from fringeforce.explorer.protocol import encoded, request
from fringeforce.explorer.server import application
from fringeforce.explorer.session import FirstDesign
from fringeforce.explorer.skins.protocol import (
    SKIN,
    SkinDownloadRequest,
    SkinReadRequest,
    SkinStrainRequest,
)
from fringeforce.explorer.skins.solution import facts as facts_of
from fringeforce.explorer.skins.tasks import PLACES, file, pressed, read
from fringeforce.explorer.strain import under_fingers
from fringeforce.explorer.tasks import stored

FINGERS = [
    {"x": -2.1e-3, "radius": 6e-3, "normal": 2.5, "tangential": 0.9},
    {"x": 2.4e-3, "radius": 2e-3, "normal": 0.8, "tangential": -0.2},
]
FAR = 5.0
"""Deviations: beyond them lies one in two million."""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> str:
    model = ff.characterize(ff.load_sensor("skin").replace(**{"transducer.edges": "roller"}))
    return stored(model, str(tmp_path_factory.mktemp("model")))


def wish(fingers: list[dict[str, float]]) -> SkinReadRequest:
    return SkinReadRequest.model_validate(
        {"type": "read", "id": 1, "design": 1, "contacts": fingers, "seed": 3}
    )


def test_tractions_are_shown_without_loss_where_they_are() -> None:
    places = np.linspace(-0.01, 0.01, 401)
    x = np.linspace(-1, 1, 65) * 0.7e-3 + 1.1e-3
    forces = np.column_stack([1 - np.linspace(-1, 1, 65) ** 2, np.linspace(-1, 1, 65)])
    shown = Tractions(x, forces).between(places)
    np.testing.assert_allclose(shown.sum(axis=0), forces.sum(axis=0), atol=1e-12)
    assert shown[:, 0] @ places / shown[:, 0].sum() == pytest.approx(1.1e-3, abs=1e-6)
    line = Tractions(np.array([2e-3]), np.array([[1.5, 0.2]])).between(places)
    assert line[np.abs(places - 2e-3).argmin()].tolist() == [1.5, 0.2]


def test_a_soft_skin_is_pressed_gently_at_first_and_read(tmp_path: Path) -> None:
    """A fifth of the forces, of which the whole ones would fold its surface."""
    soft = ff.characterize(ff.load_sensor("soft-skin"))
    assert facts_of(soft)["finite"]
    assert not facts_of(ff.characterize(ff.load_sensor("skin")))["finite"]
    gentle = [
        {**one, "normal": 0.2 * one["normal"], "tangential": 0.2 * one["tangential"]}
        for one in FINGERS
    ]
    facts, _ = read(stored(soft, str(tmp_path)), wish(gentle))
    assert facts["status"] == "OK"
    assert len(facts["contacts"]) == 3


def test_what_is_read_is_what_is_true(path: str) -> None:
    facts, blocks = read(path, wish(FINGERS))
    assert facts["status"] == "OK"
    step = (blocks["places"][1] - blocks["places"][0]) * 2e-3
    sums = blocks["truth"].sum(axis=0) * step
    np.testing.assert_allclose(sums, [3.3, 0.7], rtol=1e-6)
    np.testing.assert_allclose(blocks["traction"].sum(axis=0) * step, [3.3, 0.7], atol=0.05)
    total, *contacts = facts["contacts"]
    assert len(contacts) == len(facts["true"]) == 2
    for row, (x, normal, tangential) in zip(contacts, facts["true"], strict=True):
        assert abs(row[0] - x) < FAR * row[4]
        assert abs(row[2] - normal) < FAR * row[6]
        assert abs(row[3] - tangential) < FAR * row[7]
    assert abs(total[2] - 3.3) < FAR * total[6]
    assert blocks["traction"].shape == blocks["std"].shape == (PLACES, 2)
    assert encoded(facts, blocks)  # all of it can be sent


def test_finite_strain_of_fingers_is_that_of_finer_elements(tmp_path: Path) -> None:
    model = ff.characterize(ff.load_sensor("soft-skin"))
    fingers = [
        {**FINGERS[0], "normal": 1.0, "tangential": 0.3},
        {**FINGERS[1], "normal": 0.3, "tangential": 0.0},
    ]
    asked = {"type": "strain", "id": 1, "design": 1, "contacts": fingers}
    wished = SkinStrainRequest.model_validate(asked)
    facts, blocks = under_fingers(stored(model, str(tmp_path)), wished)
    # patches that stand for the fingers, on finer elements of higher order
    finer, peak = model.phase(pressed(wished), strain="finite"), np.abs(blocks["linear"]).max()
    assert facts["share"] > 0.05
    assert np.abs(blocks["finite"] - finer).max() < 0.01 * peak
    assert np.abs(blocks["finite"] - blocks["linear"]).max() == facts["largest"]
    assert facts["deviations"] > 5
    assert encoded(facts, blocks)


def test_finite_strain_of_nothing_is_nothing(path: str) -> None:
    asked = {"type": "strain", "id": 1, "design": 1, "contacts": []}
    facts, _ = under_fingers(path, SkinStrainRequest.model_validate(asked))
    assert facts["largest"] == facts["share"] == facts["deviations"] == 0


def test_nothing_presses(path: str) -> None:
    facts, blocks = read(path, wish([{**FINGERS[0], "normal": 0.0, "tangential": 0.0}]))
    assert facts["status"] == "NO_CONTACT"
    assert facts["true"] == []
    assert not blocks["truth"].any()
    assert not blocks["phase"].any()
    assert encoded(facts, blocks)


def test_fingers_beyond_the_strip_are_refused(path: str) -> None:
    with pytest.raises(InputError, match="beyond the strip"):
        read(path, wish([{**FINGERS[0], "x": 0.0124}]))
    with pytest.raises(InputError, match="friction"):
        read(path, wish([{**FINGERS[0], "tangential": 2.4}]))


@pytest.mark.parametrize(
    "fingers", [FINGERS * 4, [{**FINGERS[0], "radius": 0.0}], [{**FINGERS[0], "normal": -1.0}]]
)
def test_questions_that_no_page_asks_are_refused(fingers: list[dict[str, float]]) -> None:
    asked = {"type": "read", "id": 1, "design": 1, "contacts": fingers}
    with pytest.raises(InputError):
        request(encoded(asked), SKIN)


@pytest.mark.parametrize(("kind", "start"), [("design", b"name"), ("reading", b"frame,contact")])
def test_files_are_those_of_the_library(path: str, kind: str, start: bytes) -> None:
    asked = {"type": "download", "id": 1, "design": 1, "contacts": FINGERS, "kind": kind}
    _, blocks = file(path, SkinDownloadRequest.model_validate(asked))
    assert blocks["content"].tobytes().startswith(start)


def test_every_kind_of_design_has_its_page() -> None:
    skin = ff.load_sensor("skin")
    pages = [page_of(ff.load_sensor(name)) for name in ("saad", "skin", "pad")]
    assert pages == [STRIP_PAGE, SKIN_PAGE, PAD_PAGE]
    assert set(SKIN_PAGE.shipped()) == {"skin", "soft-skin"}
    assert not {"skin", "soft-skin"} & set(STRIP_PAGE.shipped())
    limits.check_skin(skin)
    with pytest.raises(DesignError, match="open the design of the strip"):
        limits.check_skin(ff.load_sensor("saad"))
    with pytest.raises(DesignError, match=r"skin\.resolution"):
        limits.check_skin(skin.replace(**{"skin.resolution": "0.02 mm"}))


@pytest.mark.parametrize("name", ["skin", "pad-skin"])
def test_cameras_of_skins_are_watched_elsewhere(name: str) -> None:
    from fringeforce.explorer.live import Source

    def opened(model: object) -> NoReturn:
        raise AssertionError("is not opened")

    camera = Source(opened, recorded=False)
    with pytest.raises(InputError, match="fringeforce live"):
        application(FirstDesign(ff.load_sensor(name)), "token", lambda: None, camera)
