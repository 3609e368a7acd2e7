"""Lists of poses in JSON and YAML without K: quaternions, R and t, and matrices whose key states the direction."""

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

R = Rotation.from_rotvec([0.4, -0.7, 0.3])
C = np.array([1.5, -2.0, 0.75])
TURN = R.as_matrix()
CAMERA = raycam.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]], np.eye(3), [0, 0, 0], (640, 480))
WORLD_FROM_CAMERA = np.block([[R.as_matrix(), C[:, None]], [np.eye(4)[3:]]])
XYZW = R.as_quat().tolist()
POSITION = dict(zip("xyz", C.tolist(), strict=True))
ORIENTATION = dict(zip("xyzw", XYZW, strict=True))


def read(folder: Path, content: Any, **arguments: Any) -> raycam.Cameras:
    (folder / "a.json").write_text(json.dumps(content))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return raycam.load_cameras(folder / "a.json", intrinsics=CAMERA, **arguments)


def check(cameras: raycam.Cameras, world_from_camera: Any = TURN, center: Any = C) -> None:
    for camera in cameras.values():
        np.testing.assert_allclose(camera.R, np.asarray(world_from_camera).T, atol=1e-9)
        np.testing.assert_allclose(camera.C, center, atol=1e-9)
    assert not has_notice(cameras.notices, "ignored_key"), cameras.notices


@pytest.mark.parametrize(
    "pose",
    [
        {"position": C.tolist(), "orientation_xyzw": XYZW},
        {"position": POSITION, "orientation": ORIENTATION},
        {"translation": C.tolist(), "quaternion_wxyz": [XYZW[3], *XYZW[:3]]},
        {"transform": {"translation": POSITION, "rotation": ORIENTATION}},
        dict(zip(["tx", "ty", "tz", "qx", "qy", "qz", "qw"], [*C, *XYZW], strict=True)),
    ],
)
def test_quaternions_and_positions_are_poses(tmp_path: Path, pose: dict[str, Any]) -> None:
    named = read(tmp_path, [{"name": "a", **pose}, {"name": "b", **pose}])
    assert list(named) == ["a", "b"]
    assert has_notice(named.notices, "assumed_convention", "world_from_camera")
    check(named)
    check(read(tmp_path, {"poses": [{"timestamp": 1.5, **pose}, {"timestamp": 2.5, **pose}]}))
    check(read(tmp_path, {"img1": pose, "img2": pose}))
    check(read(tmp_path, pose))


def test_position_is_the_center_and_translation_is_not(tmp_path: Path) -> None:
    inverse, turned = R.inv(), {"direction": "camera_from_world"}
    check(read(tmp_path, [{"position": C.tolist(), "q_xyzw": XYZW}], **turned), inverse.as_matrix())
    moved = read(tmp_path, [{"translation": C.tolist(), "q_xyzw": XYZW}], **turned)
    check(moved, inverse.as_matrix(), -inverse.apply(C))


@pytest.mark.parametrize("key", ["w2c", "world_to_camera", "extrinsic"])
def test_key_of_each_item_states_the_direction(tmp_path: Path, key: str) -> None:
    matrix = np.linalg.inv(WORLD_FROM_CAMERA).tolist()
    check(read(tmp_path, {"frames": [{"id": 1, key: matrix}, {"id": 2, key: matrix}]}))
    check(read(tmp_path, [{"name": "a", key: matrix}]))


def test_different_keys_of_the_items_are_refused(tmp_path: Path) -> None:
    items = [{"w2c": np.eye(4).tolist()}, {"c2w": np.eye(4).tolist()}]
    with raises(raycam.FormatError, mentions=["w2c", "c2w"]):
        read(tmp_path, items)


def test_r_and_t_are_camera_from_world(tmp_path: Path) -> None:
    w2c = np.linalg.inv(WORLD_FROM_CAMERA)
    pose = {"R": w2c[:3, :3].tolist(), "t": w2c[:3, 3].tolist()}
    check(read(tmp_path, [{"image": "a.png", **pose}, {"image": "b.png", **pose}]))


def test_axes_alone_keep_the_direction_of_the_key(tmp_path: Path) -> None:
    w2c = np.diag([1.0, -1, -1, 1]) @ np.linalg.inv(WORLD_FROM_CAMERA)
    check(read(tmp_path, {"w2c": [w2c.tolist()] * 2}, axes="opengl"))
