"""Cameras in separate maps, and the poses next to these maps."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from scipy.spatial.transform import Rotation
from support.raises import has_notice, raises

K = np.array([[500.0, 0, 320], [0, 510, 240], [0, 0, 1]])
CAMERA = {"K": K.tolist(), "img_size": [640, 480]}
POSES = {
    name: (Rotation.from_rotvec(vector).as_matrix(), np.array(t))
    for name, vector, t in [
        ("left", [0.4, -0.7, 0.3], [0.5, -1.0, 2.0]),
        ("right", [-0.2, 0.1, 0.5], [-0.5, 0.25, 1.5]),
        ("top", [1.2, 0.3, -0.4], [0.1, 0.2, 3.0]),
    ]
}
R_AND_T = {name: {"R": r.tolist(), "T": t.tolist()} for name, (r, t) in POSES.items()}
MATRICES = {name: np.block([[r, t[:, None]], [np.eye(4)[3:]]]).tolist() for name, (r, t) in POSES.items()}


def load(folder: Path, content: dict[str, Any], **arguments: Any) -> raycam.Cameras:
    path = folder / "a.json"
    path.write_text(json.dumps(content))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return raycam.load_cameras(path, **arguments)


@pytest.mark.parametrize(
    ("poses", "arguments"),
    [
        ({"extrinsics": R_AND_T}, {}),
        ({"camera_poses": R_AND_T}, {}),
        ({"extrinsics": MATRICES}, {"direction": "camera_from_world"}),
        ({"world_to_camera": MATRICES}, {}),
    ],
)
@pytest.mark.parametrize(
    "cameras", [{"intrinsics": dict.fromkeys(POSES, CAMERA)}, dict.fromkeys(POSES, CAMERA)]
)
def test_poses_in_a_map_with_the_cameras_names_are_assigned(
    tmp_path: Path, cameras: dict[str, Any], poses: dict[str, Any], arguments: dict[str, Any]
) -> None:
    found = load(tmp_path, {**cameras, **poses}, **arguments)
    assert list(found) == list(POSES)
    for name, (r, t) in POSES.items():
        np.testing.assert_allclose(found[name].R, r, atol=1e-12)
        np.testing.assert_allclose(found[name].C, -r.T @ t, atol=1e-12)


@pytest.mark.parametrize(
    "poses",
    [
        {"extrinsics": {"S1": R_AND_T}},
        {"camera_poses": {"left": R_AND_T["left"], "right_to_left": R_AND_T["right"]}},
        {
            "extrinsics": [
                {"rotation": {"qw": 1, "qx": 0, "qy": 0, "qz": 0}, "translation": {"x": 1, "y": 2, "z": 3}}
            ]
        },
        {"extrinsics": [MATRICES["left"], MATRICES["right"]]},
    ],
)
def test_poses_that_belong_to_no_camera_are_refused(tmp_path: Path, poses: dict[str, Any]) -> None:
    with raises(raycam.FormatError, mentions=[next(iter(poses)), "outside the cameras' maps"]):
        load(tmp_path, {"left": CAMERA, "right": CAMERA, **poses})


@pytest.mark.parametrize(
    "key", ["left_to_right", "right_to_left", "T_right_from_left", "left_from_right", "extrinsics"]
)
def test_key_of_the_pose_of_a_pair_states_its_direction(tmp_path: Path, key: str) -> None:
    r, t = POSES["left"]
    camera = load(tmp_path, {"left": CAMERA, "right": CAMERA, key: R_AND_T["left"]})["right"]
    is_inverse = key in ("right_to_left", "left_from_right")
    np.testing.assert_allclose(camera.R, r.T if is_inverse else r, atol=1e-12)
    np.testing.assert_allclose(camera.C, t if is_inverse else -r.T @ t, atol=1e-12)


@pytest.mark.parametrize(
    "sensor", [{"lidar": R_AND_T["left"]}, {"LidarTop": R_AND_T["left"]}, {"imu0": R_AND_T["left"]}]
)
@pytest.mark.parametrize("cameras", [{"left": CAMERA}, {"left": CAMERA, "right": CAMERA}])
def test_pose_of_another_sensor_is_not_the_pose_of_a_camera(
    tmp_path: Path, cameras: dict[str, Any], sensor: dict[str, Any]
) -> None:
    found = load(tmp_path, {**cameras, **sensor})
    for camera in found.values():
        np.testing.assert_array_equal(camera.C, np.zeros(3))
    assert has_notice(found.notices, "ignored_key", next(iter(sensor))), found.notices


def test_pose_of_a_lidar_in_a_list_of_sensors_is_ignored_with_a_notice(tmp_path: Path) -> None:
    sensors = [{"name": "front", **CAMERA}, {"name": "lidar_top", **R_AND_T["left"]}]
    found = load(tmp_path, {"sensors": sensors})
    assert list(found) == ["front"]
    assert has_notice(found.notices, "ignored_key", "sensors1"), found.notices


def test_pose_in_the_map_of_poses_must_agree_with_the_cameras_own_pose(tmp_path: Path) -> None:
    with raises(raycam.FormatError, mentions=["left", "another pose"]):
        load(tmp_path, {"left": {**CAMERA, **R_AND_T["top"]}, "extrinsics": {"left": R_AND_T["left"]}})


@pytest.mark.parametrize(
    "names", [("left", "right"), ("left_camera", "right_camera"), ("camLeft", "camRight")]
)
@pytest.mark.parametrize(
    "key", ["right_to_left", "right2left", "left_from_right", "right_camera_to_left_camera"]
)
def test_pose_from_the_second_to_the_first_camera_is_inverted(
    tmp_path: Path, names: tuple[str, str], key: str
) -> None:
    first, second = names
    pose = {"R": np.eye(3).tolist(), "T": [0.1, 0, 0]}
    assert load(tmp_path, {first: CAMERA, second: CAMERA, key: pose})[second].C[0] == pytest.approx(0.1)


def test_camera_without_a_pose_in_the_map_of_poses_gets_a_notice(tmp_path: Path) -> None:
    content = {
        **dict.fromkeys(POSES, CAMERA),
        "extrinsics": {name: R_AND_T[name] for name in ("right", "top")},
    }
    path = tmp_path / "cameras.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.warns(raycam.Notice, match="left: no pose in the map of poses"):
        raycam.load_cameras(path)
