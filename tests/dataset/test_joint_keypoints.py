"""The option keypoints="joints" of COCO data sets, read back by pycocotools."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from pycocotools.coco import COCO
from raycam.dataset import write
from support.raises import raises

pytestmark = pytest.mark.filterwarnings(
    "ignore:__array__ implementation:DeprecationWarning"
)  # of pycocotools

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


def test_joints_require_a_robot_as_category_and_coco(tmp_path: Path, world: raycam.World) -> None:
    camera = world.view_from("iso", size=(80, 60))
    with raises(raycam.SettingsError, code="missing_value", mentions=['category="robot"']):
        write(
            raycam.load(tmp_path / "arm.urdf"), tmp_path / "a", "coco", cameras=[camera], keypoints="joints"
        )
    with raises(raycam.SettingsError, code="unsupported_feature", mentions=["coco"]):
        write(world, tmp_path / "b", "yolo", cameras=[camera], keypoints="joints", task="pose")


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
