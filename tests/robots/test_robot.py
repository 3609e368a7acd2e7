"""Robots of worlds: objects, joints, limits and names."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest
import raycam
from support.raises import Fault, fault, raises, warns


def test_robot_becomes_objects_with_names_and_categories(arm: Path) -> None:
    world = raycam.load(arm)
    assert [item.name for item in world.objects] == ["arm/base", "arm/upper", "arm/upper/2", "arm/slide"]
    assert [item.category for item in world.objects] == ["base", "upper", "upper", "slide"]
    robot = world.robots["arm"]
    assert robot.joints == ("turn", "push")
    assert robot.links == ("base", "upper", "slide", "finger")
    assert robot.limits == {"turn": (-1, 2), "push": (0.05, 0.3)}
    np.testing.assert_array_equal(robot.values, [0, 0.05])


def test_objects_follow_the_links(arm: Path) -> None:
    world = raycam.World()
    robot = world.add_robot(arm, location=[1, 2, 3], yaw=30, joints={"push": 0.1}, category="robot")
    for joints in ([0.3, 0.2], {"turn": 1.5}):
        world.set_joints("arm", joints)
        boxes = {item.name: item for item in world.objects}
        shift = np.eye(4)
        shift[2, 3] = 0.25
        np.testing.assert_allclose(boxes["arm/upper"].matrix, robot.pose("upper") @ shift, atol=1e-15)
        np.testing.assert_allclose(boxes["arm/slide"].matrix, robot.pose("slide"), atol=1e-15)
    assert {item.category for item in world.objects} == {"arm"}
    np.testing.assert_array_equal(robot.values, [1.5, 0.2])
    np.testing.assert_allclose(
        robot.pose("finger")[:3, 3], robot.pose("slide") @ [0.1 - 0.4, 0, 0, 1] @ np.eye(4, 3)
    )


def test_root_pose_is_the_pose_of_an_object(arm: Path) -> None:
    world = raycam.World("y")
    robot = world.add_robot(arm, location=[1, 2, 3], roll=10, pitch=20, yaw=30)
    box = world.add_object(box=1.0, location=[1, 2, 3], roll=10, pitch=20, yaw=30)
    upright = [[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]]
    np.testing.assert_allclose(robot.pose("base"), world.objects[box].matrix @ upright, atol=1e-15)
    with raises(raycam.WorldError, code="not_a_rotation"):
        world.add_robot(arm, name="b", matrix=np.diag([2.0, 2, 2, 1]))


def test_collision_shapes_are_shown_on_request(arm: Path) -> None:
    world = raycam.World()
    world.add_robot(arm, geometry="collision")
    (item,) = world.objects
    low, high = world.triangles(0).reshape(-1, 3).min(0), world.triangles(0).reshape(-1, 3).max(0)
    assert item.name == "arm/upper"
    local = world.triangles(0).reshape(-1, 3) - item.matrix[:3, 3]
    radii = np.linalg.norm(
        local @ item.matrix[:3, :3] - [[0, 0, 1]] * np.clip(local @ item.matrix[:3, 2:3], -0.25, 0.25), axis=1
    )
    np.testing.assert_allclose(radii, 0.08, atol=1e-12)
    assert (high > low).all()
    assert world.topology(0).closed


def test_colours_are_srgb(arm: Path) -> None:
    world = raycam.load(arm)
    number = next(item.id for item in world.objects if item.name == "arm/upper")
    colors = world.triangle_colors()[world.triangle_ids()[:, 0] == number]
    np.testing.assert_allclose(colors[0], [1, ((0.5 + 0.055) / 1.055) ** 2.4, 0], atol=1e-6)


FAULTS = [
    ({"trun": 1.0}, fault("unknown_name", "'trun'", "'turn'")),
    ({"follow": 1.0}, fault("unknown_name", "'follow'", "'push'")),
    ([1.0], fault("wrong_shape", "[2]", "[1]", "turn, push")),
    ([1.0, 2.0, 3.0], fault("wrong_shape", "turn, push")),
    ({"turn": [1.0, 2.0]}, fault("wrong_shape", "2")),
    ({"turn": "a"}, fault("wrong_type", "turn")),
    ({"turn": np.nan}, fault("out_of_range", "turn")),
]


@pytest.mark.parametrize(("joints", "expected"), FAULTS)
def test_wrong_joints_raise_and_change_nothing(arm: Path, joints: object, expected: Fault) -> None:
    world = raycam.load(arm)
    before = world.to_bytes()
    with raises(raycam.WorldError, **expected):
        world.set_joints("arm", joints)  # type: ignore[arg-type]
    assert world.to_bytes() == before
    with raises(raycam.WorldError, code="unknown_name", mentions=["'arn'", "'arm'"]):
        world.set_joints("arn", [0, 0])
    with raises(raycam.WorldError, code="unknown_name", mentions=["'uper'"]):
        world.robots["arm"].pose("uper")


def test_values_beyond_limits_are_used_with_one_notice_or_clamped(arm: Path) -> None:
    world = raycam.load(arm)
    with warns(raycam.Notice, code="outside_limits", mentions=["2.5", "-1", "0.5"]) as found:
        world.set_joints("arm", [2.5, 0.5])
    assert len(found) == 1
    np.testing.assert_array_equal(world.robots["arm"].values, [2.5, 0.5])
    with raycam.strict():
        world.set_joints("arm", [2.5, -0.5], clamp_joints=True)
    np.testing.assert_array_equal(world.robots["arm"].values, [2, 0.05])


def test_joint_values_in_degrees_give_a_notice(arm: Path) -> None:
    world = raycam.load(arm)
    with warns(raycam.Notice, code="implausible"):
        world.set_joints("arm", {"turn": 45.0})


def test_copies_and_pickles_have_independent_robots(arm: Path) -> None:
    world = raycam.load(arm)
    for other in (copy.copy(world), pickle.loads(pickle.dumps(world)), world.at(0.0)):
        other.set_joints("arm", {"turn": 1.0})
        assert other.robots["arm"].values[0] == 1.0
        assert world.robots["arm"].values[0] == 0.0
        assert other.objects[1].matrix[0, 0] != world.objects[1].matrix[0, 0]


def test_removed_robot_objects_stay_removed(arm: Path) -> None:
    world = raycam.load(arm)
    world.remove_object("arm/upper")
    world.set_joints("arm", {"turn": 1.0})
    assert len(world.objects) == 3


def test_robot_object_names_are_unique(arm: Path) -> None:
    world = raycam.load(arm)
    with raises(raycam.WorldError, code="duplicate_name", mentions=["'arm'"]):
        world.add_robot(arm)
    world.add_robot(arm, name="left", location=[1, 0, 0])
    assert list(world.robots) == ["arm", "left"]
    assert len(world.objects) == 8


def test_render_many_with_joints_equals_single_images(arm: Path) -> None:
    world = raycam.load(arm)
    camera = world.view_from(size=(40, 30))
    q = np.array([[0.2, 0.1], [1.0, 0.2]])
    frames = raycam.render_many(world, camera, joints={"arm": q}, channels=["color", "depth", "instance"])
    for number, row in enumerate(q):
        world.set_joints("arm", row)
        alone = raycam.render(world, camera, channels=["color", "depth", "instance"], frame=number)
        for name in ("color", "depth", "instance"):
            np.testing.assert_array_equal(frames[number][name], alone[name])
    with raises(raycam.SettingsError, code="conflicting_values", mentions=["arm/upper"]):
        raycam.render_many(world, camera, joints={"arm": q}, poses={"arm/upper": np.eye(4)})
