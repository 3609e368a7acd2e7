"""The server: images for authorised clients, nothing for others."""

from __future__ import annotations

import builtins
import io
import json
import os
import random
import re
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import raycam
from raycam.render.frame import CHANNELS, PASSES
from raycam.viewer import answers
from raycam.viewer import scheduler as scheduling
from raycam.viewer import server as serving
from raycam.viewer.server import MOST_CONNECTIONS, MOST_SESSIONS, PORTS, Server
from raycam.viewer.session import Session
from raycam.viewer.wire import unpack
from support.patience import PATIENCE, until
from support.raises import Fault, fault, raises
from support.session_messages import orbited
from support.viewer_client import SPACE, Client
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidStatus
from websockets.sync.client import ClientConnection
from websockets.typing import Subprotocol

Open = Callable[..., ClientConnection]


def raw(server: Server, request: bytes, *, is_all: bool = False) -> bytes:
    """The response to bytes sent to the port; `is_all` closes the sending side."""
    with socket.create_connection(server.address, timeout=PATIENCE) as made:
        made.sendall(request)
        if is_all:
            made.shutdown(socket.SHUT_WR)
        answer = b""
        try:
            while part := made.recv(65536):
                answer += part
        except ConnectionResetError:
            pass
        return answer


PAGE = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"


def get(server: Server, path: str, host: str = "127.0.0.1") -> tuple[int, dict[str, str], bytes]:
    head, _, body = raw(server, f"GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode()).partition(
        b"\r\n\r\n"
    )
    first, *lines = head.decode().split("\r\n")
    return int(first.split()[1]), dict(line.split(": ", 1) for line in lines), body


# Pages ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "status"), [("/", 200), ("/client.js", 200), ("/style.css", 404), ("/x", 404)]
)
def test_every_response_has_the_security_headers(server: Server, path: str, status: int) -> None:
    got, headers, body = get(server, path)
    assert got == status
    assert body
    assert serving.gate.response_headers().items() <= headers.items()
    assert "server" not in {name.lower() for name in headers}
    assert server.token.encode() not in body


def test_request_of_another_host_is_refused(server: Server) -> None:
    assert get(server, "/", "evil.example")[0] == 403


def test_server_listens_on_the_loopback_interface_only(server: Server) -> None:
    assert server.address[0] == "127.0.0.1"
    assert server.url == f"http://127.0.0.1:{server.address[1]}/#t={server.token}"
    assert len(server.token) >= 43


@pytest.mark.parametrize(
    "request_bytes",
    [
        *(
            b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n",
            b"\x16\x03\x01\x02\x00\x01",
            b"\r\n\r\n",
        ),
        *(
            b"GET / HTTP/1.1\r\n\r\n",
            b"GET /" + b"a" * 100000 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n",
            b"GET / HTTP/9\r\n\r\n",
        ),
        b"GET / HTTP/1.1\r\n" + b"".join(b"X-%d: y\r\n" % i for i in range(500)) + b"Host: localhost\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n",
        *(
            os.urandom(500),
            b"PUT /etc/passwd HTTP/1.1\r\nHost: localhost\r\n\r\n",
            b"GET ../../etc/passwd HTTP/1.1\r\nHost: localhost\r\n\r\n",
        ),
    ],
    ids=range(11),
)
def test_invalid_requests_get_no_page_and_the_server_continues(server: Server, request_bytes: bytes) -> None:
    answer = raw(server, request_bytes, is_all=True)
    assert b"<html" not in answer
    assert answer[9:12] in (b"", b"400", b"403", b"404", b"405", b"414", b"431", b"500", b"501", b"505")
    assert get(server, "/")[0] == 200


def is_open(made: socket.socket) -> bool:
    made.setblocking(False)
    try:
        return made.recv(1, socket.MSG_PEEK) != b""
    except BlockingIOError:
        return True
    except ConnectionResetError:
        return False


