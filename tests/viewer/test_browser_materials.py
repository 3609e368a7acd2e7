"""Placement, textures, lights and cameras that are edited in the panel, in Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.viewer.session import Session
from raycam.viewer.viewer import Viewer
from support.chromium import Tab
from support.patience import until
from support.two_materials import two_materials
from support.viewer_page import place_of

SAMPLES = 4
LISTED_ALONE = "document.querySelectorAll('#tree-list li').length === 1"
STRIPES = np.repeat(np.repeat(np.array([[[255, 0, 0], [0, 0, 255]]], np.uint8), 4, axis=0), 2, axis=1)


@pytest.fixture
def viewer() -> Iterator[Viewer]:
    world = raycam.World()
    world.add_object(box={"size": 1}, name="box", type="principled", texture=STRIPES, yaw=20)
    world.add_object(sphere={"radius": 0.4}, location=[0.9, -0.6, -0.1], name="ball")
    with Viewer(world, port=0, integrator="direct", samples=SAMPLES) as made:
        yield made


@pytest.fixture
def session(viewer: Viewer, tab: Tab) -> Session:
    assert viewer._server is not None
    tab.said.clear()
    tab.show(1280, 800)
    tab.open(viewer.url)
    tab.wait("document.querySelectorAll('#tree-list li').length >= 2")
    (found,) = viewer._server.sessions.values()
    return found


def put(tab: Tab, name: str, value: str) -> None:
    """Enters a value into a field, as a user does who leaves the field afterwards."""
    tab.evaluate(
        f"(() => {{ const field = document.getElementById('{name}'); field.value = '{value}';"
        " field.dispatchEvent(new Event('change')); })()"
    )


def click(tab: Tab, selector: str) -> None:
    """Clicks an element once it is enabled."""
    tab.wait(f"!document.querySelector({selector!r}).disabled")
    tab.evaluate(f"document.querySelector({selector!r}).click()")


def value_of(tab: Tab, name: str) -> float:
    return float(tab.evaluate(f"document.getElementById('{name}').value"))


def test_placement_fields_show_and_set_the_matrix(tab: Tab, session: Session) -> None:
    click(tab, "#tree-list li:nth-child(1) .row-name")
    tab.wait("document.getElementById('place-yaw').value === '20'")
    put(tab, "place-x", "0.75")
    put(tab, "place-yaw", "65")
    put(tab, "scale-z", "2")
    expected = raycam.World()
    expected.add_object(box={"size": 1}, location=[0.75, 0, 0], yaw=65, scale=[1, 1, 2])
    until(lambda: np.allclose(session.view.base.objects[0].matrix, expected.objects[0].matrix))
    for _ in range(3):
        click(tab, "#undo")
    until(lambda: abs(session.view.base.objects[0].matrix[0, 3]) < 1e-12)
    tab.wait(
        "document.getElementById('place-x').value === '0' && document.getElementById('place-yaw').value === '20'"
    )
    put(tab, "scale-x", "0")
    tab.wait("document.getElementById('message').textContent.includes('scale')")
    assert tab.said == []


def test_placement_fields_show_few_digits_of_noisy_and_small_numbers(tab: Tab, viewer: Viewer) -> None:
    world = raycam.World()
    world.add_object(box={"size": 1}, location=[1e-17, 1 / 3, 0], pitch=-89.999992, scale=1.234567e-5)
    viewer.world = world
    tab.open(viewer.url)
    for name, text in {
        "place-x": "0",
        "place-y": "0.333333",
        "place-pitch": "-90",
        "scale-x": "0.000012346",
    }.items():
        tab.wait(f"document.getElementById('{name}').value === '{text}'")


def test_texture_shows_a_thumbnail_and_accepts_another_file(
    tab: Tab, session: Session, tmp_path: Path
) -> None:
    click(tab, "#tree-list li:nth-child(1) .row-name")
    tab.wait("document.querySelector('[data-texture=color] img')?.complete")
    corner = (
        "((u) => {{ const canvas = document.createElement('canvas'); canvas.width = canvas.height = 64;"
        " const context = canvas.getContext('2d');"
        " context.drawImage(document.querySelector('[data-texture=color] img'), 0, 0);"
        " return [...context.getImageData(u, 20, 1, 1).data]; }})({})"
    )
    assert np.allclose(tab.evaluate(corner.format(10)), [255, 0, 0, 255], atol=6)
    assert np.allclose(tab.evaluate(corner.format(52)), [0, 0, 255, 255], atol=6)
    Image.new("RGB", (700, 500), (0, 200, 0)).save(tmp_path / "green paint.png")
    click(tab, "[data-texture=color] button")
    tab.said.clear()  # the browser opens no dialog for a click by script
    tab.call("DOM.enable")
    root = tab.call("DOM.getDocument")["root"]["nodeId"]
    (node,) = tab.call("DOM.querySelectorAll", nodeId=root, selector="[aria-label='Texture file']")["nodeIds"]
    tab.call("DOM.setFileInputFiles", files=[str(tmp_path / "green paint.png")], nodeId=node)
    tab.wait("document.querySelector('[data-texture=color] small')?.textContent === 'green paint.png'")
    tab.wait("document.querySelector('[data-texture=color] img')?.complete")
    assert np.allclose(tab.evaluate(corner.format(30)), [0, 200, 0, 255], atol=6)
    camera = session.view.still_camera
    seen = raycam.render(session.view.base, camera, channels=["albedo", "instance"], samples=1)
    assert np.allclose(
        seen["albedo"][seen["instance"] == 0], [0, (200 / 255 + 0.055) ** 2.4 / 1.055**2.4, 0], atol=0.01
    )
    click(tab, "#undo")
    tab.wait("document.querySelector('[data-texture=color] small').textContent !== 'green paint.png'")
    click(tab, "[data-texture=color] button[aria-label^=clear]")
    until(lambda: _is_white(session))
    assert tab.said == []


def _is_white(session: Session) -> bool:
    seen = raycam.render(
        session.view.base, session.view.still_camera, channels=["albedo", "instance"], samples=1
    )
    return bool(np.allclose(seen["albedo"][seen["instance"] == 0], 1))


def test_light_is_added_colored_moved_by_its_handle_and_removed(tab: Tab, session: Session) -> None:
    put(tab, "light-type", "point")
    tab.wait("!document.getElementById('lights').hidden")
    put(tab, "light-color", "#ff0000")
    put(tab, "light-level", "50")
    put(tab, "light-position-x", "0")
    put(tab, "light-position-y", "0")
    put(tab, "light-position-z", "0.1")
    until(lambda: session.view.base.lights and session.view.base.lights[0]["position"] == [0, 0, 0.1])
    assert np.allclose(session.view.base.lights[0]["power"], [50, 0, 0])
    until(
        lambda: (
            not session.images.is_moving
            and session.images.still is not None
            and session.connection.sent == session.connection.acknowledged
        )
    )
    tab.wait(f"document.getElementById('status').textContent.includes('{SAMPLES} samples')")
    (arrow,) = (each for each in session.overlay(session.view) if each.get("handle") == "z")
    u, v = arrow["lines"][0][-1]
    x, y = place_of(tab, u - 0.5, v - 0.5, session.view.size)
    tab.mouse("mousePressed", x, y, button="left", clickCount=1)
    for step in range(1, 6):
        tab.mouse("mouseMoved", x, y - 8 * step, button="left", buttons=1)
    tab.mouse("mouseReleased", x, y - 40, button="left", clickCount=1)
    until(lambda: session.view.base.lights[0]["position"][2] > 0.15)
    assert np.allclose(session.view.base.lights[0]["position"][:2], 0)
    tab.wait("Number(document.getElementById('light-position-z').value) > 0.15")
    click(tab, "#light-remove")
    until(lambda: not session.view.base.lights)
    tab.wait("document.getElementById('lights').hidden")
    click(tab, "#undo")
    until(lambda: len(session.view.base.lights) == 1)
    assert tab.said == []


def test_view_saved_as_a_camera_can_be_drawn_and_removed(tab: Tab, session: Session) -> None:
    kept = session.view.camera
    put(tab, "camera-name", "over the box")
    click(tab, "#camera-keep")
    tab.wait("document.getElementById('camera').value === 'over the box'")
    assert session.view.base.camera("over the box") == kept
    click(tab, "#camera-keep")
    tab.wait("document.getElementById('camera').value === 'view'")
    click(tab, "#sides button:nth-child(3)")
    tab.wait("document.getElementById('camera').value === ''")
    click(tab, "#show-cameras")
    until(lambda: {"over the box", "view"} <= {each["name"] for each in session.overlay(session.view)})
    click(tab, "#tree-list ul[aria-label=Cameras] li:nth-child(1) button")
    until(lambda: session.view.camera == kept)
    tab.wait("!document.getElementById('camera-remove').hidden")
    click(tab, "#camera-remove")
    until(lambda: list(session.view.base.cameras) == ["view"])
    click(tab, "#undo")
    until(lambda: list(session.view.base.cameras) == ["over the box", "view"])
    assert tab.said == []


def test_measure_tool_draws_the_distance_between_two_clicks(tab: Tab, session: Session) -> None:
    tab.wait(f"document.getElementById('status').textContent.includes('{SAMPLES} samples')")
    seen = raycam.render(
        session.view.base, session.view.still_camera, channels=["position", "instance"], samples=1
    )
    ends = [np.argwhere(seen["instance"] == number).mean(axis=0).round().astype(int) for number in (0, 1)]
    tab.press("d")
    tab.wait("document.getElementById('measure').getAttribute('aria-pressed') === 'true'")
    for row, column in ends:
        tab.click(*place_of(tab, column, row, session.view.size))
        tab.wait(
            f"document.getElementById('pixel-place').textContent.includes('column {column}, row {row} (held)')"
        )
        tab.evaluate("new Promise((done) => setTimeout(done, 400))")
    tab.wait("!document.getElementById('distance').hidden")
    expected = np.linalg.norm(
        np.subtract(*(seen["position"][row, column].astype(float) for row, column in ends))
    )
    shown = float(tab.evaluate("document.getElementById('distance').textContent").split(": ")[1].split()[0])
    assert abs(shown - expected) < 1e-4 * expected
    assert tab.evaluate("document.getElementById('measure').getAttribute('aria-pressed')") == "false"
    assert tab.said == []


def test_turn_and_size_buttons_keep_the_middle_of_a_distant_mesh(tab: Tab, viewer: Viewer) -> None:
    world = raycam.World()
    corners = np.array(np.meshgrid([5, 6], [5, 7], [0, 1])).reshape(3, -1).T.astype(float)
    world.add_object(vertices=corners, triangles=[[0, 1, 2], [1, 3, 2], [4, 5, 6], [5, 7, 6]])
    viewer.world = world
    tab.open(viewer.url)
    assert viewer._server is not None
    for button in range(1, 5):
        before = viewer.world.bounds
        tab.wait(f"document.querySelectorAll('#turns button').length === 4 && {LISTED_ALONE}")
        click(tab, f"#turns button:nth-child({button})")
        until(lambda before=before: not np.allclose(viewer.world.bounds, before, atol=1e-3))
        assert np.allclose(viewer.world.bounds.mean(axis=0)[:2], before.mean(axis=0)[:2], atol=1e-5)


def colors_of_triangles(world: raycam.World) -> np.ndarray:
    """The albedo [2, 3] of the square's two triangles."""
    seen = raycam.render(
        world, world.view_from("top", size=(64, 64)), channels=["albedo", "triangle"], samples=1
    )
    return np.array([seen["albedo"][seen["triangle"] == triangle][0] for triangle in range(2)])


