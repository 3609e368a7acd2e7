"""The gate: accepted and refused requests."""

from __future__ import annotations

import base64
import hashlib
import re

import pytest
from raycam.viewer import gate

TOKEN = "a" * 43
ACCEPTS = TOKEN.__eq__
OWN = "127.0.0.1:7421"


class Request(dict[str, "list[str]"]):
    """The headers of a request; a header may occur several times."""

    def get_all(self, name: str) -> list[str]:
        return self.get(name, [])


def page(**headers: str | list[str]) -> Request:
    return Request({"Host": [OWN]} | {key: [v] if isinstance(v, str) else v for key, v in headers.items()})


def upgrade(host: str = OWN, **headers: str | list[str]) -> Request:
    socket = {
        "Host": host,
        "Upgrade": "websocket",
        "Origin": f"http://{host}",
        "Sec-WebSocket-Protocol": f"raycam.view.1, token.{TOKEN}",
    }
    return page(**{**socket, **headers})


def status(path: str, headers: Request, allowed: tuple[str, ...] = ()) -> int:
    answer = gate.answer_to(path, headers, ACCEPTS, allowed)
    return 101 if answer is None else answer.status


@pytest.mark.parametrize("path", ["/", "/client.js"])
@pytest.mark.parametrize(
    "host", [OWN, "localhost", "localhost:9000", "LOCALHOST:1", "[::1]:7421", "127.0.0.1"]
)
def test_pages_are_served_to_local_hosts(path: str, host: str) -> None:
    assert status(path, page(Host=host)) == 200


@pytest.mark.parametrize(
    "host",
    [
        *(
            "evil.example",
            "evil.example:7421",
            "127.0.0.1.evil.example",
            "localhost.evil.example",
            "192.168.1.2",
        ),
        *(
            "127.0.0.1:7421@evil",
            "",
            " 127.0.0.1",
            "127.0.0.1:",
            "127.0.0.1:x",
            "127.0.0.1\\evil",
            "0.0.0.0",
            "[::]",
        ),
        [],
        [OWN, OWN],
        [OWN, "evil.example"],
    ],
)
def test_hosts_that_are_not_local_are_refused(host: str | list[str]) -> None:
    for path in ("/", "/client.js", gate.SOCKET):
        assert status(path, page(Host=host)) == 403
        assert status(path, upgrade(Host=host)) == 403


@pytest.mark.parametrize(
    "path",
    [
        *(
            "/index.html",
            "/client.js?x=1",
            "//client.js",
            "/client.js/",
            "/../client.js",
            "/%63lient.js",
            "/CLIENT.JS",
        ),
        *(
            "/etc/passwd",
            "/..%2f..%2fetc/passwd",
            "/socket",
            "",
            "*",
            "http://127.0.0.1/",
            "/?t=" + TOKEN,
            "/.git/config",
        ),
    ],
)
def test_unknown_paths_are_not_found(path: str) -> None:
    assert status(path, page()) == 404


def test_socket_opens_with_the_token_and_the_pages_own_origin() -> None:
    assert status(gate.SOCKET, upgrade()) == 101
    assert status(gate.SOCKET, upgrade(Origin=f"https://{OWN}")) == 101
    assert status(gate.SOCKET, upgrade("localhost:9000")) == 101


@pytest.mark.parametrize("path", ["/", "/client.js", "/socket/", "/socket?x"])
def test_socket_opens_on_no_other_path(path: str) -> None:
    assert status(path, upgrade()) == 404


@pytest.mark.parametrize(
    "origin",
    [
        *(
            "http://evil.example",
            "null",
            "http://127.0.0.1:8888",
            "http://localhost:7421",
            f"http://{OWN}.evil.example",
        ),
        *(f"http://{OWN}/", f"ftp://{OWN}", "", OWN, f"http://evil@{OWN}"),
        [],
        [f"http://{OWN}", "http://evil.example"],
    ],
)
def test_foreign_origins_are_refused_even_with_the_token(origin: str | list[str]) -> None:
    assert status(gate.SOCKET, upgrade(Origin=origin)) == 403


@pytest.mark.parametrize(
    "offered",
    [
        *(
            "raycam.view.1",
            "raycam.view.1, token.",
            f"raycam.view.1, token.{TOKEN[:-1]}",
            f"raycam.view.1, token.{TOKEN}a",
        ),
        *(
            f"raycam.view.1, {TOKEN}",
            f"raycam.view.1, Token.{TOKEN}",
            f"raycam.view.1, token.{TOKEN}, token.b",
            "",
            "é",
        ),
        [],
    ],
)
def test_socket_requires_the_token(offered: str | list[str]) -> None:
    assert status(gate.SOCKET, upgrade(**{"Sec-WebSocket-Protocol": offered})) == 401


def test_token_is_accepted_only_as_a_subprotocol() -> None:
    for headers in ({"Cookie": f"token={TOKEN}"}, {"Authorization": f"Bearer {TOKEN}"}):
        assert status(gate.SOCKET, upgrade(**{"Sec-WebSocket-Protocol": "raycam.view.1"}, **headers)) == 401


def test_other_protocol_version_is_refused_with_a_hint_to_reload() -> None:
    answer = gate.answer_to(
        gate.SOCKET, upgrade(**{"Sec-WebSocket-Protocol": f"raycam.view.2, token.{TOKEN}"}), ACCEPTS
    )
    assert answer is not None
    assert answer.status == 400


def test_allowed_hosts_are_accepted_with_their_own_origin() -> None:
    allowed = ("hub.example",)
    assert status("/", page(Host="hub.example"), allowed) == 200
    assert status(gate.SOCKET, upgrade("hub.example", Origin="https://hub.example"), allowed) == 101
    assert status(gate.SOCKET, upgrade("hub.example", Origin=f"http://{OWN}"), allowed) == 403
    assert status("/", page(Host="evil.example"), allowed) == 403


@pytest.mark.parametrize("method", ["POST", "PUT", "HEAD", "OPTIONS", "get"])
def test_methods_other_than_get_are_refused(method: str) -> None:
    answers = [
        gate.answer_to(path, headers(), ACCEPTS, (), method)
        for path, headers in (("/", page), ("/socket", upgrade))
    ]
    assert [answer and answer.status for answer in answers] == [405, 405]


def test_page_loads_only_its_own_files() -> None:
    answer = gate.answer_to("/", page(), ACCEPTS)
    assert answer is not None
    assert TOKEN not in answer.text
    assert '<link rel="preload" href="client.js" as="script">' in answer.text
    policy = gate.response_headers()["Content-Security-Policy"]
    assert "unsafe" not in policy
    for kind in ("script", "style"):
        (inline,) = re.findall(f"<{kind}>(.*?)</{kind}>", answer.text, re.S)
        digest = base64.b64encode(hashlib.sha256(inline.encode()).digest()).decode()
        (allowed,) = re.findall(f"{kind}-src ([^;]*);", policy)
        assert allowed.removeprefix("'self' ") == f"'sha256-{digest}'"


def test_page_and_script_are_assembled_once() -> None:
    gate.prepare_page()
    answers = [gate.answer_to("/client.js", page(), ACCEPTS) for _ in range(2)]
    assert answers[0] is not None
    assert answers[1] is not None
    assert answers[0].text is answers[1].text
