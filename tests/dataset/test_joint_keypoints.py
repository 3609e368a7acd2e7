"""The option keypoints="joints" of COCO and YOLO data sets.

COCO files are read back by pycocotools.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
import yaml
from pycocotools.coco import COCO
from raycam.dataset import write
from support.raises import raises, warns

# pycocotools causes this warning.
pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")

ARM = """<robot name="arm">
  <link name="base"><visual><geometry><box size="0.3 0.3 0.1"/></geometry></visual></link>
  <link name="upper"><visual><origin xyz="0 0 0.25"/><geometry><box size="0.1 0.1 0.5"/></geometry></visual>
    <visual><origin xyz="0 0 0.1"/><geometry><sphere radius="0.1"/></geometry></visual></link>
  <link name="hand"><visual><origin xyz="0 0 0.1"/><geometry><box size="0.08 0.2 0.2"/></geometry></visual></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.05"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="10" velocity="1"/></joint>
  <joint name="wrist" type="continuous"><parent link="upper"/><child link="hand"/><origin xyz="0 0 0.5"/>
    <axis xyz="1 0 0"/></joint>
</robot>"""


@pytest.fixture
def world(tmp_path: Path) -> raycam.World:
    """An arm behind a board, which hides its wrist in the first view."""
    (tmp_path / "arm.urdf").write_text(ARM)
    world = raycam.World()
    arm = world.add_robot(tmp_path / "arm.urdf", category="robot")
    world.set_joints("arm", {"shoulder": 0.6})
    world.add_object(
        box={"size": [0.02, 0.3, 0.3]}, location=arm.pose("hand")[:3, 3] + [0.5, 0, 0], name="board"
    )
    return world


def test_joints_are_keypoints_of_the_whole_robot(tmp_path: Path, world: raycam.World) -> None:
    arm = world.robots["arm"]
    cameras = [
        raycam.Camera.look_at(
            eye, [0.1, 0, 0.3], [0, 0, 1], size=(160, 120), fov=40, distortion=[-0.1, 0.02, 0, 0]
        )
        for eye in ([3, 0, 0.4], [0.2, 3, 0.4])
    ]
    write(world, tmp_path / "set", "coco", cameras=cameras, keypoints="joints", samples=1)
    coco = COCO(str(tmp_path / "set/annotations/instances.json"))
    (category,) = coco.loadCats(coco.getCatIds())
    assert (category["name"], category["keypoints"], category["skeleton"]) == (
        "arm",
        ["shoulder", "wrist"],
        [[1, 2]],
    )
    parts = [item.id for item in world.objects if item.category == "arm"]
    assert len(parts) == 4
    for number, (camera, flags) in enumerate(zip(cameras, ([2, 1], [2, 2]), strict=True), start=1):
        (one,) = coco.loadAnns(coco.getAnnIds(imgIds=number))
        instance = raycam.render(world, camera, channels=["instance"])["instance"]
        np.testing.assert_array_equal(coco.annToMask(one), np.isin(instance, parts))
        expected = camera.project([arm.pose(link)[:3, 3] for link in ("upper", "hand")])[0]
        found = np.reshape(one["keypoints"], (2, 3))
        np.testing.assert_allclose(found[:, :2], expected + 0.5, atol=1e-6)
        assert found[:, 2].tolist() == flags
        assert one["object"] == "arm"


def test_joints_are_keypoints_of_yolo_labels(tmp_path: Path, world: raycam.World) -> None:
    arm = world.robots["arm"]
    short = (
        (tmp_path / "arm.urdf")
        .read_text()
        .replace('"continuous"', '"fixed"')
        .replace('name="arm"', 'name="stub"')
    )
    (tmp_path / "stub.urdf").write_text(short)
    stub = world.add_robot(tmp_path / "stub.urdf", category="robot", location=[0, 1, 0])
    world.add_object(sphere={"radius": 0.1}, location=[0, -0.6, 0.2], name="ball", category="ball")
    camera = raycam.Camera.look_at([3, 0.3, 0.4], [0.1, 0.3, 0.3], [0, 0, 1], size=(160, 120), fov=40)
    with warns(raycam.Notice, code="ignored_element", mentions=["ball"]):
        write(world, tmp_path / "set", "yolo", cameras=[camera], keypoints="joints", task="pose", samples=1)
    about = yaml.safe_load((tmp_path / "set/data.yaml").read_text())
    assert about["kpt_shape"] == [2, 3]
    assert about["names"] == {0: "arm", 1: "stub"}
    assert about["kpt_names"] == {0: ["shoulder", "wrist"], 1: ["shoulder", "unused_1"]}
    (file,) = (tmp_path / "set/labels").rglob("*.txt")
    rows = {int(row[0]): np.array(row[1:], float) for row in map(str.split, file.read_text().splitlines())}
    assert {number: len(row) for number, row in rows.items()} == {0: 4 + 2 * 3, 1: 4 + 2 * 3}
    instance = raycam.render(world, camera, channels=["instance"])["instance"]
    for number, (robot, flags) in enumerate([(arm, [2, 1]), (stub, [2, 0])]):
        shown = np.isin(instance, [item.id for item in world.objects if item.category == robot.name])
        y, x = np.nonzero(shown)
        low, high = np.array([x.min(), y.min()]), np.array([x.max(), y.max()]) + 1
        box = np.concatenate([(low + high) / 2, high - low]) / [160, 120, 160, 120]
        np.testing.assert_allclose(rows[number][:4], box, atol=1e-8)
        found = rows[number][4:].reshape(2, 3)
        joints = [robot.pose(link)[:3, 3] for link in ("upper", "hand")]
        expected = (camera.project(joints)[0] + 0.5) / [160, 120]
        count = sum(flag > 0 for flag in flags)
        np.testing.assert_allclose(found[:count, :2], expected[:count], atol=1e-8)
        assert found[:, 2].tolist() == flags
    assert not rows[1][7:].any()


def test_joints_require_a_robot_as_category_and_a_format_with_keypoints(
    tmp_path: Path, world: raycam.World
) -> None:
    camera = world.view_from("iso", size=(80, 60))
    with raises(raycam.SettingsError, code="missing_value", mentions=['category="robot"']):
        write(
            raycam.load(tmp_path / "arm.urdf"), tmp_path / "a", "coco", cameras=[camera], keypoints="joints"
        )
    with raises(raycam.SettingsError, code="unknown_key", mentions=["keypoints"]):
        write(world, tmp_path / "b", "bop", cameras=[camera], keypoints="joints")


@pytest.mark.parametrize(
    ("objects", "code"),
    [(["arm/base"], "wrong_shape"), (["arm/base", "arm/bse"], "unknown_name"), (7, "wrong_shape")],
)
def test_objects_of_keypoints_are_checked(
    tmp_path: Path, world: raycam.World, objects: object, code: str
) -> None:
    points = {"names": ["a", "b"], "points": [[0, 0, 0], [0, 0, 1]], "objects": objects}
    camera = world.view_from("iso", size=(80, 60))
    with raises(raycam.SettingsError, code=code, mentions=["arm"]):
        write(world, tmp_path / "set", "coco", cameras=[camera], keypoints={"arm": points})
