"""Robots in MCAP bags, read by the decoder of the mcap project and compared with yourdfpy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from dataset.test_mcap_lidars import decoded, matrix
from raycam.dataset import write
from raycam.robots import read_joint_states
from support.raises import warns

URDF = """<robot name="arm">
  <link name="base"><visual><geometry><box size="0.2 0.2 0.1"/></geometry></visual></link>
  <link name="plate"/>
  <link name="upper"><visual><geometry><box size="0.1 0.1 0.5"/></geometry></visual></link>
  <link name="finger"/>
  <joint name="mount" type="fixed">
    <parent link="base"/><child link="plate"/><origin xyz="0 0 0.1" rpy="0.1 0.2 0.3"/>
  </joint>
  <joint name="turn" type="revolute">
    <parent link="plate"/><child link="upper"/><origin xyz="0.3 0 0" rpy="0 0 1"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="follow" type="prismatic">
    <parent link="upper"/><child link="finger"/><axis xyz="1 0 0"/><mimic joint="turn" multiplier="-2" offset="0.1"/>
    <limit lower="-9" upper="9" effort="1" velocity="1"/>
  </joint>
</robot>"""


def cell(folder: Path, robots: tuple[str, ...] = ("arm",), text: str = URDF) -> raycam.World:
    """A world with robots on pedestals, moved by a video of 1 second."""
    (folder / "arm.urdf").write_text(text, encoding="utf-8")
    world = raycam.World()
    for number, name in enumerate(robots):
        world.add_robot(folder / "arm.urdf", name=name, location=[2 * number, 0, 0.7], yaw=30)
    frames = [{"time": time, "robot": robots[0], "joints": {"turn": time}} for time in (0, 1)]
    world.set_video(fps=2, keyframe=frames)
    return world


def view(world: raycam.World, **options: Any) -> list[raycam.Camera]:
    return [world.view_from("front", size=(8, 6)), world.view_from("iso", size=(8, 6))]


def pose_of(tree: dict[str, tuple[str, Any]], frame: str) -> Any:
    """The pose world_from_frame [4, 4] of a frame."""
    found = np.eye(4)
    while frame != "world":
        frame, parent_from_frame = tree[frame]
        found = parent_from_frame @ found
    return found


def test_bag_contains_description_joints_and_link_poses(tmp_path: Path) -> None:
    pytest.importorskip("mcap_ros2")
    yourdfpy = pytest.importorskip("yourdfpy")
    world = cell(tmp_path)
    write(world, tmp_path / "bag", "mcap", cameras=view(world), times=[0.25, 1.0], samples=1)
    write(world, tmp_path / "two", "mcap", cameras=view(world), times=[0.25, 1.0], samples=1, workers=2)
    bag = tmp_path / "bag" / "raycam.mcap"
    assert bag.read_bytes() == (tmp_path / "two" / "raycam.mcap").read_bytes()
    found = decoded(bag)
    (description,) = found["/robot_description"]
    assert description.data == URDF
    assert [list(state.name) for state in found["/joint_states"]] == [["turn", "follow"]] * 2
    np.testing.assert_allclose(
        [list(state.position) for state in found["/joint_states"]], [[0.25, -0.4], [1, -1.9]]
    )
    fixed = {
        row.child_frame_id: (row.header.frame_id, matrix(row)) for row in found["/tf_static"][0].transforms
    }
    assert set(fixed) == {"base", "plate"}
    links = [message for message in found["/tf"] if message.transforms[0].child_frame_id != "camera_optical"]
    other = yourdfpy.URDF.load(str(tmp_path / "arm.urdf"), build_scene_graph=True, load_meshes=False)
    for message, turn in zip(links, (0.25, 1.0), strict=True):
        rows = message.transforms
        stamp = rows[0].header.stamp
        assert stamp.sec + 1e-9 * stamp.nanosec == 1 + turn
        tree = fixed | {row.child_frame_id: (row.header.frame_id, matrix(row)) for row in rows}
        other.update_cfg({"turn": turn})
        for link in ("plate", "upper", "finger"):
            expected = world.robots["arm"].world_from_root @ other.get_transform(link, "base")
            np.testing.assert_allclose(pose_of(tree, link), expected, atol=1e-12)
    tracks = read_joint_states(bag)
    np.testing.assert_allclose(tracks["turn"].positions, [0.25, 1.0])
    assert (
        "durability: 1"
        in (tmp_path / "bag" / "metadata.yaml").read_text().split("/robot_description")[1][:300]
    )


def test_several_robots_have_topics_and_frames_of_their_own(tmp_path: Path) -> None:
    pytest.importorskip("mcap_ros2")
    world = cell(tmp_path, ("left", "1 right"))
    write(world, tmp_path / "bag", "mcap", cameras=view(world), samples=1)
    found = decoded(tmp_path / "bag" / "raycam.mcap")
    robots = {topic for topic in found if "camera" not in topic and "instance" not in topic}
    assert robots == {
        "/tf",
        "/tf_static",
        *(
            f"/{name}/{topic}"
            for name in ("left", "_1_right")
            for topic in ("robot_description", "joint_states")
        ),
    }
    roots = [row.child_frame_id for message in found["/tf_static"] for row in message.transforms]
    assert roots == ["left/base", "left/plate", "1 right/base", "1 right/plate"]


@pytest.mark.parametrize(
    ("root", "location", "expected"),
    [
        ("world", [0, 0, 0], []),
        ("world", [0, 0, 1], ["arm/world"]),
        ("camera_optical", [0, 0, 0], ["arm/camera_optical"]),
    ],
)
def test_link_frames_have_a_prefix_if_another_frame_has_the_name(
    tmp_path: Path, root: str, location: list[float], expected: list[str]
) -> None:
    pytest.importorskip("mcap_ros2")
    (tmp_path / "arm.urdf").write_text(URDF.replace('"base"', f'"{root}"'), encoding="utf-8")
    world = raycam.World()
    world.add_robot(tmp_path / "arm.urdf", location=location)
    write(world, tmp_path / "bag", "mcap", cameras=view(world), samples=1)
    found = decoded(tmp_path / "bag" / "raycam.mcap")
    rows = [row for message in found["/tf_static"] for row in message.transforms]
    assert [row.child_frame_id for row in rows if row.header.frame_id == "world"][
        : len(expected) or None
    ] == (expected or ["plate"])


def test_robot_without_urdf_has_poses_and_a_notice(tmp_path: Path) -> None:
    pytest.importorskip("mcap_ros2")
    (tmp_path / "model.sdf").write_text(
        '<sdf version="1.9"><model name="m"><link name="body"><visual name="v"><geometry><box><size>1 1 1</size></box>'
        "</geometry></visual></link></model></sdf>",
        encoding="utf-8",
    )
    world = raycam.load(tmp_path / "model.sdf")
    with warns(raycam.Notice, code="not_written", mentions=["model.sdf"]):
        write(world, tmp_path / "bag", "mcap", cameras=view(world)[:1], samples=1)
    found = decoded(tmp_path / "bag" / "raycam.mcap")
    assert "/robot_description" not in found
    assert [row.child_frame_id for row in found["/tf_static"][0].transforms] == ["__model__", "body"]
