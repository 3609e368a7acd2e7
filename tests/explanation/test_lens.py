"""Rays of lenses and parallel cameras, compared with OpenCV and the renderer."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import raycam
from raycam.camera._optics import Readout
from raycam.viewer.probe import locate
from support.raises import raises

SIZE = (64, 48)
LENSES: dict[str, dict[str, Any]] = {
    "opencv": {"distortion": [-0.25, 0.06, 0.002, -0.001, 0.01]},
    "fisheye": {"distortion": [0.05, -0.01, 0.002, 0.001], "model": "fisheye"},
    "rational": {"distortion": [0.3, -0.1, 0.001, 0.002, 0.01, 0.2, -0.05, 0.01]},
}


def made_world() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": 1}, name="box")
    world.add_object(sphere={"radius": 0.6, "level": 2}, location=[1.2, 0.5, 0], name="ball")
    world.add_object(plane={"size": [9, 9]}, location=[0, 0, -0.6], name="floor")
    return world


def camera_with(**lens: Any) -> raycam.Camera:
    return raycam.Camera.look_at([4, -3, 2], [0.3, 0, 0], size=SIZE, focal=55, **lens)


@pytest.mark.parametrize("name", LENSES)
def test_undistorted_points_equal_those_of_opencv(name: str) -> None:
    cv2 = pytest.importorskip("cv2")
    camera = camera_with(**LENSES[name])
    for pixel in [(3, 4), (31, 24), (60, 40)]:
        steps = raycam.explain(made_world(), camera, pixel).lens
        assert steps is not None
        at = np.array([[pixel]], np.float64)
        if name == "fisheye":
            wanted = cv2.fisheye.undistortPoints(at, camera.K, np.array(LENSES[name]["distortion"]))
        else:
            criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-14)
            wanted = cv2.undistortPoints(
                at, camera.K, np.array(LENSES[name]["distortion"]), criteria=criteria
            )
        assert np.allclose(steps.undistorted, wanted[0, 0], atol=1e-6)
        assert np.allclose(steps.image_point, (np.array(pixel) - camera.K[:2, 2]) / 55)
        assert np.allclose(steps.back, pixel, atol=1e-8)


def rolling(camera: raycam.Camera) -> raycam.Camera:
    """The camera with a rolling shutter, moving and turning during the readout."""
    end = raycam.Camera.look_at([3.6, -3.3, 2.3], [0.1, 0.2, 0], size=SIZE, focal=55)
    return camera.moving(camera.at_pose(end.R, end.location), exposure=0.01, readout=0.05)


def check_pixel(found: raycam.Explanation, frame: raycam.Frame) -> None:
    """Checks that a pixel's explanation equals the frame's values."""
    column, row = found.pixel
    seen = (-1, -1) if found.winner is None else (found.winner.instance, found.winner.triangle)
    assert seen == (frame["instance"][row, column], frame["triangle"][row, column])
    assert found.depth == pytest.approx(frame["depth"][row, column], rel=1e-6)
    assert found.distance == pytest.approx(frame["distance"][row, column], rel=1e-6)


@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("name", ["pinhole", *LENSES, "parallel"])
def test_explained_hits_equal_the_rendered_image(name: str, moves: bool) -> None:
    world = made_world()
    camera = (
        raycam.Camera.orthographic([4, -3, 2], target=[0, 0, 0], size=SIZE, height=4)
        if name == "parallel"
        else camera_with(**LENSES.get(name, {}))
    )
    if moves:
        camera = rolling(camera)
    frame = raycam.render(
        world, camera, samples=1, channels=["depth", "distance", "instance", "triangle"], integrator="flat"
    )
    for column in range(2, SIZE[0], 9):
        for row in range(2, SIZE[1], 9):
            check_pixel(raycam.explain(world, camera, (column, row)), frame)


@pytest.mark.parametrize("direction", ["down", "left"])
@pytest.mark.parametrize("moves", [False, True])
def test_moving_objects_with_a_rolling_shutter_are_explained_as_rendered(
    moves: bool, direction: Readout
) -> None:
    world = made_world()
    keys = [
        {"time": 0, "object": "box", "location": [-0.6, -0.5, 0], "yaw": 0},
        {"time": 1, "object": "box", "location": [0.6, 0.4, 0.3], "yaw": 120},
        {"time": 0, "object": "ball", "location": [1.2, 1.5, 0]},
        {"time": 1, "object": "ball", "location": [1.2, -0.5, 0.2]},
    ]
    world.set_video(seconds=1, interpolation="linear", keyframe=keys)
    moment, eye = world.at(0.5), camera_with(**LENSES["opencv"])
    camera = (
        eye.moving(eye.at_pose(eye.R, [3.8, -3.1, 2.1]), exposure=0.02, readout=0.6, direction=direction)
        if moves
        else eye.exposing(0.02, readout=0.6, direction=direction)
    )
    channels = ["depth", "distance", "instance", "triangle", "position"]
    frame = raycam.render(moment, camera, samples=1, channels=channels, integrator="flat")
    standing = raycam.render(moment, eye, samples=1, channels=["depth"], integrator="flat")["depth"]
    others = 0
    for column in range(2, SIZE[0], 7):
        for row in range(2, SIZE[1], 7):
            found = raycam.explain(moment, camera, (column, row))
            check_pixel(found, frame)
            point = locate(moment, camera, column + 0.5, row + 0.5)["point"]
            if point is not None:
                np.testing.assert_allclose(point, frame["position"][row, column], atol=1e-5)
            others += not np.isclose(found.depth, standing[row, column], atol=0.01)
    assert others > 3  # the motion changes the depth of some pixels


def test_global_shutter_is_explained_at_the_middle_of_the_exposure() -> None:
    world = made_world()
    keys = [{"time": t, "object": "box", "location": [x, 0, 0]} for t, x in ((0, -2.0), (1, 2.0))]
    world.set_video(seconds=1, interpolation="linear", keyframe=keys)
    moment, camera = world.at(0.5), camera_with().exposing(0.4)
    frame = raycam.render(moment, camera, samples=1, channels=["depth"], integrator="flat")
    assert raycam.explain(moment, camera, (28, 24)).depth == pytest.approx(frame["depth"][24, 28], rel=1e-6)


def test_text_contains_the_steps_of_the_lens() -> None:
    text = str(raycam.explain(made_world(), camera_with(**LENSES["fisheye"]), (60, 40)))
    assert "THROUGH THE LENS (fisheye)" in text
    assert "C + r, projected again        (60, 40): the same pixel" in text
    assert "pseudo" not in text
    assert "P⁺" not in text


def test_far_worlds_are_explained_relative_to_a_near_origin() -> None:
    world = raycam.World()
    world.add_object(box={"size": 1}, location=[1e6, 0, 0])
    camera = raycam.Camera.look_at([1e6 + 4, -3, 2], [1e6, 0, 0], size=SIZE, focal=55, **LENSES["fisheye"])
    found = raycam.explain(world, camera, (31, 24))
    frame = raycam.render(world, camera, samples=1, channels=["distance"], integrator="flat")
    assert found.distance == pytest.approx(frame["distance"][24, 31], rel=1e-6)


def test_pixel_without_a_ray_is_refused() -> None:
    camera = raycam.Camera.look_at(
        [4, -3, 2], [0, 0, 0], size=SIZE, focal=8, distortion=[0, 0, 0, 0], model="fisheye"
    )
    assert not camera.valid([0, 0])
    with raises(raycam.CameraError, code="out_of_range"):
        raycam.explain(made_world(), camera, (0, 0))
    assert raycam.explain(made_world(), camera, (31, 24)).svg().startswith("<svg")
