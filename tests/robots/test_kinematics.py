"""Poses and Jacobians of links, compared with yourdfpy, differences and closed forms."""

from __future__ import annotations

import io
import logging

import numpy as np
import pytest
import yourdfpy
from raycam.robots import Robot
from raycam.robots.urdf import read_urdf
from robots.conftest import random_robot


def robot_of(text: str) -> Robot:
    return Robot.at_zero("r", read_urdf(text.encode(), "r.urdf"), np.eye(4))


@pytest.mark.parametrize("seed", range(12))
def test_poses_agree_with_yourdfpy(seed: int) -> None:
    logging.disable(logging.CRITICAL)
    text = random_robot(seed)
    robot = robot_of(text)
    judge = yourdfpy.URDF.load(io.BytesIO(text.encode()), load_meshes=False, build_scene_graph=True)
    rng = np.random.default_rng(seed)
    for _ in range(5):
        q = rng.uniform(-6, 6, len(robot.joints))
        judge.update_cfg(dict(zip(robot.joints, q, strict=True)))
        for link in robot.links:
            expected = judge.get_transform(link, judge.base_link)
            np.testing.assert_allclose(robot.pose(link, q), expected, rtol=0, atol=2e-12)


def one_joint(kind: str, axis: str = "0 0 1") -> Robot:
    return robot_of(
        f'<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="{kind}"><parent link="a"/>'
        f'<child link="b"/><origin xyz="1 2 3"/><axis xyz="{axis}"/></joint></robot>'
    )


def test_planar_joint_moves_in_the_plane_of_its_normal() -> None:
    pose = one_joint("planar").pose("b", {"j": [0.5, -0.25, np.pi / 2]})
    np.testing.assert_allclose(
        pose, [[0, -1, 0, 1.5], [1, 0, 0, 1.75], [0, 0, 1, 3], [0, 0, 0, 1]], atol=1e-15
    )


def test_floating_joint_accepts_numbers_or_a_matrix() -> None:
    robot = one_joint("floating")
    half = np.sqrt(0.5)
    pose = robot.pose("b", {"j": [0.1, 0.2, 0.3, 0, 0, 2 * half, 2 * half]})
    expected = [[0, -1, 0, 1.1], [1, 0, 0, 2.2], [0, 0, 1, 3.3], [0, 0, 0, 1]]
    np.testing.assert_allclose(pose, expected, atol=1e-15)
    matrix = np.array(expected) - [[0, 0, 0, 1], [0, 0, 0, 2], [0, 0, 0, 3], [0, 0, 0, 0]]
    np.testing.assert_allclose(robot.pose("b", {"j": matrix}), expected, atol=1e-15)


@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, -2, 3]])
@pytest.mark.parametrize("angle", [0.3, 3.0, np.pi, -3.1])
def test_matrices_of_floating_joints_are_restored(axis: list[float], angle: float) -> None:
    rotation = one_joint("revolute", " ".join(map(str, axis))).pose("b", {"j": angle})[:3, :3]
    robot = one_joint("floating")
    given = np.eye(4)
    given[:3, :3] = rotation
    np.testing.assert_allclose(robot.pose("b", {"j": given})[:3, :3], rotation, atol=4e-15)


def test_many_joint_vectors_give_many_poses() -> None:
    robot = robot_of(random_robot(3))
    q = np.random.default_rng(0).uniform(-1, 1, (7, len(robot.joints)))
    poses = robot.pose(robot.links[-1], q)
    assert poses.shape == (7, 4, 4)
    for row, pose in zip(q, poses, strict=True):
        np.testing.assert_allclose(robot.pose(robot.links[-1], row), pose, atol=1e-15)


@pytest.mark.parametrize("seed", range(5))
def test_jacobian_is_the_derivative_of_the_pose(seed: int) -> None:
    robot = robot_of(random_robot(seed))
    rng = np.random.default_rng(seed)
    robot.world_from_root = robot_of(random_robot(seed)).pose("l3", rng.uniform(-1, 1, len(robot.joints)))
    q, step = rng.uniform(-1, 1, len(robot.joints)), 1e-6
    for link in robot.links:
        jacobian = robot.jacobian(link, q)
        assert jacobian.shape == (6, len(q))
        for column in range(len(q)):
            move = np.eye(len(q))[column] * step
            ahead, behind = robot.pose(link, q + move), robot.pose(link, q - move)
            turn = (ahead[:3, :3] - behind[:3, :3]) / (2 * step) @ robot.pose(link, q)[:3, :3].T
            numeric = [*(ahead[:3, 3] - behind[:3, 3]) / (2 * step), turn[2, 1], turn[0, 2], turn[1, 0]]
            np.testing.assert_allclose(jacobian[:, column], numeric, atol=1e-7)


def test_jacobians_of_planar_and_floating_joints_equal_closed_forms() -> None:
    planar = one_joint("planar").jacobian("b", [0.5, 0.25, 1.0])
    np.testing.assert_allclose(planar, np.eye(6)[:, [0, 1, 5]], atol=1e-15)
    floating = one_joint("floating").jacobian("b", [0.5, 0.25, 1.0, 0, 0, 0, 1])
    np.testing.assert_allclose(floating, np.eye(6), atol=1e-15)


@pytest.mark.parametrize("seed", range(4))
def test_pose_of_one_link_equals_its_pose_among_all_links(seed: int) -> None:
    robot = robot_of(random_robot(seed))
    q = np.random.default_rng(seed).uniform(-3, 3, (3, len(robot.joints)))
    for link, expected in robot._kinematics.poses(q).items():
        np.testing.assert_array_equal(robot.pose(link, q), robot.world_from_root @ expected)


@pytest.mark.parametrize("kind", ["floating", "planar", "revolute", "prismatic"])
def test_steps_along_columns_of_the_jacobian_move_the_link_accordingly(kind: str) -> None:
    robot, step = one_joint(kind), 1e-6
    kinematics = robot._kinematics
    values = np.array([0.3, -0.2, 0.5, 0.4, -0.3, 0.2, 0.8])[: kinematics.size]
    jacobian = robot.jacobian("b", values)
    for column in range(jacobian.shape[1]):
        change = step * np.eye(jacobian.shape[1])[column]
        before, after = (robot.pose("b", kinematics.advance(values, sign * change)) for sign in (-1, 1))
        turn = (after[:3, :3] @ before[:3, :3].T - np.eye(3)) / (2 * step)
        found = [*(after[:3, 3] - before[:3, 3]) / (2 * step), turn[2, 1], turn[0, 2], turn[1, 0]]
        np.testing.assert_allclose(found, jacobian[:, column], atol=1e-5)
    assert kinematics.velocity_joints == ["j"] * jacobian.shape[1]
