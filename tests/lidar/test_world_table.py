"""Lidars of world files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam import _core
from raycam.lidar.settings import SETTING_CHECKS
from raycam.video import VideoPlan
from support.raises import raises, warns

WALL = """
[[object]]
name = "wall"
box = { size = [0.2, 100, 100] }
location = [10.1, 0, 0]
color = [0.5, 0.5, 0.5]
"""
LIDAR = """
[[lidar]]
name = "top"
device = "vlp16"
location = [1, 2, 3]
yaw = 20
pitch = 5
returns = "dual"
noise = false
beam_divergence = 0.003
beam_samples = 7
seed = 5
"""
SCHEMA = json.loads(_core.json_schema())["$defs"]


@pytest.fixture
def load(tmp_path: Path) -> Any:
    def load(text: str) -> raycam.World:
        (tmp_path / "a.toml").write_text(WALL + text, encoding="utf-8")
        return raycam.load(tmp_path / "a.toml")

    return load


def test_schema_contains_the_settings_of_lidars() -> None:
    keys = set(SCHEMA["LidarSpec"]["properties"])
    pose = {"location", "roll", "pitch", "yaw", "target", "up", "R", "C", "t"}
    assert keys == {"name", "device", "calibration", "trajectory", "force_rate", *SETTING_CHECKS, *pose}


def test_lidar_of_a_world_file_equals_the_python_call(load: Any) -> None:
    world = load(LIDAR)
    expected = raycam.Lidar(
        "vlp16", returns="dual", noise=False, beam_divergence=(0.003, 0.003), beam_samples=7, seed=5
    ).placed([1, 2, 3], pitch=5, yaw=20)
    for found in (world, raycam.World.from_bytes(world.to_bytes()), world.copy()):
        lidar = found.sensors["top"]
        assert lidar.settings == expected.settings
        np.testing.assert_allclose(lidar.pose, expected.pose, atol=1e-12)
    points, wanted = raycam.scan(world, "top"), raycam.scan(world, expected)
    np.testing.assert_allclose(points["position"], wanted["position"], atol=1e-9)
    with raises(raycam.LidarError, code="unknown_name", mentions=["tip", "top"]):
        raycam.scan(world, "tip")


def test_lidar_of_a_y_up_world_is_placed_in_its_axes(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text(
        'up = "y"\n[[lidar]]\ndevice = "vlp16"\n'
        '[[lidar]]\nname = "b"\ndevice = "vlp16"\nlocation = [1, 2, 3]\nyaw = 30\n',
        encoding="utf-8",
    )
    sensors = raycam.load(path).sensors
    expected = raycam.Lidar("vlp16", up="y")
    np.testing.assert_allclose(sensors["lidar"].pose, expected.pose, atol=1e-12)
    np.testing.assert_allclose(sensors["b"].pose, expected.placed([1, 2, 3], yaw=30).pose, atol=1e-12)


def test_calibration_is_read_from_the_folder_of_the_world(load: Any, tmp_path: Path) -> None:
    rows = ["time,azimuth,elevation", *(f"{0.01 * i},{i - 2},0" for i in range(5))]
    (tmp_path / "unit.csv").write_text("\n".join(rows), encoding="utf-8")
    world = load('[[lidar]]\ncalibration = "unit.csv"\nnoise = false\n')
    world = raycam.World.from_bytes(world.to_bytes())  # the bytes contain the calibration
    (tmp_path / "unit.csv").unlink()
    angles = np.radians(np.arange(5) - 2)
    np.testing.assert_allclose(raycam.scan(world, "lidar")["distance"], 10 / np.cos(angles), atol=1e-9)
    with raises(FileNotFoundError, mentions=["lidar[0].calibration", "unit.csv"]):
        load('[[lidar]]\ncalibration = "unit.csv"\n')
    with raises(raycam.FormatError, code="outside_root"):
        load('[[lidar]]\ncalibration = "../unit.csv"\n')


@pytest.mark.parametrize(
    ("text", "code", "facts"),
    [
        ('device = "vlp61"', "unknown_name", ["vlp61", "vlp16", "lidar"]),
        ('device = "vlp16"\nrate = 50', "unsupported_rate", ["50", "5 to 20"]),
        ('device = "vlp16"\nbeam_samples = 3', "unknown_name", ["3", "19"]),
        ('device = "vlp16"\nreturns = "duel"', None, ["duel", "dual", "a.toml:9", "lidar[0].returns"]),
        ('device = "vlp16"\nrat = 5', "unknown_key", ["rat", "rate", "a.toml:9"]),
        ("rate = 5", None, ["device", "calibration", "lidar[0]"]),
        ('device = "vlp16"\nname = "a/b"', "invalid_value", ["a/b"]),
        ('device = "vlp16"\nR = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]', None, ["lidar[0]"]),
        ('calibration = "a.toml"', "unknown_format", ["a.toml", ".json"]),
    ],
)
def test_invalid_lidars_are_refused_when_the_world_is_loaded(
    text: str, code: str | None, facts: list[str], load: Any
) -> None:
    with raises(raycam.Error, mentions=["a.toml", *facts], **({} if code is None else {"code": code})):
        load(f"[[lidar]]\n{text}\n")


RIG = """
[[rig]]
name = "car"
location = [0, 0, 1]
[[rig.lidar]]
name = "top"
device = "vlp16"
location = [0.5, 0, 1]
noise = false
[video]
seconds = 1
[[video.keyframe]]
time = 0
rig = "car"
location = [0, 0, 1]
[[video.keyframe]]
time = 1
rig = "car"
location = [4, 0, 1]
"""


def test_lidar_of_a_rig_moves_with_the_video(load: Any) -> None:
    world = load(RIG)
    np.testing.assert_allclose(world.sensors["car/top"].pose[:3, 3], [0.5, 0, 2])
    for time in (0.25, 0.5):
        moment = world.at(time)
        lidar = moment.sensors["car/top"]
        bodies = [world.rig_at(world.rigs["car"], time + later).C for later in (0.0, 0.1)]
        _, places = lidar.track.at(np.array([0.0, 0.1]))
        np.testing.assert_allclose(places, np.array(bodies) + np.array([0.5, 0, 1]), atol=1e-12)
        points = raycam.scan(moment, "car/top")
        wall = points["instance"] == 0
        np.testing.assert_allclose(points.in_world()[wall, 0], 10.0, atol=1e-9)
        plan = VideoPlan(world, raycam.Camera.look_at([0, 0, 5], [10, 0, 0], fov=40, size=(8, 6)), fps=4)
        arrays = plan.sample(round(time * 4))["car/top"]
        np.testing.assert_array_equal(
            arrays["position"][:9], raycam.scan(moment, "car/top", frame=round(time * 4))["position"][:9]
        )


def test_rig_of_a_world_file_carries_its_lidar(load: Any) -> None:
    rig = load(RIG).rigs["car"]
    assert list(rig.sensors) == ["top"]
    again = raycam.Rig.from_dict(json.loads(json.dumps(rig.to_dict())))
    assert again == rig
    with raises(raycam.WorldError, mentions=["rig[0].lidar[0].trajectory"]):
        load(RIG.replace("noise = false", 'trajectory = "a.tum"'))
    with raises(raycam.WorldError, code="duplicate_name", mentions=["top"]):
        load(RIG.replace("[video]", '[[rig.lidar]]\nname = "top"\ndevice = "hdl32e"\n[video]'))


def test_lidar_follows_its_trajectory(load: Any, tmp_path: Path) -> None:
    half = np.sqrt(0.5)
    poses = f"0 0 0 0 0 0 0 1\n1 2 0 0 0 0 {half} {half}\n2 2 4 0 0 0 {half} {half}\n"
    (tmp_path / "body.tum").write_text(poses, encoding="utf-8")
    world = load('[[lidar]]\nname = "top"\ndevice = "vlp16"\ntrajectory = "body.tum"\nlocation = [1, 0, 0]\n')
    lidar = world.at(0.95).sensors["top"]
    turns, places = lidar.track.at(np.array([0.0, 0.05, 0.1]))
    angle = np.radians(90 * 0.95)
    np.testing.assert_allclose(turns[0][:2, 0], [np.cos(angle), np.sin(angle)], atol=1e-9)
    np.testing.assert_allclose(
        places[1], [2, 1, 0], atol=1e-9
    )  # the body is at (2, 0, 0), turned by 90 degrees
    np.testing.assert_allclose(places[2], [2, 1.2, 0], atol=1e-9)
    with warns(raycam.Notice, code="outside_times", mentions=["body.tum"]):
        _ = world.at(1.95).sensors
    np.testing.assert_allclose(world.sensors["top"].pose[:3, 3], [1, 0, 0], atol=1e-12)
    (tmp_path / "body.tum").write_text("1 0 0 0 0 0 0 1\n0 1 0 0 0 0 0 1\n", encoding="utf-8")
    with raises(raycam.LidarError, code="unordered_times", mentions=["body.tum"]):
        load('[[lidar]]\ndevice = "vlp16"\ntrajectory = "body.tum"\n')


def test_data_set_samples_the_sensors_of_the_world(load: Any, tmp_path: Path) -> None:
    world = load(LIDAR + '[[light]]\ntype = "sky"\nradiance = [1, 1, 1]\n')
    camera = raycam.Camera.look_at([0, 0, 5], [10, 0, 0], fov=40, size=(8, 6))
    world.add_camera(camera, "a")
    world.add_camera(camera, "b")
    raycam.dataset.write(world, tmp_path / "out", "kitti", samples=1)
    files = sorted((tmp_path / "out").rglob("*.npz"))
    assert [path.relative_to(tmp_path / "out").as_posix() for path in files] == ["sensors/top/000000.npz"]
    with np.load(files[0]) as arrays:
        np.testing.assert_array_equal(arrays["position"], raycam.scan(world, "top")["position"])
