"""Regression tests for recurring faults of the live view; each test covers one kind."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.explanation.svg import escape
from raycam.viewer.page import page
from raycam.viewer.scene.edits import edited
from raycam.viewer.server import Server
from raycam.viewer.session import Session
from raycam.viewer.viewer import Viewer
from support.chromium import Tab
from support.gltf_document import Document, animated
from support.node_core import needs_node, run_module
from support.patience import until
from support.session_messages import receive
from support.viewer_page import opened, place_of, readout

SAMPLES = 4


def offset_box() -> raycam.World:
    """A box whose vertices are far from the origin of its coordinates."""
    world = raycam.World()
    corners = np.array(np.meshgrid([5, 6], [5, 6], [0, 1])).reshape(3, -1).T.astype(float)
    world.add_object(vertices=corners, triangles=[[0, 1, 2], [1, 3, 2], [4, 5, 6], [5, 7, 6]])
    return world


@pytest.mark.parametrize(("key", "value"), [("turn", 30.0), ("scale", 1.5)])
def test_turn_and_scale_keep_the_middle_of_the_object(key: str, value: float) -> None:
    world = offset_box()
    changed = edited(world, "object", 0, key, value)
    before, after = (each.triangles(0).reshape(-1, 3) for each in (world, changed))
    assert not np.allclose(before, after)
    middles = [(each.min(axis=0) + each.max(axis=0)) / 2 for each in (before, after)]
    assert np.allclose(middles[0][:2], middles[1][:2], atol=1e-6)


def test_first_image_shows_the_animation_at_its_time_and_fit_frames_it(tmp_path: Path) -> None:
    document = Document()
    node = document.node(mesh=document.square(pbrMetallicRoughness={}))
    animated(document, "translation", [0, 1], [[5, 0, 0], [6, 0, 0]], node=node)
    world = raycam.load(document.save(tmp_path / "m.glb"))
    session = Session(world)
    expected = world.at(0.0)
    assert np.array_equal(session.view.world.objects[0].matrix, expected.objects[0].matrix)
    assert np.allclose(session.view.camera_message(0)["bounds"], expected.bounds)
    assert session.view.camera == expected.default_camera()
    receive(session, {"type": "time", "t": 1.0, "animation": ""})
    assert np.allclose(session.view.camera_message(0)["bounds"], world.at(1.0).bounds)
    receive(session, {"type": "home", "seq": 1})
    assert session.view.camera == world.at(1.0).default_camera()


def test_buttons_that_turn_and_scale_keep_the_middle_of_the_object(tab: Tab) -> None:
    with Viewer(offset_box(), port=0, integrator="direct", samples=SAMPLES) as viewer:
        assert viewer._server is not None
        session = opened(tab, viewer._server, SAMPLES)
        middle = session.view.bounds.mean(axis=0)
        for number, text in enumerate(("turn left", "larger"), 1):
            tab.evaluate(
                "[...document.querySelectorAll('#turns button')].find((each) => "
                f"each.textContent === '{text}').click()"
            )
            until(lambda number=number: session.view.opened.edits.about()["undo"] == number)
            assert np.allclose(session.view.bounds.mean(axis=0)[:2], middle[:2], atol=1e-6)


def test_page_of_an_animated_world_shows_the_world_at_the_time_of_the_slider(
    tab: Tab, tmp_path: Path
) -> None:
    document = Document()
    node = document.node(mesh=document.square(pbrMetallicRoughness={}))
    animated(document, "translation", [0, 1], [[5, 0, 0], [6, 0, 0]], node=node)
    with Viewer(raycam.load(document.save(tmp_path / "m.glb")), port=0, samples=SAMPLES) as viewer:
        assert viewer._server is not None
        session = opened(tab, viewer._server, SAMPLES)
        size = session.view.size
        tab.click(*place_of(tab, size[0] // 2, size[1] // 2, size))
        tab.wait("document.getElementById('pixel-place').textContent.endsWith('(held)')")
        x, y, z = (float(each) for each in readout(tab)["position"])
        low, high = session.view.base.at(0.0).bounds
        assert (low - 1e-3 <= [x, y, z]).all()
        assert ([x, y, z] <= high + 1e-3).all()
        assert low[0] > 1  # the rest pose is at the origin
        assert tab.evaluate("document.getElementById('time-text').textContent").startswith("0.00 s")


def test_text_in_figures_is_valid_xml() -> None:
    text = "".join(map(chr, range(0x100))) + "\ufffe\ud800 <&>"
    found = ElementTree.fromstring(f"<t>{escape(text)}</t>").text
    assert found is not None
    assert found.endswith("\ufffd\ufffd <&>")


@needs_node
def test_inflate_stops_at_its_limit() -> None:
    found = run_module(
        "image/planes.js",
        "const packed = await deflate(new Uint8Array(50_000_000));"
        "const within = (await inflate(await deflate(new Uint8Array(900)), 1000)).length;"
        "try { await inflate(packed, 1000); } catch (error) { return [within, error.name]; }",
    )
    assert found == [900, "RangeError"]


def test_invitation_token_is_valid_once(server: Server) -> None:
    token = server.invitation().split("#t=")[1]
    assert token != server.token
    assert [server._tokens.accept(token), server._tokens.accept(token)] == [True, False]
    assert [server._tokens.accept(server.token), server._tokens.accept("x")] == [True, False]


@pytest.fixture(scope="module")
def served(small_world: raycam.World) -> Iterator[Server]:
    camera = small_world.camera("front")
    made = Server(lambda: Session(small_world, camera, samples=SAMPLES, title="w"), port=0)
    yield made
    made.close()


def test_image_is_drawn_again_for_another_pixel_ratio(tab: Tab, served: Server) -> None:
    opened(tab, served, SAMPLES)
    width = tab.evaluate("document.getElementById('picture').width")
    shown = {"width": 1280, "height": 800, "mobile": False}
    tab.call("Emulation.setDeviceMetricsOverride", **shown, deviceScaleFactor=2)
    tab.mouse("mouseMoved", 300, 300)
    tab.wait(f"document.getElementById('picture').width === {2 * width}")
    tab.call("Emulation.setDeviceMetricsOverride", **shown, deviceScaleFactor=1)
    tab.mouse("mouseMoved", 310, 300)
    tab.wait(f"document.getElementById('picture').width === {width}")


def test_reload_keeps_the_camera(tab: Tab, served: Server) -> None:
    tab.open(served.url)
    tab.wait(f"document.getElementById('status').textContent.includes('{SAMPLES} samples')")
    before = len(served.sessions)
    tab.evaluate("document.getElementById('picture').focus()")
    for kind in ("keyDown", "keyUp"):  # commands depend on a key's position, not on its letter
        tab.call("Input.dispatchKeyEvent", type=kind, key="\u0441", code="KeyC")
    until(lambda: any(each.view.camera_name == "side" for each in served.sessions.values()))
    tab.evaluate("location.reload()")
    tab.wait("document.getElementById('camera').value === 'side'")
    assert len(served.sessions) == before


def test_horizontal_swipe_and_double_click_keep_the_view(tab: Tab, served: Server) -> None:
    session = opened_again(tab, served)
    version, view = session.images.version, session.view
    x, y = place_of(tab, 600, 400, view.size)
    tab.mouse("mouseWheel", x, y, deltaX=120, deltaY=0)
    tab.evaluate(
        "globalThis.picks = 0, WebSocket.prototype.send = ((send) => function (text) {"
        " globalThis.picks += text.includes('pick'); return send.call(this, text);"
        "})(WebSocket.prototype.send), 0"
    )
    for count in (1, 2):
        for kind in ("mousePressed", "mouseReleased"):
            tab.mouse(kind, x, y, button="left", clickCount=count)
    tab.wait("globalThis.picks > 0")
    assert tab.evaluate("globalThis.picks") == 1
    assert session.view.camera == view.camera
    assert session.images.version == version


def opened_again(tab: Tab, server: Server) -> Session:
    tab.open(server.url)
    tab.wait(f"document.getElementById('status').textContent.includes('{SAMPLES} samples')")
    return max(server.sessions.values(), key=lambda each: each.connection.is_open)


def test_tab_key_moves_the_focus_out_of_the_image(tab: Tab, served: Server) -> None:
    opened_again(tab, served)
    tab.evaluate("document.getElementById('picture').focus()")
    for kind in ("keyDown", "keyUp"):
        tab.call("Input.dispatchKeyEvent", type=kind, key="Tab", code="Tab", windowsVirtualKeyCode=9)
    tab.wait("document.activeElement.id !== 'picture'")


@pytest.fixture
def saved(small_world: raycam.World, tmp_path: Path) -> Path:
    """The page of an image, in a folder of its own."""
    path = tmp_path / "saved.html"
    frame = raycam.render(small_world, small_world.camera("front"), samples=2)
    path.write_text(page(frame, title="saved"), encoding="utf-8")
    return path


def test_wheel_over_an_embedded_page_scrolls_the_outer_page_until_a_click(tab: Tab, saved: Path) -> None:
    outer = saved.with_name("outer.html")
    outer.write_text(
        '<body style="margin: 0; height: 4000px">'
        '<iframe src="saved.html" style="border: 0; width: 1000px; height: 600px"></iframe>',
        encoding="utf-8",
    )
    tab.call("Page.navigate", url=outer.as_uri())
    tab.wait("document.querySelector('iframe')")

    def zoom() -> Any:
        tree = tab.call("Page.getFrameTree")["frameTree"]
        frames = [each["frame"]["id"] for each in tree.get("childFrames", [])]
        if not frames:
            return None
        world = tab.call("Page.createIsolatedWorld", frameId=frames[0])["executionContextId"]
        script = "document.getElementById('status-zoom')?.textContent"
        found = tab.call("Runtime.evaluate", expression=script, contextId=world, returnByValue=True)
        return found["result"].get("value")

    until(zoom)
    before = zoom()
    tab.mouse("mouseWheel", 400, 300, deltaX=0, deltaY=200)
    tab.wait("scrollY > 0")
    assert zoom() == before
    tab.evaluate("scrollTo(0, 0)")
    tab.wait("scrollY === 0")
    tab.click(400, 300)
    tab.mouse("mouseWheel", 400, 300, deltaX=0, deltaY=200)
    until(lambda: zoom() != before)
    assert tab.evaluate("scrollY") == 0


def test_saved_page_shows_its_image_without_javascript(tab: Tab, saved: Path) -> None:
    tab.call("Emulation.setScriptExecutionDisabled", value=True)
    try:
        tab.call("Page.navigate", url=saved.as_uri())
        tab.wait("document.querySelector('noscript img')?.naturalWidth === 48")
        assert tab.evaluate("document.querySelector('noscript img').getBoundingClientRect().width") > 0
    finally:
        tab.call("Emulation.setScriptExecutionDisabled", value=False)
