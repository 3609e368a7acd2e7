"""The live view on a network: all addresses, proxies, and signals that end it."""

from __future__ import annotations

import base64
import contextlib
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import raycam
from raycam.viewer import gate
from raycam.viewer.server import Server, machine_addresses
from raycam.viewer.session import Session
from support.chromium import Tab
from support.patience import PATIENCE, until
from support.viewer_client import Client
from websockets.datastructures import Headers
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 3\n"


def socket_of(
    address: str, token: str, *, origin: str = "", host: str = "", forwarded: str = ""
) -> ClientConnection:
    """Opens a WebSocket of the server at `address`, as a page of `origin` does.

    `host` replaces the address in the URL; `forwarded` is the header X-Forwarded-Host.
    """
    headers = {name: text for name, text in {"X-Forwarded-Host": forwarded}.items() if text}
    return connect(
        f"ws://{host or address}/socket",
        origin=Origin(origin or f"http://{address}"),
        subprotocols=[Subprotocol(gate.PROTOCOL), Subprotocol(f"token.{token}")],
        additional_headers=headers,
        compression=None,
        max_size=None,
        proxy=None,
    )


@pytest.fixture
def public(small_world: raycam.World) -> Iterator[Server]:
    """A server on all addresses of this machine, which trusts this machine as a proxy."""
    made = Server(lambda: Session(small_world, samples=4), host="0.0.0.0", port=0, proxies=["127.0.0.1"])
    yield made
    made.close()


def test_every_printed_address_of_a_public_server_opens(public: Server) -> None:
    assert len(public.urls) == len(machine_addresses("0.0.0.0"))
    for url in public.urls:
        found = re.fullmatch(r"http://([0-9.]+:\d+)/#t=(.+)", url)
        assert found is not None
        with socket_of(found[1], found[2]) as made:
            assert Client(made).welcome["type"] == "welcome"


def test_x_forwarded_host_is_accepted_only_from_a_named_proxy(
    public: Server, small_world: raycam.World
) -> None:
    address = f"127.0.0.1:{public.address[1]}"
    origin = "https://hub.example"
    with pytest.raises(InvalidStatus) as refused:
        socket_of(address, public.token, origin=origin, forwarded="hub.example")
    assert b"--allow-host hub.example" in (refused.value.response.body or b"")
    public._allowed.append("hub.example")
    with socket_of(address, public.token, origin=origin, forwarded="hub.example") as made:
        assert Client(made).welcome["type"] == "welcome"
    stranger = Server(lambda: Session(small_world, samples=4), port=0, allow_hosts=["hub.example"])
    try:
        with pytest.raises(InvalidStatus) as refused:
            socket_of(
                f"127.0.0.1:{stranger.address[1]}", stranger.token, origin=origin, forwarded="hub.example"
            )
        assert b"X-Forwarded-Host (raycam view --proxy ADDRESS)" in (refused.value.response.body or b"")
    finally:
        stranger.close()


def test_proxy_with_its_own_host_header_is_refused_with_the_cause() -> None:
    request = Headers(
        [
            ("Host", "127.0.0.1:7421"),
            ("Origin", "https://hub.example"),
            ("Upgrade", "websocket"),
            ("Sec-WebSocket-Protocol", f"{gate.PROTOCOL}, token.a"),
        ]
    )
    answer = gate.answer_to(gate.SOCKET, request, lambda token: True)
    assert answer is not None
    assert answer.status == 403
    for word in ("https://hub.example", "127.0.0.1:7421", "X-Forwarded-Host"):
        assert word in answer.text


@contextlib.contextmanager
def served(world: Path, folder: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """The command that shows a world and opens dropped files, and its address; `folder` is for temporary files."""
    words = [
        sys.executable,
        "-m",
        "raycam",
        "view",
        str(world),
        "--no-browser",
        "--allow-open",
        "--port",
        "0",
    ]
    with subprocess.Popen(
        words,
        env={"TMPDIR": str(folder), "PATH": "", "PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as process:
        assert process.stdout is not None
        found = None
        while found is None:
            line = process.stdout.readline()
            assert line, "the command ended"
            found = re.search(r"http://127\.0\.0\.1:\d+/#t=\S+", line)
        yield process, found[0]


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_signal_notifies_the_pages_and_removes_uploads(tmp_path: Path, name: str) -> None:
    (tmp_path / "world.obj").write_bytes(TRIANGLE)
    folder = tmp_path / "temporary"
    folder.mkdir()
    with served(tmp_path / "world.obj", folder) as (process, url):
        address, token = url.removeprefix("http://").split("/#t=")
        with socket_of(address, token) as made:
            client = Client(made)
            data = base64.b64encode(TRIANGLE).decode()
            client.say("upload", name="dropped.obj", bytes=len(TRIANGLE), offset=0, data=data)
            until(lambda: list(folder.rglob("dropped.obj")), "the file did not arrive")
            process.send_signal(getattr(signal, name))
            assert client.hear("closing")[0]["text"] == "The server has stopped."
        process.wait(PATIENCE)
    assert list(folder.iterdir()) == []


@pytest.mark.proof
def test_browser_opens_every_printed_address_of_a_public_server(public: Server, tab: Tab) -> None:
    for url in public.urls:
        tab.open(url)
        tab.wait("document.getElementById('status-connection').textContent === 'connected'")
        tab.wait("document.getElementById('status').textContent.includes('4 samples')")


@pytest.mark.proof
def test_browser_reports_a_server_that_a_signal_ends(tab: Tab, tmp_path: Path) -> None:
    (tmp_path / "world.obj").write_bytes(TRIANGLE)
    (tmp_path / "dropped.obj").write_bytes(TRIANGLE)
    folder = tmp_path / "temporary"
    folder.mkdir()
    with served(tmp_path / "world.obj", folder) as (process, url):
        tab.open(url)
        tab.drop(400, 300, [tmp_path / "dropped.obj"])
        tab.wait("document.getElementById('title').textContent === 'dropped.obj'")
        assert list(folder.rglob("dropped.obj"))
        process.send_signal(signal.SIGHUP)
        tab.wait("document.getElementById('message').textContent.includes('The server has stopped.')")
        process.wait(PATIENCE)
    assert list(folder.iterdir()) == []
