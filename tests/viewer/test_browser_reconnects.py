"""The live view in a browser after lost connections and restarts of the server.

Requires Chromium: `make proof`.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import raycam
from raycam.viewer.scene.edits import Edits
from raycam.viewer.server import Server
from raycam.viewer.session import Session
from support.chromium import Tab
from support.relay import Relay
from support.viewer_page import text_of

pytestmark = pytest.mark.proof
DONE = "document.getElementById('status').textContent.includes('16 samples')"
LOST = "document.getElementById('status').textContent === 'disconnected, trying again'"
SHOWN = """new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() =>
  done([...document.getElementById("picture").getContext("2d").getImageData(300, 200, 200, 200).data].join()))))"""


def served(world: raycam.World | Edits, camera: raycam.Camera, token: str = "") -> Server:
    made = Server(lambda: Session(world, camera, samples=16, title="small"), port=0)
    made._tokens.own = token or made.token
    return made


@pytest.fixture
def relay(server: Server) -> Iterator[Relay]:
    made = Relay(server.address)
    yield made
    made.close()


def open_through(tab: Tab, relay: Relay, token: str) -> None:
    """Opens the live view through the relay, and waits for its last sample."""
    tab.said.clear()
    tab.open(f"http://127.0.0.1:{relay.port}/#t={token}")
    tab.wait(DONE)


def choose(tab: Tab, element: str, value: str) -> None:
    tab.evaluate(
        f"(() => {{ const found = document.getElementById('{element}'); found.value = '{value}';"
        "for (const kind of ['input', 'change']) found.dispatchEvent(new Event(kind, { bubbles: true })); })()"
    )


def paint_it_green(tab: Tab) -> None:
    """Edits the first object, and waits for the last sample of the new image."""
    tab.evaluate("document.getElementById('status').textContent = ''")
    choose(tab, "object-color", "#00ff00")
    tab.wait("!document.getElementById('undo').disabled")
    tab.wait(DONE)


def test_interrupted_connection_restores_view_and_edits(tab: Tab, server: Server, relay: Relay) -> None:
    open_through(tab, relay, server.token)
    (session,) = server.sessions.values()
    choose(tab, "camera", "side")
    paint_it_green(tab)
    choose(tab, "channel", "depth")
    tab.wait("document.getElementById('status').textContent.startsWith('direct, 1 sample,')")
    choose(tab, "channel", "color")
    tab.wait(DONE)
    tab.evaluate("document.getElementById('status').textContent = ''")
    choose(tab, "exposure", "1")
    tab.wait(DONE)
    before, world, id = tab.evaluate(SHOWN), session.view.world, session.connection.id

    relay.cut(None)
    tab.wait(LOST)
    assert tab.evaluate(SHOWN) == before, "the last picture stays"
    tab.evaluate("document.getElementById('undo').click()")
    assert text_of(tab, "message").startswith("No connection to the server, so the command was not executed.")
    choose(tab, "exposure", "2")

    relay.cut(server.address)
    tab.wait(DONE)
    assert list(server.sessions) == [id]
    assert session.view.world is world, "an edit and what could not be said were kept apart"
    assert tab.evaluate("document.getElementById('camera').value") == session.view.camera_name == "side"
    assert tab.evaluate("document.getElementById('exposure').value") == "2"
    assert session.view.exposure == 2
    tab.evaluate("document.getElementById('undo').click()")
    tab.wait("!document.getElementById('redo').disabled")
    tab.wait(DONE)
    assert session.view.world is not world, "the edit is the newest step"
    assert session.view.camera_name == "side", "an earlier step"


def test_page_reconnects_until_it_succeeds(tab: Tab, server: Server, relay: Relay) -> None:
    open_through(tab, relay, server.token)
    for _ in range(2):
        relay.cut(None)
        tab.wait(LOST)
        # The page tries to reconnect several times.
        tab.evaluate("new Promise((done) => setTimeout(done, 1500))")
        assert tab.evaluate(LOST)
        relay.cut(server.address)
        tab.wait(DONE)
    assert len(server.sessions) == 1


def test_page_reconnects_to_a_restarted_server(
    tab: Tab, server: Server, relay: Relay, small_world: raycam.World
) -> None:
    edits = Edits(small_world)
    first = served(edits, small_world.camera("front"))
    relay.target = first.address
    open_through(tab, relay, first.token)
    paint_it_green(tab)
    before = tab.evaluate(SHOWN)
    relay.cut(None)  # the connection is lost without being closed
    first.close()
    tab.wait(LOST)
    assert tab.evaluate(SHOWN) == before
    second = served(edits, small_world.camera("front"), first.token)
    relay.cut(second.address)
    try:
        tab.wait(
            "document.getElementById('message').textContent.startsWith('The server was restarted: this new session')"
        )
        tab.wait(DONE)
        (session,) = second.sessions.values()
        assert not tab.evaluate("document.getElementById('undo').disabled")
        assert session.view.world is edits.world, "what the program keeps is there"
    finally:
        second.close()


def test_server_with_another_token_is_distinguished_from_no_server(
    tab: Tab, server: Server, relay: Relay, small_world: raycam.World
) -> None:
    open_through(tab, relay, server.token)
    before = tab.evaluate(SHOWN)
    other = served(small_world, small_world.camera("side"))
    relay.cut(other.address)
    try:
        tab.wait(
            "document.getElementById('message').textContent.includes('open the address that it printed')"
        )
        assert tab.evaluate(SHOWN) == before
        assert not other.sessions
        assert tab.evaluate(LOST)
        tab.call("Page.navigate", url=f"http://127.0.0.1:{relay.port}/#t={other.token}")
        tab.wait(DONE)
        assert len(other.sessions) == 1
        assert "#" not in tab.evaluate("location.href")
    finally:
        other.close()


def test_page_does_not_reconnect_to_a_closed_server(tab: Tab, small_world: raycam.World) -> None:
    server = served(small_world, small_world.camera("front"))
    tab.said.clear()
    tab.open(server.url)
    tab.wait(DONE)
    before = tab.evaluate(SHOWN)
    server.close()
    tab.wait("document.getElementById('status').textContent === 'disconnected'")
    assert text_of(tab, "message") == "The server has stopped. The last image and its values are still shown."
    tab.evaluate("new Promise((done) => setTimeout(done, 1500))")
    assert text_of(tab, "status") == "disconnected", "nothing is tried again"
    assert tab.evaluate(SHOWN) == before
