"""The live view's controls in a browser: text fields, keys, and the status line.

Requires Chromium: `make proof`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.viewer.server import Server
from raycam.viewer.session import Session
from support.chromium import Tab
from support.patience import until
from support.viewer_page import drag, opened, place_of, text_of

pytestmark = pytest.mark.proof
SAMPLES = 8
SHIFT, CTRL = 8, 2


@pytest.fixture
def live(small_world: raycam.World) -> Iterator[Server]:
    camera = small_world.camera("front")
    made = Server(lambda: Session(small_world, camera, samples=SAMPLES, title="w", allows_open=True), port=0)
    yield made
    made.close()


def press(tab: Tab, key: str, modifiers: int = 0) -> None:
    tab.evaluate("document.getElementById('picture').focus()")
    for kind in ("keyDown", "keyUp"):
        code = f"Key{key.upper()}" if len(key) == 1 else key
        tab.call("Input.dispatchKeyEvent", type=kind, key=key, code=code, modifiers=modifiers)


def type_into(tab: Tab, element: str, text: str) -> None:
    tab.evaluate(
        f"(() => {{ const field = document.querySelector('{element}'); field.value = '{text}';"
        "field.dispatchEvent(new Event('change', { bubbles: true })); })()"
    )


def said(tab: Tab) -> str:
    shown: str = tab.evaluate(
        "(({ hidden, textContent }) => hidden ? '' : textContent)(document.getElementById('message'))"
    )
    return shown


def test_status_shows_rate_triangles_and_connection(tab: Tab, live: Server) -> None:
    session = opened(tab, live, SAMPLES)
    until(lambda: session.images.refinement_of(session.view).change is not None)
    tab.wait("document.getElementById('status-change').textContent.includes(' % changed since ')")
    assert text_of(tab, "status-rate").endswith(" M samples/s")
    assert text_of(tab, "status-world") == "14 triangles"
    assert text_of(tab, "status-connection") == "connected"


@pytest.mark.parametrize("stops", [-13.5, 0.25, 16.0])
def test_exposure_control_starts_at_the_exposure_of_the_world(tab: Tab, stops: float) -> None:
    world = raycam.World.from_dict({"object": [{"box": {"size": 1}}], "render": {"exposure": stops}})
    server = Server(lambda: Session(world, world.default_camera(), samples=2), port=0)
    try:
        session = opened(tab, server, 2)
        assert text_of(tab, "exposure-text") == f"{stops:+g} stops"
        assert float(tab.evaluate("document.getElementById('exposure').value")) == stops
        until(lambda: session.view.exposure == stops)
    finally:
        server.close()


def test_invalid_numbers_are_refused_with_name_and_range(tab: Tab, live: Server) -> None:
    session = opened(tab, live, SAMPLES)
    before = session.view.camera
    for element, text, told in [
        ("#pose-x", "1e12", "x, m: expected a number from -1000000000 to 1000000000, got 1e12."),
        ("#pose-yaw", "", "yaw, °: expected a number from -10000 to 10000."),
        ("#lens-fields input", "0", "fx: expected a number from 0.001 to 10000000, got 0."),
        ("#object-emission", "-3", "Emission W/(m² sr): expected a number from 0 to 1000000, got -3."),
    ]:
        tab.evaluate("document.getElementById('message').click()")
        assert said(tab) == ""
        was = tab.evaluate(f"document.querySelector('{element}').value")
        type_into(tab, element, text)
        assert said(tab) == told
        tab.evaluate(f"document.querySelector('{element}').value = '{was}'")
    press(tab, "Escape")
    assert said(tab) == ""
    assert session.view.camera == before
    # The page sent nothing that the server counts as invalid.
    assert text_of(tab, "status-connection") == "connected"


def test_unchanged_numbers_keep_all_digits(tab: Tab) -> None:
    world = raycam.World()
    middle = np.array([1e6, -2e6, 500.0])
    world.add_object(box={"size": 1}, location=middle.tolist())
    camera = raycam.Camera.look_at(middle + np.array([4.123456789, -3.3, 2.2]), middle, size=(48, 32), fov=40)
    server = Server(lambda: Session(world, camera, samples=2), port=0)
    try:
        session = opened(tab, server, 2)
        type_into(tab, "#pose-z", "503")
        until(lambda: session.view.camera != camera)
        assert session.view.camera.location.tolist() == [*camera.location[:2], 503.0]
        assert np.abs(session.view.camera.R - camera.R).max() < 1e-12
    finally:
        server.close()


def test_keys_dolly_pan_and_frame_the_selected_object(tab: Tab, live: Server) -> None:
    session = opened(tab, live, SAMPLES)
    for key, modifiers, way in [
        ("ArrowUp", SHIFT, lambda moved, camera: moved @ camera.forward > 0),
        ("ArrowDown", SHIFT, lambda moved, camera: moved @ camera.forward < 0),
        (
            "ArrowRight",
            CTRL,
            lambda moved, camera: abs(moved @ camera.R[0]) > 0.9 * np.linalg.norm(moved) > 0,
        ),
        ("ArrowUp", CTRL, lambda moved, camera: abs(moved @ camera.R[1]) > 0.9 * np.linalg.norm(moved) > 0),
    ]:
        before = session.view.camera
        press(tab, key, modifiers)
        until(lambda before=before: session.view.camera != before)
        assert way(session.view.camera.location - before.location, before)
    press(tab, "Home")
    tab.wait("document.getElementById('camera').value === 'front'")
    press(tab, "c")
    until(lambda: session.view.camera_name == "side")
    for name in ("", "side"):
        press(tab, "v")
        until(lambda name=name: session.view.camera_name == name)
    tab.click(*place_of(tab, session.view.size[0] // 2, session.view.size[1] // 2, session.view.size))
    tab.wait("document.getElementById('pixel-place').textContent.includes('held')")
    press(tab, "f")
    until(lambda: session.view.camera_name == "")
    assert np.allclose(session.view.pivot, 0)  # the centre of the box alone, without the floor
    press(tab, "n")
    before = session.view.camera
    press(tab, "w")
    until(lambda: session.view.camera != before)
    for _ in range(2):
        press(tab, "n")


def test_late_message_about_a_camera_does_not_replace_a_newer_choice(
    tab: Tab, live: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = opened(tab, live, SAMPLES)
    late: list[dict[str, Any]] = []
    send = session.connection.send

    def hold(message: dict[str, Any], buffers: Sequence[bytes] = ()) -> None:
        if message["type"] == "camera":
            late.append(message)
        else:
            send(message, buffers)

    monkeypatch.setattr(session.connection, "send", hold)
    press(tab, "c")
    until(lambda: session.view.camera_name == "side")
    press(tab, "v")
    until(lambda: session.view.camera_name == "")
    assert {each["name"] for each in late} == {"side", ""}
    for number, message in enumerate(late):
        send(message)
        send({"type": "notice", "text": f"notice {number}"})
        tab.wait(f"document.getElementById('message').textContent.includes('notice {number}')")
        assert tab.evaluate("document.getElementById('camera').value") == ""
    press(tab, "v")
    until(lambda: session.view.camera_name == "side")


def test_object_omitted_from_the_list_is_selected_by_a_click(tab: Tab) -> None:
    world = raycam.World()
    for i in range(1003):
        world.add_object(plane={"size": [0.5, 0.5]}, location=[i % 40, i // 40, 0], name=f"tile {i}")
    camera = raycam.Camera.look_at([2, 25, 3], [2, 25, 0], [0, 1, 0], size=(60, 40), fov=40)
    server = Server(lambda: Session(world, camera, samples=2), port=0)
    try:
        session = opened(tab, server, 2)
        tab.wait(
            "document.getElementById('unlisted').textContent.startsWith('1,000 of 1,003 objects are listed')"
        )
        tab.click(*place_of(tab, session.view.size[0] // 2, session.view.size[1] // 2, session.view.size))
        tab.wait("document.getElementById('object').selectedOptions[0].textContent === 'tile 1002'")
        tab.evaluate("document.getElementById('object-visible').click()")
        until(lambda: not session.view.base.objects[1002].visible)
    finally:
        server.close()


def test_new_session_restores_the_settings_of_the_page(tab: Tab, live: Server) -> None:
    session = opened(tab, live, SAMPLES)
    for box in ("show-grid", "show-cameras"):
        tab.evaluate(f"document.getElementById('{box}').click()")
    until(lambda: session.overlays.grid and session.overlays.cameras)
    session.connection.set_visible(False)  # as if the page had been hidden before the connection was lost
    tab.wait("document.getElementById('status-connection').textContent === 'connected'")
    session.connection.send(session.welcome())
    until(lambda: session.connection._visible)
    assert tab.evaluate("document.getElementById('show-grid').checked")
    # The session is new, as if the server had been restarted.
    session.overlays = replace(session.overlays, grid=False, cameras=False)
    session.connection.send(session.welcome())
    tab.wait(
        "!document.getElementById('show-grid').checked && !document.getElementById('show-cameras').checked"
    )


def test_unreadable_files_show_an_error(tab: Tab, live: Server, tmp_path: Path) -> None:
    opened(tab, live, SAMPLES)
    for name, data, told in [
        ("empty.glb", b"", "No world found in these files"),
        ("m.toml", b'[[object]]\nmesh = "no.ply"\n', "no.ply"),
    ]:
        tab.evaluate("document.getElementById('message').click()")
        (tmp_path / name).write_bytes(data)
        tab.drop(300, 200, [tmp_path / name])
        tab.wait(f"document.getElementById('message').textContent.includes('{told}')")
        assert tab.evaluate("document.getElementById('message').classList.contains('error')")
    assert text_of(tab, "title") == "w"
    assert text_of(tab, "status-connection") == "connected"


def test_narrow_page_has_no_horizontal_scrolling(tab: Tab, small_world: raycam.World) -> None:
    title = "a very long name of a world file that does not end soon.toml"
    server = Server(lambda: Session(small_world, small_world.camera("front"), samples=2, title=title), port=0)
    tab.show(360, 700)
    try:
        opened(tab, server, 2)
        assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth")
    finally:
        tab.show(1280, 800)
        server.close()


def test_object_of_the_tree_stays_selected_while_a_pixel_is_held(tab: Tab, live: Server) -> None:
    session = opened(tab, live, SAMPLES)
    tab.click(*place_of(tab, session.view.size[0] / 2, session.view.size[1] / 2, session.view.size))
    tab.wait("document.getElementById('object').value === '0'")
    tab.wait("document.querySelector('#values tr')")
    tab.evaluate("document.querySelector('#tree [title=floor]').click()")
    until(lambda: session.selection.number == 1)
    number = session.connection.sent
    type_into(tab, "#exposure", "1")
    tab.evaluate("document.getElementById('exposure').dispatchEvent(new Event('input'))")
    until(lambda: session.connection.acknowledged > number)  # the image and the pixel's values are sent again
    tab.evaluate("new Promise((done) => setTimeout(done, 500))")
    assert tab.evaluate("document.getElementById('object').value") == "1"
    assert session.selection.number == 1


def test_click_on_the_image_scrolls_to_the_selection_and_keeps_the_focus(tab: Tab, live: Server) -> None:
    session = opened(tab, live, SAMPLES)
    tab.show(1280, 440)
    tab.wait("innerHeight === 440")
    width, height = session.view.size
    tab.evaluate("document.getElementById('panel').scrollTop = document.getElementById('panel').scrollHeight")
    visible = (
        "(() => { const [seen, group, bar] = ['panel', 'edit', 'groups'].map((name) => document.getElementById(name)"
        ".getBoundingClientRect()); return group.top >= bar.bottom - 1 && group.top + 200 < seen.bottom; })()"
    )
    assert not tab.evaluate(visible)
    tab.click(*place_of(tab, width // 2, height // 2, (width, height)))
    tab.wait(visible)
    assert tab.evaluate("document.activeElement.id") == "picture"
    tab.evaluate("document.getElementById('panel').scrollTop = 0")
    assert not tab.evaluate(visible)
    # The next click is not part of a double click.
    tab.evaluate("new Promise((done) => setTimeout(done, 600))")
    tab.click(*place_of(tab, width // 2, height // 2 + 40, (width, height)))
    tab.wait(visible)
    tab.show(1280, 800)


@pytest.mark.parametrize("height", [560, 600, 720, 800])
def test_click_on_the_image_shows_the_first_values_and_the_selection(
    tab: Tab, live: Server, height: int
) -> None:
    tab.show(1280, height)
    try:
        session = opened(tab, live, SAMPLES)
        size = session.view.size
        tab.click(*place_of(tab, size[0] // 2, size[1] // 2, size))
        tab.wait("document.querySelector('#values tr')")
        tab.wait("document.querySelector('#tree-list li[aria-current]')")
        top, bottom, place, values, row, edit = tab.evaluate(
            "(() => { const box = (each) => each.getBoundingClientRect();"
            " const [panel, place, values, edit] = ['panel', 'pixel-place', 'values-box', 'edit'].map((id) =>"
            " box(document.getElementById(id))); const row = box(document.querySelector('#values tr:nth-child(6)'));"
            " const bar = box(document.getElementById('groups'));"
            " return [bar.bottom, panel.bottom, place.top, values.bottom, row.bottom, edit.top]; })()"
        )
        assert top <= place
        assert row <= values <= edit
        assert edit + 200 < bottom
    finally:
        tab.show(1280, 800)


def test_buttons_store_the_view_as_a_camera_and_as_comparison_image_b(tab: Tab, live: Server) -> None:
    session = opened(tab, live, SAMPLES)
    tab.evaluate("document.getElementById('camera-add').click()")
    until(lambda: "view" in session.view.base.cameras)
    tab.evaluate("document.getElementById('compare-button').click()")
    tab.wait("document.getElementById('compare').open")
    tab.wait("!document.getElementById('compare-mode').disabled")
    tab.wait("document.getElementById('compare-mode').value === 'slider'")
    tab.evaluate("document.getElementById('compare-button').click()")
    tab.wait("document.getElementById('compare-mode').value === 'off'")


def test_up_button_turns_the_model_upright(tab: Tab, small_world: raycam.World) -> None:
    made = Server(lambda: Session(small_world, samples=SAMPLES, title="w"), port=0)
    try:
        session = opened(tab, made, SAMPLES)
        assert text_of(tab, "up-axis") == "Up: Z"
        tab.evaluate("document.getElementById('up-axis').click()")
        tab.wait("document.getElementById('up-axis').textContent === 'Up: Y'")
        assert session.view.base.up == "y"
        assert "assumed" not in text_of(tab, "notices")
    finally:
        made.close()


def test_up_button_reports_that_the_axis_of_a_mesh_file_is_assumed(tab: Tab, tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    world = raycam.load(tmp_path / "m.obj")
    made = Server(lambda: Session(world, samples=SAMPLES, title="m"), port=0)
    try:
        session = opened(tab, made, SAMPLES)
        assert text_of(tab, "up-axis") == "Up: Z (assumed)"
        assert "z is assumed" in text_of(tab, "notices")
        middle = place_of(tab, session.view.size[0] / 2, session.view.size[1] / 2, session.view.size)
        drag(tab, middle, (middle[0] + 40, middle[1]))
        until(lambda: session.view.shape == "window")
        assert text_of(tab, "up-axis") == "Up: Z (assumed)"
        tab.evaluate("document.getElementById('up-axis').click()")
        tab.wait("document.getElementById('up-axis').textContent === 'Up: Y'")
        tab.wait("!document.getElementById('notices').textContent.includes('assumed')")
    finally:
        made.close()


def test_numbers_of_the_pose_follow_the_camera_during_a_drag(tab: Tab, live: Server) -> None:
    session = opened(tab, live, SAMPLES)
    x, y = place_of(tab, session.view.size[0] // 2, session.view.size[1] // 2, session.view.size)
    shown = "['x', 'y', 'z'].map((axis) => Number(document.getElementById(`pose-${axis}`).value))"
    tab.mouse("mousePressed", x, y, button="left", clickCount=1)
    for step in range(1, 4):
        before = session.view.camera.location
        tab.mouse("mouseMoved", x + 30 * step, y, button="left", buttons=1)
        until(lambda before=before: not np.allclose(session.view.camera.location, before))
        until(lambda: np.allclose(tab.evaluate(shown), session.view.camera.location, atol=1e-6))
    tab.mouse("mouseReleased", x + 90, y, button="left", clickCount=1)
