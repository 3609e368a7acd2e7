"""Limits of the server.

They concern time, messages per second, stored sessions, and worlds opened by one client.
"""

from __future__ import annotations

import base64
import contextlib
import json
import socket
import stat
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import raycam
from raycam.viewer import probe_limit
from raycam.viewer import server as serving
from raycam.viewer.client_messages import MAX_IMAGE_SIZE
from raycam.viewer.files.uploads import Uploads
from raycam.viewer.messages import CHECKS, MAX_MESSAGE_BYTES
from raycam.viewer.server import Server
from raycam.viewer.session import MAX_STILL_SIZE, Session
from support.patience import PATIENCE, until
from support.viewer_client import Client
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection
from websockets.typing import Origin, Subprotocol

Open = Callable[..., ClientConnection]
MESH = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.fixture
def opening(small_world: raycam.World) -> Iterator[Server]:
    """A server whose clients may open files."""
    camera = small_world.camera("front")
    made = Server(lambda: Session(small_world, camera, samples=4, allows_open=True), port=0)
    yield made
    made.close()


def parts_of(server: Server) -> dict[str, Any]:
    """A server's address, origin and token."""
    place = "{}:{}".format(*server.address)
    protocols = [Subprotocol("raycam.view.1"), Subprotocol(f"token.{server.token}")]
    return {"uri": f"ws://{place}/socket", "origin": Origin(f"http://{place}"), "subprotocols": protocols}


def test_server_limits_have_the_documented_values() -> None:
    assert (MAX_MESSAGE_BYTES, serving.QUEUED_IN, serving.MOST_CONNECTIONS, serving.MOST_SESSIONS) == (
        65536,
        8,
        32,
        8,
    )
    assert (serving.HANDSHAKE_TIME, probe_limit.MOST_PROBES, serving.KEPT) == (5, 60, 600)
    assert MAX_STILL_SIZE <= MAX_IMAGE_SIZE == (2560, 1600)


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """Servers started from now on allow half a second for a handshake."""
    monkeypatch.setattr(serving, "HANDSHAKE_TIME", 0.5)


def test_slow_handshake_is_closed(hasty: None, server: Server) -> None:
    with socket.create_connection(server.address, timeout=PATIENCE) as made:
        made.sendall(b"GET / HTTP/1.1\r\nHost: 127.")
        answer = b""
        while part := made.recv(65536):
            answer += part
    assert b"<html" not in answer


def test_client_without_a_hello_message_is_closed(
    server: Server, open_socket: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The limit for the hello message; the limit for the handshake is unchanged.
    monkeypatch.setattr(serving, "HANDSHAKE_TIME", 0.5)
    made = open_socket()
    with pytest.raises(ConnectionClosed) as closed:
        made.recv(timeout=PATIENCE)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == serving.GOING_AWAY  # after this code, the page connects again
    assert not server.sessions


def test_socket_uses_no_compression(open_socket: Open) -> None:
    made = open_socket(compression="deflate")
    assert made.response is not None
    assert "Sec-WebSocket-Extensions" not in made.response.headers


def test_disconnected_session_expires(
    server: Server, open_socket: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    def left(kept: float) -> str:
        gone = Client(open_socket())
        gone.socket.close()
        until(lambda: not server.sessions[gone.welcome["session"]].connection.is_open)
        monkeypatch.setattr(serving, "KEPT", kept)
        return str(gone.welcome["session"])

    first = left(600.0)
    assert Client(open_socket(), first).welcome["session"] == first
    second = left(-1.0)
    assert Client(open_socket()).welcome["session"] != second
    assert second not in server.sessions


def test_requested_image_sizes_are_limited(client: Client, server: Server) -> None:
    session = server.sessions[client.welcome["session"]]
    client.say("size", width=10000, height=10000, ratio=1)
    client.say("copy", format="toml")
    client.hear("copied")
    assert all(mine <= most for mine, most in zip(session.view.size, MAX_STILL_SIZE, strict=True))
    client.say("size", width=10001, height=1, ratio=1)
    assert "out of range" in client.hear("error")[0]["text"]
    assert not CHECKS["probe"]["u"](MAX_IMAGE_SIZE[0])


def test_opened_file_is_shown_only_to_its_client(
    opening: Server, open_socket: Open, small_world: raycam.World
) -> None:
    first, second = (Client(open_socket(**parts_of(opening))) for _ in range(2))
    data = base64.b64encode(MESH).decode()
    first.say("upload", name="a.obj", bytes=len(MESH), offset=0, data=data)
    first.say("open", name="a.obj", others=[])
    assert first.hear("welcome")[0]["title"] == "a.obj"
    sessions = [opening.sessions[each.welcome["session"]] for each in (first, second)]
    assert sessions[0].view.base.counts["triangles"] == 1
    assert sessions[1].view.base is small_world
    first.say("edit_material", number=0, slot=-1, key="color", value="#00ff00")
    first.hear("contents", undo=1)
    assert sessions[1].view.base is small_world
    first.say("open", name="../a.obj", others=[])
    assert "file name" in first.hear("error")[0]["text"]


def test_upload_folder_is_private_to_the_user() -> None:
    made = Uploads()
    made.add("a.obj", len(MESH), 0, base64.b64encode(MESH).decode())
    assert stat.S_IMODE(made._path().stat().st_mode) == 0o700
    made.close()


def test_server_answers_after_1000_invalid_connections(server: Server) -> None:
    for number in range(1000):
        with socket.create_connection(server.address) as made:
            made.sendall(json.dumps({"type": "move", "number": number}).encode() + b"\r\n\r\n")
    # The server may still be closing earlier connections, which count towards its maximum.
    until(lambda: page(server).startswith(b"HTTP/1.1 200"))
    assert not server.sessions


def page(server: Server) -> bytes:
    """The start of the response to a request for the page; empty if the connection is closed."""
    with contextlib.suppress(ConnectionResetError), socket.create_connection(server.address) as made:
        made.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
        return made.recv(65536)
    return b""
