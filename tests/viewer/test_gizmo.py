"""Handles of an object, and the effect of dragging them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import raycam
from raycam.viewer.scene import gizmo

LENSES: dict[str, dict[str, Any]] = {
    "pinhole": {},
    "opencv": {"distortion": [-0.2, 0.05, 0, 0, 0]},
    "fisheye": {"distortion": [0.05, 0, 0, 0], "model": "fisheye"},
}
WAY = np.array([30, -12])
PLACE = np.array([0.5, 0.2, 0.3])


def world_and_camera(lens: str) -> tuple[raycam.World, raycam.Camera]:
    world = raycam.World()
    world.add_object(box={"size": 1}, name="box", location=PLACE, yaw=20, scale=[1, 2, 0.5])
    camera = raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(320, 240), focal=280, **LENSES[lens])
    return world, camera


def pixel(camera: raycam.Camera, point: Any) -> Any:
    return camera.project(np.asarray(point, float))[0] - camera.corner


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize(("handle", "axis"), [("x", [1, 0, 0]), ("y", [0, 1, 0]), ("z", [0, 0, 1])])
def test_moved_object_follows_the_pointer_along_its_axis(lens: str, handle: str, axis: list[int]) -> None:
    world, camera = world_and_camera(lens)
    matrix, way = np.array(world.objects[0].matrix), np.array(axis)
    begin, end = pixel(camera, PLACE + 0.4 * way), pixel(camera, PLACE + 0.9 * way)
    after = gizmo.dragged(matrix, np.zeros(3), camera, "move", handle, begin, end)
    assert np.allclose(after[:3, 3], PLACE + 0.5 * way, atol=1e-6)
    assert np.array_equal(after[:3, :3], matrix[:3, :3])


@pytest.mark.parametrize("lens", LENSES)
def test_freely_moved_object_stays_under_the_pointer(lens: str) -> None:
    world, camera = world_and_camera(lens)
    begin = pixel(camera, PLACE)
    after = gizmo.dragged(
        np.array(world.objects[0].matrix), np.zeros(3), camera, "move", "all", begin, begin + WAY
    )
    assert np.allclose(pixel(camera, after[:3, 3]), begin + WAY, atol=1e-6)
    assert camera.forward @ (after[:3, 3] - PLACE) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize(("handle", "index"), [("x", 0), ("y", 1), ("z", 2)])
def test_object_rotates_by_the_angle_of_the_pointer(lens: str, handle: str, index: int) -> None:
    world, camera = world_and_camera(lens)
    matrix, axes = np.array(world.objects[0].matrix), np.eye(3)
    first, second = axes[(index + 1) % 3], axes[(index + 2) % 3]
    angle = np.radians(25)
    begin = pixel(camera, PLACE + 0.5 * first)
    end = pixel(camera, PLACE + 0.5 * (np.cos(angle) * first + np.sin(angle) * second))
    after = gizmo.dragged(matrix, np.zeros(3), camera, "turn", handle, begin, end)
    step = after[:3, :3] @ np.linalg.inv(matrix[:3, :3])
    assert np.allclose(step @ axes[index], axes[index], atol=1e-9)
    assert np.allclose(step @ first, np.cos(angle) * first + np.sin(angle) * second, atol=1e-6)
    assert np.allclose(after[:3, 3], PLACE)


@pytest.mark.parametrize("lens", LENSES)
def test_scaling_keeps_the_centre_and_right_angles(lens: str) -> None:
    world, camera = world_and_camera(lens)
    matrix = np.array(world.objects[0].matrix)
    axis = gizmo.axes_of(matrix, "scale")[0]
    begin, end = pixel(camera, PLACE + 0.4 * axis), pixel(camera, PLACE + 0.6 * axis)
    after = gizmo.dragged(matrix, np.zeros(3), camera, "scale", "x", begin, end)
    before, now = (np.linalg.norm(each[:3, :3], axis=0) for each in (matrix, after))
    assert np.allclose(now / before, [1.5, 1, 1], atol=1e-6)
    products = after[:3, :3].T @ after[:3, :3]
    assert np.allclose(products, np.diag(np.diag(products)), atol=1e-9)
    center = pixel(camera, PLACE)
    after = gizmo.dragged(
        matrix, np.zeros(3), camera, "scale", "all", center + np.array([20, 0]), center + np.array([0, 50])
    )
    assert np.allclose(after[:3, :3], 2.5 * matrix[:3, :3])


def test_pivot_is_the_centre_of_the_mesh() -> None:
    world = raycam.World()
    world.add_mesh(
        [[9, 9, 9], [11, 9, 9], [9, 11, 9], [9, 9, 11]], [[0, 1, 2], [0, 2, 3]], matrix=np.diag([2, 2, 2, 1])
    )
    middle = gizmo.middle_of(world, 0)
    assert np.allclose(middle, [10, 10, 10])
    camera = raycam.Camera.look_at([40, 0, 30], [20, 20, 20], size=(320, 240), focal=280)
    after = gizmo.dragged(
        np.array(world.objects[0].matrix), middle, camera, "turn", "z", [100, 100], [200, 90]
    )
    assert np.allclose(gizmo.placed(after, middle), [20, 20, 20])


@pytest.mark.parametrize("tool", gizmo.TOOLS)
@pytest.mark.parametrize("lens", LENSES)
def test_handles_are_near_the_object(tool: str, lens: str) -> None:
    world, camera = world_and_camera(lens)
    made = gizmo.handles(np.array(world.objects[0].matrix), np.zeros(3), camera, tool)
    assert [each["handle"] for each in made] == ["x", "y", "z"] + ["all"] * (tool != "turn")
    center = pixel(camera, PLACE)
    for each in made:
        points = np.concatenate([np.array(line) for line in each["lines"]])
        assert np.linalg.norm(points - center, axis=1).max() < 1.6 * gizmo.LENGTH


def test_drag_of_zero_length_does_not_change_the_object() -> None:
    world, camera = world_and_camera("pinhole")
    matrix = np.array(world.objects[0].matrix)
    for tool in gizmo.TOOLS:
        for handle in gizmo.HANDLES:
            after = gizmo.dragged(matrix, np.zeros(3), camera, tool, handle, [150, 120], [150, 120])
            assert np.allclose(after, matrix, atol=1e-9)
