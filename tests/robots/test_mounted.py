"""Cameras on links."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import raycam
from support.raises import raises


def test_mounted_camera_follows_the_joints(arm: Path) -> None:
    world = raycam.load(arm)
    robot = world.robots["arm"]
    R, C = [[0, 1, 0], [0, 0, 1], [1, 0, 0]], [0.1, 0.2, 0.3]
    fixed = raycam.Camera(
        [[50, 0, 32], [0, 50, 24], [0, 0, 1]], np.eye(3), np.zeros(3), (64, 48), distortion=[0.1, 0, 0, 0]
    )
    camera = fixed.mounted(robot, "slide", R, C)
    for joints in ({"turn": 0.4}, {"turn": -0.7, "push": 0.2}):
        world.set_joints("arm", joints)
        pose = robot.pose("slide")
        np.testing.assert_allclose(camera.C, pose[:3, :3] @ C + pose[:3, 3], atol=1e-15)
        np.testing.assert_allclose(camera.R, np.array(R) @ pose[:3, :3].T, atol=1e-15)
        plain = fixed.at_pose(camera.R, camera.C)
        first, second = (raycam.render(world, one, channels=["depth"])["depth"] for one in (camera, plain))
        np.testing.assert_array_equal(first, second)
        copies = (camera.replace(up="z"), pickle.loads(pickle.dumps(camera)))
        assert all(type(copy) is raycam.Camera and (copy.C == camera.C).all() for copy in copies)
    assert (camera.link, camera.robot) == ("slide", robot)


def test_mounted_camera_of_an_unknown_link_raises(arm: Path) -> None:
    world = raycam.load(arm)
    with raises(raycam.WorldError, code="unknown_name", mentions=["'slid'", "'slide'"]):
        world.default_camera().mounted(world.robots["arm"], "slid")


def test_render_many_moves_the_mounted_camera_with_each_joint_vector(arm: Path) -> None:
    world = raycam.load(arm)
    world.add_object(box=[4, 4, 0.1], location=[0, 0, -0.5], name="floor")
    camera = world.view_from(size=(40, 30)).mounted(world.robots["arm"], "slide")
    q = np.array([[0.2, 0.1], [1.0, 0.2], [-0.5, 0.3]])
    frames = raycam.render_many(world, camera, joints={"arm": q}, channels=["depth", "instance"])
    for row, frame in zip(q, frames, strict=True):
        world.set_joints("arm", row)
        alone = raycam.render(world, camera, channels=["depth", "instance"])
        for name in ("depth", "instance"):
            np.testing.assert_array_equal(frame[name], alone[name])
        np.testing.assert_array_equal(frame.camera.C, camera.C)
