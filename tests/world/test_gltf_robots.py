"""Robots in GLB files, read by trimesh and by raycam."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
import trimesh
from support.raises import notice_codes
from world.test_robot_tables import VIDEO, WORLD, write

Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


def document(path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    assert struct.unpack("<I", data[8:12])[0] == len(data)
    found: dict[str, Any] = json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])
    return found


def children(nodes: list[dict[str, Any]], name: str) -> set[str]:
    (node,) = (node for node in nodes if node.get("name") == name)
    return {nodes[child]["name"] for child in node.get("children", [])}


def test_links_are_nodes_at_their_poses(tmp_path: Path) -> None:
    world = raycam.load(write(tmp_path, WORLD))
    world.remove_object("arm/base")
    world.to_gltf(tmp_path / "room.glb")
    nodes = document(tmp_path / "room.glb")["nodes"]
    assert {"left", "arm", "plane"} <= children(nodes, "y up")
    left = next(node for node in nodes if node["name"] == "left")
    base = nodes[left["children"][0]]
    assert base["name"] == "base"
    assert {nodes[child]["name"] for child in base["children"]} == {"left/base", "upper"}
    scene = trimesh.load(tmp_path / "room.glb")
    # trimesh appends a number to the second of two nodes with equal names.
    for link in ("base", "upper", "slide", "finger"):
        found = scene.graph[link][0]
        np.testing.assert_allclose(found, Y_UP @ world.robots["left"].pose(link), atol=1e-12)
    read = raycam.load(tmp_path / "room.glb", up="y")
    matrices = {item.name: item.matrix for item in read.objects}
    for item in world.objects:
        np.testing.assert_allclose(matrices[item.name], Y_UP @ item.matrix, atol=1e-7)
    np.testing.assert_allclose(
        read.camera("left/wrist").C, Y_UP[:3, :3] @ world.camera("left/wrist").C, atol=1e-12
    )


def test_joint_keyframes_become_an_animation(tmp_path: Path) -> None:
    world = raycam.load(write(tmp_path, WORLD + VIDEO))
    notices = world.to_gltf(tmp_path / "room.glb")
    # Only categories and a camera's size are not written; the video becomes an animation.
    assert notice_codes(notices).count("not_written") == 2
    moving = world.copy()
    moving.set_video(orbit={"target": [0, 0, 0]})
    assert notice_codes(moving.to_gltf(tmp_path / "orbit.glb")).count("not_written") == 3
    assert "animations" not in document(tmp_path / "orbit.glb")
    nodes, (animation,) = (document(tmp_path / "room.glb")[key] for key in ("nodes", "animations"))
    assert animation["name"] == "joints"
    moved = [
        (nodes[each["target"]["node"]]["name"], each["target"]["path"]) for each in animation["channels"]
    ]
    assert moved == [("upper", "rotation")]
    read = raycam.load(tmp_path / "room.glb", up="y")
    for time in (0.0, 0.3, 1.0):
        matrices = {item.name: item.matrix for item in read.at(time).objects}
        for item in world.at(time).objects:
            np.testing.assert_allclose(matrices[item.name], Y_UP @ item.matrix, atol=2e-6)
        expected = Y_UP[:3, :3] @ world.at(time).camera("left/wrist").C
        np.testing.assert_allclose(read.at(time).camera("left/wrist").C, expected, atol=2e-6)


@pytest.mark.parametrize("scale", ["1 -2 3", "1 1 1"])
def test_mirrored_meshes_and_moved_objects_keep_their_place(tmp_path: Path, scale: str) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", encoding="utf-8")
    (tmp_path / "r.urdf").write_text(
        f'<robot name="r"><link name="a"><visual><geometry><mesh filename="a.obj" scale="{scale}"/></geometry></visual>'
        "</link></robot>",
        encoding="utf-8",
    )
    world = raycam.World()
    world.add_robot(tmp_path / "r.urdf", location=[1, 2, 3], yaw=40)
    before = world.triangles()
    world.to_gltf(tmp_path / "r.glb")
    np.testing.assert_allclose(
        raycam.load(tmp_path / "r.glb", up="z").triangles(), before @ Y_UP[:3, :3].T, atol=1e-6
    )
    shear = [[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5]]
    world.set_object("r/a", matrix=shear)
    world.to_gltf(tmp_path / "r.glb")
    moved = raycam.load(tmp_path / "r.glb", up="z").triangles()
    np.testing.assert_allclose(moved, world.triangles() @ Y_UP[:3, :3].T, atol=1e-6)
