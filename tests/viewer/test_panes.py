"""Several cameras at once: images of up to four cameras, next to each other."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.viewer.server import Server
from support.chromium import Tab
from support.patience import until
from support.viewer_client import SPACE, Client
from support.viewer_page import opened, text_of
from websockets.sync.client import ClientConnection

SAMPLES = 16
HALF = (SPACE["width"] // 2, SPACE["height"] // 2)


def hear_pane(client: Client, name: str, **fields: Any) -> tuple[dict[str, Any], bytes]:
    """The next image of a camera with these fields; all images are acknowledged."""
    while True:
        message, buffers = client.next()
        if message["type"] != "pane":
            continue
        client.say("ack", picture=message["picture"])
        if message["name"] == name and all(message[each] == value for each, value in fields.items()):
            return message, buffers[0]


def test_panes_show_the_images_of_their_cameras(client: Client, small_world: raycam.World) -> None:
    client.say("panes", names=["front", "side"])
    for name in ("front", "side"):
        _, data = hear_pane(client, name, samples=SAMPLES)
        shown = np.asarray(Image.open(io.BytesIO(data)), np.float64)
        expected = raycam.render(small_world, small_world.camera(name).resized(HALF), samples=SAMPLES)
        assert np.abs(shown - expected.to_srgb8()).mean() < 4
        client.say("panes", names=["front", "side"])  # a client that has reconnected sends the names again


def test_panes_show_the_channel_of_the_session(client: Client, server: Server) -> None:
    client.say("panes", names=["side", ""])
    client.say("channel", name="instance")
    message, _ = hear_pane(client, "side", channel="instance")
    assert (message["plane"]["width"], message["plane"]["height"]) == HALF
    hear_pane(client, "", channel="instance")
    client.say("channel", name="color")
    assert hear_pane(client, "side", channel="color", samples=SAMPLES)[0]["encoding"] == "jpeg"
    (session,) = server.sessions.values()
    until(lambda: not any(each.is_due for each in session.panes))


def test_panes_are_rendered_again_only_after_changes_that_they_show(client: Client, server: Server) -> None:
    (session,) = server.sessions.values()
    client.say("panes", names=["side", ""])
    hear_pane(client, "", samples=SAMPLES)
    until(lambda: not any(each.is_due for each in session.panes))
    versions = [each.images.version for each in session.panes]
    client.say("side", seq=1, name="top")
    hear_pane(client, "", samples=SAMPLES)
    assert [each.images.version for each in session.panes] == [versions[0], versions[1] + 1]
    client.say("edit", kind="object", number=0, key="visible", value=False)
    hear_pane(client, "side", samples=SAMPLES)
    assert [each.images.version for each in session.panes] == [versions[0] + 1, versions[1] + 2]


def test_panes_are_removed_by_an_empty_list_and_with_their_camera(client: Client, server: Server) -> None:
    (session,) = server.sessions.values()
    client.say("panes", names=["side", "front"])
    client.say("remove_camera", name="side")
    until(lambda: [each.name for each in session.panes] == ["front"])
    client.say("panes", names=["nothing"])
    client.hear("error")
    client.say("panes", names=[])
    until(lambda: not session.panes)


def test_unacknowledged_panes_pause_the_images(
    open_socket: Callable[..., ClientConnection], server: Server
) -> None:
    client = Client(open_socket())
    (session,) = server.sessions.values()
    client.hear("picture", samples=SAMPLES)
    until(lambda: session.connection.sent == session.connection.acknowledged)
    client.say("panes", names=["front", "side", ""])
    until(lambda: not session.connection.is_ready)
    assert session.connection.sent - session.connection.acknowledged == 2


PAINTED = (
    "[...document.querySelectorAll('#panes canvas')].filter((each) => each.width > 20 && "
    "new Set(each.getContext('2d').getImageData(0, 0, each.width, each.height).data).size > 20).length"
)


def press(tab: Tab, letter: str) -> None:
    for kind in ("keyDown", "keyUp"):
        tab.call("Input.dispatchKeyEvent", type=kind, key=letter, code=f"Key{letter.upper()}")


@pytest.mark.proof
def test_browser_shows_four_cameras_and_selects_one(
    tab: Tab, small_world: raycam.World, server: Server
) -> None:
    tab.show(1280, 800)
    session = opened(tab, server, SAMPLES)
    tab.evaluate("document.querySelector('[aria-label=\"Four cameras\"]').click()")
    tab.wait(f"{PAINTED} === 2")
    selects = "[...document.querySelectorAll('#panes select')].map((each) => each.value).join()"
    assert tab.evaluate(selects) == "front,side"
    sizes = tab.evaluate("[...document.querySelectorAll('#panes canvas')].map((each) => each.width)")
    assert [each.view.size[0] for each in session.panes] == sizes
    until(lambda: not any(each.is_due for each in session.panes))
    tab.wait("![...document.querySelectorAll('#panes .samples')].some((each) => each.textContent)")
    tab.evaluate(
        "(() => { const first = document.querySelector('#panes select'); first.value = '';"
        "first.dispatchEvent(new Event('change')); })()"
    )
    until(lambda: [each.name for each in session.panes] == ["", "side"])
    tab.evaluate("document.querySelector('[aria-label=\"Show side alone\"]').click()")
    tab.wait("document.getElementById('panes').hidden")
    until(lambda: session.view.camera_name == "side" and not session.panes)
    press(tab, "u")
    until(lambda: len(session.panes) == 2)
    camera = session.view.camera
    press(tab, "c")  # the hidden main image keeps its camera
    for name in ("ArrowLeft", "Home"):
        for kind in ("keyDown", "keyUp"):
            tab.call("Input.dispatchKeyEvent", type=kind, key=name, code=name)
    press(tab, "u")
    until(lambda: not session.panes)
    assert session.view.camera is camera
    assert text_of(tab, "title") == "small"
    assert not [line for line in tab.said if "error" in line.lower()]