def test_all_materials_get_a_roughness_and_keep_their_colours(
    tab: Tab, viewer: Viewer, tmp_path: Path
) -> None:
    viewer.world = two_materials(tmp_path)
    tab.open(viewer.url)
    tab.wait(LISTED_ALONE)
    click(tab, "#slots [data-slot='-1']")
    tab.wait("document.querySelector('#slots [aria-current] [data-slot]').dataset.slot === '-1'")
    put(tab, "object-roughness", "0.35")
    until(lambda: viewer.world._core.materials(0).count("Principled") == 2)
    assert np.allclose(colors_of_triangles(viewer.world), [[0.8, 0.1, 0.1], [0.1, 0.1, 0.9]], atol=1e-3)
    assert tab.said == []


def test_click_selects_the_material_of_the_triangle_and_edits_only_this_material(
    tab: Tab, viewer: Viewer, tmp_path: Path
) -> None:
    viewer.world = two_materials(tmp_path)
    tab.open(viewer.url)
    assert viewer._server is not None
    tab.wait(f"{LISTED_ALONE} && document.getElementById('status').textContent.includes('{SAMPLES} samples')")
    (session,) = viewer._server.sessions.values()
    view = session.view
    seen = raycam.render(view.base, view.still_camera, channels=["triangle"], samples=1)["triangle"]
    # The red material is selected at first, so the first click must select the blue material.
    for triangle, name in ((1, "blue"), (0, "red"), (1, "blue")):
        row, column = np.argwhere(seen == triangle).mean(axis=0).round().astype(int)
        tab.click(*place_of(tab, column, row, view.size))
        tab.wait(f"document.querySelector('#slots [aria-current]').textContent === '{name}'")
    tab.wait("document.getElementById('object-color').value === '#5959f3'")
    put(tab, "object-color", "#00ff00")
    until(lambda: np.allclose(colors_of_triangles(viewer.world), [[0.8, 0.1, 0.1], [0, 1, 0]], atol=1e-3))
    tab.wait(
        "getComputedStyle(document.querySelector('#slots [aria-current] .swatch')).backgroundColor"
        " === 'rgb(0, 255, 0)'"
    )
    click(tab, "#undo")
    until(lambda: np.allclose(colors_of_triangles(viewer.world)[1], [0.1, 0.1, 0.9], atol=1e-3))
    assert tab.said == []
