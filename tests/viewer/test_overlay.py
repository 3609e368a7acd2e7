"""Lines over the image."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest
import raycam
from raycam.explanation.scene_figure import Line
from raycam.viewer.scene.overlay import MAX_CAMERAS, frusta, grid, polylines
from raycam.viewer.server import Server
from raycam.viewer.session import Session
from support.chromium import Tab
from support.patience import until
from support.session_messages import receive
from support.viewer_page import place_of


def test_frustum_ends_at_its_projected_corners(small_world: raycam.World) -> None:
    seen = raycam.Camera.look_at([0, -12, 5], [0, 0, 1], size=(640, 480), fov=60)
    made = {each["name"]: each["lines"] for each in frusta(small_world.cameras, seen, 1.0)}
    assert list(made) == ["front", "side"]
    camera = small_world.camera("side")
    origin, direction = camera.rays(np.array([0.0, 0.0]) + camera.corner)
    corner = seen.project(origin + direction / (direction @ camera.forward))[0] - seen.corner
    assert np.allclose(made["side"][0][0], corner, atol=0.06)
    assert np.allclose(made["side"][1][0], seen.project(camera.location)[0] - seen.corner, atol=0.06)
    assert [each["name"] for each in frusta(small_world.cameras, seen, 1.0, "front")] == ["side"]


@pytest.mark.parametrize("model", ["pinhole", "fisheye"])
def test_lines_are_clipped_where_the_camera_has_no_image(model: str) -> None:
    seen = raycam.Camera.look_at([0, 0, 0], [1, 0, 0], size=(64, 48), fov=60)
    if model == "fisheye":
        seen = seen.replace(distortion=[0, 0, 0, 0], model="fisheye")
    line = np.linspace([-5.0, 0.3, 0.1], [5.0, 0.3, 0.1], 21)
    (cut,) = polylines([line], seen)
    assert (
        len(cut) == 21 if model == "fisheye" else 2 <= len(cut) < 21
    )  # a fisheye also shows points behind it
    expected = seen.project(line[-1])[0] - seen.corner
    assert np.allclose(cut[-1], expected, atol=0.06)
    assert polylines([np.full((4, 3), np.nan)], seen) == []


def test_overlay_is_sent_on_request(small_world: raycam.World) -> None:
    session = Session(small_world, small_world.camera("front"))
    assert session.overlay(session.view) == []
    receive(session, {"type": "overlay", "cameras": True, "explained": True, "grid": False})
    assert [each["name"] for each in session.overlay(session.view)] in ([], ["side"])


@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("model", ["pinhole", "fisheye"])
def test_grid_lies_on_the_ground_with_round_cell_sizes(up: Literal["y", "z"], model: str) -> None:
    k = "xyz".index(up)
    bounds = np.array([[-2.0, -2.0, -2.0], [5.2, 5.2, 5.2]])
    eye = np.full(3, 20.0)
    seen = raycam.Camera.look_at(eye, [1, 1, 1], up=up, size=(640, 480), fov=60)
    if model == "fisheye":
        seen = seen.replace(distortion=[0.02, 0, 0, 0], model="fisheye")
    made = {each["name"]: each for each in grid(bounds, seen)}
    assert list(made) == ["grid of 1 m", "x", "y", "z"]
    for name, axis in zip("xyz", np.eye(3), strict=True):
        (line,) = made[name]["lines"]
        ends = seen.project(np.array([np.zeros(3), axis]))[0] - seen.corner
        assert np.allclose([line[0], line[-1]], ends, atol=0.06)
    corners = np.full((2, 3), -2.0)
    corners[1, [axis for axis in range(3) if axis != k]] = (
        6.0  # the grid consists of whole cells around the bounds
    )
    lines = made["grid of 1 m"]["lines"]
    assert len(lines) == 2 * 9
    ends = seen.project(corners)[0] - seen.corner
    assert np.allclose([lines[0][0], lines[-1][-1]], ends, atol=0.06)


def test_grid_axes_of_a_distant_world_start_at_its_centre() -> None:
    middle = np.array([1e6, -2e6, 30.0])
    seen = raycam.Camera.look_at(middle + np.array([40, -40, 30]), middle, size=(640, 480), fov=60)
    made = {each["name"]: each for each in grid(middle + np.array([[-9.0, -9, -1], [9, 9, 1]]), seen)}
    (line,) = made["z"]["lines"]
    base = middle - [0, 0, 1]
    assert np.allclose(line[0], seen.project(base)[0] - seen.corner, atol=0.06)
    assert "grid of 2 m" in made


def test_omitted_cameras_give_a_notice() -> None:
    world = raycam.World()
    world.add_object(box={"size": 1})
    for i in range(MAX_CAMERAS + 1):
        world.add_camera(raycam.Camera.look_at([4, i, 2], [0, 0, 0], size=(48, 32), fov=40), f"c{i}")
    session = Session(world, world.default_camera())
    said: list[dict[str, Any]] = []
    session.connection.open(lambda message, buffers: said.append(message))
    for _ in range(2):
        receive(session, {"type": "overlay", "cameras": True, "explained": True, "grid": False})
    notices = [each["text"] for each in said if each["type"] == "notice"]
    assert [str(MAX_CAMERAS) in each for each in notices] == [True]


def test_rays_of_an_explained_pixel_are_drawn_for_every_camera(small_world: raycam.World) -> None:
    session = Session(small_world, small_world.camera("front"))
    session.show_rays([Line("sun 0", "#e0a800", np.array([[0.5, 0, 0], [0.5, 0, 1.0]]))], session.view.world)
    for name in ("front", "side"):
        receive(session, {"type": "camera", "seq": 1, "name": name})
        (line,) = session.overlay(session.view)
        ends = (
            session.view.still_camera.project([[0.5, 0, 0], [0.5, 0, 1.0]])[0]
            - session.view.still_camera.corner
        )
        found = np.array(line["lines"][0])
        assert np.allclose(found[[0, -1]], ends, atol=0.06)
        assert (line["name"], line["color"]) == ("sun 0", "#e0a800")
    receive(session, {"type": "overlay", "cameras": False, "explained": False, "grid": False})
    assert session.overlay(session.view) == []


def test_cameras_are_drawn_at_their_video_poses() -> None:
    world = raycam.World()
    world.add_object(box={"size": 1})
    world.add_camera(raycam.Camera.look_at([3, 0, 1], [0, 0, 0], size=(48, 32), fov=40), "turning")
    world.set_video(fps=10, seconds=2, orbit={"target": [0, 0, 0]})
    session = Session(world, raycam.Camera.look_at([9, -9, 9], [0, 0, 0], size=(480, 320), fov=60))
    receive(session, {"type": "overlay", "cameras": True, "explained": True, "grid": False})
    receive(session, {"type": "time", "t": 1.0, "animation": ""})
    (drawn,) = session.overlay(session.view)
    place = world.camera_at(world.camera("turning"), 1.0).location
    assert np.allclose(place, [-3, 0, 1])
    expected = session.view.still_camera.project(place)[0] - session.view.still_camera.corner
    assert np.allclose(drawn["lines"][1][0], expected, atol=0.06)


@pytest.mark.proof
def test_rays_in_the_browser_end_with_escape_or_another_world_or_light(tab: Tab, server: Server) -> None:
    changes: dict[str, dict[str, Any]] = {
        "world": {"type": "edit", "kind": "object", "number": 0, "key": "move", "value": [0.1, 0, 0]},
        "light": {"type": "quality", "integrator": "path"},
    }
    tab.open(server.url)
    (session,) = server.sessions.values()
    for end in ("Escape", *changes):
        # The pixel is explained in the world of the image that is clicked.
        until(
            lambda: session.images.is_shown() and session.connection.sent == session.connection.acknowledged
        )
        tab.wait("document.getElementById('status').textContent.includes('16 samples')")
        tab.click(*place_of(tab, session.view.size[0] // 2, session.view.size[1] // 2, session.view.size))
        tab.wait("!document.getElementById('explain').disabled")
        tab.evaluate("document.getElementById('explain').click()")
        tab.wait("document.getElementById('explained').open")
        tab.evaluate("document.getElementById('explained').close()")
        until(lambda: session.overlays.rays)
        assert "sun 0" in [line["name"] for line in session.overlay(session.view)]
        if end == "Escape":
            tab.press("Escape")
        else:
            receive(session, changes[end])
        until(lambda: not session.overlays.rays, end)
        assert not [line for line in session.overlay(session.view) if line["name"]]