def test_excess_connections_are_closed_and_later_connections_answered(
    small_world: raycam.World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        serving, "HANDSHAKE_TIME", 2 * PATIENCE
    )  # silent connections are not closed by the timeout
    server = Server(lambda: Session(small_world, small_world.camera("front")), port=0)
    try:
        idle = [socket.create_connection(server.address) for _ in range(MOST_CONNECTIONS + 20)]
        until(lambda: sum(map(is_open, idle)) <= MOST_CONNECTIONS, "too many are open")
        assert sum(map(is_open, idle)) == MOST_CONNECTIONS
        for each in idle:
            each.close()
        until(lambda: raw(server, PAGE).startswith(b"HTTP/1.1 200"), "there is no room again")
    finally:
        server.close()


def assert_ended(client: Client) -> None:
    """Asserts that the server closes the connection after its earlier messages."""
    for _ in range(1000):
        try:
            client.next()
        except ConnectionClosed:
            return
    raise AssertionError("the connection is open still")


# The socket -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changed", "status"),
    [
        ({"origin": "http://evil.example"}, 403),
        ({"origin": None}, 403),
        ({"origin": "http://127.0.0.1:1"}, 403),
        ({"subprotocols": [Subprotocol("raycam.view.1")]}, 401),
        ({"subprotocols": [Subprotocol("raycam.view.1"), Subprotocol("token.wrong")]}, 401),
        ({"subprotocols": None}, 401),
    ],
)
def test_requests_without_a_token_are_refused(
    server: Server, open_socket: Open, changed: dict[str, Any], status: int
) -> None:
    with pytest.raises(InvalidStatus) as refused:
        open_socket(**changed)
    assert refused.value.response.status_code == status
    assert not server.sessions


@pytest.mark.parametrize("path", ["/", "/client.js", "/socket?t=1", "/other"])
def test_socket_on_another_path_is_refused(server: Server, open_socket: Open, path: str) -> None:
    host, port = server.address
    with pytest.raises(InvalidHandshake):
        open_socket(uri=f"ws://{host}:{port}{path}")
    assert not server.sessions


@pytest.mark.parametrize("first", ["junk", b"\x00", "{}", json.dumps({"type": "ack", "picture": 0})])
def test_first_message_must_be_hello(server: Server, open_socket: Open, first: str | bytes) -> None:
    made = open_socket()
    made.send(first)
    with pytest.raises(ConnectionClosed) as closed:
        made.recv(timeout=PATIENCE)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == serving.POLICY_VIOLATION
    assert not server.sessions


def test_three_invalid_messages_disconnect_only_their_client(client: Client, open_socket: Open) -> None:
    bad = Client(open_socket())
    for junk in ("junk", json.dumps({"type": "move"}), json.dumps({"type": "hello", "session": "", **SPACE})):
        bad.socket.send(junk)
    assert_ended(bad)
    client.hear("picture")
    client.say("probe", id=1, u=1, v=1)
    assert client.hear("values")[0]["id"] == 1


def test_overlong_message_disconnects_the_client(open_socket: Open) -> None:
    bad = Client(open_socket())
    bad.socket.send(json.dumps({"type": "camera", "name": "x" * 70000}))
    assert_ended(bad)


def test_number_of_sessions_is_limited(server: Server, open_socket: Open) -> None:
    for _ in range(MOST_SESSIONS):
        Client(open_socket())
    with pytest.raises(ConnectionClosed) as closed:
        Client(open_socket())
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == serving.TRY_AGAIN_LATER
    assert len(server.sessions) == MOST_SESSIONS


def test_disconnected_session_is_replaced_when_full(server: Server, open_socket: Open) -> None:
    clients = [Client(open_socket()) for _ in range(MOST_SESSIONS)]
    clients[3].socket.close()
    until(lambda: not all(each.connection.is_open for each in server.sessions.values()))
    left = clients[3].welcome["session"]
    assert Client(open_socket()).welcome["session"] not in {each.welcome["session"] for each in clients}
    assert left not in server.sessions


