"""Joints as points of a robot's objects, compared with MuJoCo's anchors and with yourdfpy."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import raycam
import yourdfpy
from raycam.robots import joint_points
from support.raises import has_notice

pytestmark = pytest.mark.filterwarnings("ignore::raycam.Notice")

MJCF = """<mujoco model="arm"><compiler angle="degree"/><worldbody>
  <body name="base" pos="0 0 .3" euler="0 0 20"><freejoint name="float"/><geom size=".1" pos=".05 0 0"/>
    <body name="upper" pos=".1 0 .1" euler="10 20 30"><joint name="pitch" axis="0 1 .2" pos="0 .05 0" ref="15"/>
      <joint name="yaw" axis="0 0 1" pos=".02 0 0"/><geom type="box" size=".2 .05 .05" pos=".2 0 0" euler="0 20 0"/>
      <body name="bare" pos=".4 0 0"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        <joint name="ball" type="ball" pos=".01 0 .02"/>
        <body name="tip" pos="0 .1 0"><joint name="slide" type="slide" axis="0 1 0"/><geom size=".02"/></body>
      </body></body></body></worldbody></mujoco>"""
URDF = """<robot name="r">
  <link name="base"><visual><geometry><box size="0.1 0.2 0.3"/></geometry></visual></link>
  <link name="flange"/><link name="tool"/><link name="finger"><visual><origin xyz="0 0 .1" rpy="1 0 0"/>
    <geometry><cylinder radius="0.02" length="0.1"/></geometry></visual></link><link name="free"/>
  <joint name="turn" type="revolute"><parent link="base"/><child link="flange"/><origin xyz=".1 0 .3" rpy="0 .4 0"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="fixed" type="fixed"><parent link="flange"/><child link="tool"/><origin xyz="0 .1 0" rpy=".2 0 0"/>
    </joint>
  <joint name="spin" type="continuous"><parent link="tool"/><child link="finger"/><origin xyz="0 0 .2"/>
    <axis xyz="1 0 0"/></joint>
  <joint name="pull" type="prismatic"><parent link="tool"/><child link="free"/><origin xyz="0 0 .1"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>"""


def positions(world: raycam.World, robot: raycam.Robot) -> dict[str, np.ndarray]:
    """The points of the joints in the world."""
    matrices = {item.name: item.matrix for item in world.objects}
    points, _ = joint_points(robot, matrices)
    return {each.joint: (matrices[each.objects[0]] @ [*each.point, 1.0])[:3] for each in points}


def test_joint_points_equal_mujocos_joint_anchors(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(MJCF)
    world = raycam.load(path)
    robot = world.robots["arm"]
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    values = {
        "float": [1, 2, 3, 0, 0, 0.6, 0.8],
        "pitch": 0.5,
        "yaw": -0.7,
        "ball": [0, 0.6, 0, 0.8],
        "slide": 0.1,
    }
    for state in ({}, values):
        world.set_joints("arm", state)
        if state:
            data.qpos[:] = [1, 2, 3, 0.8, 0, 0, 0.6, 0.5, -0.7, 0.8, 0, 0.6, 0, 0.1]
        mujoco.mj_kinematics(model, data)
        found = positions(world, robot)
        assert list(found) == ["float", "pitch", "yaw", "ball", "slide"]
        for name, place in found.items():
            expected = data.xanchor[model.joint(name).id]
            # MuJoCo's anchor does not move with the joint, but this point moves with the link.
            if name == "slide":
                expected = expected + data.xaxis[model.joint(name).id] * float(state.get("slide", 0.0))
            np.testing.assert_allclose(place, expected, atol=1e-12, err_msg=name)


def test_points_of_links_without_shapes_move_with_neighbours(tmp_path: Path) -> None:
    path = tmp_path / "r.urdf"
    path.write_text(URDF)
    world = raycam.load(path)
    robot = world.robots["r"]
    judge = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=True)
    world.set_joints("r", {"turn": 0.7, "spin": 1.1})
    judge.update_cfg({"turn": 0.7, "spin": 1.1, "pull": 0.0})
    found = positions(world, robot)
    for name, link in (("turn", "flange"), ("spin", "finger")):
        np.testing.assert_allclose(found[name], judge.get_transform(link, "base")[:3, 3], atol=1e-9)
    points, notices = joint_points(robot, robot.objects)
    assert {each.joint: (each.objects, each.parent) for each in points} == {
        "turn": (["r/base"], None),
        "spin": (["r/finger"], "turn"),
    }
    assert has_notice(notices, "ignored_element", "'pull'")
