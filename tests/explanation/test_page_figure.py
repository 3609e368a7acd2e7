"""The data from which pages draw the figures of an explanation."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.explanation.page_figure import lines_figure, page_figure
from raycam.explanation.scene_figure import light_lines, path_marks, tree_lines
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
def test_page_figure_has_the_crossings_of_the_explanation(small_world: raycam.World, name: str) -> None:
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


def lit_world() -> raycam.World:
    """A box, a floor, a finely divided sphere, and a sun."""
    world = raycam.World()
    world.add_object(box={"size": 1}, name="box", yaw=20)
    world.add_object(plane={"size": [60, 60]}, location=[0, 0, -0.5], name="floor")
    world.add_object(sphere={"radius": 0.5, "level": 5}, location=[1, 1, 0], name="ball")
    world.add_light({"type": "sun", "direction": [-1, 1, -2], "irradiance": 3})
    return world


def figure_of_lines(camera: raycam.Camera, subject: str) -> dict[str, Any]:
    """The figure of the given subject for pixel (24, 16)."""
    explanation = raycam.explain(lit_world(), camera, (24, 16))
    if subject == "tree":
        return lines_figure(explanation, tree_lines(explanation, explanation.tree()), [])
    path = explanation.light_path()
    lines = light_lines(explanation.world, explanation.lighting(), path)
    return lines_figure(explanation, lines, path_marks(path))


@pytest.mark.parametrize("subject", ["light", "tree"])
def test_figure_lines_in_the_image_equal_those_in_the_world(subject: str) -> None:
    found = figure_of_lines(CAMERA, subject)
    json.dumps(found, allow_nan=False)
    P = np.asarray(CAMERA.P)
    compared = 0
    for line in found["lines"]:
        ends = np.column_stack([line["points"], np.ones(len(line["points"]))]) @ P.T
        if len(line["pixels"]) == 1 == len(ends) - 1 and (ends[:, 2] > 0.1).all():
            # Pixel coordinates of figures start at the image's corner instead of the first pixel's centre.
            pixels = ends[:, :2] / ends[:, 2:] + 0.5
            seen = np.array(line["pixels"][0])
            way = (pixels[1] - pixels[0]) / np.linalg.norm(pixels[1] - pixels[0])
            aside = seen - pixels[0]
            assert np.abs(way[0] * aside[:, 1] - way[1] * aside[:, 0]).max() < 0.1
            compared += 1
    assert compared > (0 if subject == "light" else 10)
    for mark in found["marks"]:
        if mark["pixel"]:
            x = P @ [*mark["at"], 1]
            np.testing.assert_allclose(mark["pixel"], x[:2] / x[2] + 0.5, atol=0.1)
    assert subject == "tree" or found["marks"][0]["pixel"]


def test_large_meshes_are_drawn_coarser() -> None:
    found = figure_of_lines(CAMERA, "light")
    shown = np.reshape(found["corners"], (-1, 3, 3))
    every = np.asarray(lit_world().triangles(), np.float64)
    assert len(shown) == len(found["colors"]) <= 2000 < len(every)
    points = shown.reshape(-1, 3)
    nearest = [np.linalg.norm(every.reshape(-1, 3) - point, axis=1).min() for point in points[::17]]
    assert max(nearest) < 1e-2  # vertices are vertices of the world, rounded
    ball = every[np.abs(every - [1, 1, 0]).max(axis=(1, 2)) < 0.51].reshape(-1, 3)
    gaps = [np.linalg.norm(points - point, axis=1).min() for point in ball[::101]]
    assert max(gaps) < 0.1
    area = np.linalg.norm(np.cross(shown[:, 1] - shown[:, 0], shown[:, 2] - shown[:, 0]), axis=1) / 2
    assert (area > 0).all()
    # The area of the box (6) and of the ball (pi).
    assert area[area < 100].sum() == pytest.approx(6 + np.pi, rel=0.1)


@needs_node
@pytest.mark.parametrize("name", CAMERAS)
def test_page_figure_draws_light_path_and_shadow_rays_from_outside(name: str) -> None:
    figure = figure_of_lines(CAMERAS[name], "light")
    found = run_module(
        "figure/explained.js",
        f"const figure = {json.dumps(figure)}, {{ view, content }} = outsideOfLines(figure, null);"
        "view.place(600, 360);"
        "return { ends: [figure.C, figure.end].map((point) => view.see(point)), strokes: content.strokes,"
        " panels: linesPanels(figure, null).map(({ title }) => title) };",
    )
    assert found["panels"] == ["From outside", "In the image"]
    assert all(0 < x < 600 and 0 < y < 360 for x, y, _ in found["ends"])
    path = [stroke for stroke in found["strokes"] if not stroke.get("dash")]
    bounces = [figure["C"], *(mark["at"] for mark in figure["marks"])]
    for stroke, start, end in zip(path, bounces[:-1], bounces[1:], strict=True):
        np.testing.assert_allclose([stroke["from"], stroke["to"]], [start, end], atol=5e-3)
    dashed = [stroke for stroke in found["strokes"] if stroke.get("dash")]
    assert [stroke["text"].split(":")[0] for stroke in dashed] == ["sun 0"]
