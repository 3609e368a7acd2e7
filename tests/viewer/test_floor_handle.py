"""The handle that moves a light along the floor."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.viewer import client_messages as messages
from raycam.viewer.scene.edits import Edits
from raycam.viewer.server import Server
from raycam.viewer.session import Session
from support.chromium import Tab
from support.patience import until
from support.viewer_page import drag, opened, place_of

SAMPLES = 2
FLOOR = -0.5
LIGHT = [0.2, -0.3, 0.8]


@pytest.fixture
def lit_world(small_world: raycam.World) -> raycam.World:
    world = small_world.copy()
    world.add_light({"type": "point", "position": LIGHT, "power": [9, 9, 9]})
    return world


def pixel_of(camera: raycam.Camera, point: list[float]) -> list[float]:
    """The position from the top left corner of a point's image, by the pinhole equation."""
    u, v, w = camera.K @ (camera.R @ (np.array(point) - camera.location))
    return [float(u / w - camera.corner), float(v / w - camera.corner)]


def handle(session: Session) -> list[list[list[float]]]:
    (found,) = (each for each in session.overlay(session.view) if each.get("handle") == "floor")
    lines: list[list[list[float]]] = found["lines"]
    return lines


def test_circle_is_centred_at_the_floor_point_below_the_light(lit_world: raycam.World) -> None:
    session = Session(Edits(lit_world), lit_world.camera("front"))
    session.receive(messages.SelectLight(1))
    circle = np.concatenate([np.array(each) for each in handle(session)])
    foot = pixel_of(session.view.still_camera, [*LIGHT[:2], FLOOR])
    assert np.abs((circle.min(axis=0) + circle.max(axis=0)) / 2 - foot).max() < 1.5
    assert np.ptp(circle, axis=0).min() > 5


def test_drag_moves_the_light_at_its_height_in_one_step(lit_world: raycam.World) -> None:
    session = Session(Edits(lit_world), lit_world.camera("front"))
    session.receive(messages.SelectLight(1))
    camera = session.view.still_camera
    begin = pixel_of(camera, [*LIGHT[:2], FLOOR])
    for x, y in ([0.4, 0.1], [0.7, 0.2]):
        session.receive(messages.Gizmo("floor", 3, begin, pixel_of(camera, [x, y, FLOOR])))
    edits = session.view.opened.edits
    assert np.allclose(edits.world.lights[1]["position"], [0.7, 0.2, LIGHT[2]], atol=1e-9)
    assert edits.about()["undo"] == 1
    session.receive(messages.Undo())
    assert edits.world.lights[1]["position"] == LIGHT


def test_drag_above_the_horizon_keeps_the_light(lit_world: raycam.World) -> None:
    world = lit_world.copy()
    world.add_camera(raycam.Camera.look_at([4, 0, 0], [0, 0, 0], size=(48, 32), fov=60), "level")
    session = Session(Edits(world), world.camera("level"))
    session.receive(messages.SelectLight(1))
    begin = pixel_of(session.view.still_camera, [*LIGHT[:2], FLOOR])
    for row in (0.0, 15.99999):  # the pointer is in the sky, and then just below the horizon
        session.receive(messages.Gizmo("floor", 3, begin, [24.0, row]))
        assert session.view.opened.edits.world.lights[1]["position"] == LIGHT


def test_floor_handle_does_not_change_objects(lit_world: raycam.World) -> None:
    session = Session(Edits(lit_world), lit_world.camera("front"))
    for tool in ("move", "turn", "scale"):
        session.receive(messages.Select(0, -1, tool))
        session.receive(messages.Gizmo("floor", 3, [20, 20], [30, 20]))
    assert session.view.opened.edits.about()["undo"] == 0


HAS_YELLOW = """
(x, y) => {
  const picture = document.getElementById("picture");
  const { left, top } = picture.getBoundingClientRect();
  const { data } = picture.getContext("2d").getImageData(x - left - 3, y - top - 3, 7, 7);
  return [...Array(49).keys()].some((i) => data[4 * i] > 230 && data[4 * i + 1] > 180 && data[4 * i + 2] < 60);
}
"""
"""True if the handle's colour is drawn at a position of the window."""


@pytest.mark.proof
def test_browser_drags_a_light_along_the_floor_and_undoes(tab: Tab, lit_world: raycam.World) -> None:
    camera = lit_world.camera("front")
    server = Server(lambda: Session(lit_world, camera, samples=SAMPLES), port=0)
    try:
        tab.show(1280, 800)
        session = opened(tab, server, SAMPLES)
        edits = session.view.opened.edits
        tab.evaluate("document.querySelector('#tree [title=\"point 1\"]').click()")
        until(lambda: session.selection.light == 1)
        column, row = handle(session)[0][0]
        begin = place_of(tab, column - 0.5, row - 0.5, session.view.size)
        tab.wait(f"({HAS_YELLOW})({begin[0]}, {begin[1]})")
        drag(tab, begin, (begin[0] - 60, begin[1] + 20))
        until(lambda: edits.about()["undo"] == 1)
        position = edits.world.lights[1]["position"]
        assert position[2] == pytest.approx(LIGHT[2])
        assert np.linalg.norm(np.subtract(position, LIGHT)) > 0.1
        assert session.view.camera == camera  # the drag did not move the camera
        tab.wait("!document.getElementById('undo').disabled")
        tab.evaluate("document.getElementById('undo').click()")
        until(lambda: edits.world.lights[1]["position"] == LIGHT)
    finally:
        server.close()