def test_client_messages_open_no_files(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    client.hear("picture", samples=16)
    opened: list[str] = []

    def recorded(function: Callable[..., Any]) -> Callable[..., Any]:
        def record(path: Any, *rest: Any, **more: Any) -> Any:
            opened.append(os.fspath(path))
            return function(path, *rest, **more)

        return record

    with monkeypatch.context() as patched:
        for module in (builtins, io, os):
            patched.setattr(module, "open", recorded(module.open))
        for name in ("../../etc/passwd", "/etc/passwd", "\0", "front/../../x"):
            client.say("camera", seq=1, name=name)
            assert "unknown camera" in client.hear("error")[0]["text"]
        for format in ("png", "npz", "html"):
            client.say("snapshot", format=format)
            assert client.hear("file")[1][0]
    package = Path(raycam.__file__).parent
    assert [path for path in opened if not Path(path).is_relative_to(package)] == []


def test_random_messages_do_not_affect_other_clients(
    server: Server, client: Client, open_socket: Open
) -> None:
    client.hear("picture", samples=16)
    before = server.sessions[client.welcome["session"]].images.version
    chance = random.Random(7)
    words = [None, True, -1, 1e300, "depth", "", [], {}, "move", 2**70]
    for _ in range(15):
        bad = Client(open_socket())
        try:
            for _ in range(serving.STRIKES + 2):
                bad.socket.send(
                    json.dumps(
                        {chance.choice(["type", "u", "v", "x"]): chance.choice(words) for _ in range(4)}
                    )
                )
            for _ in range(200):
                bad.next()
        except (ConnectionClosed, TimeoutError):
            pass
        bad.socket.close()
    assert server.sessions[client.welcome["session"]].images.version == before
    assert get(server, "/")[0] == 200


# Answers to a client --------------------------------------------------------------------------------------


def test_images_are_refined_and_equal_render(client: Client, small_world: raycam.World) -> None:
    client.hear("picture", samples=16)
    assert [each["moving"] for each, _ in client.pictures] == [True] + [False] * (len(client.pictures) - 1)
    counts = [each["samples"] for each, _ in client.pictures]
    assert counts == sorted(counts)
    assert (counts[0], counts[-1]) == (1, 16)
    assert client.pictures[0][1][:3] == b"\xff\xd8\xff"
    camera = small_world.camera("front")
    client.say("planes", wanted=True)
    message: dict[str, Any] = {}
    while "plane" not in message:
        message, (data,) = client.hear("picture", samples=16)
    expected = raycam.render(small_world, camera, samples=16, channels=["color", "alpha", "coverage"])
    assert unpack(message["plane"], data).tobytes() == expected["color"].tobytes()


def test_every_channel_is_sent_exactly(client: Client, small_world: raycam.World) -> None:
    camera = small_world.camera("front")
    client.say("planes", wanted=True)
    client.hear("picture", samples=16)
    names = [channel["name"] for channel in client.welcome["channels"]]
    assert {*names, "shadow", *PASSES} == set(CHANNELS)
    names.remove("error")
    expected = raycam.render(small_world, camera, samples=16, channels=names)
    for channel in names:
        client.say("channel", name=channel)
        message, (data,) = client.hear("picture", channel=channel, moving=False, exact=True)
        assert unpack(message["plane"], data).tobytes() == expected[channel].tobytes(), channel
    client.say("channel", name="error")
    message, (data,) = client.hear("picture", channel="error", moving=False, samples=16, exact=True)
    expected = raycam.render(small_world, camera, samples=16, channels=["color", "error"])
    assert unpack(message["plane"], data).tobytes() == expected["error"].tobytes()


def test_numbers_for_display_are_rounded_and_tiles_are_exact(
    client: Client, small_world: raycam.World
) -> None:
    camera = small_world.camera("front")
    expected = raycam.render(
        small_world, camera, samples=16, channels=["color", "alpha", "coverage", "depth"]
    )
    client.hear("picture", samples=16)
    client.say("tile", id=1, u=40, v=3, width=100, height=5)
    message, (data,) = client.hear("tile", id=1)
    assert (message["u"], message["v"], message["channel"]) == (40, 3, "color")
    assert unpack(message["plane"], data).tobytes() == expected["color"][3:8, 40:].tobytes()
    client.say("channel", name="depth")
    message, (data,) = client.hear("picture", channel="depth", moving=False)
    assert not message["exact"]
    found, exact = unpack(message["plane"], data)[..., 0], expected["depth"]
    seen = np.isfinite(exact)
    np.testing.assert_allclose(found[seen], exact[seen], rtol=2.0**-13)
    assert (found[seen] != exact[seen]).any()
    client.say("tile", id=2, u=10, v=10, width=20, height=10)
    message, (data,) = client.hear("tile", id=2)
    assert unpack(message["plane"], data)[..., 0].tobytes() == exact[10:20, 10:30].tobytes()


def test_probes_return_the_values_of_the_image(client: Client, small_world: raycam.World) -> None:
    client.hear("picture", samples=16)
    names = [channel["name"] for channel in client.welcome["channels"] if channel["name"] != "error"]
    expected = raycam.render(small_world, small_world.camera("front"), samples=16, channels=names)
    for id, (u, v) in enumerate([(24, 16), (0, 0), (47, 31), (10, 25)]):
        client.say("probe", id=id, u=u, v=v)
        values = client.hear("values", id=id)[0]["values"]
        assert set(values) == set(names)
        for name in names:
            numbers = np.array([float(number) for number in values[name]["numbers"]], expected[name].dtype)
            assert numbers.tobytes() == np.atleast_1d(expected[name][v, u]).tobytes(), name
    client.say("probe", id=9, u=24, v=16)
    values = client.hear("values", id=9)[0]["values"]
    assert (values["instance"]["name"], values["category"]["name"]) == ("box", "crate")


def test_pixel_of_an_outdated_image_is_evaluated_with_the_camera_of_its_image(
    server: Server, client: Client, small_world: raycam.World
) -> None:
    client.hear("picture", samples=16)
    camera, before = small_world.camera("front"), client.image
    image = {"image": before}
    client.socket.send(json.dumps(orbited(client.welcome["camera"], 35)))
    while client.image == before:
        client.hear("picture")
    client.say("probe", id=1, u=24, v=16, **image)
    exact = raycam.render(small_world, camera, samples=1, channels=["position"])["position"][16, 24]
    values = client.hear("values")[0]["values"]
    assert [float(each) for each in values["position"]["numbers"]] == exact.tolist()
    client.say("probe", id=2, u=24, v=16)
    values = client.hear("values")[0]["values"]
    assert [float(each) for each in values["position"]["numbers"]] != exact.tolist()
    client.say("locate", id=3, u=24.5, v=16.5, **image)
    np.testing.assert_allclose(client.hear("answer")[0]["point"], exact, atol=1e-6)
    client.say("explain", id=4, u=24, v=16, **image)
    assert client.hear("explained")[0]["text"] == str(raycam.explain(small_world, camera, (24, 16)))
    client.say("tile", id=5, u=0, v=0, width=48, height=32)
    client.hear("tile", id=5)


def test_pixel_of_an_unknown_image_is_not_evaluated(client: Client) -> None:
    client.hear("picture", samples=16)
    unknown = client.image + 1000
    client.say("probe", id=1, u=24, v=16, image=unknown)
    client.say("tile", id=1, u=0, v=0, width=8, height=8, image=unknown)
    client.say("tile", id=2, u=0, v=0, width=8, height=8)
    assert client.hear("tile")[0]["id"] == 2
    client.say("probe", id=2, u=24, v=16)
    assert client.hear("values")[0]["id"] == 2
    for kind in ("pick", "explain"):
        client.say(kind, **({"id": 3} if kind == "explain" else {}), u=24, v=16, image=unknown)
        assert client.hear("error")[0]["text"] == "image: out of date; click again in the new image"


def test_image_versions_never_decrease(client: Client) -> None:
    for step in range(30):
        client.socket.send(json.dumps(orbited(client.welcome["camera"], step + 1)))
    client.hear("picture", samples=16)
    versions = [message["version"] for message, _ in client.pictures]
    assert versions == sorted(versions)
    assert client.pictures[-1][0]["samples"] == 16


def test_at_most_two_images_are_unacknowledged(server: Server, open_socket: Open) -> None:
    lazy = Client(open_socket())
    lazy.say = lambda kind, /, **fields: None if kind == "ack" else Client.say(lazy, kind, **fields)  # type: ignore[method-assign]
    for step in range(10):
        lazy.socket.send(json.dumps(orbited(lazy.welcome["camera"], step + 1)))
        time.sleep(0.05)
    session = server.sessions[lazy.welcome["session"]]
    assert session.connection.sent - session.connection.acknowledged <= 2


def test_each_client_has_its_own_camera(server: Server, client: Client, open_socket: Open) -> None:
    other = Client(open_socket())
    other.say("camera", seq=1, name="side")
    other.hear("picture", samples=16)
    one, two = (server.sessions[each.welcome["session"]].view.camera for each in (client, other))
    assert np.allclose(one.C, [4, -3, 2])
    assert np.allclose(two.C, [-4, -3, 2])


def test_reconnected_client_keeps_its_view(server: Server, client: Client, open_socket: Open) -> None:
    client.socket.send(json.dumps(orbited(client.welcome["camera"], 35)))
    client.hear("picture", samples=16)
    moved = server.sessions[client.welcome["session"]].view.camera
    client.socket.close()
    until(lambda: not server.sessions[client.welcome["session"]].connection.is_open)
    back = Client(open_socket(), client.welcome["session"])
    assert back.welcome["session"] == client.welcome["session"]
    assert server.sessions[back.welcome["session"]].view.camera == moved
    assert back.hear("picture", moving=False)[0]["samples"] == 16


def test_image_follows_the_welcome_message_of_a_slow_reconnection(
    server: Server, client: Client, open_socket: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    greet = Session.greet

    def greet_late(session: Session) -> None:
        server.scheduler.wake()
        time.sleep(0.5)
        greet(session)

    client.hear("picture", samples=16)
    client.socket.close()
    until(lambda: not server.sessions[client.welcome["session"]].connection.is_open)
    monkeypatch.setattr(Session, "greet", greet_late)
    back = Client(open_socket(), client.welcome["session"])
    assert back.hear("picture", moving=False)[0]["samples"] == 16


def test_session_of_a_connected_client_cannot_be_taken_over(client: Client, open_socket: Open) -> None:
    assert Client(open_socket(), client.welcome["session"]).welcome["session"] != client.welcome["session"]


def test_pixels_are_explained_and_cameras_copied(client: Client, small_world: raycam.World) -> None:
    client.hear("picture", samples=16)
    client.say("explain", id=1, u=24, v=16)
    explained = client.hear("explained")[0]
    camera = small_world.camera("front")
    assert explained["text"] == str(raycam.explain(small_world, camera, (24, 16)))
    client.say("explain", id=2, u=1000, v=16)
    assert "pixel 1000, 16" in client.hear("error")[0]["text"]
    client.say("copy", format="python")
    names: dict[str, Any] = {"raycam": raycam}
    exec(client.hear("copied")[0]["text"], names)
    assert names["camera"] == camera


def test_cameras_are_copied_for_opencv_and_colmap(
    client: Client, small_world: raycam.World, tmp_path: Path
) -> None:
    camera = small_world.camera("front")
    client.say("copy", format="opencv")
    (tmp_path / "camera.yaml").write_text(client.hear("copied")[0]["text"])
    stored = cv2.FileStorage(str(tmp_path / "camera.yaml"), cv2.FILE_STORAGE_READ)
    for name, expected in (("camera_matrix", camera.K), ("R", camera.R)):
        np.testing.assert_array_equal(stored.getNode(name).mat(), expected)
    client.say("copy", format="colmap")
    _, cameras, images = re.split(r"# (?:cameras|images)\.txt\n", client.hear("copied")[0]["text"])
    folder = tmp_path / "colmap"
    folder.mkdir()
    (folder / "cameras.txt").write_text(cameras)
    (folder / "images.txt").write_text(images)
    (back,) = raycam.load_cameras(folder).values()
    np.testing.assert_allclose(back.R, camera.R, atol=1e-12)
    np.testing.assert_allclose(back.location, camera.location, atol=1e-12)
    np.testing.assert_allclose(back.K[:2, :2], camera.K[:2, :2])
    np.testing.assert_allclose(
        back.K[:2, 2], camera.K[:2, 2] + 0.5
    )  # COLMAP's pixel coordinates start at the corner


def test_unsupported_camera_of_a_copy_format_sends_an_error(client: Client, server: Server) -> None:
    (session,) = server.sessions.values()
    session.show(
        session.view.with_camera(session.view.camera.replace(distortion=[], model="equirectangular"))
    )
    client.say("copy", format="colmap")
    assert "equirectangular" in client.hear("error")[0]["text"]


def test_snapshots_equal_the_frame(client: Client, small_world: raycam.World) -> None:
    client.hear("picture", samples=16)
    client.say("snapshot", format="npz")
    message, (data,) = client.hear("file")
    assert message["name"] == "small.npz"
    saved = np.load(io.BytesIO(data))
    expected = raycam.render(
        small_world, small_world.camera("front"), samples=16, channels=["color", "depth"]
    )
    assert saved["color"].tobytes() == expected["color"].tobytes()
    assert saved["depth"].tobytes() == expected["depth"].tobytes()
    client.say("snapshot", format="html")
    message, (data,) = client.hear("file")
    assert data.startswith(b"<!doctype html>")


def test_close_sends_a_closing_message(server: Server, client: Client) -> None:
    server.close()
    assert client.hear("closing")
    with pytest.raises(ConnectionClosed):
        client.hear("nothing")  # `hear` skips an image that was already sent
    assert not server.scheduler.is_alive()


def test_server_start_raises_the_cause(monkeypatch: pytest.MonkeyPatch) -> None:
    async def fails(server: Server) -> None:
        raise ModuleNotFoundError("No module named 'websockets'")

    monkeypatch.setattr(Server, "_serve", fails)
    with raises(ModuleNotFoundError, mentions=["websockets"]):
        Server(lambda: None)  # type: ignore[arg-type, return-value]


def test_used_port_raises_without_a_session(server: Server) -> None:
    with raises(OSError, code="cannot_listen", mentions=["port"]):
        Server(lambda: None, port=server.address[1])  # type: ignore[arg-type, return-value]


def test_next_free_port_is_used(
    small_world: raycam.World, monkeypatch: pytest.MonkeyPatch, server: Server
) -> None:
    monkeypatch.setattr(serving, "PORTS", [server.address[1], 0])
    other = Server(lambda: None)  # type: ignore[arg-type, return-value]
    assert other.address[1] not in (server.address[1], 0)
    other.close()
    monkeypatch.setattr(serving, "PORTS", [server.address[1]])
    with raises(OSError, code="cannot_listen", mentions=["port"]):
        Server(lambda: None)  # type: ignore[arg-type, return-value]
    assert PORTS[0] == 7421


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"port": 70000}, fault("out_of_range", "70000", "65535")),
        ({"port": -1}, fault("out_of_range", "-1", "65535")),
        (
            {"host": "192.0.2.1", "port": 0},
            fault("cannot_listen", "192.0.2.1:0"),
        ),
    ],
)
def test_invalid_addresses_raise_with_a_remedy(
    small_world: raycam.World, options: dict[str, Any], told: Fault
) -> None:
    with raises((raycam.SettingsError, OSError), **told):
        Server(lambda: Session(small_world, small_world.camera("front")), **options)


def test_used_port_raises(server: Server, small_world: raycam.World) -> None:
    with raises(OSError, code="cannot_listen", mentions=["port"]):
        Server(lambda: Session(small_world, small_world.camera("front")), port=server.address[1])


def test_internal_error_is_sent_and_the_view_continues(
    client: Client, server: Server, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (session,) = server.sessions.values()

    def fail(*given: object, **settings: object) -> str:
        raise ZeroDivisionError("oh")

    monkeypatch.setattr(answers, "copied", fail)
    client.say("copy", format="python")
    assert "ZeroDivisionError: oh" in client.hear("error")[0]["text"]
    monkeypatch.undo()
    client.say("copy", format="python")
    assert "raycam.Camera" in client.hear("copied")[0]["text"]
    monkeypatch.setattr(scheduling, "moving_frame", fail)
    session.images.restart()
    server.scheduler.wake()
    assert "ZeroDivisionError: oh" in client.hear("error")[0]["text"]
    monkeypatch.undo()
    session.images.restart()
    server.scheduler.wake()
    assert client.hear("picture")
    assert "ZeroDivisionError" in capsys.readouterr().err
