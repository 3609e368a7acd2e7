"""Rigs with lidars but without cameras: data sets, world files and the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import raycam
from dataset.test_semantickitti import FORWARD, drive, matrices, street
from mcap.reader import make_reader
from raycam.cli import main
from raycam.dataset import FORMATS, write
from raycam.dataset.job_units import read_record, record_name

LIDAR_FORMATS = ["semantickitti", "nuscenes", "mcap"]


def body() -> raycam.Rig:
    return raycam.Rig({"top": raycam.Lidar("vlp16", noise=False, min_range=0).placed([0, 0, 1.8], yaw=5)})


def lidar_drive() -> tuple[list[raycam.Rig], list[float]]:
    """The poses of `drive`, for a rig that has only its lidar."""
    rigs, times = drive()
    return [body().at_pose(rig.R, rig.C) for rig in rigs], times


def test_rig_without_cameras_moves_and_restores() -> None:
    rig = body()
    moved = rig.moving(rig.placed([1, 0, 0]), exposure=0.1)
    assert moved.shutter is not None
    np.testing.assert_allclose(moved.still().C, [0.5, 0, 0])
    assert list(moved.still().sensors) == ["top"]
    assert raycam.Rig.from_dict(moved.to_dict()) == moved
    assert "top: at [0.  0.  1.8]" in repr(rig)


def test_image_of_a_rig_without_cameras_is_refused() -> None:
    with pytest.raises(raycam.CameraError) as caught:
        body().render(street())
    assert caught.value.code == "missing_camera"
    with pytest.raises(raycam.CameraError) as caught:
        body().baseline()
    assert caught.value.code == "missing_value"
    with pytest.raises(raycam.CameraError) as caught:
        raycam.Rig.of({"top": raycam.Lidar("vlp16")})  # type: ignore[dict-item]
    assert caught.value.code == "wrong_type"


@pytest.mark.parametrize("format", [name for name in FORMATS if name not in LIDAR_FORMATS])
def test_format_of_images_requires_a_camera(format: str, tmp_path: Path) -> None:
    rigs, times = lidar_drive()
    with pytest.raises(raycam.SettingsError) as caught:
        write(street(), tmp_path, format, cameras=rigs, times=times)
    assert caught.value.code == "missing_camera"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("format", LIDAR_FORMATS)
def test_workers_write_the_same_files_without_cameras(format: str, tmp_path: Path) -> None:
    rigs, times = lidar_drive()
    write(street(), tmp_path / "a", format, cameras=rigs, times=times)
    write(street(), tmp_path / "b", format, cameras=rigs, times=times, workers=2)
    files = [path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*") if path.is_file()]
    compared = [path for path in files if ".raycam" not in path.parts[0]]
    assert compared
    for path in compared:
        assert (tmp_path / "a" / path).read_bytes() == (tmp_path / "b" / path).read_bytes()


def test_semantickitti_uses_the_lidar_as_camera_0(tmp_path: Path) -> None:
    rigs, times = lidar_drive()
    world = street()
    write(world, tmp_path, "semantickitti", cameras=rigs, times=times, labels={"car": 10, "road": 40})
    base = tmp_path / "sequences" / "00"
    rows = dict(line.split(": ") for line in (base / "calib.txt").read_text().splitlines())
    assert not (base / "image_2").exists()
    tr = np.eye(4)
    tr[:3] = np.array(rows["Tr"].split(), float).reshape(3, 4)
    np.testing.assert_allclose(tr[:3], np.column_stack([FORWARD, [0, 0, 0]]), atol=1e-12)
    np.testing.assert_array_equal(np.array(rows["P0"].split(), float).reshape(3, 4), np.eye(3, 4))
    lidar = rigs[0].sensors["top"].pose
    poses = matrices(base / "poses.txt")
    np.testing.assert_allclose(poses[0], np.eye(4), atol=1e-12)
    for number in range(3):
        points = np.fromfile(base / "velodyne" / f"{number:06d}.bin", np.float32).reshape(-1, 4)
        label = np.fromfile(base / "labels" / f"{number:06d}.label", np.uint32)
        world_from_points = lidar @ np.linalg.inv(tr) @ poses[number] @ tr
        at = points[:, :3] @ world_from_points[:3, :3].T + world_from_points[:3, 3]
        car = label & 0xFFFF == 10
        assert car.sum() > 20
        assert world.closest_points(at[car], objects=["car"])["distance"].max() < 1e-4


def test_nuscenes_boxes_without_cameras_have_no_visibility(tmp_path: Path) -> None:
    rigs, times = lidar_drive()
    write(street(), tmp_path, "nuscenes", cameras=rigs, times=times)
    tables = {path.stem: json.loads(path.read_text()) for path in (tmp_path / "v1.0-mini").iterdir()}
    assert [row["modality"] for row in tables["sensor"]] == ["lidar"]
    assert len(tables["sample"]) == len(tables["sample_data"]) == 3
    assert tables["sample_annotation"]
    assert {row["visibility_token"] for row in tables["sample_annotation"]} == {""}
    assert min(row["num_lidar_pts"] for row in tables["sample_annotation"]) > 0


def test_bag_without_cameras_contains_points_and_frames(tmp_path: Path) -> None:
    rigs, times = lidar_drive()
    write(street(), tmp_path, "mcap", cameras=rigs, times=times)
    with (tmp_path / "raycam.mcap").open("rb") as stream:
        topics = [channel.topic for _, channel, _ in make_reader(stream).iter_messages()]
    assert {topic: topics.count(topic) for topic in topics} == {
        "/instances": 1,
        "/tf": 3,
        "/tf_static": 1,
        "/top/points": 3,
    }
    assert not (tmp_path / "images").exists()
    assert read_record(tmp_path / record_name(0))["stamp"] == 1_000_000_000


def test_command_line_writes_a_rig_without_cameras(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    plane = '[[object]]\nplane = { size = [80, 80] }\nname = "road"\n'
    rig = '[[rig]]\nname = "car"\n[[rig.lidar]]\nname = "top"\ndevice = "vlp16"\nlocation = [0, 0, 1.8]\n'
    Path("road.toml").write_text(plane)
    Path("car.toml").write_text(plane + rig)
    Path("body.tum").write_text("0 0 0 0 0 0 0 1\n0.1 1 0 0 0 0 0 1\n")
    shared = ["--poses", "body.tum", "--format", "semantickitti"]
    assert main(["dataset", "car.toml", "-o", "a", "--rig", "car", *shared]) == 0
    assert main(["dataset", "road.toml", "-o", "b", "--lidar", "top=vlp16@0,0,1.8", *shared]) == 0
    for number in (0, 1):
        scan = Path("sequences") / "00" / "velodyne" / f"{number:06d}.bin"
        assert (Path("a") / scan).read_bytes() == (Path("b") / scan).read_bytes() != b""
    capsys.readouterr()
    for command in (["render", "car.toml", "-o", "x.png"], ["video", "car.toml", "-o", "x.mp4"]):
        assert main([*command, "--rig", "car"]) == 2
        assert "has no camera" in capsys.readouterr().err
    assert main(["dataset", "road.toml", "-o", "c", "--poses", "body.tum"]) == 2
    assert main(["dataset", "road.toml", "-o", "c", "--lidar", "top=vlp16@0,0,1.8"]) == 2
