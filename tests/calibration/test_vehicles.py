"""The calibrations of vehicles' cameras: nuScenes, Argoverse 2 and Waymo."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import raycam
from raycam.errors import FormatError
from scipy.spatial.transform import Rotation
from support.camera_truth import Array, brown, check, four, intrinsics, pose
from support.raises import has_notice, raises

K = intrinsics(1266.4, 1265.5, 816.25, 491.5)


def table(folder: Path, name: str, rows: list[dict[str, Any]]) -> Path:
    """A table of nuScenes."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.json"
    path.write_text(json.dumps(rows))
    return path


def quaternion(R: Array, sign: float = 1.0) -> list[float]:
    """The quaternion w x y z of a rotation, multiplied by `sign` (1 or -1)."""
    x, y, z, w = sign * Rotation.from_matrix(R).as_quat()
    return [w, x, y, z]


def nuscenes(folder: Path) -> list[tuple[Array, Array]]:
    """Writes the tables of two images and a lidar.

    Returns R and C of the cameras in the world.
    """
    mounts, egos = [pose(1), pose(2)], [pose(3), pose(4)]
    place = [{"rotation": quaternion(R.T, -1), "translation": C.tolist()} for R, C in mounts]
    lidar = {"token": "l", "sensor_token": "sl", "camera_intrinsic": [], **place[0]}
    cameras = [
        {"token": f"c{i}", "sensor_token": f"s{i}", "camera_intrinsic": K.tolist(), **where}
        for i, where in enumerate(place)
    ]
    table(folder, "calibrated_sensor", [lidar, *cameras])
    names = {"sl": "LIDAR_TOP", "s0": "CAM_FRONT", "s1": "CAM_BACK"}
    table(folder, "sensor", [{"token": key, "channel": name, "modality": "x"} for key, name in names.items()])
    table(
        folder,
        "ego_pose",
        [
            {"token": f"e{i}", "timestamp": 1, "rotation": quaternion(R.T), "translation": C.tolist()}
            for i, (R, C) in enumerate(egos)
        ],
    )
    seen = [
        ("l", 0, "LIDAR/0.bin", 0, 0),
        ("c0", 0, "CAM_FRONT/0.jpg", 1600, 900),
        ("c1", 1, "CAM_BACK/1.jpg", 1600, 900),
    ]
    table(
        folder,
        "sample_data",
        [
            {
                "token": file,
                "calibrated_sensor_token": sensor,
                "ego_pose_token": f"e{ego}",
                "filename": file,
                "width": width,
                "height": height,
                "timestamp": 1_532_402_927_612_460 + ego,
            }
            for sensor, ego, file, width, height in seen
        ],
    )
    # world_from_camera = world_from_ego ego_from_camera.
    found = [four(E.T, D) @ four(R.T, C) for (R, C), (E, D) in zip(mounts, egos, strict=True)]
    return [(matrix[:3, :3].T, matrix[:3, 3]) for matrix in found]


def test_nuscenes_cameras_are_read(tmp_path: Path) -> None:
    expected = nuscenes(tmp_path)
    for path in (tmp_path, tmp_path / "calibrated_sensor.json"):
        cameras = raycam.load_cameras(path)
        assert list(cameras) == ["CAM_FRONT/0.jpg", "CAM_BACK/1.jpg"]
        for camera, (R, C) in zip(cameras.values(), expected, strict=True):
            check(camera, K, R, C)
            assert camera.size == (1600, 900)
    assert cameras.times["CAM_BACK/1.jpg"] == pytest.approx(1532402927.612461, abs=1e-6)
    (tmp_path / "sample_data.json").unlink()
    (rig,) = raycam.load_cameras(tmp_path, size=(1600, 900)).rigs.values()
    assert list(rig) == ["CAM_FRONT", "CAM_BACK"]
    check(rig["CAM_BACK"], K, *pose(2))


def test_damaged_nuscenes_tables_raise_with_their_name(tmp_path: Path) -> None:
    nuscenes(tmp_path)
    whole = (tmp_path / "ego_pose.json").read_text()
    (tmp_path / "ego_pose.json").write_text(whole.replace('"e1"', '"e7"'))
    with raises(FormatError, code="syntax", mentions=["sample_data.json", "ego_pose_token"]):
        raycam.load_cameras(tmp_path)
    rows = json.loads((tmp_path / "calibrated_sensor.json").read_text())
    rows[1]["rotation"] = [2, 0, 0, 0]
    table(tmp_path, "calibrated_sensor", rows)
    with raises(FormatError, code="syntax", mentions=["calibrated_sensor.json"]):
        raycam.load_cameras(tmp_path)


