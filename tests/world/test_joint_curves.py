"""Curved paths of robots between the frames of a video."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from support.raises import raises

JOINT = (
    '<joint name="{name}" type="revolute"><limit lower="-100" upper="100" effort="1" velocity="1"/>'
    '<parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 0 1"/></joint>'
)
ROD = '<visual><origin xyz="0.5 0 0"/><geometry><box size="1 0.1 0.1"/></geometry></visual>'
TOLERANCE = 1e-5


def two_rods(folder: Path) -> raycam.World:
    """A robot of two rods of one metre: `shoulder` turns about z, and `elbow` about y."""
    path = folder / "rods.urdf"
    joints = [
        JOINT.format(name="shoulder", parent="base", child="upper", xyz="0 0 1", rpy="0 0 0"),
        JOINT.format(name="elbow", parent="upper", child="lower", xyz="1 0 0", rpy="1.57079632679 0 0"),
    ]
    links = ['<link name="base"/>', *(f'<link name="{name}">{ROD}</link>' for name in ("upper", "lower"))]
    path.write_text(f'<robot name="rods">{"".join(links + joints)}</robot>', encoding="utf-8")
    return raycam.load(path)


def test_moving_links_stay_within_the_tolerance_of_their_exact_path(tmp_path: Path) -> None:
    world = two_rods(tmp_path)
    ends = {"shoulder": [0.0, 2.0], "elbow": [0.5, -2.5]}
    frames = [
        {"time": 0.4 * end, "robot": "rods", "joints": {name: ends[name][end] for name in ends}}
        for end in (0, 1)
    ]
    world.set_video(fps=5, keyframe=frames)
    robot, worst = world.robots["rods"], 0.0
    for time in np.linspace(0, 0.4, 97):
        joints = {name: np.interp(time, [0, 0.4], values) for name, values in ends.items()}
        moment = world.at(float(time))
        for number, link in enumerate(("upper", "lower")):
            matrix = robot.pose(link, joints)
            # The box's vertices, in closed form: half a metre along x from the box's centre.
            corners = np.array([[x, y, z, 1] for x in (0, 1) for y in (-0.05, 0.05) for z in (-0.05, 0.05)])
            exact = (corners @ matrix.T)[:, :3]
            shown = moment.triangles(number).reshape(-1, 3)
            worst = max(worst, np.abs(shown[:, None] - exact).max(axis=2).min(axis=1).max())
    assert worst <= TOLERANCE
    assert worst > 1e-8  # the times are between the keyframes


def test_joint_that_turns_several_times_per_frame_keeps_its_direction_and_speed(tmp_path: Path) -> None:
    world = two_rods(tmp_path)
    frames = [
        {"time": time, "robot": "rods", "joints": {"shoulder": angle}} for time, angle in ((0, -90), (1, 90))
    ]
    world.set_video(fps=10, keyframe=frames)
    world.to_gltf(tmp_path / "rods.glb")
    copy = raycam.load(tmp_path / "rods.glb", up="y")
    y_up_from_z_up = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    for time in (0.0125, 0.0313, 0.7871):
        expected = world.robots["rods"].pose("upper", {"shoulder": -90 + 180 * time})[:3, :3]
        np.testing.assert_allclose(world.at(time).objects[0].matrix[:3, :3], expected, atol=1e-9)
        np.testing.assert_allclose(
            copy.at(time).objects[0].matrix[:3, :3], y_up_from_z_up @ expected, atol=1e-4
        )


def test_path_with_too_many_keyframes_is_refused(tmp_path: Path) -> None:
    world = two_rods(tmp_path)
    frames = [{"time": time, "robot": "rods", "joints": {"elbow": 0.0}} for time in (0, 1)]
    with raises(raycam.WorldError, code="too_large", mentions=["rods"]):
        world.set_video(fps=3_000_000, keyframe=frames)
