"""Lines over the picture."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.explanation.scene_figure import Line
from raycam.viewer.scene.overlay import frusta, polylines
from raycam.viewer.session import Session


def test_a_frustum_ends_where_its_corners_project(small_world: raycam.World) -> None:
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
def test_lines_are_cut_where_the_camera_has_no_image(model: str) -> None:
    seen = raycam.Camera.look_at([0, 0, 0], [1, 0, 0], size=(64, 48), fov=60)
    if model == "fisheye":
        seen = seen.replace(distortion=[0, 0, 0, 0], model="fisheye")
    line = np.linspace([-5.0, 0.3, 0.1], [5.0, 0.3, 0.1], 21)
    (cut,) = polylines([line], seen)
    assert len(cut) == 21 if model == "fisheye" else 2 <= len(cut) < 21  # a fisheye sees what is behind it
    expected = seen.project(line[-1])[0] - seen.corner
    assert np.allclose(cut[-1], expected, atol=0.06)
    assert polylines([np.full((4, 3), np.nan)], seen) == []


def test_the_picture_carries_them_when_asked(small_world: raycam.World) -> None:
    session = Session(small_world, small_world.camera("front"))
    assert session.overlay(session.camera) == []
    session.receive({"type": "overlay", "cameras": True, "explained": True})
    assert [each["name"] for each in session.overlay(session.camera)] in ([], ["side"])


def test_rays_of_an_explained_pixel_are_drawn_from_anywhere(small_world: raycam.World) -> None:
    session = Session(small_world, small_world.camera("front"))
    session.show_lines([Line("sun 0", "#e0a800", np.array([[0.5, 0, 0], [0.5, 0, 1.0]]))])
    for name in ("front", "side"):
        session.receive({"type": "camera", "name": name})
        (line,) = session.overlay(session.camera)
        ends = session.camera.project([[0.5, 0, 0], [0.5, 0, 1.0]])[0] - session.camera.corner
        found = np.array(line["lines"][0])
        assert np.allclose(found[[0, -1]], ends, atol=0.06)
        assert (line["name"], line["color"]) == ("sun 0", "#e0a800")
    session.receive({"type": "overlay", "cameras": False, "explained": False})
    assert session.overlay(session.camera) == []
