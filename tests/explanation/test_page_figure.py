"""The data from which pages draw the figures of an explanation."""

from __future__ import annotations

import json

import numpy as np
import pytest
import raycam
from raycam.explanation.page_figure import page_figure
from support.node_core import needs_node, run_module

CAMERA = raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(48, 32), fov=40)
CAMERAS = {
    "pinhole": CAMERA,
    "half": raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(48, 32), fov=40, pixel_center="half"),
    "opencv": CAMERA.replace(distortion=[-0.2, 0.05, 0.01, -0.02], model="opencv"),
    "parallel": raycam.Camera.orthographic([4, -3, 2], target=[0, 0, 0], height=3, size=(48, 32)),
}


@pytest.fixture(scope="module")
def small_world() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": 1}, name="box", yaw=20)
    world.add_object(plane={"size": [6, 6]}, location=[0, 0, -0.5], name="floor")
    return world


@pytest.mark.parametrize("name", CAMERAS)
def test_page_figure_contains_ray_and_triangle(small_world: raycam.World, name: str) -> None:
    camera = CAMERAS[name]
    explanation = raycam.explain(small_world, camera, (24, 16))
    found = page_figure(explanation)
    json.dumps(found, allow_nan=False)
    start, way = camera.rays(np.array([24, 16]) + (0.5 if name == "half" else 0))
    np.testing.assert_allclose(found["C"], explanation.units.points(start), atol=1e-12)
    np.testing.assert_allclose(np.cross(found["r"], way), 0, atol=1e-9)
    corner = np.array([0, 0]) + camera.corner
    np.testing.assert_allclose(found["rays"][0][3:], camera.rays(corner)[1], atol=1e-12)
    assert explanation.winner is not None
    assert found["triangle"] == explanation.winner.corners.ravel().tolist()
    shown = np.reshape(found["corners"], (-1, 3, 3))
    assert any(np.array_equal(each, explanation.winner.corners) for each in shown)
    assert len(found["colors"]) == len(shown)


@needs_node
@pytest.mark.parametrize("name", CAMERAS)
def test_page_shows_the_same_crossings(small_world: raycam.World, name: str) -> None:
    explanation = raycam.explain(small_world, CAMERAS[name], (24, 16))
    found = run_module(
        "figure/pixel.js",
        f"const figure = {json.dumps(page_figure(explanation))}, steps = stepsOfFigure(figure);"
        "const { content, share } = outsideOf(figure, null);"
        "return { ...steps, share, pixel: content.spots[1].at, corners: content.rig?.corners, eye: content.rig?.C };",
    )
    winner = explanation.winner
    assert winner is not None
    assert (found["crossings"], found["inside"]) == (winner.crossings, winner.inside)
    np.testing.assert_allclose(found["t"], winner.t, rtol=1e-9)
    np.testing.assert_allclose(found["f"], winner.f, atol=1e-9)
    # The pixel lies on the drawn image plane, on the way from the drawn camera to f(t).
    eye, pixel = np.array(found["eye"]), np.array(found["pixel"])
    np.testing.assert_allclose(np.cross(pixel - eye, winner.f - eye), 0, atol=1e-9)
    normal = np.cross(
        np.subtract(found["corners"][1], found["corners"][0]),
        np.subtract(found["corners"][3], found["corners"][0]),
    )
    if name in ("pinhole", "half", "parallel"):
        assert abs(normal @ (pixel - found["corners"][0])) < 1e-9
