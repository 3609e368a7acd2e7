"""The live view in a notebook cell, with messages over the notebook's channel."""

from __future__ import annotations

import base64
import json
import queue
import sys
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
import raycam
from raycam.viewer import widget as widget_module
from raycam.viewer.server import MOST_SESSIONS
from raycam.viewer.session import Session
from raycam.viewer.widget import Views, cell_page, is_unattended, make_widget
from raycam.viewer.wire import data_url
from support.patience import PATIENCE

HELLO = {"type": "hello", "width": 48, "height": 32, "ratio": 1, "session": ""}


class Channel:
    """The kernel's channel, with the messages that the cell receives."""

    def __init__(self, world: raycam.World) -> None:
        self.heard: queue.Queue[tuple[dict[str, Any], list[bytes]]] = queue.Queue()
        self.views = Views(lambda: Session(world, world.camera("front"), samples=16), self.put)

    def put(self, content: dict[str, Any], buffers: Any) -> None:
        self.heard.put((content, list(buffers)))

    def say(self, view: str, message: Any) -> None:
        self.views.hear({"view": view, "said": json.dumps(message) if isinstance(message, dict) else message})

    def hear(self, view: str, kind: str) -> tuple[dict[str, Any], list[bytes]]:
        while True:
            content, buffers = self.heard.get(timeout=PATIENCE)
            message = content["message"]
            if message["type"] == "picture":
                self.say(content["view"], {"type": "ack", "picture": message["picture"]})
            if content["view"] == view and message["type"] == kind:
                return message, buffers


@pytest.fixture
def channel(small_world: raycam.World) -> Iterator[Channel]:
    made = Channel(small_world)
    yield made
    made.views.close()


def test_notebook_cell_receives_images_and_replies_to_requests(channel: Channel) -> None:
    channel.say("a", HELLO)
    assert channel.hear("a", "welcome")[0]["title"] == "raycam"
    picture, buffers = channel.hear("a", "picture")
    assert (picture["width"], picture["height"], len(buffers)) == (48, 32, 1)
    channel.say("a", {"type": "probe", "id": 5, "u": 24, "v": 16, "image": picture["image"]})
    assert channel.hear("a", "values")[0]["values"]["instance"]["name"] == "box"
    channel.say("a", {"type": "copy", "format": "python"})
    assert channel.hear("a", "copied")[0]["text"].startswith("camera = ")


def test_two_outputs_of_a_widget_have_their_own_cameras(channel: Channel) -> None:
    for view in ("a", "b"):
        channel.say(view, HELLO)
    channel.say("a", {"type": "camera", "seq": 1, "name": "side"})
    assert [channel.views.sessions[view].view.camera_name for view in ("a", "b")] == ["side", "front"]
    channel.say("a", None)
    assert list(channel.views.sessions) == ["b"]


@pytest.mark.parametrize("junk", ["{", '{"type": "open"}', '{"type": "ack", "picture": -1}', "[]", 7])
def test_invalid_messages_are_answered_with_an_error(channel: Channel, junk: Any) -> None:
    channel.say("a", HELLO)
    before = channel.views.sessions["a"].view.camera
    channel.views.hear({"view": "a", "said": junk})
    channel.hear("a", "error")
    assert channel.views.sessions["a"].view.camera == before
    for content in (
        None,
        {},
        {"view": 3},
        {"view": "nobody", "said": '{"type": "visible", "visible": true}'},
    ):
        channel.views.hear(content)
    assert list(channel.views.sessions) == ["a"]


def test_sessions_of_closed_cells_are_replaced(channel: Channel) -> None:
    for number in range(MOST_SESSIONS + 2):
        channel.say(str(number), HELLO)
    assert list(channel.views.sessions) == [str(number) for number in range(2, MOST_SESSIONS + 2)]


def test_cell_page_loads_nothing() -> None:
    page = cell_page("<b>")
    assert "&lt;b&gt;" in page
    assert 'id="in-a-cell"' in page
    assert "connect-src" not in page
    assert "default-src 'none'" in page


def test_widget_forwards_messages(small_world: raycam.World) -> None:
    pytest.importorskip("anywidget")
    widget = make_widget(lambda: Session(small_world, small_world.camera("front")), "small", 400)
    try:
        sent: list[Any] = []
        widget.send = lambda content, buffers=None: sent.append(content)
        widget._handle_custom_msg({"view": "a", "said": json.dumps(HELLO)}, [])
        assert sent[0]["message"]["type"] == "welcome"
        assert widget.page == cell_page("small")
    finally:
        widget.close()


@pytest.mark.parametrize(
    ("accepts_input", "software", "expected"),
    [(True, "", False), (False, "", True), (False, "voila/0.5", False)],
    ids=["notebook", "nbconvert", "voila"],
)
def test_notebooks_that_a_program_executes_are_recognised(
    monkeypatch: pytest.MonkeyPatch, accepts_input: bool, software: str, expected: bool
) -> None:
    request = {"content": {"code": "1", "allow_stdin": accepts_input}}
    shell = SimpleNamespace(kernel=SimpleNamespace(get_parent=lambda: request))
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    monkeypatch.setenv("SERVER_SOFTWARE", software)
    assert is_unattended() is expected


def test_cell_that_a_program_executes_contains_only_an_image(
    small_world: raycam.World, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("anywidget")
    monkeypatch.setattr(widget_module, "is_unattended", lambda: True)
    with raycam.view(small_world, small_world.camera("front"), cell=True) as viewer:
        assert viewer._repr_mimebundle_().keys() == {"text/plain", "image/jpeg"}


@pytest.mark.parametrize(("size", "first"), [((48, 32), (480, 320)), ((1, 2000), (1, 480))])
def test_cell_contains_an_image_for_readers_without_a_kernel(
    small_world: raycam.World, size: tuple[int, int], first: tuple[int, int]
) -> None:
    pytest.importorskip("anywidget")
    camera = small_world.camera("front").resized(size)
    with raycam.view(small_world, camera, cell=True) as viewer:
        data = viewer._repr_mimebundle_()
        data = data[0] if isinstance(data, tuple) else data
        assert data["text/plain"] == "Viewer in a cell"
        assert "application/vnd.jupyter.widget-view+json" in data
        picture = base64.b64decode(data["image/jpeg"])
        assert viewer._widget.still == data_url("image/jpeg", picture)
        shown = raycam.render(
            small_world, camera.resized(first), samples=4, channels="color", integrator="direct"
        )
        assert picture == shown.to_jpeg()
