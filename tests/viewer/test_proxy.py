"""The live view behind a proxy that serves it under a path."""

from __future__ import annotations

import urllib.request
from collections.abc import Iterator
from typing import Any

import pytest
import raycam
from raycam.viewer.server import Server
from raycam.viewer.session import Session
from support.chromium import Tab
from support.patience import PATIENCE
from support.prefix_proxy import PrefixProxy
from support.viewer_client import Client
from support.viewer_page import drag, place_of
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

PREFIX = "/user/ada/proxy/7421/"
SAMPLES = 4
PROXIES: dict[str, dict[str, Any]] = {
    "nginx, with proxy_set_header Host": {},
    "a proxy that names the host in X-Forwarded-Host": {"host": "127.0.0.1:1", "forwarded": True},
}


@pytest.fixture
def proxied(small_world: raycam.World) -> Iterator[Server]:
    made = Server(
        lambda: Session(small_world, small_world.camera("front"), samples=SAMPLES),
        port=0,
        proxies=["127.0.0.1"],
    )
    yield made
    made.close()


def socket_at(address: str, token: str) -> ClientConnection:
    """The WebSocket that the page at `address` opens."""
    return connect(
        f"ws://{address}{PREFIX}socket",
        origin=Origin(f"http://{address}"),
        subprotocols=[Subprotocol("raycam.view.1"), Subprotocol(f"token.{token}")],
        compression=None,
        max_size=None,
        proxy=None,
    )


@pytest.mark.parametrize("kind", PROXIES)
def test_page_and_socket_work_behind_a_proxy_with_a_path_prefix(proxied: Server, kind: str) -> None:
    proxy = PrefixProxy(proxied.address, PREFIX, **PROXIES[kind])
    for name in ("", "client.js"):
        with urllib.request.urlopen(f"http://{proxy.address}{PREFIX}{name}", timeout=PATIENCE) as answer:
            assert answer.status == 200
            text = answer.read().decode()
        assert 'src="/' not in text
        assert 'href="/' not in text
    with socket_at(proxy.address, proxied.token) as made:
        assert Client(made).hear("picture", samples=SAMPLES)[1]
    proxy.close()


def test_proxy_that_hides_the_public_host_is_refused(proxied: Server) -> None:
    proxy = PrefixProxy(proxied.address, PREFIX, host="127.0.0.1:1")
    with pytest.raises(InvalidStatus) as refused:
        socket_at(proxy.address, proxied.token)
    assert refused.value.response.status_code == 403
    assert b"X-Forwarded-Host" in refused.value.response.body
    proxy.close()


@pytest.mark.proof
def test_browser_sends_all_requests_below_the_proxy_path_prefix(proxied: Server, tab: Tab) -> None:
    proxy = PrefixProxy(proxied.address, PREFIX)
    tab.said.clear()
    tab.requests.clear()
    tab.open(f"http://{proxy.address}{PREFIX}#t={proxied.token}")
    tab.wait(f"document.getElementById('status').textContent.includes('{SAMPLES} samples')")
    (session,) = proxied.sessions.values()
    before = session.view
    drag(tab, place_of(tab, 300, 200, before.size), place_of(tab, 340, 200, before.size))
    tab.wait("document.getElementById('camera').value === ''")
    own = f"http://{proxy.address}{PREFIX}"
    assert all(each.startswith((own, "data:", "blob:", own.replace("http", "ws"))) for each in tab.requests)
    assert tab.said == []
    proxy.close()
