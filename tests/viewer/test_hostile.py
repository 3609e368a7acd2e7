"""Generated hostile requests: none receives data, changes state or affects other clients."""

from __future__ import annotations

import base64
import contextlib
import json
import os
import random
import re
import socket
import struct
import urllib.request
from collections.abc import Callable
from pathlib import Path

import pytest
import raycam
from raycam.viewer.server import MOST_FOLLOWERS, MOST_FREE, Server
from raycam.viewer.session import Session
from support.patience import PATIENCE
from support.viewer_client import Client
from viewer.test_messages import GOOD
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

HOSTS = ("evil.example", "127.0.0.1.evil.example", "0.0.0.0", "", "127.0.0.1@evil", "a" * 3000, "[::1")
PATHS = (
    "/x",
    "/../client.js",
    "/etc/passwd",
    "/%2e%2e/x",
    "/socket/..",
    "/?t=1",
    "//",
    "/client.js%00",
    "/" + "a" * 9000,
)
METHODS = ("POST", "PUT", "DELETE", "HEAD", "OPTIONS", "TRACE", "CONNECT", "get", "G E T", "\0")
ORIGINS = (
    "http://evil.example",
    "null",
    "",
    "file://",
    "http://127.0.0.1:1",
    "https://localhost.evil.example",
)
GOOD_FRAMES = (0x1, 0x2, 0x9)


def junk(chance: random.Random, most: int = 400) -> bytes:
    """Some random bytes."""
    return chance.randbytes(chance.randrange(most))


def upgrade(server: Server, **changed: str | None) -> bytes:
    """The request that opens a socket, with changed headers; headers that are None are omitted."""
    own = f"127.0.0.1:{server.address[1]}"
    parts: dict[str, str | None] = {
        "Host": own,
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Key": base64.b64encode(b"0123456789abcdef").decode(),
        "Sec-WebSocket-Version": "13",
        "Origin": f"http://{own}",
        "Sec-WebSocket-Protocol": f"raycam.view.1, token.{server.token}",
    } | {key.replace("_", "-"): value for key, value in changed.items() if key != "path"}
    lines = "".join(f"{key}: {value}\r\n" for key, value in parts.items() if value is not None)
    return f"GET {changed.get('path') or '/socket'} HTTP/1.1\r\n{lines}\r\n".encode()


def frame(chance: random.Random, payload: bytes) -> bytes:
    """A WebSocket frame: masked, unmasked, reserved, truncated, or with a wrong length."""
    kind = chance.choice([*GOOD_FRAMES, 0x0, 0x3, 0xB, 0xF, 0x8]) | chance.choice(
        [0x80, 0x80, 0x00, 0xC0, 0xF0]
    )
    length = chance.choice([len(payload), len(payload), 0, 125])
    masked = chance.random() < 0.7
    if chance.random() < 0.2:
        return bytes([kind, 127 | 0x80]) + struct.pack(">Q", chance.choice([2**63, 2**40, 70000])) + payload
    if length > 125:
        return bytes([kind, 126 | 0x80 * masked]) + struct.pack(">H", length) + bytes(4 * masked) + payload
    return bytes([kind, length | 0x80 * masked]) + bytes(4 * masked) + payload


def wrong_token(server: Server, chance: random.Random) -> str:
    """A token that is not the server's."""
    token = list(server.token)
    token[chance.randrange(len(token))] = "#"
    nearly = "".join(token)
    almost = [f"token.{nearly}", f"token.{server.token[:-1]}", f"token.{server.token}x"]
    return chance.choice(["", "token.", "token.\xff", *almost])


def hostile(server: Server, chance: random.Random) -> bytes:
    """A request that must not receive data."""
    own = f"127.0.0.1:{server.address[1]}"
    two = f"{own}\r\nHost: evil.example"
    talk = json.dumps(
        {
            "type": chance.choice(["move", "edit", "undo", "x", "hello", "camera"]),
            "number": 0,
            "key": "visible",
        }
    )
    kinds: list[Callable[[], bytes]] = [
        lambda: junk(chance),
        lambda: f"GET {chance.choice(PATHS)} HTTP/1.1\r\nHost: {own}\r\n\r\n".encode(),
        lambda: f"GET / HTTP/1.1\r\nHost: {chance.choice(HOSTS)}\r\n\r\n".encode(),
        lambda: f"{chance.choice(METHODS)} / HTTP/1.1\r\nHost: {own}\r\n\r\n".encode(),
        lambda: (
            f"GET / HTTP/{chance.choice(['0.9', '2.0', 'x', '1.1 x'])}\r\nHost: {own}".encode()
            + b"\r\n\r\n"[:2]
        ),
        lambda: f"GET / HTTP/1.1\r\nHost: {two}\r\n\r\n".encode(),
        lambda: f"GET / HTTP/1.1\r\nHost: {chance.choice(HOSTS)}\r\n".encode() + b"X: y\r\n" * 400 + b"\r\n",
        lambda: upgrade(server, Origin=chance.choice([*ORIGINS, None])),
        lambda: upgrade(server, Host=chance.choice(HOSTS)),
        lambda: upgrade(server, path=chance.choice([*PATHS, "/"])),
        lambda: upgrade(server, Sec_WebSocket_Protocol=f"raycam.view.1, {wrong_token(server, chance)}"),
        lambda: upgrade(
            server,
            Sec_WebSocket_Protocol=chance.choice(
                [None, "chat", f"raycam.view.1\r\nCookie: t={server.token}"]
            ),
        ),
        lambda: upgrade(server, path=f"/socket?token={server.token}", Sec_WebSocket_Protocol="raycam.view.1"),
        lambda: upgrade(server, Sec_WebSocket_Key=chance.choice([None, "", "x", "A" * 100])),
        lambda: upgrade(server)[: chance.randrange(1, 200)],
        lambda: upgrade(server, Origin="http://evil.example") + frame(chance, talk.encode()),
        # With the token, but against the protocol: no hello message, random bytes in frames.
        lambda: upgrade(server) + frame(chance, junk(chance, 120)),
        lambda: upgrade(server) + bytes([0x81, 0x80 | min(len(talk), 125)]) + bytes(4) + talk.encode()[:125],
        lambda: upgrade(server) + bytes([0x82, 0x80 | 100]) + bytes(4) + chance.randbytes(100),
    ]
    return chance.choice(kinds)()


