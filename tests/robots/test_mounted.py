"""Cameras on links."""

from __future__ import annotations

import pickle
from pathlib import Path

import cv2
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


SIX_JOINTS = "".join(
    f'<link name="l{i}"/><joint name="j{i}" type="continuous"><parent link="{"base" if i == 0 else f"l{i - 1}"}"/>'
    f'<child link="l{i}"/><origin xyz="0.05 0 0.15" rpy="0.2 0.1 0"/><axis xyz="{axis}"/></joint>'
    for i, axis in enumerate(["0 0 1", "0 1 0", "1 0 0", "0 0 1", "0 1 0", "1 0 0"])
)


def solve_hand_eye(base_from_gripper: list, camera_from_board: list) -> tuple[np.ndarray, np.ndarray]:
    """Returns rotation and position of gripper_from_camera, the solution X of A X = X B (Park and Martin 1994)."""
    first, start = base_from_gripper[0], camera_from_board[0]
    a = [np.linalg.inv(first) @ pose for pose in base_from_gripper[1:]]
    b = [start @ np.linalg.inv(pose) for pose in camera_from_board[1:]]
    axes_a, axes_b = (
        np.array([cv2.Rodrigues(one[:3, :3])[0].ravel() for one in motions]) for motions in (a, b)
    )
    u, _, vt = np.linalg.svd(axes_a.T @ axes_b)
    rotation = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    left = np.concatenate([one[:3, :3] - np.eye(3) for one in a])
    right = np.concatenate([rotation @ two[:3, 3] - one[:3, 3] for one, two in zip(a, b, strict=True)])
    return rotation, np.linalg.lstsq(left, right, rcond=None)[0]


def test_hand_eye_calibration_with_exact_corners_returns_the_mounting(tmp_path: Path) -> None:
    path = tmp_path / "six.urdf"
    path.write_text(f'<robot name="six"><link name="base"/>{SIX_JOINTS}</robot>')
    world = raycam.World()
    arm = world.add_robot(path)
    R, C = cv2.Rodrigues(np.array([0.3, -0.5, 1.1]))[0], np.array([0.03, -0.02, 0.08])
    K = [[500, 0, 320], [0, 500, 240], [0, 0, 1]]
    camera = raycam.Camera(K, np.eye(3), np.zeros(3), (640, 480)).mounted(arm, "l5", R, C)
    board = np.array([[0.03 * x, 0.03 * y, 0] for y in range(6) for x in range(8)])
    rng = np.random.default_rng(4)
    base_from_gripper, camera_from_board = [], []
    start = camera.C + 0.6 * camera.R[2]
    corners = start + (board - board.mean(axis=0)) @ camera.R
    for _ in range(20):
        world.set_joints("six", rng.uniform(-0.15, 0.15, 6))
        pixels, _ = camera.project(corners)
        found, turn, shift = cv2.solvePnP(board, pixels, camera.K, None)
        assert found
        turn, shift = cv2.solvePnPRefineLM(board, pixels, camera.K, None, turn, shift)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = cv2.Rodrigues(turn)[0], shift.ravel()
        camera_from_board.append(pose)
        base_from_gripper.append(arm.pose("l5"))
    rotation, position = solve_hand_eye(base_from_gripper, camera_from_board)
    np.testing.assert_allclose(rotation.T, R, atol=1e-9)
    np.testing.assert_allclose(position, C, atol=1e-9)