@pytest.mark.parametrize("ending", ["csv", "json"])
def test_argoverse_cameras_are_read(tmp_path: Path, ending: str) -> None:
    rows, mounts = [], []
    for i, name in enumerate(("ring_front_center", "stereo_front_left")):
        R, C = pose(i)
        K_row = dict(
            zip(("fx_px", "fy_px", "cx_px", "cy_px"), (K[0, 0], K[1, 1], K[0, 2], K[1, 2]), strict=True)
        )
        lens = {"k1": -0.05 * i, "k2": 0.01, "k3": 0.002}
        rows.append({"sensor_name": name, **K_row, **lens, "height_px": 900, "width_px": 1600})
        turn = dict(zip(("qw", "qx", "qy", "qz"), quaternion(R.T), strict=True))
        move = dict(zip(("tx_m", "ty_m", "tz_m"), C.tolist(), strict=True))
        mounts.append({"sensor_name": name, **turn, **move})
    mounts.insert(0, {**mounts[0], "sensor_name": "up_lidar"})
    for name, content in (("intrinsics", rows), ("egovehicle_SE3_sensor", mounts)):
        lines = [",".join(["", *content[0]])]
        lines += [",".join([str(i), *map(str, row.values())]) for i, row in enumerate(content)]
        text = "\r\n".join(lines) + "\r\n" if ending == "csv" else json.dumps(content)
        (tmp_path / f"{name}.{ending}").write_bytes(text.encode())
    cameras = raycam.load_cameras(tmp_path / f"intrinsics.{ending}")
    assert list(cameras) == [row["sensor_name"] for row in rows]
    for i, camera in enumerate(cameras.values()):
        check(camera, K, *pose(i), lambda x, i=i: brown(x, (-0.05 * i, 0.01, 0.002)))
    (tmp_path / f"egovehicle_SE3_sensor.{ending}").write_text(
        "sensor_name,qw\nx,1\n" if ending == "csv" else '[{"sensor_name": "x"}]'
    )
    with raises(FormatError, code="syntax", mentions=["egovehicle_SE3_sensor", "ring_front_center"]):
        raycam.load_cameras(tmp_path / f"intrinsics.{ending}")


@pytest.mark.parametrize("shape", ["context", "top"])
def test_waymo_cameras_are_read(tmp_path: Path, shape: str) -> None:
    R, C = pose(5)
    lens = (-0.3, 0.1, 0.001, -0.002, 0.01)
    key = "cameraCalibrations" if shape == "context" else "camera_calibrations"
    # Waymo's axes are x forward, y left, z up: OpenCV's z, -x and -y.
    vehicle_from_camera = four(np.column_stack([R[2], -R[0], -R[1]]), C)
    row = {
        "name": "FRONT",
        "intrinsic": [K[0, 0], K[1, 1], K[0, 2], K[1, 2], *lens],
        "extrinsic": {"transform": vehicle_from_camera.ravel().tolist()},
        "width": 1920,
        "height": 1280,
        "rollingShutterDirection": "LEFT_TO_RIGHT",
    }
    table: dict[str, Any] = {key: [row]}
    (tmp_path / "a.json").write_text(json.dumps({"context": table} if shape == "context" else table))
    cameras = raycam.load_cameras(tmp_path / "a.json")
    assert has_notice(cameras.notices, "ignored_feature", "rolling shutter", 1)
    points = np.random.default_rng(1).uniform([-1, -1, 2], [1, 1, 5], (20, 3))
    expected = cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, np.array(lens))[0][:, 0]
    np.testing.assert_allclose(cameras["FRONT"].project(points @ R + C)[0], expected, atol=1e-8)
    made = raycam.Camera.from_x_forward(K, vehicle_from_camera, (1920, 1280), distortion=lens)
    np.testing.assert_allclose(made.project(points @ R + C)[0], expected, atol=1e-8)


def test_unsupported_files_of_vehicle_data_sets_are_refused(tmp_path: Path) -> None:
    (tmp_path / "intrinsics.feather").write_bytes(b"ARROW1\0\0" + bytes(64))
    with raises(FormatError, code="unsupported_feature", mentions=["to_csv"]):
        raycam.load_cameras(tmp_path / "intrinsics.feather")
    (tmp_path / "segment.tfrecord").write_bytes(bytes(range(64)))
    with raises(
        FormatError, code="unsupported_feature", mentions=["TFRecord", "camera_calibrations", "JSON"]
    ):
        raycam.load_cameras(tmp_path / "segment.tfrecord")
