"""What the server answers, and to whom."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from local_server import unwarmed
from starlette.testclient import TestClient, WebSocketTestSession
from starlette.websockets import WebSocketDisconnect

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.explorer.protocol import MAX_REQUEST, StrainRequest, decoded, encoded
from fringeforce.explorer.server import application
from fringeforce.explorer.session import FirstDesign
from fringeforce.explorer.strain import under_forces
from fringeforce.explorer.tasks import stored
from fringeforce.models.imaging import Calibration

pytestmark = pytest.mark.slow

TOKEN = "t" * 32
HOST = "http://127.0.0.1:8000"
SOCKET = f"ws://127.0.0.1:8000/{TOKEN}/socket"
Blocks = dict[str, np.ndarray]


@pytest.fixture(scope="module")
def client(sensor: ff.Sensor) -> Iterator[TestClient]:
    with TestClient(application(FirstDesign(sensor), TOKEN), base_url=HOST) as found:
        yield found


Ask = Callable[..., tuple[dict[str, Any], Blocks]]


@pytest.fixture
def socket(client: TestClient) -> Iterator[WebSocketTestSession]:
    with client.websocket_connect(SOCKET, headers={"Origin": HOST}) as found:
        assert decoded(found.receive_bytes())[0]["type"] == "hello"
        yield found


@pytest.fixture
def ask(socket: WebSocketTestSession) -> Ask:
    def asked(**header: object) -> tuple[dict[str, Any], Blocks]:
        socket.send_bytes(encoded(header))
        return decoded(socket.receive_bytes())

    return asked


def test_the_page_is_served_to_who_knows_the_token_and_keeps_to_itself(client: TestClient) -> None:
    answer = client.get(f"/{TOKEN}/")
    assert answer.status_code == 200
    policy = answer.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "frame-ancestors 'none'" in policy
    assert "http:" not in policy
    assert "unsafe" not in policy
    assert client.get(f"/{TOKEN}/explorer.js").status_code == 200
    assert client.get(f"/{TOKEN}/../session.py").status_code == 404


@pytest.mark.parametrize(
    ("path", "headers", "status"),
    [
        ("/", {}, 404),
        ("/wrong/", {}, 404),
        (f"/{TOKEN[:-1]}/", {}, 404),
        (f"/{TOKEN}/", {"Host": "evil.example"}, 421),
        (f"/{TOKEN}/", {"Host": "127.0.0.1.evil.example:8000"}, 421),
        (f"/{TOKEN}/", {"Origin": "https://evil.example"}, 403),
        (f"/{TOKEN}/", {"Origin": "null"}, 403),
    ],
)
def test_others_get_nothing(
    client: TestClient, path: str, headers: dict[str, str], status: int
) -> None:
    answer = client.get(path, headers=headers)
    assert answer.status_code == status
    assert "<html" not in answer.text


@pytest.mark.parametrize(
    ("path", "headers"),
    [
        (SOCKET, {}),
        (SOCKET, {"Origin": "https://evil.example"}),
        (SOCKET, {"Origin": "http://127.0.0.1:9999"}),
        (SOCKET.replace("127.0.0.1", "evil.example"), {"Origin": "http://evil.example:8000"}),
        (SOCKET.replace(TOKEN, "wrong"), {"Origin": HOST}),
    ],
)
def test_a_foreign_page_cannot_open_the_socket(
    client: TestClient, path: str, headers: dict[str, str]
) -> None:
    with pytest.raises(WebSocketDisconnect), client.websocket_connect(path, headers=headers):
        pass


def test_a_message_that_is_too_long_ends_the_conversation(socket: WebSocketTestSession) -> None:
    socket.send_bytes(b" " * (MAX_REQUEST + 1))
    with pytest.raises(WebSocketDisconnect) as closed:
        socket.receive_bytes()
    assert closed.value.code == 1009


def test_a_page_that_speaks_in_text_is_let_go(socket: WebSocketTestSession) -> None:
    socket.send_text("hello")
    with pytest.raises(WebSocketDisconnect):
        socket.receive_bytes()


def test_the_page_gets_the_library_s_numbers(ask: Ask, model: ff.SensorModel) -> None:
    header, blocks = ask(type="design", id=1)
    assert header["type"] == "model"
    assert header["values"]["transducer.compliant.thickness"] == "0.5 mm"
    psi = model.pixel_influence.reshape(len(model.pixel_influence), -1)
    np.testing.assert_allclose(blocks["psi"].T, psi, rtol=1e-6, atol=1e-6)
    header, _ = ask(type="inside", id=2, design=1)
    figures = {figure["key"]: figure["value"] for figure in header["figures"]}
    phase = model.phase(ff.polar(1.0, 10, n=11))
    assert figures["peak"] == pytest.approx(np.abs(phase).max(), rel=1e-12)
    assert figures["condition"] == pytest.approx(np.linalg.cond(psi), rel=1e-9)


def test_depth_integrated_picture_of_stress_is_the_phase(ask: Ask, model: ff.SensorModel) -> None:
    """Eq. (1): the cells of sigma_x, summed through the clear layer, are the influence matrix."""
    header, _ = ask(type="design", id=1)
    _, blocks = ask(type="inside", id=2, design=1)
    constant = 6.409e-3  # K_t of the paper [rad/(Pa m)]
    stress = blocks["stress_clear"][:, 0]  # loads, rows, columns
    integral = 2 * constant * stress.sum(axis=1) * header["layers"][1] / stress.shape[1]
    columns = stress.shape[2]
    x = ((np.arange(columns) + 0.5) / columns - 0.5) * header["strip"]["length"]
    expected = model.influence(x).reshape(columns, -1).T
    assert np.linalg.norm(integral - expected) < 0.02 * np.linalg.norm(expected)


def test_the_skin_sinks_where_it_is_pressed_and_the_base_stays(ask: Ask) -> None:
    tactels = ask(type="design", id=1)[1]["tactels"]
    _, blocks = ask(type="inside", id=2, design=1)
    moved = blocks["moved"]  # loads, (u, w), columns, rows
    assert (moved[:, :, :, 0] == 0).all()
    for tactel, x in enumerate(tactels):
        column = np.abs(blocks["mesh_x"] - x).argmin()
        assert moved[2 * tactel, 1, column, -1] == moved[2 * tactel, 1].min() < 0
        pulled = moved[2 * tactel + 1, 0]
        assert pulled[column, -1] == pulled.max() > 0


def test_finite_strain_is_the_library_s_and_of_second_order(
    ask: Ask, model: ff.SensorModel
) -> None:
    ask(type="design", id=1)
    found = list[float]()
    width = model.sensor.transducer.compliant.thickness
    wide = ff.characterize(model.sensor.replace(**{"tactels.contact_width": width}))
    for number, load in enumerate((0.25, 0.5), 2):
        forces = ff.polar(load, 10, model.sensor.tactels.count)
        header, blocks = ask(type="strain", id=number, design=1, forces=forces.tolist())
        assert header["type"] == "strain"
        assert header["width"] == width
        expected = wide.phase(forces, strain="finite")
        np.testing.assert_allclose(blocks["finite"], expected, atol=1e-5)
        np.testing.assert_allclose(blocks["linear"], wide.phase(forces), atol=1e-5)
        found.append(header["largest"])
        sunk = blocks["moved"][1, :, -1]
        assert sunk[np.abs(blocks["mesh_x"]).argmin()] < 0
    assert found[1] / found[0] == pytest.approx(4, rel=0.05)


def test_large_strain_is_shown_of_drawings_only(model: ff.SensorModel, tmp_path: Any) -> None:
    none = np.zeros(0)
    own = Calibration((), none, none, np.zeros((0, 0)), (), (), (), 1.0, ())
    calibrated = replace(model, calibration=own)
    wish = StrainRequest(type="strain", id=1, design=1, forces=[[0.0, 0.0]] * 11)
    with pytest.raises(InputError, match="of drawings"):
        under_forces(stored(calibrated, str(tmp_path)), wish)


def test_a_reading_is_the_library_s_of_the_same_frame(ask: Ask, model: ff.SensorModel) -> None:
    ask(type="design", id=1)
    forces = ff.polar(0.8, 5, n=11)
    header, blocks = ask(type="read", id=2, design=1, forces=forces.tolist(), seed=5)
    frame = model.expose(forces, rng=5)
    np.testing.assert_array_equal(blocks["frame"], frame)
    reading = ff.Reader(model).search(frame)
    assert header["status"] == reading.status.name
    np.testing.assert_allclose(blocks["forces"], reading.forces, atol=1e-5)
    np.testing.assert_allclose(blocks["std"], reading.std, rtol=1e-4)
    # the deviation of the phase, by drawing loads from the reading's covariance
    loads = np.random.default_rng(0).multivariate_normal(
        reading.forces.ravel(), reading.covariance, 4000
    )
    spread = model.phase(loads.reshape(-1, 11, 2)).std(axis=0)
    np.testing.assert_allclose(blocks["phase_std"], spread, rtol=0.1, atol=1e-4)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"transducer.compliant.thickness": "0.5"}, "has no unit"),
        ({"transducer.compliant.thickness": "-1 mm"}, "must be greater than 0"),
        ({"transducer.photoelastic.poissons_ratio": 0.5}, "must be less than 0.5"),
        ({"transducer.edges": "glued"}, "must be 'free' or 'roller'"),
        ({"tactels.pitch": "3 mm"}, "beyond the strip's end"),
        ({"camera.bits": 6}, "lower the amplitude"),
        ({"camera.pixels": 10**6}, "must be 8192 or less"),
        ({"tactels.count": 100, "tactels.pitch": "0.1 mm"}, "must be 64 or less"),
        ({"transducer.length": "9 m"}, "times the strip's"),
        ({"transducer.compliant.thickness": "0.1 m"}, "times the strip's"),
        ({"transducer.compliant.thickness": "0.5 m"}, "10 times the longest side, 25 mm"),
        ({"nonsense.path": 1}, "no part 'nonsense'"),
        ({"polariscope.wavelength": "1e-60 m"}, "single precision"),
    ],
)
def test_bad_values_are_refused_in_the_library_s_words(
    ask: Ask, changes: dict[str, object], words: str
) -> None:
    header, _ = ask(type="design", id=1, changes=changes)
    assert header["type"] == "refused"
    assert (header["id"], header["of"]) == (1, "design")
    assert words in header["text"]


def test_forces_that_do_not_fit_and_designs_that_are_gone_are_refused(ask: Ask) -> None:
    ask(type="design", id=1)
    header, _ = ask(type="read", id=2, design=1, forces=[[1.0, 0.0]])
    assert "do not fit this sensor" in header["text"]
    header, _ = ask(type="read", id=3, design=9, forces=[[1.0, 1.0]] * 11)
    assert header["stale"]
    assert ask(type="inside", id=4, design=9)[0]["stale"]


def test_designs_that_stand_side_by_side_are_both_looked_into(socket: WebSocketTestSession) -> None:
    for number, edges in enumerate(("free", "roller")):
        changes = {"transducer.edges": edges}
        wish = {"type": "design", "id": number, "slot": edges, "changes": changes}
        socket.send_bytes(encoded(wish))
    shown = {decoded(socket.receive_bytes())[0]["id"] for _ in range(2)}
    assert shown == {0, 1}
    for number, edges in enumerate(("free", "roller")):
        wish = {"type": "inside", "id": 2 + number, "slot": edges, "design": number}
        socket.send_bytes(encoded(wish))
    answers = [decoded(socket.receive_bytes()) for _ in range(2)]
    moved = {header["design"]: blocks["moved"] for header, blocks in answers}
    # rollers hold the ends where free ones give way
    assert np.abs(moved[1][:, 0, 0]).max() == 0 < np.abs(moved[0][:, 0, 0]).max()


def test_downloads_read_back_to_what_was_shown(ask: Ask, tmp_path: Any) -> None:
    ask(type="design", id=1, changes={"transducer.edges": "roller"})
    load = {"design": 1, "forces": [[1.0, 0.1]] * 11, "seed": 3}
    for kind, name in {"design": "d.toml", "model": "m.h5", "forces": "f.csv"}.items():
        header, blocks = ask(type="download", id=2, kind=kind, **load)
        assert header["name"].startswith(kind)
        (tmp_path / name).write_bytes(blocks["content"].tobytes())
    assert ff.load_sensor(tmp_path / "d.toml").transducer.edges == "roller"
    assert ff.load_model(tmp_path / "m.h5").sensor == ff.load_sensor(tmp_path / "d.toml")
    from fringeforce.io.tables import load_forces

    np.testing.assert_array_equal(load_forces(tmp_path / "f.csv", 11), [load["forces"]])
    _, blocks = ask(type="download", id=3, kind="reading", **load)
    assert blocks["content"].tobytes().startswith(b"frame,tactel,normal_N")


def test_of_wishes_that_pile_up_the_last_is_answered_and_most_are_dropped(
    socket: WebSocketTestSession,
) -> None:
    thicknesses = [f"{1 + 0.1 * k:.1f} mm" for k in range(12)]
    for k, thickness in enumerate(thicknesses):
        changes = {"transducer.compliant.thickness": thickness}
        socket.send_bytes(encoded({"type": "design", "id": k, "changes": changes}))
    answered = []
    while not answered or answered[-1] != len(thicknesses) - 1:
        answered.append(decoded(socket.receive_bytes())[0]["id"])
    assert len(answered) < len(thicknesses)


def test_a_worker_that_dies_is_replaced(client: TestClient, ask: Ask) -> None:
    import multiprocessing

    ask(type="design", id=1)
    for child in multiprocessing.active_children():
        child.kill()
        child.join()
    changes = {"transducer.compliant.thickness": "0.77 mm"}
    assert ask(type="design", id=2, changes=changes)[0]["type"] == "model"
    forces = [[1.0, 0.0]] * 11
    assert ask(type="read", id=3, design=2, forces=forces)[0]["status"] == "OK"


def test_a_loaded_model_is_shown_as_it_is_and_a_changed_one_as_drawn(
    model: ff.SensorModel,
) -> None:
    import pickle
    from dataclasses import replace

    measured = replace(model, psi=model.psi * 1.25)
    start = FirstDesign(model.sensor, pickle.dumps(measured))
    headers = {"Origin": HOST}
    with (
        unwarmed(),
        TestClient(application(start, TOKEN), base_url=HOST) as client,
        client.websocket_connect(SOCKET, headers=headers) as socket,
    ):
        socket.receive_bytes()
        peaks, drawn = [], []
        for k, changes in enumerate([{}, {"transducer.edges": "roller"}]):
            socket.send_bytes(encoded({"type": "design", "id": k, "changes": changes}))
            header, blocks = decoded(socket.receive_bytes())
            peaks.append(np.abs(blocks["psi"]).max())
            drawn.append(header["as_drawn"])
    assert drawn == [False, True]
    assert peaks[0] == pytest.approx(np.abs(measured.pixel_influence).max(), rel=1e-6)
    assert peaks[1] < np.abs(model.pixel_influence).max() * 1.1
