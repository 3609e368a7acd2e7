"""The start of a served page: it connects before the client's script runs.

Requires Chromium: `make proof`.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import raycam
from raycam.viewer.session import Session
from raycam.viewer.viewer import Viewer
from support.chromium import Tab
from support.patience import until

pytestmark = pytest.mark.proof
SPACE = "(({ width, height }) => [width, height])(picture.getBoundingClientRect())"


@pytest.fixture
def viewer() -> Iterator[Viewer]:
    world = raycam.World()
    # The world has no camera, so the first camera has the shape of the window.
    world.add_object(box={"size": 1}, name="box")
    with Viewer(world, port=0, samples=8) as made:
        yield made


def newest_session(viewer: Viewer, count: int) -> Session:
    """The last of `count` sessions, as soon as it exists."""
    server = viewer._server
    assert server is not None
    until(lambda: len(server.sessions) == count)
    return list(server.sessions.values())[-1]


@pytest.mark.parametrize("width", [1280, 390])
def test_server_receives_the_image_size_before_the_client_runs(tab: Tab, viewer: Viewer, width: int) -> None:
    tab.show(width, 800)
    tab.call("Network.setBlockedURLs", urls=["*client.js"])
    try:
        tab.call("Page.navigate", url=viewer.url)
        session = newest_session(viewer, 1)
        until(lambda: session.connection.sent)
        before = [round(side) for side in tab.evaluate(SPACE)]
        assert list(session.view.space) == before
    finally:
        tab.call("Network.setBlockedURLs", urls=[])
    tab.call("Page.navigate", url="about:blank")
    tab.open(viewer.url)
    session = newest_session(viewer, 2)
    until(lambda: session.images.still is not None)
    # The client does not change the size of the image's space, so the image is rendered only once.
    assert [round(side) for side in tab.evaluate(SPACE)] == before
    assert tab.evaluate("location.hash") == ""
    assert session.images.version == 1


def test_page_without_a_token_reports_the_missing_token(tab: Tab, viewer: Viewer) -> None:
    tab.call("Page.navigate", url=viewer.url.split("#")[0])
    tab.wait("document.getElementById('message').textContent.includes('token')")


def test_socket_opens_before_the_page_has_a_body(tab: Tab, viewer: Viewer) -> None:
    mark = """globalThis.WebSocket = class extends WebSocket {
      constructor(...given) { super(...given); globalThis.hadBody = Boolean(document.body); }
    }"""
    script = tab.call("Page.addScriptToEvaluateOnNewDocument", source=mark)
    try:
        tab.open(viewer.url)
        assert tab.evaluate("hadBody") is False
    finally:
        tab.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script["identifier"])


def test_redirect_file_opens_the_view_once_without_the_token(tab: Tab, viewer: Viewer) -> None:
    server = viewer._server
    assert server is not None
    file = viewer.redirect_file()
    assert file.stat().st_mode & 0o077 == 0
    assert server.token not in file.read_text()
    tab.evaluate("sessionStorage.clear()") if tab.evaluate("location.protocol") == "http:" else None
    tab.call("Page.navigate", url="about:blank")
    tab.open(file.as_uri())
    tab.wait("document.getElementById('status-connection').textContent === 'connected'")
    history = tab.call("Page.getNavigationHistory")["entries"]
    invitation = file.read_text().partition("#t=")[2].partition("'")[0]
    for secret in (server.token, invitation):
        assert not [each["url"] for each in history if secret in each["url"]]
    assert not server._tokens.accept(invitation)
