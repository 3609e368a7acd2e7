"""Robots in world files: tables, cameras and keyframes of joints."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from robots.conftest import ARM
from support.raises import fault, raises

WORLD = """up = "z"
[[object]]
plane = { size = [4, 4] }
[[robot]]
file = "arm.urdf"
name = "left"
location = [0, 0, 0.5]
joints = { turn = 0.5 }
[[robot.camera]]
name = "wrist"
link = "slide"
size = [64, 48]
fov = 60
C = [0, 0, 0.4]
[[robot]]
file = "arm.urdf"
"""
VIDEO = """
[video]
fps = 10
[[video.keyframe]]
time = 0
robot = "left"
joints = { turn = 0.0 }
[[video.keyframe]]
time = 1
robot = "left"
joints = { turn = 1.5 }
"""


def write(folder: Path, text: str) -> Path:
    (folder / "arm.urdf").write_text(ARM, encoding="utf-8")
    path = folder / "room.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_world_file_has_robots_and_their_cameras(tmp_path: Path) -> None:
    world = raycam.load(write(tmp_path, WORLD))
    left = world.robots["left"]
    assert list(world.robots) == ["left", "arm"]
    np.testing.assert_array_equal(left.values, [0.5, 0.05])
    assert left.pose("base")[2, 3] == 0.5
    for turn in (0.5, -0.5):
        world.set_joints("left", {"turn": turn})
        expected = left.pose("slide") @ [0, 0, 0.4, 1]
        np.testing.assert_allclose(world.camera("left/wrist").C, expected[:3], atol=1e-15)
    frames = raycam.render_many(
        world, "left/wrist", joints={"left": {"turn": [0.1, 0.2]}}, channels=["depth"]
    )
    np.testing.assert_allclose(frames[1].camera.C, (left.pose("slide", {"turn": 0.2}) @ [0, 0, 0.4, 1])[:3])


def test_joint_keyframes_follow_the_curve_at_frames_and_between(tmp_path: Path) -> None:
    world = raycam.load(write(tmp_path, WORLD + VIDEO))
    assert (world.video.fps, world.video.seconds) == (10, 1)
    number = next(item.id for item in world.objects if item.name == "left/slide")
    for time in (0, 0.1, 0.7, 1.0, 2.0):
        expected = world.robots["left"].pose("slide", {"turn": 1.5 * min(time, 1)})
        np.testing.assert_allclose(world.at(time).objects[number].matrix, expected, atol=1e-14)
    between = world.robots["left"].pose("slide", {"turn": 1.5 * 0.333})
    np.testing.assert_allclose(world.at(0.333).objects[number].matrix, between, atol=1e-5)
    still = next(item.id for item in world.objects if item.name == "arm/slide")
    np.testing.assert_array_equal(world.at(0.5).objects[still].matrix, world.objects[still].matrix)


def test_cameras_on_links_follow_joint_keyframes(tmp_path: Path) -> None:
    world = raycam.load(write(tmp_path, WORLD + VIDEO))
    base = world.camera("left/wrist")
    for time in (0.0, 0.1, 0.7, 2.0):
        expected = world.robots["left"].pose("slide", {"turn": 1.5 * min(time, 1)})
        moment = world.at(time)
        np.testing.assert_allclose(moment.robots["left"].pose("slide"), expected, atol=1e-14)
        # Other processes have the bytes of the world, without its robots.
        sent = raycam.World.from_bytes(world.to_bytes())
        for camera in (
            moment.camera("left/wrist"),
            world.camera_at(base, time),
            world.camera_at(base.resized((8, 6)), time),
            moment.camera_at(moment.camera("left/wrist"), time),
            sent.camera_at(sent.camera("left/wrist"), time),
        ):
            np.testing.assert_allclose(camera.C, (expected @ [0, 0, 0.4, 1])[:3], atol=1e-14)
            link_from_camera = expected[:3, :3].T @ camera.R.T
            np.testing.assert_allclose(
                link_from_camera, world.robots["left"].pose("slide")[:3, :3].T @ base.R.T, atol=1e-12
            )
    np.testing.assert_array_equal(world.camera("left/wrist").P, base.P)
    exposed = base.exposing(0.2)
    track = world.camera_at(exposed, 0.5).shutter["track"]
    assert len(track) > 2
    world.set_video(fps=10, orbit={"target": [0, 0, 0]})
    np.testing.assert_array_equal(world.at(0.7).robots["left"].values, world.robots["left"].values)


def test_continuous_joints_rotate_along_the_shorter_arc(tmp_path: Path) -> None:
    path = tmp_path / "wheel.urdf"
    path.write_text(
        '<robot name="w"><link name="a"/><link name="b"><visual><geometry><box size="1 1 1"/></geometry></visual>'
        "</link>"
        '<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>',
        encoding="utf-8",
    )
    world = raycam.load(path)
    frames = [{"time": time, "robot": "w", "joints": {"j": value}} for time, value in ((0, 3.0), (1, -3.0))]
    world.set_video(fps=10, keyframe=frames)
    np.testing.assert_allclose(world.at(0.5).objects[0].matrix[:2, :2], np.diag([1, -1]), atol=1e-12)


FAULTS = {
    'file = "arm.urdf"\ncolour = 1': fault("unknown_key", "room.toml", "line 1", "robot[0]", "'colour'"),
    'file = "none.urdf"': fault("file_not_found", "none.urdf"),
    'file = "../arm.urdf"': fault("outside_root", "room.toml", "line 1", "../arm.urdf"),
    "name = 'a'": fault("wrong_type", "room.toml", "line 1", "file"),
    'file = "arm.urdf"\njoints = { trun = 1 }': fault("unknown_name", "room.toml", "line 1", "'turn'"),
    'file = "arm.urdf"\njoints = [1, 2, 3]': fault("wrong_shape", "room.toml", "line 1", "turn, push"),
    'file = "arm.urdf"\npackages = ["none"]': fault("file_not_found", "room.toml", "line 1", "none"),
    'file = "arm.urdf"\n[[robot.camera]]\nlink = "slid"\nsize = [4, 4]\nfov = 60\nlocation = [0, 0, 0]': fault(
        "unknown_name", "room.toml", "'slide'"
    ),
    'file = "arm.urdf"\n[[robot.camera]]\nsize = [4, 4]\nfov = 60': fault("wrong_type", "room.toml", "link"),
    'file = "arm.urdf"\n[[video.keyframe]]\ntime = 0\nrobot = "arn"\njoints = {}': fault(
        "unknown_name", "room.toml", "'arn'"
    ),
    'file = "arm.urdf"\n[[video.keyframe]]\ntime = 0\nrobot = "arm"\nyaw = 3': fault(
        "unknown_key", "room.toml", "'yaw'"
    ),
}


@pytest.mark.parametrize("body", FAULTS)
def test_wrong_tables_raise_with_file_and_line(tmp_path: Path, body: str) -> None:
    path = write(tmp_path, f"[[robot]]\n{body}\n")
    with raises((raycam.Error, FileNotFoundError), **FAULTS[body]):
        raycam.load(path)


def test_mirrored_objects_cannot_have_keyframes(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", encoding="utf-8")
    mirrored = ARM.replace('<sphere radius="0.08"/>', '<mesh filename="a.obj" scale="1 -1 1"/>')
    (tmp_path / "arm.urdf").write_text(mirrored, encoding="utf-8")
    world = raycam.load(tmp_path / "arm.urdf")
    with raises(raycam.WorldError, code="unsupported_feature", mentions=["'arm/upper/2'"]):
        world.set_video(
            keyframe=[{"time": time, "robot": "arm", "joints": {"turn": time}} for time in (0, 1)]
        )