def answer(server: Server, request: bytes) -> bytes:
    """The server's response until it closes the connection or sends nothing more."""
    said = b""
    with contextlib.suppress(OSError), socket.create_connection(server.address, timeout=1.0) as made:
        made.sendall(request)
        made.shutdown(socket.SHUT_WR)
        while part := made.recv(65536):
            said += part
    return said


@pytest.mark.parametrize("count", [300, pytest.param(10_000, marks=pytest.mark.proof)])
def test_generated_hostile_requests_are_refused_without_effect(
    server: Server,
    client: Client,
    open_socket: Callable[..., ClientConnection],
    count: int,
    small_world: raycam.World,
) -> None:
    client.hear("picture", samples=16)
    session = server.sessions[client.welcome["session"]]
    version, world = session.images.version, session.view.base
    chance = random.Random(count)
    for number in range(count):
        request = hostile(server, chance)
        said = answer(server, request)
        status = re.match(rb"HTTP/1\.1 (\d{3})", said)
        assert status is None or int(status[1]) in (
            101,
            400,
            401,
            403,
            404,
            405,
            413,
            414,
            426,
            431,
            500,
            501,
            505,
        ), (
            request,
            said[:200],
        )
        secret = (
            server.token.encode(),
            client.welcome["session"].encode(),
            b"welcome",
            b"box",
            b"\xff\xd8\xff",
            b"<script",
        )
        assert not any(word in said for word in secret), (number, request, said[:200])
    assert list(server.sessions) == [session.connection.id]
    assert session.images.version == version
    assert session.view.base is world is small_world
    client.say("probe", id=5, u=24, v=16)
    assert client.hear("values", id=5)[0]["values"]["instance"]["name"] == "box"
    other = Client(open_socket())
    assert other.hear("picture", samples=16)[0]["samples"] == 16


WORDS = [
    "",
    "x",
    "../../etc/passwd",
    "#12345",
    "a" * 999,
    "front",
    "depth",
    "attach",
    "detach",
    "lead",
    "\ud800",
]
VALUES = [None, True, -1, 0, 1, 2**53, 1e300, -1e-300, [], [0, 0], [1e9] * 3, [0.5] * 9, {}, *WORDS]


def message(chance: random.Random) -> str:
    """A message of any type: mostly valid, otherwise with a random value in one field."""
    kind = chance.choice([each for each in GOOD if each not in ("hello", "film")])
    fields = dict(GOOD[kind])
    if fields and chance.random() < 0.3:
        fields[chance.choice(list(fields))] = chance.choice(VALUES)
    return json.dumps({"type": kind, **fields})


def talk(server: Server, url: str, chance: random.Random, count: int) -> None:
    """Sends messages to a server without reading the answers.

    Connects again when it is disconnected.
    """
    host, port = server.address
    sent = 0
    while sent < count:
        with (
            contextlib.suppress(ConnectionClosed, OSError),
            connect(
                f"ws://{host}:{port}/socket",
                origin=Origin(f"http://{host}:{port}"),
                subprotocols=[Subprotocol("raycam.view.1"), Subprotocol(f"token.{url.partition('#t=')[2]}")],
                compression=None,
                max_size=None,
                proxy=None,
                close_timeout=0.1,  # a client with unread images does not receive the answer to its close frame
            ) as made,
        ):
            made.send(json.dumps({"type": "hello", "session": "", "width": 48, "height": 32, "ratio": 1}))
            for _ in range(100):
                made.send(message(chance))
                sent += 1


def resident_bytes() -> int:
    """The memory of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.parametrize("count", [300, pytest.param(10_000, marks=pytest.mark.proof)])
def test_generated_messages_of_followers_change_nothing_and_take_little_memory(
    small_world: raycam.World, count: int
) -> None:
    server = Server(
        lambda: Session(small_world, small_world.camera("front"), samples=4, allows_open=True),
        port=0,
        follow=True,
    )
    try:
        assert server.following is not None
        leader = server.following.leader
        before, view = resident_bytes(), leader.view
        talk(server, server.followers_urls[0], random.Random(count), count)
        assert leader.view is view
        assert leader.view.base is small_world
        assert len(server.sessions) <= MOST_FOLLOWERS + MOST_FREE
        assert resident_bytes() - before < 300e6
        talk(server, server.url, random.Random(count), count)  # this client has the rights of a leader
        assert len(server.sessions) <= MOST_FOLLOWERS + MOST_FREE
        assert resident_bytes() - before < 600e6
        with urllib.request.urlopen(server.url.split("#")[0], timeout=PATIENCE) as page:
            assert page.status == 200
        assert server.scheduler.is_alive()
    finally:
        server.close()
